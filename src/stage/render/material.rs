//! A material, opened for rendering: its evaluator, its texture, and what there is to say about it.

use serde_json::Value;

use super::Options;
use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::method::coherent::Plane;
use crate::method::value::evaluator::Evaluator;
use crate::method::value::table::{Table, Values};
use crate::render::texture::{Maker, PIECE_BYTES, Pieces, Texture};
use crate::run::Context;
use crate::run::budget::Room;
use crate::shape::{Area, Size};
use crate::stage::image::{PlaneOptions, model_of, of_stage, without_source};
use crate::stage::pack;
use crate::stage::values::{By, TileValues, beyond};
use crate::store::enlarged::{self, Enlarged};
use crate::store::model::{self, Model, Stage};
use crate::store::recognise::article;
use crate::words::counted;
use crate::zarr::Store;

/// Memory of a texel of a plane while a piece of it is made, with what lies around the piece.
const PLANE_PIECE_BYTES: u64 = 4 * 24 * 512 * 512;

/// Memory of a texel of a tile: its number, where it was cut from, and what is read beside.
const INDEX_BYTES: u64 = 16;

/// Memory beside values while they are read: chunks of a store, and a piece of a texture.
pub(super) const SPARE_BYTES: u64 = (32 << 20) + PIECE_BYTES;

/// A material.
pub struct Material {
    /// Its values under any view and light.
    pub evaluator: Evaluator<Table>,
    /// Which entry of the evaluator each texel is.
    pub texture: Texture,
    /// Size of the texture and whether it repeats; none where it is endless.
    pub bounds: Option<(Size, bool)>,
    /// What a user should know of it, a sentence each.
    pub notes: Vec<String>,
}

/// Opens what is to be shown; what stays in memory is taken of the room.
///
/// # Errors
/// Those of opening the stores, and of memory.
pub fn open(options: &Options, room: &mut Room, context: &Context<'_>) -> Result<Material> {
    let path = &options.source;
    if pack::is_packed(path) {
        return of_packed(options, room, context);
    }
    let attributes = Store::at(path).expect_one_of(&[model::KIND, enlarged::KIND])?;
    let kind = attributes.get("kind").and_then(Value::as_str).unwrap_or_default();
    if kind != model::KIND && options.plane.is_some() {
        return Err(Error::usage(format!(
            "{}: an endless plane is made of a model, got {}",
            path.display(),
            article(kind)
        )));
    }
    if kind == model::KIND {
        let model = Model::open(path)?;
        let (values, mut notes) = values(&model, options.values, room, context)?;
        let (texture, bounds) = match options.plane {
            Some(which) => (endless(&model, &values, which, room, context)?, None),
            None => tile(&values, None, room)?,
        };
        let (evaluator, more) = values.into_evaluator(context)?;
        notes.extend(more);
        return Ok(Material { evaluator, texture, bounds, notes });
    }
    let enlarged = Enlarged::open(path)?;
    let model = model_of(&enlarged, path, options.model.as_deref())?;
    let (values, mut notes) = values(&model, options.values, room, context)?;
    let by_texel = values.by() == By::Components;
    if by_texel && !enlarged.has_source() {
        return Err(without_source(path));
    }
    let missing = enlarged.shards().texels() - enlarged.shards_done();
    if missing > 0 {
        notes.push(format!("{} is not complete: {} missing", path.display(), counted(missing, "shard")));
    }
    let bounds = Some((enlarged.size(), enlarged.recipe().tileable));
    let (evaluator, more) = values.into_evaluator(context)?;
    notes.extend(more);
    let count = evaluator.values().entries();
    let read: Maker = Box::new(move |area: Area| {
        let window = area.within_first_quadrant().ok_or_else(|| Error::internal("a window below 0"))?;
        let entries = match by_texel {
            true => enlarged.read_source(window)?.unwrap_or_default(),
            false => enlarged.read(window)?.into_iter().map(u32::from).collect(),
        };
        expect_within(&entries, count)?;
        Ok(entries)
    });
    let texture = pieces(read, bounds, room);
    Ok(Material { evaluator, texture, bounds, notes })
}

/// The tile of a packed model.
fn of_packed(options: &Options, room: &mut Room, context: &Context<'_>) -> Result<Material> {
    let refused = |what: &str, why: &str| {
        Error::usage(format!("{}: {what}, and this is a packed model: {why}", options.source.display()))
            .hint("leave the option out")
    };
    if options.plane.is_some() {
        return Err(refused("an endless plane is made of a model", "it has its tile only"));
    }
    if options.model.is_some() {
        return Err(refused("--model names the model of an enlargement", "it has its own values"));
    }
    if options.values == Some(By::Clusters) {
        return Err(refused("values of clusters were asked for", "it has components only"));
    }
    let values = TileValues::of_packed(&options.source, context)?;
    values.take(SPARE_BYTES, room)?;
    let (texture, bounds) = tile(&values, None, room)?;
    let (evaluator, notes) = values.into_evaluator(context)?;
    Ok(Material { evaluator, texture, bounds, notes })
}

/// The values of a model that were asked for, or that it has.
fn values(
    model: &Model,
    wanted: Option<By>,
    room: &mut Room,
    context: &Context<'_>,
) -> Result<(TileValues, Vec<String>)> {
    let by = wanted.map_or_else(|| By::of(model), Ok)?;
    let mut notes = Vec::new();
    if wanted.is_none() && by == By::Components {
        notes.push("the model has no clusters: values are those of its components".to_owned());
    }
    let values = TileValues::of_model(model, by, context)?;
    values.take(SPARE_BYTES, room)?;
    Ok((values, notes))
}

/// Checks that all entries of a texture have values.
fn expect_within(entries: &[u32], count: usize) -> Result<()> {
    match entries.iter().all(|&entry| (entry as usize) < count) {
        true => Ok(()),
        false => Err(beyond(entries, count)),
    }
}

/// A texture that is made piece by piece, of which a quarter of what is left is kept.
pub(super) fn pieces(make: Maker, bounds: Option<(Size, bool)>, room: &Room) -> Texture {
    Texture::Pieces(Pieces::new(make, bounds, room.left() / 4))
}

/// The tile of a model; `wraps` is asked for, or as it is.
pub(super) fn tile(
    values: &TileValues,
    wraps: Option<bool>,
    room: &Room,
) -> Result<(Texture, Option<(Size, bool)>)> {
    let (size, wraps) = (values.size(), wraps.unwrap_or(values.wraps()));
    room.require(&format!("a tile of {size}"), INDEX_BYTES * size.texels() as u64)?;
    Ok((Texture::Whole { size, wraps, index: values.entries()? }, Some((size, wraps))))
}

/// The endless plane of a model.
pub(super) fn endless(
    model: &Model,
    values: &TileValues,
    which: PlaneOptions,
    room: &Room,
    context: &Context<'_>,
) -> Result<Texture> {
    let size = model.tile()?.size;
    let appearance = of_stage(model, Stage::Appearance, Model::appearance)?;
    let index = of_stage(model, Stage::Cluster, Model::index)?;
    let plane = context.compute(|| Plane::new(size, &index, &appearance, Kernel::fastest()))?;
    let mut variation = plane.variation(which.seed);
    variation.jitter = which.jitter.unwrap_or(variation.jitter);
    plane.check(&variation)?;
    let mut room = *room;
    room.take("an endless plane", plane.bytes() + context.threads as u64 * PLANE_PIECE_BYTES)?;
    let entries = values.entries()?;
    let make: Maker = Box::new(move |area: Area| {
        let sources = plane.window(&variation, area.y, area.x, area.size)?;
        Ok(sources.into_iter().map(|texel| entries[texel as usize]).collect())
    });
    Ok(pieces(make, None, &room))
}
