//! Finding the lattice of a texture in its autocorrelation.
//!
//! A lattice is believed where the texture comes back after a shift and has been away in between: a peak with a valley
//! before it. Smooth random textures have no peaks, and what hardly changes at all has no valleys.

use super::cells::wave_counts;
use super::correlation::Autocorrelation;
use super::peaks::{Peak, SHORTEST, lowest_before, peaks};
use super::{Lattice, cross, dot, length, reduced, sine};
use crate::shape::{Size, Window};

/// Least autocorrelation of a peak.
const LEAST_VALUE: f64 = 0.35;

/// Least height of a peak above the valley before it.
const LEAST_RISE: f64 = 0.30;

/// Least value of the peaks that may be shortest vectors, relative to the best.
const NEARLY_BEST: f64 = 0.8;

/// Least sine of the angle between the two shortest vectors.
const LEAST_SINE: f64 = 0.35;

/// How far from its place a peak of the lattice may lie, texels.
const STRAY: f64 = 2.0;

/// Least value of a peak that a vector is fitted to, relative to the best.
const FITTED_VALUE: f64 = 0.5;

/// Least mean over the lattice, relative to the best peak.
const LEAST_MEAN: f64 = 0.70;

/// Fewest shifts within reach that speak for two directions; every shift counts with its opposite.
const FEWEST_IN_TWO: usize = 8;

/// The same for one direction.
const FEWEST_IN_ONE: usize = 4;

/// Least mean along the free direction, relative to the best peak.
const LEAST_ALONG: f64 = 0.5;

/// Largest multiples of two vectors whose sums must all have a valley before them.
const COMBINED: i32 = 3;

/// Parts that a period of ribs is tried in.
const PARTS: [f64; 4] = [5.0, 4.0, 3.0, 2.0];

/// Parts of the reach from which vectors are fitted in turn.
const GROWING: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// Longest side that is looked at, so that memory is bounded: of a longer one its middle part.
const LONGEST_SIDE: usize = 1024;

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// The lattice.
    pub lattice: Lattice,
    /// Highest peak of the autocorrelation at least 3 texels from 0, whether a valley lies before it or not; 0 to 1.
    pub strongest_peak: f64,
    /// Mean of the autocorrelation over the shifts of the lattice that was found or, at last, refused; 0 where there
    /// were none to try.
    pub mean_over_lattice: f64,
}

/// Finds the lattice of a plane of features [y, x, dim], to a part of a texel.
///
/// A plane that wraps (its borders join) gets a lattice that its sides are whole numbers of cells of, where they are
/// within 0.3 of a cell. Vectors are within half of a plane that wraps and 0.6 of one that does not. Nothing is found
/// in features that are not finite, that do not change, or with a side below 8 texels. Takes memory for some 100
/// bytes a texel, of planes beyond 1024 texels a side no more than of those. The result is the same on every machine.
pub fn detect(size: Size, dims: usize, features: &[f32], wraps: bool) -> Detection {
    let nothing = Detection { lattice: Lattice::None, strongest_peak: 0.0, mean_over_lattice: 0.0 };
    if features.len() != size.texels().saturating_mul(dims) {
        return nothing;
    }
    let looked_at = Size::new(size.height.min(LONGEST_SIDE), size.width.min(LONGEST_SIDE));
    let correlation = if looked_at == size {
        Autocorrelation::of(size, dims, features, wraps)
    } else {
        Autocorrelation::of(looked_at, dims, &middle(size, looked_at, dims, features), false)
    };
    let Some(correlation) = correlation else { return nothing };
    let found = Search::new(&correlation).run();
    let counts = if wraps { wave_counts(&found.lattice, size) } else { None };
    let exact = counts.map(|counts| counts.lattice(size));
    Detection { lattice: downward(exact.unwrap_or(found.lattice)), ..found }
}

/// A lattice whose vectors point down, those across to the right even if they rise a little.
fn downward(lattice: Lattice) -> Lattice {
    // Adding 0 turns -0 into 0.
    let turned =
        |[dy, dx]: [f64; 2]| if dy + dx / 8.0 < 0.0 { [0.0 - dy, 0.0 - dx] } else { [dy + 0.0, dx + 0.0] };
    match lattice {
        Lattice::None => Lattice::None,
        Lattice::OneDirection { period } => Lattice::OneDirection { period: turned(period) },
        Lattice::TwoDirections(vectors) => Lattice::TwoDirections(vectors.map(turned)),
    }
}

/// The features of the middle part of a plane.
fn middle(size: Size, part: Size, dims: usize, features: &[f32]) -> Vec<f32> {
    let Window { y, x, size: part } = size.middle(part);
    let rows = features.chunks_exact(size.width * dims).skip(y).take(part.height);
    rows.flat_map(|row| &row[x * dims..(x + part.width) * dims]).copied().collect()
}

/// A search in one autocorrelation.
struct Search<'a> {
    correlation: &'a Autocorrelation,
    peaks: Vec<Peak>,
    /// Highest of the peaks that have a valley before them.
    best: f64,
}

impl<'a> Search<'a> {
    fn new(correlation: &'a Autocorrelation) -> Self {
        Self { correlation, peaks: peaks(correlation), best: 0.0 }
    }

    fn run(mut self) -> Detection {
        let strongest_peak = self.peaks.iter().map(|peak| peak.value).fold(0.0, f64::max);
        let mut candidates: Vec<Peak> =
            self.peaks.iter().filter(|peak| self.stands_out(peak)).copied().collect();
        self.best = candidates.iter().map(|peak| peak.value).fold(0.0, f64::max);
        candidates.retain(|peak| peak.value >= NEARLY_BEST * self.best);
        candidates.sort_by(|a, b| length(a.at).total_cmp(&length(b.at)));
        let (lattice, mean_over_lattice) = match candidates.first() {
            Some(first) => self.lattice_from(first.at, &candidates),
            None => (Lattice::None, 0.0),
        };
        Detection { lattice, strongest_peak, mean_over_lattice }
    }

    fn stands_out(&self, peak: &Peak) -> bool {
        peak.value >= LEAST_VALUE && peak.value - lowest_before(self.correlation, peak.at) >= LEAST_RISE
    }

    /// The lattice whose shortest vector is `first`, and the mean over it.
    fn lattice_from(&self, first: [f64; 2], candidates: &[Peak]) -> (Lattice, f64) {
        let second = candidates.iter().find(|peak| sine(peak.at, first) > LEAST_SINE);
        let mut refused = 0.0;
        if let Some(vectors) = second.and_then(|second| self.two(first, second.at)) {
            let mean = self.mean(&Lattice::TwoDirections(vectors), FEWEST_IN_TWO);
            if mean >= LEAST_MEAN * self.best {
                return (Lattice::TwoDirections(vectors), mean);
            }
            refused = mean;
        }
        match self.one(first) {
            Some((period, mean)) => (Lattice::OneDirection { period }, mean),
            None => (Lattice::None, refused),
        }
    }

    /// The two shortest vectors of the lattice, fitted to its peaks; none where the texture does not change along one.
    fn two(&self, first: [f64; 2], second: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        let [a, b] = reduced([first, second]);
        // Peaks that were picked at random along ribs are told by a sum of theirs that runs along the ribs.
        for i in 0..=COMBINED {
            for j in -COMBINED..=COMBINED {
                let [i, j] = [i, j].map(f64::from);
                let shift = [0, 1].map(|axis| i * a[axis] + j * b[axis]);
                if self.correlation.reaches(shift) && !self.changes_before(shift) {
                    return None;
                }
            }
        }
        let vectors = [a, b];
        let fitted = GROWING.into_iter().fold(vectors, |vectors, part| self.fitted_two(vectors, part));
        Some(reduced(fitted))
    }

    /// Whether the texture has been away and is back after a shift.
    fn changes_before(&self, shift: [f64; 2]) -> bool {
        let rise = || self.correlation.interpolated(shift) - lowest_before(self.correlation, shift);
        length(shift) >= SHORTEST && rise() >= LEAST_RISE
    }

    /// Least squares of i a + j b against the peaks near such places.
    fn fitted_two(&self, vectors: [[f64; 2]; 2], part: f64) -> [[f64; 2]; 2] {
        let waves = Lattice::TwoDirections(vectors).waves();
        let [a, b] = reduced(vectors);
        let stray = STRAY.min(length(a) / 3.0);
        // Of the normal equations: sums of i i, i j, j j, and of i p, j p.
        let (mut ii, mut ij, mut jj) = (0.0, 0.0, 0.0);
        let (mut ip, mut jp) = ([0.0; 2], [0.0; 2]);
        for peak in self.fitted_peaks(part) {
            let [i, j] = [0, 1].map(|k| dot(waves[k], peak.at).round());
            let place = [i * a[0] + j * b[0], i * a[1] + j * b[1]];
            let off = length([peak.at[0] - place[0], peak.at[1] - place[1]]);
            if off <= stray && (i != 0.0 || j != 0.0) {
                (ii, ij, jj) = (ii + i * i, ij + i * j, jj + j * j);
                ip = [ip[0] + i * peak.at[0], ip[1] + i * peak.at[1]];
                jp = [jp[0] + j * peak.at[0], jp[1] + j * peak.at[1]];
            }
        }
        let determinant = ii * jj - ij * ij;
        if determinant < 0.5 {
            return [a, b];
        }
        let solved =
            |ip: f64, jp: f64| [(jj * ip - ij * jp) / determinant, (ii * jp - ij * ip) / determinant];
        let ([ay, by], [ax, bx]) = (solved(ip[0], jp[0]), solved(ip[1], jp[1]));
        let fitted = [[ay, ax], [by, bx]];
        if sine(fitted[0], fitted[1]) < LEAST_SINE / 2.0 { [a, b] } else { fitted }
    }

    fn fitted_peaks(&self, part: f64) -> impl Iterator<Item = &Peak> {
        let fits = move |peak: &&Peak| {
            peak.value >= FITTED_VALUE * self.best && self.correlation.within(peak.at, part)
        };
        self.peaks.iter().filter(fits)
    }

    /// Mean over all shifts of a lattice within reach; 0 where they are too few.
    fn mean(&self, lattice: &Lattice, fewest: usize) -> f64 {
        let reach = self.correlation.reach.map(|n| n as f64);
        let most: Vec<i64> =
            lattice.waves().iter().map(|[y, x]| (y.abs() * reach[0] + x.abs() * reach[1]) as i64).collect();
        let (vectors, most_of) = (basis(lattice), |k: usize| most.get(k).copied().unwrap_or(0));
        let (mut sum, mut count) = (0.0, 0);
        for i in -most_of(0)..=most_of(0) {
            for j in -most_of(1)..=most_of(1) {
                let (i, j) = (i as f64, j as f64);
                let shift = [0, 1].map(|axis| i * vectors[0][axis] + j * vectors[1][axis]);
                if self.correlation.reaches(shift) {
                    sum += self.correlation.interpolated(shift);
                    count += 1;
                }
            }
        }
        if count >= fewest { sum / f64::from(count as u32) } else { 0.0 }
    }

    /// The period of ribs whose shortest peak is `first`, at a right angle to them, and the mean over its multiples.
    fn one(&self, first: [f64; 2]) -> Option<([f64; 2], f64)> {
        let mean = self.mean(&Lattice::OneDirection { period: first }, FEWEST_IN_ONE);
        if mean < LEAST_MEAN * self.best {
            return None;
        }
        let direction = |degrees: usize| {
            let (sin, cos) = libm::sincos((degrees as f64).to_radians());
            [sin, cos]
        };
        let along = (0..180).map(|degrees| (self.mean_along(direction(degrees)), degrees));
        let (mean_along, degrees) = along.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
        let [y, x] = direction(degrees);
        // The part of the first peak across the ribs.
        let across = cross([y, x], first);
        if mean_along < LEAST_ALONG * self.best || across.abs() < SHORTEST {
            return None;
        }
        let wave = [-x / across, y / across];
        let wave = GROWING.into_iter().fold(wave, |wave, part| self.fitted_one(wave, part));
        let square = dot(wave, wave);
        let period = wave.map(|n| n / square);
        // The first peak may lie on the second rib.
        let part = PARTS.into_iter().map(|part| period.map(|n| n / part)).find(|&period| {
            let multiples = || self.mean(&Lattice::OneDirection { period }, FEWEST_IN_ONE);
            self.changes_before(period) && multiples() >= LEAST_MEAN * self.best
        });
        Some((part.unwrap_or(period), mean))
    }

    /// Mean in one direction from the shortest period to the end of reach.
    fn mean_along(&self, direction: [f64; 2]) -> f64 {
        let shifts = (SHORTEST as usize..).map(|n| direction.map(|d| d * n as f64));
        let values: Vec<f64> = shifts
            .take_while(|&shift| self.correlation.within(shift, 1.0))
            .map(|shift| self.correlation.interpolated(shift))
            .collect();
        values.iter().sum::<f64>() / values.len().max(1) as f64
    }

    /// Least squares of the wave (cycles a texel) against whole cycles at the peaks near such places.
    fn fitted_one(&self, wave: [f64; 2], part: f64) -> [f64; 2] {
        let stray = (STRAY * length(wave)).min(0.25);
        let (mut yy, mut yx, mut xx) = (0.0, 0.0, 0.0);
        let mut kp = [0.0; 2];
        for &Peak { at: [y, x], .. } in self.fitted_peaks(part) {
            let cycles = dot(wave, [y, x]);
            let k = cycles.round();
            if (cycles - k).abs() <= stray {
                (yy, yx, xx) = (yy + y * y, yx + y * x, xx + x * x);
                kp = [kp[0] + k * y, kp[1] + k * x];
            }
        }
        let determinant = yy * xx - yx * yx;
        let enough = determinant > LEAST_SINE * LEAST_SINE * (yy * xx).max(1.0);
        if enough {
            [(xx * kp[0] - yx * kp[1]) / determinant, (yy * kp[1] - yx * kp[0]) / determinant]
        } else {
            wave
        }
    }
}

/// Two vectors whose sums are the shifts of a lattice that count for its mean; of ribs the second is 0.
fn basis(lattice: &Lattice) -> [[f64; 2]; 2] {
    match *lattice {
        Lattice::None => [[0.0; 2]; 2],
        Lattice::OneDirection { period } => [period, [0.0; 2]],
        Lattice::TwoDirections(vectors) => reduced(vectors),
    }
}
