//! The header of a packed model: sizes, directions, channels and texts.

use crate::bytes::{Reader, push_long, push_short};
use crate::directions;
use crate::error::{Error, Result};
use crate::model::{Direction, Model};
use crate::quantise::MOST_PLANES;

/// The first bytes of a packed model.
pub const MAGIC: [u8; 4] = *b"BTFC";

/// Versions of the format: images by cosines, and images by a palette.
const VERSIONS: [u8; 2] = [1, 2];

/// Longest side of a tile in texels.
pub const MOST_SIDE: usize = 4096;

/// Most views, and most lights.
pub const MOST_DIRECTIONS: usize = 1024;

/// Most channels.
const MOST_CHANNELS: usize = 256;

/// The largest step: no number that may be read is larger.
const MOST_STEP: f32 = (1u128 << 64) as f32;

/// Numbers that a file of no length may stand for, and that each of its bytes adds.
const NUMBERS: [usize; 2] = [1 << 22, 1 << 12];

/// Everything before the first section.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Header {
    pub(crate) size: [usize; 2],
    pub(crate) wraps: bool,
    /// Whether a palette follows the header.
    pub(crate) has_palette: bool,
    pub(crate) views: Vec<Direction>,
    pub(crate) lights: Vec<Direction>,
    pub(crate) channels: Vec<String>,
    pub(crate) texts: Vec<(String, String)>,
    /// The finest step.
    pub(crate) step: f32,
    /// Bit planes of magnitudes.
    pub(crate) planes: u32,
    /// Sections; the first holds all planes but one for each other.
    pub(crate) sections: u32,
}

/// Whether a file of so many bytes may stand for a mean and so many components.
///
/// # Errors
/// Where it would be more numbers than such a file can reasonably mean, or more components than are independent.
pub(crate) fn expect_numbers(brdf: usize, texels: usize, components: usize, bytes: usize) -> Result<()> {
    let independent = brdf.min(texels);
    if components > independent {
        let expected = format!("at most {independent}, as many as there are texels, or values of one");
        return Err(Error::new(format!("{components} components"), expected));
    }
    let numbers = brdf.saturating_add(components.saturating_mul(brdf.saturating_add(texels)));
    let most = NUMBERS[0] + NUMBERS[1].saturating_mul(bytes);
    if numbers <= most {
        return Ok(());
    }
    Err(Error::new(
        format!("{components} components, {numbers} numbers together, in a file of {bytes} bytes"),
        format!("at most {most} numbers"),
    ))
}

impl Header {
    /// The header of a model with these planes.
    ///
    /// # Errors
    /// Sizes beyond those that the format has room for.
    pub(crate) fn of(model: &Model, step: f32, planes: u32, sections: u32) -> Result<Self> {
        let within = |what: &str, found: usize, most: usize| match (1..=most).contains(&found) {
            true => Ok(()),
            false => Err(Error::new(format!("{found} {what}"), format!("1 to {most}"))),
        };
        within("rows", model.size[0], MOST_SIDE)?;
        within("columns", model.size[1], MOST_SIDE)?;
        within("views", model.views.len(), MOST_DIRECTIONS)?;
        within("lights", model.lights.len(), MOST_DIRECTIONS)?;
        within("channels", model.channels.len(), MOST_CHANNELS)?;
        Ok(Self {
            size: model.size,
            wraps: model.wraps,
            has_palette: false,
            views: model.views.clone(),
            lights: model.lights.clone(),
            channels: model.channels.clone(),
            texts: model.texts.clone(),
            step,
            planes,
            sections,
        })
    }

    /// The header as bytes, and their checksum.
    ///
    /// # Errors
    /// Names and texts that are too long.
    pub(crate) fn to_bytes(&self) -> Result<Vec<u8>> {
        let mut rest = vec![];
        directions::write(&mut rest, &self.views, None);
        directions::write(&mut rest, &self.lights, Some(&self.views));
        for channel in &self.channels {
            push_short(&mut rest, channel)?;
        }
        let many = |_| Error::new(format!("{} texts", self.texts.len()), "at most 255");
        rest.push(u8::try_from(self.texts.len()).map_err(many)?);
        for (name, text) in &self.texts {
            push_short(&mut rest, name)?;
            push_long(&mut rest, text)?;
        }
        let mut bytes = MAGIC.to_vec();
        let version = VERSIONS[usize::from(self.has_palette)];
        bytes.extend([version, u8::from(self.wraps), self.planes as u8, self.sections as u8]);
        for side in self.size {
            bytes.extend((side as u16).to_le_bytes());
        }
        bytes.extend((self.channels.len() as u16).to_le_bytes());
        bytes.extend(self.step.to_le_bytes());
        bytes.extend((rest.len() as u32).to_le_bytes());
        bytes.extend(rest);
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        Ok(bytes)
    }

    /// Reads a header, and checks it.
    ///
    /// # Errors
    /// Says what is not as it must be, and where.
    pub(crate) fn read(reader: &mut Reader<'_>, file: &[u8]) -> Result<Self> {
        let magic = reader.take(MAGIC.len())?;
        if magic != MAGIC {
            return Err(Error::new(
                format!("the first bytes {magic:?}"),
                "a packed model, which begins BTFC",
            )
            .at(0));
        }
        let version = reader.u8()?;
        if !VERSIONS.contains(&version) {
            let found = format!("version {version} of packed models");
            return Err(Error::new(found, "version 1 or 2; a newer btfkit may read it").at(4));
        }
        let has_palette = version == VERSIONS[1];
        let flags = reader.u8()?;
        let [planes, sections] = [reader.u8()?, reader.u8()?].map(u32::from);
        let size = [reader.u16()?, reader.u16()?].map(usize::from);
        let channels = usize::from(reader.u16()?);
        let step = reader.f32()?;
        let length = reader.u32()? as usize;
        let end = reader.at().saturating_add(length);
        // The checksum comes first: a wrong bit is told as one, and not as what it makes of a number.
        {
            let mut ahead = Reader::new(file);
            let covered = ahead.take(end)?;
            let (found, expected) = (crc32fast::hash(covered), ahead.u32()?);
            if found != expected {
                return Err(Error::new(
                    "a damaged header: its checksum differs",
                    "the file as it was written",
                )
                .at(end));
            }
        }
        let views = directions::read(reader, None, MOST_DIRECTIONS)?;
        let lights = directions::read(reader, Some(&views), MOST_DIRECTIONS)?;
        if flags > 1 || !(1..=MOST_PLANES).contains(&planes) || !(1..=planes).contains(&sections) {
            return Err(Error::new(
                format!("flags {flags}, {planes} planes, {sections} sections"),
                format!("flags 0 or 1, 1 to {MOST_PLANES} planes, and no more sections than planes"),
            )
            .at(5));
        }
        if !size.iter().all(|side| (1..=MOST_SIDE).contains(side)) || !(1..=MOST_CHANNELS).contains(&channels)
        {
            return Err(Error::new(
                format!("{channels} channels of {} x {} texels", size[1], size[0]),
                format!("1 to {MOST_CHANNELS} channels and sides of 1 to {MOST_SIDE}"),
            )
            .at(8));
        }
        if !(step > 0.0 && step <= MOST_STEP) {
            let expected = format!("a number above 0, of at most {MOST_STEP:e}");
            return Err(Error::new(format!("a step of {step:e}"), expected).at(14));
        }
        let brdf = views.len() * lights.len() * channels;
        // A palette has a number for each texel even without components.
        let least = if has_palette { brdf + size[0] * size[1] } else { brdf };
        expect_numbers(least, size[0] * size[1], 0, file.len())?;
        let names = (0..channels).map(|_| {
            let length = reader.u8()?;
            reader.text(usize::from(length))
        });
        let channels = names.collect::<Result<_>>()?;
        let texts = (0..reader.u8()?).map(|_| {
            let length = reader.u8()?;
            let name = reader.text(usize::from(length))?;
            let length = reader.u16()?;
            Ok((name, reader.text(usize::from(length))?))
        });
        let texts = texts.collect::<Result<_>>()?;
        if reader.at() != end {
            let found = format!("a header that ends at byte {}", reader.at());
            return Err(Error::new(found, format!("byte {end}, as it says")).at(reader.at()));
        }
        reader.u32()?;
        Ok(Self {
            size,
            wraps: flags == 1,
            has_palette,
            views,
            lights,
            channels,
            texts,
            step,
            planes,
            sections,
        })
    }
}
