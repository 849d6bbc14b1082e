//! Any bytes as a TIFF; see `picture_rules`.
#![no_main]

mod picture_rules;

use btfkit_formats::picture::Format;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| picture_rules::hold(bytes, Format::Tiff, b"II\x2A\0\x08\0\0\0"));
