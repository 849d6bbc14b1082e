//! A seat with its headrest and a dashboard: curved sheets, as materials are shown on in a car, made by formula.
//!
//! Each sheet is a profile in the plane of y and z, drawn across the width; a third axis of relief lifts bolsters and
//! hoods off it, and its sides curl inwards. Texture coordinates are lengths along profile and width, so that the
//! material has the same size everywhere.

use super::corner::{Corner, expect_triangles};
use super::mesh::Mesh;
use crate::error::Result;
use crate::run::budget::Room;
use crate::vector::{Vector, along, cross, length, minus, unit};

/// Points along a profile, and across.
const ALONG: usize = 160;
const ACROSS: usize = 120;

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

/// The seat: cushion and backrest in one piece.
const SEAT: Sheet = Sheet {
    profile: &[
        [-0.86, 0.62],
        [-0.72, 0.66],
        [-0.36, 0.72],
        [-0.21, 0.62],
        [-0.2, 0.36],
        [-0.26, 0.05],
        [-0.22, -0.13],
        [0.0, -0.22],
        [0.4, -0.29],
        [0.76, -0.38],
        [0.88, -0.44],
        [0.86, -0.55],
        [0.6, -0.62],
        [0.3, -0.6],
    ],
    half: 0.40,
    curl: 0.11,
    middle: 0.62,
    relief: |s, t| {
        // Bolsters at the sides, and three soft seams between them.
        let side = smooth(0.5, 0.95, t.abs());
        let body = smooth(0.12, 0.25, s) * (1.0 - smooth(0.70, 0.86, s));
        let seam = |at: f64| -0.02 * libm::exp(-((s - at) / 0.012) * ((s - at) / 0.012));
        0.12 * side * body + (seam(0.30) + seam(0.53) + seam(0.64)) * (1.0 - side)
    },
};

/// The headrest.
const HEADREST: Sheet = Sheet {
    profile: &[
        [0.9, -0.56],
        [0.88, -0.46],
        [0.93, -0.37],
        [1.04, -0.35],
        [1.16, -0.38],
        [1.22, -0.47],
        [1.18, -0.57],
        [1.05, -0.6],
    ],
    half: 0.17,
    curl: 0.09,
    middle: 0.62,
    relief: |_, t| 0.02 * (1.0 - t * t),
};

/// The dashboard: from the knees up over the brow to the windscreen.
const DASHBOARD: Sheet = Sheet {
    profile: &[
        [-0.95, -0.6],
        [-0.8, -0.52],
        [-0.6, -0.4],
        [-0.4, -0.3],
        [-0.2, -0.28],
        [-0.03, -0.33],
        [0.12, -0.36],
        [0.26, -0.3],
        [0.37, -0.32],
        [0.43, -0.45],
        [0.44, -0.62],
        [0.42, -0.8],
        [0.38, -1.0],
    ],
    half: 0.74,
    curl: 0.12,
    middle: -0.70,
    relief: |s, t| {
        let bump = |at: [f64; 2], wide: [f64; 2]| {
            let (a, b) = ((s - at[0]) / wide[0], (t - at[1]) / wide[1]);
            libm::exp(-a * a - b * b * b * b)
        };
        // The hood over the instruments, the middle console, and a shelf.
        0.13 * bump([0.70, -0.42], [0.10, 0.36]) + 0.08 * bump([0.34, 0.45], [0.20, 0.24])
            - 0.05 * bump([0.47, -0.42], [0.06, 0.34])
    },
};

/// From 0 to 1 between two places.
fn smooth(from: f64, to: f64, at: f64) -> f64 {
    let share = ((at - from) / (to - from)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

/// The object; what stays in memory is taken of the room.
///
/// # Errors
/// Where there is no room for it.
pub fn mesh(room: &mut Room) -> Result<Mesh> {
    let sheets = [SEAT, HEADREST, DASHBOARD];
    expect_triangles(room, sheets.len() * 2 * ALONG * ACROSS)?;
    let mut corners = Vec::with_capacity(sheets.len() * 2 * ALONG * ACROSS);
    sheets.iter().for_each(|sheet| corners.extend(sheet.corners()));
    let mesh = Mesh::new(corners)?;
    room.take("the interior", mesh.bytes())?;
    Ok(mesh)
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
