//! The lattice of a regular material: the shifts that bring its texture back onto itself.
//!
//! A woven cloth repeats in two directions, ribs in one only (along them any shift will do), leather not at all.
//! [`detect`](detect::detect) finds the lattice in the texture's autocorrelation, [`cells`] tells whether a rectangle
//! holds whole numbers of cells, and the texts of [`LatticeChoice`] say it at the command line.

pub mod cells;
mod correlation;
pub mod detect;
mod given;
mod peaks;
#[cfg(test)]
mod tests;

pub use cells::{WaveCounts, largest_whole_cells, wave_counts, whole_cell_sides};
pub use detect::{Detection, detect};
pub use given::LatticeChoice;

use serde::{Deserialize, Serialize};

/// Shifts (dy, dx), in texels, that leave a texture as it is. Stored as a list of zero, one or two vectors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(into = "Vec<[f64; 2]>", try_from = "Vec<[f64; 2]>")]
pub enum Lattice {
    /// No shift does.
    #[default]
    None,
    /// Ribs: whole multiples of a period, and any shift across it.
    OneDirection {
        /// The period, at a right angle to the ribs.
        period: [f64; 2],
    },
    /// Whole multiples of two vectors.
    TwoDirections([[f64; 2]; 2]),
}

impl Lattice {
    /// The vectors: none, the period, or both.
    pub fn vectors(&self) -> Vec<[f64; 2]> {
        match *self {
            Self::None => Vec::new(),
            Self::OneDirection { period } => vec![period],
            Self::TwoDirections(vectors) => vectors.to_vec(),
        }
    }

    /// The shortest vectors, to which [`Lattice::waves`] is the dual basis: wave k brings vector k forward by one cycle.
    fn shortest(&self) -> Vec<[f64; 2]> {
        match *self {
            Self::TwoDirections(vectors) => reduced(vectors).to_vec(),
            _ => self.vectors(),
        }
    }

    /// The waves that every shift of the lattice brings forward by whole cycles, in cycles a texel down and across: the
    /// dual basis of the shortest vectors. A shift s belongs to the lattice if w s is a whole number for each wave w.
    pub(crate) fn waves(&self) -> Vec<[f64; 2]> {
        match *self {
            Self::None => Vec::new(),
            Self::OneDirection { period } => {
                let square = dot(period, period);
                vec![period.map(|n| n / square)]
            }
            Self::TwoDirections([a, b]) => {
                let [a, b] = reduced([a, b]);
                let area = cross(a, b);
                vec![[b[1] / area, -b[0] / area], [-a[1] / area, a[0] / area]]
            }
        }
    }
}

impl From<Lattice> for Vec<[f64; 2]> {
    fn from(lattice: Lattice) -> Self {
        lattice.vectors()
    }
}

impl TryFrom<Vec<[f64; 2]>> for Lattice {
    type Error = String;

    /// The lattice of zero, one or two vectors.
    ///
    /// # Errors
    /// More vectors, vectors that are not finite, shorter than one texel or longer than a million, or two that are
    /// (nearly) parallel.
    fn try_from(vectors: Vec<[f64; 2]>) -> Result<Self, String> {
        if vectors.len() > 2 {
            return Err(format!("a lattice has at most two vectors, got {}", vectors.len()));
        }
        if let Some([dy, dx]) = vectors.iter().find(|&&v| !(1.0..=1e6).contains(&length(v))) {
            return Err(format!("a period of a lattice has at least one texel, got {dy},{dx}"));
        }
        match vectors[..] {
            [] => Ok(Self::None),
            [period] => Ok(Self::OneDirection { period }),
            [a, b, ..] if sine(a, b) < LEAST_SINE => Err(format!(
                "the two vectors of a lattice are parallel: {},{} and {},{}",
                a[0], a[1], b[0], b[1]
            )),
            [a, b, ..] => Ok(Self::TwoDirections([a, b])),
        }
    }
}

/// Sine of the angle between two vectors below which they count as parallel.
const LEAST_SINE: f64 = 1e-3;

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// The area spanned by two vectors, with its sign.
fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn length(v: [f64; 2]) -> f64 {
    dot(v, v).sqrt()
}

/// Absolute sine of the angle between two vectors that are not 0.
fn sine(a: [f64; 2], b: [f64; 2]) -> f64 {
    cross(a, b).abs() / (length(a) * length(b))
}

/// The two shortest vectors of the lattice of two vectors that are not parallel (Gauss's reduction), the shorter first.
fn reduced([mut a, mut b]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    /// More steps than the vectors of any lattice here need.
    const STEPS: usize = 64;
    for _ in 0..STEPS {
        if dot(b, b) < dot(a, a) {
            (a, b) = (b, a);
        }
        let times = (dot(a, b) / dot(a, a)).round();
        if times == 0.0 {
            break;
        }
        b = [b[0] - times * a[0], b[1] - times * a[1]];
    }
    [a, b]
}
