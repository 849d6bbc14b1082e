//! Any bytes as a JPEG: no panic, samples only for bytes that earn them, no image that stays whole when cut.
#![no_main]

use btfkit_formats::{Limits, jpeg};
use libfuzzer_sys::fuzz_target;

/// A block of 64 pixels takes at least one bit, and a pixel has at most three samples.
const MAX_SAMPLES_PER_BYTE: usize = 8 * 64 * 3;

fuzz_target!(|bytes: &[u8]| {
    let mut limits = Limits::default();
    limits.max_pixels_per_image = 1 << 18;
    let Ok(image) = jpeg::decode(bytes, &limits) else { return };
    let samples = image.width as usize * image.height as usize * usize::from(image.channels);
    assert_eq!(image.samples.len(), samples);
    assert!(samples <= MAX_SAMPLES_PER_BYTE * bytes.len());
    assert_eq!(jpeg::header(bytes, &limits).unwrap().width, image.width);
    let end = bytes.iter().rposition(|&byte| byte != 0).unwrap();
    assert!(jpeg::check(&bytes[..end], &limits).is_err());
});
