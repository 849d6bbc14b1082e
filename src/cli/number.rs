//! Numbers of the command line: one parser for each range that an option may have. What is not finite is none.

use btfkit::method::coherent::JITTER_ONE;

/// A finite number in a range that `holds` says and `expected` names.
fn number(text: &str, expected: &str, holds: impl Fn(f64) -> bool) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().ok().filter(|&number| number.is_finite() && holds(number));
    number.ok_or_else(|| format!("expected {expected}, got {text:?}"))
}

/// Above 0.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    number(text, "a number above 0", |number| number > 0.0)
}

/// How many, at least one.
pub(super) fn count(text: &str) -> Result<usize, String> {
    let number = text.trim().parse::<usize>().ok().filter(|&number| number > 0);
    number.ok_or_else(|| format!("expected a whole number, 1 or more, got {text:?}"))
}

/// From 0 to 1.
pub(super) fn share(text: &str) -> Result<f64, String> {
    number(text, "a number from 0 to 1", |number| (0.0..=1.0).contains(&number))
}

/// Jitter from 0 to 1, in the units of a plane.
pub(super) fn jitter(text: &str) -> Result<u32, String> {
    Ok((share(text)? * f64::from(JITTER_ONE)).round() as u32)
}

/// A reflectance that can be white.
pub(super) fn white(text: &str) -> Result<f64, String> {
    number(text, "a reflectance from 0.001 to 1000", |number| (1e-3..=1e3).contains(&number))
}

/// A factor on linear values that no picture is lost by.
pub(super) fn exposure(text: &str) -> Result<f64, String> {
    number(text, "a number above 0, from 1e-6 to 1e6", |number| (1e-6..=1e6).contains(&number))
}

/// A factor on the size of features.
pub(super) fn scale(text: &str) -> Result<f64, String> {
    number(text, "a number from 0.01 to 100", |number| (0.01..=100.0).contains(&number))
}

/// An angle of view in degrees.
pub(super) fn field_of_view(text: &str) -> Result<f64, String> {
    number(text, "a number of degrees, from 0.1 to 170", |number| (0.1..=170.0).contains(&number))
}

/// A linear grey.
pub(super) fn grey(text: &str) -> Result<f64, String> {
    number(text, "a number from 0 to 1000", |number| (0.0..=1000.0).contains(&number))
}

/// Any angle in degrees.
pub(super) fn turn(text: &str) -> Result<f64, String> {
    number(text, "a number of degrees, from -360 to 360", |number| (-360.0..=360.0).contains(&number))
}

/// A place, X,Y,Z.
pub(super) fn place(text: &str) -> Result<[f64; 3], String> {
    let expected = || format!("expected X,Y,Z, such as 0,1.5,4, each from -1e6 to 1e6, got {text:?}");
    let coordinate = |part: &str| number(part, "", |number| number.abs() <= 1e6).map_err(|_| expected());
    match text.split(',').collect::<Vec<_>>()[..] {
        [x, y, z] => Ok([coordinate(x)?, coordinate(y)?, coordinate(z)?]),
        _ => Err(expected()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A parser, with numbers that it takes and that it refuses: both sides of every bound.
    type Case = (fn(&str) -> Result<f64, String>, &'static [&'static str], &'static [&'static str]);

    #[test]
    fn both_sides_of_every_bound_are_told_apart() {
        let cases: [Case; 8] = [
            (positive, &["1e-300", " 7 ", "1e300"], &["0", "-0", "-1"]),
            (share, &["0", "1", "-0"], &["1.0000001", "-1e-9"]),
            (white, &["0.001", "1000"], &["0.000999", "1000.1", "0"]),
            (exposure, &["1e-6", "1e6"], &["9e-7", "1000001", "0"]),
            (scale, &["0.01", "100"], &["0.0099", "100.1", "0"]),
            (field_of_view, &["0.1", "170"], &["0.09", "170.1", "0"]),
            (grey, &["0", "1000"], &["-0.001", "1000.1"]),
            (turn, &["-360", "360"], &["-361", "360.1"]),
        ];
        for (parse, taken, refused) in cases {
            for text in taken {
                assert_eq!(parse(text), Ok(text.trim().parse().unwrap_or(f64::NAN)), "{text}");
            }
            for text in refused.iter().chain(&["", "nan", "inf", "-inf", "1e999", "1,5", "0x10", "1 2"]) {
                assert!(parse(text).is_err_and(|error| error.contains("expected a ")), "{text}");
            }
        }
        assert_eq!(place("1, -2.5,1e6"), Ok([1.0, -2.5, 1e6]));
        for text in ["", "1,2", "1,2,3,4", "a,0,1", "1,2,nan", "1,2,1e7"] {
            assert!(place(text).is_err_and(|error| error.contains("X,Y,Z")), "{text}");
        }
        assert_eq!((count("1"), count(" 18446744073709551615 ")), (Ok(1), Ok(usize::MAX)));
        for text in ["0", "-1", "1.0", "18446744073709551616", ""] {
            assert!(count(text).is_err_and(|error| error.contains("1 or more")), "{text}");
        }
    }
}
