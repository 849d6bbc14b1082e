//! Any bytes as a Bonn container: no panic, images of the size that was announced, nothing for a file cut short.
#![no_main]

use btfkit_formats::bonn::{Archive, OpenOptions, recognise};
use btfkit_formats::{Images, Limits};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut limits = Limits::default();
    limits.max_decoded_bytes = 1 << 20;
    let options = OpenOptions::default();
    let Ok(archive) = Archive::open(bytes, &options, &limits) else { return };
    assert_eq!(recognise(bytes), Some(archive.kind()));
    assert!(Archive::open(&bytes[..bytes.len() - 1], &options, &limits).is_err());
    let contents = archive.contents();
    let (views, lights) = (contents.views.len(), contents.lights.len());
    let image = contents.width as usize * contents.height as usize * contents.channels.len();
    for (view, lights) in [(0, 0..1), (views - 1, 0..lights)] {
        let number = lights.len();
        if let Ok(samples) = archive.read_images(bytes, view, lights) {
            assert_eq!(samples.len(), number * image);
            assert_eq!(samples.sample_type(), contents.sample_type);
            assert!(samples.to_f32().iter().all(|value| value.is_finite()));
        }
    }
});
