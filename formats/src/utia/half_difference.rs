//! Half and difference angles (Rusinkiewicz 1998).

use crate::Direction;
use crate::ubo2003::Angles;

use super::Pair;

/// Light and view of a half vector and a difference vector, `None` if one of them is below the surface.
///
/// The half vector lies midway between light and view. The difference vector is the light after turning the half vector to
/// the normal: about z by -phi of the half vector, then about y by its -theta.
pub(crate) fn light_and_view(half: Direction, difference: Direction) -> Option<Pair> {
    let [x, y, z] = difference.vector();
    let (sin, cos) = half.theta_rad.sin_cos();
    let [x, z] = [cos * x + sin * z, cos * z - sin * x];
    let (sin, cos) = half.phi_rad.sin_cos();
    let light = [cos * x - sin * y, sin * x + cos * y, z];
    let half = half.vector();
    let along: f64 = light.iter().zip(half).map(|(l, h)| l * h).sum();
    let mut view = half;
    for (v, l) in view.iter_mut().zip(light) {
        *v = 2.0 * along * *v - l;
    }
    Some(Pair { view: angles(view)?, light: angles(light)? })
}

fn angles(vector: [f64; 3]) -> Option<Angles> {
    let direction = Direction::from_vector(vector)?;
    let theta = direction.theta_rad.to_degrees();
    // Grazing directions may come out a rounding below the surface.
    let theta = if theta > 90.0 && theta < 90.0 + 1e-9 { 90.0 } else { theta };
    Angles::new(theta, direction.phi_rad.to_degrees())
}

/// What is said of directions that no [`Angles`] can be.
pub(crate) fn below_the_surface(image: usize) -> String {
    format!("image {image} of a direction that is not finite or not above the surface")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degrees(theta: f64, phi: f64) -> Direction {
        Direction::from_degrees(theta, phi)
    }

    fn near(angles: Angles, theta: f64, phi: f64) {
        let found = degrees(angles.theta_deg(), angles.phi_deg()).vector();
        let distance: f64 = found.iter().zip(degrees(theta, phi).vector()).map(|(a, b)| (a - b).abs()).sum();
        assert!(distance < 1e-12, "{angles:?} where ({theta}, {phi}) was expected");
    }

    #[test]
    fn directions_by_hand() {
        // The half vector at the normal: the light is the difference vector, the view opposite.
        let pair = light_and_view(degrees(0.0, 0.0), degrees(30.0, 50.0)).unwrap();
        near(pair.light, 30.0, 50.0);
        near(pair.view, 30.0, 230.0);
        // In the plane of the half vector the angles add up.
        let pair = light_and_view(degrees(20.0, 90.0), degrees(15.0, 0.0)).unwrap();
        near(pair.light, 35.0, 90.0);
        near(pair.view, 5.0, 90.0);
        assert!(light_and_view(degrees(80.0, 0.0), degrees(30.0, 0.0)).is_none());
    }

    #[test]
    fn half_vector_of_the_result_is_the_one_given() {
        let (half, difference) = (degrees(37.0, 141.0), degrees(25.0, 200.0));
        let pair = light_and_view(half, difference).unwrap();
        let vector = |a: Angles| degrees(a.theta_deg(), a.phi_deg()).vector();
        let (light, view) = (vector(pair.light), vector(pair.view));
        let sum: Vec<f64> = light.iter().zip(view).map(|(l, v)| l + v).collect();
        let found = Direction::from_vector([sum[0], sum[1], sum[2]]).unwrap();
        near(Angles::new(found.theta_rad.to_degrees(), found.phi_rad.to_degrees()).unwrap(), 37.0, 141.0);
        let cosine: f64 = light.iter().zip(half.vector()).map(|(a, b)| a * b).sum();
        assert!((cosine - 25f64.to_radians().cos()).abs() < 1e-12);
    }
}
