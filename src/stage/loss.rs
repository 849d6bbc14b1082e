//! What a format cannot hold of the values that are put into it, said by everything that converts: pictures, pyramids
//! and archives in the formats of others.

use std::sync::Mutex;

use btfkit_formats::picture::wavelength_nm;
use btfkit_formats::{SampleType, Samples};

use crate::color::Remarkable;
use crate::picture::Meaning;
use crate::store::measurement::Description;
use crate::words::counted;

/// Values that display codes, from black to white, do not hold. They are counted by whoever encodes them.
#[derive(Debug, Default)]
pub struct Beyond(Mutex<Remarkable>);

/// How many samples are not finite.
pub(crate) fn not_finite(samples: &Samples) -> u64 {
    match samples {
        Samples::U8(_) | Samples::U16(_) => 0,
        Samples::F16(list) => list.iter().filter(|sample| !sample.is_finite()).count() as u64,
        Samples::F32(list) => list.iter().filter(|sample| !sample.is_finite()).count() as u64,
    }
}

impl Beyond {
    /// Counts linear values, in which 1 is white.
    pub fn count(&self, values: impl IntoIterator<Item = f64>) {
        let mut found = Remarkable::default();
        for value in values {
            let finite = value.is_finite();
            found.clipped += u64::from(finite && value > 1.0);
            found.negative += u64::from(finite && value < 0.0);
            found.not_finite += u64::from(!finite);
        }
        *self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner) += found;
    }

    /// Counts samples that are not finite, which count as black before they get here.
    pub(crate) fn count_not_finite(&self, count: u64) {
        let mut found = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        found.not_finite += count;
    }

    /// Counts pixels, if they are light.
    pub(crate) fn count_pixels(&self, meaning: Meaning, pixels: &[[f32; 3]]) {
        if meaning == Meaning::Linear {
            self.count(pixels.as_flattened().iter().map(|&value| f64::from(value)));
        }
    }

    /// What became of them, a sentence; none where there are none.
    pub fn notes(&self) -> Vec<String> {
        let found = *self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let parts = [
            (found.clipped, "above white (1), stored as white"),
            (found.negative, "below 0, stored as black"),
            (found.not_finite, "not finite, stored as black"),
        ];
        let parts = parts.into_iter().filter(|&(count, _)| count > 0);
        let parts: Vec<String> =
            parts.map(|(count, what)| format!("{} {what}", counted(count, "value"))).collect();
        if parts.is_empty() { Vec::new() } else { vec![format!("not held: {}", parts.join("; "))] }
    }
}

/// What a format of pictures takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Takes {
    /// The most bits of a sample.
    pub bits: u8,
    /// Whether it says what the channels are beside grey or red, green and blue.
    pub names: bool,
    /// Whether other channels are made red, green and blue.
    pub mixes: bool,
    /// Whether it says that samples are linear.
    pub linear: bool,
}

/// What a format does not hold of a measurement, whatever its values are, a sentence each.
pub(crate) fn of_format(description: &Description, takes: Takes) -> Vec<String> {
    let mut notes = Vec::new();
    let bits = match description.sample_type {
        SampleType::U8 => 8,
        SampleType::U16 | SampleType::F16 => 16,
        SampleType::F32 => 32,
    };
    if bits > takes.bits {
        notes.push(format!(
            "not held: {} samples became {}-bit sRGB codes",
            description.sample_type.name(),
            takes.bits
        ));
    }
    let channels = &description.channels;
    let spectral = channels.iter().any(|name| wavelength_nm(name).is_some());
    let what = if spectral { "the wavelengths" } else { "the names" };
    if !takes.names && (spectral || !is_plain(channels)) {
        let become_rgb = if takes.mixes && channels.len() > 1 { "; they became R, G and B" } else { "" };
        let first_last = match channels.as_slice() {
            [first, .., last] => format!("{}, {first} to {last}", counted(channels.len(), "channel")),
            _ => format!("channel {}", channels.concat()),
        };
        notes.push(format!("not held: {what} of {first_last}{become_rgb}"));
    }
    if !takes.linear && description.transfer == crate::color::Transfer::Linear {
        notes.push("not held: that samples are linear; import it with --transfer linear".to_owned());
    }
    notes
}

/// One channel, or red, green and blue.
fn is_plain(channels: &[String]) -> bool {
    channels.len() == 1 || channels == ["R", "G", "B"]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_display_values_do_not_hold_is_counted_and_nothing_is_said_of_the_rest() {
        let beyond = Beyond::default();
        beyond.count([0.0, 1.0, 0.5]);
        beyond.count_pixels(Meaning::Display, &[[2.0, -1.0, f32::NAN]]);
        assert!(Beyond::default().notes().is_empty() && beyond.notes().is_empty());
        let beyond = Beyond::default();
        beyond.count_pixels(Meaning::Linear, &[[2.0, -1.0, f32::NAN], [1.5, 0.0, 0.0]]);
        let told = "not held: 2 values above white (1), stored as white; 1 value below 0, stored as black; \
            1 value not finite, stored as black";
        assert_eq!(beyond.notes(), [told]);
    }
}
