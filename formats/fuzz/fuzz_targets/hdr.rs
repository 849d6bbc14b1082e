//! Any bytes as a Radiance picture; see `picture_rules`.
#![no_main]

mod picture_rules;

use btfkit_formats::picture::Format;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| picture_rules::hold(bytes, Format::Hdr, b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"));
