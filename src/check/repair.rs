//! What to tell `btf import` so that a finding is repaired, beside what it was told already: a reading of the archive
//! is one set of options, and an option that was given is never advised again.

use super::Report;
use crate::color::Transfer;
use crate::store::measurement::{Adaptation, Side};

impl Report {
    /// Turns what repairs the measurement as it was read into all that `btf import` is to be told.
    ///
    /// `given` is how the archive was read.
    pub fn beside(&mut self, given: &Adaptation) {
        let told = given.options();
        if told.is_empty() {
            return;
        }
        for finding in self.checks.iter_mut().flat_map(|check| &mut check.findings) {
            let Some(repair) = finding.repair.take() else { continue };
            finding.repair = repaired(given, &repair).map(|new| change(&told, &new.options()));
            if finding.repair.is_none() {
                let told: Vec<&str> = told.iter().map(String::as_str).collect();
                let already = format!(" ({} was given already, and does not repair it)", told.join(" "));
                finding.message.push_str(&already);
            }
        }
    }
}

/// The options, and those of before that are not among them any more.
fn change(before: &[String], now: &[String]) -> String {
    let name = |option: &str| option.split(' ').next().unwrap_or_default().to_owned();
    let gone =
        before.iter().map(|option| name(option)).filter(|old| !now.iter().any(|new| name(new) == *old));
    let gone: Vec<String> = gone.map(|name| format!("without {name}")).collect();
    [now.join(" "), gone.join(" and ")]
        .into_iter()
        .filter(|part| !part.is_empty())
        .collect::<Vec<_>>()
        .join(", ")
}

/// How an archive is to be read where it was read so, and `repair` mends what came of that; none where no options do.
fn repaired(given: &Adaptation, repair: &str) -> Option<Adaptation> {
    let mut new = given.clone();
    let [lights, views] = Side::lights_and_views(given.mirrored);
    let [low_lights, low_views] = Side::lights_and_views(given.elevations);
    let turned = given.turn_deg % 360;
    match repair.split_once(' ').unwrap_or((repair, "")) {
        ("--swap", _) => {
            new.swap = !given.swap;
            new.mirrored = Side::of(views, lights);
            new.elevations = Side::of(low_views, low_lights);
            std::mem::swap(&mut new.drop_views, &mut new.drop_lights);
        }
        ("--polar", "elevation") => new.elevations = Side::of(!low_lights, !low_views),
        ("--polar", "elevation-lights") => new.elevations = Side::of(!low_lights, low_views),
        ("--polar", "elevation-views") => new.elevations = Side::of(low_lights, !low_views),
        ("--transpose", _) => new.transpose = !given.transpose,
        ("--cosine", _) if !given.cosine_excluded => new.cosine_excluded = true,
        ("--transfer", "linear") => new.transfer = Some(Transfer::Linear),
        ("--transfer", "srgb") => new.transfer = Some(Transfer::Srgb),
        ("--turn", angle) => new.turn_deg = (turned + angle.parse::<u16>().ok()?) % 360,
        // A mirroring behind a turn is one before the turn the other way round.
        ("--azimuth", "mirrored") => {
            new.mirrored = Side::of(!lights, !views);
            new.turn_deg = (360 - turned) % 360;
        }
        ("--azimuth", "mirrored-lights") if turned.is_multiple_of(180) => {
            new.mirrored = Side::of(!lights, views);
        }
        ("--azimuth", "mirrored-views") if turned.is_multiple_of(180) => {
            new.mirrored = Side::of(lights, !views);
        }
        ("--drop-view", number) => {
            // By its number in the archive, whose views before it may have been left out.
            let number = number.parse::<usize>().ok()?;
            new.drop_views.push((0..).filter(|view| !given.drop_views.contains(view)).nth(number)?);
            new.drop_views.sort_unstable();
        }
        _ => return None,
    }
    Some(new)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::store::measurement::Type;

    /// What is advised where an archive was read so and this was found.
    fn advised(given: &Adaptation, repair: &str) -> Option<String> {
        repaired(given, repair).map(|new| change(&given.options(), &new.options()))
    }

    #[test]
    fn what_was_given_is_taken_into_account_and_never_advised_again() {
        let given = Adaptation::default;
        let turned = Adaptation { turn_deg: 90, ..given() };
        let both = Adaptation { mirrored: Some(Side::Both), turn_deg: 90, ..given() };
        let lights = Adaptation { mirrored: Some(Side::Lights), ..given() };
        let swapped = Adaptation { swap: true, ..lights.clone() };
        let without_cosine = Adaptation { cosine_excluded: true, ..given() };
        let low = Adaptation { elevations: Some(Side::Both), ..given() };
        let dropped = Adaptation { drop_views: vec![0, 2], ..given() };
        for (given, repair, expected) in [
            (&turned, "--turn 90", Some("--turn 180")),
            (&Adaptation { turn_deg: 270, ..given() }, "--turn 90", Some("without --turn")),
            (&turned, "--azimuth mirrored", Some("--azimuth mirrored --turn 270")),
            (&both, "--azimuth mirrored", Some("--turn 270, without --azimuth")),
            (&turned, "--azimuth mirrored-views", None),
            (&lights, "--azimuth mirrored-lights", Some("without --azimuth")),
            (&lights, "--azimuth mirrored-views", Some("--azimuth mirrored")),
            (&lights, "--azimuth mirrored", Some("--azimuth mirrored-views")),
            (&lights, "--swap", Some("--swap --azimuth mirrored-views")),
            (&swapped, "--swap", Some("--azimuth mirrored-views, without --swap")),
            (&without_cosine, "--cosine excluded", None),
            (&without_cosine, "--transfer linear", Some("--cosine excluded --transfer linear")),
            (&Adaptation { transpose: true, ..given() }, "--transpose", Some("without --transpose")),
            (
                &Adaptation { transfer: Some(Transfer::Linear), samples: Some(Type::F16), ..given() },
                "--transfer srgb",
                Some("--transfer srgb --samples f16"),
            ),
            (&low, "--polar elevation", Some("without --polar")),
            (&low, "--polar elevation-lights", Some("--polar elevation-views")),
            (&lights, "--polar elevation", Some("--polar elevation --azimuth mirrored-lights")),
            // The first that is left is number 1 of the archive, the second number 3.
            (&dropped, "--drop-view 0", Some("--drop-view 0 --drop-view 1 --drop-view 2")),
            (&dropped, "--drop-view 1", Some("--drop-view 0 --drop-view 2 --drop-view 3")),
        ] {
            let told = advised(given, repair);
            assert_eq!(told.as_deref(), expected, "{repair} beside {:?}", given.options());
            let again = told.is_some_and(|told| told == given.options().join(" "));
            assert!(!again, "{repair}");
        }
        assert_eq!(advised(&given(), "--swap").as_deref(), Some("--swap"));
    }
}
