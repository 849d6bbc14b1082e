//! Any bytes as a light list: no panic, lights above the surface, files inside the folder, one line for each light.
#![no_main]

use btfkit_formats::{Limits, rti};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Ok(list) = rti::read_lp(bytes, &Limits::default()) else { return };
    assert!(!list.lamps.is_empty());
    assert!(list.lamps.windows(2).all(|pair| pair[0].line < pair[1].line));
    for lamp in &list.lamps {
        assert!((0.0..=90.0).contains(&lamp.light.theta_deg()));
        if let Some(file) = &lamp.file {
            assert!(!file.is_empty() && !file.starts_with('/') && !file.contains('\\'));
            assert!(file.split('/').all(|part| part != ".." && !part.is_empty()));
        }
    }
});
