//! Pixels that are not square, as a picture states them. Nothing of it is applied, as the grid is what was measured; the
//! caller is told.

/// How far from square is still rounding.
const ROUNDING: f64 = 0.005;

/// A sentence on pixels that are `ratio` times as wide as high, by what `place` says; `None` if they are square, or
/// nothing usable is said.
pub(crate) fn remark(ratio: f64, place: &str) -> Option<String> {
    let usable = ratio.is_finite() && ratio > 0.0 && (ratio - 1.0).abs() > ROUNDING;
    usable.then(|| {
        format!(
            "the pixels are {ratio:.4} times as wide as high by {place}, which is not applied: rows and columns are as stored"
        )
    })
}

/// The same by how many pixels there are to a length, across and down, as resolutions are stated.
pub(crate) fn of_densities(across: f64, down: f64, place: &str) -> Option<String> {
    remark(down / across, place)
}
