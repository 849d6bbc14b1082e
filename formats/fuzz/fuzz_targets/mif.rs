//! Any bytes as a MIF file, and any text as its description: no panic, and no more samples than the bytes hold for each light.
#![no_main]

use btfkit_formats::mif::{Mif, Options, recognise};
use btfkit_formats::{Images, Limits};
use libfuzzer_sys::fuzz_target;

fn read(bytes: &[u8]) {
    let Ok(mif) = Mif::open(bytes, &Options::default(), &Limits::default()) else { return };
    assert!(recognise(bytes));
    for light in 0..mif.contents().lights.len() {
        assert!(mif.read_images(bytes, 0, light..light + 1).unwrap().len() <= bytes.len());
    }
}

fuzz_target!(|bytes: &[u8]| {
    read(bytes);
    // The same bytes as the XML of a file of two images.
    let chunk = |kind: u64, data: &[u8]| [&kind.to_le_bytes()[..], &(data.len() as u64).to_le_bytes(), data].concat();
    let image = |index: u64| [index, 0, 1, 1, 1, 1].map(u64::to_le_bytes).concat();
    let image = |index: u64| chunk(0, &[image(index), vec![7]].concat());
    let mut file = b"MIF FILE".to_vec();
    file.extend([8u64, 1].map(u64::to_le_bytes).concat());
    file.extend([image(0), image(1), chunk(1, bytes)].concat());
    read(&file);
});
