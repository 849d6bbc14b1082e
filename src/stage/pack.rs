//! Components to one small file and back; see [`btfkit_packed`].

use std::path::{Path, PathBuf};

use btfkit_formats::Direction;
use btfkit_packed as packed;
use serde::Serialize;

use crate::color::Transfer;
use crate::disk::output::{self, Made};
use crate::error::{Error, Result};
use crate::lattice::Lattice;
use crate::method::tile::Tile;
use crate::method::value::components::Components;
use crate::names::ends_with;
use crate::run::Context;
use crate::run::recipe::Recipe;
use crate::shape::Size;
use crate::stage::compare::same_directions;
use crate::stage::components::Report as ComponentsReport;
use crate::stage::image::of_stage;
use crate::store::model::components::{ComponentsRecipe, Found, raw_bytes};
use crate::store::model::tile::{TileRecipe, TileReport};
use crate::store::model::{Model, Stage, UNPACKED};
pub use crate::store::packed::{ENDING, is_packed};
use crate::store::packed::{
    LICENCE, MEASUREMENT, Packed as OpenedFile, PackedFile, SAMPLES, TEXEL_MM, TILE, TRANSFER,
};

/// How small, or how good.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quality {
    /// At most so many bytes.
    Bytes(u64),
    /// So many times smaller than the samples of the tile.
    Ratio(f64),
    /// At least this peak signal-to-noise ratio, dB.
    Decibels(f64),
}

/// What to pack.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model with components.
    pub model: PathBuf,
    /// The file.
    pub output: PathBuf,
    /// How small or how good.
    pub quality: Quality,
    /// Under which licence the material may be used.
    pub licence: Option<String>,
    /// Millimetres of a texel.
    pub texel_mm: Option<f64>,
}

/// What was packed.
#[derive(Clone, Debug, Serialize)]
pub struct Packed {
    /// Bytes of the file.
    pub bytes: u64,
    /// Bytes of the tile's samples.
    pub tile_bytes: u64,
    /// Components in it.
    pub components: usize,
    /// Components of the model.
    pub components_of_model: usize,
    /// Peak signal-to-noise ratio to the samples, dB.
    pub psnr_db: Option<f64>,
    /// The commands that give it more components, where all that the model has are in it and there can be more.
    #[serde(skip)]
    pub more: Option<String>,
    /// Whether it was there already.
    #[serde(skip)]
    pub made: Option<Made>,
}

/// Digits of the digest of a tile that a file keeps: enough to tell models apart.
const TILE_DIGITS: usize = 16;

/// Those that a model holds in its tile.
const OF_THE_TILE: [&str; 3] = [SAMPLES, TRANSFER, MEASUREMENT];

/// The curve's name in a packed model.
fn transfer_name(transfer: Transfer) -> &'static str {
    match transfer {
        Transfer::Srgb => "srgb",
        Transfer::Linear => "linear",
    }
}

/// Packs the components of a model.
///
/// # Errors
/// A model without components, a quality that cannot be had, a size that the format does not hold, and those of
/// writing.
pub fn pack(options: &Options, context: &Context<'_>) -> Result<Packed> {
    output::expect_outside_stores(&options.output)?;
    if !ends_with(&options.output, ENDING) {
        let name = options.output.display();
        return Err(Error::usage(format!("{name}: expected a name that ends with {ENDING}")));
    }
    let model = Model::open(&options.model)?;
    let report: ComponentsReport =
        of_stage(&model, Stage::Components, |model| model.report(Stage::Components))?;
    // In f32 as they are read, then in f64 twice, beside whole numbers and what is known of them.
    context.require("packing components", 5 * model.components_bytes()?)?;
    let mut whole = unpacked_model(&model)?;
    whole.texts.extend(options.licence.iter().map(|licence| (LICENCE.to_owned(), licence.clone())));
    whole.texts.extend(options.texel_mm.iter().map(|side| (TEXEL_MM.to_owned(), side.to_string())));
    // What the file said that the components were unpacked from, unless it is said anew.
    for (name, text) in &report.texts {
        if !whole.texts.iter().any(|(there, _)| there == name) {
            whole.texts.push((name.clone(), text.clone()));
        }
    }
    if report.squared_error.is_none() && matches!(options.quality, Quality::Decibels(_)) {
        return Err(Error::usage(format!(
            "{}: its components come from a packed file, so it is not known how far they are from the measurement",
            options.model.display()
        ))
        .hint("ask for bytes or a ratio, or pack the model that the file was made of"));
    }
    let target = match options.quality {
        Quality::Bytes(bytes) => packed::Target::Bytes(usize::try_from(bytes).unwrap_or(usize::MAX)),
        Quality::Ratio(ratio) => packed::Target::Bytes((report.tile_bytes as f64 / ratio) as usize),
        Quality::Decibels(decibels) => packed::Target::Decibels(decibels),
    };
    context.check_stop()?;
    let file = context
        .compute(|| packed::pack(&whole, report.squared_error, target))
        .map_err(|error| Error::usage(format!("{}: {error}", options.model.display())))?;
    let made = output::prepare_bytes(&options.output, context.existing, &file.bytes)?.publish()?;
    let twice = 2 * report.components;
    // Not of components that were unpacked: there is no measurement to find more in.
    let can_have_more = report.squared_error.is_some()
        && file.components == report.components
        && twice <= whole.texels().min(whole.brdf());
    let more = can_have_more.then(|| {
        format!(
            "{} --components {twice} --force, then btf pack {} {} --force with the same --quality",
            model.command(Stage::Components),
            options.model.display(),
            options.output.display()
        )
    });
    Ok(Packed {
        more,
        bytes: file.bytes.len() as u64,
        tile_bytes: report.tile_bytes,
        components: file.components,
        components_of_model: report.components,
        psnr_db: report.squared_error.map(|_| file.decibels),
        made: Some(made),
    })
}

/// What the components of a model are after they were packed into at most so many bytes, and how many it took; none
/// where that is too few for any file.
pub(crate) fn packed_and_unpacked(
    model: &Model,
    bytes: u64,
    context: &Context<'_>,
) -> Result<Option<(Components, u64)>> {
    let whole = unpacked_model(model)?;
    let target = packed::Target::Bytes(usize::try_from(bytes).unwrap_or(usize::MAX));
    let Ok(file) = context.compute(|| packed::pack(&whole, None, target)) else { return Ok(None) };
    let length = file.bytes.len() as u64;
    let file = PackedFile::of(model.path(), file.bytes)?;
    let unpacked = file.model(context)?;
    Ok(Some((OpenedFile::of(file, unpacked).components, length)))
}

/// The components of a model as the packer takes them.
fn unpacked_model(model: &Model) -> Result<packed::Model> {
    let components = model.components()?;
    let tile: TileReport = model.tile_report()?;
    let count = components.count();
    let lists = |values: &[f32]| -> Vec<Vec<f64>> {
        (0..count)
            .map(|k| values.iter().skip(k).step_by(count).map(|&value| f64::from(value)).collect())
            .collect()
    };
    let parts = lists(&components.basis).into_iter().zip(lists(&components.coefficients));
    let [views, lights] = model.directions()?.map(|list| {
        let degrees = |direction: &Direction| {
            let (theta_deg, phi_deg) = direction.degrees();
            packed::Direction { theta_deg, phi_deg }
        };
        list.iter().map(degrees).collect()
    });
    let mut texts = vec![(TRANSFER.to_owned(), transfer_name(tile.transfer).to_owned())];
    texts.extend(tile.samples.iter().map(|name| (SAMPLES.to_owned(), name.clone())));
    if tile.patch.is_none() {
        // Of a tile that is the whole measurement it can be told again which texel is which.
        texts.push((MEASUREMENT.to_owned(), model.recipe::<TileRecipe>(Stage::Tile)?.measurement));
    } else {
        // Of a tile that was cut, only its model knows it.
        let digest = model.stage_digest(Stage::Tile)?;
        texts.push((TILE.to_owned(), digest.chars().take(TILE_DIGITS).collect()));
    }
    Ok(packed::Model {
        size: tile.size,
        wraps: tile.wraps,
        views,
        lights,
        channels: components.channels,
        texts,
        mean: components.mean.iter().map(|&value| f64::from(value)).collect(),
        components: parts.map(|(basis, coefficients)| packed::Component { basis, coefficients }).collect(),
    })
}

/// What is known of a section of a packed model: a file that is cut behind it is a model, too.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Section {
    /// Bytes up to its end: a file that is cut there is a model.
    pub bytes: usize,
    /// Components.
    pub components: usize,
    /// Peak signal-to-noise ratio, dB.
    pub psnr_db: f64,
}

/// What a packed model holds.
#[derive(Clone, Debug, Serialize)]
pub struct About {
    /// What it is, for programs that read it.
    pub kind: &'static str,
    /// Columns and rows of the tile.
    pub size: [usize; 2],
    /// Whether its borders join.
    pub wraps: bool,
    /// Views and lights.
    pub directions: [usize; 2],
    /// Names of the channels.
    pub channels: Vec<String>,
    /// Bytes of the file.
    pub bytes: usize,
    /// Of these, bytes of the header (sizes, directions, names and texts) and of the palette.
    pub header_bytes: usize,
    /// Centres of the palette, where coefficients are by one.
    pub centres: Option<usize>,
    /// Bytes of the same components as a model keeps them.
    pub raw_bytes: u64,
    /// Bytes of the tile's samples, where their type is said.
    pub tile_bytes: Option<u64>,
    /// Whether the tile is all of the measurement.
    pub whole_measurement: bool,
    /// What it can be cut to.
    pub planes: Vec<Section>,
    /// What else is said.
    pub texts: Vec<(String, String)>,
    /// What is wrong with its end.
    pub notes: Vec<String>,
}

/// What a packed model holds.
///
/// # Errors
/// A file that is none, or is damaged before its first plane ends; channels that are not understood.
pub fn about(path: &Path) -> Result<About> {
    let file = PackedFile::open(path)?;
    let (notes, samples) = (file.notes(), file.sample_type());
    let whole_measurement = file.text(MEASUREMENT).is_some();
    let components = file.outline.components();
    let packed::Outline {
        size,
        wraps,
        views,
        lights,
        channels,
        texts,
        planes,
        bytes,
        header_bytes,
        centres,
        ..
    } = file.outline;
    let (brdf, texels) = (views.len() * lights.len() * channels.len(), size[0] * size[1]);
    let values = (texels * brdf) as u64;
    let plane = |plane: &packed::SectionEnd| Section {
        bytes: plane.end,
        components: plane.components,
        psnr_db: plane.decibels,
    };
    Ok(About {
        kind: "packed model",
        size: [size[1], size[0]],
        wraps,
        directions: [views.len(), lights.len()],
        bytes,
        header_bytes,
        centres,
        raw_bytes: raw_bytes(components, brdf, texels),
        whole_measurement,
        tile_bytes: samples.map(|samples| samples.bytes() as u64 * values),
        planes: planes.iter().map(plane).collect(),
        channels,
        texts,
        notes,
    })
}

/// What was unpacked.
#[derive(Clone, Debug)]
pub struct Restored {
    /// Rows and columns of the tile.
    pub size: Size,
    /// Components.
    pub components: usize,
    /// Whether it was found done.
    pub found: bool,
    /// What is wrong with the file's end.
    pub notes: Vec<String>,
}

/// Makes a model of a packed one, with a tile and components.
///
/// # Errors
/// A file that is none; a model there that is another; those of writing.
pub fn unpack(file: &Path, path: &Path, context: &Context<'_>) -> Result<Restored> {
    let opened = PackedFile::open(file)?;
    let notes = opened.notes();
    let from = opened.model(context)?;
    let psnr_db = opened.outline.planes.last().map(|plane| plane.decibels).filter(|&found| found > 0.0);
    let named = opened.text(MEASUREMENT).map(str::to_owned);
    let PackedFile { description, digest, .. } = opened;
    let (size, transfer) = (description.size, description.transfer);
    let model = Model::create(path, context)?;
    let named = named.unwrap_or_else(|| format!("{UNPACKED}{digest}"));
    let tile = if from.wraps { "periodic" } else { "none" }.to_owned();
    let tile_recipe = TileRecipe { measurement: named, tile, seed: 1, lattice: None }.to_value()?;
    if let Some(_lock) = model.begin(Stage::Tile, &tile_recipe, context)? {
        let report = TileReport {
            size: from.size,
            wraps: from.wraps,
            patch: None,
            seam_visibility: 1.0,
            uncut_visibility: 1.0,
            transfer,
            channels: Some(from.channels.clone()),
            samples: Some(description.sample_type.name().to_owned()),
            measurement_size: from.size,
            lattice: Lattice::default(),
            cells: vec![],
            black: 0.0,
        };
        model.write_directions(&description)?;
        model.write_tile(&Tile::whole(size, from.wraps))?;
        model.finish(Stage::Tile, &tile_recipe, &report, context)?;
    }
    // A tile that was there is taken by its recipe, which a file only claims.
    let [views, lights] = model.directions()?;
    if model.tile()?.size != size
        || model.tile_report()?.channels.as_ref() != Some(&from.channels)
        || !same_directions(&views, &description.views)
        || !same_directions(&lights, &description.lights)
    {
        return Err(Error::recipe(format!(
            "{}: its tile is not that of {}: another size, other channels or directions",
            path.display(),
            file.display()
        ))
        .hint("unpack it under another name"));
    }
    let recipe = ComponentsRecipe {
        tile: model.stage_digest(Stage::Tile)?,
        components: from.components.len(),
        seed: 1,
        packed: Some(digest),
    };
    let recipe = recipe.to_value()?;
    let components = from.components.len().max(1);
    let done = |found: bool| Restored { size, components, found, notes: notes.clone() };
    let Some(_lock) = model.begin(Stage::Components, &recipe, context)? else { return Ok(done(true)) };
    let (mut bases, mut coefficients): (Vec<_>, Vec<_>) =
        from.components.into_iter().map(|part| (part.basis, part.coefficients)).unzip();
    if bases.is_empty() {
        // A model of the mean alone: a component of nothing.
        bases.push(vec![0.0; from.mean.len()]);
        coefficients.push(vec![0.0; size.texels()]);
    }
    let mean = from.mean.iter().map(|&value| value as f32).collect();
    model.write_components(&Found { mean, bases, coefficients })?;
    let report = ComponentsReport {
        components,
        strengths: vec![],
        squared_error: None,
        not_finite: 0,
        psnr_db,
        bytes: model.bytes_of_components(components)?,
        tile_bytes: description.bytes(),
        texts: from.texts.into_iter().filter(|(name, _)| !OF_THE_TILE.contains(&name.as_str())).collect(),
    };
    model.finish(Stage::Components, &recipe, &report, context)?;
    Ok(done(false))
}
