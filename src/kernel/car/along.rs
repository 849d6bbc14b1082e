//! The recursion along a row.
//!
//! Texel by texel it is one chain of dependent steps. Some successive texels are made at once instead, as many as fit a
//! vector of all their channels: each is a sum over what the rows above gave to it and to those before it in the block
//! (times the impulse response of the recursion), and over the texels before the block (times its response to them).
//! Only the latter sum waits for the block before.

use super::STRIP;
use super::lanes::{LANES, Lanes};

/// Sums that grow side by side, so that a block waits for few additions of the one before.
const CHAINS: usize = 3;

/// The recursion y_x = s_x + A_1 y_(x-1) + ... + A_n y_(x-n), in blocks.
pub(super) struct Along {
    channels: usize,
    /// Texels of a block: a divisor of the strip.
    texels: usize,
    /// Values of the line that are earlier texels: n, and what fills up a multiple of [`CHAINS`].
    before: usize,
    /// `[vector][channel, texel of the block][lane]`: what the sums give to the block.
    inputs: Vec<[f32; LANES]>,
    /// `[vector][value before the block][lane]`: what earlier texels give.
    states: Vec<[f32; LANES]>,
}

impl Along {
    /// `coefficient(dx, to, from)` is A_dx, dx from 1 to `reach`, which is n.
    pub(super) fn new(
        channels: usize,
        reach: usize,
        coefficient: impl Fn(usize, usize, usize) -> f64,
    ) -> Self {
        let texels = [16, 8, 5, 4, 2].into_iter().find(|n| n * channels <= LANES).unwrap_or(1);
        // What a unit at one place gives to the block, by the recursion itself; places run over texels, then channels.
        let response = |place: usize| -> Vec<f64> {
            let mut line = vec![0.0; (reach + texels) * channels];
            line[place] = 1.0;
            for x in reach..reach + texels {
                for (to, dx, from) in steps(channels, reach) {
                    line[x * channels + to] += coefficient(dx, to, from) * line[(x - dx) * channels + from];
                }
            }
            line.split_off(reach * channels)
        };
        let split = |places: &[Option<usize>]| -> Vec<[f32; LANES]> {
            let responses: Vec<Vec<f64>> =
                places.iter().map(|place| place.map(response).unwrap_or_default()).collect();
            let vectors = (texels * channels).div_ceil(LANES);
            let lane = |response: &[f64], n: usize| response.get(n).map_or(0.0, |&value| value as f32);
            let of = |v| responses.iter().map(move |r| std::array::from_fn(|n| lane(r, v * LANES + n)));
            (0..vectors).flat_map(of).collect()
        };
        let values = reach * channels;
        let before = values.next_multiple_of(CHAINS);
        let states: Vec<_> = (0..before).map(|n| n.checked_sub(before - values)).collect();
        let inputs: Vec<_> =
            (0..channels).flat_map(|c| (0..texels).map(move |x| Some((reach + x) * channels + c))).collect();
        Self { channels, texels, before, inputs: split(&inputs), states: split(&states) }
    }

    /// Values of the line that are earlier texels; the last of them is that before the first to be made.
    pub(super) fn before(&self) -> usize {
        self.before
    }

    /// Length of the line that [`Self::run`] works on: earlier texels, a strip, and what vectors write beyond it.
    pub(super) fn line_len(&self) -> usize {
        self.before + STRIP * self.channels + LANES
    }

    /// Makes `columns` texels of the line, which is interleaved and begins with the earlier texels, from `sums`
    /// `[channel][STRIP]`.
    #[inline(always)]
    pub(super) fn run<V: Lanes>(&self, columns: usize, sums: &[f32], line: &mut [f32]) {
        match self.texels {
            16 => self.blocks::<V, 16>(columns, sums, line),
            8 => self.blocks::<V, 8>(columns, sums, line),
            5 => self.blocks::<V, 5>(columns, sums, line),
            4 => self.blocks::<V, 4>(columns, sums, line),
            2 => self.blocks::<V, 2>(columns, sums, line),
            _ => self.blocks::<V, 1>(columns, sums, line),
        }
    }

    /// `T` texels a block.
    #[inline(always)]
    fn blocks<V: Lanes, const T: usize>(&self, columns: usize, sums: &[f32], line: &mut [f32]) {
        let inputs = self.inputs.as_chunks::<T>().0;
        let states = self.states.as_chunks::<CHAINS>().0;
        let (c, n) = (self.channels, self.before / CHAINS);
        for (number, first) in (0..columns).step_by(T).enumerate() {
            let line = &mut line[number * T * c..];
            for vector in 0..inputs.len() / c {
                let (inputs, states) = (&inputs[vector * c..][..c], &states[vector * n..][..n]);
                let mut chains = [V::splat(0.0); CHAINS];
                for (coefficients, sums) in inputs.iter().zip(sums.chunks_exact(STRIP)) {
                    let sums: &[f32; T] = sums[first..].first_chunk().unwrap_or(&[0.0; T]);
                    for t in 0..T {
                        chains[0] = V::load(&coefficients[t]).times_plus(V::splat(sums[t]), chains[0]);
                    }
                }
                for (coefficients, earlier) in states.iter().zip(line.as_chunks::<CHAINS>().0) {
                    for n in 0..CHAINS {
                        chains[n] = V::load(&coefficients[n]).times_plus(V::splat(earlier[n]), chains[n]);
                    }
                }
                let found = chains[1].plus(chains[2]).plus(chains[0]);
                if let Some(to) = line[self.before + vector * LANES..].first_chunk_mut() {
                    found.store(to);
                }
            }
        }
    }
}

/// Receiving channel, distance and giving channel of every coefficient.
fn steps(channels: usize, reach: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    let of = move |to| (1..=reach).flat_map(move |dx| (0..channels).map(move |from| (to, dx, from)));
    (0..channels).flat_map(of)
}
