//! The values of a tile's texels, however a material keeps them: as clusters, as components, or in a packed file.
//!
//! Pictures, renderings and comparisons open [`TileValues`] and do not ask which. Every texel has an entry, and every
//! entry has values under all measured pairs of directions: an entry is a cluster, or where values are those of
//! components, the texel itself.

use std::borrow::Cow;
use std::path::Path;

use btfkit_formats::{Direction, Samples};
use serde::Serialize;

use super::image::{cluster_colors, of_stage};
use crate::color::Transfer;
use crate::error::{Error, Result};
use crate::method::value::components::{ComponentTable, Components};
use crate::method::value::evaluate::Appearance;
use crate::method::value::evaluator::Evaluator;
use crate::method::value::table::{ClusterTable, Table};
use crate::method::value::triangulation::{Interpolator, triangulate};
use crate::picture::Picture;
use crate::run::Context;
use crate::run::budget::Room;
use crate::shape::Size;
use crate::store::measurement::Description;
use crate::store::model::{Model, Stage};
use crate::store::packed::Packed;
use crate::words::counted;

/// How a model keeps values: it may have both.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum By {
    /// An index into clusters, and what represents each.
    Clusters,
    /// A mean and components.
    Components,
}

impl By {
    /// What a model has, clusters if it has both.
    ///
    /// # Errors
    /// Those of reading the model's attributes.
    pub fn of(model: &Model) -> Result<Self> {
        let only_components = !model.has(Stage::Cluster)? && model.has(Stage::Components)?;
        Ok(if only_components { Self::Components } else { Self::Clusters })
    }

    /// The stage that it comes of.
    pub(crate) fn stage(self) -> Stage {
        match self {
            Self::Clusters => Stage::Cluster,
            Self::Components => Stage::Components,
        }
    }
}

/// Values of a tile.
pub struct TileValues {
    size: Size,
    wraps: bool,
    directions: [Vec<Direction>; 2],
    triangles: [Vec<[u16; 3]>; 2],
    digest: String,
    notes: Vec<String>,
    kept: Kept,
}

enum Kept {
    /// Read in parts, when they are asked for.
    Clusters(Model),
    Components(ComponentTable),
}

impl TileValues {
    /// Those of a model.
    ///
    /// # Errors
    /// A model without them, and too little memory.
    pub fn of_model(model: &Model, by: By, context: &Context<'_>) -> Result<Self> {
        let tile = model.tile_report()?;
        let digest = model.stage_digest(by.stage())?;
        let kept = match by {
            By::Clusters => Kept::Clusters(model.clone()),
            By::Components => of_stage(model, Stage::Components, |model| {
                context.require("the components of a model", model.components_bytes()?)?;
                ComponentTable::new(model.components()?).map(Kept::Components)
            })?,
        };
        Ok(Self {
            size: tile.size(),
            wraps: tile.wraps,
            directions: model.directions()?,
            triangles: model.triangles()?,
            digest,
            notes: vec![],
            kept,
        })
    }

    /// Those of a packed file.
    ///
    /// # Errors
    /// A file that is none, or is damaged before its first plane ends; too little memory.
    pub fn of_packed(path: &Path, context: &Context<'_>) -> Result<Self> {
        Self::of_opened(Packed::open(path, context)?)
    }

    /// The same of one that is open.
    pub(crate) fn of_opened(packed: Packed) -> Result<Self> {
        let directions = [packed.description.views, packed.description.lights];
        Ok(Self {
            size: packed.description.size,
            wraps: packed.wraps,
            triangles: [&directions[0], &directions[1]].map(|list| triangulate(list)),
            directions,
            digest: packed.digest,
            notes: packed.notes,
            kept: Kept::Components(ComponentTable::new(packed.components)?),
        })
    }

    /// Rows and columns of the tile.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Whether the tile's borders join.
    pub fn wraps(&self) -> bool {
        self.wraps
    }

    /// Views and lights.
    pub fn directions(&self) -> [&[Direction]; 2] {
        [&self.directions[0], &self.directions[1]]
    }

    /// How they are kept.
    pub fn by(&self) -> By {
        match self.kept {
            Kept::Clusters(_) => By::Clusters,
            Kept::Components(_) => By::Components,
        }
    }

    /// Digest of what they were read from: a stage of a model, or a file.
    pub(crate) fn digest(&self) -> &str {
        &self.digest
    }

    /// What a user should know of what was read.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Entry of each texel of the tile.
    ///
    /// # Errors
    /// Those of reading the index.
    pub fn entries(&self) -> Result<Vec<u32>> {
        match &self.kept {
            Kept::Clusters(model) => {
                let index = of_stage(model, Stage::Cluster, Model::index)?;
                Ok(index.into_iter().map(u32::from).collect())
            }
            Kept::Components(_) => Ok((0..self.size.texels() as u32).collect()),
        }
    }

    /// Linear RGB of each entry under a light, seen from a view.
    ///
    /// # Errors
    /// Those of reading.
    pub fn colors(&self, view: Direction, light: Direction, context: &Context<'_>) -> Result<Vec<[f32; 3]>> {
        match &self.kept {
            Kept::Clusters(model) => {
                of_stage(model, Stage::Cluster, |model| cluster_colors(model, view, light))
            }
            Kept::Components(table) => {
                let [views, lights] =
                    [0, 1].map(|side| Interpolator::new(&self.directions[side], &self.triangles[side]));
                let appearance = Appearance::new(&views, &lights, view, light);
                Ok(context.install(|| table.colors(&appearance)))
            }
        }
    }

    /// The tile under a light, seen from a view.
    ///
    /// # Errors
    /// As [`Self::colors`] and [`Self::entries`].
    pub fn picture(&self, view: Direction, light: Direction, context: &Context<'_>) -> Result<Picture> {
        let (colors, entries) = (self.colors(view, light, context)?, self.entries()?);
        let color = |&entry: &u32| colors.get(entry as usize).copied();
        let pixels: Option<Vec<[f32; 3]>> = entries.iter().map(color).collect();
        let pixels = pixels.ok_or_else(|| beyond(&entries, colors.len()))?;
        Ok(Picture::linear(self.size, pixels))
    }

    /// Takes the memory that [`Self::into_evaluator`] needs, beside which there must be room for some `spare` bytes.
    ///
    /// # Errors
    /// Too little memory, and those of reading how much there is.
    pub(crate) fn take(&self, spare: u64, room: &mut Room) -> Result<()> {
        let (what, bytes) = match &self.kept {
            Kept::Clusters(model) => {
                let clusters = of_stage(model, Stage::Cluster, Model::clusters)?;
                let [views, lights] = self.directions().map(<[Direction]>::len);
                let what = format!("the values of {}", counted(clusters, "cluster"));
                (what, ClusterTable::bytes([clusters, views, lights]))
            }
            Kept::Components(table) => {
                let Components { mean, basis, coefficients, .. } = table.components();
                let bytes = size_of::<f32>() * (mean.len() + basis.len() + coefficients.len());
                ("the values of components".to_owned(), bytes as u64)
            }
        };
        room.require(&what, bytes.saturating_add(spare))?;
        room.take(&what, bytes)
    }

    /// What gives values of any place, view and light, and what there is to say of it.
    ///
    /// # Errors
    /// Those of reading.
    pub(crate) fn into_evaluator(self, context: &Context<'_>) -> Result<(Evaluator<Table>, Vec<String>)> {
        let mut notes = self.notes;
        let [views, lights] = [0, 1].map(|side| (&self.directions[side][..], &self.triangles[side][..]));
        for (name, (list, _)) in [("view", views), ("light", lights)] {
            if list.len() < 3 {
                notes.push(format!(
                    "the model has {}: it looks the same from everywhere",
                    counted(list.len(), &format!("{name} direction"))
                ));
            }
        }
        let table = match self.kept {
            Kept::Clusters(model) => {
                let table = cluster_table(&model, [views.0.len(), lights.0.len()], context)?;
                if table.not_finite() > 0 {
                    notes.push(format!(
                        "{} of the model are no finite numbers and count as 0",
                        counted(table.not_finite(), "value")
                    ));
                }
                Table::Clusters(table)
            }
            Kept::Components(table) => Table::Components(table),
        };
        Ok((Evaluator::new(views, lights, table), notes))
    }

    /// The samples of all entries, which are compared view by view.
    ///
    /// # Errors
    /// Those of reading.
    pub(crate) fn samples(&self) -> Result<TileSamples<'_>> {
        Ok(match &self.kept {
            Kept::Clusters(model) => {
                let samples = of_stage(model, Stage::Cluster, Model::representatives)?.samples;
                TileSamples::Clusters { entries: self.entries()?, samples }
            }
            Kept::Components(table) => TileSamples::Components(table),
        })
    }
}

/// That an index has more than there are entries.
pub(crate) fn beyond(entries: &[u32], count: usize) -> Error {
    let most = entries.iter().max().copied().unwrap_or(0);
    Error::input(format!("the index refers to entry {most}, beyond the {count} of the model"))
}

/// The clusters of a model, decoded.
fn cluster_table(model: &Model, [views, lights]: [usize; 2], context: &Context<'_>) -> Result<ClusterTable> {
    let mut table = ClusterTable::new(views, lights);
    for part in model.representative_chunks()? {
        context.check_stop()?;
        let representatives = model.representatives_of(part)?;
        table.push(&representatives.samples, &representatives.decoder()?);
    }
    Ok(table)
}

/// The tile's samples as a model has them.
pub(crate) enum TileSamples<'a> {
    Clusters { entries: Vec<u32>, samples: Samples },
    Components(&'a ComponentTable),
}

impl TileSamples<'_> {
    /// Bytes that [`Self::of_view`] makes for a texel.
    pub(crate) fn bytes_of_texel(&self, description: &Description) -> usize {
        match self {
            Self::Clusters { .. } => 0,
            // Samples, and the values that they are rounded from.
            Self::Components(_) => description.texel_bytes() + description.texel_samples() * size_of::<f32>(),
        }
    }

    /// Samples that hold those of all texels under a view, and where each texel's begin.
    pub(crate) fn of_view(&self, view: usize, description: &Description) -> (Cow<'_, Samples>, Vec<usize>) {
        let texel = description.texel_samples();
        match self {
            Self::Clusters { entries, samples } => {
                let start = |&entry: &u32| (entry as usize * description.views.len() + view) * texel;
                (Cow::Borrowed(samples), entries.iter().map(start).collect())
            }
            Self::Components(table) => {
                let (components, transfer): (_, Transfer) = (table.components(), description.transfer);
                let (lights, tile) = (0..description.lights.len(), components.size);
                let samples =
                    components.samples(view, lights, tile.window(), description.sample_type, transfer);
                (Cow::Owned(samples), (0..tile.texels()).map(|number| number * texel).collect())
            }
        }
    }
}
