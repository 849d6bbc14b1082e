//! The measurement store: the rectified images of one material, arranged texel by texel.
//!
//! | array | shape | type |
//! | --- | --- | --- |
//! | `reflectance` | [view, y, x, light, channel] | u8, u16, f16 or f32, as measured |
//! | `luminance` | [view, y, x, light] | u8, L* code `round(2.55 L*)` |
//! | `view_direction`, `light_direction` | [n, 2] | f64, theta and phi in radians |
//!
//! One shard is one view (of a part of the plane), so a view is the unit of an import.

mod description;
mod read;
mod write;

use std::path::{Path, PathBuf};

use btfkit_formats::{SampleType, Samples};
use serde_json::{Map, Value, json};

use crate::error::{Error, Result};
use crate::run::{Context, recipe};
use crate::shape::{Size, Window};
use crate::store::codec::{Chain, chunk_codecs};
use crate::store::{Array, Layout, Lock, Named, Store};
use crate::views::Views;
use btfkit_formats::Direction;
pub use description::Description;
use description::SHARD_LIMIT_BYTES;
pub(crate) use write::encoded_bytes;

/// The attribute `kind` of a measurement store.
pub const KIND: &str = "measurement";

/// Side of a chunk in texels.
const CHUNK_SIDE: usize = 16;

/// A measurement store, open for reading or writing.
pub struct Measurement {
    store: Store,
    description: Description,
    digest: String,
    /// Side of a shard in texels.
    side: usize,
    codec: Chain,
    reflectance: Array,
    luminance: Array,
    /// Of one that is being written.
    _lock: Option<Lock>,
}

impl Measurement {
    /// Starts a measurement, or goes on with one that the same recipe began.
    ///
    /// # Errors
    /// [`crate::Kind::Recipe`] where another recipe's measurement lies there.
    pub fn create(
        path: &Path,
        description: Description,
        codec: Chain,
        origin: &Origin<'_>,
        context: &Context<'_>,
    ) -> Result<Self> {
        Self::create_in_shards(path, description, codec, origin, SHARD_LIMIT_BYTES, context)
    }

    fn create_in_shards(
        path: &Path,
        description: Description,
        codec: Chain,
        origin: &Origin<'_>,
        limit_bytes: usize,
        context: &Context<'_>,
    ) -> Result<Self> {
        let recipe = origin.recipe;
        let store = Store::at(path);
        let radiometry = "apparent reflectance, cosine of the light angle included";
        let lock = store.begin_by_recipe(
            KIND,
            recipe,
            json!({
                "radiometry": radiometry, "transfer": description.transfer, "white": description.white,
                "assumptions": origin.assumptions, "remarks": origin.remarks,
            }),
            context,
        )?;
        write_directions(&store, "view_direction", "view", &description.views)?;
        write_directions(&store, "light_direction", "light", &description.lights)?;
        let side = description.shard_side(limit_bytes);
        let reflectance = create_reflectance(&store, &description, codec, side)?;
        let luminance = create_luminance(&store, &description, codec, side)?;
        let digest = recipe::digest(recipe);
        Ok(Self { store, description, digest, side, codec, reflectance, luminance, _lock: Some(lock) })
    }

    /// Opens a measurement for reading; its views may be incomplete.
    pub fn open(path: &Path) -> Result<Self> {
        let store = Store::at(path);
        let found = store.expect(KIND)?;
        let reflectance = store.open_array("reflectance")?;
        let luminance = store.open_array("luminance")?;
        let views = read_directions(&store, "view_direction")?;
        let lights = read_directions(&store, "light_direction")?;
        let damaged = |what: String| Error::input(format!("{}: {what}", path.display()));
        let &[n_views, height, width, n_lights, _] = reflectance.shape() else {
            return Err(damaged(format!(
                "reflectance: got shape {:?}, expected 5 dimensions",
                reflectance.shape()
            )));
        };
        let expected = [n_views, height, width, n_lights];
        let consistent = (n_views, n_lights) == (views.len() as u64, lights.len() as u64)
            && luminance.shape() == expected
            && reflectance
                .shape()
                .iter()
                .try_fold(1u64, |product, &n| product.checked_mul(n))
                .is_some_and(|n| n > 0);
        if !consistent {
            return Err(damaged(format!(
                "got reflectance {:?}, luminance {:?}, {} views and {} lights, which do not fit together",
                reflectance.shape(),
                luminance.shape(),
                views.len(),
                lights.len()
            )));
        }
        let transfer = found
            .get("transfer")
            .and_then(|value| serde_json::from_value(value.clone()).ok())
            .ok_or_else(|| damaged("attribute btfkit.transfer: expected srgb or linear".to_owned()))?;
        let white = found.get("white").and_then(Value::as_f64).filter(|white| *white > 0.0);
        let white =
            white.ok_or_else(|| damaged("attribute btfkit.white: expected a reflectance".to_owned()))?;
        let digest = found.get("digest").and_then(Value::as_str).unwrap_or_default().to_owned();
        let names = crate::store::channel_names(&reflectance)
            .map_err(|error| damaged(format!("reflectance: {error}")))?;
        let sample_type = crate::store::sample_type_of(&reflectance)
            .ok_or_else(|| damaged(format!("reflectance: got samples of {}", reflectance.data_type())))?;
        let description = Description {
            size: Size::new(height as usize, width as usize),
            channels: names,
            sample_type,
            views,
            lights,
            transfer,
            white,
        };
        let side = reflectance
            .chunk_shape(&[0; 5])
            .ok()
            .and_then(|shape| shape.get(1).map(|side| side.get() as usize))
            .ok_or_else(|| damaged("reflectance: no shard shape".to_owned()))?;
        let codec = Chain::of(&store.array_codecs("reflectance")?, &description.chunk());
        let codec = codec.ok_or_else(|| damaged("reflectance: its codecs are not ours".to_owned()))?;
        let codes = Chain::of(&store.array_codecs("luminance")?, &description.code_chunk());
        if codes != Some(codec) || !side.is_multiple_of(CHUNK_SIDE) {
            return Err(damaged("luminance: other codecs than those of reflectance".to_owned()));
        }
        Ok(Self { store, description, digest, side, codec, reflectance, luminance, _lock: None })
    }

    /// What it holds.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Digest of the recipe that made it.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// The attributes of its group: how samples are meant, what was assumed, the recipe.
    pub fn attributes(&self) -> Result<Map<String, Value>> {
        self.store.expect(KIND)
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        self.store.path()
    }

    /// Whether all of a view has been written.
    pub fn has_view(&self, view: usize) -> bool {
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
    pub fn chunk_windows(&self) -> impl Iterator<Item = Window> + use<> {
        self.windows(CHUNK_SIDE)
    }

    /// The texels of each row of chunks.
    pub fn chunk_row_windows(&self) -> impl Iterator<Item = Window> + use<> {
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

    fn shards(&self) -> impl Iterator<Item = (u64, u64)> + use<> {
        let Size { height, width } = self.description.size;
        let side = self.side;
        let across = width.div_ceil(side) as u64;
        (0..height.div_ceil(side) as u64).flat_map(move |sy| (0..across).map(move |sx| (sy, sx)))
    }
}

impl Views for Measurement {
    fn description(&self) -> &Description {
        &self.description
    }

    fn read_view(&self, view: usize, window: Window) -> Result<Samples> {
        self.read_reflectance(view, window)
    }
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

/// Where a measurement comes from.
pub struct Origin<'a> {
    /// Everything that its bytes depend on.
    pub recipe: &'a Value,
    /// What had to be assumed because the archive does not say it.
    pub assumptions: &'a [String],
    /// What else the archive says of itself.
    pub remarks: &'a [(String, String)],
}

fn create_reflectance(store: &Store, description: &Description, codec: Chain, side: usize) -> Result<Array> {
    let names = ["view", "y", "x", "light", "channel"];
    let mut layout = sample_layout(description, &names, description.n_channels(), side);
    layout.data_type = crate::store::data_type_of(description.sample_type);
    layout.attributes.insert("channels".to_owned(), json!(description.channels));
    let one = match description.sample_type {
        SampleType::U8 => "255 = 1",
        SampleType::U16 => "65535 = 1",
        SampleType::F16 | SampleType::F32 => "1.0 = 1",
    };
    let units = format!("reflectance, {one}, through the transfer curve of the group");
    layout.attributes.insert("units".to_owned(), json!(units));
    layout.codecs = Some(chunk_codecs(codec, &description.chunk())?);
    store.create_array("reflectance", &layout)
}

fn create_luminance(store: &Store, description: &Description, codec: Chain, side: usize) -> Result<Array> {
    let mut layout = sample_layout(description, &["view", "y", "x", "light"], 1, side);
    layout.shape.pop();
    layout.chunk.pop();
    layout.shard.as_mut().map(Vec::pop);
    layout.attributes.insert("units".to_owned(), json!("CIE 1976 L* (D65), code = round(2.55 L*)"));
    layout.codecs = Some(chunk_codecs(codec, &description.code_chunk())?);
    store.create_array("luminance", &layout)
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

/// Writes directions as [n, 2] theta, phi in radians.
pub(crate) fn write_directions(
    store: &Store,
    name: &str,
    dimension: &str,
    directions: &[Direction],
) -> Result<()> {
    let angles: Vec<f64> = directions.iter().flat_map(|d| [d.theta_rad, d.phi_rad]).collect();
    let names = [dimension, "angle"];
    let mut layout = Layout::small::<f64>(&names, &[directions.len(), 2]);
    layout.attributes.insert("units".to_owned(), json!("rad"));
    layout.attributes.insert("angles".to_owned(), json!(["theta", "phi"]));
    store.write(name, &layout, &angles)
}

/// Reads directions written by [`write_directions`].
pub(crate) fn read_directions(store: &Store, name: &str) -> Result<Vec<Direction>> {
    let (_, angles) = store.read::<f64>(name, &[0, 2])?;
    let in_range = |d: &Direction| (0.0..=1.571).contains(&d.theta_rad) && d.phi_rad.is_finite();
    let directions: Vec<Direction> =
        angles.chunks_exact(2).map(|a| Direction { theta_rad: a[0], phi_rad: a[1] }).collect();
    match directions.iter().position(|d| !in_range(d)) {
        None => Ok(directions),
        Some(at) => Err(Error::input(format!(
            "{}: {name}: direction {at} is theta {} phi {} rad, expected theta in 0..pi/2",
            store.path().display(),
            directions[at].theta_rad,
            directions[at].phi_rad
        ))),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::color::{LightnessCodes, Transfer};
    use crate::random::Hash;
    use crate::store::gather::{Images, images_of_texels};
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
            let recipe = json!({"size": size.to_string()});
            let origin = Origin { recipe: &recipe, assumptions: &[], remarks: &[] };
            let description = description(size, sample_type);
            let measurement = Measurement::create_in_shards(
                folder.path(),
                description.clone(),
                Chain::Stock,
                &origin,
                limit,
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
