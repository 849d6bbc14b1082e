//! The parts of a judging, each of which can be made alone: the whole of the subject, each pair of directions, the normals.

use std::sync::OnceLock;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::codes::{Codes, codes_of, pictures_of, tile_codes};
use super::crops::{self, Crops, Origin};
use super::found::{Found, lattice_of, lattice_peak, mean, told};
use super::report::{Normals, Report};
use super::sheet::{self, Panels};
use super::subject::Subject;
use super::whole::{self, Material};
use super::{Judged, Options, normals, pairs, phase};
use crate::error::{Error, Result};
use crate::lattice::WaveCounts;
use crate::likeness::verdict::Verdict;
use crate::likeness::{Judge, Lightness};
use crate::method::tile::Tile;
use crate::run::Context;
use crate::run::progress::Counted;
use crate::run::recipe::METHOD;
use crate::shape::{Size, Window};
use crate::stage::cluster::open_measurement_of;
use crate::store::measurement::Measurement;
use crate::store::model::{Model, Stage};

/// What a part of the work found.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Part {
    /// The whole of the subject.
    Whole(Whole),
    /// One pair of directions.
    Pair(Box<Found>),
    /// The normals.
    Normals(Normals),
}

/// What only the whole shows.
#[derive(Serialize, Deserialize)]
pub(super) struct Whole {
    verdict: Verdict,
    bands: [Option<f64>; 2],
    wavy_bands: [Option<f64>; 2],
}

/// What all parts have in common.
pub(super) struct Judging<'a> {
    options: &'a Options,
    subject: Subject,
    model: Model,
    measurement: Measurement,
    pairs: Vec<[usize; 2]>,
    tile: Tile,
    index: Vec<u16>,
    /// [cluster, view, light].
    centres: Vec<u8>,
    exemplar: Window,
    wraps: bool,
    clusters: usize,
    /// Periods of the lattice, in texels.
    periods: Vec<[f64; 2]>,
    origin: Origin,
    crops: Crops,
    /// Of each pair, once they are read.
    codes: Vec<OnceLock<Codes>>,
}

impl<'a> Judging<'a> {
    /// Opens all that is read, and chooses where to cut.
    ///
    /// # Errors
    /// As [`super::run`].
    pub(super) fn open(options: &'a Options, context: &Context<'_>) -> Result<Self> {
        let (subject, model) =
            context.compute(|| Subject::open(&options.subject, options.model.as_deref(), options.size))?;
        let measurement = open_measurement_of(&model, &options.measurement)?;
        let description = measurement.description();
        let pairs = pairs::chosen(options, &measurement)?;
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
        let Size { height, width } = subject.size();
        let reals = crops::real_crops(description.size, tile.bounds(), height.min(width), options.crop)?;
        let crops = Crops {
            side: reals.side,
            reals: reals.windows,
            enlarged: crops::crops_of(subject.size(), reals.side),
            repeated: crops::spread_over(exemplar.size),
            cell: phase::cell(&lattice, reals.side),
        };
        let codes = pairs.iter().map(|_| OnceLock::new()).collect();
        let periods = counts.lattice(exemplar.size).vectors();
        let mut judging = Self {
            options,
            subject,
            model,
            measurement,
            pairs,
            tile,
            index,
            centres,
            exemplar,
            wraps,
            clusters,
            periods,
            origin: reals.origin,
            crops,
            codes,
        };
        judging.move_into_phase(context)?;
        Ok(judging)
    }

    /// All that results depend on, beside the version of the method of each stage, which is in the digests.
    pub(super) fn what(&self) -> Result<Value> {
        let mut stages = vec![Stage::Tile, Stage::Cluster];
        for stage in [Stage::Normals, Stage::Appearance] {
            if self.model.has(stage)? {
                stages.push(stage);
            }
        }
        let Size { height, width } = self.subject.size();
        Ok(json!({
            "stage": "judge", "method": METHOD, "measurement": self.measurement.digest(),
            "model": self.model.digest_of(&stages)?, "subject": self.subject.digest(), "size": [height, width],
            "pairs": self.pairs, "crop": self.crops.side,
        }))
    }

    /// How many parts there are.
    pub(super) fn units(&self) -> usize {
        self.pairs.len() + 2
    }

    /// Does these parts, ascending numbers below [`Self::units`], and hands what each found to `keep`.
    ///
    /// # Errors
    /// Those of reading, and of `keep`.
    pub(super) fn work(
        &self,
        units: &[usize],
        context: &Context<'_>,
        mut keep: impl FnMut(usize, Part) -> Result<()>,
    ) -> Result<()> {
        let (whole, normals) = (0, self.units() - 1);
        if units.contains(&whole) {
            keep(whole, Part::Whole(self.whole(context)?))?;
        }
        let of_pairs: Vec<usize> =
            units.iter().copied().filter(|&unit| unit != whole && unit != normals).collect();
        context.progress.begin("judge", of_pairs.len() as u64, Counted::Items("pairs"));
        for unit in of_pairs {
            context.check_stop()?;
            keep(unit, Part::Pair(Box::new(self.pair(unit - 1, context)?)))?;
            context.progress.advance(1);
        }
        context.progress.end();
        if units.contains(&normals) {
            let found = normals::judge(
                &self.subject,
                &self.model,
                &self.measurement,
                &self.material(),
                &self.crops,
                context,
            )?;
            keep(normals, Part::Normals(found))?;
        }
        Ok(())
    }

    /// Puts the parts, in their order, together.
    ///
    /// # Errors
    /// Those of reading the pictures that are shown.
    pub(super) fn judged(&self, parts: Vec<Part>, context: &Context<'_>) -> Result<Judged> {
        let (mut whole, mut found, mut normals) = (None, Vec::new(), None);
        for part in parts {
            match part {
                Part::Whole(part) => whole = Some(part),
                Part::Pair(part) => found.push(*part),
                Part::Normals(part) => normals = Some(part),
            }
        }
        let (Some(Whole { verdict, bands, wavy_bands }), Some(normals)) = (whole, normals) else {
            return Err(Error::internal("a part of a judging is missing"));
        };
        let corner = |window: &Window| [window.y, window.x];
        let (exemplar, size) = (self.exemplar, self.subject.size());
        let report = Report {
            subject: self.options.subject.clone(),
            size: [size.height, size.width],
            measurement: self.options.measurement.clone(),
            measurement_digest: self.measurement.digest().to_owned(),
            exemplar: [exemplar.y, exemplar.x, exemplar.size.height, exemplar.size.width],
            origin: self.origin,
            crop: self.crops.side,
            real_crops: self.crops.reals.iter().map(corner).collect(),
            crops: self.crops.enlarged.iter().map(corner).collect(),
            in_phase_within: self.crops.cell.map(|cell| [cell.height, cell.width]),
            pairs: self
                .pairs
                .iter()
                .zip(&found)
                .map(|(&pair, found)| told(&self.measurement, pair, found))
                .collect(),
            mean: mean(&found)?,
            normals,
            verdict,
            bands,
            wavy_bands,
            lattice: lattice_peak(&found),
        };
        let sheet = if self.options.sheet {
            let panels = (0..self.pairs.len()).map(|pair| self.panels(pair, context));
            Some(sheet::sheet(&panels.collect::<Result<Vec<_>>>()?, &report))
        } else {
            None
        };
        Ok(Judged { report, sheet })
    }

    fn material(&self) -> Material<'_> {
        Material {
            tile: self.tile.size,
            index: &self.index,
            exemplar: self.exemplar,
            wraps: self.wraps,
            clusters: self.clusters,
        }
    }

    /// Codes under a pair; read once.
    fn codes(&self, pair: usize, context: &Context<'_>) -> Result<&Codes> {
        let none = || Error::internal("a pair beyond those that are judged");
        let (Some(place), Some(&[view, light])) = (self.codes.get(pair), self.pairs.get(pair)) else {
            return Err(none());
        };
        if let Some(codes) = place.get() {
            return Ok(codes);
        }
        let description = self.measurement.description();
        let brdf = description.views.len() * description.lights.len();
        let at = view * description.lights.len() + light;
        let codes = Codes {
            tile: tile_codes(&self.measurement, &self.tile, [view, light], context)?,
            clusters: self.centres.iter().skip(at).step_by(brdf).copied().collect(),
        };
        Ok(place.get_or_init(|| codes))
    }

    fn real_crops(&self, pair: usize) -> Result<Vec<Lightness>> {
        let crop = |&window: &Window| {
            Ok(Lightness::of_codes(window.size, codes_of(&self.measurement, self.pairs[pair], window)?))
        };
        self.crops.reals.iter().map(crop).collect()
    }

    fn whole(&self, context: &Context<'_>) -> Result<Whole> {
        context.progress.begin("read", self.pairs.len() as u64, Counted::Items("pairs"));
        let codes: Vec<&Codes> = (0..self.pairs.len())
            .map(|pair| {
                let codes = self.codes(pair, context)?;
                context.progress.advance(1);
                Ok(codes)
            })
            .collect::<Result<_>>()?;
        context.progress.end();
        let material = self.material();
        let (verdict, bands) = whole::look(&self.subject, &material, &codes, context)?;
        let wavy_bands = match codes.first() {
            Some(codes) => context.compute(|| whole::wavy(&self.subject, &material, codes))?,
            None => [None; 2],
        };
        Ok(Whole { verdict, bands, wavy_bands })
    }

    fn pair(&self, pair: usize, context: &Context<'_>) -> Result<Found> {
        let codes = self.codes(pair, context)?;
        let real = self.real_crops(pair)?;
        context.compute(|| self.judge_pair(codes, &real))
    }

    fn judge_pair(&self, codes: &Codes, real: &[Lightness]) -> Result<Found> {
        let judge = Judge::new(real)?;
        let (material, crops) = (self.material(), &self.crops);
        let tile = Lightness::of_codes(material.tile, codes.tile.iter().copied());
        let repeated = crops.of_repeated(&tile.part(material.exemplar));
        let (mut alone, mut with_model) = (Vec::new(), Vec::new());
        for &window in &crops.enlarged {
            let (of_texels, of_clusters) = pictures_of(&self.subject, &material, codes, window)?;
            alone.extend(of_texels);
            with_model.push(of_clusters);
        }
        let seen = if alone.is_empty() { &with_model } else { &alone };
        Ok(Found {
            own: crops.judge(&judge, &repeated)?,
            alone: if alone.is_empty() { None } else { Some(crops.judge(&judge, &alone)?) },
            with_model: crops.judge(&judge, &with_model)?,
            floor: judge.floor(),
            lattice: lattice_of(seen, &repeated, &self.periods),
        })
    }

    /// The pictures of a pair: the middle crop, and the real crop with which it is in phase.
    fn panels(&self, pair: usize, context: &Context<'_>) -> Result<Panels> {
        let codes = self.codes(pair, context)?;
        let real = self.real_crops(pair)?;
        let middle = self.crops.enlarged.len() / 2;
        let (alone, with_model) = context
            .compute(|| pictures_of(&self.subject, &self.material(), codes, self.crops.enlarged[middle]))?;
        Ok(Panels { real: real[middle % real.len()].clone(), alone, with_model })
    }

    /// Of a regular material, moves crops of the enlargement and of the repeated exemplar, within a cell, into phase with
    /// the real crops under the first pair.
    fn move_into_phase(&mut self, context: &Context<'_>) -> Result<()> {
        let (Some(cell), false) = (self.crops.cell, self.pairs.is_empty()) else { return Ok(()) };
        let codes = self.codes(0, context)?;
        let real = self.real_crops(0)?;
        let (enlarged, repeated) = context.compute(|| self.in_phase(cell, codes, &real))?;
        (self.crops.enlarged, self.crops.repeated) = (enlarged, repeated);
        Ok(())
    }

    /// The crops of the enlargement, and the places of those of the repeated exemplar, in phase.
    fn in_phase(
        &self,
        cell: Size,
        codes: &Codes,
        real: &[Lightness],
    ) -> Result<(Vec<Window>, Vec<[usize; 2]>)> {
        let material = self.material();
        let side = Size::new(self.crops.side, self.crops.side);
        let mut enlarged = self.crops.enlarged.clone();
        for (crop, partner) in enlarged.iter_mut().zip(real.iter().cycle()) {
            let around = phase::around(*crop, cell, self.subject.size());
            let (alone, with_model) = pictures_of(&self.subject, &material, codes, around)?;
            let [y, x] = phase::best_place(alone.as_ref().unwrap_or(&with_model), partner);
            *crop = Window { y: around.y + y, x: around.x + x, size: side };
        }
        let tile = Lightness::of_codes(material.tile, codes.tile.iter().copied());
        let exemplar = tile.part(material.exemplar);
        let size = Size::new(side.height + cell.height - 1, side.width + cell.width - 1);
        let mut repeated = self.crops.repeated.clone();
        for (place, partner) in repeated.iter_mut().zip(real.iter().cycle()) {
            let [y, x] = phase::best_place(&exemplar.repeated(place[0], place[1], size), partner);
            *place = [place[0] + y, place[1] + x];
        }
        Ok((enlarged, repeated))
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
