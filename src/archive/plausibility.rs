//! What an archive of any kind says of its channels and directions, held against what can be.

use btfkit_formats::picture::wavelength_nm;
use btfkit_formats::{Contents, Direction};

use crate::error::{Error, Result};
use crate::store::measurement::Side;

/// Directions nearer to each other than this are hardly meant to be two, degrees.
const NEAR_DEG: f64 = 0.05;

/// A right angle in radians, to two digits above: what theta never exceeds where radians are taken for degrees.
const RIGHT_ANGLE_RAD: f64 = 1.58;

/// Names of a channel that says how opaque a texel is.
const ALPHA: [&str; 8] = ["a", "alpha", "ra", "ga", "ba", "ar", "ag", "ab"];

/// Names of a single channel that is no light.
const NO_LIGHT: [&str; 12] =
    ["z", "zback", "depth", "a", "alpha", "mask", "id", "n", "u", "v", "normal", "velocity"];

/// Names of a single channel that is grey without a doubt, beside wavelengths and numbers.
const GREY: [&str; 9] = ["y", "l", "i", "grey", "gray", "luminance", "intensity", "reflectance", "albedo"];

/// Refuses channels that are one by two names (`550nm` and `550.0`, `R` and `r`), opacity among colours, and a single
/// channel that is no light.
///
/// # Errors
/// Names the channels.
pub(super) fn require_channels(contents: &Contents) -> Result<()> {
    let names = &contents.channels;
    let mut meanings: Vec<(String, &str)> = names.iter().map(|name| (meaning(name), name.as_str())).collect();
    meanings.sort_unstable();
    let mut neighbours = meanings.iter().zip(meanings.iter().skip(1));
    if let Some(((_, first), (_, second))) = neighbours.find(|(a, b)| a.0 == b.0) {
        return Err(Error::input(format!(
            "got the channels {first:?} and {second:?}, expected each channel once: these two mean the same"
        ))
        .hint("leave one of them out, or name it as what it is"));
    }
    let is = |name: &str, wanted: &str| name.eq_ignore_ascii_case(wanted);
    let colours = ["R", "G", "B"].iter().all(|colour| names.iter().any(|name| is(name, colour)));
    let grey = names.len() == 2 && names.iter().any(|name| is(name, "Y"));
    let alpha = names.iter().find(|name| ALPHA.iter().any(|alpha| is(name, alpha)));
    if let [only] = names.as_slice()
        && NO_LIGHT.iter().any(|name| is(only, name))
    {
        return Err(Error::input(format!(
            "got the channel {only} alone, expected light: {only} is the name of a depth, an opacity, a normal or the like"
        ))
        .hint("take the pictures with their colours; or, if it is light, rename the channel to Y"));
    }
    match alpha {
        Some(alpha) if colours || grey => Err(Error::input(format!(
            "got the channels {}, expected reflectances only: {alpha} says how opaque a texel is",
            names.join(" ")
        ))
        .hint("leave that channel out of the archive")),
        _ => Ok(()),
    }
}

/// What to know of a single channel that may be one of several: all that is made of it is grey.
pub(super) fn single_channel(contents: &Contents) -> Option<String> {
    let [only] = contents.channels.as_slice() else { return None };
    let name = only.trim().to_lowercase();
    // Arrays and pictures without names have numbers.
    let numbered = name.trim_start_matches(|c: char| c.is_alphabetic() || c == ' ').parse::<u32>().is_ok();
    let known = GREY.contains(&name.as_str()) || wavelength_nm(only).is_some() || numbered;
    (!known).then(|| format!("the only channel is called {only:?}: it is taken as grey, for all colours"))
}

/// What a name says, the same for all spellings.
fn meaning(name: &str) -> String {
    let bare = name.trim().to_lowercase();
    let number = bare.strip_suffix("nm").unwrap_or(&bare).trim().replace(',', ".").parse::<f64>().ok();
    match wavelength_nm(name.trim())
        .or_else(|| wavelength_nm(&bare))
        .or(number.filter(|number| number.is_finite()))
    {
        // To a thousandth of a nanometre: 0.55um is 550.0000000000001 nm.
        Some(number) => format!("{number:.3}"),
        None => bare,
    }
}

/// What to know of views and lights that are almost the same.
pub(super) fn near_directions(contents: &Contents) -> Vec<String> {
    let told = |list: &[Direction], what: &str| {
        let (a, b, apart) = nearest_pair(list)?;
        Some(format!(
            "the {what} {a} and {b} are {apart:.6} degrees apart and are read as two; if they are one, write them alike"
        ))
    };
    [told(&contents.views, "views"), told(&contents.lights, "lights")].into_iter().flatten().collect()
}

/// What to know of angles that may be others than polar angles in degrees; `elevations` are those that were read as such.
pub(super) fn doubtful_angles(contents: &Contents, elevations: Option<Side>) -> Vec<String> {
    let polar = |list: &[Direction]| list.iter().map(|d| d.theta_rad.to_degrees()).fold(0.0, f64::max);
    let (views, lights) = (polar(&contents.views), polar(&contents.lights));
    let highest = views.max(lights);
    let mut notes = Vec::new();
    if highest > 0.0 && highest <= RIGHT_ANGLE_RAD {
        let way_out = match contents.format.as_str() {
            names if names.starts_with("pictures named") => "say so by --pattern ({theta_i:rad} and so on)",
            _ => "multiply them by 180 / pi",
        };
        notes.push(format!(
            "no direction is more than {highest:.3} degrees from the normal: if the angles are radians, {way_out}"
        ));
    }
    let [lights_read, views_read] = Side::lights_and_views(elevations);
    let sides = [("views", views, views_read), ("lights", lights, lights_read)];
    let is_grazing = |highest: f64| highest > 89.5;
    let found = |(what, highest, _): &(&str, f64, bool)| {
        format!(
            "{what} are up to {highest:.1} degrees from the normal, where nothing can be seen: if the angles are"
        )
    };
    for side in sides.iter().filter(|(_, highest, is_read)| is_grazing(*highest) && *is_read) {
        notes.push(format!("{} no elevations, leave out --polar", found(side)));
    }
    let unread: Vec<_> =
        sides.iter().filter(|(_, highest, is_read)| is_grazing(*highest) && !is_read).collect();
    // One option for all of them, and for what is read so already.
    let option = match Side::of(lights_read || is_grazing(lights), views_read || is_grazing(views)) {
        Some(Side::Lights) => "elevation-lights",
        Some(Side::Views) => "elevation-views",
        _ => "elevation",
    };
    if let Some(side) = unread.first() {
        let found =
            if unread.len() > 1 { found(side).replacen("views", "views and lights", 1) } else { found(side) };
        notes.push(format!("{found} elevations above the surface, --polar {option} reads them so"));
    }
    notes
}

/// The first two that are nearer than [`NEAR_DEG`], in the order of theta, and by how much.
fn nearest_pair(list: &[Direction]) -> Option<(Direction, Direction, f64)> {
    let mut sorted = list.to_vec();
    sorted.sort_by(|a, b| a.theta_rad.total_cmp(&b.theta_rad).then(a.phi_rad.total_cmp(&b.phi_rad)));
    let near_rad = NEAR_DEG.to_radians();
    sorted.iter().enumerate().find_map(|(at, &a)| {
        let later = sorted.iter().skip(at + 1).take_while(|b| b.theta_rad - a.theta_rad < near_rad);
        later.copied().find_map(|b| {
            let squares = a.vector().into_iter().zip(b.vector()).map(|(a, b)| (a - b).powi(2));
            let apart = squares.sum::<f64>().sqrt().to_degrees();
            (apart < NEAR_DEG).then_some((a, b, apart))
        })
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use btfkit_formats::SampleType;

    fn contents(channels: &[&str], lights: &[(f64, f64)]) -> Contents {
        Contents {
            format: "made".to_owned(),
            width: 1,
            height: 1,
            channels: channels.iter().map(|&name| name.to_owned()).collect(),
            sample_type: SampleType::U8,
            views: vec![Direction::from_degrees(0.0, 0.0)],
            lights: lights.iter().map(|&(theta, phi)| Direction::from_degrees(theta, phi)).collect(),
            linear: true,
            cosine_included: true,
            assumptions: Vec::new(),
            remarks: Vec::new(),
        }
    }

    #[test]
    fn channels_of_one_meaning_and_opacity_are_refused() {
        for names in [
            &["Y"][..],
            &["R", "G", "B"],
            &["X", "Y", "Z"],
            &["550nm", "550.5nm"],
            &["channel 0", "channel 1", "channel 2", "channel 3"],
            &["C0", "C1"],
            &["A", "B", "C"],
            &["430-400nm", "430nm"],
        ] {
            require_channels(&contents(names, &[])).unwrap();
        }
        for (names, words) in [
            (&["550nm", "550.0nm"][..], "\"550.0nm\" and \"550nm\""),
            (&["550", "650", "550,0nm"], "\"550\" and \"550,0nm\""),
            (&["5.5e2", "550"], "mean the same"),
            (&["0.55um", "550nm"], "mean the same"),
            (&["T.550,000000nm", "550nm"], "mean the same"),
            (&["R", "r"], "mean the same"),
            (&["R", "G", "B", "A"], "A says how opaque"),
            (&["a", "b", "g", "r"], "a says how opaque"),
            (&["R", "G", "B", "Alpha"], "Alpha says how opaque"),
            (&["Y", "A"], "A says how opaque"),
        ] {
            let error = require_channels(&contents(names, &[])).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn angles_that_may_be_radians_or_elevations_are_told() {
        let told = |lights: &[(f64, f64)]| doubtful_angles(&contents(&["Y"], lights), None);
        assert_eq!(told(&[(0.0, 0.0)]), Vec::<String>::new());
        assert_eq!(told(&[(0.0, 0.0), (75.0, 0.0)]), Vec::<String>::new());
        assert!(told(&[(0.0, 0.0), (1.309, 3.0)])[0].contains("radians"));
        assert!(told(&[(15.0, 0.0), (90.0, 0.0)])[0].contains("lights are up to 90.0 degrees"));
        // One option reads both sides, and what is read already stays so.
        let mut both = contents(&["Y"], &[(15.0, 0.0), (90.0, 0.0)]);
        both.views.clone_from(&both.lights);
        let [note] = doubtful_angles(&both, None).try_into().unwrap();
        assert!(note.contains("views and lights") && note.contains("--polar elevation reads"), "{note}");
        both.views = vec![Direction::from_degrees(0.0, 0.0)];
        let [note] = doubtful_angles(&both, Some(Side::Views)).try_into().unwrap();
        assert!(note.contains("--polar elevation reads"), "{note}");
    }

    #[test]
    fn directions_that_are_almost_one_are_told() {
        let told = |lights: &[(f64, f64)]| near_directions(&contents(&["Y"], lights));
        assert_eq!(told(&[(0.0, 0.0), (15.0, 0.0), (15.0, 1.0), (15.1, 0.0)]), Vec::<String>::new());
        for lights in [
            [(15.0, 0.0), (60.0, 20.0), (15.0004, 0.0)],
            [(15.0, 0.0), (60.0, 20.0), (15.0, 359.9996)],
            [(60.0, 20.0), (0.001, 0.0), (0.001, 90.0)],
        ] {
            let [only] = told(&lights).try_into().unwrap();
            assert!(only.contains("the lights") && only.contains("degrees apart"), "{only}");
        }
    }
}
