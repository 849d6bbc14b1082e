//! An archive as a source of views, for those who want texels and not images.

use btfkit_formats::Samples;

use super::source::Views;
use crate::archive::{Source, read_groups};
use crate::error::Result;
use crate::shape::Window;
use crate::store::measurement::Description;
use crate::store::measurement::gather::Images;

/// An archive read view by view, without a store.
pub struct ArchiveViews<'a> {
    source: &'a dyn Source,
    description: Description,
}

impl<'a> ArchiveViews<'a> {
    /// The views of an archive, meant as the description says.
    pub fn new(source: &'a dyn Source, description: Description) -> Self {
        Self { source, description }
    }
}

impl Views for ArchiveViews<'_> {
    fn description(&self) -> &Description {
        &self.description
    }

    fn read_view(&self, view: usize, window: Window) -> Result<Samples> {
        let Description { size, sample_type, .. } = self.description;
        let groups = read_groups(self.source, view)?;
        let images = Images::new(size, self.description.n_channels(), sample_type, groups)?;
        Ok(images.gather(window))
    }

    fn reading_bytes(&self) -> u64 {
        self.description.view_bytes() + self.source.bytes_beside_image()
    }
}
