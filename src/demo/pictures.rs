//! The pictures of the page, each made from the finished stages when it is asked for.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use btfkit_formats::jpeg::{Chroma, EncodeOptions, encode};

use super::second_tile::{SecondTile, second_tile, stands_at};
use crate::disk::temporary::write_file;
use crate::error::{Error, Result};
use crate::method::tile::{Cut, Features, Tile, cut};
use crate::picture::{Picture, false_color};
use crate::run::Context;
use crate::shape::{Size, Window};
use crate::stage::image::{cluster_colors, look_up, of_measured_tile, of_measurement};
use crate::stage::tile::features;
use crate::store::enlarged::Enlarged;
use crate::store::measurement::Measurement;
use crate::store::model::Model;
use btfkit_formats::Direction;

/// Pictures with a side above this are embedded as JPEG, smaller ones as PNG.
const PNG_SIDE: usize = 512;

/// Quality of the embedded JPEGs: 1024 x 1024 of fine grain in some 400 KiB.
const JPEG: EncodeOptions = EncodeOptions { quality: 88, progressive: false, chroma: Chroma::Half };

/// How often a tile is repeated each way to show its seams.
const REPEATS: usize = 3;

/// Factor on the difference between measurement and model.
pub(super) const DIFFERENCE_GAIN: f32 = 4.0;

/// A view and a light, (theta, phi) in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lit {
    pub(super) view: (f64, f64),
    pub(super) light: (f64, f64),
}

impl Lit {
    /// Seen from the normal, lit almost from there: colour and relief both show.
    pub(super) const REFERENCE: Self = Self { view: (0.0, 0.0), light: (15.0, 0.0) };

    fn directions(self) -> [Direction; 2] {
        [self.view, self.light].map(|(theta, phi)| Direction::from_degrees(theta, phi))
    }
}

/// What a picture shows; where no light is named, the light and view of [`Lit::REFERENCE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Subject {
    /// The whole measurement.
    Measured(Lit),
    /// The measured texels of the tile.
    Tile,
    /// The tile with the texels from beyond its borders tinted.
    Seams,
    /// The patch repeated as it is.
    PatchRepeated,
    /// The tile repeated.
    TileRepeated,
    /// The tile's clusters in false colours, from dark to light ones.
    Clusters,
    /// The tile by the model.
    Modelled,
    /// Model less measurement.
    Difference,
    /// Normal map of the tile.
    Normals,
    /// Synthesised normal map, its first texels to the extent of the tile.
    SynthesisedNormals,
    /// The second tile.
    SecondTile,
    /// The second tile with the texels of its own interior tinted.
    SecondTileInside,
    /// The tile repeated over the size of the enlarged picture.
    OneTile,
    /// Both tiles, placed by chance.
    TwoTiles,
    /// The enlarged index by the model.
    Enlarged(Lit),
    /// The index enlarged by the paper's rule, by the model.
    ByPaper,
}

impl Subject {
    /// The enlarged picture that is compared.
    pub(super) const ENLARGED: Self = Self::Enlarged(Lit::REFERENCE);
}

/// The finished stages, opened, with what the pictures share.
pub(super) struct Workshop {
    pub(super) measurement: Measurement,
    pub(super) model: Model,
    pub(super) enlarged: Enlarged,
    pub(super) by_paper: Enlarged,
    pub(super) features: Features,
    pub(super) cut: Cut,
    pub(super) second_tile: SecondTile,
    pub(super) tile_index: Vec<u16>,
    pub(super) enlarged_index: Vec<u16>,
    pub(super) index_by_paper: Vec<u16>,
    seed: u64,
}

impl Workshop {
    /// Opens the stores and cuts the second tile.
    pub(super) fn open(
        [measurement, model, enlarged, by_paper]: [&Path; 4],
        seed: u64,
        context: &Context<'_>,
    ) -> Result<Self> {
        let (measurement, model) = (Measurement::open(measurement)?, Model::open(model)?);
        let (enlarged, by_paper) = (Enlarged::open(enlarged)?, Enlarged::open(by_paper)?);
        let report = model.tile_report()?;
        let patch = report
            .patch
            .ok_or_else(|| Error::internal(format!("{} has no cut tile", model.path().display())))?;
        let features = features(&measurement, context)?;
        let (cut, second_tile) = context.install(|| {
            let first = cut(&features, patch);
            let second = second_tile(&features, &first, seed);
            (first, second)
        });
        let tile_index = model.index()?;
        let enlarged_index = enlarged.read(enlarged.size().window())?;
        let index_by_paper = by_paper.read(by_paper.size().window())?;
        Ok(Self {
            measurement,
            model,
            enlarged,
            by_paper,
            features,
            cut,
            second_tile,
            tile_index,
            enlarged_index,
            index_by_paper,
            seed,
        })
    }

    /// Raw bytes of a texel under all pairs of directions.
    pub(super) fn texel_bytes(&self) -> u64 {
        let description = self.measurement.description();
        description.bytes() / description.size.texels().max(1) as u64
    }

    /// Synthesised normals of the whole plane.
    pub(super) fn synthesised_normals(&self) -> Result<Vec<[f32; 3]>> {
        self.normals_of(self.by_paper.size().window())
    }

    fn normals_of(&self, window: Window) -> Result<Vec<[f32; 3]>> {
        let normals = self.by_paper.read_normals(window)?;
        normals.ok_or_else(|| Error::internal("the enlarged index was made without its normals"))
    }

    /// Makes a picture.
    pub(super) fn picture(&self, subject: Subject, context: &Context<'_>) -> Result<Picture> {
        let tile = &self.cut.tile;
        let measured = |tile: &Tile| self.measured(tile, Lit::REFERENCE, context);
        let repeats = Size::new(REPEATS * tile.size.height, REPEATS * tile.size.width);
        let plane = self.enlarged.size();
        Ok(match subject {
            Subject::Measured(lit) => {
                let [view, light] = lit.directions();
                let window = self.measurement.description().size.window();
                of_measurement(&self.measurement, view, light, window, context)?
            }
            Subject::Tile => measured(tile)?,
            Subject::Seams => false_color::seams(&measured(tile)?, &self.cut.beyond),
            Subject::PatchRepeated => measured(&self.cut.patch.uncut())?.repeated(repeats),
            Subject::TileRepeated => measured(tile)?.repeated(repeats),
            Subject::Clusters => {
                let [view, light] = Lit::REFERENCE.directions();
                let colors = false_color::by_lightness(&cluster_colors(&self.model, view, light)?);
                Picture::display(tile.size, look_up(tile.size, &self.tile_index, &colors)?.pixels)
            }
            Subject::Modelled => self.modelled(tile.size, &self.tile_index, Lit::REFERENCE)?,
            Subject::Difference => {
                let modelled = self.modelled(tile.size, &self.tile_index, Lit::REFERENCE)?;
                false_color::difference(&measured(tile)?, &modelled, DIFFERENCE_GAIN)
            }
            Subject::Normals => false_color::normals(tile.size, &self.model.normals()?),
            Subject::SynthesisedNormals => {
                let size = Size::new(tile.size.height.min(plane.height), tile.size.width.min(plane.width));
                false_color::normals(size, &self.normals_of(size.window())?)
            }
            Subject::SecondTile => measured(&self.second_tile.tile)?,
            Subject::SecondTileInside => {
                let tinted: Vec<u8> =
                    self.second_tile.inside.iter().map(|&inside| u8::from(inside)).collect();
                false_color::seams(&measured(&self.second_tile.tile)?, &tinted)
            }
            Subject::OneTile => measured(tile)?.repeated(plane),
            Subject::TwoTiles => {
                let tiles = [measured(tile)?, measured(&self.second_tile.tile)?];
                laid(&tiles, plane, |row, column| stands_at(self.seed, row, column))
            }
            Subject::Enlarged(lit) => self.modelled(plane, &self.enlarged_index, lit)?,
            Subject::ByPaper => self.modelled(plane, &self.index_by_paper, Lit::REFERENCE)?,
        })
    }

    /// Measured samples of the texels of a tile.
    fn measured(&self, tile: &Tile, lit: Lit, context: &Context<'_>) -> Result<Picture> {
        let [view, light] = lit.directions();
        of_measured_tile(&self.measurement, tile, view, light, context)
    }

    /// Values of the model, equation (27) of the paper.
    fn modelled(&self, size: Size, index: &[u16], lit: Lit) -> Result<Picture> {
        let [view, light] = lit.directions();
        look_up(size, index, &cluster_colors(&self.model, view, light)?)
    }
}

/// A plane laid with the first of two pictures of one size, or the second where `second` says so.
fn laid(pictures: &[Picture; 2], plane: Size, second: impl Fn(usize, usize) -> bool) -> Picture {
    let Size { height, width } = pictures[0].size;
    let columns = plane.width.div_ceil(width);
    let choice: Vec<bool> = (0..plane.height.div_ceil(height))
        .flat_map(|row| (0..columns).map(move |column| (row, column)))
        .map(|(row, column)| second(row, column))
        .collect();
    let pixel = |n: usize| {
        let (y, x) = (n / plane.width, n % plane.width);
        let picture = &pictures[usize::from(choice[y / height * columns + x / width])];
        picture.pixels[y % height * width + x % width]
    };
    let pixels = (0..plane.texels()).map(pixel).collect();
    Picture { size: plane, pixels, meaning: pictures[0].meaning }
}

/// A picture as the page holds it.
pub(super) struct Embedded {
    /// Its bytes as a data address.
    pub(super) address: String,
    pub(super) size: Size,
}

/// Writes a picture to `path` as PNG and encodes it for the page.
pub(super) fn write_and_embed(picture: &Picture, path: &Path) -> Result<Embedded> {
    let picture = picture.as_display();
    let Size { height, width } = picture.size;
    let png = picture.png()?;
    write_file(path, &png)?;
    let (kind, bytes) = if height.max(width) > PNG_SIDE {
        ("jpeg", encode(&picture.bytes(), width as u32, height as u32, 3, &JPEG)?)
    } else {
        ("png", png)
    };
    Ok(Embedded {
        address: format!("data:image/{kind};base64,{}", STANDARD.encode(bytes)),
        size: picture.size,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_plane_is_laid_with_the_tile_of_each_place() {
        let tile = |level: f32| {
            let size = Size::new(2, 3);
            Picture::display(size, (0..6).map(|n| [level, n as f32, 0.0]).collect())
        };
        let plane = laid(&[tile(0.0), tile(1.0)], Size::new(5, 7), |row, column| row == 1 && column == 2);
        for (n, pixel) in plane.pixels.iter().enumerate() {
            let (y, x) = (n / 7, n % 7);
            let second = y / 2 == 1 && x / 3 == 2;
            assert_eq!(*pixel, [f32::from(u8::from(second)), ((y % 2) * 3 + x % 3) as f32, 0.0]);
        }
    }

    #[test]
    fn large_pictures_are_embedded_as_jpeg_and_kept_as_png() {
        let folder = tempfile::tempdir().unwrap();
        for (side, kind, magic) in [(8, "png", "iVBORw0KGgo"), (520, "jpeg", "/9j/")] {
            let path = folder.path().join("picture.png");
            let picture = Picture::display(Size::new(side, 4), vec![[0.25, 0.5, 1.0]; side * 4]);
            let embedded = write_and_embed(&picture, &path).unwrap();
            assert!(embedded.address.starts_with(&format!("data:image/{kind};base64,{magic}")));
            assert_eq!(&std::fs::read(&path).unwrap()[1..4], b"PNG");
        }
    }
}
