//! Bytes to a model.

use crate::bytes::Reader;
use crate::error::{Error, Result};
use crate::header::{Header, expect_numbers};
use crate::model::{Component, Model};
use crate::palette::Palette;
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
    /// Bytes before the first of them: the header, and the palette.
    pub header_bytes: usize,
    /// Centres of the palette, where images are by one.
    pub centres: Option<usize>,
    /// How it ends.
    pub ending: Ending,
}

/// Reads a packed model, as fine as its bytes allow.
///
/// Nothing is trusted: memory is in proportion to the bytes that there are, beside 2^22 numbers, and the header and each
/// section have a checksum. A file that is cut, or damaged behind its first section, gives the model of the sections
/// before; [`Unpacked::ending`] says so.
///
/// # Errors
/// Where not even the first section is whole; sizes that such a file cannot mean; bytes behind the last section.
pub fn unpack(file: &[u8]) -> Result<Unpacked> {
    let mut reader = Reader::new(file);
    let header = Header::read(&mut reader, file)?;
    let palette = match header.has_palette {
        true => Some(Palette::read(&mut reader, file, header.size)?),
        false => None,
    };
    let header_bytes = reader.at();
    let centres = palette.as_ref().map(Palette::centres);
    let channels = header.channels.len();
    let transforms = Transforms::new(header.size, &header.views, &header.lights, channels, palette);
    let mut stream = Stream::new(&transforms, channels, header.planes);
    let (brdf, texels) = (stream.brdf.values(), header.size[0] * header.size[1]);
    let (mut planes, mut strengths): (Vec<SectionEnd>, Vec<u16>) = (vec![], vec![]);
    let mut ending = Ending::Whole;
    let mut step = f64::from(header.step);
    for low in (0..header.sections).rev() {
        let start = reader.at();
        let section = match Section::read(&mut reader, file, strengths.len()) {
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
        let mut decoder = Decoder::new(section.payload);
        stream.code_mean(&mut decoder, low, &[]);
        (0..section.components)
            .for_each(|number| stream.code_component(&mut decoder, number, low, Truth::default()));
        strengths.extend(section.strengths);
        step = f64::from(header.step) * f64::from(1u32 << low);
        let decibels = f64::from(section.centibels) / 100.0;
        planes.push(SectionEnd { end: reader.at(), components: section.components, decibels, step });
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
    Ok(Unpacked { model, planes, sections: header.sections as usize, header_bytes, centres, ending })
}
