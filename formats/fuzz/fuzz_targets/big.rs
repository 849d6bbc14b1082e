//! Any bytes as a BIG file: no panic, and no more samples than the bytes hold.
#![no_main]

use btfkit_formats::big::{Big, Options, recognise};
use btfkit_formats::utia::Order;
use btfkit_formats::{Images, Limits};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let limits = Limits::default();
    for order in [Order::Stated, Order::Ubo81, Order::Uniform] {
        let mut options = Options::default();
        options.order = order;
        let Ok(big) = Big::open(bytes, &options, &limits) else { continue };
        assert!(recognise(bytes));
        let (views, lights) = (big.contents().views.len(), big.contents().lights.len());
        for view in [0, views - 1] {
            assert!(big.read_images(bytes, view, 0..lights).unwrap().len() <= bytes.len());
        }
    }
});
