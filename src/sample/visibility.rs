//! What the relief hides: shadows with a soft edge, the openness of hollows
//! to the sky, and the point that a view ray meets.

use super::HORIZON;
use super::surface::Surface;

/// Heights over the padded plane, bilinear between texel centres. Positions are
/// (column, row) of padded texels, whole at texel centres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Relief<'a> {
    heights: &'a [f32],
    columns: usize,
    rows: usize,
    /// Bound on |height|: the same for every size of a surface, so that rays step the same way.
    bound: f32,
    /// The greatest height.
    highest: f32,
}

/// The four texels around a position and their weights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners {
    /// Padded position of the upper left texel.
    pub(super) first: usize,
    /// Weights of the upper left, upper right, lower left and lower right texel.
    pub(super) weights: [f32; 4],
}

/// A direction as the marches want it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heading {
    /// Step of one texel along the azimuth, in columns and rows (rows run against y).
    column: f32,
    row: f32,
    /// Horizontal distance per unit of height, tan theta.
    tangent: f32,
}

impl Heading {
    /// Of theta and phi in radians.
    pub(super) fn new([theta, phi]: [f64; 2]) -> Self {
        let tangent = libm::sin(theta) / libm::cos(theta).max(1e-3);
        Self { column: libm::cos(phi) as f32, row: -libm::sin(phi) as f32, tangent: tangent as f32 }
    }
}

impl<'a> Relief<'a> {
    pub(super) fn new(surface: &'a Surface) -> Self {
        Self {
            heights: &surface.heights,
            columns: surface.columns,
            rows: surface.rows,
            bound: surface.relief,
            highest: surface.heights.iter().fold(-surface.relief, |highest, &h| highest.max(h)),
        }
    }

    /// Where a position lies between texels; held inside the padded plane.
    pub(super) fn corners(&self, column: f32, row: f32) -> Corners {
        let column = column.clamp(0.0, self.columns as f32 - 1.001);
        let row = row.clamp(0.0, self.rows as f32 - 1.001);
        let (left, top) = ((column as usize).min(self.columns - 2), (row as usize).min(self.rows - 2));
        let (u, v) = (column - left as f32, row - top as f32);
        Corners {
            first: top * self.columns + left,
            weights: [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v],
        }
    }

    fn at(&self, column: f32, row: f32) -> f32 {
        let Corners { first, weights: [a, b, c, d] } = self.corners(column, row);
        let below = first + self.columns;
        a * self.heights[first]
            + b * self.heights[first + 1]
            + c * self.heights[below]
            + d * self.heights[below + 1]
    }

    /// Part of the light that reaches texel n, 0 to 1. The edge is soft as that of a small lamp,
    /// and over a short way no softer than the texels can tell.
    pub(super) fn lit(&self, n: usize, light: Heading) -> f32 {
        const STEP: f32 = 0.7;
        if light.tangent < 1e-3 {
            return 1.0;
        }
        let (column, row) = ((n % self.columns) as f32, (n / self.columns) as f32);
        let rise = 1.0 / light.tangent;
        // Nothing lies beyond the padded plane; the flattest light meets its end.
        let across = (self.columns + self.rows) as f32;
        let mut lit = 1.0_f32;
        for step in 1.. {
            let way = step as f32 * STEP;
            let ray = self.heights[n] + way * rise;
            let softness = (0.15 * way).min(0.25 + 0.035 * way);
            if ray - softness > self.highest || lit <= 0.0 || way > across {
                break;
            }
            let clear = ray - self.at(column + way * light.column, row + way * light.row);
            lit = lit.min(0.5 + 0.5 * clear / softness);
        }
        lit.max(0.0)
    }

    /// Part of the sky, weighted by the cosine, that texel n sees over the relief around it
    /// (Max 1988's horizon: 1 / (1 + tangent squared), averaged over azimuths).
    pub(super) fn openness(&self, n: usize) -> f32 {
        const DIAGONAL: f32 = std::f32::consts::FRAC_1_SQRT_2;
        const AZIMUTHS: [[f32; 2]; 8] = [
            [1.0, 0.0],
            [DIAGONAL, DIAGONAL],
            [0.0, 1.0],
            [-DIAGONAL, DIAGONAL],
            [-1.0, 0.0],
            [-DIAGONAL, -DIAGONAL],
            [0.0, -1.0],
            [DIAGONAL, -DIAGONAL],
        ];
        const WAYS: [f32; 8] = [1.0, 2.0, 3.0, 4.5, 6.5, 9.0, 13.0, HORIZON];
        let (column, row) = ((n % self.columns) as f32, (n / self.columns) as f32);
        let sky = AZIMUTHS.map(|[dx, dy]| {
            let horizon = WAYS.iter().fold(0.0_f32, |horizon, &way| {
                horizon.max((self.at(column + way * dx, row + way * dy) - self.heights[n]) / way)
            });
            1.0 / (1.0 + horizon * horizon)
        });
        sky.iter().sum::<f32>() / AZIMUTHS.len() as f32
    }

    /// The position that the view ray through (column, row) of the mean plane meets first.
    pub(super) fn hit(&self, column: f32, row: f32, view: Heading) -> [f32; 2] {
        const STEP: f32 = 0.35;
        let (dx, dy) = (view.column * view.tangent, view.row * view.tangent);
        let over = |z: f32| z - self.at(column + z * dx, row + z * dy);
        let descent = STEP / view.tangent.max(STEP);
        let (mut above, mut below) = (self.bound, self.bound);
        while below > -self.bound && over(below) > 0.0 {
            above = below;
            below -= descent;
        }
        // The surface lies between the last height over it and the first below it.
        for _ in 0..10 {
            let middle = 0.5 * (above + below);
            if over(middle) > 0.0 { above = middle } else { below = middle }
        }
        [column + below * dx, row + below * dy]
    }
}
