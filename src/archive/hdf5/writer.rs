//! Writes a measurement as one HDF5 file, view by view.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use btfkit_formats::{Contents, Direction, SampleType, Samples, f16};
use hdf5::{Dataset, File, H5Type, Hyperslab, Selection, SliceOrIndex};
use ndarray::{ArrayView2, ArrayViewD};
use serde_json::{Map, Value};

use super::attribute;
use super::measurement::{DIRECTIONS, FORMAT, LUMINANCE, RADIOMETRY, REFLECTANCE, TOLD, TRANSFER};
use crate::disk::output::{self, Made};
use crate::disk::temporary::Temporary;
use crate::error::{Error, ErrorKind, Result};
use crate::run::Existing;
use crate::store::measurement::KIND;
use crate::words::counted;

/// Side of a chunk in texels.
const CHUNK_SIDE: usize = 16;

/// Level of deflate: the fastest, as for the store.
const DEFLATE_LEVEL: u8 = 1;

/// The file within its temporary folder.
const FILE: &str = "file.h5";

/// An HDF5 file that is being written. It appears under its name with [`Writer::finish`], whole; dropped before, it
/// leaves nothing.
pub struct Writer {
    path: PathBuf,
    existing: Existing,
    temporary: Temporary,
    file: Option<File>,
    /// [view, y, x, light, channel].
    shape: [usize; 5],
    reflectance: Option<Dataset>,
    luminance: Option<Dataset>,
    /// Views whose samples are written, and those whose L* codes are.
    written: [BTreeSet<usize>; 2],
}

impl Writer {
    /// Begins a file. `attributes` are those of the measurement store beside what `contents` says: `white`, `version`,
    /// `recipe`. Remarks and assumptions of `contents` are not written.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Usage`] for contents without views, lights, channels or texels; [`crate::ErrorKind::Io`]
    /// where nothing can be written, or for an attribute of more than 60 000 bytes.
    pub fn create(path: &Path, contents: &Contents, attributes: &Map<String, Value>) -> Result<Self> {
        let shape = [
            contents.views.len(),
            contents.height as usize,
            contents.width as usize,
            contents.lights.len(),
            contents.channels.len(),
        ];
        if shape.contains(&0) {
            return Err(Error::usage(format!(
                "{}: asked for the shape {shape:?}, expected no extent of 0",
                path.display()
            )));
        }
        // In a folder that is locked, since the C library locks files itself and releases them when it closes them.
        Temporary::sweep_beside(path);
        let temporary = Temporary::folder(path).map_err(|error| Error::io("write", path, error))?;
        // The newer layout of metadata has checksums throughout; the older one has none, and the C library believes it.
        // Without times the same measurement gives the same bytes.
        let builder = File::with_options()
            .with_fapl(|access| access.libver_v110())
            .with_fcpl(|create| create.obj_track_times(false))
            .clone();
        let file =
            builder.create_excl(temporary.path().join(FILE)).map_err(|error| cannot_write(path, &error))?;
        let mut writer = Self {
            path: path.to_owned(),
            existing: Existing::Keep,
            temporary,
            file: Some(file),
            shape,
            reflectance: None,
            luminance: None,
            written: [BTreeSet::new(), BTreeSet::new()],
        };
        writer.begin(contents, attributes).map_err(|error| cannot_write(path, &error))?;
        Ok(writer)
    }

    /// The same, and what to do about a file that has the name when it is finished.
    #[must_use]
    pub fn with_existing(mut self, existing: Existing) -> Self {
        self.existing = existing;
        self
    }

    fn begin(&mut self, contents: &Contents, attributes: &Map<String, Value>) -> hdf5::Result<()> {
        let Some(file) = &self.file else { return Ok(()) };
        let text = |known: [(bool, &str); 2], is| {
            Value::from(known.iter().find(|(known, _)| *known == is).map_or("", |&(_, text)| text))
        };
        attribute::write(file, "kind", &Value::from(KIND))?;
        attribute::write(file, "format", &Value::from(FORMAT))?;
        attribute::write(file, "radiometry", &text(RADIOMETRY, contents.cosine_included))?;
        attribute::write(file, "transfer", &text(TRANSFER, contents.linear))?;
        for (name, value) in attributes.iter().filter(|(name, _)| !TOLD.contains(&name.as_str())) {
            attribute::write(file, name, value)?;
        }
        write_directions(file, 0, &contents.views)?;
        write_directions(file, 1, &contents.lights)?;
        let reflectance = match contents.sample_type {
            SampleType::U8 => self.array::<u8>(REFLECTANCE, &self.shape),
            SampleType::U16 => self.array::<u16>(REFLECTANCE, &self.shape),
            SampleType::F16 => self.array::<f16>(REFLECTANCE, &self.shape),
            SampleType::F32 => self.array::<f32>(REFLECTANCE, &self.shape),
        }?;
        attribute::write_texts(&reflectance, "channels", &contents.channels)?;
        let one = match contents.sample_type {
            SampleType::U8 => "255",
            SampleType::U16 => "65535",
            SampleType::F16 | SampleType::F32 => "1.0",
        };
        let units = format!("reflectance, {one} = 1, through the transfer curve of the group");
        attribute::write(&reflectance, "units", &units.into())?;
        self.reflectance = Some(reflectance);
        Ok(())
    }

    /// A chunked array of [view, y, x, ...].
    fn array<T: H5Type>(&self, name: &str, shape: &[usize]) -> hdf5::Result<Dataset> {
        let file = self.file.as_ref().ok_or("the file is closed")?;
        let chunk: Vec<usize> = shape
            .iter()
            .enumerate()
            .map(|(axis, &extent)| match axis {
                0 => 1,
                1 | 2 => extent.min(CHUNK_SIDE),
                _ => extent,
            })
            .collect();
        let builder = file.new_dataset::<T>().shape(shape.to_vec()).chunk(chunk);
        let dataset =
            builder.obj_track_times(false).shuffle().deflate(DEFLATE_LEVEL).fletcher32().create(name)?;
        let names = ["view", "y", "x", "light", "channel"];
        attribute::write_labels(&dataset, &names[..shape.len()])?;
        Ok(dataset)
    }

    /// Writes one view: samples `[y, x, light, channel]`, and its L* codes `[y, x, light]`, either for all views or for
    /// none.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Internal`] for samples of another type or number than the contents say;
    /// [`crate::ErrorKind::Io`].
    pub fn write_view(&mut self, view: usize, samples: &Samples, luminance: Option<&[u8]>) -> Result<()> {
        let [_, height, width, lights, channels] = self.shape;
        if let Some(codes) = luminance {
            if self.luminance.is_none() {
                self.luminance =
                    Some(self.begin_luminance().map_err(|error| cannot_write(&self.path, &error))?);
            }
            self.write(1, view, codes, &[height, width, lights])?;
        }
        let shape = [height, width, lights, channels];
        match samples {
            Samples::U8(list) => self.write(0, view, list, &shape),
            Samples::U16(list) => self.write(0, view, list, &shape),
            Samples::F16(list) => self.write(0, view, list, &shape),
            Samples::F32(list) => self.write(0, view, list, &shape),
        }
    }

    fn begin_luminance(&self) -> hdf5::Result<Dataset> {
        let dataset = self.array::<u8>(LUMINANCE, &self.shape[..4])?;
        attribute::write(&dataset, "units", &"CIE 1976 L* (D65), code = round(2.55 L*)".into())?;
        Ok(dataset)
    }

    /// Writes a view of the samples (array 0) or the L* codes (1).
    fn write<T: H5Type>(&mut self, array: usize, view: usize, list: &[T], shape: &[usize]) -> Result<()> {
        let dataset = if array == 0 { &self.reflectance } else { &self.luminance };
        let Some(dataset) = dataset else { return Err(Error::internal("no array to write to")) };
        let fits = view < self.shape[0] && list.len() == shape.iter().product::<usize>();
        if !fits || !dataset.dtype().is_ok_and(|kind| kind.is::<T>()) {
            return Err(Error::internal(format!(
                "{}: got {} of {} for view {view}, expected {shape:?} for one of {}",
                self.path.display(),
                counted(list.len(), "sample"),
                counted(size_of::<T>(), "byte"),
                counted(self.shape[0], "view")
            )));
        }
        let whole = shape.iter().map(|&extent| 0..extent);
        let window = std::iter::once(view..view + 1).chain(whole).map(SliceOrIndex::from).collect::<Vec<_>>();
        let shape: Vec<usize> = std::iter::once(1).chain(shape.iter().copied()).collect();
        let samples = ArrayViewD::from_shape(shape, list).map_err(hdf5::Error::from);
        samples
            .and_then(|samples| dataset.write_slice(samples, Selection::from(Hyperslab::from(window))))
            .map_err(|error| cannot_write(&self.path, &error))?;
        self.written[array].insert(view);
        Ok(())
    }

    /// Completes the file and gives it its name.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Internal`] where views are missing; [`crate::ErrorKind::Io`].
    pub fn finish(mut self) -> Result<Made> {
        let counts = [&self.written[0], &self.written[1]].map(BTreeSet::len);
        let views = self.shape[0];
        if counts[0] != views || (counts[1] != 0 && counts[1] != views) {
            return Err(Error::internal(format!(
                "{}: got samples of {} and L* codes of {}, expected {views}",
                self.path.display(),
                counted(counts[0], "view"),
                counts[1]
            )));
        }
        (self.reflectance, self.luminance) = (None, None);
        if let Some(file) = self.file.take() {
            file.flush().and_then(|()| file.close()).map_err(|error| cannot_write(&self.path, &error))?;
        }
        output::put_in_place(&self.temporary.path().join(FILE), &self.path, self.existing)
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        // Closed before the temporary folder is removed.
        (self.reflectance, self.luminance, self.file) = (None, None, None);
    }
}

fn write_directions(file: &File, which: usize, directions: &[Direction]) -> hdf5::Result<()> {
    let angles: Vec<f64> = directions.iter().flat_map(|d| [d.theta_rad, d.phi_rad]).collect();
    let shape = [directions.len(), 2];
    // In a chunk, for the sake of a checksum.
    let dataset = file
        .new_dataset::<f64>()
        .obj_track_times(false)
        .shape(shape)
        .chunk(shape)
        .fletcher32()
        .create(DIRECTIONS[which])?;
    dataset.write(ArrayView2::from_shape((directions.len(), 2), &angles)?)?;
    attribute::write(&dataset, "units", &"rad".into())?;
    attribute::write_texts(&dataset, "angles", &["theta", "phi"])?;
    attribute::write_labels(&dataset, &[["view", "light"][which], "angle"])
}

fn cannot_write(path: &Path, error: &hdf5::Error) -> Error {
    Error::new(ErrorKind::Io, format!("cannot write {}: {error}", path.display()))
}
