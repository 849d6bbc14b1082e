//! Numbers of the command line: one parser for each range that an option may have. What is not finite is none.

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
