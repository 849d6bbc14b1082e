//! What the page is given of a model or an enlargement.

use btfkit_formats::Samples;
use serde_json::{Value, json};

use super::Options;
use super::container::Container;
use crate::color::Transfer;
use crate::error::{Error, Result};
use crate::method::coherent::{Appearance, default_jitter};
use crate::run::Context;
use crate::shape::{Area, Size};
use crate::stage::image::{model_of, of_stage};
use crate::store::enlarged::{self, Enlarged};
use crate::store::measurement;
use crate::store::model::{self, Model, Representatives, Stage};
use crate::words::counted;
use crate::zarr::Store;

/// Most values of clusters that a page holds: browsers read no longer text.
const MOST_VALUES: usize = 1 << 26;

/// Longest side of the part of an enlargement that a page holds.
const MOST_SIDE: usize = 1024;

/// Longest side of a tile: what graphics hardware takes at least.
const MOST_TILE_SIDE: usize = 2048;

/// Most clusters, lights and views: the same.
const MOST_DIRECTIONS: usize = 2048;

/// A material, ready to be packed.
pub(super) struct Material {
    pub(super) name: String,
    pub(super) container: Container,
    pub(super) notes: Vec<String>,
}

/// Reads what the page shows.
pub(super) fn read(options: &Options, context: &Context<'_>) -> Result<Material> {
    let path = &options.source;
    let attributes = Store::at(path).expect_one_of(&[measurement::KIND, model::KIND, enlarged::KIND])?;
    let kind = attributes.get("kind").and_then(Value::as_str).unwrap_or_default();
    let mut container = Container::default();
    let mut notes = Vec::new();
    let model = match kind {
        model::KIND => {
            if options.window.is_some() {
                return Err(Error::usage(format!(
                    "{}: a window is a part of an enlargement, got a model",
                    path.display()
                ))
                .hint("leave out --window: the page shows all of a model"));
            }
            Model::open(path)?
        }
        enlarged::KIND => {
            let enlarged = Enlarged::open(path)?;
            let model = model_of(&enlarged, path, options.model.as_deref())?;
            put_enlarged(&mut container, &enlarged, options.window, &mut notes)?;
            model
        }
        _ => {
            return Err(Error::usage(format!(
                "{}: got a measurement, expected a model or an enlargement",
                path.display()
            ))
            .hint(format!("make a model of it first: btf model {} NAME.model.zarr", path.display())));
        }
    };
    let file = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let name = file.trim_end_matches(".zarr").trim_end_matches(".model").to_owned();
    container.say("name", json!(name));
    container.say("version", json!(env!("CARGO_PKG_VERSION")));
    put_tile(&mut container, &model)?;
    put_directions(&mut container, &model)?;
    put_values(&mut container, &model, context)?;
    if model.has(Stage::Appearance)? {
        put_appearance(&mut container, &model.appearance()?);
    } else {
        notes.push(format!(
            "the model has no endless surface; to make it: {}",
            model.how_to_make(Stage::Appearance)
        ));
    }
    Ok(Material { name, container, notes })
}

/// The index of the tile, and its normals where they are known.
fn put_tile(container: &mut Container, model: &Model) -> Result<()> {
    let report = model.tile_report()?;
    let Size { height, width } = report.size();
    if height.max(width) > MOST_TILE_SIDE {
        return Err(Error::usage(format!(
            "{}: got a tile of {}, expected at most {MOST_TILE_SIDE} texels a side",
            model.path().display(),
            report.size()
        ))
        .hint("make a model with a smaller tile: btf model --tile cut"));
    }
    container.say("tile", json!({"height": height, "width": width, "wraps": report.wraps}));
    let index = of_stage(model, Stage::Cluster, Model::index)?;
    put_index(container, "index", Size { height, width }, &index, model.clusters()?);
    if model.has(Stage::Normals)? {
        let code = |value: &f32| ((value + 1.0) / 2.0 * 255.0).round().clamp(0.0, 255.0) as u8;
        let normals = model.normals()?;
        let codes: Vec<u8> = normals.as_flattened().iter().map(code).collect();
        container.put("normals", &[height, width, 3], &codes);
    }
    Ok(())
}

fn put_index(container: &mut Container, name: &str, size: Size, index: &[u16], clusters: usize) {
    let shape = [size.height, size.width];
    if clusters <= model::NARROW {
        let narrow: Vec<u8> = index.iter().map(|&cluster| cluster as u8).collect();
        container.put(name, &shape, &narrow);
    } else {
        container.put(name, &shape, index);
    }
}

fn put_enlarged(
    container: &mut Container,
    enlarged: &Enlarged,
    window: Option<Area>,
    notes: &mut Vec<String>,
) -> Result<()> {
    let size = enlarged.size();
    let shown = Size::new(size.height.min(MOST_SIDE), size.width.min(MOST_SIDE));
    let area = window.unwrap_or(Area { y: 0, x: 0, size: shown });
    let Area { y, x, size: part } = area;
    if part.height.max(part.width) > MOST_SIDE {
        return Err(Error::usage(format!(
            "got a window of {part}, expected at most {MOST_SIDE} texels a side"
        )));
    }
    let window = area.within_first_quadrant().filter(|window| window.fits(size)).ok_or_else(|| {
        Error::usage(format!("window {x},{y},{},{} does not lie within {size}", part.width, part.height))
    })?;
    if part != size {
        notes.push(format!(
            "of {size} texels the page holds {part}, from column {x} and row {y} on; --window chooses another part"
        ));
    }
    let index = enlarged.read(window)?;
    container.say("enlarged", json!({"height": part.height, "width": part.width, "y": y, "x": x}));
    put_index(container, "enlarged_index", part, &index, enlarged.clusters());
    Ok(())
}

/// Unit vectors of views and lights, and the triangles between them.
fn put_directions(container: &mut Container, model: &Model) -> Result<()> {
    let lists = model.directions()?;
    let triangles = model.triangles()?;
    for ((name, list), triangles) in ["view", "light"].into_iter().zip(&lists).zip(&triangles) {
        if list.len() > MOST_DIRECTIONS {
            return Err(Error::usage(format!(
                "{}: got {}, expected at most {MOST_DIRECTIONS}",
                model.path().display(),
                counted(list.len(), name)
            )));
        }
        let vectors: Vec<f64> = list.iter().flat_map(|direction| direction.vector()).collect();
        container.put(&format!("{name}s"), &[list.len(), 3], &vectors);
        container.put(&format!("{name}_triangles"), &[triangles.len(), 3], triangles.as_flattened());
    }
    Ok(())
}

/// Values of the clusters [cluster, view, light, rgb].
fn put_values(container: &mut Container, model: &Model, context: &Context<'_>) -> Result<()> {
    let [views, lights] = model.directions()?.map(|list| list.len());
    let clusters = model.clusters()?;
    let values = clusters.saturating_mul(views).saturating_mul(lights);
    if values > MOST_VALUES {
        return Err(Error::usage(format!(
            "{}: got {clusters} clusters of {views} x {lights} values, expected at most {MOST_VALUES} values in all",
            model.path().display()
        ))
        .hint("make a model with fewer clusters: btf model --clusters 256"));
    }
    context.require("a page of the clusters", values as u64 * 40)?;
    let representatives = of_stage(model, Stage::Cluster, Model::representatives)?;
    let shape = [clusters, views, lights];
    match srgb_codes(&representatives) {
        Some(codes) => {
            container.say("values", json!("srgb8"));
            container.put("representatives", &[clusters, views, lights, 3], &codes);
        }
        None => {
            let decoder = representatives.decoder()?;
            let channels = representatives.shape[3];
            let shared: Vec<u32> = (0..values)
                .map(|at| shared_exponent(decoder.rgb(&representatives.samples, at * channels)))
                .collect();
            container.say("values", json!("rgb9e5"));
            container.put("representatives", &shape, &shared);
        }
    }
    Ok(())
}

/// The samples themselves where they are sRGB codes of red, green and blue, or of one grey channel.
fn srgb_codes(representatives: &Representatives) -> Option<Vec<u8>> {
    let Samples::U8(samples) = &representatives.samples else { return None };
    if representatives.transfer != Transfer::Srgb {
        return None;
    }
    let is_rgb =
        || representatives.channels.iter().zip(["R", "G", "B"]).all(|(a, b)| a.eq_ignore_ascii_case(b));
    match representatives.channels.len() {
        1 => Some(samples.iter().flat_map(|&code| [code; 3]).collect()),
        3 if is_rgb() => Some(samples.clone()),
        _ => None,
    }
}

/// Linear RGB as 9 bits each with one exponent, RGB9_E5 of OpenGL (EXT_texture_shared_exponent).
fn shared_exponent(rgb: [f64; 3]) -> u32 {
    const BIAS: i32 = 15;
    const BITS: i32 = 9;
    /// 511 / 512 * 2^16.
    const LARGEST: f64 = 65408.0;
    let clamped = rgb.map(|value| value.clamp(0.0, LARGEST));
    let largest = clamped.iter().copied().fold(0.0, f64::max);
    let exponent_of = |value: f64| if value > 0.0 { value.log2().floor() as i32 } else { -BIAS - 1 };
    let mut exponent = exponent_of(largest).max(-BIAS - 1) + 1 + BIAS;
    let scaled = |exponent: i32, value: f64| (value / f64::from(exponent - BIAS - BITS).exp2() + 0.5).floor();
    if scaled(exponent, largest) >= 512.0 {
        exponent += 1;
    }
    let [red, green, blue] = clamped.map(|value| scaled(exponent, value) as u32);
    red | green << 9 | blue << 18 | (exponent as u32) << 27
}

/// What the endless plane is made of.
fn put_appearance(container: &mut Container, appearance: &Appearance) {
    let exemplar = appearance.exemplar;
    let levels: Vec<Value> = appearance
        .levels
        .iter()
        .map(|level| {
            json!({"dims": level.dims, "shift": level.shift, "passes": level.passes, "repetition": level.repetition})
        })
        .collect();
    container.say(
        "appearance",
        json!({
            "exemplar": [exemplar.y, exemplar.x, exemplar.size.height, exemplar.size.width],
            "wraps": appearance.wraps, "lattice": appearance.lattice.0, "levels": levels,
            "jitter": default_jitter(&appearance.lattice),
        }),
    );
    let features = appearance.features.as_flattened();
    container.put(
        "features",
        &[appearance.features.len(), features.len() / appearance.features.len().max(1)],
        features,
    );
    for (number, level) in appearance.levels.iter().enumerate() {
        let inputs = level.weights.len() / level.dims;
        container.put(&format!("basis_{number}"), &[inputs, level.dims], &level.weights);
        container.put(&format!("offset_{number}"), &[level.dims], &level.offset);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shared_exponent_keeps_nine_bits() {
        let decoded = |code: u32| {
            let scale = f64::from((code >> 27) as i32 - 24).exp2();
            [code & 511, code >> 9 & 511, code >> 18 & 511].map(|part| f64::from(part) * scale)
        };
        for rgb in [
            [0.0; 3],
            [1.0, 0.5, 0.25],
            [0.999_999, 0.1, 0.0],
            [300.0, 2.0, 0.01],
            [1e-6, 2e-6, 0.0],
            [1e9, -1.0, 5.0],
        ] {
            let largest = rgb.iter().copied().fold(0.0, f64::max).min(65408.0);
            for (got, wanted) in decoded(shared_exponent(rgb)).into_iter().zip(rgb) {
                let off = (got - wanted.clamp(0.0, 65408.0)).abs();
                assert!(off <= largest / 511.0 + 2f64.powi(-24), "{rgb:?}: {got} for {wanted}");
            }
        }
    }
}
