//! Model against measurement: how well the tile is reconstructed from its index and representatives, or from its
//! components.

use std::borrow::Cow;
use std::path::PathBuf;

use btfkit_formats::Samples;
use serde::Serialize;

use crate::color::{ciede2000, lab};
use crate::error::Result;
use crate::method::value::components::Components;
use crate::run::progress::Counted;
use crate::run::{Context, units};
use crate::stage::cluster::open_measurement_of;
use crate::stage::image::of_stage;
use crate::store::measurement::{Description, Measurement};
use crate::store::model::{Model, Stage};

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

/// What of a model is compared: each gives the tile's samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum By {
    /// Index and representatives of the clusters.
    Clusters,
    /// The components.
    Components,
}

impl By {
    /// What a model has, clusters if it has both.
    ///
    /// # Errors
    /// Those of reading the model's attributes.
    pub fn of(model: &Model) -> Result<Self> {
        let only_components = !model.has(Stage::Cluster)? && model.has(Stage::Components)?;
        Ok(if only_components { Self::Components } else { Self::Clusters })
    }
}

/// The tile's samples as a model has them.
enum Modelled {
    Clusters { index: Vec<u16>, samples: Samples },
    Components(Components),
}

impl Modelled {
    fn open(model: &Model, by: By, context: &Context<'_>) -> Result<Self> {
        Ok(match by {
            By::Clusters => Self::Clusters {
                index: of_stage(model, Stage::Cluster, Model::index)?,
                samples: of_stage(model, Stage::Cluster, Model::representatives)?.samples,
            },
            By::Components => Self::Components(of_stage(model, Stage::Components, |model| {
                context.require("comparing components", model.components_bytes()?)?;
                model.components()
            })?),
        })
    }

    /// Samples that hold those of all texels under a view, and where each texel's begin.
    fn of_view(&self, view: usize, description: &Description) -> (Cow<'_, Samples>, Vec<usize>) {
        let texel = description.texel_samples();
        match self {
            Self::Clusters { index, samples } => {
                let start = |&cluster: &u16| (usize::from(cluster) * description.views.len() + view) * texel;
                (Cow::Borrowed(samples), index.iter().map(start).collect())
            }
            Self::Components(components) => {
                let samples = components.samples_of_view(view, description.sample_type, description.transfer);
                (Cow::Owned(samples), (0..components.size.texels()).map(|number| number * texel).collect())
            }
        }
    }
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

#[derive(Clone, Default)]
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

/// Re-makes the tile under every pair of directions and compares it with the measurement.
///
/// # Errors
/// Those of reading, and too little memory.
pub fn run(model: &Model, measurement: &Measurement, by: By, context: &Context<'_>) -> Result<Report> {
    let description = measurement.description();
    let (tile, modelled) = (model.tile()?, Modelled::open(model, by, context)?);
    let (bounds, offsets) = (tile.bounds(), tile.offsets_in_bounds());
    let (texel, channels) = (description.texel_samples(), description.n_channels());
    let decoder = description.decoder()?;
    let codes = description.codes()?;
    let stride = offsets.len().div_ceil(COLOUR_TEXELS);

    let views: Vec<usize> = (0..description.views.len()).collect();
    context.progress.begin("compare", views.len() as u64, Counted::Items("views"));
    // Of components, samples of the view are made, and the values that they are rounded from.
    let made = match by {
        By::Clusters => 0,
        By::Components => description.texel_bytes() + description.texel_samples() * size_of::<f32>(),
    };
    let window_bytes = (bounds.size.texels() * (2 * description.texel_bytes() + made)) as u64;
    let in_flight = units::in_flight(context, &format!("comparing views of {}", bounds.size), window_bytes)?;
    let sums = units::for_each(context, &views, in_flight, |&view| {
        let window = measurement.read_reflectance(view, bounds)?;
        let (model_samples, starts) = modelled.of_view(view, description);
        let mut sums = Sums { views: 1, ..Sums::default() };
        let difference = |measured: usize, modelled: usize| {
            let [a, b] = [window.value(measured), model_samples.value(modelled)];
            Some(a? - b?).filter(|difference| difference.is_finite())
        };
        for (number, (&at, &start)) in offsets.iter().zip(&starts).enumerate() {
            for sample in (0..texel).step_by(channels) {
                let (measured, modelled) = (at * texel + sample, start + sample);
                let code = codes.code(&window, measured);
                sums.codes += u64::from(code.abs_diff(codes.code(&model_samples, modelled)));
                for channel in 0..channels {
                    match difference(measured + channel, modelled + channel) {
                        Some(difference) => sums.squares += difference * difference,
                        None => sums.left_out += 1,
                    }
                }
                if number % stride == 0 {
                    let [a, b] = [decoder.rgb(&window, measured), decoder.rgb(&model_samples, modelled)];
                    sums.add_colour(ciede2000(lab(a), lab(b)));
                }
            }
            sums.code_count += description.lights.len() as u64;
        }
        sums.sample_count = (offsets.len() * texel) as u64 - sums.left_out;
        context.progress.advance(1);
        Ok(sums)
    })?;
    context.progress.end();

    let mut elevations: Vec<(f64, Sums)> = Vec::new();
    let mut order = views;
    order.sort_by(|&a, &b| description.views[a].theta_rad.total_cmp(&description.views[b].theta_rad));
    for view in order {
        let theta = (description.views[view].degrees().0 * 1e6).round() / 1e6;
        match elevations.last_mut() {
            Some((last, group)) if *last == theta => *group = std::mem::take(group).add(&sums[view]),
            _ => elevations.push((theta, sums[view].clone())),
        }
    }
    Ok(Report {
        elevations: elevations.iter().map(|(theta, sums)| sums.errors(Some(*theta))).collect(),
        all: sums.iter().fold(Sums::default(), Sums::add).errors(None),
        colour_texels: offsets.len().div_ceil(stride),
    })
}
