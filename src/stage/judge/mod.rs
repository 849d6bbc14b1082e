//! How far an enlargement is from real crops of the material, in units of how far those are from each other.
//!
//! Only crops are read, and rows that stream by. `docs/how-to/judge.md` says what the figures mean.

mod codes;
mod crops;
mod found;
mod judging;
mod normals;
mod pairs;
mod phase;
mod report;
mod sheet;
mod subject;
mod whole;

use std::path::PathBuf;

use btfkit_formats::Direction;

use crate::error::{Error, Result};
use crate::picture::Picture;
use crate::run::Context;
use crate::shape::Size;
use crate::stage::partial::{Shared, Sharing, Work};
pub use crops::Origin;
use judging::{Judging, Part};
pub use report::{LatticePeak, NormalRows, Normals, Pair, Report, Row, Rows};

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
    /// Whether the pictures that were judged are shown too.
    pub sheet: bool,
}

/// What a judging found.
pub struct Judged {
    /// The figures.
    pub report: Report,
    /// The pictures that were judged, if they were asked for.
    pub sheet: Option<Picture>,
}

/// Judges.
///
/// # Errors
/// Stores that do not belong together or are not there yet, a measurement or an enlargement too small to cut crops from,
/// pairs that were not measured, and those of reading.
pub fn run(options: &Options, context: &Context<'_>) -> Result<Judged> {
    let judging = Judging::open(options, context)?;
    let units: Vec<usize> = (0..judging.units()).collect();
    let mut parts = Vec::with_capacity(units.len());
    judging.work(&units, context, |_, part| {
        parts.push(part);
        Ok(())
    })?;
    judging.judged(parts, context)
}

/// As [`run`], shared between runs: what each part of the work found is kept in a folder, and whoever finds all of them
/// puts them together.
///
/// # Errors
/// As [`run`]; and [`crate::ErrorKind::Missing`] where nothing is to be judged but something is missing.
pub fn run_shared(options: &Options, sharing: &Sharing, context: &Context<'_>) -> Result<Shared<Judged>> {
    let judging = Judging::open(options, context)?;
    sharing.run(
        &Work { what: &judging.what()?, units: judging.units(), words: ["part", "judged"] },
        |_: &Part| Ok(()),
        |missing, partial| judging.work(missing, context, |unit, part| partial.write(unit, &part)),
        |parts| judging.judged(parts, context),
    )
}
