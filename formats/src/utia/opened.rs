//! What is kept of an open container of either format, and its images read one by one.

use std::ops::Range;

use super::{Grid, with_capacity};
use crate::{Contents, Error, ErrorKind, Limits, Result, Samples, request};

/// A container whose images are found by their place in the order of its directions.
#[derive(Debug, Clone)]
pub(crate) struct Opened {
    pub(crate) contents: Contents,
    pub(crate) grid: Grid,
    /// What a stored number is multiplied by.
    pub(crate) unit: f32,
    /// Bytes of the file that was opened.
    pub(crate) bytes: usize,
    pub(crate) limits: Limits,
}

impl Opened {
    /// The images of a view under a range of lights; `append` adds the image at a place, in the unit given, or says by
    /// `None` that its data are not there.
    ///
    /// # Errors
    /// A view or light that there is none of, other bytes than those that were opened.
    pub(crate) fn read(
        &self,
        bytes: &[u8],
        view: usize,
        lights: Range<usize>,
        append: impl Fn(usize, f32, &mut Samples) -> Option<()>,
    ) -> Result<Samples> {
        request::check(&self.contents, self.bytes, bytes, view, &lights)?;
        let count = request::samples(&self.contents, lights.len(), &self.limits)?;
        let mut samples = with_capacity(self.contents.sample_type, count);
        for light in lights {
            let place = self.grid.place(view, light);
            if place.and_then(|place| append(place, self.unit, &mut samples)).is_none() {
                let found = format!("no data of view {view}, light {light}");
                return Err(Error::new(ErrorKind::Argument, found, "the file that was opened"));
            }
        }
        Ok(samples)
    }
}
