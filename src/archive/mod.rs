//! Archives as they come: anything with the images of one material under every pair of a view and a light.
//!
//! [`open`] recognises what lies at a path by its content; whatever it is, the rest of the program sees a
//! [`Source`]. [`adapt`] wraps a source to mend what is known to be wrong with an archive.

pub mod adapt;
mod container;
pub mod files;
mod pictures;
pub mod views;

use std::ops::Range;
use std::path::{Path, PathBuf};

use btfkit_formats::{Contents, Limits, Samples};

use crate::error::Result;
use adapt::Adaptation;
use crate::run::Context;

/// A measurement that can be read image by image.
pub trait Source: Send + Sync {
    /// Where it lies, for messages.
    fn path(&self) -> &Path;

    /// Sizes, directions, and how its samples are meant.
    fn contents(&self) -> &Contents;

    /// How many images of a view are best read at once.
    fn lights_at_once(&self) -> usize;

    /// The images of one view under a range of lights, [light, y, x, channel].
    fn read_images(&self, view: usize, lights: Range<usize>) -> Result<Samples>;

    /// Looks at the whole archive without decoding it, and returns a digest of everything that its samples
    /// depend on.
    ///
    /// # Errors
    /// Names every unusable image.
    fn check(&self, context: &Context<'_>) -> Result<String>;
}

/// Recognises and opens an archive: the files at one path, or the pieces at several.
pub fn open(paths: &[PathBuf], options: &Options) -> Result<Box<dyn Source>> {
    let source = Box::new(pictures::Pictures::open(paths, Limits::default())?);
    adapt::adapt(source, &options.adaptation)
}

/// What a reader is told because the archive does not say it, or says it wrong.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// What is mended.
    pub adaptation: Adaptation,
}
