//! UBO2003 and the sets that follow its naming (ATRIUM, Bonn's folders of OpenEXR images): one picture for each
//! pair of directions, the directions in the file's name.
//!
//! theta (`t`) is the polar angle from the surface normal, phi (`p`) the azimuth, counter-clockwise as seen in
//! the image from its right-hand side, of the light (`l`) and of the view (`v`): `tl015 pl060` is a light.
//! Published names read `NNNNN tlTTT plPPP tvTTT pvPPP.jpg` with `NNNNN = 81 light + view`, and lie in one zip,
//! in one folder for each view, or in one zip for each view.

mod name;

pub use crate::angles::Angles;
pub use crate::catalogue::{Catalogue, CatalogueErrors, Duplicate, Pair};
pub use crate::directions::directions_81;
pub use name::{ImageName, doubt, expect_known, parse_name, write_name};

impl Catalogue {
    /// Sorts out a list of entry or file names by [`parse_name`]; see [`Catalogue::from_pairs`]. One pair
    /// with two files, be they of two formats, is an error.
    ///
    /// # Errors
    /// As [`Catalogue::from_pairs`].
    pub fn from_names<'a>(
        names: impl IntoIterator<Item = &'a str>,
    ) -> Result<Catalogue, Box<CatalogueErrors>> {
        let pair = |name| parse_name(name).map(|image| Pair { view: image.view, light: image.light });
        Catalogue::from_pairs(names.into_iter().map(|name| (name, pair(name))))
    }
}
