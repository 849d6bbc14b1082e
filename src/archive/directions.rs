//! Corrects the directions of an archive as the options say: leaves some out, exchanges views and lights, reads
//! elevations, mirrors and turns azimuths.

use std::path::Path;

use btfkit_formats::{About, Contents, Direction};

use crate::error::{Error, Result};
use crate::store::measurement::{Adaptation, Side};

impl Adaptation {
    /// Lights and views as the archive has them, by their numbers, that are left out: light and view may be exchanged.
    pub(super) fn dropped(&self) -> [&[usize]; 2] {
        let [mut lights, mut views] = [&self.drop_lights, &self.drop_views].map(Vec::as_slice);
        if self.swap {
            std::mem::swap(&mut lights, &mut views);
        }
        [lights, views]
    }

    /// Numbers of the lights and of the views that are kept; those that are left out are sorted.
    ///
    /// # Errors
    /// A number that there is none of, or none left.
    pub(super) fn kept(&self, of: &Contents, path: &Path) -> Result<[Vec<usize>; 2]> {
        let mut counts = [of.lights.len(), of.views.len()];
        if self.swap {
            counts.reverse();
        }
        let [lights, views] = counts;
        let kept = |what: &str, count: usize, dropped: &[usize]| {
            let path = path.display();
            if let Some(&beyond) = dropped.iter().find(|&&number| number >= count) {
                return Err(Error::usage(format!(
                    "{path}: there is no {what} {beyond} to drop: {what}s are numbered 0 to {}",
                    count.saturating_sub(1)
                )));
            }
            let kept: Vec<usize> =
                (0..count).filter(|number| dropped.binary_search(number).is_err()).collect();
            if kept.is_empty() {
                return Err(Error::usage(format!("{path}: no {what} is left")));
            }
            Ok(kept)
        };
        Ok([kept("light", lights, &self.drop_lights)?, kept("view", views, &self.drop_views)?])
    }

    /// All lights and views, mended.
    ///
    /// # Errors
    /// Elevations that are one direction.
    pub(super) fn directions(&self, of: &Contents, path: &Path) -> Result<[Vec<Direction>; 2]> {
        let views_are_assumed = of.assumptions.iter().any(|assumption| assumption.about == About::Views);
        let turn = f64::from(self.turn_deg).to_radians();
        let mended = |list: &[Direction], elevations: bool, mirrored: bool| {
            let mend = |direction: &Direction| {
                let Direction { theta_rad, phi_rad } =
                    if elevations { of_elevation(*direction) } else { *direction };
                let phi_rad = if mirrored { -phi_rad } else { phi_rad };
                let turned = (phi_rad + turn).rem_euclid(std::f64::consts::TAU);
                Direction { theta_rad, phi_rad: turned }
            };
            list.iter().map(mend).collect::<Vec<_>>()
        };
        let mut lists = [&of.lights, &of.views];
        // A view that no name gives is frontal, and no elevation.
        let mut given = [true, !views_are_assumed];
        if self.swap {
            lists.reverse();
            given.reverse();
        }
        let [elevations, mirrored] = [self.elevations, self.mirrored].map(Side::lights_and_views);
        let all: [Vec<Direction>; 2] =
            std::array::from_fn(|side| mended(lists[side], elevations[side] && given[side], mirrored[side]));
        if self.elevations.is_some() {
            expect_distinct(&all[0], "lights", path)?;
            expect_distinct(&all[1], "views", path)?;
        }
        Ok(all)
    }
}

/// The direction whose elevation above the surface stands where its angle from the normal should.
pub(crate) fn of_elevation(direction: Direction) -> Direction {
    let (elevation_deg, phi_deg) = direction.degrees();
    // Without the noise of the conversion, so that it is what a name with theta would give.
    let theta_deg = ((90.0 - elevation_deg) * 1e9).round().max(0.0) / 1e9;
    Direction::from_degrees(theta_deg, if theta_deg > 0.0 { phi_deg } else { 0.0 })
}

/// That no two directions are straight above: their azimuths told them apart while they were on the horizon.
fn expect_distinct(list: &[Direction], what: &str, path: &Path) -> Result<()> {
    let mut above = (0..list.len()).filter(|&number| list[number].theta_rad == 0.0);
    match (above.next(), above.next()) {
        (Some(first), Some(second)) => Err(Error::input(format!(
            "{}: the {what} {first} and {second} are both straight above as elevations of 90 degrees, expected one",
            path.display()
        ))
        .hint("if these angles are no elevations, leave out --polar; else leave all but one of them out by --drop-view or --drop-light")),
        _ => Ok(()),
    }
}
