//! What all containers have in front: the description of the measurement, directions, the plane's size.

use super::signature::BonnKind;
use crate::reader::Reader;
use crate::words::counted;
use crate::{Direction, Error, ErrorKind, Limits, Result};

/// What stands in place of the header's size in the older form of PVF.
const LEGACY_PVF: i32 = 301_074;

/// Bytes of each of the three texts.
pub(super) const TEXT_BYTES: usize = 80;

/// Bytes of one direction: theta and phi, f32.
const DIRECTION_BYTES: usize = 8;

/// Versions of the header that are known.
const VERSIONS: std::ops::RangeInclusive<u32> = 1..=4;

#[derive(Debug)]
pub(super) struct Header {
    /// 0 in the older form of PVF, which has none.
    pub(super) version: u32,
    /// Measurement setup, image sensor, light source.
    pub(super) texts: [String; 3],
    pub(super) pixels_per_mm: f32,
    pub(super) rgb_scale: [f32; 3],
    /// Whether the cosine of the light's polar angle is in the data; `None` if the header is too old to say.
    pub(super) cosine_included: Option<bool>,
    pub(super) xml_bytes: u32,
    pub(super) channels: Vec<String>,
    pub(super) views: Vec<Direction>,
    pub(super) lights: Vec<Direction>,
    /// The first view whose light directions are not those of view 0.
    pub(super) other_lights: Option<usize>,
    pub(super) width: u32,
    pub(super) height: u32,
}

impl Header {
    /// Reads all up to the plane's size (in the older form of PVF: up to the directions).
    pub(super) fn read(reader: &mut Reader<'_>, kind: BonnKind, limits: &Limits) -> Result<Header> {
        if kind == BonnKind::Pvf && reader.clone().i32_le()? == LEGACY_PVF {
            reader.take(4)?;
            return Header::read_legacy(reader, limits);
        }
        let mut header = Header::read_description(reader, limits)?;
        header.read_directions(reader, limits)?;
        header.read_size(reader, limits)?;
        Ok(header)
    }

    fn empty(version: u32) -> Header {
        Header {
            version,
            texts: Default::default(),
            pixels_per_mm: 0.0,
            rgb_scale: [1.0; 3],
            cosine_included: None,
            xml_bytes: 0,
            channels: ["R", "G", "B"].map(str::to_owned).to_vec(),
            views: Vec::new(),
            lights: Vec::new(),
            other_lights: None,
            width: 0,
            height: 0,
        }
    }

    fn read_legacy(reader: &mut Reader<'_>, limits: &Limits) -> Result<Header> {
        let mut header = Header::empty(0);
        let _components = reader.u32_le()?;
        header.read_size(reader, limits)?;
        let at = reader.position();
        let slots = reader.u32_le()?;
        header.read_directions(reader, limits)?;
        if usize::try_from(slots) != Ok(header.views.len()) {
            let found = format!("{} for {}", counted(slots, "slot"), counted(header.views.len(), "view"));
            return Err(Error::malformed(found, "a slot for each view").at(at));
        }
        Ok(header)
    }

    fn read_description(reader: &mut Reader<'_>, limits: &Limits) -> Result<Header> {
        let start = reader.position();
        let size = reader.u32_le()?;
        let version = reader.u32_le()?;
        if !VERSIONS.contains(&version) {
            let found = format!("a header of version {version}");
            return Err(Error::new(ErrorKind::Unsupported, found, "version 1 to 4").at(start));
        }
        let mut header = Header::empty(version);
        for field in &mut header.texts {
            *field = text(reader.take(TEXT_BYTES)?);
        }
        header.pixels_per_mm = reader.f32_le()?;
        for factor in &mut header.rgb_scale {
            *factor = reader.f32_le()?;
        }
        if version > 1 {
            header.cosine_included = Some(reader.u32_le()? != 0);
        }
        if version > 2 {
            header.xml_bytes = reader.u32_le()?;
            reader.take(length(header.xml_bytes))?;
        }
        if version > 3 {
            header.channels = read_channels(reader, limits)?;
        }
        let read = reader.position().saturating_sub(start);
        if usize::try_from(size) != Ok(read) {
            let expected = format!("the {} that its fields take", counted(read, "byte"));
            return Err(
                Error::malformed(format!("a header of {}", counted(size, "byte")), expected).at(start)
            );
        }
        Ok(header)
    }

    fn read_directions(&mut self, reader: &mut Reader<'_>, limits: &Limits) -> Result<()> {
        let views = count(reader, "views", limits)?;
        let mut first: Option<&[u8]> = None;
        for view in 0..views {
            self.views.push(direction(reader)?);
            let at = reader.position();
            let lights = count(reader, "lights", limits)?;
            let list = reader.take(lights.saturating_mul(DIRECTION_BYTES))?;
            match first {
                None => {
                    first = Some(list);
                    let mut list = Reader::new(list);
                    self.lights = (0..lights).map(|_| direction(&mut list)).collect::<Result<_>>()?;
                }
                Some(first) if first.len() != list.len() => {
                    let found = format!("{} for view {view}", counted(lights, "light"));
                    let expected = format!("{}, as for view 0", self.lights.len());
                    return Err(Error::new(ErrorKind::Unsupported, found, expected).at(at));
                }
                Some(first) if first != list && self.other_lights.is_none() => {
                    self.other_lights = Some(view);
                }
                Some(_) => {}
            }
        }
        Ok(())
    }

    fn read_size(&mut self, reader: &mut Reader<'_>, limits: &Limits) -> Result<()> {
        let at = reader.position();
        self.width = reader.u32_le()?;
        self.height = reader.u32_le()?;
        let (width, height) = (self.width, self.height);
        let pixels = u64::from(width).saturating_mul(u64::from(height));
        if pixels == 0 {
            return Err(Error::malformed(format!("{width} x {height} pixels"), "at least one").at(at));
        }
        if pixels > limits.max_pixels_per_image {
            let expected = format!("at most {}", limits.max_pixels_per_image);
            return Err(Error::new(ErrorKind::Limit, format!("{width} x {height} pixels"), expected).at(at));
        }
        Ok(())
    }
}

/// The local frames: a count, and 3 x 3 numbers, row by row, for each.
pub(super) fn read_rotations(reader: &mut Reader<'_>, limits: &Limits) -> Result<Vec<[f32; 9]>> {
    let at = reader.position();
    let number = reader.u32_le()?;
    if u64::from(number) > limits.max_pixels_per_image {
        let expected = format!("at most {}", limits.max_pixels_per_image);
        return Err(Error::new(ErrorKind::Limit, counted(number, "rotation").to_string(), expected).at(at));
    }
    let bytes = reader.take(length(number).saturating_mul(36))?;
    let (numbers, _) = bytes.as_chunks::<4>();
    let (matrices, _) = numbers.as_chunks::<9>();
    Ok(matrices.iter().map(|matrix| matrix.map(f32::from_le_bytes)).collect())
}

/// A count of bytes or items as it may be asked of a slice; nothing holds as many as do not fit.
pub(super) fn length(number: u32) -> usize {
    usize::try_from(number).unwrap_or(usize::MAX)
}

/// Text that ends with its first zero.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(bytes.get(..end).unwrap_or(bytes)).trim().to_owned()
}

fn read_channels(reader: &mut Reader<'_>, limits: &Limits) -> Result<Vec<String>> {
    let at = reader.position();
    let number = reader.u32_le()?;
    if number == 0 {
        return Err(Error::malformed("no channels", "at least one").at(at));
    }
    if u64::from(number) > limits.max_channels {
        let expected = format!("at most {}", limits.max_channels);
        return Err(Error::new(ErrorKind::Limit, counted(number, "channel"), expected).at(at));
    }
    let name = |_| {
        let len = reader.u32_le()?;
        Ok(text(reader.take(length(len))?))
    };
    (0..number).map(name).collect()
}

/// A number of directions that the limits allow.
fn count(reader: &mut Reader<'_>, what: &str, limits: &Limits) -> Result<usize> {
    let at = reader.position();
    let number = reader.u32_le()?;
    if number == 0 {
        return Err(Error::malformed(format!("no {what}"), "at least one").at(at));
    }
    if u64::from(number) > limits.max_directions {
        let expected = format!("at most {}", limits.max_directions);
        return Err(Error::new(ErrorKind::Limit, format!("{number} {what}"), expected).at(at));
    }
    Ok(length(number))
}

fn direction(reader: &mut Reader<'_>) -> Result<Direction> {
    let at = reader.position();
    let (theta, phi) = (reader.f32_le()?, reader.f32_le()?);
    if !(0.0..=std::f32::consts::PI).contains(&theta) || !phi.is_finite() {
        let found = format!("a direction of theta {theta}, phi {phi}");
        return Err(Error::malformed(found, "radians, theta in 0..=pi").at(at));
    }
    Ok(Direction { theta_rad: f64::from(theta), phi_rad: f64::from(phi) })
}
