//! Words for numbers in messages.

pub use btfkit_formats::words::counted;
