//! What is judged: an enlarged index, or a part of a model's endless plane.

use std::path::Path;

use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::method::coherent::{Plane, Variation};
use crate::shape::{Area, Size, Window};
use crate::stage::image::{model_of, of_stage, plane_rows};
use crate::store::enlarged::{self, CHUNK_SIDE, Enlarged};
use crate::store::kind_among;
use crate::store::model::{self, Model, Stage};

/// Rows and columns of a plane that are made at once.
const PLANE_SIDE: usize = 512;

/// Seed of the plane, as that of an enlargement by default.
const SEED: u32 = 1;

/// A surface that has clusters, and perhaps sources.
pub(super) enum Subject {
    Enlarged(Box<Enlarged>),
    Plane { plane: Box<Plane>, variation: Variation, index: Vec<u16>, size: Size },
}

/// Clusters of a window, and the tile's texels that its texels are.
pub(super) struct Texels {
    pub(super) index: Vec<u16>,
    pub(super) source: Option<Vec<u32>>,
}

impl Subject {
    /// Opens what lies at a path, and its model.
    pub(super) fn open(path: &Path, model: Option<&Path>, size: Option<Size>) -> Result<(Self, Model)> {
        match (kind_among(path, &[enlarged::KIND, model::KIND])?, size) {
            (enlarged::KIND, None) => {
                let enlarged = Enlarged::open(path)?;
                let model = model_of(&enlarged, path, model)?;
                if !enlarged.is_whole() {
                    return Err(Error::missing(format!("{} is not whole yet", path.display()))
                        .hint("run the command that makes it again; it goes on where it stopped"));
                }
                Ok((Self::Enlarged(Box::new(enlarged)), model))
            }
            (enlarged::KIND, Some(_)) => Err(Error::usage(format!(
                "{} has a size of its own: --size is for a model, whose plane is endless",
                path.display()
            ))),
            (model::KIND, Some(_)) if model.is_some() => Err(Error::usage(format!(
                "{} is a model itself: --model names that of an enlargement",
                path.display()
            ))),
            (model::KIND, Some(size)) => {
                let model = Model::open(path)?;
                let (tile, index) = (model.tile()?, of_stage(&model, Stage::Cluster, Model::index)?);
                let appearance = of_stage(&model, Stage::Appearance, Model::appearance)?;
                let plane = Plane::new(tile.size, &index, &appearance, Kernel::fastest())?;
                let variation = plane.variation(SEED);
                Ok((Self::Plane { plane: Box::new(plane), variation, index, size }, model))
            }
            (model::KIND, None) => Err(Error::usage(format!(
                "{} is a model, whose plane is endless: say how much of it to judge with --size WIDTHxHEIGHT",
                path.display()
            ))),
            (kind, _) => Err(Error::input(format!(
                "{}: got a store of kind {kind}, expected an enlarged index or a model",
                path.display()
            ))),
        }
    }

    pub(super) fn size(&self) -> Size {
        match self {
            Self::Enlarged(enlarged) => enlarged.size(),
            Self::Plane { size, .. } => *size,
        }
    }

    /// Digest of what is judged, beside the model.
    pub(super) fn digest(&self) -> String {
        match self {
            Self::Enlarged(enlarged) => enlarged.digest().to_owned(),
            Self::Plane { .. } => format!("plane of seed {SEED}"),
        }
    }

    pub(super) fn has_source(&self) -> bool {
        match self {
            Self::Enlarged(enlarged) => enlarged.has_source(),
            Self::Plane { .. } => true,
        }
    }

    /// Normals that were kept, of a window.
    pub(super) fn normals(&self, window: Window) -> Result<Option<Vec<[f32; 3]>>> {
        match self {
            Self::Enlarged(enlarged) => enlarged.read_normals(window),
            Self::Plane { .. } => Ok(None),
        }
    }

    /// Rows that are best read together.
    pub(super) fn band_rows(&self) -> usize {
        match self {
            Self::Enlarged(_) => CHUNK_SIDE,
            Self::Plane { .. } => PLANE_SIDE,
        }
    }

    /// A window, checked against the numbers of clusters and of the tile's texels.
    pub(super) fn texels(&self, window: Window, clusters: usize, tile: Size) -> Result<Texels> {
        let (index, source) = match self {
            Self::Enlarged(enlarged) => (enlarged.read(window)?, enlarged.read_source(window)?),
            Self::Plane { plane, variation, index, .. } => {
                let area = Area { y: window.y as i64, x: window.x as i64, size: window.size };
                let source = plane_rows(plane, variation, area)?;
                (source.iter().map(|&texel| index[texel as usize]).collect(), Some(source))
            }
        };
        if let Some(cluster) = index.iter().find(|&&cluster| usize::from(cluster) >= clusters) {
            return Err(Error::input(format!("index: got cluster {cluster}, the model has {clusters}")));
        }
        let beyond = |&&texel: &&u32| texel as usize >= tile.texels();
        if let Some(texel) = source.iter().flatten().find(beyond) {
            return Err(Error::input(format!("source: got texel {texel}, the tile has {}", tile.texels())));
        }
        Ok(Texels { index, source })
    }
}
