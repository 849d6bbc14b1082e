//! How many pyramid levels and neighbours a field can carry: samples against parameters.

use super::car::Positions;
use super::neighbourhood;
use super::spectrum::MOST_LEVELS;
use crate::error::{Error, Result};
use crate::method::field::model::{CarKind, Options};
use crate::method::field::pyramid;

/// Scalars of data that each scalar of a model should rest on.
const SAMPLES_PER_PARAMETER: usize = 10;

/// The most levels that are chosen without being asked for.
const MOST_CHOSEN_LEVELS: usize = 5;

/// Neighbours that the coarsest level must be able to carry.
const COARSEST_SITES: usize = 4;

/// The most levels to fit to a field of this height and width: those asked for, or else as many as keep enough samples
/// per parameter at the coarsest.
///
/// # Errors
/// When more levels are asked for than halve the longer side to one texel, more than 8, or none.
pub(super) fn most_levels(size: [usize; 2], channels: usize, options: &Options) -> Result<usize> {
    let [height, width] = size;
    if let Some(levels) = options.levels {
        let most = 1 + height.max(width).next_power_of_two().trailing_zeros() as usize;
        let most = most.min(MOST_LEVELS);
        if !(1..=most).contains(&levels) {
            return Err(Error::usage(format!(
                "{levels} pyramid levels for {height} x {width} texels: 1 to {most} are possible"
            )));
        }
        return Ok(levels);
    }
    let sets = neighbourhood::nested();
    let carries = |size: &[usize; 2]| {
        sets.iter()
            .filter(|set| set.len() == COARSEST_SITES)
            .all(|set| affords(*size, channels, set, options))
    };
    let sizes = pyramid::sizes(height, width, MOST_CHOSEN_LEVELS);
    Ok(sizes.iter().take_while(|&size| carries(size)).count().max(1))
}

/// Channels that one model of this kind has.
pub(super) fn joint_channels(kind: CarKind, channels: usize) -> usize {
    match kind {
        CarKind::Car3d => channels,
        CarKind::Car2d => 1,
    }
}

/// Scalars of data at a level, for one joint model, against the scalars of its Gamma and Sigma.
pub(super) fn balance(
    size: [usize; 2],
    channels: usize,
    set: &[[i32; 2]],
    options: &Options,
) -> (usize, usize) {
    let c = joint_channels(options.kind, channels);
    let texels = Positions::new(options.boundary, set).count(size[0], size[1]);
    (texels * c, c * c * set.len() + c * (c + 1) / 2)
}

pub(super) fn affords(size: [usize; 2], channels: usize, set: &[[i32; 2]], options: &Options) -> bool {
    let (samples, parameters) = balance(size, channels, set, options);
    samples >= SAMPLES_PER_PARAMETER * parameters
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::method::field::{Boundary, Gains};

    fn options(kind: CarKind, levels: Option<usize>) -> Options {
        Options { kind, levels, gains: Gains::None, boundary: Boundary::Periodic }
    }

    #[test]
    fn levels_stop_where_the_coarsest_would_starve() {
        let chosen =
            |side, channels, kind| most_levels([side, side], channels, &options(kind, None)).unwrap();
        // 3D, three channels: 42 parameters need 140 texels. Scalar: 5 parameters need 50.
        assert_eq!(chosen(64, 3, CarKind::Car3d), 3);
        assert_eq!(chosen(64, 3, CarKind::Car2d), 4);
        assert_eq!(chosen(1024, 3, CarKind::Car3d), MOST_CHOSEN_LEVELS);
        assert_eq!(chosen(8, 3, CarKind::Car3d), 1);
        // Mirrored, 16 x 14 texels, less one row and two columns: 180 inner ones, but 42 at the next level.
        let mirrored = Options { boundary: Boundary::Mirrored, ..options(CarKind::Car3d, None) };
        assert_eq!(most_levels([16, 14], 3, &mirrored).unwrap(), 1);
        assert_eq!(balance([16, 14], 3, &neighbourhood::nested()[1], &mirrored), (540, 42));
    }

    #[test]
    fn levels_asked_for_end_at_one_texel() {
        let asked = |levels| most_levels([9, 16], 1, &options(CarKind::Car3d, Some(levels)));
        assert_eq!(asked(5).unwrap(), 5);
        assert!(asked(6).is_err() && asked(0).is_err());
    }
}
