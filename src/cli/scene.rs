use std::path::{Path, PathBuf};

use btfkit::error::Result;
use btfkit::shape::Area;
use btfkit::stage::image::{Options, PlaneOptions, Subject, Values};
use btfkit::store::{measurement, model};
use btfkit_formats::Direction;
use clap::{Args, ValueEnum};

use super::given::{Given, kind_at};
use super::number;

/// What a picture shows.
#[derive(Args)]
pub(super) struct SceneArgs {
    /// Direction of the light, theta,phi in degrees: theta from the normal, phi counter-clockwise from the right
    #[arg(long, default_value = "15,0", allow_hyphen_values = true)]
    pub(super) light: Direction,
    /// Direction of the view, theta,phi in degrees
    #[arg(long, default_value = "0,0", allow_hyphen_values = true)]
    pub(super) view: Direction,
    /// Show only this part: x,y,width,height in texels, where x,y is its top left corner
    #[arg(long, allow_hyphen_values = true)]
    window: Option<Area>,
    /// Brightness: a factor on the linear values, above 0
    #[arg(long, default_value_t = 1.0, value_parser = number::exposure)]
    pub(super) exposure: f64,
    /// Which values texels have [default: model]
    #[arg(long, value_enum)]
    values: Option<ValuesName>,
    /// The measurement; implies --values measured [default: where it was when the model was made; else beside
    /// the model or in the current folder, without .model in its name]
    #[arg(long)]
    measurement: Option<PathBuf>,
    /// The model of an enlargement [default: where it was when the enlargement was made; else of that name beside it
    /// or in the current folder]
    #[arg(long)]
    model: Option<PathBuf>,
    /// Show a part of the endless surface of a model, without storing it; --window says which part, and its x and y may
    /// be negative
    #[arg(long)]
    plane: bool,
    #[command(flatten)]
    variation: PlaneArgs,
}

/// Which endless surface of a model.
#[derive(Args)]
pub(super) struct PlaneArgs {
    /// Seed of the endless surface
    #[arg(long, requires = "plane", default_value_t = 1)]
    seed: u32,
    /// Jitter of the endless surface, from 0 to 1, as in `btf enlarge`
    #[arg(long, requires = "plane", value_parser = number::jitter)]
    jitter: Option<u32>,
}

impl PlaneArgs {
    pub(super) fn options(&self) -> PlaneOptions {
        PlaneOptions { seed: self.seed, jitter: self.jitter }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum ValuesName {
    /// Those of the model's clusters
    Model,
    /// Those of the model's components (btf components)
    Components,
    /// Those that were measured where each texel comes from, so nothing is lost by clustering
    Measured,
}

impl SceneArgs {
    /// Refuses options that would change nothing of what is shown of a store; `is_lit` says whether that has a light.
    pub(super) fn refuse_idle(&self, given: &Given, source: &Path, is_lit: bool) -> Result<()> {
        if !is_lit {
            let lit = ["light", "view", "exposure", "values", "measurement"];
            given.refuse_these(&lit, "in a picture of cluster numbers or of normals, which has no light")?;
        }
        if matches!(self.values, Some(ValuesName::Model)) {
            given
                .refuse_these(&["measurement"], "beside --values model: values are those of the clusters")?;
        }
        if matches!(self.values, Some(ValuesName::Components)) {
            let beside = "beside --values components: values are those of the components";
            given.refuse_these(&["measurement"], beside)?;
        }
        match kind_at(source) {
            Some(measurement::KIND) => given.refuse_these(
                &["values", "measurement", "model"],
                "in a picture of a measurement, which has its own values",
            ),
            Some(model::KIND) => given
                .refuse_these(&["model"], "in a picture of a model: it names the model of an enlargement"),
            _ => Ok(()),
        }
    }

    pub(super) fn options(&self, source: &Path, subject: Subject) -> Options {
        Options {
            source: source.to_owned(),
            model: self.model.clone(),
            subject,
            values: match (self.values, &self.measurement) {
                (Some(ValuesName::Model), _) | (None, None) => Values::Model,
                (Some(ValuesName::Components), _) => Values::Components,
                _ => Values::Measured(self.measurement.clone()),
            },
            plane: self.plane.then(|| self.variation.options()),
            window: self.window,
        }
    }
}
