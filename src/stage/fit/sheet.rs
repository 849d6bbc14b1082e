//! The statistics of a synthesis and its tile on a sheet.

use super::statistics::{COMPONENTS, Comparison, Statistics};
use crate::method::field::fit::second_order::Autocovariance;
use crate::picture::drawing::{Canvas, INK};
use crate::picture::{Picture, false_color};
use crate::shape::Size;

const SIZE: Size = Size { height: 920, width: 1120 };

/// Side of a panel, and what lies between two.
const PANEL: usize = 256;
const GAP: usize = 16;

/// Bars of a histogram.
const BINS: usize = 64;

const TILE: [f32; 3] = [0.78, 0.8, 0.84];
const SYNTHESIS: [f32; 3] = [0.1, 0.35, 0.7];

/// The sheet: both normal maps, their distributions, their autocorrelations and their bands.
pub fn draw(comparison: &Comparison, title: &str) -> Picture {
    let mut canvas = Canvas::new(SIZE);
    canvas.large_text([12, GAP], 2, title);
    let both = [&comparison.tile, &comparison.synthesis];
    let top = 60;
    for (n, (one, name)) in both.into_iter().zip(["tile", "synthesis"]).enumerate() {
        let left = GAP + n * (PANEL + GAP);
        canvas.text(top - 14, left, name);
        canvas.put(
            top,
            left,
            &false_color::normals(one.size, &one.normals).repeated(Size::new(PANEL, PANEL)),
        );
    }
    let left = GAP + 2 * (PANEL + GAP);
    let height = (PANEL - 2 * GAP) / 3;
    canvas.text(top - 14, left, "distribution: tile grey, synthesis blue");
    for axis in 0..3 {
        let corner = [top + axis * (height + GAP), left];
        histogram(&mut canvas, comparison, axis, corner, Size::new(height, SIZE.width - left - GAP));
    }
    let top = top + PANEL + 40;
    for (n, (axis, one, name)) in [
        (0, both[0], "autocorrelation of n_x, tile"),
        (0, both[1], "synthesis"),
        (1, both[0], "of n_y, tile"),
        (1, both[1], "synthesis"),
    ]
    .into_iter()
    .enumerate()
    {
        let left = GAP + n * (PANEL + GAP);
        canvas.text(top - 14, left, name);
        canvas.put(top, left, &autocorrelation(&one.autocovariance, axis));
    }
    let top = top + PANEL + 40;
    canvas.text(
        top - 14,
        GAP,
        "standard deviation in each band of the pyramid, the finest first: tile grey, synthesis blue",
    );
    for axis in 0..3 {
        let width = (SIZE.width - 4 * GAP) / 3;
        bands(&mut canvas, both, axis, [top, GAP + axis * (width + GAP)], Size::new(220, width));
    }
    canvas.into_picture()
}

/// Shares of a component's values, between the tile's least and most.
fn histogram(canvas: &mut Canvas, comparison: &Comparison, axis: usize, [top, left]: [usize; 2], size: Size) {
    let [tile, synthesis] = [&comparison.tile, &comparison.synthesis].map(|one| &one.components[axis].sorted);
    let range = [tile, synthesis].map(|sorted| (sorted[0], sorted[sorted.len() - 1]));
    let (least, most) = (range[0].0.min(range[1].0), range[0].1.max(range[1].1));
    let shares = |sorted: &[f32]| {
        let mut counts = vec![0.0; BINS];
        for value in sorted {
            let place = (value - least) / (most - least).max(f32::MIN_POSITIVE) * BINS as f32;
            counts[(place as usize).min(BINS - 1)] += 1.0 / sorted.len() as f64;
        }
        counts
    };
    let shares = [shares(tile), shares(synthesis)];
    let highest = shares.iter().flatten().copied().fold(0.0, f64::max);
    let row = |share: f64| top + size.height - (share / highest * (size.height - 12) as f64) as usize;
    let column = |bin: usize| left + bin * size.width / BINS;
    for (bin, &share) in shares[0].iter().enumerate() {
        let height = top + size.height - row(share);
        canvas.fill([row(share), column(bin)], Size::new(height, column(bin + 1) - column(bin)), TILE);
    }
    for (bin, pair) in shares[1].windows(2).enumerate() {
        let middle = (column(1) - left) / 2;
        canvas.line(
            [row(pair[0]), column(bin) + middle],
            [row(pair[1]), column(bin + 1) + middle],
            2,
            SYNTHESIS,
        );
    }
    canvas.line([top + size.height, left], [top + size.height, left + size.width], 1, INK);
    canvas.text(top, left, &format!("{} {least:.2} to {most:.2}", COMPONENTS[axis]));
}

/// R(d) / R(0) of a component over the whole plane of lags: 1 red, 0 white, -1 blue.
fn autocorrelation(autocovariance: &Autocovariance, axis: usize) -> Picture {
    let lags = autocovariance.lags;
    let side = 2 * lags.columns + 1;
    let variance = autocovariance.covariance()[(axis, axis)].max(f64::MIN_POSITIVE);
    let lower: Vec<f32> = autocovariance.at.iter().map(|at| (at[(axis, axis)] / variance) as f32).collect();
    // R(-d) = R(d)^T: the upper half is the lower one turned round.
    let upper = lower[side..].iter().rev();
    let color = |&value: &f32| {
        let pale = 1.0 - value.abs().min(1.0);
        if value >= 0.0 { [1.0, pale, pale] } else { [pale, pale, 1.0] }
    };
    let size = Size::new(2 * lags.rows + 1, side);
    let picture = Picture::display(size, upper.chain(&lower).map(color).collect());
    picture.magnified((PANEL / size.height.max(size.width)).max(1))
}

/// Two bars a band.
fn bands(canvas: &mut Canvas, both: [&Statistics; 2], axis: usize, [top, left]: [usize; 2], size: Size) {
    let values = both.map(|one| one.bands.iter().map(|band| band[axis]).collect::<Vec<f64>>());
    let highest = values.iter().flatten().copied().fold(f64::MIN_POSITIVE, f64::max);
    let count = values[0].len();
    for (n, (values, color)) in values.iter().zip([TILE, SYNTHESIS]).enumerate() {
        for (band, value) in values.iter().enumerate() {
            let height = (value / highest * (size.height - 24) as f64) as usize;
            let width = size.width / count / 3;
            let column = left + band * size.width / count + n * width;
            canvas.fill([top + size.height - height, column], Size::new(height, width), color);
        }
    }
    canvas.line([top + size.height, left], [top + size.height, left + size.width], 1, INK);
    canvas.text(top, left, &format!("{}, at most {highest:.3}", COMPONENTS[axis]));
}
