//! Anything whose views can be read one after another: a measurement store, an archive.

use btfkit_formats::Samples;

use crate::error::Result;
use crate::shape::Window;
use crate::store::measurement::Description;

/// A source of views.
pub trait Views: Sync {
    /// Sizes, directions, how samples are meant.
    fn description(&self) -> &Description;
    /// Samples of a window under one view, [y, x, light, channel].
    fn read_view(&self, view: usize, window: Window) -> Result<Samples>;
}
