//! The measurement store: the rectified images of one material, arranged texel by texel.
//!
//! | array | shape | type |
//! | --- | --- | --- |
//! | `reflectance` | [view, y, x, light, channel] | u8, u16, f16 or f32, as measured |
//! | `luminance` | [view, y, x, light] | u8, L* code `round(2.55 L*)` |
//! | `view_direction`, `light_direction` | [n, 2] | f64, theta and phi in radians |
//! | `view_theta`, `view_phi`, `light_theta`, `light_phi` | [n] | f64, the same in degrees |
//!
//! One shard is one view (of a part of the plane), so a view is the unit of an import.

mod description;
mod facts;
pub(crate) mod gather;
mod read;
mod reading;
mod reading_options;
mod write;

use std::path::{Path, PathBuf};

use btfkit_formats::SampleType;
use serde_json::{Map, Value, json};

use crate::disk::lock::Lock;
use crate::disk::output::expect_outside_stores;
use crate::disk::temporary;
use crate::error::{Error, Result};
use crate::run::Context;
use crate::run::recipe::{self, Recipe};
use crate::shape::{Size, Window};
use crate::store::directions;
use crate::zarr::checksums::DIGITS;
use crate::zarr::codec::{Chain, chunk_codecs};
use crate::zarr::{Array, Layout, Named, Store};
pub use description::Description;
use description::SHARD_LIMIT_BYTES;
pub use facts::ImportRecipe;
use facts::{Facts, RADIOMETRY};
pub use reading::{Adaptation, Reading, Side, Type};
pub(crate) use write::encoded_bytes;

/// The attribute `kind` of a measurement store.
pub const KIND: &str = "measurement";

/// Side of a chunk in texels.
const CHUNK_SIDE: usize = 16;

/// Longest side of a plane.
const MOST_SIDE: usize = 1 << 24;

/// The attribute of a finished measurement that holds the checksums of its shards.
const CHECKSUMS: &str = "checksums";

/// Dimensions of `reflectance`; `luminance` has all but the last.
const REFLECTANCE_AXES: [&str; 5] = ["view", "y", "x", "light", "channel"];

/// A measurement store, open for reading or writing.
pub struct Measurement {
    store: Store,
    description: Description,
    digest: String,
    /// Side of a shard in texels.
    side: usize,
    codec: Chain,
    recipe: ImportRecipe,
    reflectance: Array,
    luminance: Array,
    /// Of one that is being written.
    _lock: Option<Lock>,
}

impl Measurement {
    /// Starts a measurement, or goes on with one that the same recipe began.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Recipe`] where another recipe's measurement lies there.
    pub fn create(
        path: &Path,
        description: Description,
        codec: Chain,
        recipe: ImportRecipe,
        remarks: &[(String, String)],
        context: &Context<'_>,
    ) -> Result<Self> {
        let side = description.shard_side(SHARD_LIMIT_BYTES);
        Self::create_in_shards(path, description, (codec, side), recipe, remarks, context)
    }

    fn create_in_shards(
        path: &Path,
        description: Description,
        (codec, side): (Chain, usize),
        recipe: ImportRecipe,
        remarks: &[(String, String)],
        context: &Context<'_>,
    ) -> Result<Self> {
        let stored = recipe.to_value()?;
        expect_outside_stores(path)?;
        let mut store = Store::at(path);
        let lock = store.begin_by_recipe(
            KIND,
            &stored,
            json!({
                "radiometry": RADIOMETRY, "transfer": description.transfer, "white": description.white,
                "channels": description.channels, "samples": description.sample_type.name(),
                "assumptions": recipe.assumptions, "remarks": remarks,
            }),
            context,
        )?;
        directions::write(&store, "view", &description.views)?;
        directions::write(&store, "light", &description.lights)?;
        let reflectance =
            store.create_array("reflectance", &reflectance_layout(&description, codec, side)?)?;
        let luminance = store.create_array("luminance", &luminance_layout(&description, codec, side)?)?;
        let digest = recipe::digest(&stored);
        Ok(Self {
            store,
            description,
            recipe,
            digest,
            side,
            codec,
            reflectance,
            luminance,
            _lock: Some(lock),
        })
    }

    /// Opens a measurement for reading; its views may be incomplete.
    ///
    /// # Errors
    /// Where attributes or metadata are not those of a measurement, or do not fit together.
    pub fn open(path: &Path) -> Result<Self> {
        let (store, found) = Store::open(path, KIND)?;
        let damaged = |what: String| {
            Error::input(format!("{}: {what}", path.display()))
                .hint("import the archive again, under another name")
        };
        let [n_views, height, width, n_lights, n_channels] = store.claimed_shape("reflectance", 5)?[..]
        else {
            return Err(Error::internal("a shape of five lengths"));
        };
        let facts = Facts::read(&found).map_err(&damaged)?;
        let views = directions::read(&store, "view")?;
        let lights = directions::read(&store, "light")?;
        let sample_type = facts.sample_type(&store)?;
        let channels = facts.channels(&store)?;
        let size = Size::new(height, width);
        let (transfer, white) = (facts.transfer, facts.white);
        let description = Description { size, channels, sample_type, views, lights, transfer, white };
        let shape = [n_views, height, width, n_lights, n_channels];
        if shape != description.shape() || shape.contains(&0) || height.max(width) > MOST_SIDE {
            return Err(damaged(format!(
                "reflectance: got shape {shape:?}, expected {} views, {} lights, {} channels and sides from 1 to \
                 {MOST_SIDE}",
                description.views.len(),
                description.lights.len(),
                description.n_channels()
            )));
        }
        let recipe = facts.recipe(&description).map_err(&damaged)?;
        let document = store.array_document("reflectance")?;
        let side = shard_side_of(&document, &description).ok_or_else(|| {
            damaged(format!(
                "reflectance: got shards that hold no whole chunks of {CHUNK_SIDE} x {CHUNK_SIDE} texels"
            ))
        })?;
        let codecs = document.get("codecs").cloned().unwrap_or_default();
        // Where the codecs are none of ours the layout says so.
        let codec = Chain::of(&codecs, &description.chunk()).unwrap_or(Chain::Stock);
        if Chain::of(&codecs, &description.chunk()).is_some() {
            recipe.check_codec(codec).map_err(&damaged)?;
        }
        let layout = reflectance_layout(&description, codec, side)?;
        let reflectance = store.check_document("reflectance", &layout, &document)?;
        let luminance = store.open_array("luminance", &luminance_layout(&description, codec, side)?)?;
        let digest = facts.digest;
        Ok(Self { store, description, recipe, digest, side, codec, reflectance, luminance, _lock: None })
    }

    /// Declares the measurement finished, if all views are there: its root then holds checksums, and the metadata of
    /// all arrays for other programs.
    ///
    /// # Errors
    /// Those of reading and writing, and where a shard's index is damaged.
    pub fn finish(&self, context: &Context<'_>) -> Result<()> {
        if self.views_done() < self.description.views.len() {
            return Ok(());
        }
        let checksums = json!({
            "reflectance": self.store.checksums(&self.reflectance)?,
            "luminance": self.store.checksums(&self.luminance)?,
        });
        let _lock = self.store.lock("", context)?;
        let mut attributes = self.store.expect(KIND)?;
        attributes.insert(CHECKSUMS.to_owned(), checksums);
        self.store.write_finished(attributes, &self.arrays())
    }

    /// Whether it was declared finished: then its shards have checksums.
    ///
    /// # Errors
    /// Those of reading the attributes.
    pub(crate) fn is_finished(&self) -> Result<bool> {
        Ok(self.store.expect(KIND)?.contains_key(CHECKSUMS))
    }

    /// The array whose shards of a view are not those that were written, though each may be intact; `None` where all
    /// are, or no checksums are kept.
    ///
    /// # Errors
    /// Where a shard is missing, or its index is damaged.
    pub fn exchanged(&self, view: usize) -> Result<Option<SampleArray>> {
        let attributes = self.store.expect(KIND)?;
        let Some(kept) = attributes.get(CHECKSUMS) else { return Ok(None) };
        for (which, array) in
            [(SampleArray::Reflectance, &self.reflectance), (SampleArray::Luminance, &self.luminance)]
        {
            let found = format!("{:08x}", self.store.checksum(array, view as u64)?);
            let kept = kept.get(which.name()).and_then(Value::as_str).unwrap_or_default();
            if kept.get(view * DIGITS..(view + 1) * DIGITS) != Some(found.as_str()) {
                return Ok(Some(which));
            }
        }
        Ok(None)
    }

    /// Checks that the coordinates by which other programs select are the directions.
    ///
    /// # Errors
    /// Where they are not.
    pub(crate) fn check_coordinates(&self) -> Result<()> {
        directions::check_coordinates(&self.store, "view", &self.description.views)?;
        directions::check_coordinates(&self.store, "light", &self.description.lights)
    }

    /// Whether the root holds the metadata of all arrays as they are.
    ///
    /// # Errors
    /// Those of reading.
    pub(crate) fn is_consolidated(&self) -> Result<bool> {
        self.store.is_consolidated(&self.arrays())
    }

    /// Names of its arrays.
    fn arrays(&self) -> Vec<String> {
        let mut names = vec!["reflectance".to_owned(), "luminance".to_owned()];
        names.extend(
            ["view", "light"].iter().flat_map(|dimension| directions::arrays(dimension, self.store.format())),
        );
        names
    }

    /// What it holds.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// How its chunks are packed.
    pub fn codec(&self) -> Chain {
        self.codec
    }

    /// Digest of the recipe that made it.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// By what it was made.
    pub fn recipe(&self) -> &ImportRecipe {
        &self.recipe
    }

    /// The attributes of its group: how samples are meant, what was assumed, the recipe.
    pub fn attributes(&self) -> Result<Map<String, Value>> {
        let mut attributes = self.store.expect(KIND)?;
        // They are of this store's files.
        attributes.remove(CHECKSUMS);
        attributes.remove("seal");
        Ok(attributes)
    }

    /// Version of its layout.
    pub fn format(&self) -> u64 {
        self.store.format()
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        self.store.path()
    }

    /// Whether all of a view has been written.
    pub(crate) fn has_view(&self, view: usize) -> bool {
        self.shards().all(|(sy, sx)| {
            self.store.has_chunk(&self.reflectance, &[view as u64, sy, sx, 0, 0])
                && self.store.has_chunk(&self.luminance, &[view as u64, sy, sx, 0])
        })
    }

    /// Number of views written so far.
    pub fn views_done(&self) -> usize {
        (0..self.description.views.len()).filter(|&view| self.has_view(view)).count()
    }

    /// The texels of each chunk, cut at the border of the plane.
    pub(crate) fn chunk_windows(&self) -> impl Iterator<Item = Window> + use<> {
        self.windows(CHUNK_SIDE)
    }

    /// The texels of each row of chunks.
    pub(crate) fn chunk_row_windows(&self) -> impl Iterator<Item = Window> + use<> {
        self.windows(self.description.size.width)
    }

    fn windows(&self, width: usize) -> impl Iterator<Item = Window> + use<> {
        let plane = self.description.size;
        (0..plane.height).step_by(CHUNK_SIDE).flat_map(move |y| {
            (0..plane.width).step_by(width).map(move |x| Window {
                y,
                x,
                size: Size::new(CHUNK_SIDE.min(plane.height - y), width.min(plane.width - x)),
            })
        })
    }

    /// The file of the shard that a window begins in.
    pub fn shard_path(&self, array: SampleArray, view: usize, window: Window) -> PathBuf {
        let place = [view, window.y / self.side, window.x / self.side, 0, 0].map(|n| n as u64);
        match array {
            SampleArray::Reflectance => self.store.chunk_path(&self.reflectance, &place),
            SampleArray::Luminance => self.store.chunk_path(&self.luminance, &place[..4]),
        }
    }

    /// Whether something that is no file has the name of a shard of a view.
    pub(crate) fn obstructed(&self, view: usize) -> bool {
        let arrays = [SampleArray::Reflectance, SampleArray::Luminance];
        let origin = Window { y: 0, x: 0, size: Size { height: 1, width: 1 } };
        arrays.iter().any(|&array| {
            let depth = if array == SampleArray::Reflectance { 4 } else { 3 };
            let first = self.shard_path(array, view, origin);
            first.ancestors().nth(depth).is_some_and(|folder| holds_what_is_no_file(folder, depth))
        })
    }

    fn shards(&self) -> impl Iterator<Item = (u64, u64)> + use<> {
        let Size { height, width } = self.description.size;
        let side = self.side;
        let across = width.div_ceil(side) as u64;
        (0..height.div_ceil(side) as u64).flat_map(move |sy| (0..across).map(move |sx| (sy, sx)))
    }
}

/// Whether anything but a file lies `depth` folders below a folder. Only what is there is looked at: a store may claim
/// more shards than can be counted.
fn holds_what_is_no_file(folder: &Path, depth: usize) -> bool {
    std::fs::read_dir(folder).into_iter().flatten().flatten().any(|entry| {
        let path = entry.path();
        match depth {
            0 | 1 => !temporary::is_temporary(&path) && !path.is_file(),
            _ => path.is_dir() && holds_what_is_no_file(&path, depth - 1),
        }
    })
}

/// The two arrays of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleArray {
    /// Samples as measured.
    Reflectance,
    /// L* codes.
    Luminance,
}

impl SampleArray {
    /// Name in the store.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reflectance => "reflectance",
            Self::Luminance => "luminance",
        }
    }
}

fn reflectance_layout(description: &Description, codec: Chain, side: usize) -> Result<Layout<'static>> {
    let mut layout = sample_layout(description, &REFLECTANCE_AXES, description.n_channels(), side);
    layout.data_type = crate::zarr::data_type_of(description.sample_type);
    layout.attributes.insert("channels".to_owned(), json!(description.channels));
    let one = match description.sample_type {
        SampleType::U8 => "255 = 1",
        SampleType::U16 => "65535 = 1",
        SampleType::F16 | SampleType::F32 => "1.0 = 1",
    };
    let units = format!("reflectance, {one}, through the transfer curve of the group");
    layout.attributes.insert("units".to_owned(), json!(units));
    layout.codecs = Some(chunk_codecs(codec, &description.chunk())?);
    Ok(layout)
}

fn luminance_layout(description: &Description, codec: Chain, side: usize) -> Result<Layout<'static>> {
    let mut layout = sample_layout(description, &REFLECTANCE_AXES[..4], 1, side);
    layout.shape.pop();
    layout.chunk.pop();
    layout.shard.as_mut().map(Vec::pop);
    layout.attributes.insert("units".to_owned(), json!("CIE 1976 L* (D65), code = round(2.55 L*)"));
    layout.codecs = Some(chunk_codecs(codec, &description.code_chunk())?);
    Ok(layout)
}

/// Side of the shards that a document claims: whole chunks, and no more than a shard may hold, nor much more than the
/// plane.
fn shard_side_of(document: &Map<String, Value>, description: &Description) -> Option<usize> {
    let shape = document.get("chunk_grid")?.get("configuration")?.get("chunk_shape")?;
    let side = usize::try_from(shape.get(1)?.as_u64()?).ok()?;
    let most = description.shard_side(SHARD_LIMIT_BYTES);
    ((CHUNK_SIDE..=most).contains(&side) && side.is_multiple_of(CHUNK_SIDE)).then_some(side)
}

/// The layout of `reflectance`: [view, y, x, light, channel] in shards of one view.
fn sample_layout<'a>(
    description: &Description,
    names: &'a [&'a str],
    channels: usize,
    side: usize,
) -> Layout<'a> {
    let Size { height, width } = description.size;
    let (lights, channels) = (description.lights.len() as u64, channels as u64);
    let side = side as u64;
    Layout {
        shape: vec![description.views.len() as u64, height as u64, width as u64, lights, channels],
        chunk: vec![1, CHUNK_SIDE as u64, CHUNK_SIDE as u64, lights, channels],
        shard: Some(vec![1, side, side, lights, channels]),
        data_type: u8::data_type(),
        codecs: None,
        names,
        attributes: Map::new(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::gather::{Images, images_of_texels};
    use btfkit_formats::Samples;

    use super::*;
    use crate::color::{LightnessCodes, Transfer};
    use crate::random::Hash;
    use btfkit_formats::Direction;
    use btfkit_formats::f16;

    fn description(size: Size, sample_type: SampleType) -> Description {
        let direction = |n: u32| Direction::from_degrees(f64::from(n), 0.0);
        let (views, lights) = ((0..2).map(direction).collect(), (0..5).map(direction).collect());
        let channels = ["R", "G", "B"].map(str::to_owned).to_vec();
        Description { size, channels, sample_type, views, lights, transfer: Transfer::Srgb, white: 1.0 }
    }

    fn noise(sample_type: SampleType, count: usize) -> Samples {
        let hash = Hash::new(1, 0);
        let numbers = (0..count as u32).map(|n| hash.words(n, 0, 0)[0]);
        match sample_type {
            SampleType::U8 => Samples::U8(numbers.map(|n| n as u8).collect()),
            SampleType::U16 => Samples::U16(numbers.map(|n| n as u16).collect()),
            SampleType::F16 => Samples::F16(numbers.map(|n| f16::from_bits(n as u16 >> 2)).collect()),
            SampleType::F32 => Samples::F32(numbers.map(|n| n as f32 / 4e9).collect()),
        }
    }

    #[test]
    fn planes_in_one_shard_and_in_many_give_back_what_was_written() {
        for (size, limit, side, sample_type) in [
            (Size::new(32, 32), SHARD_LIMIT_BYTES, 32, SampleType::U8),
            (Size::new(19, 41), SHARD_LIMIT_BYTES, 48, SampleType::F16),
            (Size::new(37, 50), 16 * 16 * 15 * 2, 16, SampleType::U16),
            (Size::new(37, 50), 16 * 16 * 15 * 4, 16, SampleType::F32),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let stop = std::sync::atomic::AtomicBool::new(false);
            let context = Context::new(&crate::run::progress::Silent, &stop, 1, 1 << 30).unwrap();
            let description = description(size, sample_type);
            let recipe = ImportRecipe::of(&description, Chain::Stock);
            let measurement = Measurement::create_in_shards(
                folder.path(),
                description.clone(),
                (Chain::Stock, description.shard_side(limit)),
                recipe,
                &[],
                &context,
            )
            .unwrap();
            assert_eq!(measurement.side, side);
            let images = noise(sample_type, size.texels() * 15);
            let codes = LightnessCodes::new(Transfer::Srgb, sample_type, &description.channels, 1.0).unwrap();
            let groups = vec![(0..5, images.clone())];
            let view = Images::new(size, 3, sample_type, groups).unwrap();
            measurement.write_view(1, &view, &codes).unwrap();
            let measurement = Measurement::open(folder.path()).unwrap();
            assert!(measurement.has_view(1) && !measurement.has_view(0));
            let texels = measurement.read_reflectance(1, size.window()).unwrap();
            assert_eq!(images_of_texels(&texels, 5, 3), images);
            let mut expected = vec![0; size.texels() * 5];
            codes.fill(&texels, &mut expected);
            assert_eq!(measurement.read_luminance(1, size.window()).unwrap(), expected);
            let window = Window { y: 14, x: 13, size: Size::new(5, 19) };
            let rows = (14..19).flat_map(|y| &expected[(y * size.width + 13) * 5..(y * size.width + 32) * 5]);
            assert_eq!(measurement.read_luminance(1, window).unwrap(), rows.copied().collect::<Vec<u8>>());
        }
    }
}
