//! A material, opened for rendering: its evaluator, its texture, and what there is to say about it.

use serde_json::Value;

use super::Options;
use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::method::coherent::Plane;
use crate::method::value::evaluator::Evaluator;
use crate::method::value::table::ClusterTable;
use crate::render::texture::{Maker, PIECE_BYTES, Pieces, Texture};
use crate::run::Context;
use crate::shape::{Area, Size};
use crate::stage::image::{PlaneOptions, model_of, of_stage};
use crate::store::enlarged::{self, Enlarged};
use crate::store::model::{self, Model, Stage};
use crate::store::recognise::article;
use crate::words::counted;
use crate::zarr::Store;

/// Memory of a texel of a plane while a piece of it is made, with what lies around the piece.
const PLANE_PIECE_BYTES: u64 = 4 * 24 * 512 * 512;

/// A material.
pub(super) struct Material {
    pub(super) evaluator: Evaluator,
    pub(super) texture: Texture,
    /// Size of the texture and whether it repeats; none where it is endless.
    pub(super) bounds: Option<(Size, bool)>,
    pub(super) notes: Vec<String>,
}

/// Opens what is to be shown; `beside` is memory that is taken already.
pub(super) fn open(options: &Options, beside: u64, context: &Context<'_>) -> Result<Material> {
    let path = &options.source;
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
        let (evaluator, notes) = evaluator(&model, beside, context)?;
        let (texture, bounds) = match options.plane {
            Some(which) => (endless(&model, which, context)?, None),
            None => tile(&model, None)?,
        };
        return Ok(Material { evaluator, texture, bounds, notes });
    }
    let enlarged = Enlarged::open(path)?;
    let model = model_of(&enlarged, path, options.model.as_deref())?;
    let (evaluator, mut notes) = evaluator(&model, beside, context)?;
    let missing = enlarged.shards().texels() - enlarged.shards_done();
    if missing > 0 {
        notes.push(format!("{} is not complete: {} missing", path.display(), counted(missing, "shard")));
    }
    let bounds = Some((enlarged.size(), enlarged.recipe().tileable));
    let read: Maker = Box::new(move |area: Area| {
        let window = area.within_first_quadrant().ok_or_else(|| Error::internal("a window below 0"))?;
        enlarged.read(window)
    });
    let texture = Texture::Pieces(Pieces::new(read, bounds, context.work_bytes() / 4));
    Ok(Material { evaluator, texture, bounds, notes })
}

/// The clusters of a model, decoded.
pub(super) fn evaluator(
    model: &Model,
    beside: u64,
    context: &Context<'_>,
) -> Result<(Evaluator, Vec<String>)> {
    let [views, lights] = model.directions()?;
    let [view_triangles, light_triangles] = model.triangles()?;
    let clusters = of_stage(model, Stage::Cluster, Model::clusters)?;
    let bytes = ClusterTable::bytes([clusters, views.len(), lights.len()]);
    let what = format!("the values of {}", counted(clusters, "cluster"));
    context.require(&what, bytes.saturating_add(beside + (32 << 20) + PIECE_BYTES))?;
    let mut table = ClusterTable::new(views.len(), lights.len());
    for part in model.representative_chunks()? {
        context.check_stop()?;
        let representatives = model.representatives_of(part)?;
        table.push(&representatives.samples, &representatives.decoder()?);
    }
    let mut notes = Vec::new();
    if table.not_finite() > 0 {
        notes.push(format!(
            "{} of the model are no finite numbers and count as 0",
            counted(table.not_finite(), "value")
        ));
    }
    for (name, list) in [("view", &views), ("light", &lights)] {
        if list.len() < 3 {
            notes.push(format!(
                "the model has {}: it looks the same from everywhere",
                counted(list.len(), &format!("{name} direction"))
            ));
        }
    }
    Ok((Evaluator::new((&views, &view_triangles), (&lights, &light_triangles), table), notes))
}

/// The tile of a model; `wraps` is asked for, or as it is.
pub(super) fn tile(model: &Model, wraps: Option<bool>) -> Result<(Texture, Option<(Size, bool)>)> {
    let tile = model.tile()?;
    let index = of_stage(model, Stage::Cluster, Model::index)?;
    let (size, wraps) = (tile.size, wraps.unwrap_or(tile.wraps));
    Ok((Texture::Whole { size, wraps, index }, Some((size, wraps))))
}

/// The endless plane of a model.
pub(super) fn endless(model: &Model, which: PlaneOptions, context: &Context<'_>) -> Result<Texture> {
    let size = model.tile()?.size;
    let appearance = of_stage(model, Stage::Appearance, Model::appearance)?;
    let index = of_stage(model, Stage::Cluster, Model::index)?;
    let plane = context.compute(|| Plane::new(size, &index, &appearance, Kernel::fastest()))?;
    let mut variation = plane.variation(which.seed);
    variation.jitter = which.jitter.unwrap_or(variation.jitter);
    plane.check(&variation)?;
    context.require("an endless plane", plane.bytes() + context.threads as u64 * PLANE_PIECE_BYTES)?;
    let make: Maker = Box::new(move |area: Area| {
        let sources = plane.window(&variation, area.y, area.x, area.size)?;
        Ok(sources.into_iter().map(|texel| index[texel as usize]).collect())
    });
    Ok(Texture::Pieces(Pieces::new(make, None, context.work_bytes() / 4)))
}
