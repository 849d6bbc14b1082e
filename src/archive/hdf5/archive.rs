//! An HDF5 archive of either layout, open for reading.

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use btfkit_formats::{Contents, Limits, SampleType, Samples, f16};
use hdf5::H5Type;

use super::dataset::File;
use super::image_list::{self, ImageList};
use super::measurement::{self, Texels};
use crate::error::{Error, Result};
use crate::shape::{Size, Window};
use crate::words::counted;

/// An HDF5 archive, listed but with no samples read. Can be read from several threads; the C library serves one at a
/// time.
pub struct Archive {
    path: PathBuf,
    limits: Limits,
    layout: Layout,
    contents: Contents,
}

enum Layout {
    Images(ImageList),
    Texels(Texels),
}

impl Archive {
    /// Opens a file and checks that all that it declares is there, without reading samples.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Input`]: no HDF5 file, a damaged one, one of neither layout, data that lie elsewhere or are
    /// packed by other filters than deflate, shuffle and fletcher32, extents beyond the limits or beyond the file,
    /// directions that make no complete grid of views and lights.
    pub fn open(path: &Path, limits: &Limits) -> Result<Self> {
        // The bindings index some lists by counts that the file gives (parameters of a filter, for one).
        catch_unwind(AssertUnwindSafe(|| Self::open_layout(path, limits))).unwrap_or_else(|_| {
            Err(Error::input(format!("{}: the HDF5 library cannot make sense of this file", path.display())))
        })
    }

    fn open_layout(path: &Path, limits: &Limits) -> Result<Self> {
        let file = File::open(path)?;
        let (layout, contents) = if file.has(measurement::REFLECTANCE) {
            let (texels, contents) = Texels::open(&file, limits)?;
            (Layout::Texels(texels), contents)
        } else if file.has(image_list::COLOR) {
            let (images, contents) = ImageList::open(&file, limits)?;
            (Layout::Images(images), contents)
        } else {
            return Err(file
                .error(format!("got {}, expected reflectance or ground_color", file.names()))
                .hint("of HDF5 files, NeuralBTF's lists of images and what this program writes are read"));
        };
        let pixels = u64::from(contents.width) * u64::from(contents.height);
        if pixels > limits.max_pixels_per_image {
            return Err(file.error(format!(
                "got images of {}x{}, expected at most {}",
                contents.width,
                contents.height,
                counted(limits.max_pixels_per_image, "pixel")
            )));
        }
        Ok(Self { path: path.to_owned(), limits: limits.clone(), layout, contents })
    }

    /// What it holds.
    pub fn contents(&self) -> &Contents {
        &self.contents
    }

    /// The images of one view under a range of lights, `[light, y, x, channel]`.
    ///
    /// # Errors
    /// A view or light that there is none of; more than the limits allow at once; damaged data.
    pub fn read_images(&self, view: usize, lights: Range<usize>) -> Result<Samples> {
        self.check(view, lights.clone(), self.size().window())?;
        match self.contents.sample_type {
            SampleType::U8 => self.images(view, lights).map(Samples::U8),
            SampleType::U16 => self.images(view, lights).map(Samples::U16),
            SampleType::F16 => self.images::<f16>(view, lights).map(Samples::F16),
            SampleType::F32 => self.images(view, lights).map(Samples::F32),
        }
    }

    /// A window of one view under all lights, `[y, x, light, channel]`. Of our own layout this reads what it returns
    /// and little more, as long as the window's sides are multiples of 16.
    ///
    /// # Errors
    /// As [`Archive::read_images`]; a window that reaches beyond the images.
    pub fn read_view(&self, view: usize, window: Window) -> Result<Samples> {
        self.check(view, 0..self.contents.lights.len(), window)?;
        match self.contents.sample_type {
            SampleType::U8 => self.texels(view, window).map(Samples::U8),
            SampleType::U16 => self.texels(view, window).map(Samples::U16),
            SampleType::F16 => self.texels::<f16>(view, window).map(Samples::F16),
            SampleType::F32 => self.texels(view, window).map(Samples::F32),
        }
    }

    fn size(&self) -> Size {
        Size::new(self.contents.height as usize, self.contents.width as usize)
    }

    fn check(&self, view: usize, lights: Range<usize>, window: Window) -> Result<()> {
        let Contents { views, lights: all, channels, sample_type, .. } = &self.contents;
        let inside = view < views.len() && lights.end <= all.len() && window.fits(self.size());
        if !inside {
            return Err(Error::usage(format!(
                "{}: asked for view {view}, lights {lights:?}, window {window} of {}, {}, {}",
                self.path.display(),
                counted(views.len(), "view"),
                counted(all.len(), "light"),
                self.size()
            )));
        }
        let texel_bytes = lights.len() * channels.len() * sample_type.bytes();
        let bytes = (window.size.texels() as u64).saturating_mul(texel_bytes as u64);
        if bytes > self.limits.max_decoded_bytes {
            return Err(Error::usage(format!(
                "{}: asked for {} at once, expected at most {}",
                self.path.display(),
                counted(bytes, "byte"),
                self.limits.max_decoded_bytes
            )));
        }
        Ok(())
    }

    fn images<T: H5Type + Copy>(&self, view: usize, lights: Range<usize>) -> Result<Vec<T>> {
        let rows = rows_and_columns(self.size().window());
        match &self.layout {
            Layout::Images(images) => images.read_images(view, lights, rows),
            Layout::Texels(texels) => {
                let samples = texels.read(view, rows, lights.clone())?;
                Ok(swap_outer(&samples, self.size().texels(), lights.len(), self.contents.channels.len()))
            }
        }
    }

    fn texels<T: H5Type + Copy>(&self, view: usize, window: Window) -> Result<Vec<T>> {
        let (rows, lights) = (rows_and_columns(window), self.contents.lights.len());
        match &self.layout {
            Layout::Texels(texels) => texels.read(view, rows, 0..lights),
            Layout::Images(images) => {
                let samples = images.read_images(view, 0..lights, rows)?;
                Ok(swap_outer(&samples, lights, window.size.texels(), self.contents.channels.len()))
            }
        }
    }
}

fn rows_and_columns(Window { y, x, size }: Window) -> [Range<usize>; 2] {
    [y..y + size.height, x..x + size.width]
}

/// From [outer, inner, channel] to [inner, outer, channel].
fn swap_outer<T: Copy>(samples: &[T], outer: usize, inner: usize, channels: usize) -> Vec<T> {
    let mut swapped = Vec::with_capacity(samples.len());
    for i in 0..inner {
        for o in 0..outer {
            let at = (o * inner + i) * channels;
            swapped.extend_from_slice(&samples[at..at + channels]);
        }
    }
    swapped
}
