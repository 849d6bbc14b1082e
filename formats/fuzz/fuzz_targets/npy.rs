//! Any bytes as an array, with a list of directions before it: no panic, and no more samples than bytes.
#![no_main]

use btfkit_formats::npy::{Archive, Beside, directions};
use btfkit_formats::{Direction, Images, Limits};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let limits = Limits::default();
    if let Ok(list) = directions(bytes, &limits) {
        assert!(list.len() <= bytes.len());
        assert!(list.iter().all(|d| (0.0..1.6).contains(&d.theta_rad) && d.phi_rad.is_finite()));
    }
    let Some((&count, array)) = bytes.split_first() else { return };
    let list = (0..count).map(|i| Direction { theta_rad: 0.005 * f64::from(i), phi_rad: 1.0 }).collect();
    let beside = Beside { views: None, lights: Some(list), channels: None };
    let Ok(archive) = Archive::open(array, beside, &limits) else { return };
    let lights = archive.contents().lights.len();
    assert_eq!(lights, usize::from(count));
    let samples = archive.read_images(array, 0, 0..lights).unwrap();
    assert!(samples.len() <= array.len());
});
