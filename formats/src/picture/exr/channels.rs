//! The channel list, and the order that its channels are handed out in.

use exr::meta::attribute::SampleType as Stored;

use crate::picture::size::unsupported;
use crate::picture::wavelength::{quantity, wavelength_nm};
use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, Result, SampleType};

#[derive(Debug, Clone)]
pub(super) struct Channel {
    /// As in the file; the decompressor goes by it.
    pub(super) name: String,
    /// Without that of its layer.
    shown: String,
    pub(super) role: Role,
    pub(super) stored: Stored,
    pub(super) quantize_linearly: bool,
}

/// What a channel is of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Colour,
    /// Must be 1 everywhere.
    Alpha,
    /// Depth, normals, motion and the like, beside colours.
    LeftOut,
}

/// Bands of light that stand beside R, G and B without a wavelength.
const BANDS: [&str; 4] = ["IR", "NIR", "SWIR", "UV"];

/// The channels of a picture.
#[derive(Debug, Clone)]
pub(super) struct Channels {
    /// As in the file: sorted by name, alpha and those left out too.
    pub(super) stored: Vec<Channel>,
    /// Numbers of the colours, in the order in which they are handed out.
    pub(super) order: Vec<usize>,
    /// The layer that the picture is in, if it is in one.
    pub(super) layer: Option<String>,
}

impl Channels {
    /// Reads an attribute of type `chlist`.
    pub(super) fn read(data: &[u8]) -> Result<Channels> {
        let mut reader = Reader::new(data);
        let mut stored: Vec<Channel> = Vec::new();
        loop {
            let name = text(&mut reader)?;
            if name.is_empty() {
                break;
            }
            if stored.last().is_some_and(|before| before.name >= name) {
                return Err(Error::malformed(
                    format!("the channel {name:?} out of order"),
                    "names that ascend",
                ));
            }
            let kind = match reader.i32_le()? {
                0 => Stored::U32,
                1 => Stored::F16,
                2 => Stored::F32,
                other => return Err(Error::malformed(format!("samples of type {other}"), "0, 1 or 2")),
            };
            let quantize_linearly = reader.u8()? != 0;
            reader.take(3)?;
            let sampling = (reader.i32_le()?, reader.i32_le()?);
            if sampling != (1, 1) {
                let found = format!("the channel {name:?} with sampling {sampling:?}");
                return Err(unsupported(found, "a sample at every pixel"));
            }
            let (shown, role) = (name.clone(), Role::LeftOut);
            stored.push(Channel { name, shown, role, stored: kind, quantize_linearly });
        }
        let layer = layer_of_picture(&stored)?;
        let mut within: Vec<&mut Channel> = Vec::new();
        for channel in &mut stored {
            let (of, rest) = split_layer(&channel.name);
            if of == layer.as_deref().unwrap_or("") {
                channel.shown = rest.to_owned();
                within.push(channel);
            }
        }
        give_roles(&mut within)?;
        let order = order_of(&stored);
        if order.is_empty() {
            return Err(unsupported(counted(stored.len(), "channel"), "a channel that is not alpha"));
        }
        Ok(Channels { stored, order, layer })
    }

    pub(super) fn names(&self) -> Vec<String> {
        self.order
            .iter()
            .filter_map(|&number| self.stored.get(number))
            .map(|channel| channel.shown.clone())
            .collect()
    }

    /// Names of the channels that are no part of the picture.
    pub(super) fn left_out(&self) -> Vec<&str> {
        let left = self.stored.iter().filter(|channel| channel.role == Role::LeftOut);
        left.map(|channel| channel.name.as_str()).collect()
    }

    /// Halves if all colours are halves.
    pub(super) fn sample_type(&self) -> SampleType {
        let mut colours = self.stored.iter().filter(|channel| channel.role == Role::Colour);
        if colours.all(|channel| channel.stored == Stored::F16) { SampleType::F16 } else { SampleType::F32 }
    }

    pub(super) fn bytes_per_pixel(&self) -> u64 {
        let bytes = self.stored.iter().map(|channel| if channel.stored == Stored::F16 { 2u64 } else { 4 });
        bytes.fold(0, u64::saturating_add)
    }
}

/// Text up to a zero byte, which is read too.
pub(super) fn text(reader: &mut Reader<'_>) -> Result<String> {
    const LONGEST: usize = 255;
    let at = reader.position();
    let rest = reader.rest();
    let Some(len) = rest.iter().take(LONGEST.saturating_add(1)).position(|&byte| byte == 0) else {
        return Err(Error::malformed("a name without an end", "at most 255 bytes and a zero").at(at));
    };
    let bytes = reader.take(len)?;
    reader.take(1)?;
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.to_owned()),
        Err(_) => Err(Error::malformed(format!("the name {}", bytes.escape_ascii()), "text (UTF-8)").at(at)),
    }
}

/// The layer in a name and what is left. A point separates them, unless it is that of a wavelength.
fn split_layer(name: &str) -> (&str, &str) {
    if wavelength_nm(name).is_some() {
        // Unpolarised emission and reflectance are the picture itself.
        return match quantity(name) {
            ("" | "S0" | "T", _) => ("", name),
            (other, rest) => (other, rest),
        };
    }
    let mut points = name
        .match_indices('.')
        .filter_map(|(at, _)| Some((name.get(..at)?, name.get(at.checked_add(1)?..)?)));
    let wavelength = points.find(|(_, rest)| wavelength_nm(rest).is_some());
    wavelength.or_else(|| name.rsplit_once('.')).unwrap_or(("", name))
}

/// The layer that all channels are in, or the only one with R, G and B: then what it is called does not matter.
fn layer_of_picture(channels: &[Channel]) -> Result<Option<String>> {
    let mut layers: Vec<&str> = channels.iter().map(|channel| split_layer(&channel.name).0).collect();
    layers.sort_unstable();
    layers.dedup();
    let has =
        |layer: &str, colour: &str| channels.iter().any(|one| split_layer(&one.name) == (layer, colour));
    let with_colours = layers.iter().filter(|layer| RGB.iter().all(|colour| has(layer, colour)));
    let polarised = layers.iter().any(|layer| matches!(*layer, "S1" | "S2" | "S3"));
    match (layers.as_slice(), with_colours.collect::<Vec<_>>().as_slice()) {
        ([], _) => Ok(None),
        (&[only], _) | (_, &[&only]) if !polarised => {
            Ok(Some(only.to_owned()).filter(|only| !only.is_empty()))
        }
        _ => Err(unsupported(
            format!("the layers {layers:?}"),
            "channels without layers, or of one layer, or one layer with R, G and B",
        )),
    }
}

const RGB: [&str; 3] = ["R", "G", "B"];

/// What each channel of the picture's layer is: beside R, G and B, or X, Y and Z, or Y, only wavelengths and bands are
/// colours too. Without these all are.
fn give_roles(channels: &mut [&mut Channel]) -> Result<()> {
    let has = |name: &&str| channels.iter().any(|channel| channel.shown == *name);
    let colours: &[&str] = match [&RGB[..], &["X", "Y", "Z"], &["Y"]].iter().find(|list| list.iter().all(has))
    {
        Some(["Y"]) if has(&"RY") || has(&"BY") => {
            return Err(unsupported("luminance with chroma (Y, RY, BY)", "R, G and B"));
        }
        found => found.copied().unwrap_or_default(),
    };
    for channel in channels {
        let name = channel.shown.as_str();
        let of_light =
            wavelength_nm(name).is_some() || BANDS.iter().any(|band| name.eq_ignore_ascii_case(band));
        channel.role = match name {
            "A" => Role::Alpha,
            _ if colours.is_empty() || colours.contains(&name) || of_light => Role::Colour,
            _ => Role::LeftOut,
        };
    }
    Ok(())
}

/// R, G, B; then Y, or X, Y, Z; then wavelengths from short to long; then others by name.
fn order_of(channels: &[Channel]) -> Vec<usize> {
    let rank = |name: &str| -> (u8, f64) {
        match (name, wavelength_nm(name)) {
            ("R", _) => (0, 0.0),
            ("G", _) => (1, 0.0),
            ("B", _) => (2, 0.0),
            ("X", _) => (3, 0.0),
            ("Y", _) => (4, 0.0),
            ("Z", _) => (5, 0.0),
            (_, Some(wavelength)) => (6, wavelength),
            _ => (7, 0.0),
        }
    };
    let mut order: Vec<usize> = Vec::new();
    order.extend(
        channels
            .iter()
            .enumerate()
            .filter(|(_, channel)| channel.role == Role::Colour)
            .map(|(number, _)| number),
    );
    // Stable, so that equal ranks stay in the order of their names.
    order.sort_by(|&a, &b| {
        let of =
            |number| channels.get(number).map_or((u8::MAX, 0.0), |channel: &Channel| rank(&channel.shown));
        let ((a_rank, a_nm), (b_rank, b_nm)) = (of(a), of(b));
        a_rank.cmp(&b_rank).then(a_nm.total_cmp(&b_nm))
    });
    order
}
