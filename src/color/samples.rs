//! Samples as light: on one scale whatever their type, and linear whatever their transfer curve.

use std::ops::Range;

use btfkit_formats::Samples;

use super::{Transfer, srgb_decode};

/// A run of samples as they are, on the scale where the largest integer and the float 1.0 are reflectance 1.
pub(crate) fn scaled(samples: &Samples, range: Range<usize>) -> Vec<f32> {
    match samples {
        Samples::U8(list) => list[range].iter().map(|&s| f32::from(s) / 255.0).collect(),
        Samples::U16(list) => list[range].iter().map(|&s| f32::from(s) / 65535.0).collect(),
        Samples::F16(list) => list[range].iter().map(|&s| s.to_f32()).collect(),
        Samples::F32(list) => list[range].to_vec(),
    }
}

/// Linear reflectance of a run of samples. The sRGB curve goes on above 1 as it is, below 0 as a straight line.
pub fn linear(samples: &Samples, range: Range<usize>, transfer: Transfer) -> Vec<f32> {
    match (samples, transfer) {
        (Samples::U8(list), _) => {
            let table: [f32; 256] = std::array::from_fn(|code| transfer.decode(code as f64 / 255.0) as f32);
            list[range].iter().map(|&s| table[usize::from(s)]).collect()
        }
        (_, Transfer::Linear) => scaled(samples, range),
        (_, Transfer::Srgb) => {
            scaled(samples, range).into_iter().map(|s| srgb_decode(f64::from(s)) as f32).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use btfkit_formats::f16;

    #[test]
    fn every_sample_type_gives_the_same_light() {
        let codes = [0u8, 51, 102, 255];
        let kinds = [
            Samples::U8(codes.to_vec()),
            Samples::U16(codes.iter().map(|&c| u16::from(c) * 257).collect()),
            Samples::F16(codes.iter().map(|&c| f16::from_f32(f32::from(c) / 255.0)).collect()),
            Samples::F32(codes.iter().map(|&c| f32::from(c) / 255.0).collect()),
        ];
        for samples in &kinds {
            for (transfer, expected) in
                [(Transfer::Srgb, [0.0331, 0.1329, 1.0]), (Transfer::Linear, [0.2, 0.4, 1.0])]
            {
                let found = linear(samples, 1..4, transfer);
                assert!(
                    found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 2e-4),
                    "{found:?} {expected:?}"
                );
            }
        }
        let bright = linear(&Samples::F32(vec![2.0, -0.1]), 0..2, Transfer::Srgb);
        assert!((bright[0] - 4.954).abs() < 0.01 && (bright[1] + 0.1 / 12.92).abs() < 1e-6, "{bright:?}");
    }
}
