//! Any bytes as an OpenEXR file; see `picture_rules`.
#![no_main]

mod picture_rules;

use btfkit_formats::picture::Format;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| picture_rules::hold(bytes, Format::Exr, b"\x76\x2F\x31\x01\x02\0\0\0"));
