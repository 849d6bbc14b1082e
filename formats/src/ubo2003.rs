//! UBO2003 and the sets that follow its naming (ATRIUM): one JPEG for each pair of directions, the directions
//! in the file's name.
//!
//! theta (`t`) is the polar angle from the surface normal, phi (`p`) the azimuth, counter-clockwise as seen in
//! the image from its right-hand side, of the light (`l`) and of the view (`v`): `tl015 pl060` is a light.
//! Published names read `NNNNN tlTTT plPPP tvTTT pvPPP.jpg` with `NNNNN = 81 light + view`, and lie in one zip
//! or in one folder for each view.

mod catalogue;
mod directions;
mod name;

pub use catalogue::{Catalogue, CatalogueErrors, Duplicate, Pair};
pub use directions::{Angles, directions_81};
pub use name::{ImageName, parse_name, write_name};
