//! Normals by over-determined photometric stereo, equations (2) and (3) with rho = 1.

use nalgebra::{Matrix3, Vector3};

use crate::error::{Error, Result};
use btfkit_formats::Direction;

/// Share of the lights that a robust fit leaves out, darkest and brightest against the fit together.
const ROBUST_SHARE: f64 = 0.3;

/// Rounds of a robust fit.
const ROBUST_ROUNDS: usize = 3;

/// Estimates unit normals from intensities under known lights.
pub struct Stereo {
    lights: Vec<Vector3<f64>>,
    /// Rows of (L^T L)^-1 L^T, one column a light.
    pseudo_inverse: Vec<Vector3<f64>>,
}

impl Stereo {
    /// For the given lights.
    ///
    /// # Errors
    /// Where the lights do not span space.
    pub fn new(lights: &[Direction]) -> Result<Self> {
        let lights: Vec<Vector3<f64>> = lights.iter().map(|light| Vector3::from(light.vector())).collect();
        let pseudo_inverse = pseudo_inverse(&lights).ok_or_else(|| {
            Error::input(format!(
                "photometric stereo needs lights from at least three sides, got {} that lie in one plane",
                lights.len()
            ))
        })?;
        Ok(Self { lights, pseudo_inverse })
    }

    /// The unit normal of (3) from linear intensities, one a light. A black texel points up.
    pub fn normal(&self, intensities: &[f64]) -> [f32; 3] {
        unit(self.solve(intensities))
    }

    /// The normal from the lights that fit it best: after a plain fit those with the largest residuals
    /// (shadows and highlights) are left out and the fit repeated.
    pub(crate) fn robust_normal(&self, intensities: &[f64]) -> [f32; 3] {
        let mut estimate = self.solve(intensities);
        let keep = ((self.lights.len() as f64 * (1.0 - ROBUST_SHARE)).ceil() as usize).max(3);
        for _ in 0..ROBUST_ROUNDS {
            let mut order: Vec<usize> = (0..self.lights.len()).collect();
            let residual = |light: usize| (self.lights[light].dot(&estimate) - intensities[light]).abs();
            order.sort_by(|&a, &b| residual(a).total_cmp(&residual(b)).then(a.cmp(&b)));
            order.truncate(keep);
            let lights: Vec<Vector3<f64>> = order.iter().map(|&light| self.lights[light]).collect();
            let Some(inverse) = pseudo_inverse(&lights) else { break };
            estimate = order.iter().zip(&inverse).map(|(&light, column)| column * intensities[light]).sum();
        }
        unit(estimate)
    }

    fn solve(&self, intensities: &[f64]) -> Vector3<f64> {
        self.pseudo_inverse.iter().zip(intensities).map(|(column, &e)| column * e).sum()
    }
}

/// Columns of (L^T L)^-1 L^T.
fn pseudo_inverse(lights: &[Vector3<f64>]) -> Option<Vec<Vector3<f64>>> {
    let moment: Matrix3<f64> = lights.iter().map(|light| light * light.transpose()).sum();
    // The determinant of a sum of unit dyads is small only where they lie (almost) in one plane.
    if moment.determinant() < 1e-9 * moment.trace().powi(3) {
        return None;
    }
    let inverse = moment.try_inverse()?;
    Some(lights.iter().map(|light| inverse * light).collect())
}

fn unit(vector: Vector3<f64>) -> [f32; 3] {
    let length = vector.norm();
    if length > 0.0 { [0, 1, 2].map(|axis| (vector[axis] / length) as f32) } else { [0.0, 0.0, 1.0] }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn lights() -> Vec<Direction> {
        (0..24)
            .map(|i| Direction::from_degrees(15.0 + 30.0 * f64::from(i % 3), 15.0 * f64::from(i)))
            .collect()
    }

    fn degrees_between(found: [f32; 3], truth: Vector3<f64>) -> f64 {
        let found = Vector3::new(f64::from(found[0]), f64::from(found[1]), f64::from(found[2]));
        found.dot(&truth).clamp(-1.0, 1.0).acos().to_degrees()
    }

    #[test]
    fn a_rendered_sphere_gives_back_its_normals() {
        let lights = lights();
        let stereo = Stereo::new(&lights).unwrap();
        for step in 0..100 {
            // Up to 15 degrees every light reaches the surface and the fit is exact.
            let truth = Vector3::from(
                Direction::from_degrees(0.15 * f64::from(step), 37.0 * f64::from(step)).vector(),
            );
            let intensities: Vec<f64> =
                lights.iter().map(|light| 0.7 * Vector3::from(light.vector()).dot(&truth).max(0.0)).collect();
            assert!(degrees_between(stereo.normal(&intensities), truth) < 0.05);
        }
    }

    #[test]
    fn the_robust_fit_forgives_shadows_and_highlights() {
        let lights = lights();
        let stereo = Stereo::new(&lights).unwrap();
        let truth = Vector3::from(Direction::from_degrees(20.0, 70.0).vector());
        let mut intensities: Vec<f64> =
            lights.iter().map(|light| 0.5 * Vector3::from(light.vector()).dot(&truth).max(0.0)).collect();
        for light in [3, 9, 10] {
            intensities[light] = 0.0;
        }
        intensities[14] = 2.0;
        let (plain, robust) = (stereo.normal(&intensities), stereo.robust_normal(&intensities));
        assert!(degrees_between(robust, truth) < 0.5, "{}", degrees_between(robust, truth));
        assert!(degrees_between(plain, truth) > 3.0);
    }

    #[test]
    fn black_texels_point_up_and_coplanar_lights_are_refused() {
        assert_eq!(Stereo::new(&lights()).unwrap().normal(&[0.0; 24]), [0.0, 0.0, 1.0]);
        let coplanar: Vec<_> = (0..9).map(|i| Direction::from_degrees(10.0 * f64::from(i), 0.0)).collect();
        assert!(Stereo::new(&coplanar).is_err());
    }
}
