//! The autoregressive field of one level on its lattice: where its rows and columns lie, and its noise.

use crate::error::Result;
use crate::kernel::Kernel;
use crate::kernel::car::{Coefficients, Ends, Field};
use crate::method::field::fit::car::cholesky;
use crate::method::field::model::{CarKind, Level};
use crate::random::Hash;

/// Rows and columns of a lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Grid {
    /// The first row that is generated, after rows of zeros.
    pub first_row: i32,
    /// The first column; 0 on a ring.
    pub first_column: i32,
    /// Columns.
    pub width: usize,
    /// Rows after which the noise comes again, and texels that the recursion along a row sets out before the first,
    /// where rows are rings.
    pub ring: Option<Ring>,
}

/// A lattice that wraps in both directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Ring {
    pub height: usize,
    pub lead: usize,
}

/// Generates rows of Y_r = Gamma X_r + e_r, e_r = L z_r with L L^T = Sigma, from the zero state. The normals z are
/// hashed from row, column and channel.
pub(super) struct Lattice {
    /// One field of all channels, or (2D) one of each.
    parts: Vec<Field>,
    kernel: Kernel,
    hash: Hash,
    grid: Grid,
    next_row: i32,
}

impl Lattice {
    /// The field of `level`. The noise of a texel depends on `hash` and its place on the lattice only.
    pub(super) fn new(level: &Level, kind: CarKind, hash: Hash, grid: Grid, kernel: Kernel) -> Result<Self> {
        let ends = grid.ring.map_or(Ends::Open, |ring| Ends::Ring { lead: ring.lead });
        let sites = &level.neighbourhood;
        let field = |channels, gamma: &[f64], factor: &[f64]| {
            Field::new(kernel, Coefficients { channels, sites, gamma, factor }, grid.width, ends)
        };
        let channels = level.gamma.nrows();
        let parts = match kind {
            CarKind::Car3d => {
                // Columns of Gamma run over the sites, then the channels from which; its transpose lies row by row.
                let block = |s| level.gamma.columns(s * channels, channels).transpose();
                let gamma: Vec<f64> = (0..sites.len()).flat_map(|s| block(s).as_slice().to_vec()).collect();
                vec![field(channels, &gamma, cholesky(level.noise_covariance())?.l().transpose().as_slice())]
            }
            CarKind::Car2d => {
                let of = |channel| {
                    let gamma: Vec<f64> = level.gamma.row(channel).iter().copied().collect();
                    field(1, &gamma, &[level.noise_covariance()[(channel, 0)].sqrt()])
                };
                (0..channels).map(of).collect()
            }
        };
        Ok(Self { parts, kernel, hash, grid, next_row: grid.first_row })
    }

    /// The lattice row that [`Self::advance`] will generate.
    pub(super) fn next_row(&self) -> i32 {
        self.next_row
    }

    /// Generates one row.
    pub(super) fn advance(&mut self) {
        let Self { parts, kernel, hash, grid, next_row } = self;
        let row = grid.ring.map_or(*next_row, |ring| next_row.rem_euclid(ring.height as i32));
        let channels = parts[0].channels();
        for (n, part) in parts.iter_mut().enumerate() {
            part.advance(|channel, at, out| {
                let column = grid.first_column + at as i32;
                hash.normal_row(*kernel, row, column, (n * channels + channel) as u32, out);
            });
        }
        self.next_row += 1;
    }

    /// Copies columns `first ..` of the newest row of a channel.
    pub(super) fn copy(&self, channel: usize, first: i32, out: &mut [f32]) {
        let channels = self.parts[0].channels();
        let row = self.parts[channel / channels].row(0, channel % channels);
        let mut at = first - self.grid.first_column;
        if self.grid.ring.is_some() {
            at = at.rem_euclid(row.len() as i32);
        }
        let mut at = at as usize;
        let mut rest = out;
        while !rest.is_empty() {
            let (here, after) = rest.split_at_mut(rest.len().min(row.len() - at));
            here.copy_from_slice(&row[at..at + here.len()]);
            (rest, at) = (after, 0);
        }
    }

    /// The values that the next row depends on, in a fixed order.
    pub(super) fn state(&self) -> impl Iterator<Item = &[f32]> {
        self.parts.iter().flat_map(|part| {
            let rows = (0..part.depth()).flat_map(|above| (0..part.channels()).map(move |c| (above, c)));
            rows.map(|(above, channel)| part.row(above, channel))
        })
    }

    /// How many values [`Self::state`] gives.
    pub(super) fn state_len(&self) -> usize {
        self.parts.iter().map(|part| part.depth() * part.channels()).sum::<usize>() * self.grid.width
    }

    /// Goes on from the values of [`Self::state`], [`Self::state_len`] of them, with row `next_row`.
    pub(super) fn restore(&mut self, next_row: i32, values: &[f32]) {
        let mut rest = values;
        for part in &mut self.parts {
            for above in 0..part.depth() {
                let (row, after) = rest.split_at(part.channels() * self.grid.width);
                part.replace(above, row);
                rest = after;
            }
        }
        self.next_row = next_row;
    }
}
