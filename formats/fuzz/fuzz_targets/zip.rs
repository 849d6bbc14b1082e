//! Any bytes as a zip: no panic, and what is read has the declared size.
#![no_main]

use btfkit_formats::{Limits, zip::ZipIndex};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut limits = Limits::default();
    limits.max_entry_bytes = 1 << 20;
    let Ok(index) = ZipIndex::open(bytes, &limits) else { return };
    for (i, entry) in index.entries().iter().enumerate() {
        if let Ok(data) = index.read(bytes, i) {
            assert_eq!(data.len() as u64, entry.uncompressed_bytes());
        }
    }
});
