//! What can be checked: anything whose views can be read one after another.

use btfkit_formats::Samples;

use crate::error::Result;
use crate::shape::Window;
use crate::store::measurement::{Description, Measurement};

/// Anything whose views can be read one after another: a measurement store, an archive.
pub trait Views: Sync {
    /// Sizes, directions, how samples are meant.
    fn description(&self) -> &Description;
    /// Samples of a window under one view, [y, x, light, channel].
    fn read_view(&self, view: usize, window: Window) -> Result<Samples>;
    /// Memory that reading one view takes, beside the samples that are handed out: of another view, of images, of a
    /// file that is decoded.
    fn reading_bytes(&self) -> u64 {
        // The mapped shards; chunks compress.
        self.description().view_bytes()
    }
}

impl Views for Measurement {
    fn description(&self) -> &Description {
        self.description()
    }

    fn read_view(&self, view: usize, window: Window) -> Result<Samples> {
        self.read_reflectance(view, window)
    }
}
