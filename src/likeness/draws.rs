//! The random numbers of numpy's `default_rng(0)`, in the order in which numpy draws them, so that figures here can be
//! compared with those of a judge written in Python: O'Neill's PCG XSL RR 128/64 ("PCG: a family of simple fast
//! space-efficient statistically good algorithms for random number generation", 2014), Lemire's bounded integers ("Fast
//! random integer generation in an interval", 2019) and the ziggurat of Marsaglia and Tsang ("The ziggurat method for
//! generating random variables", 2000).

/// Multiplier of the generator.
const MULTIPLIER: u128 = 0x2360_ED05_1FC6_5DA4_4385_DF64_9FCC_F645;

/// State and increment that numpy derives from seed 0.
const STATE_OF_SEED_0: u128 = 35_399_562_948_360_463_058_890_781_895_381_311_971;
const INCREMENT_OF_SEED_0: u128 = 87_136_372_517_582_989_555_478_159_403_783_844_777;

/// Layers of the ziggurat, and where the lowest one begins its tail.
const LAYERS: usize = 256;
const TAIL: f64 = 3.654_152_885_361_009;

/// 2^52: positions in a layer.
const POSITIONS: f64 = (1u64 << 52) as f64;

/// A generator, and the upper half of a word of which only the lower one was used.
pub(super) struct Draws {
    state: u128,
    spare: Option<u32>,
    ziggurat: Ziggurat,
}

impl Draws {
    pub(super) fn of_seed_0() -> Self {
        Self { state: STATE_OF_SEED_0, spare: None, ziggurat: Ziggurat::new() }
    }

    fn word(&mut self) -> u64 {
        self.state = self.state.wrapping_mul(MULTIPLIER).wrapping_add(INCREMENT_OF_SEED_0);
        let folded = (self.state >> 64) as u64 ^ self.state as u64;
        folded.rotate_right((self.state >> 122) as u32)
    }

    fn half_word(&mut self) -> u32 {
        self.spare.take().unwrap_or_else(|| {
            let word = self.word();
            self.spare = Some((word >> 32) as u32);
            word as u32
        })
    }

    /// From 0 up to 1.
    fn uniform(&mut self) -> f64 {
        (self.word() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A whole number below `bound`, which is at least 2.
    pub(super) fn below(&mut self, bound: u32) -> u32 {
        let threshold = bound.wrapping_neg() % bound;
        loop {
            let product = u64::from(self.half_word()) * u64::from(bound);
            if product as u32 >= threshold {
                return (product >> 32) as u32;
            }
        }
    }

    /// A standard normal.
    pub(super) fn normal(&mut self) -> f64 {
        loop {
            let word = self.word();
            let layer = (word & 0xFF) as usize;
            let is_negative = word >> 8 & 1 == 1;
            let position = word >> 9 & ((1 << 52) - 1);
            let magnitude = position as f64 * self.ziggurat.width[layer];
            let signed = |magnitude: f64, is_negative: bool| if is_negative { -magnitude } else { magnitude };
            if position < self.ziggurat.inner[layer] {
                return signed(magnitude, is_negative);
            }
            if layer == 0 {
                return signed(self.tail(), position >> 8 & 1 == 1);
            }
            let [outer, inner] = [layer - 1, layer].map(|layer| self.ziggurat.density[layer]);
            if (outer - inner) * self.uniform() + inner < libm::exp(-0.5 * magnitude * magnitude) {
                return signed(magnitude, is_negative);
            }
        }
    }

    /// The magnitude of a normal in the tail.
    fn tail(&mut self) -> f64 {
        loop {
            let beyond = -libm::log1p(-self.uniform()) / TAIL;
            let height = -libm::log1p(-self.uniform());
            if height + height > beyond * beyond {
                return TAIL + beyond;
            }
        }
    }
}

/// Layers of equal area under exp(-x^2 / 2).
struct Ziggurat {
    /// Positions that surely lie below the curve.
    inner: [u64; LAYERS],
    /// Length of a position.
    width: [f64; LAYERS],
    /// The curve at the layer's right end.
    density: [f64; LAYERS],
}

impl Ziggurat {
    fn new() -> Self {
        let density = |x: f64| libm::exp(-0.5 * x * x);
        let tail = (std::f64::consts::PI / 2.0).sqrt() * libm::erfc(TAIL * std::f64::consts::FRAC_1_SQRT_2);
        let area = TAIL * density(TAIL) + tail;
        let base = area / density(TAIL);
        let mut table = Self { inner: [0; LAYERS], width: [0.0; LAYERS], density: [0.0; LAYERS] };
        table.inner[0] = (TAIL / base * POSITIONS) as u64;
        table.width[0] = base / POSITIONS;
        table.density[0] = 1.0;
        let mut end = TAIL;
        for layer in (1..LAYERS).rev() {
            table.width[layer] = end / POSITIONS;
            table.density[layer] = density(end);
            if layer > 1 {
                let next = (-2.0 * libm::log(area / end + density(end))).sqrt();
                table.inner[layer] = (next / end * POSITIONS) as u64;
                end = next;
            }
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known values of numpy 2.4: `g = default_rng(0); g.integers(0, 14884, 4000)[:5]; g.standard_normal(5)`, and then
    /// the sum of absolute values of 200000 more, which visits every layer and the tail.
    #[test]
    fn they_are_those_of_numpy() {
        let mut draws = Draws::of_seed_0();
        let integers: Vec<u32> = (0..4000).map(|_| draws.below(14_884)).collect();
        assert_eq!(integers[..5], [12_660, 9480, 7607, 4015, 4581]);
        let normals: Vec<f64> = (0..5).map(|_| draws.normal()).collect();
        let expected = [
            1.5368184215190834,
            -1.0460250843496357,
            -0.6560050267337564,
            -0.6832544940131859,
            0.7848009523262729,
        ];
        for (found, expected) in normals.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{normals:?}");
        }
        let sum: f64 = (0..200_000).map(|_| draws.normal().abs()).sum();
        assert!((sum - 159804.783138730).abs() < 1e-6, "{sum}");
    }
}
