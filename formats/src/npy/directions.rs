//! Lists of directions as arrays.

use std::f64::consts::FRAC_PI_2;

use super::header::{Header, Scalar, elements, write};
use crate::words::counted;
use crate::{Angles, Direction, Error, ErrorKind, Limits, Result};

/// Reads a list of directions: `[n, 2]` theta and phi in radians, or `[n, 3]` vectors of any length, x right,
/// y up, z out of the surface; float32 or float64. By custom the lists of `NAME.npy` are `NAME.views.npy` and
/// `NAME.lights.npy`.
///
/// # Errors
/// [`ErrorKind::Malformed`]: a damaged file; theta outside 0..=pi/2 (degrees, perhaps), a vector of no length or into the
/// surface, numbers that are not finite. [`ErrorKind::Unsupported`]: another type or shape. [`ErrorKind::Limit`]:
/// more than [`Limits::max_directions`].
pub fn directions(bytes: &[u8], limits: &Limits) -> Result<Vec<Direction>> {
    let header = Header::read(bytes)?;
    let unsupported = |found: String, expected| Error::new(ErrorKind::Unsupported, found, expected);
    let (count, columns) = match header.shape[..] {
        [count, columns @ (2 | 3)] => (count, columns),
        ref other => {
            let expected = "[n, 2] theta and phi in radians, or [n, 3] vectors";
            return Err(unsupported(format!("an array {other:?}"), expected));
        }
    };
    if count > limits.max_directions {
        return Err(Error::new(
            ErrorKind::Limit,
            counted(count, "direction"),
            format!("at most {}", limits.max_directions),
        ));
    }
    let numbers: Vec<f64> = match (header.scalar, header.data(bytes)?) {
        (Scalar::F32, data) => {
            let numbers = elements(data, header.big_endian, f32::from_le_bytes, f32::from_be_bytes);
            numbers.into_iter().map(f64::from).collect()
        }
        (Scalar::F64, data) => elements(data, header.big_endian, f64::from_le_bytes, f64::from_be_bytes),
        (other, _) => {
            return Err(unsupported(format!("directions of type {}", other.code()), "float32 or float64"));
        }
    };
    let rows = numbers.chunks_exact(if columns == 2 { 2 } else { 3 });
    rows.enumerate()
        .map(|(row, numbers)| {
            direction(numbers)
                .map_err(|expected| Error::malformed(format!("direction {row}: {numbers:?}"), expected))
        })
        .collect()
}

fn direction(numbers: &[f64]) -> std::result::Result<Direction, &'static str> {
    match *numbers {
        // What is above by rounding (pi/2 in float32 is) is taken for pi/2.
        [theta, phi_rad] if (0.0..FRAC_PI_2 + 1e-6).contains(&theta) && phi_rad.is_finite() => {
            Ok(Direction { theta_rad: theta.min(FRAC_PI_2), phi_rad })
        }
        [x, y, z] => Angles::from_vector([x, y, z]).map(Angles::direction),
        _ => Err("theta in 0..=pi/2 and phi, both in radians"),
    }
}

/// A list of directions as a file that [`directions`] and numpy read: float64 `[n, 2]`, theta and phi in
/// radians.
pub fn directions_file(directions: &[Direction]) -> Vec<u8> {
    let count = u64::try_from(directions.len()).unwrap_or(u64::MAX);
    let mut file = write(&[count, 2], Scalar::F64);
    for direction in directions {
        file.extend(direction.theta_rad.to_le_bytes());
        file.extend(direction.phi_rad.to_le_bytes());
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::directions::directions_151;

    fn file(shape: &[u64], scalar: Scalar, data: &[u8]) -> Vec<u8> {
        [write(shape, scalar), data.to_vec()].concat()
    }

    fn read(bytes: &[u8]) -> Result<Vec<Direction>> {
        directions(bytes, &Limits::default())
    }

    #[test]
    fn written_lists_are_read_back() {
        let list: Vec<Direction> = directions_151().into_iter().map(Angles::direction).collect();
        assert_eq!(read(&directions_file(&list)).unwrap(), list);
    }

    #[test]
    fn vectors_and_either_byte_order() {
        let vectors = [0.0f32, 0.0, 2.0, 0.0, -3.0, 3.0];
        let little: Vec<u8> = vectors.iter().flat_map(|x| x.to_le_bytes()).collect();
        let big: Vec<u8> = vectors.iter().flat_map(|x| x.to_be_bytes()).collect();
        let little = file(&[2, 3], Scalar::F32, &little);
        let mut big = file(&[2, 3], Scalar::F32, &big);
        let order = big.iter().position(|&byte| byte == b'<').unwrap();
        big[order] = b'>';
        for bytes in [little, big] {
            let list = read(&bytes).unwrap();
            assert_eq!(list[0], Direction { theta_rad: 0.0, phi_rad: 0.0 });
            assert!((list[1].theta_rad - 0.25 * std::f64::consts::PI).abs() < 1e-12);
            assert!((list[1].phi_rad - 1.5 * std::f64::consts::PI).abs() < 1e-12);
        }
    }

    #[test]
    fn lists_that_are_none() {
        let doubles = |list: &[f64]| -> Vec<u8> { list.iter().flat_map(|x| x.to_le_bytes()).collect() };
        for (bytes, reason) in [
            (file(&[1, 2], Scalar::F64, &doubles(&[45.0, 0.0])), "direction 0: [45.0, 0.0]"),
            (file(&[1, 2], Scalar::F64, &doubles(&[-0.1, 0.0])), "radians"),
            (file(&[2, 2], Scalar::F64, &doubles(&[0.0, 0.0, 0.1, f64::NAN])), "direction 1"),
            (file(&[1, 3], Scalar::F64, &doubles(&[1.0, 0.0, -1.0])), "z >= 0"),
            (file(&[1, 3], Scalar::F64, &doubles(&[0.0; 3])), "long enough"),
            (file(&[1, 4], Scalar::F64, &doubles(&[0.0; 4])), "[1, 4]"),
            (file(&[2], Scalar::F64, &doubles(&[0.0; 2])), "[2]"),
            (file(&[1, 2], Scalar::U16, &[0; 4]), "u2"),
            (file(&[1, 2], Scalar::F64, &[0; 15]), "15 bytes"),
            (file(&[1, 2], Scalar::F64, &[0; 17]), "17 bytes"),
            (file(&[1 << 40, 2], Scalar::F64, &[0; 16]), "at most 65536"),
        ] {
            let error = read(&bytes).unwrap_err();
            assert!(error.to_string().contains(reason), "{error}");
        }
        let grazing = std::f32::consts::FRAC_PI_2.to_le_bytes();
        let list = read(&file(&[1, 2], Scalar::F32, &[grazing, [0; 4]].concat())).unwrap();
        assert_eq!(list[0].theta_rad, FRAC_PI_2);
    }
}
