//! Measurement, or packed model, to archive: so that others' programs open what we hold, and nobody is locked in.

mod bonn;
#[cfg(feature = "hdf5")]
mod hdf5;
mod npy;
mod pictures;

use std::path::{Path, PathBuf};

use btfkit_formats::{SampleType, Samples};

use crate::archive::adapt::half;
use crate::color::Transfer;
use crate::disk::output::{Made, expect_outside_stores};
use crate::error::{Error, Result};
use crate::run::progress::Counted;
use crate::run::{Context, read_ahead};
use crate::shape::Window;
use crate::store::measurement::gather::images_of_texels;
use crate::store::measurement::{Description, Measurement};
use crate::store::packed::{Packed, is_packed};

/// A view as it is read, turned into images, and encoded.
const VIEW_COPIES: u64 = 4;

/// What to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A zip of JPEGs named as in UBO2003: 8 bits, sRGB, lossy.
    Ubo2003,
    /// A folder of OpenEXR pictures: linear, halves or floats.
    Exr,
    /// A folder of PNGs: the 8- or 16-bit samples as they are.
    Png,
    /// An array [view, light, y, x, channel] for numpy, and two with its directions.
    Npy,
    /// One HDF5 file with the arrays of the store.
    Hdf5,
    /// Bonn's DFMF container: one factorisation a channel; 3 channels for most viewers.
    Dfmf,
    /// Bonn's FMF container: one factorisation of all channels.
    Fmf,
}

/// What to export, and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// The file or folder to make.
    pub output: PathBuf,
    /// Its format.
    pub format: Format,
    /// Components of a factorisation; all where none is given, which is exact.
    pub rank: Option<usize>,
    /// JPEG quality, 1 to 100.
    pub quality: u8,
}

/// What was written.
#[derive(Clone, Debug)]
pub struct Report {
    /// Whether it was there already.
    pub made: Made,
    /// Bytes of all files.
    pub bytes: u64,
    /// What other programs will not like, a sentence each.
    pub warnings: Vec<String>,
}

/// Whether it was there already, and what other programs will not like.
type Written = (Made, Vec<String>);

/// What is exported: samples of a plane under all pairs of directions.
pub struct Source(Kept);

enum Kept {
    Measurement(Box<Measurement>),
    /// The tile of a packed model.
    Packed(Box<Packed>),
}

impl Source {
    /// Opens a measurement, or a packed model.
    ///
    /// # Errors
    /// Where there is neither, or it is damaged; too little memory.
    pub fn open(path: &Path, context: &Context<'_>) -> Result<Self> {
        Ok(Self(match is_packed(path) {
            true => Kept::Packed(Box::new(Packed::open(path, context)?)),
            false => Kept::Measurement(Box::new(Measurement::open(path)?)),
        }))
    }

    /// Of a measurement that is open.
    pub fn of(measurement: Measurement) -> Self {
        Self(Kept::Measurement(Box::new(measurement)))
    }

    /// What there is to say of what was opened, a sentence each.
    fn notes(&self) -> Vec<String> {
        match &self.0 {
            Kept::Measurement(_) => vec![],
            Kept::Packed(packed) => packed.notes.clone(),
        }
    }

    /// Memory that stays taken, bytes.
    fn memory_bytes(&self) -> u64 {
        match &self.0 {
            Kept::Measurement(_) => 0,
            Kept::Packed(packed) => packed.memory_bytes,
        }
    }

    fn description(&self) -> &Description {
        match &self.0 {
            Kept::Measurement(measurement) => measurement.description(),
            Kept::Packed(packed) => &packed.description,
        }
    }

    /// Checks that all of it is there.
    fn expect_complete(&self) -> Result<()> {
        let Kept::Measurement(measurement) = &self.0 else { return Ok(()) };
        let (views, done) = (measurement.description().views.len(), measurement.views_done());
        if done == views {
            return Ok(());
        }
        let found = format!("{}: {done} of {views} views are there", measurement.path().display());
        Err(Error::missing(found).hint("finish its import first"))
    }

    /// Samples of a window of a view, [y, x, light, channel].
    fn read_reflectance(&self, view: usize, window: Window) -> Result<Samples> {
        match &self.0 {
            Kept::Measurement(measurement) => measurement.read_reflectance(view, window),
            Kept::Packed(packed) => Ok(packed.samples(view, 0..packed.description.lights.len(), window)),
        }
    }

    /// Their L* codes, [y, x, light].
    #[cfg(feature = "hdf5")]
    fn read_luminance(&self, view: usize, window: Window) -> Result<Vec<u8>> {
        match &self.0 {
            Kept::Measurement(measurement) => measurement.read_luminance(view, window),
            Kept::Packed(packed) => Ok(packed.description.codes()?.of(&self.read_reflectance(view, window)?)),
        }
    }

    /// What else is known of it, as attributes.
    #[cfg(feature = "hdf5")]
    fn attributes(&self) -> Result<serde_json::Map<String, serde_json::Value>> {
        match &self.0 {
            Kept::Measurement(measurement) => measurement.attributes(),
            Kept::Packed(packed) => {
                let texts = packed.texts.iter().map(|(name, text)| (name.clone(), text.clone().into()));
                Ok(texts.collect())
            }
        }
    }
}

/// Writes a whole measurement, or the tile of a packed model, as an archive.
///
/// # Errors
/// A measurement that is not complete, or that the format cannot hold; [`crate::ErrorKind::Recipe`] where other files
/// are.
pub fn run(source: &Source, options: &Options, context: &Context<'_>) -> Result<Report> {
    expect_outside_stores(&options.output)?;
    source.expect_complete()?;
    let description = source.description();
    let what = format!(
        "exporting views of {} under {}",
        description.size,
        counted(description.lights.len(), "light")
    );
    context.require(&what, source.memory_bytes() + VIEW_COPIES * description.view_bytes())?;
    let (made, more) = match options.format {
        Format::Ubo2003 => pictures::ubo2003(source, options, context)?,
        Format::Exr => pictures::folder(source, options, pictures::FileKind::Exr, context)?,
        Format::Png => pictures::folder(source, options, pictures::FileKind::Png, context)?,
        Format::Npy => npy::write(source, options, context)?,
        Format::Hdf5 => hdf5(source, options, context)?,
        Format::Dfmf => bonn::dfmf(source, options, context)?,
        Format::Fmf => bonn::fmf(source, options, context)?,
    };
    context.progress.end();
    let warnings = [source.notes(), more].concat();
    Ok(Report { made, bytes: bytes_of(&options.output), warnings })
}

use crate::words::counted;
#[cfg(feature = "hdf5")]
use hdf5::write as hdf5;

#[cfg(not(feature = "hdf5"))]
fn hdf5(_: &Source, options: &Options, _: &Context<'_>) -> Result<Written> {
    Err(crate::archive::hdf5::not_built_in(&options.output))
}

fn bytes_of(path: &Path) -> u64 {
    if path.is_dir() {
        let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
        entries.map(|entry| bytes_of(&entry.path())).sum()
    } else {
        std::fs::metadata(path).map_or(0, |data| data.len())
    }
}

/// Calls `each` with every view and its images, [light, y, x, channel].
fn for_each_view(
    source: &Source,
    context: &Context<'_>,
    mut each: impl FnMut(usize, Samples) -> Result<()>,
) -> Result<()> {
    let description = source.description();
    context.progress.begin("export", description.views.len() as u64, Counted::Items("views"));
    // Read as texels, then turned, then encoded.
    let in_flight = read_ahead::in_flight(context.work_bytes(), VIEW_COPIES * description.view_bytes());
    let read = |view| {
        let texels = source.read_reflectance(view, description.size.window())?;
        Ok((view, images_of_texels(&texels, description.lights.len(), description.n_channels())))
    };
    read_ahead::for_each(context, in_flight, 0..description.views.len(), read, |(view, images)| {
        each(view, images)?;
        context.progress.advance(1);
        Ok(())
    })
}

/// Linear samples: halves for 8 bits, which are told apart by them, and for halves; floats for the others.
fn linear(samples: &Samples, transfer: Transfer) -> Samples {
    if transfer == Transfer::Linear && matches!(samples, Samples::F16(_) | Samples::F32(_)) {
        return samples.clone();
    }
    let values = (0..samples.len()).map(|at| transfer.decode(samples.value(at).unwrap_or(0.0)));
    match samples.sample_type() {
        SampleType::U8 | SampleType::F16 => Samples::F16(values.map(half).collect()),
        SampleType::U16 | SampleType::F32 => Samples::F32(values.map(|value| value as f32).collect()),
    }
}
