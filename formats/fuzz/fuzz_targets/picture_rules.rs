//! What holds of any bytes read as a picture.

use btfkit_formats::Limits;
use btfkit_formats::picture::{Format, check, decode, header, recognise};

/// Reads `bytes`, after `start` unless they are of the format already: no panic, samples as many as the header says, and
/// nothing that decodes but fails the check.
pub fn hold(bytes: &[u8], format: Format, start: &[u8]) {
    let whole = if recognise(bytes) == Some(format) { bytes.to_vec() } else { [start, bytes].concat() };
    let mut limits = Limits::default();
    limits.max_pixels_per_image = 1 << 16;
    limits.max_channels = 64;
    limits.max_decoded_bytes = 1 << 22;
    let Ok(picture) = decode(&whole, &limits) else { return };
    let checked = check(&whole, &limits).unwrap();
    assert_eq!(checked, header(&whole, &limits).unwrap());
    assert_eq!((checked.width, checked.height), (picture.width, picture.height));
    assert_eq!(checked.channels, picture.channels);
    assert_eq!(checked.sample_type, picture.samples.sample_type());
    assert_eq!(picture.samples.len(), picture.width as usize * picture.height as usize * picture.channels.len());
}
