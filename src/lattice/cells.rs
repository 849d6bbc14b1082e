//! How a rectangle relates to a lattice: whole numbers of cells, or not.

use std::ops::RangeInclusive;

use super::Lattice;
use crate::shape::{Size, Window};

/// How far a side may be from whole numbers of cycles of each wave.
const TOLERANCE: f64 = 0.3;

/// Part of each side of a plane that a rectangle of whole cells must keep.
const LEAST_PART: f64 = 0.5;

/// Parts of a side that are given up for a misfit less by one cell.
const MISFIT_COST: f64 = 2.0;

/// How far, in texels, a side may be from a shift of the lattice: the first of these within which there is one. Half a
/// texel is rounding; oblique lattices have few shifts along the axes that are nearer.
const NEAR: [f64; 4] = [0.5, 1.0, 2.0, 3.0];

/// A lattice in whole numbers for a rectangle that it fits: for each wave of the lattice its cycles down the height and
/// across the width. None for no lattice, one for ribs, two for cells.
///
/// A shift (sy, sx) belongs to the lattice if `w[0] * sy / height + w[1] * sx / width` is a whole number for each row w.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WaveCounts(pub Vec<[i32; 2]>);

impl WaveCounts {
    /// The exact lattice of a rectangle of this size; none where the rows are not one or two independent ones.
    pub fn lattice(&self, size: Size) -> Lattice {
        let (height, width) = (size.height as f64, size.width as f64);
        let wave = |[down, across]: [i32; 2]| [f64::from(down) / height, f64::from(across) / width];
        match self.0[..] {
            [row] if row != [0, 0] => {
                let wave = wave(row);
                let square = super::dot(wave, wave);
                Lattice::OneDirection { period: wave.map(|n| n / square) }
            }
            [first, second] if self.cells() > 0 => {
                let (a, b) = (wave(first), wave(second));
                let area = super::cross(a, b);
                Lattice::TwoDirections([[b[1] / area, -b[0] / area], [-a[1] / area, a[0] / area]])
            }
            _ => Lattice::None,
        }
    }

    /// Cells in the rectangle; of ribs, the most periods along one of its sides; 0 without a lattice.
    pub fn cells(&self) -> u64 {
        let wide = |row: [i32; 2]| row.map(i64::from);
        match self.0[..] {
            [row] => row[0].unsigned_abs().max(row[1].unsigned_abs()).into(),
            [first, second] => {
                let ([a, b], [c, d]) = (wide(first), wide(second));
                (i128::from(a) * i128::from(d) - i128::from(b) * i128::from(c)).unsigned_abs() as u64
            }
            _ => 0,
        }
    }

    /// Cells that follow each other along the longer way across the rectangle, in the direction that has fewest; 0
    /// without a lattice.
    pub fn fewest_in_a_direction(&self) -> u64 {
        let longer = |&[down, across]: &[i32; 2]| u64::from(down.unsigned_abs().max(across.unsigned_abs()));
        self.0.iter().map(longer).min().unwrap_or(0)
    }
}

/// The lattice in whole numbers for a rectangle of this size; `None` where its sides do not hold whole numbers of cells
/// within 0.3 of a cell.
pub fn wave_counts(lattice: &Lattice, size: Size) -> Option<WaveCounts> {
    let sides = [size.height as f64, size.width as f64];
    let mut rows = Vec::new();
    for wave in lattice.waves() {
        let cycles = [wave[0] * sides[0], wave[1] * sides[1]];
        let fits = |n: f64| (n - n.round()).abs() <= TOLERANCE && n.abs() < f64::from(i32::MAX);
        if !cycles.into_iter().all(fits) {
            return None;
        }
        rows.push(cycles.map(|n| n.round() as i32));
    }
    let counts = WaveCounts(rows);
    let fits = *lattice == Lattice::None || counts.cells() > 0;
    fits.then_some(counts)
}

/// How far a side is from whole numbers of cycles of the waves, at most 0.5. The height is axis 0, the width axis 1.
pub(crate) fn misfit(waves: &[[f64; 2]], axis: usize, side: usize) -> f64 {
    let of = |wave: &[f64; 2]| {
        let cycles = wave[axis] * side as f64;
        (cycles - cycles.round()).abs()
    };
    waves.iter().map(of).fold(0.0, f64::max)
}

/// Whether a side holds whole numbers of cells to within so many texels. The height is axis 0, the width axis 1.
fn holds_cells(lattice: &Lattice, axis: usize, side: usize, near: f64) -> bool {
    let mut off = [0.0; 2];
    for (wave, vector) in lattice.waves().into_iter().zip(lattice.shortest()) {
        let cycles = wave[axis] * side as f64;
        let part = cycles - cycles.round();
        if part.abs() > TOLERANCE {
            return false;
        }
        off = [off[0] + part * vector[0], off[1] + part * vector[1]];
    }
    super::length(off) <= near
}

/// The sides in a range that hold whole numbers of cells as nearly as can be: to half a texel, where there are none to
/// one, to two, else to three. All of them where there is no lattice. The height is axis 0, the width axis 1.
pub fn whole_cell_sides(lattice: &Lattice, axis: usize, sides: RangeInclusive<usize>) -> Vec<usize> {
    let within = |near| sides.clone().filter(|&side| holds_cells(lattice, axis, side, near)).collect();
    NEAR.into_iter().map(within).find(|sides: &Vec<usize>| !sides.is_empty()).unwrap_or_default()
}

/// The largest centred rectangle of a plane whose sides hold whole numbers of cells as nearly as can be: a tenth of a
/// cell less of misfit is worth a fifth of a side. The whole plane where there is no lattice; `None` where no
/// rectangle of at least half of each side fits the lattice.
pub fn largest_whole_cells(lattice: &Lattice, plane: Size) -> Option<Window> {
    let waves = lattice.waves();
    let best = |axis: usize, most: usize| {
        let least = ((most as f64 * LEAST_PART).ceil() as usize).max(1);
        let worth = |side: usize| side as f64 / most as f64 - MISFIT_COST * misfit(&waves, axis, side);
        (least..=most)
            .filter(|&side| misfit(&waves, axis, side) <= TOLERANCE)
            .max_by(|&a, &b| worth(a).total_cmp(&worth(b)).then(a.cmp(&b)))
    };
    let size = Size::new(best(0, plane.height)?, best(1, plane.width)?);
    wave_counts(lattice, size)?;
    Some(plane.middle(size))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic)]
    use super::*;

    fn lattice(text: &str) -> Lattice {
        text.parse().unwrap()
    }

    fn counts(text: &str, size: Size) -> Option<Vec<[i32; 2]>> {
        wave_counts(&lattice(text), size).map(|counts| counts.0)
    }

    /// Whether a shift belongs to a lattice, by the sentence that defines wave counts.
    fn belongs(counts: &WaveCounts, size: Size, [sy, sx]: [f64; 2]) -> bool {
        counts.0.iter().all(|w| {
            let cycles = f64::from(w[0]) * sy / size.height as f64 + f64::from(w[1]) * sx / size.width as f64;
            (cycles - cycles.round()).abs() < 1e-9
        })
    }

    #[test]
    fn cells_parallel_to_the_axes_are_counted() {
        let size = Size::new(152, 184);
        assert_eq!(counts("15.2,0;0,18.4", size).unwrap(), [[10, 0], [0, 10]]);
        assert_eq!(counts("15.06,-0.02;-0.04,18.42", size).unwrap(), [[10, 0], [0, 10]]);
        // 152 texels are 1.19 periods of 128.
        assert_eq!(counts("128,0;0,128", size), None);
        assert_eq!(counts("none", size).unwrap(), [[0; 2]; 0]);
        // Less than a third of a cell is no cell.
        assert_eq!(counts("700,0;0,18.4", size), None);
        assert_eq!(counts("700,0", size), None);
    }

    #[test]
    fn an_oblique_lattice_becomes_exact_in_a_rectangle_of_whole_cells() {
        // A cloth: 11 and 12 cells down, -19 and 9 across.
        let size = Size::new(216, 224);
        let found = wave_counts(&lattice("5.94,-8.22;12.55,7.54"), size).unwrap();
        assert_eq!(found.cells(), 11 * 9 + 19 * 12);
        let Lattice::TwoDirections(exact) = found.lattice(size) else { panic!("{found:?}") };
        for (exact, near) in exact.iter().zip([[5.94, -8.22], [12.55, 7.54]]) {
            assert!((exact[0] - near[0]).abs() < 0.15 && (exact[1] - near[1]).abs() < 0.15, "{exact:?}");
        }
        let sum = [exact[0][0] * 3.0 - exact[1][0], exact[0][1] * 3.0 - exact[1][1]];
        for shift in [exact[0], exact[1], sum, [216.0, 0.0], [0.0, 224.0]] {
            assert!(belongs(&found, size, shift), "{shift:?}");
        }
        assert!(!belongs(&found, size, [exact[0][0] / 2.0, exact[0][1] / 2.0]));
    }

    #[test]
    fn ribs_leave_the_shift_along_them_free() {
        let size = Size::new(224, 207);
        let found = wave_counts(&lattice("0.04,23.12"), size).unwrap();
        assert_eq!(found, WaveCounts(vec![[0, 9]]));
        assert!(belongs(&found, size, [13.7, 23.0]) && !belongs(&found, size, [13.7, 21.0]));
        let Lattice::OneDirection { period } = found.lattice(size) else { panic!("{found:?}") };
        assert!(period[0] == 0.0 && (period[1] - 23.0).abs() < 1e-12);
        // Ribs from corner to corner of a square.
        assert_eq!(counts("8,8", Size::new(160, 160)).unwrap(), [[10, 10]]);
    }

    #[test]
    fn the_largest_rectangle_of_whole_cells_is_found() {
        let largest = |text: &str, plane| largest_whole_cells(&lattice(text), plane);
        let window = |y, x, height, width| Some(Window { y, x, size: Size::new(height, width) });
        assert_eq!(largest("none", Size::new(30, 40)), window(0, 0, 30, 40));
        assert_eq!(largest("128,0;0,128", Size::new(300, 256)), window(22, 0, 256, 256));
        assert_eq!(largest("15.06,0;0,18.42", Size::new(256, 256)), window(0, 8, 256, 239));
        assert_eq!(largest("0,23.12", Size::new(256, 256)), window(0, 1, 256, 254));
        // Less than a third of a cell is no cell.
        assert_eq!(largest("1000,0;0,128", Size::new(300, 256)), None);
        for text in ["6.04,-8.14;12.64,7.66", "20,3;-3,20", "7,7.5"] {
            let lattice = lattice(text);
            let plane = Size::new(256, 240);
            let found = largest_whole_cells(&lattice, plane).unwrap();
            assert!(found.fits(plane) && found.size.texels() * 4 >= plane.texels(), "{text}: {found:?}");
            let waves = lattice.waves();
            let worst = misfit(&waves, 0, found.size.height).max(misfit(&waves, 1, found.size.width));
            assert!(worst < 0.2, "{text}: {found:?} misses by {worst}");
        }
    }

    #[test]
    fn sides_of_whole_cells_are_as_near_as_texels_allow() {
        let sides = |text: &str, axis, range| whole_cell_sides(&lattice(text), axis, range);
        // 15.2 k: 91.2, 106.4 and so on, each rounded.
        assert_eq!(sides("15.2,0;0,18.4", 0, 85..=140), [91, 106, 122, 137]);
        assert_eq!(sides("15.2,0;0,18.4", 1, 85..=140), [92, 110, 129]);
        assert_eq!(sides("0,23.12", 1, 100..=150), [116, 139]);
        assert_eq!(sides("0,23.12", 0, 100..=110), (100..=110).collect::<Vec<_>>());
        assert_eq!(sides("none", 0, 7..=9), [7, 8, 9]);
        assert!(sides("300,0;0,30", 0, 100..=200).is_empty());
        // A lattice turned by 3/4: 5 cells of 10 x 10 along the axes.
        assert_eq!(sides("8,6;-6,8", 0, 40..=110), [50, 100]);
        // A cloth whose oblique lattice the texels meet once, and one measured a little otherwise, which they nearly do.
        assert_eq!(sides("5.94,-8.22;12.55,7.54", 0, 113..=224), [216]);
        assert_eq!(sides("5.94,-8.22;12.55,7.54", 1, 113..=224), [224]);
        assert_eq!(sides("6.04,-8.14;12.64,7.66", 1, 113..=224), [199, 200, 222, 223, 224]);
    }

    #[test]
    fn the_direction_of_fewest_cells_is_told() {
        let fewest = |rows: &[[i32; 2]]| WaveCounts(rows.to_vec()).fewest_in_a_direction();
        assert_eq!(
            [fewest(&[]), fewest(&[[0, 9]]), fewest(&[[1, 0], [0, 20]]), fewest(&[[11, -19], [12, 9]])],
            [0, 9, 1, 12]
        );
    }
}
