//! How far an enlargement is from real crops of the material, in units of how far those are from each other.
//!
//! Only crops are read, and rows that stream by. `docs/how-to/judge.md` says what the figures mean.

mod crops;
mod normals;
mod pairs;
mod phase;
mod report;
mod sheet;
mod subject;
mod whole;

use std::path::PathBuf;

use btfkit_formats::Direction;
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::lattice::WaveCounts;
use crate::likeness::autocorrelation::near_shift;
use crate::likeness::repetition::wavy_bands;
use crate::likeness::{Judge, Judgement, Lightness};
use crate::method::tile::Tile;
use crate::picture::Picture;
use crate::run::Context;
use crate::run::progress::Counted;
use crate::shape::{Size, Window};
use crate::stage::cluster::open_measurement_of;
use crate::store::measurement::Measurement;
use crate::store::model::{Model, Stage};
pub use crops::Origin;
pub use report::{LatticePeak, NormalRows, Normals, Pair, Report, Row, Rows};
use sheet::Panels;
use subject::Subject;
use whole::{Codes, Material};

/// Rows of the measurement that are read together: a row of chunks.
const BAND_ROWS: usize = 16;

/// Side of the window in which wavy bands are sought.
const WAVY_SIDE: usize = 768;

/// The pair (view, light) that shows relief best: the most frontal view under its lowest light.
///
/// # Errors
/// No directions.
pub(crate) fn frontal_pair(views: &[Direction], lights: &[Direction]) -> Result<[usize; 2]> {
    let pair = pairs::spread(views, lights, 1).first().copied();
    pair.ok_or_else(|| Error::input("got no view or no light, expected one at least"))
}

/// What to judge, and by what.
#[derive(Clone, Debug)]
pub struct Options {
    /// An enlarged index, or a model, whose endless plane is judged.
    pub subject: PathBuf,
    /// The measurement that the model was made of.
    pub measurement: PathBuf,
    /// The model of an enlarged index; beside it under its recorded name where absent.
    pub model: Option<PathBuf>,
    /// Rows and columns of the part of the endless plane.
    pub size: Option<Size>,
    /// Numbers of views and lights; some spread over the directions where there are none.
    pub pairs: Vec<[usize; 2]>,
    /// Side of the crops; as large as fit, up to 128, where absent.
    pub crop: Option<usize>,
}

/// Where pictures are cut.
struct Crops {
    side: usize,
    reals: Vec<Window>,
    enlarged: Vec<Window>,
    /// Rows and columns of crops of the plane that repeats the exemplar.
    repeated: Vec<[usize; 2]>,
    /// Rows and columns within which crops of a regular material were moved into phase with real ones.
    cell: Option<Size>,
}

impl Crops {
    /// Judges crops that were cut here.
    fn judge(&self, judge: &Judge, pictures: &[Lightness]) -> Result<Judgement> {
        if self.cell.is_some() { judge.judge_partners(pictures) } else { judge.judge(pictures) }
    }

    /// The crops of the plane that repeats an exemplar.
    fn of_repeated(&self, exemplar: &Lightness) -> Vec<Lightness> {
        let size = Size::new(self.side, self.side);
        self.repeated.iter().map(|&[y, x]| exemplar.repeated(y, x, size)).collect()
    }
}

/// What was found under one pair.
struct Found {
    own: Judgement,
    alone: Option<Judgement>,
    with_model: Judgement,
    floor: [f64; crate::likeness::Measure::ALL.len()],
    lattice: Option<[f64; 2]>,
    panels: Panels,
}

/// Judges. The report, and a sheet of the pictures that were judged.
///
/// # Errors
/// Stores that do not belong together or are not there yet, a measurement or an enlargement too small to cut crops from,
/// pairs that were not measured, and those of reading.
pub fn run(options: &Options, context: &Context<'_>) -> Result<(Report, Picture)> {
    let (subject, model) =
        context.compute(|| Subject::open(&options.subject, options.model.as_deref(), options.size))?;
    let measurement = open_measurement_of(&model, &options.measurement)?;
    let description = measurement.description();
    let pairs = pairs_of(options, &measurement)?;
    let (tile, index) = (model.tile()?, model.index()?);
    let centres = model.centres()?;
    let brdf = description.views.len() * description.lights.len();
    if !tile.bounds().fits(description.size) || !centres.len().is_multiple_of(brdf) {
        return Err(Error::input(format!(
            "{} does not fit {}",
            model.path().display(),
            measurement.path().display()
        )));
    }
    let (exemplar, wraps, counts) = exemplar_of(&model, &tile)?;
    let lattice = model.tile_report()?.lattice;
    let clusters = centres.len() / brdf;
    let material = Material { tile: tile.size, index: &index, exemplar, wraps, clusters };
    let Size { height, width } = subject.size();
    let reals = crops::real_crops(description.size, tile.bounds(), height.min(width), options.crop)?;
    let mut crops = Crops {
        side: reals.side,
        reals: reals.windows,
        enlarged: crops::crops_of(subject.size(), reals.side),
        repeated: crops::spread_over(exemplar.size),
        cell: phase::cell(&lattice, reals.side),
    };
    let mut codes = Vec::with_capacity(pairs.len());
    context.progress.begin("read", pairs.len() as u64, Counted::Items("pairs"));
    for &[view, light] in &pairs {
        let at = view * description.lights.len() + light;
        let of_clusters = centres.iter().skip(at).step_by(brdf).copied().collect();
        codes.push(Codes {
            tile: tile_codes(&measurement, &tile, [view, light], context)?,
            clusters: of_clusters,
        });
        context.progress.advance(1);
    }
    context.progress.end();
    let (verdict, bands) = whole::look(&subject, &material, &codes, context)?;
    if let (Some(cell), Some(&pair), Some(codes)) = (crops.cell, pairs.first(), codes.first()) {
        let real = real_crops(&measurement, pair, &crops)?;
        context.compute(|| move_into_phase(&mut crops, cell, &subject, &material, codes, &real))?;
    }
    let periods = counts.lattice(exemplar.size).vectors();
    let mut found = Vec::with_capacity(pairs.len());
    context.progress.begin("judge", pairs.len() as u64, Counted::Items("pairs"));
    for (&pair, codes) in pairs.iter().zip(&codes) {
        context.check_stop()?;
        let real = real_crops(&measurement, pair, &crops)?;
        found.push(context.compute(|| judge_pair(&subject, &material, &crops, codes, &real, &periods))?);
        context.progress.advance(1);
    }
    context.progress.end();
    let wavy = match codes.first() {
        Some(codes) => context.compute(|| wavy(&subject, &material, codes))?,
        None => [None; 2],
    };
    let normals = normals::judge(&subject, &model, &measurement, &material, &crops, context)?;
    let corner = |window: &Window| [window.y, window.x];
    let report = Report {
        subject: options.subject.clone(),
        size: [height, width],
        measurement: options.measurement.clone(),
        measurement_digest: measurement.digest().to_owned(),
        exemplar: [exemplar.y, exemplar.x, exemplar.size.height, exemplar.size.width],
        origin: reals.origin,
        crop: crops.side,
        real_crops: crops.reals.iter().map(corner).collect(),
        crops: crops.enlarged.iter().map(corner).collect(),
        in_phase_within: crops.cell.map(|cell| [cell.height, cell.width]),
        pairs: pairs.iter().zip(&found).map(|(&pair, found)| told(&measurement, pair, found)).collect(),
        mean: mean(&found)?,
        normals,
        verdict,
        bands,
        wavy_bands: wavy,
        lattice: lattice_peak(&found),
    };
    let panels: Vec<Panels> = found.into_iter().map(|found| found.panels).collect();
    let sheet = sheet::sheet(&panels, &report);
    Ok((report, sheet))
}

/// The pairs to judge under.
fn pairs_of(options: &Options, measurement: &Measurement) -> Result<Vec<[usize; 2]>> {
    let description = measurement.description();
    let (views, lights) = (description.views.len(), description.lights.len());
    match options.pairs.iter().find(|&&[view, light]| view >= views || light >= lights) {
        Some([view, light]) => Err(Error::usage(format!(
            "got the pair {view},{light}, expected a view from 0 to {} and a light from 0 to {}",
            views.saturating_sub(1),
            lights.saturating_sub(1)
        ))
        .hint(format!("btf info {} --directions lists them", measurement.path().display()))),
        None if options.pairs.is_empty() => {
            Ok(pairs::spread(&description.views, &description.lights, pairs::COUNT))
        }
        None => Ok(options.pairs.clone()),
    }
}

/// The part of the tile that enlargements are made of, whether it wraps, and its lattice: that of the appearance where
/// there is one.
fn exemplar_of(model: &Model, tile: &Tile) -> Result<(Window, bool, WaveCounts)> {
    if !model.has(Stage::Appearance)? {
        return Ok((tile.size.window(), tile.wraps, WaveCounts::default()));
    }
    let appearance = model.appearance()?;
    appearance.check(tile.size)?;
    Ok((appearance.exemplar, appearance.wraps, appearance.lattice))
}

/// L* codes of the texels of a tile, as measured under a pair.
fn tile_codes(
    measurement: &Measurement,
    tile: &Tile,
    [view, light]: [usize; 2],
    context: &Context<'_>,
) -> Result<Vec<u8>> {
    let bounds = tile.bounds();
    let mut plane = Vec::with_capacity(bounds.size.texels());
    for top in (0..bounds.size.height).step_by(BAND_ROWS) {
        context.check_stop()?;
        let rows = BAND_ROWS.min(bounds.size.height - top);
        let band = Window { y: bounds.y + top, x: bounds.x, size: Size::new(rows, bounds.size.width) };
        plane.extend(codes_of(measurement, [view, light], band)?);
    }
    Ok(tile.offsets_in_bounds().into_iter().map(|at| plane[at]).collect())
}

/// L* codes of a window under a pair.
fn codes_of(
    measurement: &Measurement,
    [view, light]: [usize; 2],
    window: Window,
) -> Result<impl Iterator<Item = u8> + use<>> {
    let lights = measurement.description().lights.len();
    Ok(measurement.read_luminance(view, window)?.into_iter().skip(light).step_by(lights))
}

fn real_crops(measurement: &Measurement, pair: [usize; 2], crops: &Crops) -> Result<Vec<Lightness>> {
    let crop = |&window: &Window| Ok(Lightness::of_codes(window.size, codes_of(measurement, pair, window)?));
    crops.reals.iter().map(crop).collect()
}

/// Moves crops of the enlargement and of the repeated exemplar, within a cell, into phase with the real crops.
fn move_into_phase(
    crops: &mut Crops,
    cell: Size,
    subject: &Subject,
    material: &Material<'_>,
    codes: &Codes,
    real: &[Lightness],
) -> Result<()> {
    let side = Size::new(crops.side, crops.side);
    for (crop, partner) in crops.enlarged.iter_mut().zip(real.iter().cycle()) {
        let around = phase::around(*crop, cell, subject.size());
        let (alone, with_model) = pictures_of(subject, material, codes, around)?;
        let [y, x] = phase::best_place(alone.as_ref().unwrap_or(&with_model), partner);
        *crop = Window { y: around.y + y, x: around.x + x, size: side };
    }
    let tile = Lightness::of_codes(material.tile, codes.tile.iter().copied());
    let exemplar = tile.part(material.exemplar);
    let size = Size::new(side.height + cell.height - 1, side.width + cell.width - 1);
    for (place, partner) in crops.repeated.iter_mut().zip(real.iter().cycle()) {
        let [y, x] = phase::best_place(&exemplar.repeated(place[0], place[1], size), partner);
        *place = [place[0] + y, place[1] + x];
    }
    Ok(())
}

fn judge_pair(
    subject: &Subject,
    material: &Material<'_>,
    crops: &Crops,
    codes: &Codes,
    real: &[Lightness],
    periods: &[[f64; 2]],
) -> Result<Found> {
    let judge = Judge::new(real)?;
    let tile = Lightness::of_codes(material.tile, codes.tile.iter().copied());
    let repeated = crops.of_repeated(&tile.part(material.exemplar));
    let (mut alone, mut with_model) = (Vec::new(), Vec::new());
    for &window in &crops.enlarged {
        let (of_texels, of_clusters) = pictures_of(subject, material, codes, window)?;
        alone.extend(of_texels);
        with_model.push(of_clusters);
    }
    let seen = if alone.is_empty() { &with_model } else { &alone };
    let lattice = lattice_of(seen, &repeated, periods);
    let middle = crops.enlarged.len() / 2;
    Ok(Found {
        own: crops.judge(&judge, &repeated)?,
        alone: if alone.is_empty() { None } else { Some(crops.judge(&judge, &alone)?) },
        with_model: crops.judge(&judge, &with_model)?,
        floor: judge.floor(),
        lattice,
        panels: Panels {
            // The real crop with which the middle one is in phase.
            real: real[middle % real.len()].clone(),
            alone: alone.get(middle).cloned(),
            with_model: with_model[middle].clone(),
        },
    })
}

/// A window with the values measured where its texels come from, as far as that is known, and with the clusters' values.
fn pictures_of(
    subject: &Subject,
    material: &Material<'_>,
    codes: &Codes,
    window: Window,
) -> Result<(Option<Lightness>, Lightness)> {
    let texels = subject.texels(window, material.clusters, material.tile)?;
    let of_cluster = |&cluster: &u16| codes.clusters[usize::from(cluster)];
    let of_texel = |texel: u32| codes.tile[texel as usize];
    let with_model = Lightness::of_codes(window.size, texels.index.iter().map(of_cluster));
    let source = texels.source;
    let alone = source.map(|source| Lightness::of_codes(window.size, source.into_iter().map(of_texel)));
    Ok((alone, with_model))
}

/// Mean autocorrelation at the periods of a lattice that half a crop holds: of an enlargement and of its exemplar.
fn lattice_of(enlarged: &[Lightness], own: &[Lightness], periods: &[[f64; 2]]) -> Option<[f64; 2]> {
    let side = enlarged.first()?.size.height as f64;
    let fits = |period: &&[f64; 2]| period.iter().all(|length| length.abs() <= side / 2.0);
    let periods: Vec<[f64; 2]> = periods.iter().filter(fits).copied().collect();
    let mean = |pictures: &[Lightness]| {
        let peaks: Vec<f64> = pictures
            .par_iter()
            .flat_map_iter(|picture| periods.iter().map(|&period| near_shift(picture, period)))
            .collect();
        crate::likeness::mean(&peaks)
    };
    (!periods.is_empty()).then(|| [mean(enlarged), mean(own)])
}

fn lattice_peak(found: &[Found]) -> Option<LatticePeak> {
    let peaks: Vec<[f64; 2]> = found.iter().filter_map(|found| found.lattice).collect();
    let mean =
        |which: usize| crate::likeness::mean(&peaks.iter().map(|peak| peak[which]).collect::<Vec<_>>());
    (!peaks.is_empty()).then(|| LatticePeak { enlarged: mean(0), own: mean(1) })
}

/// Wavy bands in a window in the middle.
fn wavy(subject: &Subject, material: &Material<'_>, codes: &Codes) -> Result<[Option<f64>; 2]> {
    let window = subject.size().middle(Size::new(WAVY_SIDE, WAVY_SIDE));
    let texels = subject.texels(window, material.clusters, material.tile)?;
    let values = match texels.source {
        Some(source) => source.iter().map(|&texel| codes.tile[texel as usize]).collect::<Vec<_>>(),
        None => texels.index.iter().map(|&cluster| codes.clusters[usize::from(cluster)]).collect(),
    };
    Ok(wavy_bands(&Lightness::of_codes(window.size, values), material.exemplar.size))
}

fn told(measurement: &Measurement, [view, light]: [usize; 2], found: &Found) -> Pair {
    let description = measurement.description();
    let degrees = |direction: Direction| {
        let (theta, phi) = direction.degrees();
        [theta, phi]
    };
    Pair {
        view,
        light,
        view_deg: degrees(description.views[view]),
        light_deg: degrees(description.lights[light]),
        floor: report::by_name(&found.floor),
        rows: Rows {
            own: (&found.own).into(),
            alone: found.alone.as_ref().map(Row::from),
            with_model: (&found.with_model).into(),
        },
    }
}

/// Means over the pairs.
fn mean(found: &[Found]) -> Result<Rows> {
    let row = |judgements: Vec<Judgement>| Judgement::mean(&judgements).as_ref().map(Row::from);
    let none = || Error::usage("no pair of directions to judge under");
    Ok(Rows {
        own: row(found.iter().map(|found| found.own).collect()).ok_or_else(none)?,
        alone: row(found.iter().filter_map(|found| found.alone).collect()),
        with_model: row(found.iter().map(|found| found.with_model).collect()).ok_or_else(none)?,
    })
}
