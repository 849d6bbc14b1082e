//! What to take as the tile.

use std::str::FromStr;

use crate::method::tile::LONGEST_SIDE;
use crate::shape::Size;

/// Longest side of a plane of which [`Choice::Auto`] takes as much as it can: that of the tiles that are cut from larger
/// ones, so it costs the later stages no more than such a tile.
const SMALL_PLANE: usize = LONGEST_SIDE;

/// What to take as the tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// `Largest` up to 256 texels a side, `Cut` beyond.
    Auto,
    /// The whole measurement if its borders join, else the largest seamless tile that can be cut from it.
    Largest,
    /// The whole measurement; whether its borders join is measured.
    Plane,
    /// Search origin and size of a seamless tile, among those whose seams show least.
    Cut,
    /// Search the origin of a seamless tile of this size.
    Sized(Size),
    /// The whole measurement, whose borders do not join.
    None,
    /// The whole measurement, which is a seamless tile already.
    Periodic,
}

impl Choice {
    /// What `Auto` means for a plane of this size; every other choice is itself.
    pub(crate) fn resolved(self, plane: Size) -> Self {
        match self {
            Self::Auto if plane.height.max(plane.width) <= SMALL_PLANE => Self::Largest,
            Self::Auto => Self::Cut,
            other => other,
        }
    }
}

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "largest" => Ok(Self::Largest),
            "plane" => Ok(Self::Plane),
            "cut" => Ok(Self::Cut),
            "none" => Ok(Self::None),
            "periodic" => Ok(Self::Periodic),
            _ => text.parse().map(Self::Sized).map_err(|_| {
                format!("expected auto, largest, plane, cut, none, periodic or WIDTHxHEIGHT, got {text:?}")
            }),
        }
    }
}

impl std::fmt::Display for Choice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Largest => f.write_str("largest"),
            Self::Plane => f.write_str("plane"),
            Self::Cut => f.write_str("cut"),
            Self::None => f.write_str("none"),
            Self::Periodic => f.write_str("periodic"),
            Self::Sized(size) => write!(f, "{size}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_come_back_as_they_went() {
        for text in ["auto", "largest", "plane", "cut", "none", "periodic", "48x32"] {
            assert_eq!(text.parse::<Choice>().map(|choice| choice.to_string()), Ok(text.to_owned()));
        }
        assert!("all".parse::<Choice>().is_err_and(|told| told.contains("all")));
    }

    #[test]
    fn of_small_planes_the_most_is_taken_and_of_large_ones_a_tile_is_cut() {
        assert_eq!(Choice::Auto.resolved(Size::new(256, 96)), Choice::Largest);
        assert_eq!(Choice::Auto.resolved(Size::new(96, 257)), Choice::Cut);
        assert_eq!(Choice::None.resolved(Size::new(800, 800)), Choice::None);
        assert_eq!(Choice::Cut.resolved(Size::new(96, 96)), Choice::Cut);
    }
}
