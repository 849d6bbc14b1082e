use std::path::{Path, PathBuf};

use btfkit::error::{Error, Result};
use btfkit::run::Context;
use btfkit::run::progress::{Counted, Progress};
use btfkit::run::shard::Shard;
use btfkit::stage::import::{self, Report};
use btfkit::store::measurement::Description;
use btfkit::store::recognise::expect_readable;
use btfkit::words::counted;
use btfkit::zarr::codec::Chain;
use btfkit_formats::SampleType;
use clap::Args;

use super::each::{Ended, Line, each};
use super::given::{is_store, kind_at};
use super::outputs::wanted_twice;
use super::source::SourceArgs;
use super::{Console, bytes_text, number};

/// Convert archives of any common format into stores; one archive or hundreds
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf import UBO_WOOD256.zip                      makes UBO_WOOD256.zarr here
  btf import MANYFILES/ wood.zarr --threads 2     a folder of images, or of zips
  btf import tv*.zip wood.zarr                    one measurement in many pieces; the store comes last
  btf import *.zip *.btf --into stores            many archives, one store each; a bad one does not stop the others
  btf import felt.btf --shard 3/8                 the fourth of eight parts, for an array of jobs
  btf import wall.btf --codec predictive          a tenth to a fifth smaller
If it is interrupted, run the same command again: it goes on with the views that are missing.")]
pub(super) struct Import {
    /// The archive, then the store to make [default: the archive's name with .zarr]; or many archives. A last name that
    /// ends in .zarr is the store, and all names before it are pieces of one measurement
    #[arg(required = true, value_name = "ARCHIVE")]
    paths: Vec<PathBuf>,
    /// Make one store for each archive, in this folder [default: the current folder]
    #[arg(long, value_name = "DIR")]
    into: Option<PathBuf>,
    /// Reflectance that counts as white, L* = 100; less for very dark materials
    #[arg(long, default_value_t = 1.0, value_parser = number::white)]
    white: f64,
    /// How to pack samples: `predictive` is smaller and faster, but zarr-python needs a module to read it
    #[arg(long, value_name = "stock|predictive", default_value = "stock")]
    codec: Chain,
    /// Import only part K of N of the views, K from 0, so that N jobs share the work, in any order; `env` takes both
    /// from the variables of Slurm or MPI
    #[arg(long, value_name = "K/N|env", default_value = "0/1")]
    shard: Shard,
    /// Print what would be done, and do nothing
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    source: SourceArgs,
}

/// One archive and its store.
struct Job {
    pieces: Vec<PathBuf>,
    store: PathBuf,
}

impl Import {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<Ended> {
        let jobs = self.jobs()?;
        let [job] = jobs.as_slice() else { return self.import_all(&jobs, context, console) };
        if let Some((description, report, remarks)) = self.import(job, context, console)? {
            console.line(format!("{}: {}", job.store.display(), summary(&description, &report)));
            remarks.iter().for_each(|remark| console.line(format!("  {remark}")));
        }
        Ok(Ended::Done)
    }

    /// The store and the archive, where they are named in the wrong order.
    fn swapped(&self) -> Option<(&Path, &Path)> {
        match self.paths.as_slice() {
            [store, .., archive] if self.into.is_none() && is_store(store) && !is_store(archive) => {
                Some((store, archive))
            }
            _ => None,
        }
    }

    fn jobs(&self) -> Result<Vec<Job>> {
        let folder = self.into.clone().unwrap_or_default();
        // Misspelt, the last of many archives is not to become a store.
        let is_new = |path: &Path| {
            self.into.is_none() && is_store(path) && self.paths.last().is_some_and(|last| last == path)
        };
        if let Some(absent) = self.paths.iter().find(|path| !(path.exists() || is_new(path))) {
            expect_readable(absent)?;
            let error = Error::missing(format!("{}: no such archive", absent.display()));
            if is_store(absent) {
                return Err(error.hint("archives come first, and the store to make is named last"));
            }
            return Err(
                if self.into.is_none() && self.paths.len() > 1 && Some(absent) == self.paths.last() {
                    error.hint("the store to make is named last, and ends in .zarr")
                } else {
                    error
                },
            );
        }
        if let Some((store, archive)) = self.swapped() {
            return Err(Error::usage(format!(
                "got the store {} before {}, expected the archive first and the store last",
                store.display(),
                archive.display()
            ))
            .hint(format!("btf import {} {}", archive.display(), store.display())));
        }
        match self.paths.split_last() {
            Some((store, pieces)) if self.into.is_none() && is_store(store) && !pieces.is_empty() => {
                Ok(vec![Job { pieces: pieces.to_vec(), store: store.clone() }])
            }
            _ => {
                let job = |path: &PathBuf| Job {
                    pieces: vec![path.clone()],
                    store: import::default_store(path, &folder),
                };
                let jobs: Vec<Job> = self.paths.iter().map(job).collect();
                match wanted_twice(jobs.iter().map(|job| job.store.as_path())) {
                    Some(store) => {
                        Err(Error::usage(format!("two archives would both become {}", store.display()))
                            .hint("import them one by one and name the stores"))
                    }
                    None => Ok(jobs),
                }
            }
        }
    }

    /// Imports one archive; with what a user should know of it, a line each. `None` after a dry run.
    fn import(
        &self,
        job: &Job,
        context: &Context<'_>,
        console: Console,
    ) -> Result<Option<(Description, Report, Vec<String>)>> {
        if let Some((store, kind)) = job.pieces.iter().find_map(|piece| Some((piece, kind_at(piece)?))) {
            let what = format!("{} is a store already (a {kind}), expected an archive", store.display());
            return Err(
                Error::usage(what).hint("copy it as a folder, or name the archive that it was made of")
            );
        }
        let source = self.source.open(&job.pieces).map_err(|error| match job.pieces.as_slice() {
            // Of several names the last may have been meant for the stores.
            [folder] if self.paths.len() > 1 && self.paths.last() == Some(folder) && folder.is_dir() => {
                let todo = error.guidance().map_or(String::new(), |hint| format!("{hint}; "));
                error.hint(format!("{todo}if stores are to be put there: --into {}", folder.display()))
            }
            _ => error,
        })?;
        let options = import::Options {
            store: job.store.clone(),
            white: self.white,
            codec: self.codec,
            shard: self.shard,
        };
        let plan = import::plan(source.as_ref(), options, context)?;
        if self.dry_run {
            console.plan(&plan.summary())?;
            return Ok(None);
        }
        let report = plan.run(context)?;
        let samples = plan.description().sample_type;
        let is_cut = report.samples.clipped > 0
            && !holds_highlights(samples)
            && (self.white - 1.0).abs() < f64::EPSILON;
        let lost = is_cut.then(|| {
            format!(
                "{} above white became white, as {} samples hold no more: --samples f16 keeps them",
                counted(report.samples.clipped, "sample"),
                samples.name()
            )
        });
        let options = source.reading().options();
        let read_with = (!options.is_empty()).then(|| format!("read with {}", options.join(" ")));
        let found = (report.views_found > 0).then(|| {
            format!(
                "what was found done was not read again: btf verify {} reads all of it",
                job.store.display()
            )
        });
        let assumed = source.contents().assumptions.iter().map(|text| format!("assumed: {text}"));
        let remarks = btfkit::archive::notes(source.as_ref())
            .into_iter()
            .chain(assumed)
            .chain(lost)
            .chain(read_with)
            .chain(found)
            .collect();
        Ok(Some((plan.description().clone(), report, remarks)))
    }

    /// Imports many archives under one bar; those that fail do not stop the others.
    fn import_all(&self, jobs: &[Job], context: &Context<'_>, console: Console) -> Result<Ended> {
        // Counted before anything is imported: opening an archive is cheap.
        let images = |job: &Job| {
            let contents = self.source.open(&job.pieces).map(|source| {
                (0..source.contents().views.len()).filter(|&view| self.shard.has(view)).count()
                    * source.contents().lights.len()
            });
            contents.map_or(0, |images| images as u64)
        };
        let total = jobs.iter().map(images).sum();
        context.progress.begin("import", total, Counted::Items("images"));
        let overall = Overall { bar: context.progress };
        let inner = Context::new(&overall, context.stop, context.threads, context.memory_bytes)?
            .with_memory(context.memory())
            .with_existing(context.existing);
        let name = |job: &Job| job.pieces.first().map_or_else(String::new, |path| path.display().to_string());
        each(jobs, name, false, context, console, |job| {
            context.progress.remark(&name(job));
            let report = self.import(job, &inner, console)?;
            let told = report.map(|(description, report, remarks)| {
                std::iter::once(summary(&description, &report)).chain(remarks).collect::<Vec<_>>().join("; ")
            });
            let store = job.store.display();
            Ok((Line::Text(told.map_or(format!("{store}"), |told| format!("{store}: {told}"))), None))
        })
    }
}

/// Whether samples of a type can be above white.
fn holds_highlights(samples: SampleType) -> bool {
    matches!(samples, SampleType::F16 | SampleType::F32)
}

fn summary(description: &Description, report: &Report) -> String {
    let mut text = format!(
        "{} x {} of {}, {} raw; {} written, {} found done, {} {}",
        counted(description.views.len(), "view"),
        counted(description.lights.len(), "light"),
        description.size,
        bytes_text(description.bytes()),
        counted(report.views_written, "view"),
        report.views_found,
        counted(report.samples.clipped, "sample"),
        if holds_highlights(description.sample_type) { "above white" } else { "clipped at white" }
    );
    for (count, what) in [(report.samples.not_finite, "not finite"), (report.samples.negative, "negative")] {
        if count > 0 {
            text.push_str(&format!(", {count} {what}"));
        }
    }
    text
}

/// The progress of one archive as a part of the whole.
struct Overall<'a> {
    bar: &'a dyn Progress,
}

impl Progress for Overall<'_> {
    fn begin(&self, _: &str, _: u64, _: Counted) {}

    fn advance(&self, count: u64) {
        self.bar.advance(count);
    }

    fn remark(&self, text: &str) {
        self.bar.remark(text);
    }

    fn end(&self) {}

    fn pause(&self, act: &mut dyn FnMut()) {
        self.bar.pause(act);
    }

    fn notice(&self, text: &str) {
        self.bar.notice(text);
    }
}
