//! A container, opened.

use std::ops::Range;

use super::bdi::Bdi;
use super::factors::Factors;
use super::header::{Header, read_rotations};
use super::images::{self, Plane};
use super::signature::{BonnKind, Signature, readings};
use crate::reader::Reader;
use crate::words::counted;
use crate::{Assumption, Contents, Error, ErrorKind, Images, Limits, Result, SampleType, Samples};

/// Which row of the image is stored first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum RowOrder {
    /// The top one, as Bonn's own library reads the files.
    #[default]
    TopFirst,
    /// The bottom one, as other readers have it.
    BottomFirst,
}

/// What the files do not say and the reader has to be told.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct OpenOptions {
    /// Row order; the choice is named among the assumptions.
    pub rows: RowOrder,
}

/// A `.btf` file of the University of Bonn. See the [module](super) for what is read, and how.
#[derive(Debug)]
pub struct Archive {
    contents: Contents,
    kind: BonnKind,
    payload: Payload,
    rotations: Vec<[f32; 9]>,
    plane: Plane,
    opened_bytes: usize,
    max_decoded_bytes: u64,
}

#[derive(Debug)]
enum Payload {
    Factors(Factors),
    Bdi(Bdi),
}

impl Archive {
    /// Reads the headers and checks that everything they announce is there, and nothing else. Matrices and
    /// chunks are not looked into: a mapped file stays on its disk.
    ///
    /// # Errors
    /// - [`ErrorKind::Malformed`]: another format, a file cut short or with bytes to spare, sizes that
    ///   contradict each other.
    /// - [`ErrorKind::Unsupported`]: an unknown version or colour model, bzip2 chunks, light directions whose
    ///   number differs from view to view.
    /// - [`ErrorKind::Limit`]: more directions, channels or pixels than `limits` allows.
    pub fn open(bytes: &[u8], options: &OpenOptions, limits: &Limits) -> Result<Archive> {
        let (signature, header, mut reader) = read_header(bytes, limits)?;
        let kind = signature.kind;
        let (payload, rotations) = if kind == BonnKind::Bdi {
            let (bdi, rotations) = Bdi::read(&mut reader, &header, limits)?;
            (Payload::Bdi(bdi), rotations)
        } else {
            // The older form of PVF has no rotations whatever its signature.
            let has_rotations = signature.rotations && header.version > 0;
            let rotations = if has_rotations { read_rotations(&mut reader, limits)? } else { Vec::new() };
            (Payload::Factors(Factors::read(&mut reader, kind, &header)?), rotations)
        };
        let left = reader.rest().len();
        if left > 0 {
            let found = format!("{} after the last matrix or chunk", counted(left, "byte"));
            return Err(Error::malformed(found, "the end of the file").at(reader.position()));
        }
        let side = |length: u32| usize::try_from(length).unwrap_or(usize::MAX);
        let plane = Plane {
            width: side(header.width),
            height: side(header.height),
            bottom_first: options.rows == RowOrder::BottomFirst,
        };
        Ok(Archive {
            contents: describe(signature, header, &payload, rotations.len(), options),
            kind,
            payload,
            rotations,
            plane,
            opened_bytes: bytes.len(),
            max_decoded_bytes: limits.max_decoded_bytes,
        })
    }

    /// Which of the containers it is.
    pub fn kind(&self) -> BonnKind {
        self.kind
    }

    /// Local frames, 3 x 3, row by row. They are not applied to anything; what they belong to is not documented.
    pub fn rotations(&self) -> &[[f32; 9]] {
        &self.rotations
    }

    /// Number of samples of so many images, if they may be returned at once.
    fn samples(&self, lights: usize) -> Result<usize> {
        let channels = self.contents.channels.len();
        let samples = self.plane.pixels().checked_mul(channels).and_then(|image| image.checked_mul(lights));
        let bytes = samples.and_then(|number| number.checked_mul(self.contents.sample_type.bytes()));
        match (samples, bytes.and_then(|bytes| u64::try_from(bytes).ok())) {
            (Some(samples), Some(bytes)) if bytes <= self.max_decoded_bytes => Ok(samples),
            (_, bytes) => {
                let bytes = bytes.map_or("more bytes than can be counted".to_owned(), |b| counted(b, "byte"));
                let expected = format!("at most {}", self.max_decoded_bytes);
                Err(Error::new(
                    ErrorKind::Limit,
                    format!("{bytes} for {}", counted(lights, "image")),
                    expected,
                ))
            }
        }
    }
}

impl Images for Archive {
    fn contents(&self) -> &Contents {
        &self.contents
    }

    fn read_images(&self, bytes: &[u8], view: usize, lights: Range<usize>) -> Result<Samples> {
        let (views, all_lights) = (self.contents.views.len(), self.contents.lights.len());
        if view >= views || lights.start > lights.end || lights.end > all_lights {
            let expected = format!("a view of {views}, lights of {all_lights}");
            return Err(Error::new(ErrorKind::Argument, format!("view {view}, lights {lights:?}"), expected));
        }
        if bytes.len() != self.opened_bytes {
            let expected = format!("the {} that were opened", self.opened_bytes);
            return Err(Error::new(ErrorKind::Argument, counted(bytes.len(), "byte"), expected));
        }
        let samples = self.samples(lights.len())?;
        let factors = match &self.payload {
            Payload::Bdi(bdi) => {
                return Ok(Samples::F16(bdi.images(bytes, self.plane, view, lights, samples)?));
            }
            Payload::Factors(factors) => factors,
        };
        let products: Option<Vec<_>> =
            (0..self.contents.channels.len()).map(|channel| factors.product(view, channel)).collect();
        let products = products.ok_or_else(|| Error::malformed("no product", "one for each channel"))?;
        Ok(match self.contents.sample_type {
            SampleType::F16 => {
                Samples::F16(images::read(factors, bytes, self.plane, &products, lights, samples)?)
            }
            _ => Samples::F32(images::read(factors, bytes, self.plane, &products, lights, samples)?),
        })
    }
}

/// The reading of the signature under which the header is consistent, the longest that is.
fn read_header<'a>(bytes: &'a [u8], limits: &Limits) -> Result<(Signature, Header, Reader<'a>)> {
    let mut first_error = None;
    for signature in readings(bytes) {
        let mut reader = Reader::new(bytes);
        reader.take(signature.text.len())?;
        match Header::read(&mut reader, signature.kind, limits) {
            Ok(header) => return Ok((signature, header, reader)),
            Err(error) => first_error = first_error.or(Some(error)),
        }
    }
    Err(first_error.unwrap_or_else(|| {
        let start = bytes.get(..bytes.len().min(10)).unwrap_or_default();
        let found = format!("the signature {:?}", String::from_utf8_lossy(start));
        Error::malformed(found, "!DFMF08FC, !FMF06FC, !FMF12FCE, !PVF06FC (with or without R) or !BDIF06R2!")
            .at(0u64)
    }))
}

fn describe(
    signature: Signature,
    header: Header,
    payload: &Payload,
    rotations: usize,
    options: &OpenOptions,
) -> Contents {
    let sample_type = match payload {
        Payload::Factors(factors) if !factors.all_half() => SampleType::F32,
        _ => SampleType::F16,
    };
    Contents {
        format: format_name(signature.kind, payload),
        sample_type,
        linear: true,
        cosine_included: header.cosine_included.unwrap_or(false),
        assumptions: assumptions(&header, payload, options),
        remarks: remarks(signature, &header, payload, rotations),
        width: header.width,
        height: header.height,
        channels: header.channels,
        views: header.views,
        lights: header.lights,
    }
}

fn format_name(kind: BonnKind, payload: &Payload) -> String {
    let name = match kind {
        BonnKind::Dfmf => "DFMF",
        BonnKind::Fmf | BonnKind::FmfExtended => "FMF",
        BonnKind::Pvf => "PVF",
        BonnKind::Bdi => "BDI",
    };
    match payload {
        Payload::Factors(factors) => format!("Bonn {name}, {}", factors.describe()),
        Payload::Bdi(bdi) => format!("Bonn {name}, f16, {}", if bdi.is_sparse() { "sparse" } else { "full" }),
    }
}

fn assumptions(header: &Header, payload: &Payload, options: &OpenOptions) -> Vec<Assumption> {
    let mut list = vec![
        match options.rows {
            RowOrder::TopFirst => "The first stored row is taken as the top of the image.",
            RowOrder::BottomFirst => "The first stored row is taken as the bottom of the image.",
        }
        .into(),
        Assumption::azimuths("Azimuths are taken as counter-clockwise from the right of the image."),
    ];
    if header.cosine_included.is_none() {
        let text = "The header is too old to say whether the cosine of the light angle is in the data; it is \
                    taken as not.";
        list.push(Assumption::cosine(text));
    }
    if let Some(view) = header.other_lights {
        list.push(
            format!(
                "Light directions of view {view} are not those of view 0; those of view 0 are used for all."
            )
            .into(),
        );
    }
    match payload {
        Payload::Factors(factors) => {
            if factors.ambiguous {
                let text = "There are as many direction pairs as pixels, so that the matrices could be \
                            transposed; they are read in the usual orientation.";
                list.push(text.into());
            }
            if factors.color.is_lab() {
                let text = "Lab values are taken as relative to D50 and turned into linear sRGB.";
                list.push(text.into());
            }
        }
        Payload::Bdi(bdi) => {
            if bdi.missing > 0 {
                let text = "The mask of missing pixels is read row by row, as the samples are.";
                list.push(text.into());
            }
        }
    }
    list
}

fn remarks(
    signature: Signature,
    header: &Header,
    payload: &Payload,
    rotations: usize,
) -> Vec<(String, String)> {
    let mut list = vec![("signature", signature.text.to_owned())];
    if header.version == 0 {
        list.push(("header", "legacy".to_owned()));
    } else {
        list.push(("header version", header.version.to_string()));
        let [setup, sensor, source] = &header.texts;
        let texts = [("measurement setup", setup), ("image sensor", sensor), ("light source", source)];
        list.extend(texts.into_iter().filter(|(_, text)| !text.is_empty()).map(|(key, t)| (key, t.clone())));
        list.push(("pixels per millimetre", header.pixels_per_mm.to_string()));
        let [r, g, b] = header.rgb_scale;
        list.push(("RGB scale factors, not applied", format!("{r}, {g}, {b}")));
    }
    if header.xml_bytes > 0 {
        list.push(("XML description, not read", counted(header.xml_bytes, "byte")));
    }
    if rotations > 0 {
        list.push(("local frames, not applied", rotations.to_string()));
    }
    match payload {
        Payload::Factors(factors) => {
            if signature.kind == BonnKind::Dfmf {
                let (code, name) = factors.color.describe();
                list.push(("colour model, undone", format!("{code} ({name})")));
            }
            if factors.log {
                list.push(("reduction of the dynamic range, undone", "logarithm".to_owned()));
            }
            if let Some((width, height)) = factors.height_map {
                list.push(("height map, not read", format!("{width} x {height}")));
            }
            if factors.any_transposed() {
                list.push(("orientation", "transposed: pixels on the left".to_owned()));
            }
        }
        Payload::Bdi(bdi) => {
            if bdi.missing > 0 {
                let state = if bdi.is_sparse() { "read as 0" } else { "read as stored" };
                list.push(("pixels marked as missing", format!("{}, {state}", bdi.missing)));
            }
        }
    }
    list.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}
