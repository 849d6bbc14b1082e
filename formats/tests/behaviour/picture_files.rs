//! Files in every flavour of every picture format, written field by field.

use std::io::{Cursor, Write};

use btfkit_formats::picture::{Picture, exr::Compression};
use btfkit_formats::{Samples, f16};
use exr::prelude as openexr;
use exr::prelude::WritableImage;

use crate::support::{crc32, jpeg_of, options};

fn zlib(data: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(data).unwrap();
    encoder.finish().unwrap()
}

/// Values that fill their range.
fn pattern(number: usize) -> u32 {
    (number as u32).wrapping_mul(2_654_435_761) >> 8
}

// --- PNG -------------------------------------------------------------------------------------------------------

pub(crate) fn png_chunk(name: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let named = [name.as_slice(), data].concat();
    let mut out = (data.len() as u32).to_be_bytes().to_vec();
    out.extend(&named);
    out.extend(crc32(&named).to_be_bytes());
    out
}

pub(crate) fn png_ihdr(width: u32, height: u32, depth: u8, colour: u8, interlaced: bool) -> Vec<u8> {
    let mut data = width.to_be_bytes().to_vec();
    data.extend(height.to_be_bytes());
    data.extend([depth, colour, 0, 0, u8::from(interlaced)]);
    png_chunk(b"IHDR", &data)
}

pub(crate) fn png_of(chunks: &[Vec<u8>]) -> Vec<u8> {
    [b"\x89PNG\r\n\x1A\n".to_vec(), chunks.concat(), png_chunk(b"IEND", b"")].concat()
}

/// A PNG whose samples are given in whole units of `depth` bits; `before` stands between IHDR and the data.
pub(crate) struct Png {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) depth: usize,
    pub(crate) colour: u8,
    pub(crate) interlaced: bool,
    pub(crate) samples: Vec<u16>,
    pub(crate) before: Vec<u8>,
}

impl Png {
    pub(crate) fn new(width: usize, height: usize, depth: usize, colour: u8, interlaced: bool) -> Png {
        let channels = [1, 0, 3, 1, 2, 0, 4][usize::from(colour)];
        let alpha = matches!(colour, 4 | 6);
        let most = (1u32 << depth) - 1;
        let samples = (0..width * height * channels).map(|n| {
            if alpha && n % channels == channels - 1 { most as u16 } else { (pattern(n) & most) as u16 }
        });
        let (samples, before) = (samples.collect(), Vec::new());
        Png { width, height, depth, colour, interlaced, samples, before }
    }

    fn channels(&self) -> usize {
        self.samples.len() / (self.width * self.height)
    }

    /// Rows of one pass, filtered by nothing and by the row above in turn.
    fn pass(&self, (x0, y0, dx, dy): (usize, usize, usize, usize)) -> Vec<u8> {
        let mut out = Vec::new();
        let mut above = vec![0u8; self.width * self.channels() * 2];
        for (number, y) in (y0..self.height).step_by(dy).enumerate() {
            let mut bits = Vec::new();
            for x in (x0..self.width).step_by(dx) {
                for c in 0..self.channels() {
                    let sample = self.samples[(y * self.width + x) * self.channels() + c];
                    bits.extend((0..self.depth).rev().map(|bit| (sample >> bit & 1) as u8));
                }
            }
            if bits.is_empty() {
                continue;
            }
            let byte = |bits: &[u8]| bits.iter().enumerate().fold(0, |sum, (i, bit)| sum | bit << (7 - i));
            let row: Vec<u8> = bits.chunks(8).map(byte).collect();
            out.push(if number % 2 == 0 { 0 } else { 2 });
            out.extend(
                row.iter().zip(&above).map(|(b, a)| if number % 2 == 0 { *b } else { b.wrapping_sub(*a) }),
            );
            above[..row.len()].copy_from_slice(&row);
        }
        out
    }

    pub(crate) fn filtered(&self) -> Vec<u8> {
        if !self.interlaced {
            return self.pass((0, 0, 1, 1));
        }
        let passes = [
            (0, 0, 8, 8),
            (4, 0, 8, 8),
            (0, 4, 4, 8),
            (2, 0, 4, 4),
            (0, 2, 2, 4),
            (1, 0, 2, 2),
            (0, 1, 1, 2),
        ];
        passes.iter().flat_map(|&pass| self.pass(pass)).collect()
    }

    pub(crate) fn bytes_with_data(&self, compressed: &[u8]) -> Vec<u8> {
        let ihdr =
            png_ihdr(self.width as u32, self.height as u32, self.depth as u8, self.colour, self.interlaced);
        let (first, second) = compressed.split_at(compressed.len() / 2);
        png_of(&[ihdr, self.before.clone(), png_chunk(b"IDAT", first), png_chunk(b"IDAT", second)])
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        self.bytes_with_data(&zlib(&self.filtered()))
    }
}

// --- TIFF ------------------------------------------------------------------------------------------------------

/// A TIFF with its directory first; all values are written with 4 bytes (8 in BigTIFF).
#[derive(Clone)]
pub(crate) struct Tiff {
    pub(crate) little_endian: bool,
    pub(crate) big: bool,
    /// Tag and values; offsets of strips or tiles are filled in.
    pub(crate) tags: Vec<(u16, Vec<u64>)>,
    pub(crate) chunks: Vec<Vec<u8>>,
    pub(crate) next: u64,
}

impl Tiff {
    /// `sample` encodes one value of [`pattern`] in the file's byte order.
    pub(crate) fn new(size: (usize, usize, usize), bits: u64, format: u64, rows_per_strip: usize) -> Tiff {
        let (width, height, channels) = size;
        let photometric = if channels == 3 { 2 } else { 1 };
        let mut tags = vec![
            (256, vec![width as u64]),
            (257, vec![height as u64]),
            (258, vec![bits; channels]),
            (259, vec![1]),
            (262, vec![photometric]),
            (277, vec![channels as u64]),
            (278, vec![rows_per_strip as u64]),
            (339, vec![format; channels]),
        ];
        if channels > 3 {
            tags.push((338, vec![0; channels - 1]));
        }
        Tiff { little_endian: true, big: false, tags, chunks: Vec::new(), next: 0 }
    }

    pub(crate) fn set(&mut self, tag: u16, values: &[u64]) -> &mut Tiff {
        self.tags.retain(|(other, _)| *other != tag);
        self.tags.push((tag, values.to_vec()));
        self.tags.sort();
        self
    }

    pub(crate) fn uint(&self, value: u64, len: usize) -> Vec<u8> {
        let bytes = value.to_le_bytes();
        let bytes = bytes[..len].iter().copied();
        if self.little_endian { bytes.collect() } else { bytes.rev().collect() }
    }

    /// Cuts samples (`[y, x, channel]`, already encoded) into strips, planes apart if wanted.
    pub(crate) fn with_strips(mut self, samples: &[Vec<u8>], rows_per_strip: usize, planar: bool) -> Tiff {
        let get =
            |tag: u16, tags: &[(u16, Vec<u64>)]| tags.iter().find(|t| t.0 == tag).unwrap().1[0] as usize;
        let (width, channels) = (get(256, &self.tags), get(277, &self.tags));
        if planar {
            self.set(284, &[2]);
            for c in 0..channels {
                let plane: Vec<_> = samples.iter().skip(c).step_by(channels).cloned().collect();
                self.chunks.extend(plane.chunks(width * rows_per_strip).map(<[_]>::concat));
            }
        } else {
            self.chunks.extend(samples.chunks(width * channels * rows_per_strip).map(<[_]>::concat));
        }
        self
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let word = if self.big { 8 } else { 4 };
        let tiled = self.tags.iter().any(|(tag, _)| *tag == 322);
        let (offsets_tag, lens_tag) = if tiled { (324, 325) } else { (273, 279) };
        let mut tags = self.tags.clone();
        if !tags.iter().any(|(tag, _)| *tag == lens_tag) {
            tags.push((lens_tag, self.chunks.iter().map(|chunk| chunk.len() as u64).collect()));
        }
        let offsets_given = tags.iter().any(|(tag, _)| *tag == offsets_tag);
        if !offsets_given {
            tags.push((offsets_tag, vec![0; self.chunks.len()]));
        }
        tags.sort();
        let start = if self.big { 16 } else { 8 };
        let count_len = if self.big { 8 } else { 2 };
        // What a channel beyond the colours means must be of the short type.
        let value_len = |tag: u16| if tag == 338 { 2 } else { word };
        let outside = |tag: u16, list: &[u64]| {
            if list.len() * value_len(tag) > word { list.len() * value_len(tag) } else { 0 }
        };
        let mut values_at = start + count_len + tags.len() * (4 + 2 * word) + word;
        let data_at = values_at + tags.iter().map(|(tag, list)| outside(*tag, list)).sum::<usize>();
        if !offsets_given {
            let mut at = data_at as u64;
            for (number, chunk) in self.chunks.iter().enumerate() {
                tags.iter_mut().find(|(tag, _)| *tag == offsets_tag).unwrap().1[number] = at;
                at += chunk.len() as u64;
            }
        }
        let mut out = if self.little_endian { b"II".to_vec() } else { b"MM".to_vec() };
        out.extend(self.uint(if self.big { 43 } else { 42 }, 2));
        if self.big {
            out.extend(self.uint(8, 2));
            out.extend(self.uint(0, 2));
        }
        out.extend(self.uint(start as u64, word));
        out.extend(self.uint(tags.len() as u64, count_len));
        let mut values = Vec::new();
        for (tag, list) in &tags {
            out.extend(self.uint(u64::from(*tag), 2));
            let kind = [3, 4, 16][[2, 4, 8].iter().position(|&len| len == value_len(*tag)).unwrap()];
            out.extend(self.uint(kind, 2));
            out.extend(self.uint(list.len() as u64, word));
            let mut encoded: Vec<u8> =
                list.iter().flat_map(|value| self.uint(*value, value_len(*tag))).collect();
            if encoded.len() <= word {
                encoded.resize(word, 0);
                out.extend(encoded);
            } else {
                out.extend(self.uint(values_at as u64, word));
                values_at += encoded.len();
                values.extend(encoded);
            }
        }
        out.extend(self.uint(self.next, word));
        out.extend(values);
        out.extend(self.chunks.concat());
        out
    }
}

/// Samples of [`pattern`], encoded; halves and floats are whole numbers.
pub(crate) fn tiff_samples(tiff: &Tiff, count: usize, kind: &str) -> Vec<Vec<u8>> {
    let encode = |n| match kind {
        "u8" => tiff.uint(u64::from(pattern(n)), 1),
        "u16" => tiff.uint(u64::from(pattern(n)), 2),
        "f16" => tiff.uint(u64::from(f16::from_f32((pattern(n) & 1023) as f32).to_bits()), 2),
        _ => tiff.uint(u64::from(((pattern(n) & 0xFFFF) as f32 / 8.0).to_bits()), 4),
    };
    (0..count).map(encode).collect()
}

/// What [`tiff_samples`] are once decoded.
pub(crate) fn pattern_samples(count: usize, kind: &str) -> Samples {
    match kind {
        "u8" => Samples::U8((0..count).map(|n| pattern(n) as u8).collect()),
        "u16" => Samples::U16((0..count).map(|n| pattern(n) as u16).collect()),
        "f16" => Samples::F16((0..count).map(|n| f16::from_f32((pattern(n) & 1023) as f32)).collect()),
        _ => Samples::F32((0..count).map(|n| (pattern(n) & 0xFFFF) as f32 / 8.0).collect()),
    }
}

/// By the encoder of the crate `tiff`.
pub(crate) fn tiff_by_crate(
    compression: tiff::encoder::Compression,
    predictor: tiff::tags::Predictor,
) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let samples: Vec<u16> = (0..9 * 7 * 3).map(|n| (pattern(n) & 0xF00F) as u16).collect();
    let encoder = tiff::encoder::TiffEncoder::new(&mut out).unwrap();
    let mut encoder = encoder.with_compression(compression).with_predictor(predictor);
    encoder.write_image::<tiff::encoder::colortype::RGB16>(9, 7, &samples).unwrap();
    out.into_inner()
}

// --- Radiance --------------------------------------------------------------------------------------------------

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HdrCoding {
    Flat,
    OldRuns,
    Components,
}

/// Pixels with runs in them, none of which looks like a run in the old coding.
pub(crate) fn rgbe(count: usize) -> Vec<[u8; 4]> {
    let pixel = |n: usize| {
        let n = n / 3;
        [(7 + n * 5) as u8, (250 - n % 200) as u8, 128 + (n % 100) as u8, 120 + (n % 20) as u8]
    };
    (0..count).map(pixel).collect()
}

fn components(line: &[[u8; 4]], out: &mut Vec<u8>) {
    out.extend([2, 2, (line.len() >> 8) as u8, line.len() as u8]);
    for c in 0..4 {
        let values: Vec<u8> = line.iter().map(|pixel| pixel[c]).collect();
        let mut rest = values.as_slice();
        while let Some(&first) = rest.first() {
            let run = rest.iter().take(127).take_while(|&&value| value == first).count();
            if run > 2 {
                out.extend([128 + run as u8, first]);
                rest = &rest[run..];
            } else {
                let len = rest.len().min(2);
                out.push(len as u8);
                out.extend(&rest[..len]);
                rest = &rest[len..];
            }
        }
    }
}

fn old_runs(line: &[[u8; 4]], out: &mut Vec<u8>) {
    let mut rest = line;
    while let Some(&first) = rest.first() {
        let run = rest.iter().take_while(|&&pixel| pixel == first).count();
        out.extend(first);
        let mut more = run - 1;
        while more > 0 {
            out.extend([1, 1, 1, (more & 255) as u8]);
            more >>= 8;
        }
        rest = &rest[run..];
    }
}

/// `resolution` is the line that says so; scan lines of `len` pixels.
pub(crate) fn hdr_of(
    lines: &str,
    resolution: &str,
    pixels: &[[u8; 4]],
    len: usize,
    coding: HdrCoding,
) -> Vec<u8> {
    let mut out = format!("#?RADIANCE\n{lines}\n{resolution}\n").into_bytes();
    for line in pixels.chunks(len) {
        match coding {
            HdrCoding::Flat => out.extend(line.concat()),
            HdrCoding::OldRuns => old_runs(line, &mut out),
            HdrCoding::Components => components(line, &mut out),
        }
    }
    out
}

pub(crate) const RGBE: &str = "FORMAT=32-bit_rle_rgbe\n";

// --- OpenEXR ---------------------------------------------------------------------------------------------------

pub(crate) fn exr_picture(width: u32, height: u32, names: &[&str], half: bool) -> Picture {
    let count = width as usize * height as usize * names.len();
    let smooth =
        (0..count).map(|n| 0.25 + ((n / names.len()) as f32 * 0.05).sin() * 0.2 + (n % names.len()) as f32);
    Picture {
        width,
        height,
        channels: names.iter().map(|&name| name.to_owned()).collect(),
        samples: if half {
            Samples::F16(smooth.map(f16::from_f32).collect())
        } else {
            Samples::F32(smooth.collect())
        },
    }
}

/// By the writer of the crate `exr`: any compression, in scan lines or in tiles.
pub(crate) fn exr_by_crate(
    picture: &Picture,
    method: openexr::Compression,
    tile: Option<(usize, usize)>,
) -> Vec<u8> {
    let blocks =
        tile.map_or(openexr::Blocks::ScanLines, |(w, h)| openexr::Blocks::Tiles(openexr::Vec2(w, h)));
    exr_layer(picture, method, blocks, openexr::LineOrder::Increasing)
}

pub(crate) fn exr_layer(
    picture: &Picture,
    compression: openexr::Compression,
    blocks: openexr::Blocks,
    line_order: openexr::LineOrder,
) -> Vec<u8> {
    let count = picture.channels.len();
    let channels = picture.channels.iter().enumerate().map(|(number, name)| {
        let samples = match &picture.samples {
            Samples::F16(list) => {
                openexr::FlatSamples::F16(list.iter().skip(number).step_by(count).copied().collect())
            }
            other => {
                openexr::FlatSamples::F32(other.to_f32().into_iter().skip(number).step_by(count).collect())
            }
        };
        openexr::AnyChannel::new(name.as_str(), samples)
    });
    let encoding = openexr::Encoding { compression, blocks, line_order };
    let layer = openexr::Layer::new(
        (picture.width as usize, picture.height as usize),
        openexr::LayerAttributes::default(),
        encoding,
        openexr::AnyChannels::sort(channels.collect()),
    );
    let mut out = Cursor::new(Vec::new());
    openexr::Image::from_layer(layer).write().non_parallel().to_buffered(&mut out).unwrap();
    out.into_inner()
}

/// A picture of 2 x 1 pixels with these chromaticities (red, green, blue, white) and this display window's width.
pub(crate) fn exr_with_attributes(
    names: [&str; 3],
    chromaticities: Option<[f32; 8]>,
    shown: Option<usize>,
) -> Vec<u8> {
    let channels =
        names.map(|name| openexr::AnyChannel::new(name, openexr::FlatSamples::F32(vec![0.5, 0.25])));
    let layer = openexr::Layer::new(
        (2, 1),
        openexr::LayerAttributes::default(),
        openexr::Encoding::FAST_LOSSLESS,
        openexr::AnyChannels::sort(channels.into_iter().collect()),
    );
    let mut image = openexr::Image::from_layer(layer);
    let pair = |x, y| openexr::Vec2(x, y);
    image.attributes.chromaticities =
        chromaticities.map(|[a, b, c, d, e, f, g, h]| exr::meta::attribute::Chromaticities {
            red: pair(a, b),
            green: pair(c, d),
            blue: pair(e, f),
            white: pair(g, h),
        });
    if let Some(width) = shown {
        image.attributes.display_window.size.0 = width;
    }
    let mut out = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut out).unwrap();
    out.into_inner()
}

pub(crate) fn exr_methods() -> Vec<openexr::Compression> {
    use openexr::Compression::{B44, B44A, DWAA, DWAB, PIZ, PXR24, RLE, Uncompressed, ZIP1, ZIP16};
    vec![Uncompressed, RLE, ZIP1, ZIP16, PIZ, PXR24, B44, B44A, DWAA(None), DWAB(None)]
}

// --- all -------------------------------------------------------------------------------------------------------

/// Small files of every flavour, by name.
pub(crate) fn all() -> Vec<(String, Vec<u8>)> {
    let mut files = pngs();
    files.extend(tiffs());
    for (coding, resolution) in [
        (HdrCoding::Flat, "-Y 3 +X 11"),
        (HdrCoding::OldRuns, "-Y 3 +X 11"),
        (HdrCoding::Components, "-Y 3 +X 11"),
        (HdrCoding::Components, "+X 3 -Y 11"),
    ] {
        let lines = format!("# by hand\nEXPOSURE=2\n{RGBE}");
        files.push((format!("hdr {coding:?}"), hdr_of(&lines, resolution, &rgbe(33), 11, coding)));
    }
    files.extend(exrs());
    files
        .push(("jpeg".to_owned(), jpeg_of(16, 9, 3, &options(60, true, btfkit_formats::jpeg::Chroma::Full))));
    files
}

pub(crate) fn pngs() -> Vec<(String, Vec<u8>)> {
    let kinds = [(0, 1), (0, 4), (0, 8), (0, 16), (2, 8), (2, 16), (3, 2), (3, 8), (4, 8), (6, 16)];
    let flavours = kinds.iter().flat_map(|&(colour, depth)| [(colour, depth, false), (colour, depth, true)]);
    let of = |(colour, depth, interlaced): (u8, usize, bool)| {
        let mut png = Png::new(5, 3, depth, colour, interlaced);
        if colour == 3 {
            let palette: Vec<u8> = (0..3 << depth).map(|n| pattern(n) as u8).collect();
            png.before = png_chunk(b"PLTE", &palette);
        }
        (format!("png colour {colour}, {depth} bits, interlaced {interlaced}"), png.bytes())
    };
    flavours.map(of).collect()
}

pub(crate) fn tiffs() -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    for (kind, bits, format) in [("u8", 8, 1), ("u16", 16, 1), ("f16", 16, 3), ("f32", 32, 3)] {
        for (channels, planar, little_endian, big) in [
            (1, false, true, false),
            (3, false, false, false),
            (3, true, true, true),
            (5, false, false, true),
        ] {
            let mut tiff = Tiff::new((4, 5, channels), bits, format, 2);
            tiff.little_endian = little_endian;
            tiff.big = big;
            let samples = tiff_samples(&tiff, 4 * 5 * channels, kind);
            let name =
                format!("tiff {kind} x {channels}, planar {planar}, little {little_endian}, big {big}");
            files.push((name, tiff.with_strips(&samples, 2, planar).bytes()));
        }
    }
    for (name, compression) in [
        ("lzw", tiff::encoder::Compression::Lzw),
        ("deflate", tiff::encoder::Compression::Deflate(tiff::encoder::DeflateLevel::Best)),
        ("packbits", tiff::encoder::Compression::Packbits),
    ] {
        files.push((format!("tiff {name}"), tiff_by_crate(compression, tiff::tags::Predictor::None)));
        if name != "packbits" {
            let predicted = tiff_by_crate(compression, tiff::tags::Predictor::Horizontal);
            files.push((format!("tiff {name} of differences"), predicted));
        }
    }
    files
}

pub(crate) fn exrs() -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    for method in exr_methods() {
        for (half, tile) in [(true, None), (false, Some((8, 4)))] {
            let picture = exr_picture(13, 9, &["B", "G", "R"], half);
            let name = format!("exr {method:?}, half {half}, tile {tile:?}");
            files.push((name, exr_by_crate(&picture, method, tile)));
        }
    }
    for compression in [Compression::None, Compression::Zip] {
        let picture = exr_picture(6, 5, &["450nm", "550nm", "650nm", "750nm"], true);
        let bytes = btfkit_formats::picture::exr::encode(&picture, compression).unwrap();
        files.push((format!("exr of our own, {compression:?}"), bytes));
    }
    files
}
