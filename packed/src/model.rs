//! The model that is packed: a mean and components over views, lights, channels and texels.

use crate::error::{Error, Result};

/// The largest number of a mean or of coefficients that is read or written. Values that are sums of products stay finite
/// in 32 bits.
pub const LARGEST: f64 = (1u128 << 64) as f64;

/// The same of bases.
pub const LARGEST_OF_BASIS: f64 = (1u64 << 32) as f64;

/// A direction in degrees: polar angle from the normal, and azimuth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Polar angle, 0 to 90.
    pub theta_deg: f64,
    /// Azimuth, 0 to 360.
    pub phi_deg: f64,
}

/// One component: its BRDF and its weight at each texel.
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    /// A unit vector [view, light, channel].
    pub basis: Vec<f64>,
    /// Weights [y, x], in units of 1/255 on the sRGB curve.
    pub coefficients: Vec<f64>,
}

/// A mean and components, the strongest first.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Rows and columns of the tile.
    pub size: [usize; 2],
    /// Whether the tile's borders join.
    pub wraps: bool,
    /// View directions.
    pub views: Vec<Direction>,
    /// Light directions.
    pub lights: Vec<Direction>,
    /// Names of the channels: Y; R, G, B; or wavelengths.
    pub channels: Vec<String>,
    /// What else is said of the material, such as its licence: names and texts.
    pub texts: Vec<(String, String)>,
    /// The mean BRDF [view, light, channel], on the sRGB curve times 255.
    pub mean: Vec<f64>,
    /// The components.
    pub components: Vec<Component>,
}

impl Model {
    /// Texels of the tile.
    pub fn texels(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// Values of a BRDF.
    pub fn brdf(&self) -> usize {
        self.views.len() * self.lights.len() * self.channels.len()
    }

    /// Checks that the lengths fit together and that all numbers are finite and of a size that values can be made of.
    ///
    /// # Errors
    /// Says which does not.
    pub fn check(&self) -> Result<()> {
        let expect = |what: &str, found: usize, expected: usize| match found == expected {
            true => Ok(()),
            false => Err(Error::new(format!("{what} of {found} values"), format!("{expected}"))),
        };
        expect("a mean", self.mean.len(), self.brdf())?;
        for Component { basis, coefficients } in &self.components {
            expect("a component's basis", basis.len(), self.brdf())?;
            expect("a component's coefficients", coefficients.len(), self.texels())?;
        }
        let within = |what: &str, list: &[f64], most: f64| match list
            .iter()
            .find(|value| value.is_nan() || value.abs() > most)
        {
            None => Ok(()),
            Some(value) => {
                let expected = format!("finite numbers, of at most {most:e}");
                Err(Error::new(format!("the value {value:e} of {what}"), expected))
            }
        };
        for Component { basis, coefficients } in &self.components {
            within("a basis", basis, LARGEST_OF_BASIS)?;
            within("coefficients", coefficients, LARGEST)?;
        }
        within("the mean", &self.mean, LARGEST)
    }
}
