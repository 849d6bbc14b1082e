//! The rotation of the channels: brightness apart from colour.

/// The orthonormal DCT-II matrix of so many channels, [rotated channel][channel]. Of three channels its rows are
/// brightness, (1, 1, 1) / sqrt 3, and two differences of colours, (1, 0, -1) / sqrt 2 and (1, -2, 1) / sqrt 6; of
/// wavelengths they are brightness, slope, curvature and so on of the spectrum.
pub(crate) fn rotation(count: usize) -> Vec<Vec<f64>> {
    let row = |frequency: usize| -> Vec<f64> {
        let scale = ((if frequency == 0 { 1.0 } else { 2.0 }) / count as f64).sqrt();
        let angle =
            |place: usize| core::f64::consts::PI * ((2 * place + 1) * frequency) as f64 / (2 * count) as f64;
        (0..count).map(|place| scale * libm::cos(angle(place))).collect()
    };
    (0..count).map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_channels_are_rotated_to_brightness_and_two_differences() {
        let expected = [[1.0, 1.0, 1.0], [1.0, 0.0, -1.0], [1.0, -2.0, 1.0]];
        for (row, expected) in rotation(3).iter().zip(expected) {
            let norm = expected.iter().map(|v: &f64| v * v).sum::<f64>().sqrt();
            assert!(row.iter().zip(expected).all(|(a, b)| (a - b / norm).abs() < 1e-12));
        }
        assert_eq!(rotation(1), [[1.0]]);
    }
}
