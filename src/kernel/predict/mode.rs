//! How a channel of a chunk is predicted, as its byte in the encoded chunk says.

/// What a sample is predicted from in the plane of its light, by the neighbours at left (L), above (U), above
/// left (C) and above right (D). Means are rounded up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spatial {
    /// The median of L, U and L + U - C.
    Median,
    /// The mean of the above and of the mean of L and U.
    Smooth,
    /// The mean of L and of the mean of U and D.
    Mean,
}

/// How much of the mean residual of the two lights around it is taken from a light's residual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// Nothing.
    None,
    /// Half of it.
    Half,
    /// All of it.
    Whole,
}

/// Distances to the lights around it, coarsest first: lights whose number is an odd multiple of the distance.
pub(crate) const DISTANCES: [usize; 3] = [4, 2, 1];

/// Prediction of one channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mode {
    /// From the plane of the light.
    pub spatial: Spatial,
    /// From the lights at each of [`DISTANCES`].
    pub weights: [Weight; 3],
}

impl Spatial {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Median, Self::Smooth, Self::Mean];
}

impl Weight {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::None, Self::Half, Self::Whole];
}

impl Mode {
    /// The byte: two bits each for the spatial predictor (lowest) and the weights.
    pub(crate) fn to_byte(self) -> u8 {
        let [a, b, c] = self.weights.map(|weight| weight as u8);
        self.spatial as u8 | a << 2 | b << 4 | c << 6
    }

    /// The mode of a byte, if it is one.
    pub(crate) fn from_byte(byte: u8) -> Option<Self> {
        let bits = |at: u8| usize::from(byte >> at & 3);
        let weight = |at| Weight::ALL.get(bits(at)).copied();
        Some(Self { spatial: *Spatial::ALL.get(bits(0))?, weights: [weight(2)?, weight(4)?, weight(6)?] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_and_bytes_are_one_to_one() {
        let modes: Vec<Mode> = (0..=u8::MAX).filter_map(Mode::from_byte).collect();
        assert_eq!(modes.len(), 81);
        assert_eq!(Mode::from_byte(0b10_01_00_01).map(|m| m.spatial), Some(Spatial::Smooth));
        for byte in 0..=u8::MAX {
            if let Some(mode) = Mode::from_byte(byte) {
                assert_eq!(mode.to_byte(), byte);
            }
        }
    }
}
