use std::path::{Path, PathBuf};

use btfkit::error::{Error, Result};
use btfkit::run::Context;
use btfkit::run::progress::{Counted, Progress};
use btfkit::stage::import::{self, Report, Shard};
use btfkit::store::measurement::Description;
use btfkit::store::recognise::expect_readable;
use btfkit::words::counted;
use btfkit::zarr::codec::Chain;
use clap::Args;

use super::each::{Ended, Line, each};
use super::outputs::wanted_twice;
use super::source::SourceArgs;
use super::{Tell, bytes_text, number};

/// Convert archives into measurements, from any format that `btf info` lists; one archive or hundreds
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf import UBO_WOOD256.zip                      makes UBO_WOOD256.zarr here
  btf import MANYFILES/ wood.zarr --threads 2     a folder of images, or of zips
  btf import tv*.zip wood.zarr                    one measurement in many pieces; the store comes last
  btf import *.zip *.btf --into stores            many archives, one store each; a bad one does not stop the others
  btf import felt.btf --shard 3/8                 the fourth of eight parts, for an array of jobs
  btf import wall.btf --codec predictive          a tenth to a fifth smaller; zarr-python needs our module to read it
If it is interrupted, run the same command again: it goes on with the views that are missing.")]
pub(super) struct Import {
    /// Archives, and last the measurement to make, if that name ends in .zarr and --into is not given
    #[arg(required = true, value_name = "ARCHIVE")]
    paths: Vec<PathBuf>,
    /// Make one measurement for each archive, in this folder [default: the current folder]
    #[arg(long, value_name = "DIR")]
    into: Option<PathBuf>,
    #[command(flatten)]
    source: SourceArgs,
    /// Reflectance that counts as white, L* = 100
    #[arg(long, default_value_t = 1.0, value_parser = number::white)]
    white: f64,
    /// How to pack samples: `stock` opens in zarr-python as it is, `predictive` is smaller and faster
    #[arg(long, value_name = "stock|predictive", default_value = "stock")]
    codec: Chain,
    /// Import part K of N of the views (K from 0)
    #[arg(long, value_name = "K/N", default_value = "0/1")]
    shard: Shard,
    /// Print what would be done, and do nothing
    #[arg(long)]
    dry_run: bool,
}

/// One archive and its store.
struct Job {
    pieces: Vec<PathBuf>,
    store: PathBuf,
}

impl Import {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<Ended> {
        let jobs = self.jobs()?;
        let [job] = jobs.as_slice() else { return self.import_all(&jobs, context, tell) };
        if let Some((description, report, remarks)) = self.import(job, context, tell)? {
            tell.line(format!("{}: {}", job.store.display(), told(&description, &report)));
            remarks.iter().for_each(|remark| tell.line(format!("  {remark}")));
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
            return Err(
                if self.into.is_none() && self.paths.len() > 1 && Some(absent) == self.paths.last() {
                    error.hint("the store to make is named last, and ends in .zarr")
                } else if let Some((store, archive)) = self.swapped() {
                    error.hint(format!(
                        "the archive comes first and the store last: btf import {} {}",
                        archive.display(),
                        store.display()
                    ))
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
        tell: Tell,
    ) -> Result<Option<(Description, Report, Vec<String>)>> {
        let source = self.source.open(&job.pieces)?;
        let options = import::Options {
            store: job.store.clone(),
            white: self.white,
            codec: self.codec,
            shard: self.shard,
        };
        let plan = import::plan(source.as_ref(), options, context)?;
        if self.dry_run {
            tell.plan(&plan.summary())?;
            return Ok(None);
        }
        let report = plan.run(context)?;
        let assumed = source.contents().assumptions.iter().map(|text| format!("assumed: {text}"));
        let remarks = btfkit::archive::notes(source.as_ref()).into_iter().chain(assumed).collect();
        Ok(Some((plan.description().clone(), report, remarks)))
    }

    /// Imports many archives under one bar; those that fail do not stop the others.
    fn import_all(&self, jobs: &[Job], context: &Context<'_>, tell: Tell) -> Result<Ended> {
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
        each(jobs, name, false, context, tell, |job| {
            context.progress.remark(&name(job));
            let report = self.import(job, &inner, tell)?;
            let told = report.map(|(description, report, remarks)| {
                std::iter::once(told(&description, &report)).chain(remarks).collect::<Vec<_>>().join("; ")
            });
            let store = job.store.display();
            Ok((Line::Text(told.map_or(format!("{store}"), |told| format!("{store}: {told}"))), None))
        })
    }
}

/// Whether a path is that of a store, made or to be made.
fn is_store(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "zarr") || path.join("zarr.json").exists()
}

fn told(description: &Description, report: &Report) -> String {
    let mut text = format!(
        "{} x {} of {}, {} raw; {} written, {} found done, {} clipped at white",
        counted(description.views.len(), "view"),
        counted(description.lights.len(), "light"),
        description.size,
        bytes_text(description.bytes()),
        counted(report.views_written, "view"),
        report.views_found,
        counted(report.samples.clipped, "sample")
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
