//! What the noise and the rows above give to the texels of a strip: no texel waits for another, so columns are lanes.

use super::STRIP;
use super::lanes::{LANES, Lanes};

/// Channels whose sums are held together, at most.
const MOST_TOGETHER: usize = 3;

/// Coefficients of the noise and of the sites in rows above, for some successive receiving channels.
struct Block {
    first: usize,
    /// Receiving channels, 1 to [`MOST_TOGETHER`].
    channels: usize,
    /// `[source][receiving channel]`; sources are the channels of the noise, then those of each site.
    coefficients: Vec<f32>,
}

/// The sums of one strip: for each texel first the noise, then the sites as given, channel by channel.
pub(super) struct Above {
    channels: usize,
    blocks: Vec<Block>,
}

impl Above {
    /// `coefficient(to, source)` with the sources in order, `sources` of them.
    pub(super) fn new(channels: usize, sources: usize, coefficient: impl Fn(usize, usize) -> f32) -> Self {
        let together = channels.div_ceil(channels.div_ceil(MOST_TOGETHER));
        let block = |first| {
            let channels = together.min(channels - first);
            let of = |source| (first..first + channels).map(move |to| (to, source));
            let coefficients =
                (0..sources).flat_map(of).map(|(to, source)| coefficient(to, source)).collect();
            Block { first, channels, coefficients }
        };
        Self { channels, blocks: (0..channels).step_by(together).map(block).collect() }
    }

    /// Fills the first `columns` of `sums` `[channel][STRIP]`, and some beyond. `noise` is `[channel][STRIP]`; source n
    /// after it begins at `rows[starts[n]]` and has a vector and more beyond the columns.
    #[inline(always)]
    pub(super) fn sum<V: Lanes>(
        &self,
        columns: usize,
        noise: &[f32],
        rows: &[f32],
        starts: &[usize],
        sums: &mut [f32],
    ) {
        for block in &self.blocks {
            let sums = &mut sums[block.first * STRIP..][..block.channels * STRIP];
            let of = |at: usize| Sources { at, noise, rows, starts };
            // At least eight sums, so that none waits for its predecessor, and no more than fit the registers.
            match (block.channels, V::TOGETHER) {
                (1, 1) => block.sum::<V, 1, 1>(columns, of, sums),
                (1, _) => block.sum::<V, 1, 5>(columns, of, sums),
                (2, 4) => block.sum::<V, 2, 4>(columns, of, sums),
                (2, 2) => block.sum::<V, 2, 2>(columns, of, sums),
                (2, _) => block.sum::<V, 2, 1>(columns, of, sums),
                (_, 4) => block.sum::<V, 3, 4>(columns, of, sums),
                (_, 2) => block.sum::<V, 3, 2>(columns, of, sums),
                _ => block.sum::<V, 3, 1>(columns, of, sums),
            }
        }
        debug_assert_eq!(sums.len(), self.channels * STRIP);
    }
}

/// Where the sources of some columns lie.
#[derive(Clone, Copy)]
struct Sources<'a> {
    at: usize,
    noise: &'a [f32],
    rows: &'a [f32],
    starts: &'a [usize],
}

impl Block {
    /// `C` channels of `U` vectors at a time.
    #[inline(always)]
    fn sum<'a, V: Lanes, const C: usize, const U: usize>(
        &self,
        columns: usize,
        sources: impl Fn(usize) -> Sources<'a>,
        sums: &mut [f32],
    ) {
        let coefficients = self.coefficients.as_chunks::<C>().0;
        for at in (0..columns).step_by(U * LANES) {
            let Sources { at, noise, rows, starts } = sources(at);
            let mut held = [[V::splat(0.0); U]; C];
            let (of_noise, of_rows) = coefficients.split_at(noise.len() / STRIP);
            for (coefficients, noise) in of_noise.iter().zip(noise.chunks_exact(STRIP)) {
                add::<V, C, U>(&mut held, coefficients, &noise[at..]);
            }
            for (coefficients, &start) in of_rows.iter().zip(starts) {
                add::<V, C, U>(&mut held, coefficients, &rows[start + at..]);
            }
            for (held, sums) in held.iter().zip(sums.chunks_exact_mut(STRIP)) {
                for (held, sums) in held.iter().zip(sums[at..].as_chunks_mut().0) {
                    held.store(sums);
                }
            }
        }
    }
}

/// Adds a source times its coefficient for each channel.
#[inline(always)]
fn add<V: Lanes, const C: usize, const U: usize>(
    held: &mut [[V; U]; C],
    coefficients: &[f32; C],
    source: &[f32],
) {
    let coefficients: [V; C] = std::array::from_fn(|c| V::splat(coefficients[c]));
    let source = &source[..U * LANES].as_chunks::<LANES>().0;
    for u in 0..U {
        let value = V::load(&source[u]);
        for c in 0..C {
            held[c][u] = coefficients[c].times_plus(value, held[c][u]);
        }
    }
}
