//! What is found under a pair of directions, and what of it is reported.

use btfkit_formats::Direction;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::report::{self, LatticePeak, Pair, Row, Rows};
use crate::error::{Error, Result};
use crate::likeness::autocorrelation::near_shift;
use crate::likeness::{Judgement, Lightness, Measure};
use crate::store::measurement::Measurement;

/// What was found under one pair.
#[derive(Serialize, Deserialize)]
pub(super) struct Found {
    pub(super) own: Judgement,
    pub(super) alone: Option<Judgement>,
    pub(super) with_model: Judgement,
    pub(super) floor: [f64; Measure::ALL.len()],
    pub(super) lattice: Option<[f64; 2]>,
}

/// Mean autocorrelation at the periods of a lattice that half a crop holds: of an enlargement and of its exemplar.
pub(super) fn lattice_of(
    enlarged: &[Lightness],
    own: &[Lightness],
    periods: &[[f64; 2]],
) -> Option<[f64; 2]> {
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

pub(super) fn lattice_peak(found: &[Found]) -> Option<LatticePeak> {
    let peaks: Vec<[f64; 2]> = found.iter().filter_map(|found| found.lattice).collect();
    let mean =
        |which: usize| crate::likeness::mean(&peaks.iter().map(|peak| peak[which]).collect::<Vec<_>>());
    (!peaks.is_empty()).then(|| LatticePeak { enlarged: mean(0), own: mean(1) })
}

pub(super) fn told(measurement: &Measurement, [view, light]: [usize; 2], found: &Found) -> Pair {
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
pub(super) fn mean(found: &[Found]) -> Result<Rows> {
    let row = |judgements: Vec<Judgement>| Judgement::mean(&judgements).as_ref().map(Row::from);
    let none = || Error::usage("no pair of directions to judge under");
    Ok(Rows {
        own: row(found.iter().map(|found| found.own).collect()).ok_or_else(none)?,
        alone: row(found.iter().filter_map(|found| found.alone).collect()),
        with_model: row(found.iter().map(|found| found.with_model).collect()).ok_or_else(none)?,
    })
}
