#![allow(clippy::unwrap_used)]
use nalgebra::DMatrix;

use super::*;
use crate::method::field::model::tests::single;
use crate::method::field::raster::{Boundary, Field};
use crate::method::field::{CarKind, pyramid};

/// Three levels of two channels with different fields.
fn model() -> Model {
    let sites = [[0, 1], [1, 0], [1, -1]];
    let gamma = [0.5, 0.1, 0.3, 0.0, 0.1, -0.05, -0.2, 0.4, 0.1, 0.3, 0.0, 0.1];
    let mut model = single(CarKind::Car3d, &sites, &gamma, &[1.0, 0.4, 0.4, 0.5]);
    model.mean = vec![0.25, -3.0];
    for factor in [0.9, -0.7] {
        let mut level = model.levels[0].clone();
        level.gamma *= factor;
        model.levels.push(level);
    }
    model
}

fn endless(model: &Model, seed: u64, height: usize, width: usize) -> Synthesis {
    Synthesis::new(model, seed, height, width, Extent::Endless, Kernel::fastest()).unwrap()
}

fn wrapping(model: &Model, seed: u64, height: usize, width: usize) -> Synthesis {
    Synthesis::new(model, seed, height, width, Extent::Wrapping, Kernel::fastest()).unwrap()
}

/// The next rows, interleaved.
fn pulled(synthesis: &mut Synthesis, height: usize) -> Field {
    let (channels, width) = (synthesis.mean.len(), synthesis.width);
    let mut row = vec![0.0; channels * width];
    let mut samples = Vec::new();
    for _ in 0..height {
        synthesis.next_row(&mut row).unwrap();
        samples.extend((0..width * channels).map(|n| f64::from(row[n % channels * width + n / channels])));
    }
    Field::new(height, width, channels, samples).unwrap()
}

fn synthesised(model: &Model, seed: u64, height: usize, width: usize) -> Field {
    pulled(&mut endless(model, seed, height, width), height)
}

fn bits(field: &Field) -> Vec<u64> {
    field.samples.iter().map(|value| value.to_bits()).collect()
}

#[test]
fn the_same_seed_gives_the_same_bytes_in_every_kernel_and_another_seed_does_not() {
    for model in [model(), scalar()] {
        for extent in [Extent::Endless, Extent::Wrapping] {
            let field = |seed, kernel| {
                bits(&pulled(&mut Synthesis::new(&model, seed, 36, 44, extent, kernel).unwrap(), 36))
            };
            let plain = field(5, Kernel::Plain);
            for kernel in Kernel::available() {
                assert!(field(5, kernel) == plain, "{kernel:?}, {extent:?}");
            }
            assert_ne!(field(6, Kernel::Plain), plain);
        }
    }
}

#[test]
fn rows_do_not_depend_on_how_they_are_pulled_nor_on_the_height() {
    let model = model();
    let whole = synthesised(&model, 5, 60, 33);
    for skipped in [1, 2, 7, 58] {
        let mut synthesis = endless(&model, 5, 2000, 33);
        synthesis.skip_rows(skipped).unwrap();
        assert_eq!(synthesis.position(), skipped);
        let row = pulled(&mut synthesis, 1);
        assert_eq!(row.samples, whole.samples[skipped * 66..(skipped + 1) * 66]);
    }
}

#[test]
fn a_restored_state_continues_the_field_from_any_row() {
    for model in [model(), scalar()] {
        for extent in [Extent::Endless, Extent::Wrapping] {
            let new = || Synthesis::new(&model, 5, 40, 36, extent, Kernel::fastest()).unwrap();
            let whole = pulled(&mut new(), 40);
            for position in [0, 1, 2, 5, 38, 40] {
                let (mut first, mut second) = (new(), new());
                first.skip_rows(position).unwrap();
                // What it is restored into has gone elsewhere.
                second.skip_rows(17).unwrap();
                let state = first.state();
                second.restore(&state).unwrap();
                assert_eq!((second.position(), second.state() == state), (position, true));
                if position < 40 {
                    let rest = pulled(&mut second, 40 - position);
                    assert!(whole.samples.ends_with(&rest.samples), "{extent:?} from row {position}");
                }
            }
        }
    }
}

#[test]
fn states_of_other_fields_are_refused() {
    let model = model();
    let mut synthesis = endless(&model, 5, 10, 33);
    synthesis.skip_rows(10).unwrap();
    let state = synthesis.state();
    assert!(endless(&model, 5, 9, 33).restore(&state).is_err());
    assert!(endless(&model, 5, 10, 34).restore(&state).is_err());
    assert!(synthesis.restore(&state[..state.len() - 4]).is_err());
    assert!(synthesis.restore(&[]).is_err());
    let mut damaged = state.clone();
    damaged.splice(20..24, f32::NAN.to_le_bytes());
    assert!(synthesis.restore(&damaged).is_err());
    synthesis.restore(&state).unwrap();
    let memory = Synthesis::memory_bytes(&model, 10, 33, Extent::Endless).unwrap();
    assert!(state.len() as u64 <= memory, "{} bytes of {memory}", state.len());
}

/// Against the pyramid of whole fields: the levels, made large enough that no border is near, collapse to the same.
#[test]
fn the_streamed_collapse_is_that_of_the_pyramid() {
    let model = model();
    let found = synthesised(&model, 9, 21, 24);
    // Fields on the lattices from (-16, -16), (-8, -8) and (-4, -4) on, in the coordinates of the output.
    let mut bands = Vec::new();
    for (k, level) in model.levels.iter().enumerate() {
        let start = 16 >> k;
        let (height, width) = (60_usize.div_ceil(1 << k), 64 >> k);
        let grid = endless(&model, 9, 21, 24).levels[k].place.grid;
        let hash = Hash::new(9, LEVEL_DOMAIN + k as u32);
        let mut lattice = Lattice::new(level, model.kind, hash, grid, Kernel::Plain).unwrap();
        let mut band = Field::new(height, width, 2, vec![0.0; height * width * 2]).unwrap();
        while lattice.next_row() < height as i32 - start {
            let y = lattice.next_row() + start;
            lattice.advance();
            for x in 0..width {
                let column = x as i32 - start;
                for c in 0..2 {
                    if y >= 0 && (0..grid.width as i32).contains(&(column - grid.first_column)) {
                        let mut value = [0.0];
                        lattice.copy(c, column, &mut value);
                        band.samples[(y as usize * width + x) * 2 + c] = f64::from(value[0]);
                    }
                }
            }
        }
        bands.push(band);
    }
    let whole = pyramid::collapse(&bands, Boundary::Mirrored).unwrap();
    for y in 0..21 {
        for x in 0..24 {
            for c in 0..2 {
                let expected = whole.texel(y + 16, x + 16)[c] + model.mean[c];
                assert!((found.texel(y, x)[c] - expected).abs() < 2e-6, "row {y}, column {x}");
            }
        }
    }
}

fn scalar() -> Model {
    let mut model = single(CarKind::Car2d, &[[0, 1], [1, 1]], &[0.5, 0.2, -0.4, 0.5], &[4.0, 1.0]);
    model.transform = Some(DMatrix::from_row_slice(2, 2, &[0.6, 0.8, -0.8, 0.6]));
    model.levels.push(model.levels[0].clone());
    model
}

#[test]
fn the_inverse_transformation_and_the_mean_are_applied() {
    let mut model = scalar();
    let turned = {
        model.mean = vec![10.0, 20.0];
        synthesised(&model, 3, 4, 5)
    };
    model.mean = vec![0.0; 2];
    model.transform = Some(DMatrix::identity(2, 2));
    let plain = synthesised(&model, 3, 4, 5);
    for (a, b) in plain.samples.chunks(2).zip(turned.samples.chunks(2)) {
        assert!((b[0] - (10.0 + 0.6 * a[0] - 0.8 * a[1])).abs() < 1e-5);
        assert!((b[1] - (20.0 + 0.8 * a[0] + 0.6 * a[1])).abs() < 1e-5);
    }
}

/// Sums of a channel of some rows: mean and mean square.
fn moments(samples: &[f64]) -> [f64; 2] {
    [1, 2].map(|power| samples.iter().map(|value| value.powi(power)).sum::<f64>() / samples.len() as f64)
}

#[test]
fn a_long_field_neither_fades_nor_drifts_and_its_edges_are_like_its_middle() {
    // Separable with a = b = 0.8: variance 1 / (1 - 0.64)^2. The sum of two levels, of which the coarser has a tenth.
    let mut model = single(CarKind::Car3d, &[[0, 1], [1, 0], [1, 1]], &[0.8, 0.8, -0.64], &[1.0]);
    let (height, width, part) = (65536, 64, 1000);
    let mut synthesis = endless(&model, 8, height, width);
    let first = pulled(&mut synthesis, part);
    synthesis.skip_rows(height - 2 * part).unwrap();
    let last = pulled(&mut synthesis, part);
    assert_eq!(synthesis.position(), height);
    // Correlation 0.8^n in both directions: sums of products of 64000 texels vary as those of some 64000 / 20.
    let variance = 1.0 / (0.36 * 0.36);
    for samples in [&first.samples, &last.samples] {
        let [mean, square] = moments(samples);
        assert!(mean.abs() < 0.45, "{mean}");
        assert!((square / variance - 1.0).abs() < 0.12, "{square} against {variance}");
    }
    model.levels.push(model.levels[0].clone());
    let field = synthesised(&model, 8, 4000, 200);
    let column = |x: usize| {
        let values: Vec<f64> = field.samples.iter().skip(x).step_by(200).copied().collect();
        moments(&values)[1]
    };
    let middle = (40..160).map(column).sum::<f64>() / 120.0;
    for x in [0, 199] {
        assert!((column(x) / middle - 1.0).abs() < 0.25, "column {x}: {} against {middle}", column(x));
    }
}

#[test]
fn wrong_sizes_and_unstable_models_are_refused() {
    let mut model = model();
    let new = |model: &Model, height, width, extent| {
        Synthesis::new(model, 1, height, width, extent, Kernel::Plain).map(|_| ())
    };
    assert!(new(&model, 0, 5, Extent::Endless).is_err());
    assert!(new(&model, 5, usize::MAX, Extent::Endless).is_err());
    assert!(new(&model, 6, 8, Extent::Wrapping).is_err());
    let mut synthesis = endless(&model, 1, 2, 5);
    assert!(synthesis.next_row(&mut [0.0; 9]).is_err());
    assert!(synthesis.skip_rows(3).is_err());
    synthesis.skip_rows(2).unwrap();
    assert!(synthesis.next_row(&mut [0.0; 10]).is_err());
    model.levels[1].gamma *= 3.0;
    assert!(new(&model, 5, 5, Extent::Endless).is_err());
}

/// Rows beyond the height of a field that wraps: those of its top again.
#[test]
fn a_wrapping_field_continues_with_its_own_top() {
    for (model, height, width) in [(model(), 24, 20), (scalar(), 16, 6), (model(), 4, 4)] {
        let mut synthesis = wrapping(&model, 5, height, width);
        synthesis.height = 3 * height;
        let rows = pulled(&mut synthesis, 3 * height);
        let row = |y: usize| &rows.samples[y * width * 2..(y + 1) * width * 2];
        for y in 0..2 * height {
            for (a, b) in row(y).iter().zip(row(y + height)) {
                assert!((a - b).abs() < 1e-5, "row {y}: {a}, {b}");
            }
        }
    }
}

/// A field of period `width` is that of twice the width with the noise of the first half again: its own equation holds
/// across the seam. Here: against an endless lattice whose noise repeats.
#[test]
fn columns_of_a_wrapping_field_are_generated_across_the_seam() {
    let model = model();
    let (height, width) = (24, 20);
    let level = &model.levels[0];
    let place = wrapping(&model, 5, height, width).levels[0].place;
    let mut lattice =
        Lattice::new(level, model.kind, Hash::new(5, LEVEL_DOMAIN), place.grid, Kernel::fastest()).unwrap();
    let z = |y: i32, x: i32, c: usize| {
        let mut one = [0.0];
        let (row, column) = (y.rem_euclid(height as i32), x.rem_euclid(width as i32));
        Hash::new(5, LEVEL_DOMAIN).normal_row(Kernel::Plain, row, column, c as u32, &mut one);
        f64::from(one[0])
    };
    let mut above = vec![[0.0_f64; 2]; width];
    let factor = [[1.0, 0.0], [0.4, (0.5_f64 - 0.16).sqrt()]];
    for y in place.grid.first_row..20 {
        lattice.advance();
        let row: Vec<[f64; 2]> = (0..width as i32)
            .map(|x| {
                [0, 1].map(|c| {
                    let mut value = [0.0];
                    lattice.copy(c, x, &mut value);
                    f64::from(value[0])
                })
            })
            .collect();
        for x in 0..width as i32 {
            let at = |row: &[[f64; 2]], x: i32| row[x.rem_euclid(width as i32) as usize];
            let neighbours = [at(&row, x - 1), at(&above, x), at(&above, x + 1)];
            for i in 0..2 {
                let mut expected = factor[i][0] * z(y, x, 0) + factor[i][1] * z(y, x, 1);
                for (s, neighbour) in neighbours.iter().enumerate() {
                    expected +=
                        level.gamma[(i, 2 * s)] * neighbour[0] + level.gamma[(i, 2 * s + 1)] * neighbour[1];
                }
                assert!((row[x as usize][i] - expected).abs() < 2e-6, "row {y}, column {x}");
            }
        }
        above = row;
    }
}

/// Laid side by side, a smooth field shows no step where its copies meet.
#[test]
fn the_seams_of_a_wrapping_field_are_as_smooth_as_its_middle() {
    let mut model = single(CarKind::Car3d, &[[0, 1], [1, 0], [1, 1]], &[0.95, 0.95, -0.9025], &[1.0]);
    model.levels.push(model.levels[0].clone());
    let (height, width) = (128, 160);
    let field = pulled(&mut wrapping(&model, 2, height, width), height);
    let at = |y: usize, x: usize| field.samples[y % height * width + x % width];
    let step = |next: &dyn Fn(usize) -> f64, count: usize| (0..count).map(next).sum::<f64>() / count as f64;
    let across = |x: usize| step(&|y| (at(y, x + 1) - at(y, x)).powi(2), height);
    let down = |y: usize| step(&|x| (at(y + 1, x) - at(y, x)).powi(2), width);
    let [across, down] = [(0..width).map(across).collect::<Vec<_>>(), (0..height).map(down).collect()];
    for steps in [across, down] {
        let (seam, inside) = steps.split_last().unwrap();
        let most = inside.iter().copied().fold(0.0, f64::max);
        assert!(*seam < most, "a step of {seam}, of {most} inside");
    }
}
