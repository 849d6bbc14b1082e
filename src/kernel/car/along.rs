//! The recursion along a row.
//!
//! Texel by texel it is one chain of dependent steps. Some successive texels are made at once instead, as many as fit a
//! vector of all their channels: each is a sum over what the rows above gave to it and to those before it in the block
//! (times the impulse response of the recursion), and over the texels before the block (times its response to them).
//! Only the latter sum waits for the block before.

use super::STRIP;
use super::lanes::{LANES, Lanes};

/// The recursion y_x = s_x + A_1 y_(x-1) + ... + A_n y_(x-n), in blocks.
pub(super) struct Along {
    channels: usize,
    /// n.
    reach: usize,
    /// Texels of a block.
    texels: usize,
    /// Vectors that hold a block.
    vectors: usize,
    /// `[vector][texel of the block, channel][lane]`: what the sums give.
    inputs: Vec<[f32; LANES]>,
    /// `[vector][texel before the block, channel][lane]`: what earlier texels give, the farthest first.
    states: Vec<[f32; LANES]>,
}

impl Along {
    /// `coefficient(dx, to, from)` is A_dx, dx from 1 to `reach`.
    pub(super) fn new(
        channels: usize,
        reach: usize,
        coefficient: impl Fn(usize, usize, usize) -> f64,
    ) -> Self {
        // Divisors of the strip only.
        let texels = [16, 8, 5, 4, 2].into_iter().find(|n| n * channels <= LANES).unwrap_or(1);
        let vectors = (texels * channels).div_ceil(LANES);
        // What a unit at one place gives to the block, by the recursion itself; places run over texels, then channels.
        let response = |place: usize| -> Vec<f64> {
            let mut line = vec![0.0; (reach + texels) * channels];
            line[place] = 1.0;
            for x in reach..reach + texels {
                for to in 0..channels {
                    for dx in 1..=reach {
                        for from in 0..channels {
                            line[x * channels + to] +=
                                coefficient(dx, to, from) * line[(x - dx) * channels + from];
                        }
                    }
                }
            }
            line.split_off(reach * channels)
        };
        let split = |places: std::ops::Range<usize>| -> Vec<[f32; LANES]> {
            let responses: Vec<Vec<f64>> = places.map(response).collect();
            let lane = |vector: usize, n: usize, response: &[f64]| {
                response.get(vector * LANES + n).map_or(0.0, |&value| value as f32)
            };
            let of = |vector| responses.iter().map(move |r| std::array::from_fn(|n| lane(vector, n, r)));
            (0..vectors).flat_map(of).collect()
        };
        let before = reach * channels;
        Self {
            channels,
            reach,
            texels,
            vectors,
            inputs: split(before..before + texels * channels),
            states: split(0..before),
        }
    }

    /// Length of the line that [`Self::run`] works on: earlier texels, a strip, and what vectors write beyond it.
    pub(super) fn line_len(&self) -> usize {
        (self.reach + STRIP) * self.channels + LANES
    }

    /// Values of the line that are earlier texels.
    pub(super) fn before(&self) -> usize {
        self.reach * self.channels
    }

    /// Makes `columns` texels of the line, which is interleaved and begins with the earlier texels, from `sums`
    /// `[channel][STRIP]`.
    #[inline(always)]
    pub(super) fn run<V: Lanes>(&self, columns: usize, sums: &[f32], line: &mut [f32]) {
        let before = self.before();
        let block = self.texels * self.channels;
        for first in (0..columns).step_by(self.texels) {
            for vector in 0..self.vectors {
                let inputs = &self.inputs[vector * block..][..block];
                let states = &self.states[vector * before..][..before];
                let mut chains = [V::splat(0.0); 3];
                for (texel, inputs) in inputs.chunks_exact(self.channels).enumerate() {
                    for (coefficients, sums) in inputs.iter().zip(sums.chunks_exact(STRIP)) {
                        chains[0] =
                            V::load(coefficients).times_plus(V::splat(sums[first + texel]), chains[0]);
                    }
                }
                let at = first * self.channels;
                let earlier = &line[at..at + before];
                for (coefficients, earlier) in states.chunks(3).zip(earlier.chunks(3)) {
                    for (chain, (coefficients, &earlier)) in
                        chains.iter_mut().zip(coefficients.iter().zip(earlier))
                    {
                        *chain = V::load(coefficients).times_plus(V::splat(earlier), *chain);
                    }
                }
                let found = chains[1].plus(chains[2]).plus(chains[0]);
                if let Some(to) = line[at + before + vector * LANES..].first_chunk_mut() {
                    found.store(to);
                }
            }
        }
    }
}
