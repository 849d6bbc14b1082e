//! The measurement store: the rectified images of one material, arranged texel by texel.
//!
//! | array | shape | type |
//! | --- | --- | --- |
//! | `reflectance` | [view, y, x, light, channel] | u8, as measured |
//! | `luminance` | [view, y, x, light] | u8, L* code `round(2.55 L*)` |
//! | `view_direction`, `light_direction` | [n, 2] | f64, theta and phi in radians |
//!
//! One shard is one view (of a part of the plane), so a view is the unit of an import.

use std::path::Path;

use serde_json::{Map, Value, json};

use crate::color::Transfer;
use crate::error::{Error, Result};
use crate::run::recipe;
use crate::shape::{Size, Window};
use crate::store::{Array, Layout, Store};
use crate::texel::direction::Direction;

/// The attribute `kind` of a measurement store.
pub const KIND: &str = "measurement";

/// Side of a chunk in texels.
const CHUNK_SIDE: usize = 16;

/// Most bytes of samples in one shard.
const SHARD_LIMIT_BYTES: usize = 256 << 20;

/// What a measurement holds: sizes, directions, and how samples are meant.
#[derive(Clone, Debug)]
pub struct Description {
    /// Rows and columns of the rectified images.
    pub size: Size,
    /// Samples of a texel under one pair of directions: 1 or 3 (R, G, B).
    pub channels: usize,
    /// View directions, in the order of the arrays.
    pub views: Vec<Direction>,
    /// Light directions, the same for all views.
    pub lights: Vec<Direction>,
    /// Transfer curve of the samples.
    pub transfer: Transfer,
    /// Reflectance that counts as L* = 100.
    pub white: f64,
}

impl Description {
    /// Samples of a texel under one pair of directions.
    pub fn n_channels(&self) -> usize {
        self.channels
    }

    /// Bytes of one view's samples.
    pub fn view_bytes(&self) -> u64 {
        (self.size.texels() * self.lights.len() * self.channels) as u64
    }

    /// Bytes of all samples.
    pub fn bytes(&self) -> u64 {
        self.view_bytes() * self.views.len() as u64
    }

    /// Bytes of one shard's samples.
    pub fn shard_bytes(&self) -> u64 {
        let side = self.shard_side(SHARD_LIMIT_BYTES);
        (side * side * self.lights.len() * self.channels) as u64
    }

    /// Side of a shard: the whole plane, or as much as keeps a shard within `limit_bytes`.
    fn shard_side(&self, limit_bytes: usize) -> usize {
        let texel_bytes = self.lights.len() * self.channels;
        let affordable = (limit_bytes / texel_bytes.max(1)).isqrt() / CHUNK_SIDE * CHUNK_SIDE;
        let plane = self.size.height.max(self.size.width).next_multiple_of(CHUNK_SIDE);
        plane.min(affordable.max(CHUNK_SIDE))
    }
}

/// A measurement store, open for reading or writing.
pub struct Measurement {
    store: Store,
    description: Description,
    digest: String,
    /// Side of a shard in texels.
    side: usize,
    reflectance: Array,
    luminance: Array,
}

impl Measurement {
    /// Starts a measurement, or goes on with one that the same recipe began.
    ///
    /// # Errors
    /// [`crate::Kind::Recipe`] where another recipe's measurement lies there.
    pub fn create(path: &Path, description: Description, recipe: &Value) -> Result<Self> {
        Self::create_in_shards(path, description, recipe, SHARD_LIMIT_BYTES)
    }

    fn create_in_shards(
        path: &Path,
        description: Description,
        recipe: &Value,
        limit_bytes: usize,
    ) -> Result<Self> {
        let store = Store::at(path);
        let radiometry = "apparent reflectance, cosine of the light angle included";
        store.begin_by_recipe(
            KIND,
            recipe,
            json!({
                "radiometry": radiometry, "transfer": description.transfer, "white": description.white,
            }),
        )?;
        write_directions(&store, "view_direction", "view", &description.views)?;
        write_directions(&store, "light_direction", "light", &description.lights)?;
        let side = description.shard_side(limit_bytes);
        let reflectance = create_reflectance(&store, &description, side)?;
        let luminance = create_luminance(&store, &description, side)?;
        Ok(Self { store, description, digest: recipe::digest(recipe), side, reflectance, luminance })
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
        let &[n_views, height, width, n_lights, channels] = reflectance.shape() else {
            return Err(damaged(format!(
                "reflectance: got shape {:?}, expected 5 dimensions",
                reflectance.shape()
            )));
        };
        let expected = [n_views, height, width, n_lights];
        let consistent = (n_views, n_lights) == (views.len() as u64, lights.len() as u64)
            && luminance.shape() == expected
            && matches!(channels, 1 | 3)
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
        let description = Description {
            size: Size::new(height as usize, width as usize),
            channels: channels as usize,
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
        Ok(Self { store, description, digest, side, reflectance, luminance })
    }

    /// What it holds.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Digest of the recipe that made it.
    pub fn digest(&self) -> &str {
        &self.digest
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

    /// Writes one view: samples [y, x, light, channel] and L* codes [y, x, light].
    pub fn write_view(&self, view: usize, reflectance: Vec<u8>, luminance: Vec<u8>) -> Result<()> {
        let Description { lights, channels, .. } = &self.description;
        self.write_shards(&self.reflectance, view, reflectance, lights.len() * channels)?;
        self.write_shards(&self.luminance, view, luminance, lights.len())
    }

    fn write_shards(&self, array: &Array, view: usize, samples: Vec<u8>, texel_bytes: usize) -> Result<()> {
        let Size { height, width } = self.description.size;
        let side = self.side;
        let index = |sy: u64, sx: u64| {
            let mut index = vec![0; array.dimensionality()];
            (index[0], index[1], index[2]) = (view as u64, sy, sx);
            index
        };
        if (height, width) == (side, side) {
            return self.store.write_chunk(array, &index(0, 0), samples);
        }
        for (sy, sx) in self.shards() {
            let (y0, x0) = (sy as usize * side, sx as usize * side);
            let columns = side.min(width - x0);
            let mut shard = vec![0; side * side * texel_bytes];
            for y in y0..height.min(y0 + side) {
                let from = (y * width + x0) * texel_bytes;
                let to = (y - y0) * side * texel_bytes;
                shard[to..to + columns * texel_bytes]
                    .copy_from_slice(&samples[from..from + columns * texel_bytes]);
            }
            self.store.write_chunk(array, &index(sy, sx), shard)?;
        }
        Ok(())
    }

    fn shards(&self) -> impl Iterator<Item = (u64, u64)> + use<> {
        let Size { height, width } = self.description.size;
        let side = self.side;
        let across = width.div_ceil(side) as u64;
        (0..height.div_ceil(side) as u64).flat_map(move |sy| (0..across).map(move |sx| (sy, sx)))
    }

    /// Samples of a window under one view, [y, x, light, channel].
    pub fn read_reflectance(&self, view: usize, window: Window) -> Result<Vec<u8>> {
        let Description { lights, channels, .. } = &self.description;
        let Window { y, x, size } = window;
        self.store.read_box(
            &self.reflectance,
            &[view as u64, y as u64, x as u64, 0, 0],
            &[1, size.height as u64, size.width as u64, lights.len() as u64, *channels as u64],
        )
    }

    /// L* codes of a window under one view, [y, x, light].
    pub fn read_luminance(&self, view: usize, window: Window) -> Result<Vec<u8>> {
        let Window { y, x, size } = window;
        self.store.read_box(
            &self.luminance,
            &[view as u64, y as u64, x as u64, 0],
            &[1, size.height as u64, size.width as u64, self.description.lights.len() as u64],
        )
    }
}

fn create_reflectance(store: &Store, description: &Description, side: usize) -> Result<Array> {
    let mut layout =
        sample_layout(description, &["view", "y", "x", "light", "channel"], description.channels, side);
    let names: &[&str] = if description.channels == 3 { &["R", "G", "B"] } else { &["Y"] };
    layout.attributes.insert("channels".to_owned(), json!(names));
    layout
        .attributes
        .insert("units".to_owned(), json!("reflectance, 255 = 1, through the transfer curve of the group"));
    store.create_array("reflectance", &layout)
}

fn create_luminance(store: &Store, description: &Description, side: usize) -> Result<Array> {
    let mut layout = sample_layout(description, &["view", "y", "x", "light"], 1, side);
    layout.shape.pop();
    layout.chunk.pop();
    layout.shard.as_mut().map(Vec::pop);
    layout.attributes.insert("units".to_owned(), json!("CIE 1976 L* (D65), code = round(2.55 L*)"));
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
        data_type: <u8 as crate::store::Named>::data_type(),
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
    use crate::random::Hash;

    fn description(size: Size) -> Description {
        let direction = |n: u32| Direction::from_degrees(f64::from(n), 0.0);
        let (views, lights) = ((0..2).map(direction).collect(), (0..5).map(direction).collect());
        Description { size, channels: 3, views, lights, transfer: Transfer::Srgb, white: 1.0 }
    }

    #[test]
    fn planes_in_one_shard_and_in_many_give_back_what_was_written() {
        let hash = Hash::new(1, 0);
        for (size, limit, side) in [
            (Size::new(32, 32), SHARD_LIMIT_BYTES, 32),
            (Size::new(19, 41), SHARD_LIMIT_BYTES, 48),
            (Size::new(37, 50), 16 * 16 * 15, 16),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let recipe = json!({"size": size.to_string()});
            let measurement =
                Measurement::create_in_shards(folder.path(), description(size), &recipe, limit).unwrap();
            assert_eq!(measurement.side, side);
            let bytes = |count: usize, salt: u32| -> Vec<u8> {
                (0..count as u32).map(|n| hash.words(n, salt, 0)[0] as u8).collect()
            };
            let (samples, codes) = (bytes(size.texels() * 15, 0), bytes(size.texels() * 5, 1));
            measurement.write_view(1, samples.clone(), codes.clone()).unwrap();
            let measurement = Measurement::open(folder.path()).unwrap();
            assert!(measurement.has_view(1) && !measurement.has_view(0));
            assert_eq!(measurement.read_reflectance(1, size.window()).unwrap(), samples);
            assert_eq!(measurement.read_luminance(1, size.window()).unwrap(), codes);
            let window = Window { y: 14, x: 13, size: Size::new(5, 19) };
            let rows = (14..19).flat_map(|y| &codes[(y * size.width + 13) * 5..(y * size.width + 32) * 5]);
            assert_eq!(measurement.read_luminance(1, window).unwrap(), rows.copied().collect::<Vec<u8>>());
        }
    }
}
