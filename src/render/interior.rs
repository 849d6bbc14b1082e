//! A seat and a dashboard: curved sheets, as materials are shown on in a car, made by formula.
//!
//! Each sheet is a profile in the plane of y and z, drawn across the width; a third axis of relief lifts bolsters and
//! hoods off it, and its sides curl inwards. Texture coordinates are lengths along profile and width, so that the
//! material has the same size everywhere.

use super::mesh::{Corner, Mesh};
use super::vector::{Vector, along, cross, length, minus, unit};
use crate::error::Result;

/// Points along a profile, and across.
const ALONG: usize = 240;
const ACROSS: usize = 160;

/// A profile swept across a width.
struct Sheet {
    /// Points of the profile, y and z; it runs smoothly through all but the first and the last.
    profile: &'static [[f64; 2]],
    /// Half the width, without the curled sides.
    half: f64,
    /// Radius of the curled sides.
    curl: f64,
    /// The middle, x.
    middle: f64,
    /// Relief above the profile, by share of its length and by place across from -1 to 1.
    relief: fn(f64, f64) -> f64,
}

/// The seat: cushion, backrest and headrest in one piece.
const SEAT: Sheet = Sheet {
    profile: &[
        [-0.75, 0.70],
        [-0.62, 0.72],
        [-0.30, 0.76],
        [-0.17, 0.66],
        [-0.17, 0.38],
        [-0.23, 0.05],
        [-0.20, -0.14],
        [0.02, -0.24],
        [0.45, -0.32],
        [0.85, -0.42],
        [1.00, -0.47],
        [1.07, -0.43],
        [1.30, -0.44],
        [1.38, -0.53],
        [1.30, -0.64],
        [0.9, -0.66],
    ],
    half: 0.42,
    curl: 0.12,
    middle: 0.62,
    relief: |s, t| {
        // Bolsters at the sides of cushion and backrest, two soft seams across, and a narrow headrest.
        let side = smooth(0.55, 0.95, t.abs());
        let body = smooth(0.10, 0.22, s) * (1.0 - smooth(0.74, 0.80, s));
        let crease = |at: f64| -0.018 * libm::exp(-((s - at) / 0.012) * ((s - at) / 0.012));
        0.11 * side * body + (crease(0.29) + crease(0.52) + crease(0.64)) * (1.0 - side)
            - 0.35 * smooth(0.79, 0.84, s) * smooth(0.42, 0.75, t.abs())
    },
};

/// The dashboard: from the knees up over the brow to the windscreen.
const DASHBOARD: Sheet = Sheet {
    profile: &[
        [-0.9, -0.7],
        [-0.75, -0.55],
        [-0.55, -0.42],
        [-0.36, -0.34],
        [-0.18, -0.36],
        [-0.02, -0.43],
        [0.14, -0.42],
        [0.27, -0.37],
        [0.38, -0.40],
        [0.43, -0.52],
        [0.42, -0.72],
        [0.38, -1.0],
        [0.36, -1.2],
    ],
    half: 0.78,
    curl: 0.14,
    middle: -0.72,
    relief: |s, t| {
        let s = 1.0 - s;
        let bump = |at: [f64; 2], wide: [f64; 2]| {
            let (a, b) = ((s - at[0]) / wide[0], (t - at[1]) / wide[1]);
            libm::exp(-a * a - b * b * b * b)
        };
        // The hood over the instruments, the middle console, and a shelf.
        0.17 * bump([0.36, -0.45], [0.09, 0.34]) + 0.09 * bump([0.62, 0.42], [0.20, 0.26])
            - 0.05 * bump([0.58, -0.45], [0.06, 0.36])
    },
};

/// From 0 to 1 between two places.
fn smooth(from: f64, to: f64, at: f64) -> f64 {
    let share = ((at - from) / (to - from)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

/// The object.
///
/// # Errors
/// None that its formula could cause.
pub fn mesh() -> Result<Mesh> {
    let mut corners = SEAT.corners();
    corners.extend(DASHBOARD.corners());
    Mesh::new(corners)
}

impl Sheet {
    fn corners(&self) -> Vec<[Corner; 3]> {
        let profile = self.points();
        let total = profile.last().map_or(1.0, |&(_, s)| s);
        let grid: Vec<Vec<(Vector, [f64; 2])>> = (0..=ALONG)
            .map(|n| {
                let ([y, z], [out_y, out_z]) = at(&profile, total * n as f64 / ALONG as f64);
                let share = n as f64 / ALONG as f64;
                (0..=ACROSS)
                    .map(|k| {
                        let t = 2.0 * k as f64 / ACROSS as f64 - 1.0;
                        let (beside, below, run) = self.across(t);
                        let lift = (self.relief)(share, t) - below;
                        let place = [self.middle + beside, y + lift * out_y, z + lift * out_z];
                        (place, [run, total * share])
                    })
                    .collect()
            })
            .collect();
        let normal = |n: usize, k: usize| {
            let step = |a: (Vector, [f64; 2]), b: (Vector, [f64; 2])| minus(b.0, a.0);
            let wide = step(grid[n][k.saturating_sub(1)], grid[n][(k + 1).min(ACROSS)]);
            let up = step(grid[n.saturating_sub(1)][k], grid[(n + 1).min(ALONG)][k]);
            unit(cross(wide, up))
        };
        let corner = |n: usize, k: usize| {
            let (place, texture) = grid[n][k];
            Corner { place, texture, normal: normal(n, k), tangent: None }
        };
        let quads = (0..ALONG).flat_map(|n| (0..ACROSS).map(move |k| (n, k)));
        quads
            .flat_map(|(n, k)| {
                let [a, b, c, d] = [corner(n, k), corner(n, k + 1), corner(n + 1, k), corner(n + 1, k + 1)];
                [[a, b, d], [a, d, c]]
            })
            .collect()
    }

    /// The profile as a fine polygon, with the length up to each point (Catmull and Rom 1974).
    fn points(&self) -> Vec<([f64; 2], f64)> {
        const STEPS: usize = 40;
        let mut points: Vec<([f64; 2], f64)> = Vec::new();
        for four in self.profile.windows(4) {
            for step in 0..STEPS {
                let t = step as f64 / STEPS as f64;
                let value = |axis: usize| {
                    let [a, b, c, d] = [four[0][axis], four[1][axis], four[2][axis], four[3][axis]];
                    let (t2, t3) = (t * t, t * t * t);
                    0.5 * (2.0 * b
                        + (c - a) * t
                        + (2.0 * a - 5.0 * b + 4.0 * c - d) * t2
                        + (3.0 * b - a - 3.0 * c + d) * t3)
                };
                let point = [value(0), value(1)];
                let before =
                    points.last().map_or(0.0, |&([y, z], s)| s + length([0.0, point[0] - y, point[1] - z]));
                points.push((point, before));
            }
        }
        points
    }

    /// Beside the middle, below the profile, and the length on the surface, at a place across.
    fn across(&self, t: f64) -> (f64, f64, f64) {
        /// The sides curl by a little more than a right angle.
        const CURL: f64 = 1.75;
        let curled = self.curl * CURL;
        let run = t * (self.half + curled);
        let over = (run.abs() - self.half).max(0.0) / self.curl;
        let beside = run.abs().min(self.half) + self.curl * libm::sin(over);
        (beside * t.signum(), self.curl * (1.0 - libm::cos(over)), run)
    }
}

/// The point of a profile at a length, and the direction out of it: towards the viewer where it climbs, up where it
/// recedes.
fn at(profile: &[([f64; 2], f64)], s: f64) -> ([f64; 2], [f64; 2]) {
    let next = profile.partition_point(|&(_, length)| length < s).clamp(1, profile.len() - 1);
    let ((a, from), (b, to)) = (profile[next - 1], profile[next]);
    let share = if to > from { ((s - from) / (to - from)).clamp(0.0, 1.0) } else { 0.0 };
    let point = along([a[0], a[1], 0.0], share, [b[0] - a[0], b[1] - a[1], 0.0]);
    let way = unit([b[0] - a[0], b[1] - a[1], 0.0]).unwrap_or([1.0, 0.0, 0.0]);
    ([point[0], point[1]], [-way[1], way[0]])
}
