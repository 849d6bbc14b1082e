//! Model against measurement: how well the tile is reconstructed from its index and representatives, from its
//! components, or from a packed file.

use std::path::{Path, PathBuf};

use btfkit_formats::Direction;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::color::{ciede2000, lab};
use crate::error::{Error, Result};
use crate::method::tile::Tile;
use crate::run::progress::Counted;
use crate::run::recipe::METHOD;
use crate::run::{Context, units};
use crate::shape::Window;
use crate::stage::cluster::open_measurement_of;
use crate::stage::ledger::Ledger;
use crate::stage::partial::{Shared, Sharing, Work};
pub use crate::stage::values::By;
use crate::stage::values::{TileSamples, TileValues};
use crate::store::measurement::Measurement;
use crate::store::model::{Model, Stage};
use crate::store::packed::{Packed, is_packed};

/// Texels whose colour differences are taken; the other figures count every texel.
const COLOUR_TEXELS: usize = 1024;

/// Colour differences are counted by steps of this.
const COLOUR_STEP: f64 = 0.05;

/// The last step: a colour difference of 100, or more.
const COLOUR_STEPS: usize = 2000;

/// What to compare.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model, or a packed model.
    pub model: PathBuf,
    /// The measurement that it was made from.
    pub measurement: PathBuf,
    /// Which values of a model: what it has where absent, clusters if it has both.
    pub by: Option<By>,
    /// The model that a packed one was made of: it says where the tile lies in the measurement. Not needed where the
    /// tile is all of the measurement.
    pub tile_of: Option<PathBuf>,
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

/// What the sums of a view count, under all lights.
struct Counts {
    texels: u64,
    samples: u64,
    /// Texels whose colours are compared.
    colours: u64,
}

impl Sums {
    /// Checks that sums may be those of a view: a seal says only that nobody changed them by accident.
    ///
    /// # Errors
    /// Counts that are not those of a view, and sums that no view has.
    fn expect_possible(&self, counts: &Counts) -> Result<()> {
        let steps = self.colours.iter().try_fold(0u64, |sum, &count| sum.checked_add(count));
        for (what, found, expected) in [
            ("views", Some(self.views as u64), 1),
            ("texels", Some(self.code_count), counts.texels),
            ("samples", self.sample_count.checked_add(self.left_out), counts.samples),
            ("colours", Some(self.colour_count), counts.colours),
            ("colours by steps", steps, counts.colours),
        ] {
            if found != Some(expected) {
                let found = found.map_or("more than can be counted".to_owned(), |found| found.to_string());
                return Err(Error::input(format!("{what}: got {found}, expected {expected}")));
            }
        }
        if self.codes > 255 * self.code_count || self.colours.len() > COLOUR_STEPS + 1 {
            return Err(Error::input("got differences of lightness or colour beyond the largest there are"));
        }
        let is_sum = |sum: f64| sum.is_finite() && sum >= 0.0;
        if !is_sum(self.squares) || !is_sum(self.colour) {
            let found = format!("{} and {}", self.squares, self.colour);
            return Err(Error::input(format!("got the sums {found}, expected finite ones of at least 0")));
        }
        Ok(())
    }

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

/// What is compared, opened.
pub struct Subject {
    /// The measurement.
    pub measurement: Measurement,
    /// Where the tile lies in it.
    pub tile: Tile,
    /// The values of the tile.
    pub values: TileValues,
    /// What they take.
    pub ledger: Ledger,
    /// What the values depend on, for sums that are shared.
    digest: String,
}

/// Opens what is compared.
///
/// # Errors
/// Where the model is not of this measurement; a packed model of a tile whose place is not known.
pub fn open(options: &Options, context: &Context<'_>) -> Result<Subject> {
    if is_packed(&options.model) {
        return open_packed(options, context);
    }
    if let Some(path) = &options.tile_of {
        return Err(Error::usage(format!(
            "{}: --tile-of is for packed models, a model knows its tile",
            path.display()
        ))
        .hint("leave it out"));
    }
    let model = Model::open(&options.model)?;
    let measurement = open_measurement_of(&model, &options.measurement)?;
    let by = options.by.map_or_else(|| By::of(&model), Ok)?;
    let digest = model.digest_of(&[Stage::Tile, by.stage()])?;
    let (values, tile) = (TileValues::of_model(&model, by, context)?, model.tile()?);
    let ledger = Ledger::of_model(&model, by, measurement.description(), tile.size.texels())?;
    Ok(Subject { measurement, tile, values, ledger, digest })
}

/// Opens the measurement of a model.
///
/// # Errors
/// Where the model is of another one.
pub fn open_measurement(model: &Path, measurement: &Path) -> Result<Measurement> {
    open_measurement_of(&Model::open(model)?, measurement)
}

fn open_packed(options: &Options, context: &Context<'_>) -> Result<Subject> {
    let name = options.model.display();
    if options.by == Some(By::Clusters) {
        return Err(Error::usage(format!("{name}: a packed model has components and no clusters"))
            .hint("leave out --by"));
    }
    let packed = Packed::open(&options.model, context)?;
    let description = &packed.description;
    let (measurement, tile, of) = match &options.tile_of {
        Some(path) => {
            let model = Model::open(path)?;
            let measurement = open_measurement_of(&model, &options.measurement)?;
            let other = match (&packed.tile, &packed.measurement) {
                (Some(tile), _) => !model.stage_digest(Stage::Tile)?.starts_with(tile.as_str()),
                (None, Some(digest)) => digest != measurement.digest(),
                (None, None) => false,
            };
            if other {
                return Err(Error::recipe(format!(
                    "{name} was not packed from {}, or from it as it was before",
                    path.display()
                ))
                .hint("name the model that it was packed from"));
            }
            (measurement, model.tile()?, path.as_path())
        }
        None => {
            let measurement = Measurement::open(&options.measurement)?;
            expect_whole(&packed, &measurement, &options.model)?;
            let tile = Tile::whole(measurement.description().size, packed.wraps);
            (measurement, tile, options.measurement.as_path())
        }
    };
    let measured = measurement.description();
    let same = tile.size == description.size
        && measured.channels == description.channels
        && same_directions(&measured.views, &description.views)
        && same_directions(&measured.lights, &description.lights);
    if !same {
        return Err(Error::recipe(format!(
            "{name}: its tile is not that of {}: another size, other channels or directions",
            of.display()
        ))
        .hint("name what the packed model was made of"));
    }
    let digest = packed.digest.clone();
    let components = packed.components.count();
    let ledger = Ledger::of_packed(packed.file_bytes, components, measured, tile.size.texels());
    Ok(Subject { tile, values: TileValues::of_opened(packed)?, ledger, digest, measurement })
}

/// Checks that the tile of a packed model is all of a measurement.
fn expect_whole(packed: &Packed, measurement: &Measurement, file: &Path) -> Result<()> {
    let (name, of) = (file.display(), measurement.path().display());
    match packed.measurement.as_deref() {
        Some(digest) if digest == measurement.digest() => Ok(()),
        Some(_) => {
            Err(Error::recipe(format!("{name} was not made of {of}, or of it as it was imported before"))
                .hint("name the measurement that it was made of"))
        }
        None => {
            Err(Error::usage(format!("{name}: its tile was cut from a measurement, it does not say where"))
                .hint("name the model that it was packed from: --tile-of MODEL"))
        }
    }
}

/// How near directions are that are one, in each coordinate: files hold them as degrees of finite precision.
const NEAR: f64 = 1e-3;

/// Whether two lists of directions are one, but for the precision of files.
pub(crate) fn same_directions(a: &[Direction], b: &[Direction]) -> bool {
    let near = |(a, b): (&Direction, &Direction)| {
        a.vector().iter().zip(b.vector()).all(|(a, b)| (a - b).abs() < NEAR)
    };
    a.len() == b.len() && a.iter().zip(b).all(near)
}

/// Re-makes the tile under every pair of directions and compares it with the measurement.
///
/// # Errors
/// Those of reading, and too little memory.
pub fn run(subject: &Subject, context: &Context<'_>) -> Result<Report> {
    let views: Vec<usize> = (0..subject.measurement.description().views.len()).collect();
    let comparison = Comparison::open(subject)?;
    let sums = comparison.sums(&views, context, |_, _| Ok(()))?;
    Ok(comparison.report(&sums))
}

/// As [`run`], shared between runs: each view's sums are kept in a folder, and whoever finds all of them adds them up, in
/// the order of the views.
///
/// # Errors
/// As [`run`]; and [`crate::ErrorKind::Missing`] where nothing is to be compared but something is missing.
pub fn run_shared(subject: &Subject, sharing: &Sharing, context: &Context<'_>) -> Result<Shared<Report>> {
    let what = json!({
        "stage": "compare", "method": METHOD, "measurement": subject.measurement.digest(),
        "model": subject.digest,
    });
    let comparison = Comparison::open(subject)?;
    let counts = comparison.counts();
    let views = subject.measurement.description().views.len();
    sharing.run(
        &Work { what: &what, units: views, words: ["view", "compared"] },
        |sums: &Sums| sums.expect_possible(&counts),
        |missing, partial| {
            comparison.sums(missing, context, |view, sums| partial.write(view, sums)).map(|_| ())
        },
        |sums| Ok(comparison.report(&sums)),
    )
}

/// A model and a measurement, with what all views have in common.
struct Comparison<'a> {
    measurement: &'a Measurement,
    bounds: Window,
    /// Texels of the tile, within the bounds.
    offsets: Vec<usize>,
    modelled: TileSamples<'a>,
    /// Of so many texels one's colours are compared.
    stride: usize,
}

impl<'a> Comparison<'a> {
    fn open(Subject { measurement, tile, values, .. }: &'a Subject) -> Result<Self> {
        let modelled = values.samples()?;
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

    /// What a view's sums must count.
    fn counts(&self) -> Counts {
        let description = self.measurement.description();
        let (lights, texels) = (description.lights.len() as u64, self.offsets.len() as u64);
        Counts {
            texels: texels * lights,
            samples: texels * description.texel_samples() as u64,
            colours: self.offsets.len().div_ceil(self.stride) as u64 * lights,
        }
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn sums_that_no_view_has_are_refused() {
        let counts = Counts { texels: 12, samples: 36, colours: 2 };
        let mut sums = Sums { views: 1, code_count: 12, sample_count: 30, left_out: 6, ..Sums::default() };
        sums.add_colour(0.5);
        sums.add_colour(200.0);
        sums.expect_possible(&counts).unwrap();
        type Change = fn(&mut Sums);
        let changes: [(Change, &str); 10] = [
            (|sums| sums.views = usize::MAX, "views: got 18446744073709551615, expected 1"),
            (|sums| sums.views = 0, "views: got 0"),
            (|sums| sums.code_count = u64::MAX, "texels: got"),
            (|sums| sums.left_out = u64::MAX, "samples: got more than can be counted"),
            (|sums| sums.sample_count = 31, "samples: got 37, expected 36"),
            (|sums| sums.colour_count = 3, "colours: got 3"),
            (|sums| sums.colours = vec![u64::MAX, 3], "colours by steps: got more than can be counted"),
            (|sums| sums.codes = 12 * 255 + 1, "beyond the largest"),
            (|sums| sums.squares = -1.0, "expected finite ones"),
            (|sums| sums.colour = f64::INFINITY, "expected finite ones"),
        ];
        for (change, told) in changes {
            let mut changed = sums.clone();
            change(&mut changed);
            let error = changed.expect_possible(&counts).unwrap_err().to_string();
            assert!(error.contains(told), "{error}");
        }
    }
}
