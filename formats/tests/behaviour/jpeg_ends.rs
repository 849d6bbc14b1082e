//! Data of a JPEG that end before those of the picture do, or go on behind them, wherever an interval of them ends.

use btfkit_formats::Limits;
use btfkit_formats::jpeg::{Chroma, EncodeOptions, decode};

use crate::support::{jpeg_of, options};

/// Noise of 48 x 64 pixels with a restart marker every five coded units.
fn with_restarts(progressive: bool, half: bool) -> Vec<u8> {
    let samples: Vec<u8> = (0u32..48 * 64 * 3).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let mut out = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut out, 80);
    encoder.set_progressive(progressive);
    encoder.set_restart_interval(5);
    let sampling =
        if half { jpeg_encoder::SamplingFactor::F_2_2 } else { jpeg_encoder::SamplingFactor::F_1_1 };
    encoder.set_sampling_factor(sampling);
    encoder.encode(&samples, 48, 64, jpeg_encoder::ColorType::Rgb).unwrap();
    out
}

/// Where data end: at restart markers, and at whatever else follows a scan. The first scan's number of them too.
fn ends(jpeg: &[u8]) -> (Vec<usize>, usize) {
    let (mut at, mut ends, mut first) = (2, Vec::new(), None);
    while jpeg[at + 1] != 0xD9 {
        let is_scan = jpeg[at + 1] == 0xDA;
        at += 2 + usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]]));
        while is_scan && (jpeg[at] != 0xFF || matches!(jpeg[at + 1], 0 | 0xD0..=0xD7)) {
            if jpeg[at] == 0xFF && jpeg[at + 1] != 0 {
                ends.push(at);
                at += 1;
            }
            at += 1;
        }
        if is_scan {
            ends.push(at);
            first.get_or_insert(ends.len());
        }
    }
    (ends, first.unwrap())
}

fn is_refused(jpeg: &[u8]) -> bool {
    decode(jpeg, &Limits::default()).is_err()
}

#[test]
fn data_that_are_missing_anywhere_are_noticed() {
    for (progressive, half) in [(false, false), (false, true), (true, false), (true, true)] {
        let whole = with_restarts(progressive, half);
        assert!(!is_refused(&whole));
        let (ends, first) = ends(&whole);
        assert!(ends.len() > 2);
        for (number, &end) in ends.iter().enumerate() {
            // The first scan of a progressive file, its means, is read to the last block.
            let least = if progressive && number < first { 1 } else { 4 };
            let cut = (end - 5..=end - least).rev().find(|&cut| whole[cut - 1] != 0xFF).unwrap();
            let shorter = [&whole[..cut], &whole[end..]].concat();
            assert!(is_refused(&shorter), "interval {number}, progressive {progressive}, half {half}");
        }
    }
}

#[test]
fn a_frame_of_fewer_rows_than_the_data_hold_is_noticed() {
    let mut all = vec![with_restarts(false, false), with_restarts(false, true), with_restarts(true, true)];
    for progressive in [false, true] {
        for (channels, chroma) in [(1, Chroma::Full), (3, Chroma::Full), (3, Chroma::Half)] {
            all.push(jpeg_of(80, 64, channels, &options(90, progressive, chroma)));
        }
    }
    all.push(jpeg_of(256, 64, 3, &EncodeOptions::UBO2003));
    for (number, whole) in all.into_iter().enumerate() {
        assert!(!is_refused(&whole), "{number}");
        let frame =
            whole.windows(4).position(|four| matches!(four, [0xFF, 0xC0 | 0xC2, 0, 11 | 17])).unwrap();
        for rows in [48u16, 32, 16] {
            let mut fewer = whole.clone();
            fewer[frame + 5..frame + 7].copy_from_slice(&rows.to_be_bytes());
            assert!(is_refused(&fewer), "{number}: {rows} rows");
        }
    }
}

#[test]
fn bytes_that_fill_up_a_file_are_no_data() {
    let whole = with_restarts(false, true);
    let (data, end) = whole.split_at(whole.len() - 2);
    assert!(!is_refused(&[data, &[0; 100], end].concat()));
    assert!(!is_refused(&[data, &[0xFF; 100], end].concat()));
    assert!(is_refused(&[data, &[7; 100], end].concat()));
}
