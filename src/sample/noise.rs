//! Gradient noise (Perlin 1985, quintic fade of 2002) on hashed lattices that are
//! turned and shifted from octave to octave, so that no lattice shows.

use crate::random::Hash;

/// One family of noise; families of different `domain` are independent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    hash: Hash,
}

/// First of the hash domains that the synthetic materials use.
pub(super) const DOMAIN: u32 = 0x5A00;

impl Noise {
    /// The family number `domain` of a seed.
    pub(super) fn new(seed: u64, domain: u32) -> Self {
        Self { hash: Hash::new(seed, DOMAIN + domain) }
    }

    /// Noise with features of unit size; mean 0, standard deviation about 0.2, within -1 to 1.
    pub(super) fn at(&self, x: f64, y: f64) -> f64 {
        self.octave(x, y, 0)
    }

    /// Sum of `octaves` noises, each about half the size and `gain` times the weight of the one
    /// before, normalised to the standard deviation of one octave.
    pub(super) fn fractal(&self, mut x: f64, mut y: f64, octaves: u32, gain: f64) -> f64 {
        // A turn by 36.87 degrees and a factor that is not a whole number keep lattices from lining up.
        const LACUNARITY: f64 = 1.93;
        let (mut sum, mut weight, mut power) = (0.0, 1.0, 0.0);
        for octave in 0..octaves {
            sum += weight * self.octave(x, y, octave);
            power += weight * weight;
            weight *= gain;
            (x, y) = (LACUNARITY * (0.8 * x - 0.6 * y), LACUNARITY * (0.6 * x + 0.8 * y));
        }
        sum / power.sqrt()
    }

    /// One octave on a lattice shifted by its own offset.
    fn octave(&self, x: f64, y: f64, octave: u32) -> f64 {
        let shift = self.hash.uniforms(0, 0, !octave);
        let (x, y) = (x + shift[0], y + shift[1]);
        let (column, row) = (x.floor(), y.floor());
        let (fx, fy) = (x - column, y - row);
        let corner = |dx: f64, dy: f64| {
            let [gx, gy, ..] = self.hash.uniforms(place(column + dx), place(row + dy), octave);
            (2.0 * gx - 1.0) * (fx - dx) + (2.0 * gy - 1.0) * (fy - dy)
        };
        let (u, v) = (fade(fx), fade(fy));
        let top = mix(corner(0.0, 0.0), corner(1.0, 0.0), u);
        let bottom = mix(corner(0.0, 1.0), corner(1.0, 1.0), u);
        mix(top, bottom, v)
    }
}

/// Hash coordinate of a whole number that may be negative.
pub(super) fn place(whole: f64) -> u32 {
    whole as i64 as u32
}

/// a at t = 0, b at t = 1.
pub(super) fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// [`mix`] for colours.
pub(super) fn mix3(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|channel| mix(a[channel], b[channel], t))
}

/// Cubic step from 0 below `from` to 1 above `to`.
pub(super) fn smoothstep(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn fade(t: f64) -> f64 {
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_centred_continuous_and_its_own_for_every_family() {
        let (a, b) = (Noise::new(3, 0), Noise::new(3, 1));
        let places: Vec<(f64, f64)> = (0..20_000)
            .map(|i| (f64::from(i % 200) * 0.37 - 31.0, f64::from(i / 200) * 0.41 - 17.0))
            .collect();
        let mean = |f: &dyn Fn(f64, f64) -> f64| places.iter().map(|&(x, y)| f(x, y)).sum::<f64>() / 20_000.0;
        let deviation = mean(&|x, y| a.at(x, y).powi(2)).sqrt();
        assert!(mean(&|x, y| a.at(x, y)).abs() < 0.01, "{}", mean(&|x, y| a.at(x, y)));
        assert!((0.15..0.3).contains(&deviation), "{deviation}");
        assert!(mean(&|x, y| a.at(x, y) * b.at(x, y)).abs() < 0.1 * deviation * deviation);
        assert!(mean(&|x, y| (a.at(x, y) - a.at(x + 1e-6, y)).abs()) < 1e-5);
    }
}
