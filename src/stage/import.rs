//! Archive to measurement: read the images of a view, arrange them texel by texel, write one shard.

use std::path::{Path, PathBuf};

use btfkit_formats::Samples;
use serde::Serialize;
use serde_json::{Value, json};

use crate::archive::Source;
use crate::color::{Remarkable, Transfer};
use crate::error::{Error, ErrorKind, Result};
use crate::run::progress::Counted;
use crate::run::recipe::Recipe;
use crate::run::shard::Shard;
use crate::run::units::each_at_once;
use crate::run::{Context, read_ahead};
use crate::shape::Size;
use crate::store::measurement::gather::Images;
use crate::store::measurement::{Description, ImportRecipe, Measurement};
use crate::words::counted;
use crate::zarr::codec::Chain;

/// How an archive is turned into a measurement.
#[derive(Clone, Debug)]
pub struct Options {
    /// The measurement store to make.
    pub store: PathBuf,
    /// Reflectance that counts as L* = 100.
    pub white: f64,
    /// How chunks are packed.
    pub codec: Chain,
    /// The part of the views that this run imports.
    pub shard: Shard,
}

impl Options {
    /// All views; reflectance 1 is white; packed so that every reader of Zarr opens the store.
    pub fn new(store: impl Into<PathBuf>) -> Self {
        Self { store: store.into(), white: 1.0, codec: Chain::Stock, shard: Shard::WHOLE }
    }
}

/// An import, ready to run.
pub struct Plan<'a> {
    source: &'a dyn Source,
    options: Options,
    description: Description,
    recipe: ImportRecipe,
}

/// How an import went.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Views of this run's part that were in the store before.
    pub views_found: usize,
    /// Views written by this run.
    pub views_written: usize,
    /// What was found in the samples of the views written.
    pub samples: Remarkable,
}

/// What a measurement of an archive will hold.
pub fn describe(source: &dyn Source, white: f64) -> Description {
    let contents = source.contents();
    Description {
        size: Size::new(contents.height as usize, contents.width as usize),
        channels: contents.channels.clone(),
        sample_type: contents.sample_type,
        views: contents.views.clone(),
        lights: contents.lights.clone(),
        transfer: if contents.linear { Transfer::Linear } else { Transfer::Srgb },
        white,
    }
}

/// Memory of one view in flight: its images, and both shards twice, as chunks and put together; and a file that is being
/// decoded.
pub(crate) fn unit_bytes(description: &Description, source: &dyn Source) -> u64 {
    let codes = (description.size.texels() * description.lights.len()) as u64;
    3 * description.view_bytes() + 2 * codes + source.bytes_beside_image()
}

/// Looks at the whole archive without decoding it, and fixes the recipe.
pub fn plan<'a>(source: &'a dyn Source, options: Options, context: &Context<'_>) -> Result<Plan<'a>> {
    let description = describe(source, options.white);
    description.decoder().map_err(|error| error.context(source.path().display()))?;
    let contents = source.contents();
    let recipe = ImportRecipe {
        format: contents.format.clone(),
        images: source.check(context)?,
        reading: serde_json::to_value(source.reading())
            .map_err(|error| Error::internal(error.to_string()))?,
        assumptions: contents.assumptions.iter().map(|assumption| assumption.text.clone()).collect(),
        ..ImportRecipe::of(&description, options.codec)
    };
    Ok(Plan { source, options, description, recipe })
}

/// A recipe for people to read: of long lists, such as those of directions, only how much is in them.
fn shortened(recipe: Value) -> Value {
    /// More than that is nobody's to read.
    const LONGEST: usize = 8;
    match recipe {
        Value::Array(list) if list.len() > LONGEST => format!("{} entries", list.len()).into(),
        Value::Array(list) => list.into_iter().map(shortened).collect(),
        Value::Object(members) => members.into_iter().map(|(name, value)| (name, shortened(value))).collect(),
        other => other,
    }
}

impl Plan<'_> {
    /// What would be done, for people and schedulers.
    pub fn summary(&self) -> Value {
        json!({
            "stage": "import",
            "store": self.options.store.display().to_string(),
            "size": self.description.size.to_string(),
            "views": self.description.views.len(),
            "lights": self.description.lights.len(),
            "channels": self.description.channels,
            "samples": self.description.sample_type.name(),
            "raw_bytes": self.description.bytes(),
            "unit": "view",
            "units": self.views().count(),
            "unit_memory_bytes": self.unit_bytes(),
            "recipe": shortened(self.recipe.to_value().unwrap_or_default()),
        })
    }

    /// What the measurement will hold.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Images that a run of this plan goes through.
    pub fn images(&self) -> u64 {
        (self.views().count() * self.description.lights.len()) as u64
    }

    fn views(&self) -> impl Iterator<Item = usize> {
        (0..self.description.views.len()).filter(|&view| self.options.shard.has(view))
    }

    fn unit_bytes(&self) -> u64 {
        unit_bytes(&self.description, self.source)
    }

    /// Imports the views that are not in the store yet.
    pub fn run(&self, context: &Context<'_>) -> Result<Report> {
        let unit = format!(
            "importing views of {} under {}",
            self.description.size,
            counted(self.description.lights.len(), "light")
        );
        context.require(&unit, self.unit_bytes())?;
        let measurement = Measurement::create(
            &self.options.store,
            self.description.clone(),
            self.options.codec,
            self.recipe.clone(),
            &self.source.contents().remarks,
            context,
        )?;
        let (found, missing): (Vec<usize>, Vec<usize>) =
            self.views().partition(|&view| measurement.has_view(view));
        context.progress.begin("import", self.images(), Counted::Items("images"));
        context.progress.advance((found.len() * self.description.lights.len()) as u64);
        let codes = self.description.codes()?;
        let in_flight = read_ahead::in_flight(context.work_bytes(), self.unit_bytes());
        let Description { size, sample_type, .. } = self.description;
        let channels = self.description.n_channels();
        let mut samples = Remarkable::default();
        let mut problems = Vec::new();
        // One view is written while the next is decoded; the threads share the work of each.
        let read = |&view: &usize| match read_view(self.source, view, self.options.white, context) {
            // A broken image does not keep the others from being looked at: all are named at the end.
            Err(error) if error.kind() == ErrorKind::Input => Ok((view, Err(error.to_string()))),
            images => Ok((view, Ok(images?))),
        };
        read_ahead::for_each(context, in_flight, &missing, read, |(view, images)| {
            match images {
                Ok((images, before)) => {
                    let stored = context.install(|| {
                        let images = Images::new(size, channels, sample_type, images)?;
                        measurement.write_view(view, &images, &codes)
                    })?;
                    samples += before.unwrap_or(stored);
                }
                Err(problem) => problems.push(problem),
            }
            Ok(())
        })?;
        context.progress.end();
        if !problems.is_empty() {
            return Err(Error::list(ErrorKind::Input, problems.iter().flat_map(|problem| problem.lines()))
                .hint("replace these images and import again: if they have changed, with --force"));
        }
        measurement.finish(context)?;
        Ok(Report { views_found: found.len(), views_written: missing.len(), samples })
    }
}

/// Groups of images of a view: lights, and their samples [light, y, x, channel].
pub(crate) type Groups = Vec<(std::ops::Range<usize>, Samples)>;

/// The images of a view, read on the threads of the pool that this is called in; and what was found in them before they
/// were converted, where they were.
///
/// # Errors
/// Names every unusable image of the view.
pub(crate) fn read_view(
    source: &dyn Source,
    view: usize,
    white: f64,
    context: &Context<'_>,
) -> Result<(Groups, Option<Remarkable>)> {
    let lights = source.contents().lights.len();
    let step = source.lights_at_once().clamp(1, lights);
    let groups: Vec<_> = (0..lights).step_by(step).map(|first| first..(first + step).min(lights)).collect();
    let read = each_at_once(&groups, source.bytes_beside_image(), context, |group| {
        context.check_stop()?;
        let samples = source.read_counted(view, group.clone(), white);
        context.progress.advance(group.len() as u64);
        samples.map(|samples| (group.clone(), samples))
    });
    context.check_stop()?;
    let mut problems = Vec::new();
    let mut images = Vec::new();
    let mut before: Option<Remarkable> = None;
    for group in read {
        match group {
            Ok((group, (samples, found))) => {
                images.push((group, samples));
                if let Some(found) = found {
                    *before.get_or_insert_default() += found;
                }
            }
            Err(error) if error.kind() == ErrorKind::Input => problems.push(error.to_string()),
            Err(error) => return Err(error),
        }
    }
    if problems.is_empty() {
        Ok((images, before))
    } else {
        Err(Error::list(ErrorKind::Input, problems.iter().flat_map(|problem| problem.lines())))
    }
}

/// The store that an archive goes to where none is named: its name with `.zarr`, in a folder.
pub fn default_store(archive: &Path, folder: &Path) -> PathBuf {
    let mut name = archive.file_stem().unwrap_or_default().to_owned();
    name.push(".zarr");
    folder.join(name)
}
