//! Any bytes as a PNG; see `picture_rules`.
#![no_main]

mod picture_rules;

use btfkit_formats::picture::Format;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| picture_rules::hold(bytes, Format::Png, b"\x89PNG\r\n\x1A\n"));
