//! Peaks of an autocorrelation, to a part of a texel, and the valleys before them.

use super::correlation::Autocorrelation;
use super::{dot, length};

/// Shortest period, texels.
pub(super) const SHORTEST: f64 = 3.0;

/// A local maximum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Peak {
    /// Its shift.
    pub(super) at: [f64; 2],
    /// Autocorrelation there.
    pub(super) value: f64,
}

/// All local maxima (3 x 3) within reach that are positive and at least the shortest period away; of a peak and its
/// mirror image one.
pub(super) fn peaks(correlation: &Autocorrelation) -> Vec<Peak> {
    let [rows, columns] = correlation.reach;
    let mut peaks = Vec::new();
    for dy in -rows..=rows {
        for dx in -columns..=columns {
            let lag = [dy as f64, dx as f64];
            let value = correlation.at(dy, dx);
            let leads = dy > 0 || (dy == 0 && dx > 0);
            if !leads || value <= 0.0 {
                continue;
            }
            let highest = (-1..=1).all(|b| (-1..=1).all(|d| correlation.at(dy + b, dx + d) <= value));
            if highest {
                let [b, d] = vertex(correlation, dy, dx);
                let at = [lag[0] + b, lag[1] + d];
                if length(at) >= SHORTEST {
                    peaks.push(Peak { at, value });
                }
            }
        }
    }
    peaks
}

/// Where the paraboloid through the 3 x 3 values around a maximum has its vertex, at most half a texel off. Along
/// a ridge, where it hardly bends, the maximum is left where it is.
fn vertex(correlation: &Autocorrelation, dy: isize, dx: isize) -> [f64; 2] {
    /// Curvature relative to the largest below which there is a ridge.
    const FLAT: f64 = 0.05;
    let at = |b: isize, d: isize| correlation.at(dy + b, dx + d);
    let gradient = [(at(1, 0) - at(-1, 0)) / 2.0, (at(0, 1) - at(0, -1)) / 2.0];
    let down = at(1, 0) + at(-1, 0) - 2.0 * at(0, 0);
    let across = at(0, 1) + at(0, -1) - 2.0 * at(0, 0);
    let twist = (at(1, 1) + at(-1, -1) - at(1, -1) - at(-1, 1)) / 4.0;
    // The steeper eigenvalue of [[down, twist], [twist, across]].
    let (middle, half) = ((down + across) / 2.0, (down - across) / 2.0);
    let radius = (half * half + twist * twist).sqrt();
    let steepest = middle - radius;
    if steepest >= 0.0 {
        return [0.0; 2];
    }
    // Two forms of the same eigenvector; the longer one is the exact one.
    let forms = [[steepest - across, twist], [twist, steepest - down]];
    let vector = if length(forms[0]) >= length(forms[1]) { forms[0] } else { forms[1] };
    let norm = length(vector);
    let [y, x] = if norm > 0.0 { vector.map(|n| n / norm) } else { [1.0, 0.0] };
    let mut offset = [0.0; 2];
    for (bend, along) in [(steepest, [y, x]), (middle + radius, [-x, y])] {
        if bend < FLAT * steepest {
            let step = -dot(gradient, along) / bend;
            offset = [offset[0] + step * along[0], offset[1] + step * along[1]];
        }
    }
    offset.map(|n| n.clamp(-0.5, 0.5))
}

/// The lowest value on the straight way from 0 to a shift within reach.
pub(super) fn lowest_before(correlation: &Autocorrelation, shift: [f64; 2]) -> f64 {
    let steps = length(shift).ceil();
    let value = |step: usize| correlation.interpolated(shift.map(|n| n * step as f64 / steps));
    (1..steps as usize).map(value).fold(1.0, f64::min)
}
