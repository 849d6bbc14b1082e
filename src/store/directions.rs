//! Directions of a store: `view_direction` and `light_direction`, and the same angles as coordinates by which xarray
//! selects.
//!
//! | array | shape | type |
//! | --- | --- | --- |
//! | `<dimension>_direction` | [n, 2] theta, phi in radians | f64 |
//! | `<dimension>_theta`, `<dimension>_phi` | [n] degrees, to 1e-9 | f64 |

use btfkit_formats::Direction;

use crate::error::{Error, Result};
use crate::zarr::{Layout, Store, metadata};

/// Most directions: triangles count them in u16.
const MOST: usize = 1 << 16;

/// Largest theta, radians: pi / 2 and what lists round.
const LARGEST_THETA: f64 = 1.571;

/// Names of the arrays of a dimension in a layout of some version.
pub(super) fn arrays(dimension: &str, format: u64) -> Vec<String> {
    let names: &[&str] = match format {
        metadata::OLDEST_FORMAT => &["direction"],
        _ => &["direction", "theta", "phi"],
    };
    names.iter().map(|name| format!("{dimension}_{name}")).collect()
}

/// The arrays of a dimension of so many directions.
pub(super) fn layouts(dimension: &str, count: usize, format: u64) -> Vec<(String, Layout<'static>)> {
    let of = |name: &String| {
        if name.ends_with("direction") {
            layout(dimension, count)
        } else {
            coordinate_layout(dimension, count)
        }
    };
    arrays(dimension, format).into_iter().map(|name| (name.clone(), of(&name))).collect()
}

/// Names of the dimensions.
fn axes(dimension: &str) -> &'static [&'static str] {
    if dimension == "view" { &["view", "angle"] } else { &["light", "angle"] }
}

fn layout(dimension: &str, count: usize) -> Layout<'static> {
    Layout::small::<f64>(axes(dimension), &[count, 2])
        .with("units", "rad")
        .with("angles", vec!["theta", "phi"])
}

/// One angle of every direction, degrees.
fn coordinates(directions: &[Direction]) -> [(&'static str, Vec<f64>); 2] {
    // Lists have few decimals: 15, not 14.999999999999998.
    let rounded = |degrees: f64| (degrees * 1e9).round() / 1e9;
    let list = |of: &dyn Fn(&Direction) -> f64| directions.iter().map(|d| rounded(of(d))).collect();
    [("theta", list(&|d| d.degrees().0)), ("phi", list(&|d| d.degrees().1))]
}

fn coordinate_layout(dimension: &str, count: usize) -> Layout<'static> {
    Layout::small::<f64>(&axes(dimension)[..1], &[count]).with("units", "degree")
}

/// Writes the directions of a dimension, `view` or `light`.
pub(super) fn write(store: &Store, dimension: &str, directions: &[Direction]) -> Result<()> {
    let angles: Vec<f64> = directions.iter().flat_map(|d| [d.theta_rad, d.phi_rad]).collect();
    store.write(&format!("{dimension}_direction"), &layout(dimension, directions.len()), &angles)?;
    for (name, list) in coordinates(directions) {
        store.write(&format!("{dimension}_{name}"), &coordinate_layout(dimension, list.len()), &list)?;
    }
    Ok(())
}

/// Reads the directions of a dimension.
///
/// # Errors
/// None, too many, or any that is not finite or lies below the plane.
pub(super) fn read(store: &Store, dimension: &str) -> Result<Vec<Direction>> {
    let name = format!("{dimension}_direction");
    let refused = |what: String| {
        Error::input(format!("{}: {name}: {what}", store.path().display()))
            .hint("run the command that makes this store again: it writes the directions anew")
    };
    let coordinate = format!("{dimension}_theta");
    if store.format() == metadata::OLDEST_FORMAT && store.path().join(&coordinate).exists() {
        return Err(refused(format!(
            "the attributes name layout format {}, whose stores have no {coordinate}",
            metadata::OLDEST_FORMAT
        )));
    }
    let count = store.claimed_shape(&name, 2)?[0];
    if !(1..=MOST).contains(&count) {
        return Err(refused(format!("got {count} directions, expected 1 to {MOST}")));
    }
    let angles = store.read_array::<f64>(&name, &layout(dimension, count))?;
    let directions: Vec<Direction> =
        angles.chunks_exact(2).map(|a| Direction { theta_rad: a[0], phi_rad: a[1] }).collect();
    let in_range = |d: &Direction| (0.0..=LARGEST_THETA).contains(&d.theta_rad) && d.phi_rad.is_finite();
    match directions.iter().position(|d| !in_range(d)) {
        None => Ok(directions),
        Some(at) => Err(refused(format!(
            "direction {at} is theta {} phi {} rad, expected theta in 0..pi/2",
            directions[at].theta_rad, directions[at].phi_rad
        ))),
    }
}

/// Checks that the coordinates are the angles of the directions.
///
/// # Errors
/// Where they are not; nothing in the oldest layout, which has none.
pub(super) fn check_coordinates(store: &Store, dimension: &str, directions: &[Direction]) -> Result<()> {
    if store.format() == metadata::OLDEST_FORMAT {
        return Ok(());
    }
    for (name, expected) in coordinates(directions) {
        let name = format!("{dimension}_{name}");
        let found = store.read_array::<f64>(&name, &coordinate_layout(dimension, expected.len()))?;
        if found != expected {
            let place = store.path().display();
            return Err(Error::input(format!("{place}: {name}: not the angles of {dimension}_direction")));
        }
    }
    Ok(())
}
