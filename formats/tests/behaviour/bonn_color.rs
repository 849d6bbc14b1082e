//! Bonn's colour models, each against its formula in f64.

use btfkit_formats::bonn::{Archive, ColorModel, OpenOptions};
use btfkit_formats::{ErrorKind, Images, Limits, Result};

use crate::bonn_support::{Btf, directions, put_f32s, put_scalars, put_u32s};

/// What a DFMF file of one pixel and one pair, whose stored channels are these, is read as.
fn read(model: i32, stored: &[f64]) -> Result<Vec<f32>> {
    let channels = (0..stored.len()).map(|c| c.to_string()).collect();
    let one = directions(1);
    let btf = Btf { channels, views: one.clone(), lights: one, width: 1, height: 1, ..Btf::small() };
    let mut bytes = btf.head("!DFMF08FCR", true);
    put_u32s(&mut bytes, &[1]);
    bytes.extend(model.to_le_bytes());
    put_f32s(&mut bytes, &[0.25, 0.5, -0.25, 1.0, 2.0, 3.0, -1.0, 0.5, 0.0, 0.0, 4.0, 1.0]);
    for &value in stored {
        bytes.push(8);
        put_u32s(&mut bytes, &[1, 1, 1]);
        put_scalars(&mut bytes, 8, &[1.0, value, 1.0]);
    }
    let archive = Archive::open(&bytes, &OpenOptions::default(), &Limits::default())?;
    Ok(archive.read_images(&bytes, 0, 0..1)?.to_f32())
}

#[track_caller]
fn check(model: i32, stored: &[f64], expected: &[f64], tolerance: f64) {
    let values = read(model, stored).unwrap();
    assert_eq!(values.len(), expected.len());
    for (&value, expected) in values.iter().zip(expected) {
        let error = (f64::from(value) - expected).abs();
        assert!(error <= tolerance * expected.abs().max(1.0), "model {model}: {values:?}, not {expected}");
    }
}

fn yuv(y: f64, u: f64, v: f64) -> [f64; 3] {
    [y + 1.13983 * v, y - 0.39465 * u - 0.5806 * v, y + 2.03211 * u]
}

#[test]
fn every_colour_model_is_undone() {
    let (a, b, c) = (0.7f64, -0.3f64, 0.2f64);
    let epsilon = 1e-5;
    check(0, &[a, b, c], &[a, b, c], 1e-6);
    check(1, &[a, b, c], &yuv(a, b, c), 1e-6);
    let pca = [a - b + 0.25, 2.0 * a + 0.5 * b + 4.0 * c + 0.5, 3.0 * a + c - 0.25];
    check(3, &[a, b, c], &pca, 1e-6);
    check(4, &[a, b, c], &[a + b - c, a + c, a - b - c], 1e-6);
    check(9, &[a, b, c], &yuv(a.exp() - epsilon, b, c), 1e-6);
    let (u, v) = (-(0.3f64.exp()) * epsilon, 0.2f64.exp() * epsilon);
    check(10, &[-9.0, b, c], &yuv((-9.0f64).exp() - epsilon, u, v), 1e-9);
    check(10, &[a, 0.0, 11.0], &yuv(a.exp() - epsilon, 0.0, 11.0f64.exp() * epsilon), 1e-6);
    let y = a.exp() - epsilon;
    check(11, &[a, b, c], &yuv(y, b * (y + epsilon), c * (y + epsilon)), 1e-6);
    check(12, &[a, b, c], &[a.exp() - epsilon, b.exp() - epsilon, c.exp() - epsilon], 1e-6);
}

#[test]
fn spectral_models_are_undone_for_any_number_of_channels() {
    let (s, others) = (2.0, [0.1, 0.2, 0.3, 0.05]);
    let stored = |number: usize| [&[s], &others[..number]].concat();
    for number in [1, 2, 4] {
        let (n, sum) = (number as f64 + 1.0, others[..number].iter().sum::<f64>());
        let shares = others[..number].iter().map(|v| v * s);
        check(5, &stored(number), &[vec![(1.0 - sum) * s], shares.collect()].concat(), 1e-6);
        let deviations = others[..number].iter().map(|v| n * s * (1.0 + v));
        check(6, &stored(number), &[vec![n * s - sum / n], deviations.collect()].concat(), 1e-6);
        check(12, &stored(number), &stored(number).iter().map(|v| v.exp() - 1e-5).collect::<Vec<_>>(), 1e-6);
    }
    check(5, &[0.5], &[0.5], 1e-6);
}

#[test]
fn lab_is_undone_to_linear_srgb() {
    check(2, &[100.0, 0.0, 0.0], &[1.0, 1.0, 1.0], 2e-3);
    check(2, &[0.0, 0.0, 0.0], &[0.0, 0.0, 0.0], 1e-6);
    // Lab of the sRGB primaries for D50, as colour tables have them.
    check(2, &[54.29, 80.81, 69.89], &[1.0, 0.0, 0.0], 4e-3);
    check(2, &[87.82, -79.29, 80.99], &[0.0, 1.0, 0.0], 4e-3);
    check(2, &[29.57, 68.30, -112.03], &[0.0, 0.0, 1.0], 4e-3);
    // L* = 5 lies on the linear foot: Y = 5 / 903.3.
    check(2, &[5.0, 0.0, 0.0], &[5.0 / 903.3; 3], 2e-5);
}

#[test]
fn models_that_are_not_known_or_do_not_fit_are_refused() {
    for model in [-1, 7, 8, 13, i32::MAX] {
        assert_eq!(read(model, &[0.0; 3]).unwrap_err().kind(), ErrorKind::Unsupported, "{model}");
    }
    for model in [1, 2, 3, 4, 9, 10, 11] {
        for channels in [1, 2, 4] {
            let error = read(model, &vec![0.0; channels]).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Malformed, "{model}, {channels}");
        }
    }
}

#[test]
fn what_is_applied_is_undone() {
    let colours = [[0.2f32, 0.5, 0.9], [1.0, 0.0, 0.0], [0.0, 0.0, 2.5], [40.0, 30.0, 1e-3], [0.0; 3]];
    for rgb in colours {
        let mut stored = rgb;
        ColorModel::LogYRatios.apply(&mut stored).unwrap();
        let stored = stored.map(f64::from);
        check(11, &stored, &rgb.map(f64::from), 1e-5);
    }
    assert_eq!(ColorModel::Yuv.apply(&mut [0.0; 3]).unwrap_err().kind(), ErrorKind::Argument);
}
