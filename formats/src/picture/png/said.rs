//! What the chunks beside a PNG's pixels say of turning and of colours (PNG 3, 11.3; the raw profiles of ImageMagick).

use std::io::Read;

use flate2::read::ZlibDecoder;

use super::SIGNATURE;
use crate::picture::{aspect, exif, orientation, profile, unapplied};
use crate::reader::Reader;

/// Longest profile or text that is inflated, bytes.
const MOST_BYTES: u64 = 1 << 20;

/// What gAMA holds for sRGB (PNG 3, table 15), times 100000.
const SRGB_GAMMA: u32 = 45_455;

/// Differences that come from rounding.
const ROUNDING: u32 = 500;

/// What was found so far; the first word on each matter counts.
#[derive(Debug, Default)]
pub(super) struct Said {
    orientation: Option<u8>,
    cicp: Option<Option<String>>,
    icc: Option<Option<String>>,
    exif_colours: Option<String>,
    srgb: bool,
    numbers: Option<String>,
    space: Option<String>,
    xmp_colours: Option<String>,
    calibration: Option<String>,
    aspect: Option<String>,
    /// Of texts and Exif data, a sentence each.
    others: Vec<String>,
}

impl Said {
    /// Steps over all chunks of a file, up to its end or where it is cut.
    pub(super) fn of(bytes: &[u8]) -> Said {
        let mut said = Said::default();
        let mut reader = Reader::new(bytes.get(SIGNATURE.len()..).unwrap_or_default());
        while let Some((name, data)) = next(&mut reader).filter(|(name, _)| name != b"IEND") {
            said.hear(&name, data);
        }
        said
    }

    /// How the picture asks to be turned, 1..=8.
    pub(super) fn orientation(&self) -> u8 {
        self.orientation.unwrap_or(1)
    }

    /// What is said of colours if it is not sRGB. Of several words cICP is above iCCP, above sRGB, above gAMA and cHRM.
    pub(super) fn profile(&self) -> Option<String> {
        let by_name = self.cicp.clone().or_else(|| self.icc.clone());
        let weaker = [&self.numbers, &self.exif_colours, &self.xmp_colours, &self.space];
        let colours = match by_name {
            Some(said) => said,
            None if self.srgb => None,
            None => weaker.into_iter().flatten().next().cloned(),
        };
        let said: Vec<String> = colours.into_iter().chain(self.calibration.clone()).collect();
        (!said.is_empty()).then(|| said.join(", with "))
    }

    /// What is said of pixels that are not square, and of samples by other names.
    pub(super) fn remarks(&self) -> Vec<String> {
        self.aspect.iter().chain(&self.others).cloned().collect()
    }

    fn hear(&mut self, name: &[u8; 4], data: &[u8]) {
        match name {
            b"eXIf" => self.hear_exif(data),
            b"cICP" => {
                // Primaries of BT.709, the curve of sRGB, RGB, full range.
                let srgb = matches!(data, [1, 13, 0, 1]);
                self.cicp.get_or_insert((!srgb).then(|| format!("the code points {data:?} (cICP)")));
            }
            b"iCCP" => {
                self.icc.get_or_insert_with(|| {
                    let packed = after_zero(data).and_then(|rest| rest.get(1..)).unwrap_or_default();
                    profile::of_icc(&inflated(packed))
                });
            }
            b"sRGB" => self.srgb = true,
            b"gAMA" => {
                let gamma = words(data).next().unwrap_or_default();
                if gamma.abs_diff(SRGB_GAMMA) > ROUNDING {
                    self.numbers = Some(format!("the gamma {:.5} (gAMA)", f64::from(gamma) / 1e5));
                }
            }
            b"cHRM" => {
                // White stands first here.
                let mut list: Vec<f64> = words(data).map(|word| f64::from(word) / 1e5).collect();
                let white = list.len().min(2);
                list.rotate_left(white);
                if let Some(told) = profile::of_chromaticities(&list) {
                    self.numbers.get_or_insert(told);
                }
            }
            b"pHYs" => {
                let mut densities = words(data).map(f64::from);
                if let (Some(across), Some(down)) = (densities.next(), densities.next()) {
                    self.aspect = aspect::of_densities(across, down, "pHYs").or(self.aspect.take());
                }
            }
            b"sCAL" => {
                let mut sizes = data.get(1..).unwrap_or_default().split(|&byte| byte == 0);
                let mut size = || std::str::from_utf8(sizes.next()?).ok()?.trim().parse::<f64>().ok();
                if let (Some(width), Some(height)) = (size(), size()) {
                    self.aspect = aspect::remark(width / height, "sCAL").or(self.aspect.take());
                }
            }
            b"pCAL" => {
                let name = data.split(|&byte| byte == 0).next().unwrap_or_default();
                self.calibration = Some(format!(
                    "a calibration of sample values {:?} (pCAL)",
                    String::from_utf8_lossy(name)
                ));
            }
            b"tEXt" | b"zTXt" | b"iTXt" => self.hear_text(name, data),
            _ => {}
        }
    }

    fn hear_exif(&mut self, block: &[u8]) {
        self.turn(exif::orientation(block));
        self.exif_colours = self.exif_colours.take().or_else(|| exif::colours(block));
        self.others.extend(exif::unapplied(block));
    }

    fn hear_xmp(&mut self, packet: &[u8]) {
        self.turn(orientation::of_xmp(packet));
        self.xmp_colours = self.xmp_colours.take().or_else(|| profile::of_xmp(packet));
    }

    fn turn(&mut self, orientation: u8) {
        if orientation != 1 {
            self.orientation.get_or_insert(orientation);
        }
    }

    /// XMP, and what ImageMagick and older programs put into texts: the bytes of Exif, XMP and ICC data in hexadecimal.
    fn hear_text(&mut self, name: &[u8; 4], data: &[u8]) {
        let (Some(rest), Some(key)) = (after_zero(data), data.split(|&byte| byte == 0).next()) else {
            return;
        };
        let (raw, xmp) = (key.strip_prefix(b"Raw profile type "), key == b"XML:com.adobe.xmp");
        let space = [&b"oiio:ColorSpace"[..], b"colorInteropID"].contains(&key);
        let name_of_it = String::from_utf8_lossy(key);
        let other = !xmp && unapplied::remark(&name_of_it, "").is_some();
        if raw.is_none() && !xmp && !space && !other {
            return;
        }
        let text = match (name, rest) {
            (b"tEXt", text) => text.to_vec(),
            (b"zTXt", [_, packed @ ..]) => inflated(packed),
            (b"iTXt", [packed, _, rest @ ..]) => {
                let text = after_zero(rest).and_then(after_zero).unwrap_or_default();
                if *packed == 1 { inflated(text) } else { text.to_vec() }
            }
            _ => return,
        };
        if other {
            self.others.extend(unapplied::remark(&name_of_it, &String::from_utf8_lossy(&text)));
            return;
        }
        if space {
            let told = profile::of_space_name(&String::from_utf8_lossy(&text), false);
            self.space = self.space.take().or(told);
            return;
        }
        if xmp {
            return self.hear_xmp(&text);
        }
        let bytes = raw_profile(&text);
        match raw {
            Some(b"icc" | b"icm") => {
                self.icc.get_or_insert_with(|| profile::of_icc(&bytes));
            }
            Some(b"xmp") => self.hear_xmp(&bytes),
            _ => match bytes.strip_prefix(exif::MARK) {
                Some(block) => self.hear_exif(block),
                None => self.turn(exif::orientation_of_segment(&bytes)),
            },
        }
    }
}

/// Name and data of the next chunk, whatever its checksum.
fn next<'a>(reader: &mut Reader<'a>) -> Option<([u8; 4], &'a [u8])> {
    let len = u32::from_be_bytes(reader.take(4).ok()?.try_into().ok()?);
    let name = reader.take(4).ok()?.try_into().ok()?;
    let data = reader.take(usize::try_from(len).ok()?).ok()?;
    reader.take(4).ok()?;
    Some((name, data))
}

fn words(data: &[u8]) -> impl Iterator<Item = u32> {
    data.as_chunks::<4>().0.iter().map(|&bytes| u32::from_be_bytes(bytes))
}

fn after_zero(data: &[u8]) -> Option<&[u8]> {
    let end = data.iter().position(|&byte| byte == 0)?;
    data.get(end.checked_add(1)?..)
}

/// What the data inflate to, as far as they do.
fn inflated(packed: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    // What does not inflate has no name to tell, which is told.
    let _ = ZlibDecoder::new(packed).take(MOST_BYTES).read_to_end(&mut out);
    out
}

/// The bytes of a raw profile: a line of its kind, a line of its length, then hexadecimal digits.
fn raw_profile(text: &[u8]) -> Vec<u8> {
    let lines = text.trim_ascii_start().splitn(3, |&byte| byte == b'\n');
    let digits = lines.last().unwrap_or_default().iter().filter_map(|&byte| char::from(byte).to_digit(16));
    let digits: Vec<u8> = digits.filter_map(|digit| u8::try_from(digit).ok()).collect();
    digits.as_chunks::<2>().0.iter().map(|[high, low]| (high << 4) | low).collect()
}
