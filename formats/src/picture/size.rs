//! The size that a header claims, held against [`Limits`] before anything is allocated.

use crate::words::counted;
use crate::{Error, ErrorKind, Limits, Result, SampleType};

/// Columns, rows and channels of a picture, all at least 1 and within the limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Size {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) channels: usize,
}

impl Size {
    /// `stored` counts every channel in the file, dropped ones too.
    pub(super) fn within(
        (width, height): (u64, u64),
        stored: u64,
        sample_type: SampleType,
        at: usize,
        limits: &Limits,
    ) -> Result<Size> {
        if width == 0 || height == 0 || stored == 0 {
            let found = format!("{width} x {height} pixels of {}", counted(stored, "channel"));
            return Err(Error::malformed(found, "at least 1 x 1 pixels of 1 channel").at(at));
        }
        let pixels = width.saturating_mul(height);
        let samples = pixels.saturating_mul(stored);
        let bytes = samples.saturating_mul(u64::try_from(sample_type.bytes()).unwrap_or(u64::MAX));
        for (claimed, most, unit, name) in [
            (pixels, limits.max_pixels_per_image, "pixels", "max_pixels_per_image"),
            (stored, limits.max_channels, "channels", "max_channels"),
            (bytes, limits.max_decoded_bytes, "bytes", "max_decoded_bytes"),
        ] {
            if claimed > most {
                let found =
                    format!("{width} x {height} pixels of {}, {claimed} {unit}", counted(stored, "channel"));
                let expected = format!("at most {most} {unit} ({name})");
                return Err(Error::new(ErrorKind::Limit, found, expected).at(at));
            }
        }
        let too_large = || {
            let found = format!("{width} x {height} pixels of {}", counted(stored, "channel"));
            Error::new(ErrorKind::Limit, found, "a size that this machine can address").at(at)
        };
        let (Ok(width), Ok(height), Ok(channels), Ok(_)) =
            (u32::try_from(width), u32::try_from(height), usize::try_from(stored), usize::try_from(bytes))
        else {
            return Err(too_large());
        };
        Ok(Size { width, height, channels })
    }

    pub(super) fn pixels(self) -> usize {
        // Both factors were multiplied without overflow when the value was made.
        usize::try_from(u64::from(self.width).saturating_mul(u64::from(self.height))).unwrap_or(usize::MAX)
    }

    pub(super) fn samples(self) -> usize {
        self.pixels().saturating_mul(self.channels)
    }
}

/// An [`ErrorKind::Unsupported`].
pub(super) fn unsupported(
    found: impl Into<Box<str>>,
    expected: impl Into<std::borrow::Cow<'static, str>>,
) -> Error {
    Error::new(ErrorKind::Unsupported, found, expected)
}
