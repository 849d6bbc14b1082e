//! Model against measurement: how well the tile is reconstructed from its index and representatives, or from its
//! components.

mod modelled;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::color::{ciede2000, lab};
use crate::error::{Error, Result};
use crate::run::progress::Counted;
use crate::run::recipe::METHOD;
use crate::run::{Context, units};
use crate::shape::Window;
use crate::stage::cluster::open_measurement_of;
use crate::stage::partial::{Partial, Sharing};
use crate::store::measurement::Measurement;
use crate::store::model::{Model, Stage};
use crate::words::counted;
pub use modelled::By;
use modelled::Modelled;

/// Texels whose colour differences are taken; the other figures count every texel.
const COLOUR_TEXELS: usize = 1024;

/// Colour differences are counted by steps of this.
const COLOUR_STEP: f64 = 0.05;

/// The last step: a colour difference of 100, or more.
const COLOUR_STEPS: usize = 2000;

/// What to compare.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model.
    pub model: PathBuf,
    /// The measurement that it was made from.
    pub measurement: PathBuf,
}

/// Errors of the reconstructed tile.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// One entry an elevation of the view, frontal first.
    pub elevations: Vec<Errors>,
    /// All views together.
    pub all: Errors,
    /// Texels that the mean CIEDE2000 was taken over, under all directions.
    pub colour_texels: usize,
}

/// Mean errors over a set of views, all lights.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Errors {
    /// Angle of the views from the normal, degrees; absent for all views.
    pub view_theta_deg: Option<f64>,
    /// Number of views.
    pub views: usize,
    /// Mean |dL*|.
    pub lightness: f64,
    /// Peak signal to noise ratio of the stored samples that are finite in both, dB; none unless they differ.
    pub psnr_db: Option<f64>,
    /// What there is to say of these samples.
    pub samples: Agreement,
    /// Samples that are no finite number in one or the other, which the ratio leaves out.
    pub samples_left_out: u64,
    /// Mean CIEDE2000.
    pub ciede2000: f64,
    /// The CIEDE2000 that 95 % of the texels' samples stay below or at, to 0.05; the last step stands for all above
    /// 100.
    pub ciede2000_95: f64,
}

impl Errors {
    /// Whether colours differ by much more than their lightness: texels of one lightness and several hues share
    /// clusters, which are formed by lightness alone.
    pub fn hues_are_lost(&self) -> bool {
        /// A colour difference that is seen beside each other by everybody.
        const SEEN: f64 = 3.0;
        /// How many times the difference in lightness it is at least. Of one hue it is 1 or less.
        const TIMES: f64 = 3.0;
        self.ciede2000 > SEEN && self.ciede2000 > TIMES * self.lightness
    }

    /// The ratio for people.
    pub fn psnr_text(&self) -> String {
        match (self.samples, self.psnr_db) {
            (Agreement::Different, Some(psnr)) => format!("{psnr:.2}"),
            (Agreement::Undefined, _) => "undefined".to_owned(),
            _ => "equal".to_owned(),
        }
    }
}

/// Whether samples agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Agreement {
    /// They differ.
    Different,
    /// They are equal, all of them.
    Equal,
    /// There is none to compare.
    Undefined,
}

#[derive(Clone, Default, Serialize, Deserialize)]
struct Sums {
    views: usize,
    codes: u64,
    code_count: u64,
    squares: f64,
    sample_count: u64,
    left_out: u64,
    colour: f64,
    colour_count: u64,
    /// Colour differences by steps of [`COLOUR_STEP`].
    colours: Vec<u64>,
}

impl Sums {
    fn add_colour(&mut self, difference: f64) {
        self.colour += difference;
        self.colour_count += 1;
        let step = ((difference / COLOUR_STEP).ceil() as usize).min(COLOUR_STEPS);
        self.colours.resize(COLOUR_STEPS + 1, 0);
        self.colours[step] += 1;
    }

    /// The step that 95 % of the colour differences do not exceed.
    fn most_colours(&self) -> f64 {
        let mut below = 0;
        let step = self.colours.iter().position(|count| {
            below += count;
            20 * below >= 19 * self.colour_count
        });
        step.unwrap_or(0) as f64 * COLOUR_STEP
    }

    fn add(self, other: &Self) -> Self {
        let mut colours = self.colours;
        colours.resize(other.colours.len().max(colours.len()), 0);
        colours.iter_mut().zip(&other.colours).for_each(|(count, more)| *count += more);
        Self {
            colours,
            views: self.views + other.views,
            codes: self.codes + other.codes,
            code_count: self.code_count + other.code_count,
            squares: self.squares + other.squares,
            sample_count: self.sample_count + other.sample_count,
            left_out: self.left_out + other.left_out,
            colour: self.colour + other.colour,
            colour_count: self.colour_count + other.colour_count,
        }
    }

    fn errors(&self, view_theta_deg: Option<f64>) -> Errors {
        let samples = match (self.sample_count, self.squares) {
            (0, _) => Agreement::Undefined,
            (_, 0.0) => Agreement::Equal,
            _ => Agreement::Different,
        };
        let psnr = || -10.0 * (self.squares / self.sample_count as f64).log10();
        Errors {
            view_theta_deg,
            views: self.views,
            lightness: self.codes as f64 / self.code_count.max(1) as f64 / 2.55,
            psnr_db: (samples == Agreement::Different).then(psnr),
            samples,
            samples_left_out: self.left_out,
            ciede2000: self.colour / self.colour_count.max(1) as f64,
            ciede2000_95: self.most_colours(),
        }
    }
}

/// Opens what is compared.
///
/// # Errors
/// Where the model is not of this measurement.
pub fn open(options: &Options) -> Result<(Model, Measurement)> {
    let model = Model::open(&options.model)?;
    let measurement = open_measurement_of(&model, &options.measurement)?;
    Ok((model, measurement))
}

/// What was compared by a run that shares the work.
#[derive(Clone, Debug, Serialize)]
pub struct Shared {
    /// Views of all parts that are compared by now.
    pub done: usize,
    /// Views that there are.
    pub views: usize,
    /// Where their results lie.
    pub folder: PathBuf,
    /// The errors, once all views are compared.
    pub report: Option<Report>,
}

/// Re-makes the tile under every pair of directions and compares it with the measurement.
///
/// # Errors
/// Those of reading, and too little memory.
pub fn run(model: &Model, measurement: &Measurement, by: By, context: &Context<'_>) -> Result<Report> {
    let views: Vec<usize> = (0..measurement.description().views.len()).collect();
    let comparison = Comparison::open(model, measurement, by, context)?;
    let sums = comparison.sums(&views, context, |_, _| Ok(()))?;
    Ok(comparison.report(&sums))
}

/// As [`run`], shared between runs: each view's sums are kept in a folder, and whoever finds all of them adds them up, in
/// the order of the views.
///
/// # Errors
/// As [`run`]; and [`crate::ErrorKind::Missing`] where nothing is to be compared but something is missing.
pub fn run_shared(
    model: &Model,
    measurement: &Measurement,
    by: By,
    sharing: &Sharing,
    context: &Context<'_>,
) -> Result<Shared> {
    let n_views = measurement.description().views.len();
    let what = json!({
        "stage": "compare", "method": METHOD, "measurement": measurement.digest(),
        "model": model.digest_of(&[Stage::Tile, by.stage()])?,
    });
    let partial = Partial::at(&sharing.folder, &what)?;
    let kept = || (0..n_views).map(|view| partial.read::<Sums>(view)).collect::<Vec<_>>();
    let comparison = Comparison::open(model, measurement, by, context)?;
    if let Some(shard) = sharing.shard {
        let found = kept();
        let missing: Vec<usize> =
            (0..n_views).filter(|&view| shard.has(view) && found[view].is_none()).collect();
        comparison.sums(&missing, context, |view, sums| partial.write(view, sums))?;
    }
    let sums = kept();
    let done = sums.iter().flatten().count();
    let folder = partial.folder().to_owned();
    if done < n_views && sharing.shard.is_none() {
        return Err(Error::missing(format!(
            "{}: {done} of {} compared",
            folder.display(),
            counted(n_views, "view")
        ))
        .hint("run all parts first: the same command with --shard K/N instead of --reduce"));
    }
    let all: Option<Vec<Sums>> = sums.into_iter().collect();
    Ok(Shared { done, views: n_views, folder, report: all.map(|sums| comparison.report(&sums)) })
}

/// A model and a measurement, with what all views have in common.
struct Comparison<'a> {
    measurement: &'a Measurement,
    bounds: Window,
    /// Texels of the tile, within the bounds.
    offsets: Vec<usize>,
    modelled: Modelled,
    /// Of so many texels one's colours are compared.
    stride: usize,
}

impl<'a> Comparison<'a> {
    fn open(model: &Model, measurement: &'a Measurement, by: By, context: &Context<'_>) -> Result<Self> {
        let (tile, modelled) = (model.tile()?, Modelled::open(model, by, context)?);
        let (bounds, offsets) = (tile.bounds(), tile.offsets_in_bounds());
        let stride = offsets.len().div_ceil(COLOUR_TEXELS);
        Ok(Self { measurement, bounds, offsets, modelled, stride })
    }

    /// Compares these views; each one's sums are handed to `keep`.
    fn sums(
        &self,
        views: &[usize],
        context: &Context<'_>,
        keep: impl Fn(usize, &Sums) -> Result<()> + Sync,
    ) -> Result<Vec<Sums>> {
        let description = self.measurement.description();
        let texel_bytes = 2 * description.texel_bytes() + self.modelled.bytes_of_texel(description);
        context.progress.begin("compare", views.len() as u64, Counted::Items("views"));
        let window_bytes = (self.bounds.size.texels() * texel_bytes) as u64;
        let what = format!("comparing views of {}", self.bounds.size);
        let in_flight = units::in_flight(context, &what, window_bytes)?;
        let sums = units::for_each(context, views, in_flight, |&view| {
            let sums = self.of_view(view)?;
            keep(view, &sums)?;
            context.progress.advance(1);
            Ok(sums)
        })?;
        context.progress.end();
        Ok(sums)
    }

    fn of_view(&self, view: usize) -> Result<Sums> {
        let description = self.measurement.description();
        let (texel, channels) = (description.texel_samples(), description.n_channels());
        let (decoder, codes) = (description.decoder()?, description.codes()?);
        let (modelled_samples, starts) = self.modelled.of_view(view, description);
        let window = self.measurement.read_reflectance(view, self.bounds)?;
        let mut sums = Sums { views: 1, ..Sums::default() };
        let difference = |measured: usize, modelled: usize| {
            let [a, b] = [window.value(measured), modelled_samples.value(modelled)];
            Some(a? - b?).filter(|difference| difference.is_finite())
        };
        for (number, (&at, &start)) in self.offsets.iter().zip(&starts).enumerate() {
            for sample in (0..texel).step_by(channels) {
                let (measured, modelled) = (at * texel + sample, start + sample);
                let code = codes.code(&window, measured);
                sums.codes += u64::from(code.abs_diff(codes.code(&modelled_samples, modelled)));
                for channel in 0..channels {
                    match difference(measured + channel, modelled + channel) {
                        Some(difference) => sums.squares += difference * difference,
                        None => sums.left_out += 1,
                    }
                }
                if number % self.stride == 0 {
                    let [a, b] = [decoder.rgb(&window, measured), decoder.rgb(&modelled_samples, modelled)];
                    sums.add_colour(ciede2000(lab(a), lab(b)));
                }
            }
            sums.code_count += description.lights.len() as u64;
        }
        sums.sample_count = (self.offsets.len() * texel) as u64 - sums.left_out;
        Ok(sums)
    }

    /// Adds up the sums of all views, in their order.
    fn report(&self, sums: &[Sums]) -> Report {
        let views = &self.measurement.description().views;
        let mut elevations: Vec<(f64, Sums)> = Vec::new();
        let mut order: Vec<usize> = (0..views.len()).collect();
        order.sort_by(|&a, &b| views[a].theta_rad.total_cmp(&views[b].theta_rad));
        for view in order {
            let theta = (views[view].degrees().0 * 1e6).round() / 1e6;
            match elevations.last_mut() {
                Some((last, group)) if *last == theta => *group = std::mem::take(group).add(&sums[view]),
                _ => elevations.push((theta, sums[view].clone())),
            }
        }
        Report {
            elevations: elevations.iter().map(|(theta, sums)| sums.errors(Some(*theta))).collect(),
            all: sums.iter().fold(Sums::default(), Sums::add).errors(None),
            colour_texels: self.offsets.len().div_ceil(self.stride),
        }
    }
}
