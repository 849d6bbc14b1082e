//! What a picture is of, read band by band so that memory does not grow with its height.

use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

use super::recipe::SceneRecipe;
use super::{Appearance, mixed};
use crate::color::Decoder;
use crate::error::{Error, ErrorKind, Result};
use crate::method::coherent::{Plane, Variation};
use crate::method::value::evaluator::expect_entries;
use crate::picture::{Meaning, Picture, false_color};
use crate::run::{Context, read_ahead};
use crate::shape::{Area, Size};
use crate::stage::loss::Beyond;
use crate::store::enlarged::{self, Enlarged};
use crate::store::measurement::Measurement;
use crate::words::counted;

/// Rows of a measurement that are decoded together: a row of chunks.
pub(super) const MEASUREMENT_ROWS: usize = 16;

/// Rows and columns of an endless plane that are made at once: what lies around a window is made for nothing.
const PLANE_SIDE: usize = 512;

/// Memory of a texel of a plane while it is made.
const PLANE_TEXEL_BYTES: usize = 24;

/// A plane of pixels that can be read in parts.
pub struct Scene {
    source: Source,
    /// The part that is shown.
    area: Area,
    /// What tells its pixels apart from those of another source.
    recipe: SceneRecipe,
    beyond: Beyond,
    /// What is shown instead of a view or a light that was not measured.
    directions: Vec<String>,
    /// That the store is not complete yet, though what is shown may be.
    incomplete: Option<String>,
}

/// Where pixels come from.
pub(super) enum Source {
    Measurement {
        measurement: Measurement,
        appearance: Appearance,
        decoder: Decoder,
    },
    Tile(Picture),
    /// An enlarged index, by the colours of clusters.
    Clusters {
        enlarged: Enlarged,
        colors: Vec<[f32; 3]>,
    },
    /// An enlarged index, by false colours of clusters.
    Index {
        enlarged: Enlarged,
        colors: Vec<[f32; 3]>,
    },
    Normals(Enlarged),
    /// An enlarged index, by the pixels of the tile's texels.
    Sources {
        enlarged: Enlarged,
        tile: Picture,
    },
    /// An endless plane, by the pixels of the tile's texels.
    Plane {
        plane: Plane,
        variation: Variation,
        tile: Picture,
    },
}

/// Pixels of some rows; looked up row by row, since numbers take less memory.
pub struct Band<'a> {
    width: usize,
    pixels: Pixels<'a>,
}

enum Pixels<'a> {
    Clusters { index: Vec<u16>, colors: &'a [[f32; 3]] },
    Texels { source: Vec<u32>, tile: &'a [[f32; 3]] },
    Own(Vec<[f32; 3]>),
}

impl Source {
    /// What a store that is not complete yet lacks: views of a measurement, shards of an enlarged index.
    pub(super) fn incomplete(&self, path: &Path) -> Option<String> {
        let (done, all, parts) = match self {
            Self::Measurement { measurement, .. } => {
                (measurement.views_done(), measurement.description().views.len(), "views")
            }
            Self::Clusters { enlarged, .. }
            | Self::Index { enlarged, .. }
            | Self::Normals(enlarged)
            | Self::Sources { enlarged, .. } => {
                (enlarged.shards_done(), enlarged.shards().texels(), "shards")
            }
            Self::Tile(_) | Self::Plane { .. } => return None,
        };
        (done < all).then(|| {
            let path = path.display();
            format!(
                "{path} is not complete, {} of {all} {parts} are missing; this shows what is there",
                all - done
            )
        })
    }
}

impl Band<'_> {
    /// The pixels of a row of it.
    pub fn row(&self, row: usize, pixels: &mut [[f32; 3]]) {
        let range = row * self.width..(row + 1) * self.width;
        match &self.pixels {
            Pixels::Own(all) => pixels.copy_from_slice(&all[range]),
            Pixels::Clusters { index, colors } => {
                for (pixel, &cluster) in pixels.iter_mut().zip(&index[range]) {
                    *pixel = colors[usize::from(cluster)];
                }
            }
            Pixels::Texels { source, tile } => {
                for (pixel, &texel) in pixels.iter_mut().zip(&source[range]) {
                    *pixel = tile[texel as usize];
                }
            }
        }
    }
}

impl Scene {
    pub(super) fn new(
        source: Source,
        area: Area,
        recipe: SceneRecipe,
        directions: Vec<String>,
        incomplete: Option<String>,
    ) -> Self {
        Self { source, area, recipe, beyond: Beyond::default(), directions, incomplete }
    }

    /// What a user should know of the picture: what display values do not hold of it, and what its store lacks.
    pub fn notes(&self) -> Vec<String> {
        let told = self.incomplete.iter().chain(&self.directions).cloned();
        told.chain(self.beyond.notes()).collect()
    }

    /// Says of an error that something is missing how much of the store is.
    pub(crate) fn explain(&self, error: Error) -> Error {
        match &self.incomplete {
            Some(told) if error.kind() == ErrorKind::Missing => {
                let told = told.split("; ").next().unwrap_or_default();
                let hint = error.guidance().unwrap_or_default().to_owned();
                Error::missing(format!("{error}: {told}")).hint(hint)
            }
            _ => error,
        }
    }

    /// That the store of the picture is not complete, where it is not.
    pub(crate) fn incomplete(&self) -> Option<&str> {
        self.incomplete.as_deref()
    }

    /// Rows and columns.
    pub fn size(&self) -> Size {
        self.area.size
    }

    /// What of it display values do not hold, as far as it has been read; whoever encodes rows counts them here too.
    pub fn beyond(&self) -> &Beyond {
        &self.beyond
    }

    /// What its values mean.
    pub fn meaning(&self) -> Meaning {
        match &self.source {
            Source::Tile(tile) | Source::Sources { tile, .. } | Source::Plane { tile, .. } => tile.meaning,
            Source::Index { .. } | Source::Normals(_) => Meaning::Display,
            Source::Measurement { .. } | Source::Clusters { .. } => Meaning::Linear,
        }
    }

    /// What tells its pixels apart from those of another source, for a recipe.
    pub fn recipe(&self) -> &SceneRecipe {
        &self.recipe
    }

    /// Multiplies what is shown of light.
    pub(crate) fn expose(&mut self, exposure: f64) {
        let scale = |pixels: &mut [[f32; 3]]| {
            pixels.as_flattened_mut().iter_mut().for_each(|value| *value *= exposure as f32);
        };
        match &mut self.source {
            Source::Tile(tile) | Source::Sources { tile, .. } | Source::Plane { tile, .. } => {
                if tile.meaning == Meaning::Linear {
                    scale(&mut tile.pixels);
                }
            }
            Source::Clusters { colors, .. } => scale(colors),
            Source::Measurement { appearance, .. } => {
                appearance.terms.iter_mut().for_each(|(.., weight)| *weight *= exposure);
            }
            Source::Index { .. } | Source::Normals(_) => {}
        }
    }

    /// Reads some rows, and of what is stored nothing but the chunks that they touch.
    pub fn read(&self, rows: Range<usize>, context: &Context<'_>) -> Result<Band<'_>> {
        let width = self.area.size.width;
        let area =
            Area { y: self.area.y + rows.start as i64, size: Size::new(rows.len(), width), ..self.area };
        if let Source::Plane { plane, variation, tile } = &self.source {
            let source = context.install(|| plane_rows(plane, variation, area))?;
            return Ok(Band { width, pixels: Pixels::Texels { source, tile: &tile.pixels } });
        }
        let window = area.within_first_quadrant().ok_or_else(|| Error::internal("a window below 0"))?;
        let pixels = match &self.source {
            Source::Measurement { measurement, appearance, decoder } => {
                Pixels::Own(mixed(measurement, appearance, decoder, window, &self.beyond, context)?)
            }
            Source::Tile(picture) => Pixels::Own(picture.part(window).pixels),
            Source::Clusters { enlarged, colors } | Source::Index { enlarged, colors } => {
                let index = enlarged.read(window)?;
                expect_entries(&index, colors.len())?;
                Pixels::Clusters { index, colors }
            }
            Source::Sources { enlarged, tile } => {
                let source = enlarged.read_source(window)?.unwrap_or_default();
                if let Some(texel) = source.iter().find(|&&texel| texel as usize >= tile.pixels.len()) {
                    return Err(Error::input(format!(
                        "source: got texel {texel}, the tile has {}",
                        tile.pixels.len()
                    )));
                }
                Pixels::Texels { source, tile: &tile.pixels }
            }
            Source::Normals(enlarged) => {
                let normals = enlarged.read_normals(window)?.unwrap_or_default();
                Pixels::Own(false_color::normals(window.size, &normals).pixels)
            }
            Source::Plane { .. } => return Err(Error::internal("a plane is not stored")),
        };
        Ok(Band { width, pixels })
    }

    /// The bands of whole rows of chunks that the picture is read in, or of parts of them where memory does not hold
    /// more beside so many bytes, and how many of them fit at a time. `what` has these rows.
    ///
    /// # Errors
    /// Where not even a row fits.
    pub(crate) fn bands_in_flight(
        &self,
        what: &str,
        beside: u64,
        context: &Context<'_>,
    ) -> Result<(usize, impl Iterator<Item = Range<usize>> + Send + use<>)> {
        let Size { height, width } = self.area.size;
        let row_bytes = (width * self.texel_bytes()) as u64;
        let sizes = std::iter::successors(Some(self.chunk_rows()), |&rows| (rows > 1).then_some(rows / 2));
        let what = format!("{what} {} wide", counted(width, "pixel"));
        context.memory().require(&what, beside + row_bytes, "show a narrower part by --window")?;
        let allowed_bytes = context.memory_bytes.saturating_sub(beside);
        let fitting = sizes.into_iter().find(|&rows| rows as u64 * row_bytes <= allowed_bytes);
        let rows = fitting.ok_or_else(|| Error::internal("memory for no row"))?;
        let in_flight = read_ahead::in_flight(allowed_bytes, rows as u64 * row_bytes);
        // Rows of chunks begin at row 0 of what is stored.
        let before = self.area.y.rem_euclid(rows as i64) as usize;
        let tops = (0..before + height).step_by(rows);
        let bands = tops.map(move |top| top.saturating_sub(before)..(top + rows - before).min(height));
        Ok((in_flight, bands))
    }

    /// Rows that are decoded together.
    fn chunk_rows(&self) -> usize {
        match &self.source {
            Source::Measurement { .. } => MEASUREMENT_ROWS,
            Source::Plane { .. } => PLANE_SIDE,
            _ => enlarged::CHUNK_SIDE,
        }
    }

    /// Bytes that a texel of a band takes while it is read.
    fn texel_bytes(&self) -> usize {
        const PIXEL: usize = size_of::<[f32; 3]>();
        match &self.source {
            Source::Measurement { measurement, .. } => {
                measurement.description().texel_bytes() + size_of::<[f64; 3]>() + PIXEL
            }
            Source::Tile(_) => PIXEL,
            Source::Clusters { .. } | Source::Index { .. } => size_of::<u8>() + size_of::<u16>(),
            Source::Normals(_) => 3 * PIXEL,
            Source::Sources { .. } => 2 * size_of::<u32>(),
            Source::Plane { .. } => PLANE_TEXEL_BYTES,
        }
    }
}

/// Source texels of some rows of a plane; pieces of them are made on all threads.
pub(crate) fn plane_rows(plane: &Plane, variation: &Variation, area: Area) -> Result<Vec<u32>> {
    let Size { height, width } = area.size;
    let columns: Vec<usize> = (0..width).step_by(PLANE_SIDE).collect();
    let piece = |&left: &usize| {
        let size = Size::new(height, PLANE_SIDE.min(width - left));
        Ok((left, size, plane.window(variation, area.y, area.x + left as i64, size)?))
    };
    let pieces = columns.par_iter().map(piece).collect::<Result<Vec<_>>>()?;
    let mut source = vec![0; height * width];
    for (left, size, piece) in pieces {
        for (row, to) in piece.chunks_exact(size.width).zip(source.chunks_exact_mut(width)) {
            to[left..left + size.width].copy_from_slice(row);
        }
    }
    Ok(source)
}
