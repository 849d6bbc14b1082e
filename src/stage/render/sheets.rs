//! Ways to cover an object with a material, side by side: the tile again and again, two tiles that join each other, the
//! paper's rule with a 2D and a 3D random field, and the endless plane of the coherent rule (figures 10 and 11 of the
//! paper).

use std::path::Path;

use rayon::prelude::*;

use super::{Options, Report, beyond_note, lights, material, objects};
use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::method::baseline::{Exemplar, Tiles};
use crate::method::field::marginals::Matching;
use crate::method::field::{self, Boundary, CarKind, Coordinates, Extent, Gains, Surface, Synthesis};
use crate::method::index::nearest::NearestNormals;
use crate::method::index::scan::{Neighbours, Scan};
use crate::method::value::evaluator::Evaluator;
use crate::method::value::table::Table;
use crate::picture::drawing::Canvas;
use crate::picture::{Encoding, Picture};
use crate::render::camera::Camera;
use crate::render::surface::Surface as Object;
use crate::render::texture::{Maker, Texture};
use crate::render::{Background, Scene};
use crate::run::Context;
use crate::run::budget::Room;
use crate::run::progress::Counted;
use crate::shape::{Area, Size};
use crate::stage::fit;
use crate::stage::image::{PlaneOptions, of_stage};
use crate::stage::values::{By, TileValues};
use crate::store::model::{Model, Stage};

/// Panels beside each other.
const COLUMNS: usize = 3;

/// Pixels around panels.
const MARGIN: usize = 12;

/// Height of a line of text.
const LINE: usize = 16;

/// Candidates of the paper's rule.
const CANDIDATES: usize = 16;

/// Side of the planes that the paper's rule makes: what the objects have of texture at scale 1.
const PAPER_SIDE: f64 = 1024.0;

/// Seed of all that is drawn.
const SEED: u64 = 1;

/// What is opened once for all panels.
struct Subject<'a> {
    model: Model,
    values: TileValues,
    evaluator: Evaluator<Table>,
    options: &'a Options,
    room: Room,
    context: &'a Context<'a>,
}

/// Shows the material on the object by each way, on one sheet with labels; a way that the model has nothing for is left
/// out, and a note says why.
///
/// # Errors
/// As [`super::run`], and where no way is possible.
pub fn compare(
    options: &Options,
    output: &Path,
    encoding: Encoding,
    context: &Context<'_>,
) -> Result<Report> {
    let Size { height, width } = options.size;
    let rows = 2;
    let sheet = Size::new(rows * (height + LINE + MARGIN) + MARGIN, COLUMNS * (width + MARGIN) + MARGIN);
    encoding.check_size(sheet)?;
    let pixels = (sheet.texels() as u64) * super::PIXEL_BYTES + encoding.memory_bytes(sheet);
    let mut room = Room::new(context.memory());
    room.take(&format!("a sheet of {sheet}"), pixels)?;
    let surface = objects::surface(options, &mut room, context)?;
    let (lights, _) = lights(options, &surface, &mut room)?;
    let model = Model::open(&options.source)?;
    let values = TileValues::of_model(&model, By::Clusters, context)?;
    values.take(material::SPARE_BYTES, &mut room)?;
    let (evaluator, mut notes) = values.into_evaluator(context)?;
    let values = TileValues::of_model(&model, By::Clusters, context)?;
    let subject = Subject { model, values, evaluator, options, room, context };
    let (background, shadows) = (Background::Grey(options.background), options.shadows);
    let mut scene =
        Scene { surface, lights, background, shadows, density: 1.0, origin: [0.0; 2], turn_rad: 0.0 };
    type Way<'a> = (&'static str, Box<dyn Fn() -> Result<Texture> + 'a>);
    let ways: [Way<'_>; 5] = [
        ("the tile repeated", Box::new(|| Ok(material::tile(&subject.values, Some(true), &room)?.0))),
        ("two tiles", Box::new(|| subject.two_tiles())),
        ("paper, 2D CAR", Box::new(|| subject.paper(CarKind::Car2d))),
        ("paper, 3D CAR", Box::new(|| subject.paper(CarKind::Car3d))),
        (
            "coherent",
            Box::new(|| {
                let which = options.plane.unwrap_or(PlaneOptions { seed: SEED as u32, jitter: None });
                material::endless(&subject.model, &subject.values, which, &room, context)
            }),
        ),
    ];
    let mut canvas = Canvas::new(sheet);
    let mut count = 0;
    context.progress.begin("render", (ways.len() * height) as u64, Counted::Items("rows"));
    for (label, texture) in &ways {
        let picture = match texture().and_then(|texture| subject.picture(options, &mut scene, &texture)) {
            Ok((picture, None)) => picture,
            Ok((picture, Some(note))) => {
                notes.push(format!("{label}: {note}"));
                picture
            }
            Err(error) if matches!(error.kind(), crate::ErrorKind::Missing | crate::ErrorKind::Usage) => {
                notes.push(format!("{label}: left out: {error}"));
                continue;
            }
            Err(error) => return Err(error),
        };
        let (top, left) = place(count, options.size);
        canvas.text(top, left, label);
        canvas.put(top + LINE, left, &exposed(picture, options.exposure).as_display());
        count += 1;
    }
    context.progress.end();
    if count == 0 {
        return Err(Error::missing(format!("{}: nothing that could be shown", options.source.display()))
            .hint(notes.join("; ")));
    }
    let (top, left) = place(count, options.size);
    canvas.text(top, left, "the tile, one pixel per texel");
    scene.surface = Object::Endless;
    let tile = exposed(subject.flat_tile(&mut scene)?, options.exposure);
    canvas.put(top + LINE, left, &tile.as_display());
    let made = super::write(&canvas.into_picture(), 1.0, output, encoding, context)?;
    Ok(Report { pictures: vec![(output.to_owned(), made)], size: sheet, notes })
}

/// Top left corner of a panel.
fn place(number: usize, size: Size) -> (usize, usize) {
    let (row, column) = (number / COLUMNS, number % COLUMNS);
    (MARGIN + row * (size.height + LINE + MARGIN), MARGIN + column * (size.width + MARGIN))
}

fn exposed(mut picture: Picture, exposure: f64) -> Picture {
    picture.pixels.as_flattened_mut().iter_mut().for_each(|value| *value *= exposure as f32);
    picture
}

impl Subject<'_> {
    /// The object, covered with a texture, and what there is to say of it.
    fn picture(
        &self,
        options: &Options,
        scene: &mut Scene,
        texture: &Texture,
    ) -> Result<(Picture, Option<String>)> {
        let bounds = match texture {
            Texture::Whole { size, wraps, .. } => Some((*size, *wraps)),
            Texture::Pieces(_) => None,
        };
        let samples;
        objects::Laid { density: scene.density, origin: scene.origin, samples } =
            objects::laid(options, &scene.surface, bounds);
        let camera = Camera::new(objects::view(options, &scene.surface), options.size)?;
        let material = (&self.evaluator, texture);
        let rendered = crate::render::render(scene, &camera, material, options.size, samples, self.context)?;
        Ok((rendered.picture, rendered.beyond.then(|| beyond_note(options, bounds))))
    }

    /// As much of the tile as a panel holds.
    fn flat_tile(&self, scene: &mut Scene) -> Result<Picture> {
        let (texture, bounds) = material::tile(&self.values, None, &self.room)?;
        let Size { height, width } = bounds.map_or(self.options.size, |(size, _)| size);
        let size = Size::new(height.min(self.options.size.height), width.min(self.options.size.width));
        let options = Options { shape: super::Shape::Flat, size, scale: 1.0, ..self.options.clone() };
        let options = Options { camera: super::CameraOptions::default(), samples: None, ..options };
        Ok(self.picture(&options, scene, &texture)?.0)
    }

    fn two_tiles(&self) -> Result<Texture> {
        let tile = self.model.tile()?;
        let index = of_stage(&self.model, Stage::Cluster, Model::index)?;
        let exemplar = Exemplar::new(tile.size, tile.wraps, index, &self.model.distance()?)?;
        let tiles = self.context.compute(|| Tiles::new(&exemplar, 2, SEED, None))?;
        let entries = self.values.entries()?;
        let make: Maker = Box::new(move |area: Area| {
            let texels = tiles.window(area.y, area.x, area.size);
            Ok(texels.into_iter().map(|texel| entries[texel as usize]).collect())
        });
        Ok(material::pieces(make, None, &self.room))
    }

    /// A plane by the paper's rule, with a field that is fitted here.
    fn paper(&self, kind: CarKind) -> Result<Texture> {
        let tile = self.model.tile()?;
        let (normals, index) = (
            of_stage(&self.model, Stage::Normals, Model::normals)?,
            of_stage(&self.model, Stage::Cluster, Model::index)?,
        );
        self.room.require("fitting a random field", fit::memory_bytes(tile.size.texels()))?;
        let boundary = if tile.wraps { Boundary::Periodic } else { Boundary::Mirrored };
        let chosen = field::Options { kind, levels: None, gains: Gains::Matched, boundary };
        let scan = Scan::new(index, &self.model.distance()?);
        let candidates = CANDIDATES.min(tile.size.texels());
        let side = (PAPER_SIDE / self.options.scale.min(1.0)).min(4.0 * PAPER_SIDE) as usize;
        let size = Size::new(side, side);
        let kernel = Kernel::fastest();
        let index = self.context.compute(|| -> Result<Vec<u16>> {
            let joint = Some(Matching::Joint);
            let surface = Surface::fit(tile.size, &normals, Coordinates::Normals, joint, &chosen)?;
            let nearest = NearestNormals::new(&normals, candidates, kernel);
            let mut synthesis =
                Synthesis::new(&surface.field, SEED, size.height, size.width, Extent::Endless, kernel)?;
            let mut index: Vec<u16> = Vec::with_capacity(size.texels());
            let mut row = vec![[0.0; 3]; size.width];
            let (mut found, mut sources) = (vec![0; size.width * candidates], vec![0; size.width]);
            for y in 0..size.height {
                surface.next_rows(&mut synthesis, size.width, &mut row)?;
                found
                    .par_chunks_mut(64 * candidates)
                    .zip(row.par_chunks(64))
                    .for_each(|(found, normals)| nearest.find_row(normals, found));
                let above = (y > 0).then(|| &index[(y - 1) * size.width..]);
                scan.choose_row(&found, Neighbours { above, below: None, wraps: false }, &mut sources);
                let chosen: Vec<u16> = sources.iter().map(|&texel| scan.cluster(texel)).collect();
                index.extend(chosen);
            }
            Ok(index)
        })?;
        Ok(Texture::Whole { size, wraps: false, index: index.into_iter().map(u32::from).collect() })
    }
}
