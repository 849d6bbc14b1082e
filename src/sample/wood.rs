//! Lacquered, ring-porous wood, grain along x: growth rings of varying width,
//! pores that follow them, fibre, a wavy figure, and a coat that smooths it all.

use super::noise::{DOMAIN, Noise, mix, mix3, place, smoothstep};
use super::{Material, Matter};
use crate::random::Hash;

/// Mean width of a growth ring.
const RING: f64 = 9.0;
/// Mean distance of pores along and across the grain.
const PORE: [f64; 2] = [27.0, 3.0];

/// Linear RGB of early wood, of late wood and of the bottom of a pore.
const EARLY: [f64; 3] = [0.50, 0.275, 0.112];
const LATE: [f64; 3] = [0.195, 0.073, 0.022];
const DARK: [f64; 3] = [0.06, 0.024, 0.01];

/// The wood of one seed.
#[derive(Clone, Debug)]
pub(super) struct Wood {
    rings: Hash,
    pores: Hash,
    course: Noise,
    wobble: Noise,
    fibre: Noise,
    hair: Noise,
    stain: Noise,
    figure: Noise,
    coat: Noise,
}

/// Where a place lies in its growth ring.
#[derive(Clone, Copy, Debug)]
struct Ring {
    /// 0 at the start of early wood, 1 at the end of late wood.
    age: f64,
    /// Distance to the end of the late wood.
    left: f64,
    /// Numbers of its own, 0 to 1.
    mark: [f64; 2],
}

impl Wood {
    pub(super) fn new(seed: u64) -> Self {
        let noise = |domain: u32| Noise::new(seed, domain);
        let hash = |domain: u32| Hash::new(seed, DOMAIN + domain);
        Self {
            rings: hash(0x20),
            pores: hash(0x21),
            course: noise(0x22),
            wobble: noise(0x23),
            fibre: noise(0x24),
            hair: noise(0x25),
            stain: noise(0x26),
            figure: noise(0x27),
            coat: noise(0x28),
        }
    }

    /// Position across the rings: y, bent by the slow course of the trunk.
    fn across(&self, x: f64, y: f64) -> f64 {
        y + 34.0 * self.course.fractal(x / 310.0, y / 150.0, 2, 0.35)
            + 17.0 * self.course.at(x / 900.0 + 13.0, y / 62.0)
            + 1.6 * self.wobble.at(x / 37.0, y / 11.0)
            + 0.35 * self.wobble.at(x / 9.0, y / 4.0 + 50.0)
    }

    /// The ring at a position across the rings.
    fn ring(&self, across: f64) -> Ring {
        let start = |k: f64| {
            let [jitter, ..] = self.rings.uniforms(place(k), 0, 0);
            RING * (k + 0.8 * (jitter - 0.5))
        };
        // A start strays by less than half a ring: it is at k - 1, k or k + 1.
        let mut k = (across / RING).floor();
        if across < start(k) {
            k -= 1.0;
        } else if across >= start(k + 1.0) {
            k += 1.0;
        }
        let (from, to) = (start(k), start(k + 1.0));
        let [_, a, b, _] = self.rings.uniforms(place(k), 0, 0);
        Ring { age: (across - from) / (to - from), left: to - across, mark: [a, b] }
    }

    /// Depth of the pores at a place along and across the grain, 0 to 1.
    fn pore(&self, along: f64, across: f64) -> f64 {
        let (column, row) = ((along / PORE[0]).floor(), (across / PORE[1]).floor());
        let mut depth = 0.0_f64;
        for (dy, dx) in [-1.0, 0.0, 1.0].into_iter().flat_map(|dy| [-1.0, 0.0, 1.0].map(|dx| (dy, dx))) {
            let (c, r) = (place(column + dx), place(row + dy));
            let [u, v, length, width] = self.pores.uniforms(c, r, 0);
            let [luck, deep, ..] = self.pores.uniforms(c, r, 1);
            let centre = [PORE[0] * (column + dx + u), PORE[1] * (row + dy + v)];
            let age = self.ring(centre[1]).age;
            // Wide pores stand in the early wood, few and narrow ones later.
            let early = 1.0 - smoothstep(0.12, 0.4, age);
            if luck > 0.13 + 0.62 * early {
                continue;
            }
            let half = [6.0 + 19.0 * length * (0.4 + 0.6 * early), 0.55 + 0.4 * width * (0.4 + 0.6 * early)];
            let along_part = ((along - centre[0]) / half[0]).abs();
            let across_part = ((across - centre[1]) / half[1]).abs();
            if along_part < 1.0 && across_part < 2.0 {
                let ends = 1.0 - along_part * along_part;
                let side = 1.0 - smoothstep(0.0, 2.0, across_part);
                depth = depth.max(ends * side * (0.45 + 0.55 * deep) * (0.55 + 0.45 * early));
            }
        }
        depth
    }
}

impl Material for Wood {
    fn matter(&self, x: f64, y: f64) -> Matter {
        let across = self.across(x, y);
        let ring = self.ring(across);
        // Late wood darkens gradually and ends at once.
        let onset = 0.25 + 0.35 * ring.mark[0];
        let late =
            smoothstep(onset, 1.0, ring.age) * smoothstep(-0.3, 1.3, ring.left) * (0.4 + 0.6 * ring.mark[1]);
        let pore = self.pore(x, across);
        let fibre = self.fibre.fractal(x / 34.0, across / 2.6, 3, 0.8);
        let hair = self.hair.fractal(x / 13.0, across / 1.9, 2, 0.8);
        let stain = self.stain.fractal(x / 140.0, across / 38.0, 3, 0.55);
        let streak = self.stain.at(x / 260.0, across / 5.0 + 77.0);
        // The figure: fibres that rise and dive in waves across the grain.
        let wave = self.figure.fractal((x + 0.4 * y) / 44.0, (y - 0.2 * x) / 120.0, 3, 0.6);

        let height = 0.3 * (late - 0.3) + 0.22 * fibre + 0.22 * hair + 0.6 * stain - 1.0 * pore + 0.12;
        let shade = 1.0 + 0.34 * fibre + 0.28 * hair + 0.65 * stain + 0.5 * streak;
        let dark = smoothstep(0.1, 0.8, pore);
        let albedo = mix3(mix3(EARLY, LATE, late), DARK, 0.85 * dark).map(|a| a * shade.max(0.3));
        Matter {
            height,
            coat_height: 0.42 * height + 1.1 * self.coat.fractal(x / 19.0, y / 15.0, 2, 0.5),
            albedo,
            alpha: mix(0.23, 0.32, dark),
            coat: mix(1.0, 0.6, dark),
            fibre: mix(0.5, 0.1, dark) * (1.0 - 0.6 * late),
            fibre_dive: 0.3 * wave + 0.3 * fibre + 0.1 * hair,
            fibre_turn: 0.15 * self.figure.at(x / 60.0 + 31.0, y / 25.0) + 0.12 * hair,
        }
    }
}
