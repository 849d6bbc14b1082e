//! The random field of a normal map: its coordinates, and how its rows become unit normals again.

use serde::{Deserialize, Serialize};

use super::fit::fit;
use super::marginals::{Marginals, Matching};
use super::model::{Model, Options};
use super::raster::Field;
use super::synthesis::Synthesis;
use crate::error::Result;
use crate::shape::Size;

/// n_z is taken for at least this when a slope is computed.
const STEEPEST: f64 = 0.05;

/// What the channels of the field are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Coordinates {
    /// n_x, n_y and n_z, as in the paper.
    Normals,
    /// n_x / n_z and n_y / n_z, which no length binds.
    Slopes,
}

impl Coordinates {
    /// Values a texel.
    pub fn channels(self) -> usize {
        match self {
            Self::Normals => 3,
            Self::Slopes => 2,
        }
    }

    /// The field of a normal map, row by row.
    ///
    /// # Errors
    /// When there are not as many normals as texels.
    pub fn field(self, size: Size, normals: &[[f32; 3]]) -> Result<Field> {
        let normals = normals.iter().map(|n| n.map(f64::from));
        let samples = match self {
            Self::Normals => normals.flatten().collect(),
            Self::Slopes => {
                normals.flat_map(|[x, y, z]| [x, y].map(|component| component / z.max(STEEPEST))).collect()
            }
        };
        Field::new(size.height, size.width, self.channels(), samples)
    }
}

/// A model of a normal map.
#[derive(Clone, Debug)]
pub struct Surface {
    /// What the channels of the field are.
    pub coordinates: Coordinates,
    /// The random field.
    pub field: Model,
    /// What gives the tile's distribution to a synthesis; without it vectors are only brought to unit length.
    pub marginals: Option<Marginals>,
}

impl Surface {
    /// Fits a model to a normal map.
    ///
    /// # Errors
    /// Those of [`fit`].
    pub fn fit(
        size: Size,
        normals: &[[f32; 3]],
        coordinates: Coordinates,
        matching: Option<Matching>,
        options: &Options,
    ) -> Result<Self> {
        let field = fit(&coordinates.field(size, normals)?, options)?;
        let matched = |matching| Marginals::new(normals, matching, &field.mean, &field.covariance);
        let marginals = matching.map(matched).transpose()?;
        Ok(Self { coordinates, field, marginals })
    }

    /// The unit normals of the next rows of a synthesis of the field, `[row][width]`: as many rows as there is room
    /// for.
    ///
    /// # Errors
    /// Those of [`Synthesis::next_row`].
    pub(crate) fn next_rows(
        &self,
        synthesis: &mut Synthesis,
        width: usize,
        normals: &mut [[f32; 3]],
    ) -> Result<()> {
        let mut row = vec![0.0; width * self.field.channels()];
        for normals in normals.chunks_exact_mut(width) {
            synthesis.next_row(&mut row)?;
            self.normals(&row, normals);
        }
        Ok(())
    }

    /// The unit normals of a row of the field, planar `[channel][width]`.
    fn normals(&self, row: &[f32], normals: &mut [[f32; 3]]) {
        let width = normals.len();
        let channel = |n: usize| &row[n * width..][..width];
        let texels = normals.iter_mut().zip(channel(0)).zip(channel(1));
        match (&self.marginals, self.coordinates) {
            (Some(marginals), _) => texels.for_each(|((normal, &a), &b)| *normal = marginals.normal(a, b)),
            (None, Coordinates::Normals) => {
                texels.zip(channel(2)).for_each(|(((normal, &x), &y), &z)| *normal = unit([x, y, z]));
            }
            (None, Coordinates::Slopes) => texels.for_each(|((normal, &p), &q)| *normal = unit([p, q, 1.0])),
        }
    }
}

/// A vector brought to unit length; one without direction points up.
#[inline]
fn unit([x, y, z]: [f32; 3]) -> [f32; 3] {
    let length = (x * x + y * y + z * z).sqrt();
    if length > 0.0 { [x / length, y / length, z / length] } else { [0.0, 0.0, 1.0] }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::method::field::{Boundary, CarKind, Gains};
    use crate::random::Hash;

    const SIZE: Size = Size { height: 48, width: 40 };

    /// Rough, smoothed along x by neighbours.
    fn rough() -> Vec<[f32; 3]> {
        let hash = Hash::new(2, 0);
        let normal = |n: u32| {
            let [a, b, ..] = hash.normals(n, 0, 0);
            let [c, d, ..] = hash.normals(n + 1, 0, 0);
            unit([(0.2 * (a + c)) as f32, (0.1 * (b + d)) as f32, 1.0])
        };
        (0..SIZE.texels() as u32).map(normal).collect()
    }

    fn fitted(coordinates: Coordinates, matching: Option<Matching>) -> Surface {
        let options = Options {
            kind: CarKind::Car3d,
            levels: Some(1),
            gains: Gains::Matched,
            boundary: Boundary::Periodic,
        };
        Surface::fit(SIZE, &rough(), coordinates, matching, &options).unwrap()
    }

    #[test]
    fn a_field_of_either_coordinates_gives_its_normals_back() {
        let normals = rough();
        for coordinates in [Coordinates::Normals, Coordinates::Slopes] {
            let field = coordinates.field(SIZE, &normals).unwrap();
            let surface = fitted(coordinates, None);
            let mut row = Vec::new();
            for channel in 0..field.channels {
                row.extend(field.samples.iter().skip(channel).step_by(field.channels).map(|&v| v as f32));
            }
            let mut found = vec![[0.0; 3]; normals.len()];
            surface.normals(&row, &mut found);
            for (a, b) in found.iter().flatten().zip(normals.iter().flatten()) {
                assert!((a - b).abs() < 1e-6, "{coordinates:?}: {a} for {b}");
            }
        }
        assert_eq!(unit([0.0; 3]), [0.0, 0.0, 1.0]);
        assert!(Coordinates::Normals.field(SIZE, &normals[1..]).is_err());
    }

    #[test]
    fn marginals_put_the_median_of_the_field_on_the_median_of_the_normals() {
        let mut x: Vec<f32> = rough().iter().map(|n| n[0]).collect();
        x.sort_unstable_by(f32::total_cmp);
        for coordinates in [Coordinates::Normals, Coordinates::Slopes] {
            let surface = fitted(coordinates, Some(Matching::Joint));
            let row: Vec<f32> = surface.field.mean.iter().map(|&mean| mean as f32).collect();
            let mut found = [[0.0; 3]];
            surface.normals(&row, &mut found);
            assert!((found[0][0] - x[x.len() / 2]).abs() < 0.01, "{coordinates:?}");
        }
    }
}
