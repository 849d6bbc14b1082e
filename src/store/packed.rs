//! Packed models, `NAME.btfc`, as they are opened to be looked at, rendered, compared or exported.

use std::ops::Range;
use std::path::{Path, PathBuf};

use btfkit_formats::{Angles, Direction, SampleType, Samples};
use btfkit_packed as packed;

use super::measurement::Description;
use crate::color::Transfer;
use crate::disk::mapped::MappedFile;
use crate::error::{Error, Result};
use crate::method::value::components::Components;
use crate::names::ends_with;
use crate::run::{Context, recipe};
use crate::shape::{Size, Window};
use crate::words::counted;
use crate::zarr::samples_named;

/// Ending of a packed model's name.
pub const ENDING: &str = ".btfc";

/// Names of texts in a packed model.
pub(crate) const SAMPLES: &str = "samples";
pub(crate) const TRANSFER: &str = "transfer";
pub(crate) const MEASUREMENT: &str = "measurement";
pub(crate) const TILE: &str = "tile";
pub(crate) const LICENCE: &str = "licence";
pub(crate) const TEXEL_MM: &str = "texel_mm";

/// Whether a file is a packed model, by its name or its first bytes.
pub fn is_packed(path: &Path) -> bool {
    path.is_file() && (ends_with(path, ENDING) || begins_so(path))
}

fn begins_so(path: &Path) -> bool {
    MappedFile::open(path).is_ok_and(|file| file.as_ref().starts_with(&packed::MAGIC))
}

/// What the packer found, as an error of this program.
pub(crate) fn of_packed(path: &Path, error: &packed::Error) -> Error {
    Error::input(format!("{}: {error}", path.display()))
}

/// A packed model of which nothing is decoded yet.
pub(crate) struct PackedFile {
    path: PathBuf,
    file: Box<dyn AsRef<[u8]> + Send + Sync>,
    pub(crate) outline: packed::Outline,
    /// What the samples of its tile are.
    pub(crate) description: Description,
    /// Digest of its bytes.
    pub(crate) digest: String,
}

impl PackedFile {
    /// Opens one; whoever looks at it, unpacks it or shows it gets the same answer.
    ///
    /// # Errors
    /// A file that is none, or is damaged before its first plane ends; directions that are none, and channels that are
    /// not understood.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let file = MappedFile::open(path).map_err(|error| Error::io("open", path, error))?;
        Self::of(path, file)
    }

    /// Of the bytes of one; `path` stands in errors.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub(crate) fn of(path: &Path, file: impl AsRef<[u8]> + Send + Sync + 'static) -> Result<Self> {
        let bytes = file.as_ref();
        let outline = packed::outline(bytes).map_err(|error| of_packed(path, &error))?;
        let description = description(path, &outline)?;
        let digest = recipe::digest_bytes(bytes);
        Ok(Self { path: path.to_owned(), outline, description, digest, file: Box::new(file) })
    }

    /// Decodes it; the memory for it is there ([`packed::Outline::memory_bytes`]).
    ///
    /// # Errors
    /// Numbers that no values can be made of.
    pub(crate) fn decode(&self) -> Result<packed::Model> {
        let bytes = (*self.file).as_ref();
        let unpacked = packed::unpack(bytes).map_err(|error| of_packed(&self.path, &error))?;
        Ok(unpacked.model)
    }

    /// Decodes it within the memory of a run.
    ///
    /// # Errors
    /// As [`Self::decode`]; too little memory.
    pub(crate) fn model(&self, context: &Context<'_>) -> Result<packed::Model> {
        let what = format!("unpacking {}", counted(self.outline.components(), "component"));
        context.require(&what, self.outline.memory_bytes())?;
        context.compute(|| self.decode())
    }

    /// What there is to say of its end.
    pub(crate) fn notes(&self) -> Vec<String> {
        let (there, all) = (self.outline.planes.len(), self.outline.sections);
        match self.outline.ending {
            packed::Ending::Whole => vec![],
            packed::Ending::Cut(at) => vec![format!(
                "the file was cut: {there} of {all} planes are there, up to byte {at}; it is coarser than it was"
            )],
            packed::Ending::Damaged(at) => vec![format!(
                "the plane that begins at byte {at} is damaged: {there} of {all} planes are read; get the file anew for the rest"
            )],
        }
    }

    /// A text by its name.
    pub(crate) fn text(&self, name: &str) -> Option<&str> {
        text(&self.outline.texts, name)
    }

    /// The type of the measured samples, where it is said.
    pub(crate) fn sample_type(&self) -> Option<SampleType> {
        self.text(SAMPLES).and_then(samples_named)
    }
}

/// A text by its name.
fn text<'a>(texts: &'a [(String, String)], name: &str) -> Option<&'a str> {
    texts.iter().find(|(found, _)| found == name).map(|(_, text)| text.as_str())
}

/// What the samples of a tile are.
fn description(path: &Path, outline: &packed::Outline) -> Result<Description> {
    let [height, width] = outline.size;
    let description = Description {
        size: Size::new(height, width),
        channels: outline.channels.clone(),
        sample_type: text(&outline.texts, SAMPLES).and_then(samples_named).unwrap_or(SampleType::F32),
        views: directions(path, &outline.views)?,
        lights: directions(path, &outline.lights)?,
        transfer: match text(&outline.texts, TRANSFER) {
            Some("linear") => Transfer::Linear,
            _ => Transfer::Srgb,
        },
        white: 1.0,
    };
    description.decoder().map_err(|error| error.context(path.display()))?;
    Ok(description)
}

fn directions(path: &Path, list: &[packed::Direction]) -> Result<Vec<Direction>> {
    let direction = |direction: &packed::Direction| {
        let angles = Angles::new(direction.theta_deg.min(90.0), direction.phi_deg);
        angles.map(Angles::direction).ok_or_else(|| {
            let packed::Direction { theta_deg, phi_deg } = direction;
            Error::input(format!(
                "{}: got the direction theta {theta_deg}, phi {phi_deg}, which is none",
                path.display()
            ))
        })
    };
    list.iter().map(direction).collect()
}

/// A packed model as it is evaluated.
pub(crate) struct Packed {
    pub(crate) components: Components,
    /// What the samples of the tile are.
    pub(crate) description: Description,
    /// Whether the tile's borders join.
    pub(crate) wraps: bool,
    /// Digest of the file.
    pub(crate) digest: String,
    /// Digest of the measurement, where the tile is all of it.
    pub(crate) measurement: Option<String>,
    /// How the digest of the model's tile begins, where the tile is a part of a measurement.
    pub(crate) tile: Option<String>,
    /// What else the file says: names and texts. Of what is exported, HDF5 files keep them.
    #[cfg_attr(not(feature = "hdf5"), allow(dead_code))]
    pub(crate) texts: Vec<(String, String)>,
    /// What is wrong with its end.
    pub(crate) notes: Vec<String>,
    /// Bytes of the file.
    pub(crate) file_bytes: u64,
    /// Memory that it took to open.
    pub(crate) memory_bytes: u64,
}

impl Packed {
    /// Opens one within the memory of a run.
    ///
    /// # Errors
    /// As [`PackedFile::open`] and [`PackedFile::model`].
    pub(crate) fn open(path: &Path, context: &Context<'_>) -> Result<Self> {
        let file = PackedFile::open(path)?;
        let model = file.model(context)?;
        Ok(Self::of(file, model))
    }

    /// The samples of a window of the tile under a view and some lights, [y, x, light, channel].
    pub(crate) fn samples(&self, view: usize, lights: Range<usize>, window: Window) -> Samples {
        let Description { sample_type, transfer, .. } = self.description;
        self.components.samples(view, lights, window, sample_type, transfer)
    }

    /// As it is evaluated, once it is decoded.
    pub(crate) fn of(file: PackedFile, from: packed::Model) -> Self {
        let (notes, memory_bytes) = (file.notes(), file.outline.memory_bytes());
        let [measurement, tile] = [MEASUREMENT, TILE].map(|name| file.text(name).map(str::to_owned));
        let file_bytes = file.outline.bytes as u64;
        let (description, digest) = (file.description, file.digest);
        let list =
            |of: fn(&packed::Component) -> &Vec<f64>| from.components.iter().map(of).collect::<Vec<_>>();
        let components = Components {
            size: description.size,
            brdf: [from.views.len(), from.lights.len()],
            mean: from.mean.iter().map(|&value| value as f32).collect(),
            basis: side_by_side(&list(|part| &part.basis), from.brdf()),
            coefficients: side_by_side(&list(|part| &part.coefficients), from.texels()),
            channels: from.channels,
        };
        let (wraps, texts) = (from.wraps, from.texts);
        Self {
            components,
            description,
            wraps,
            digest,
            measurement,
            tile,
            texts,
            notes,
            file_bytes,
            memory_bytes,
        }
    }
}

/// Values of lists of one length, [place, list].
fn side_by_side(lists: &[&Vec<f64>], length: usize) -> Vec<f32> {
    /// Places that are written together, so that they stay in a cache.
    const TOGETHER: usize = 64;
    let count = lists.len();
    let mut all = vec![0.0; length * count];
    for (piece, to) in all.chunks_mut((TOGETHER * count).max(1)).enumerate() {
        for (number, list) in lists.iter().enumerate() {
            let values = &list[piece * TOGETHER..];
            to.iter_mut().skip(number).step_by(count).zip(values).for_each(|(to, &value)| *to = value as f32);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_lie_side_by_side() {
        for (count, length) in [(0, 5), (1, 1), (3, 200), (7, 64)] {
            let lists: Vec<Vec<f64>> =
                (0..count).map(|k| (0..length).map(|n| (1000 * k + n) as f64).collect()).collect();
            let found = side_by_side(&lists.iter().collect::<Vec<_>>(), length);
            let expected: Vec<f32> =
                (0..length).flat_map(|n| (0..count).map(move |k| (1000 * k + n) as f32)).collect();
            assert_eq!(found, expected);
        }
    }
}
