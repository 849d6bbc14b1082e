//! Rows of a causal autoregressive field, y_r = L z_r + sum of A_s y_(r-s), in f32.
//!
//! The noise and the sites in rows above are summed by columns as lanes ([`above`]), strip by strip; then the sites in
//! the same row follow by a recursion in blocks ([`along`]). Every sum is of fused multiply-adds in one order, lane by
//! lane, so all kernels give the same bits.

mod above;
mod along;
mod lanes;

use super::{Kernel, compiled_for_each_kernel, dispatch};
use above::Above;
use along::Along;
use lanes::{LANES, Lanes};

/// Columns worked on together: what they need of five rows of three channels stays in the first-level cache. A multiple
/// of the columns that [`above`] holds in registers and of every block of [`along`].
pub const STRIP: usize = 320;

/// Columns beyond the end of a row that may be read for nothing.
const SLACK: usize = 5 * LANES;

/// Where a row begins and ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// Beyond both ends lie zeros.
    Open,
    /// The row is a ring: its last texels lie before its first. To reach the state in which it closes, the recursion
    /// along the row sets out this many texels before the first.
    Ring {
        /// Texels.
        lead: usize,
    },
}

/// A field: its coefficients, and the rows that the next one needs.
pub struct Field {
    kernel: Kernel,
    channels: usize,
    width: usize,
    ends: Ends,
    above: Above,
    along: Along,
    /// (dy, dx) of the sites in rows above, the farthest first.
    sites: Vec<[i32; 2]>,
    /// Texels to each side of a row that sites may reach.
    pad: usize,
    /// Distance of two channels of a row.
    stride: usize,
    /// `[slot][channel][stride]`: a ring of as many rows as the highest site reaches, and one more.
    rows: Vec<f32>,
    slots: usize,
    newest: usize,
    scratch: Scratch,
}

/// What lives while a row is made only.
struct Scratch {
    /// `[channel][STRIP]`.
    noise: Vec<f32>,
    sums: Vec<f32>,
    /// The row as it is made, interleaved; earlier texels in front.
    line: Vec<f32>,
    /// Where in the rows each source begins.
    starts: Vec<usize>,
}

/// Coefficients of a field.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients<'a> {
    /// Channels, at least 1.
    pub channels: usize,
    /// Causal sites (dy, dx), dy >= 0 and, where dy is 0, dx > 0.
    pub sites: &'a [[i32; 2]],
    /// A of each site, `[site][to][from]`.
    pub gamma: &'a [f64],
    /// L, lower triangular, `[to][from]`.
    pub factor: &'a [f64],
}

impl Field {
    /// A field of `width` texels a row, after rows of zeros.
    pub fn new(kernel: Kernel, coefficients: Coefficients<'_>, width: usize, ends: Ends) -> Self {
        let Coefficients { channels, sites, gamma, factor } = coefficients;
        let at = |site: usize, to: usize, from: usize| gamma[(site * channels + to) * channels + from];
        let of_row = |above: bool| (0..sites.len()).rev().filter(move |&n| (sites[n][0] > 0) == above);
        let upper: Vec<usize> = of_row(true).collect();
        let above = Above::new(channels, channels * (1 + upper.len()), |to, source| {
            let from = source % channels;
            match source / channels {
                0 if from > to => 0.0,
                0 => factor[to * channels + from] as f32,
                n => at(upper[n - 1], to, from) as f32,
            }
        });
        let left: Vec<usize> = of_row(false).collect();
        let reach = left.iter().map(|&n| sites[n][1].unsigned_abs() as usize).max().unwrap_or(0);
        let along = Along::new(channels, reach, |dx, to, from| {
            left.iter().filter(|&&n| sites[n][1] as usize == dx).map(|&n| at(n, to, from)).sum()
        });
        let [highest, pad] = farthest(sites);
        let stride = width + 2 * pad + SLACK;
        let slots = highest + 1;
        let scratch = Scratch {
            noise: vec![0.0; channels * STRIP],
            sums: vec![0.0; channels * STRIP],
            line: vec![0.0; along.line_len()],
            starts: Vec::with_capacity(upper.len() * channels),
        };
        Self {
            kernel,
            channels,
            width,
            ends,
            above,
            along,
            sites: upper.iter().map(|&n| sites[n]).collect(),
            pad,
            stride,
            rows: vec![0.0; slots * channels * stride],
            slots,
            newest: 0,
            scratch,
        }
    }

    /// Bytes of the rows of a field of this width.
    pub fn bytes(channels: usize, sites: &[[i32; 2]], width: usize) -> u64 {
        let [highest, pad] = farthest(sites).map(|texels| texels as u64);
        let stride = width as u64 + 2 * pad + SLACK as u64;
        (highest + 1) * stride * channels as u64 * size_of::<f32>() as u64
    }

    /// Makes the next row. `noise(channel, column, out)` gives the standard normals z of columns `column ..` of a channel;
    /// those of a ring are asked for more than once.
    pub fn advance(&mut self, mut noise: impl FnMut(usize, usize, &mut [f32])) {
        self.newest = (self.newest + 1) % self.slots;
        let mut starts = std::mem::take(&mut self.scratch.starts);
        starts.clear();
        for &[dy, dx] in &self.sites {
            let slot = (self.newest + self.slots - dy as usize) % self.slots;
            starts.extend(
                (0..self.channels).map(|from| self.start(slot, from).wrapping_add_signed(-dx as isize)),
            );
        }
        self.scratch.starts = starts;
        self.scratch.line[..self.along.before()].fill(0.0);
        if let Ends::Ring { lead } = self.ends {
            let (mut left, mut at) = (lead, (self.width - lead % self.width) % self.width);
            while left > 0 {
                let columns = left.min(self.width - at).min(STRIP);
                self.strip(at, columns, &mut noise, false);
                (left, at) = (left - columns, (at + columns) % self.width);
            }
        }
        for at in (0..self.width).step_by(STRIP) {
            self.strip(at, STRIP.min(self.width - at), &mut noise, true);
        }
        self.close(self.newest);
    }

    /// Channels.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Channel `channel` of the row that lies `above` rows above the newest.
    pub fn row(&self, above: usize, channel: usize) -> &[f32] {
        &self.rows[self.start((self.newest + self.slots - above) % self.slots, channel)..][..self.width]
    }

    /// How many rows the next one depends on: those [`Self::row`] gives from 0 on.
    pub fn depth(&self) -> usize {
        self.slots - 1
    }

    /// Puts another row in place of the one that lies `above` rows above the newest, `[channel][width]`.
    pub fn replace(&mut self, above: usize, row: &[f32]) {
        let slot = (self.newest + self.slots - above) % self.slots;
        for (channel, row) in row.chunks_exact(self.width).enumerate() {
            let start = self.start(slot, channel);
            self.rows[start..start + self.width].copy_from_slice(row);
        }
        self.close(slot);
    }

    /// Where the first column of a channel lies.
    fn start(&self, slot: usize, channel: usize) -> usize {
        (slot * self.channels + channel) * self.stride + self.pad
    }

    /// Makes texels `at ..` of the newest row after those before them in the line, and keeps them or not.
    fn strip(
        &mut self,
        at: usize,
        columns: usize,
        noise: &mut impl FnMut(usize, usize, &mut [f32]),
        keep: bool,
    ) {
        for (channel, out) in self.scratch.noise.chunks_exact_mut(STRIP).enumerate() {
            noise(channel, at, &mut out[..columns]);
        }
        let Scratch { noise, sums, line, starts } = &mut self.scratch;
        let work = Work { at, columns, noise, rows: &self.rows, starts, sums, line };
        make(self.kernel, &self.above, &self.along, work);
        let before = self.along.before();
        if keep {
            let start = self.start(self.newest, 0) + at;
            let made = &self.scratch.line[before..][..columns * self.channels];
            part(self.kernel, made, &mut self.rows[start..], self.channels, self.stride);
        }
        self.scratch.line.copy_within(columns * self.channels..columns * self.channels + before, 0);
    }

    /// Lays the ends of a ring beyond its other end.
    fn close(&mut self, slot: usize) {
        if self.ends == Ends::Open {
            return;
        }
        for channel in 0..self.channels {
            let start = self.start(slot, channel);
            for n in 0..self.pad {
                self.rows[start + self.width + n] = self.rows[start + n % self.width];
                self.rows[start - 1 - n] = self.rows[start + self.width - 1 - n % self.width];
            }
        }
    }
}

/// The farthest row above and the farthest column to either side that sites reach.
fn farthest(sites: &[[i32; 2]]) -> [usize; 2] {
    [0, 1].map(|axis| sites.iter().map(|s| s[axis].unsigned_abs() as usize).max().unwrap_or(0))
}

/// A strip of a row.
struct Work<'a> {
    at: usize,
    columns: usize,
    noise: &'a [f32],
    rows: &'a [f32],
    starts: &'a [usize],
    sums: &'a mut [f32],
    line: &'a mut [f32],
}

#[inline(always)]
fn make_with<V: Lanes>(above: &Above, along: &Along, work: Work<'_>) {
    let Work { at, columns, noise, rows, starts, sums, line } = work;
    above.sum::<V>(columns, noise, &rows[at..], starts, sums);
    along.run::<V>(columns, sums, line);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn make_avx2(above: &Above, along: &Along, work: Work<'_>) {
    make_with::<[std::arch::x86_64::__m256; 2]>(above, along, work);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,fma")]
fn make_avx512(above: &Above, along: &Along, work: Work<'_>) {
    make_with::<std::arch::x86_64::__m512>(above, along, work);
}

fn make(kernel: Kernel, above: &Above, along: &Along, work: Work<'_>) {
    dispatch!(
        kernel;
        make_with::<[f32; LANES]>(above, along, work),
        make_avx2(above, along, work),
        make_avx512(above, along, work),
    );
}

#[inline(always)]
fn part_body(texels: &[f32], planes: &mut [f32], channels: usize, stride: usize) {
    if channels == 3 {
        let (first, rest) = planes.split_at_mut(stride);
        let (second, third) = rest.split_at_mut(stride);
        let planes = first.iter_mut().zip(second).zip(third);
        for (texel, ((first, second), third)) in texels.as_chunks::<3>().0.iter().zip(planes) {
            (*first, *second, *third) = (texel[0], texel[1], texel[2]);
        }
        return;
    }
    for channel in 0..channels {
        let values = texels[channel..].iter().step_by(channels);
        planes[channel * stride..].iter_mut().zip(values).for_each(|(to, &value)| *to = value);
    }
}

compiled_for_each_kernel! {
    /// Interleaved texels to planes that lie `stride` apart.
    fn part(texels: &[f32], planes: &mut [f32], channels: usize, stride: usize) = part_body
}

#[cfg(test)]
mod tests;
