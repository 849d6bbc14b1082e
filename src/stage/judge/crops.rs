//! Where crops are cut: real ones from the measurement, and those of an enlargement.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::likeness::{Judge, Judgement, LEAST_SIDE, Lightness};
use crate::shape::{Size, Window};

/// Side of crops by default, as far as they fit. What J is depends on it: larger crops differ less from each other.
pub(super) const SIDE: usize = 128;

/// Sides are multiples of this, so that every scale of the pyramid has an even side.
const STEP: usize = 16;

/// Crops of parts that the tile did not use are taken if there are so many of this side.
const LEAST_HELD_OUT: usize = 3;
const LEAST_HELD_OUT_SIDE: usize = 96;

/// More real crops say nothing new.
const MOST: usize = 8;

/// Where pictures are cut.
pub(super) struct Crops {
    pub(super) side: usize,
    pub(super) reals: Vec<Window>,
    pub(super) enlarged: Vec<Window>,
    /// Rows and columns of crops of the plane that repeats the exemplar.
    pub(super) repeated: Vec<[usize; 2]>,
    /// Rows and columns within which crops of a regular material were moved into phase with real ones.
    pub(super) cell: Option<Size>,
}

impl Crops {
    /// Judges crops that were cut here.
    pub(super) fn judge(&self, judge: &Judge, pictures: &[Lightness]) -> Result<Judgement> {
        if self.cell.is_some() { judge.judge_partners(pictures) } else { judge.judge(pictures) }
    }

    /// The crops of the plane that repeats an exemplar.
    pub(super) fn of_repeated(&self, exemplar: &Lightness) -> Vec<Lightness> {
        let size = Size::new(self.side, self.side);
        self.repeated.iter().map(|&[y, x]| exemplar.repeated(y, x, size)).collect()
    }
}

/// Where real crops come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// Parts of the measurement that the tile was not cut from.
    HeldOut,
    /// Quadrants of the measurement, which the tile may have used.
    Quadrants,
}

/// Real crops.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Reals {
    /// Where they come from.
    pub(super) origin: Origin,
    /// Side of each.
    pub(super) side: usize,
    /// Disjoint squares of the measurement.
    pub(super) windows: Vec<Window>,
}

/// Cuts real crops from a plane of which the tile used a part; their side is at most `most`, or `wanted` exactly.
///
/// # Errors
/// A plane or an enlargement that is too small, and a wanted side that does not fit or is no multiple of 16.
pub(super) fn real_crops(plane: Size, used: Window, most: usize, wanted: Option<usize>) -> Result<Reals> {
    let whole_steps = |side: usize| side / STEP * STEP;
    if let Some(side) = wanted
        && (whole_steps(side) != side || side < LEAST_SIDE || side > most)
    {
        return Err(Error::usage(format!(
            "got crops of {side} texels a side, expected a multiple of {STEP} from {LEAST_SIDE} to {most}, the \
             enlargement's shorter side"
        )));
    }
    if most < LEAST_SIDE {
        return Err(Error::input(format!(
            "the enlargement has {most} texels along its shorter side, judging takes at least {LEAST_SIDE}"
        )));
    }
    let most = wanted.unwrap_or(whole_steps(most.min(SIDE)));
    let least = wanted.unwrap_or(LEAST_HELD_OUT_SIDE);
    for side in (least..=most).rev().filter(|&side| whole_steps(side) == side) {
        let windows = disjoint(plane, used, side);
        if windows.len() >= LEAST_HELD_OUT {
            return Ok(Reals { origin: Origin::HeldOut, side, windows: spread(&windows) });
        }
    }
    let side = whole_steps(plane.height.min(plane.width) / 2).min(most);
    if side < LEAST_SIDE || wanted.is_some_and(|wanted| side < wanted) {
        let least = 2 * wanted.unwrap_or(LEAST_SIDE);
        return Err(Error::input(format!(
            "a measurement of {plane} has no crops to judge by: expected at least {least}x{least}, four quadrants of it"
        ))
        .hint(match wanted {
            Some(wanted) if wanted > LEAST_SIDE => "import a larger part of the material, or give a smaller --crop",
            _ => "import a larger part of the material",
        }));
    }
    let (bottom, right) = (plane.height - side, plane.width - side);
    let window = |(y, x)| Window { y, x, size: Size::new(side, side) };
    let windows = [(0, 0), (0, right), (bottom, 0), (bottom, right)].map(window).to_vec();
    Ok(Reals { origin: Origin::Quadrants, side, windows })
}

/// Squares of a plane that overlap neither each other nor what is used.
fn disjoint(plane: Size, used: Window, side: usize) -> Vec<Window> {
    let (bottom, right) = (used.y + used.size.height, used.x + used.size.width);
    let rows = [0..used.y, used.y..bottom, bottom..plane.height];
    let columns = [0..used.x, used.x..right, right..plane.width];
    // The frame around it is cut into strips that go the whole way across, or the whole way down.
    let across = [
        (rows[0].clone(), 0..plane.width),
        (rows[1].clone(), columns[0].clone()),
        (rows[1].clone(), columns[2].clone()),
        (rows[2].clone(), 0..plane.width),
    ];
    let down = [
        (0..plane.height, columns[0].clone()),
        (rows[0].clone(), columns[1].clone()),
        (rows[2].clone(), columns[1].clone()),
        (0..plane.height, columns[2].clone()),
    ];
    let [across, down] = [across, down].map(|strips| {
        let squares = |(rows, columns): (std::ops::Range<usize>, std::ops::Range<usize>)| {
            let count = |length: usize| length / side;
            (0..count(rows.len()) * count(columns.len())).map(move |n| {
                let (row, column) = (n / count(columns.len()), n % count(columns.len()));
                let (y, x) = (rows.start + row * side, columns.start + column * side);
                Window { y, x, size: Size::new(side, side) }
            })
        };
        strips.into_iter().flat_map(squares).collect::<Vec<_>>()
    });
    if down.len() > across.len() { down } else { across }
}

/// At most [`MOST`] of them, from all over.
fn spread(windows: &[Window]) -> Vec<Window> {
    let count = windows.len().min(MOST);
    (0..count).map(|n| windows[n * windows.len() / count]).collect()
}

/// Squares of an enlargement, at most three down and three across, from border to border.
pub(super) fn crops_of(size: Size, side: usize) -> Vec<Window> {
    let places = |length: usize| {
        let room = length.saturating_sub(side);
        let mut places = vec![0, room / 2, room];
        places.dedup();
        places
    };
    let columns = places(size.width);
    let window = |y: usize, x: usize| Window { y, x, size: Size::new(side, side) };
    places(size.height).into_iter().flat_map(|y| columns.iter().map(move |&x| window(y, x))).collect()
}

/// Rows and columns spread over an exemplar, three down and three across, at which crops of its repetition begin.
pub(super) fn spread_over(exemplar: Size) -> Vec<[usize; 2]> {
    let places = |length: usize| (0..3).map(move |n| n * length / 3);
    places(exemplar.height).flat_map(|y| places(exemplar.width).map(move |x| [y, x])).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn window(y: usize, x: usize, height: usize, width: usize) -> Window {
        Window { y, x, size: Size::new(height, width) }
    }

    #[test]
    fn held_out_crops_overlap_neither_the_tile_nor_each_other() {
        let overlap = |a: &Window, b: &Window| {
            a.y < b.y + b.size.height
                && b.y < a.y + a.size.height
                && a.x < b.x + b.size.width
                && b.x < a.x + a.size.width
        };
        for used in [
            window(0, 0, 192, 192),
            window(250, 300, 100, 120),
            window(150, 0, 60, 500),
            window(400, 400, 9, 9),
        ] {
            let reals = real_crops(Size::new(520, 500), used, 1000, None).unwrap();
            assert_eq!((reals.origin, reals.side), (Origin::HeldOut, 128), "{used}");
            for (n, crop) in reals.windows.iter().enumerate() {
                assert!(crop.fits(Size::new(520, 500)) && !overlap(crop, &used), "{used}: {crop}");
                assert!(reals.windows[..n].iter().all(|other| !overlap(crop, other)));
            }
            assert!((3..=8).contains(&reals.windows.len()));
        }
        let narrow = real_crops(Size::new(400, 300), window(100, 0, 300, 300), 1000, None).unwrap();
        assert_eq!((narrow.origin, narrow.side, narrow.windows.len()), (Origin::HeldOut, 96, 3));
    }

    #[test]
    fn else_quadrants_are_taken_or_the_measurement_is_too_small() {
        let reals = real_crops(Size::new(256, 256), window(30, 20, 200, 210), 512, None).unwrap();
        assert_eq!((reals.origin, reals.side), (Origin::Quadrants, 128));
        assert_eq!(reals.windows[3], window(128, 128, 128, 128));
        assert_eq!(real_crops(Size::new(150, 200), window(0, 0, 150, 200), 512, None).unwrap().side, 64);
        assert_eq!(real_crops(Size::new(256, 256), window(0, 0, 256, 256), 90, None).unwrap().side, 80);
        for (plane, most, wanted) in
            [(127, 512, None), (256, 63, None), (256, 512, Some(144)), (256, 512, Some(100))]
        {
            assert!(real_crops(Size::new(plane, 256), window(0, 0, plane, 256), most, wanted).is_err());
        }
    }

    #[test]
    fn crops_of_an_enlargement_reach_its_borders() {
        let crops = crops_of(Size::new(300, 128), 128);
        assert_eq!(
            crops.iter().map(|crop| [crop.y, crop.x]).collect::<Vec<_>>(),
            [[0, 0], [86, 0], [172, 0]]
        );
        assert_eq!(crops_of(Size::new(512, 512), 128).len(), 9);
    }
}
