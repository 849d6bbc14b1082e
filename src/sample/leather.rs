//! Grained leather: irregular cells parted by grooves, finer folds inside them,
//! creases along which grooves deepen, hair pores, and a fine wrinkle over all.

use super::cells::Cells;
use super::noise::{Noise, mix, mix3, smoothstep};
use super::{Material, Matter};

/// Mean size of a cell.
const CELL: f64 = 12.5;
/// Mean size of the finer folds.
const FOLD: f64 = 5.2;
/// Mean distance of pores.
const PORE: f64 = 9.0;

/// Linear RGB of the finish on the cells, of the worn tops and of the grooves.
const FINISH: [f64; 3] = [0.225, 0.072, 0.024];
const WORN: [f64; 3] = [0.36, 0.135, 0.05];
const DEEP: [f64; 3] = [0.075, 0.02, 0.0075];

/// The leather of one seed over one rectangle.
#[derive(Clone, Debug)]
pub(super) struct Leather {
    cells: Cells,
    folds: Cells,
    pores: Cells,
    warp: [Noise; 4],
    depth: Noise,
    crease: Noise,
    undulation: Noise,
    wrinkle: Noise,
    stain: Noise,
    speckle: Noise,
}

/// How far the warps move a stretched place at most, in units of the material.
const STRAY: f64 = 7.0;

impl Leather {
    /// Over x, y in `from..to`.
    pub(super) fn new(seed: u64, from: [f64; 2], to: [f64; 2]) -> Self {
        let cells = |domain: u32, size: f64, spread: f64| {
            let corners =
                [[from[0], from[1]], [to[0], from[1]], [from[0], to[1]], [to[0], to[1]]].map(stretch);
            let bound = |axis: usize, pick: fn(f64, f64) -> f64, start: f64| {
                corners.iter().fold(start, |bound, corner| pick(bound, corner[axis]))
            };
            let low = [0, 1].map(|axis| (bound(axis, f64::min, f64::INFINITY) - STRAY) / size);
            let high = [0, 1].map(|axis| (bound(axis, f64::max, f64::NEG_INFINITY) + STRAY) / size);
            Cells::new(seed, domain, low, high, spread)
        };
        let noise = |domain: u32| Noise::new(seed, domain);
        Self {
            cells: cells(0, CELL, 0.36),
            folds: cells(1, FOLD, 0.3),
            pores: cells(2, PORE, 0.0),
            warp: [noise(3), noise(4), noise(5), noise(6)],
            depth: noise(7),
            crease: noise(8),
            undulation: noise(9),
            wrinkle: noise(10),
            stain: noise(11),
            speckle: noise(12),
        }
    }

    /// The place whose cell is shown at (x, y): borders wind instead of running straight.
    fn warped(&self, x: f64, y: f64) -> [f64; 2] {
        let [a, b, c, d] = &self.warp;
        let dx = 3.2 * a.at(x / 15.0, y / 15.0) + 1.3 * c.at(x / 4.7, y / 4.7);
        let dy = 3.2 * b.at(x / 15.0, y / 15.0) + 1.3 * d.at(x / 4.7, y / 4.7);
        stretch([x + dx, y + dy])
    }
}

/// Skin is stretched along one direction: cells are longer there.
fn stretch([x, y]: [f64; 2]) -> [f64; 2] {
    // Turn by 16.26 degrees, shrink one axis, widen the other.
    [0.88 * (0.96 * x - 0.28 * y), 1.12 * (0.28 * x + 0.96 * y)]
}

impl Material for Leather {
    fn matter(&self, x: f64, y: f64) -> Matter {
        let [u, v] = self.warped(x, y);
        let cell = self.cells.at(u / CELL, v / CELL, 0.2);
        let fold = self.folds.at(u / FOLD, v / FOLD, 0.25);
        let (distance, mark) = self.pores.site(u / PORE, v / PORE);
        let radius = 0.75 + 0.8 * mark;
        let pore = if mark > 0.55 { 1.0 - smoothstep(0.2, 1.0, distance * PORE / radius) } else { 0.0 };

        // Creases: bands along which the skin has been bent; grooves across the bend are deep there.
        let line = self.crease.fractal(x / 52.0 + y / 160.0, y / 70.0 - x / 260.0, 3, 0.45);
        let crease = 1.0 / (1.0 + (line / 0.055).powi(2));
        let uneven = self.depth.fractal(x / 23.0, y / 23.0, 2, 0.6);
        let depth = (1.0 + 2.1 * uneven + 0.55 * crease + 0.12 * cell.orientation[0]).clamp(0.2, 1.9);

        // Distances in texels; a groove is round at its bottom.
        let half = 1.35 + 0.4 * depth;
        let border = (cell.border * CELL).max(0.0);
        let pillow = 1.0 - libm::exp(-libm::pow(border / half, 1.3));
        let folded = 1.0 - libm::exp(-((fold.border * FOLD).max(0.0).powi(2) + 0.35).sqrt() / 1.1);
        let fold_depth = 0.7 * smoothstep(-0.12, 0.25, self.depth.at(x / 17.0 + 91.0, y / 17.0)) + 0.12;
        let wrinkle = self.wrinkle.fractal(u / 3.1, v / 3.1, 2, 0.6);
        let height = 1.4 * depth * (pillow - 0.72)
            + fold_depth * pillow * (folded - 0.8)
            + 0.55 * (cell.mark - 0.5) * pillow
            + 0.5 * wrinkle * (0.35 + 0.65 * pillow)
            + 1.3 * self.undulation.at(x / 37.0, y / 37.0)
            - 0.45 * crease
            - 0.9 * pore * (0.4 + 0.6 * pillow)
            + 0.45;

        // The finish gathers in the grooves and is rubbed off the tops.
        let hollow = (1.0 - pillow) * (0.55 + 0.45 * depth) + 0.4 * (1.0 - folded) * fold_depth + 0.75 * pore;
        let worn =
            smoothstep(0.1, 1.5, height) * (0.5 + 0.9 * self.stain.fractal(x / 31.0, y / 31.0, 3, 0.6));
        let shade = 1.0
            + 0.16 * (cell.mark - 0.5)
            + 0.55 * self.stain.fractal(x / 80.0 + 7.0, y / 80.0, 2, 0.5)
            + 0.3 * self.speckle.fractal(x / 2.3, y / 2.3, 2, 0.8);
        let tops = mix3(FINISH, WORN, worn.clamp(0.0, 1.0));
        let albedo = mix3(tops, DEEP, smoothstep(0.25, 1.0, hollow)).map(|a| a * shade.max(0.3));
        Matter {
            height,
            coat_height: height,
            albedo,
            alpha: mix(0.31, 0.48, smoothstep(0.0, 0.8, hollow)) + 0.12 * self.stain.at(x / 11.0, y / 11.0),
            coat: mix(1.0, 0.3, hollow.clamp(0.0, 1.0)),
            fibre: 0.0,
            fibre_dive: 0.0,
            fibre_turn: 0.0,
        }
    }
}
