//! Bytes to a model.

use crate::bytes::Reader;
use crate::error::{Error, Result};
use crate::header::{Header, expect_numbers};
use crate::model::{Component, Direction, Model};
use crate::palette::{CodedPalette, Palette};
use crate::quantise::strength;
use crate::range_coder::Decoder;
use crate::section::{Found, Section};
use crate::spectrum::Transforms;
use crate::stream::{Stream, Truth};

/// What is known of a section: a file that is cut behind it is a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionEnd {
    /// Byte where it ends.
    pub end: usize,
    /// Components up to it.
    pub components: usize,
    /// Peak signal-to-noise ratio up to it, dB.
    pub decibels: f64,
    /// Its step.
    pub step: f64,
}

/// How a file ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// All sections are there.
    Whole,
    /// The section that begins at this byte is not there, or not whole.
    Cut(usize),
    /// The section that begins at this byte is damaged: it and those behind it were left out.
    Damaged(usize),
}

/// What a file holds.
#[derive(Clone, Debug)]
pub struct Unpacked {
    /// The model.
    pub model: Model,
    /// The sections that it was made of.
    pub planes: Vec<SectionEnd>,
    /// Sections that the file was written with.
    pub sections: usize,
    /// How it ends.
    pub ending: Ending,
}

/// What a file says of itself: everything but the numbers.
#[derive(Clone, Debug)]
pub struct Outline {
    /// Rows and columns of the tile.
    pub size: [usize; 2],
    /// Whether the tile's borders join.
    pub wraps: bool,
    /// View directions.
    pub views: Vec<Direction>,
    /// Light directions.
    pub lights: Vec<Direction>,
    /// Names of the channels.
    pub channels: Vec<String>,
    /// What else is said of the material: names and texts.
    pub texts: Vec<(String, String)>,
    /// The sections that are there.
    pub planes: Vec<SectionEnd>,
    /// Sections that the file was written with.
    pub sections: usize,
    /// How it ends.
    pub ending: Ending,
    /// Bytes of the file.
    pub bytes: usize,
    /// Of these, bytes before the first section: the header, and the palette.
    pub header_bytes: usize,
    /// Centres of the palette, where images are by one.
    pub centres: Option<usize>,
}

impl Outline {
    /// Components that are there.
    pub fn components(&self) -> usize {
        self.planes.last().map_or(0, |plane| plane.components)
    }

    /// Memory that [`unpack`] takes, the model in 64 and in 32 bits and the file included.
    pub fn memory_bytes(&self) -> u64 {
        /// A magnitude, a sign, and the number in 64 and in 32 bits; and what an allocator adds.
        const NUMBER: u64 = 4 + 1 + 8 + 4 + 3;
        let [height, width, views, lights, channels, components] = [
            self.size[0],
            self.size[1],
            self.views.len(),
            self.lights.len(),
            self.channels.len(),
            self.components(),
        ]
        .map(|count| count as u64);
        // With the zeros around them; directions and sides are few enough for none of this to overflow.
        let (brdf, image) = (channels * (views + 4) * (lights + 4), (height + 4) * (width + 4));
        let transforms = 8 * (2 * (views * views + lights * lights) + 4 * (height + width));
        // An image is turned, and a BRDF, beside what they are turned from.
        let turned = 4 * 8 * brdf.max(image);
        self.bytes as u64 + NUMBER * (components + 1) * (brdf + image) + transforms + turned
    }
}

/// A file in its parts, none of which is decoded.
struct Parts<'a> {
    header: Header,
    palette: Option<CodedPalette<'a>>,
    header_bytes: usize,
    sections: Vec<Section<'a>>,
    planes: Vec<SectionEnd>,
    ending: Ending,
}

impl<'a> Parts<'a> {
    fn of(file: &'a [u8]) -> Result<Self> {
        let mut reader = Reader::new(file);
        let header = Header::read(&mut reader, file)?;
        let palette = match header.has_palette {
            true => Some(CodedPalette::read(&mut reader, file, header.size)?),
            false => None,
        };
        let header_bytes = reader.at();
        let brdf = header.views.len() * header.lights.len() * header.channels.len();
        let texels = header.size[0] * header.size[1];
        let (mut sections, mut planes): (Vec<Section<'_>>, Vec<SectionEnd>) = (vec![], vec![]);
        let mut ending = Ending::Whole;
        for low in (0..header.sections).rev() {
            let start = reader.at();
            let before = sections.last().map_or(0, |section| section.components);
            let section = match Section::read(&mut reader, file, before) {
                Ok(Found::Section(section)) => section,
                Ok(Found::Damaged) => {
                    ending = Ending::Damaged(start);
                    break;
                }
                Err(_) => {
                    ending = Ending::Cut(start);
                    break;
                }
            };
            expect_numbers(brdf, texels, section.components, file.len()).map_err(|error| error.at(start))?;
            let decibels = f64::from(section.centibels) / 100.0;
            let step = f64::from(header.step) * f64::from(1u32 << low);
            planes.push(SectionEnd { end: reader.at(), components: section.components, decibels, step });
            sections.push(section);
        }
        if planes.is_empty() {
            let found = match ending {
                Ending::Damaged(_) => "a damaged first section: its checksum differs",
                _ => "the end of the file before its first section is whole",
            };
            return Err(Error::new(found, "at least one whole section").at(reader.at()));
        }
        if ending == Ending::Whole && reader.left() > 0 {
            let found = format!("{} bytes behind the last section", reader.left());
            return Err(Error::new(found, "the end of the file").at(reader.at()));
        }
        Ok(Self { header, palette, header_bytes, sections, planes, ending })
    }
}

/// Reads what a packed model says of itself, and decodes nothing.
///
/// # Errors
/// As [`unpack`], but for what only the numbers tell.
pub fn outline(file: &[u8]) -> Result<Outline> {
    let Parts { header, palette, header_bytes, planes, ending, .. } = Parts::of(file)?;
    let centres = palette.map(|palette| palette.centres);
    let sections = header.sections as usize;
    let Header { size, wraps, views, lights, channels, texts, .. } = header;
    let bytes = file.len();
    Ok(Outline {
        size,
        wraps,
        views,
        lights,
        channels,
        texts,
        planes,
        sections,
        ending,
        bytes,
        header_bytes,
        centres,
    })
}

/// Reads a packed model, as fine as its bytes allow.
///
/// Nothing is trusted: memory is in proportion to the bytes that there are, beside 2^22 numbers ([`Outline::memory_bytes`]
/// says how much), and the header and each section have a checksum. A file that is cut, or damaged behind its first
/// section, gives the model of the sections before; [`Unpacked::ending`] says so.
///
/// # Errors
/// Where not even the first section is whole; sizes that such a file cannot mean; bytes behind the last section; numbers
/// so large that no values can be made of them.
pub fn unpack(file: &[u8]) -> Result<Unpacked> {
    let Parts { header, palette, sections, planes, ending, .. } = Parts::of(file)?;
    let palette = palette.map(|coded| Palette::decode(&coded, header.size)).transpose()?;
    let channels = header.channels.len();
    let transforms = Transforms::new(header.size, &header.views, &header.lights, channels, palette);
    let mut stream = Stream::new(&transforms, channels, header.planes);
    let texels = header.size[0] * header.size[1];
    let mut strengths: Vec<u16> = vec![];
    for (low, section) in (0..header.sections).rev().zip(sections) {
        let mut decoder = Decoder::new(section.payload);
        stream.code_mean(&mut decoder, low, &[]);
        (0..section.components)
            .for_each(|number| stream.code_component(&mut decoder, number, low, Truth::default()));
        strengths.extend(section.strengths);
    }
    let step = planes.last().map_or(0.0, |plane| plane.step);
    let components =
        stream.bases.iter().zip(&stream.images).zip(strengths).map(|((basis, image), code)| Component {
            basis: transforms.to_brdf(&basis.values(&stream.brdf, step / strength(code))),
            coefficients: transforms.to_image(image.values(&stream.image, step)),
        });
    let model = Model {
        mean: transforms.to_brdf(&stream.mean.values(&stream.brdf, step / (texels as f64).sqrt())),
        components: components.collect(),
        size: header.size,
        wraps: header.wraps,
        views: header.views,
        lights: header.lights,
        channels: header.channels,
        texts: header.texts,
    };
    model.check()?;
    Ok(Unpacked { model, planes, sections: header.sections as usize, ending })
}
