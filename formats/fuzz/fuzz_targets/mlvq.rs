//! Any bytes as an MLVQ database: no panic, and tables no larger than the bytes earn.
#![no_main]

use btfkit_formats::mlvq::{Database, ZeroBytes, recognise};
use btfkit_formats::{Images, Limits};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut limits = Limits::default();
    limits.max_pixels_per_image = 1 << 18;
    let Ok(database) = Database::open(bytes, &ZeroBytes::default(), &limits) else { return };
    assert!(recognise(bytes));
    let contents = database.contents();
    let samples = contents.width as usize * contents.height as usize * 3;
    assert!(samples <= 3 * bytes.len());
    assert_eq!(database.read_images(bytes, 57, 3..5).unwrap().len(), 2 * samples);
});
