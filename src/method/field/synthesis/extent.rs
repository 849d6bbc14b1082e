//! Where the levels of a synthesis lie: which rows and columns of each lattice are generated, and which of them count.

use super::torus::{Grid, Ring};
use crate::error::{Error, Result};
use crate::kernel::car;
use crate::method::field::fit::stability;
use crate::method::field::model::{Level, Model};

/// What lies beyond the borders of a synthesised field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// The field goes on.
    Endless,
    /// The field itself again, in both directions: row `height` is row 0, column `width` is column 0.
    ///
    /// Levels are rings of their own: level k has its noise at row modulo `height / 2^k`, column modulo `width / 2^k`,
    /// so both must be multiples of 2^(levels - 1). Rows are generated from so far above the first that the zero start
    /// has decayed to 1e-7: rows `height` and after would be rows 0 and after to that, and to what f32 rounds. Along a
    /// row the same holds for columns.
    Wrapping,
}

/// What is left of the zero state after the margin of an endless field: in variance a 2500th. A model is stable, so
/// that takes 977 rows at most.
const TRANSIENT: f64 = 0.02;

/// What is left of it where a field wraps: below what f32 keeps, so however long that takes (a model is stable, so 4022
/// rows at most).
const WRAPPED_TRANSIENT: f64 = 1e-7;

const LEAST_MARGIN: usize = 16;

/// Lattice places are 32-bit, with room for the margins.
const MOST_TEXELS: usize = 1 << 30;

/// One level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Offset {
    /// What is generated.
    pub grid: Grid,
    /// The first row that counts.
    pub first_row: i32,
    /// The first column that counts, even; columns of a ring are counted on beyond its ends.
    pub first_column: i32,
    /// Columns that count.
    pub width: usize,
}

/// The levels of a field of `height` x `width` texels, the finest first. Each reaches a little farther than the one
/// before, so that the expansion meets no border.
pub(super) fn places(model: &Model, height: usize, width: usize, extent: Extent) -> Result<Vec<Offset>> {
    if !(1..=MOST_TEXELS).contains(&height) || !(1..=MOST_TEXELS).contains(&width) {
        return Err(Error::usage(format!(
            "a field of {height} x {width} texels: each side must lie between 1 and {MOST_TEXELS}"
        )));
    }
    if extent == Extent::Wrapping {
        check_halves(model.levels.len(), height, width)?;
    }
    let (mut first_row, mut first_column, mut last_column) = (0_i32, 0_i32, width as i32 - 1);
    let mut places = Vec::new();
    for (k, level) in model.levels.iter().enumerate() {
        let radius = level.measure_radius(model.kind)?;
        let columns = (last_column - first_column) as usize + 1;
        let grid = match extent {
            Extent::Endless => {
                let margin = margin(radius, TRANSIENT);
                Grid {
                    first_row: first_row - margin as i32,
                    first_column: first_column - margin as i32,
                    width: columns + 2 * margin,
                    ring: None,
                }
            }
            Extent::Wrapping => Grid {
                first_row: first_row - margin(radius, WRAPPED_TRANSIENT) as i32,
                first_column: 0,
                width: width >> k,
                ring: Some(Ring { height: height >> k, lead: lead(level, model)? }),
            },
        };
        places.push(Offset { grid, first_row, first_column, width: columns });
        // What the expansion at the first place reads, and from an even column on.
        first_row = first_row.div_euclid(2) - 1;
        first_column = (first_column / 2 - 1).div_euclid(2) * 2;
        last_column = last_column.div_euclid(2) + 1;
    }
    Ok(places)
}

/// Bytes of the rows that all levels keep.
pub(super) fn memory_bytes(model: &Model, places: &[Offset]) -> u64 {
    let channels = model.channels();
    let bytes = |(n, (place, level)): (usize, (&Offset, &Level))| {
        let coarser = if n + 1 < places.len() { 3 } else { 0 };
        let row = (place.width * channels * size_of::<f32>()) as u64;
        car::Field::bytes(channels, &level.neighbourhood, place.grid.width) + (1 + coarser) * row
    };
    places.iter().zip(&model.levels).enumerate().map(bytes).sum()
}

/// Every level of a field that wraps must be half of the one before.
fn check_halves(levels: usize, height: usize, width: usize) -> Result<()> {
    let exponent = levels.saturating_sub(1).min(31);
    let unit = 1_usize << exponent;
    if height.is_multiple_of(unit) && width.is_multiple_of(unit) {
        return Ok(());
    }
    let nearest = |texels: usize| ((texels + unit / 2) / unit * unit).max(unit);
    Err(Error::usage(format!(
        "a field of {height} x {width} texels cannot wrap: with {levels} levels both sides must be multiples of {unit}"
    ))
    .hint(format!("the nearest such size is {} x {} rows x columns", nearest(height), nearest(width))))
}

/// Texels after which a disturbance that decays as radius^n is below `transient`, at least a few.
fn margin(radius: f64, transient: f64) -> usize {
    if radius <= 0.0 {
        return LEAST_MARGIN;
    }
    ((libm::log(transient) / libm::log(radius)).ceil() as usize).max(LEAST_MARGIN)
}

/// Texels before the first at which the recursion along a ring sets out.
fn lead(level: &Level, model: &Model) -> Result<usize> {
    let radius = stability::row_radius(&level.joint(model.kind).0, &level.neighbourhood);
    Ok(margin(radius, WRAPPED_TRANSIENT))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::method::field::CarKind;
    use crate::method::field::model::tests::single;

    #[test]
    fn margins_follow_the_radius() {
        let endless = [0.0, 0.5, 0.9, 0.95, 0.998].map(|radius| margin(radius, TRANSIENT));
        assert_eq!(endless, [16, 16, 38, 77, 1955]);
        assert_eq!([0.0, 0.5, 0.999].map(|radius| margin(radius, WRAPPED_TRANSIENT)), [16, 24, 16111]);
    }

    #[test]
    fn levels_reach_farther_than_the_expansion_and_begin_on_even_columns() {
        let mut model = single(CarKind::Car3d, &[[0, 1], [1, 0]], &[0.5, 0.3], &[1.0]);
        model.levels = vec![model.levels[0].clone(); 4];
        for (extent, width) in [(Extent::Endless, 41), (Extent::Wrapping, 40)] {
            let places = places(&model, 24, width, extent).unwrap();
            for pair in places.windows(2) {
                let (fine, coarse) = (pair[0], pair[1]);
                assert_eq!(fine.first_column % 2, 0);
                let last = fine.first_column + fine.width as i32 - 1;
                assert!(coarse.first_column < fine.first_column / 2);
                assert_eq!(coarse.first_column + coarse.width as i32 - 1, last.div_euclid(2) + 1);
                assert_eq!(coarse.first_row, fine.first_row.div_euclid(2) - 1);
            }
        }
    }

    #[test]
    fn sizes_that_do_not_halve_cannot_wrap() {
        let mut model = single(CarKind::Car3d, &[[0, 1]], &[0.5], &[1.0]);
        model.levels = vec![model.levels[0].clone(); 3];
        assert!(places(&model, 8, 12, Extent::Wrapping).is_ok());
        for (height, width) in [(8, 13), (10, 12)] {
            assert!(places(&model, height, width, Extent::Wrapping).is_err());
            assert!(places(&model, height, width, Extent::Endless).is_ok());
        }
        let error = places(&model, 1, 1001, Extent::Wrapping).unwrap_err();
        assert!(error.guidance().unwrap().contains("4 x 1000"), "{error}");
    }
}
