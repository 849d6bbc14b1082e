//! Jobs for Slurm: a folder of shell scripts, to be read and edited, that take materials from archives to surfaces.
//!
//! The scripts hold no queue and no state. Each task runs one command of the program on one part of a material; what is
//! done is what lies on the disk. If materials are divided into parts, each has a chain of jobs of its own. If they are
//! not, one array for each stage goes over all of them.

mod estimate;
mod scripts;
mod shell;

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use crate::archive;
use crate::disk::output::{Made, prepare_bytes, publish_all};
use crate::error::{Error, ErrorKind, Result};
use crate::names::with_ending;
use crate::run::Context;
use crate::shape::Size;
use crate::stage::enlarge::{By, blocks_of};
use crate::stage::{deepzoom, import, tile};
use crate::store::measurement::{self, Measurement};
use crate::store::{kind_of, recognise};
use estimate::{Facts, Need, Needs};

/// The most tasks of one array: a Slurm that is set up as it comes takes indexes up to 1000.
pub const MOST_TASKS: usize = 1000;

/// What the jobs are to do, and what they are given.
#[derive(Clone, Debug)]
pub struct Options {
    /// The program, as all nodes see it.
    pub program: PathBuf,
    /// The folder of the scripts.
    pub folder: PathBuf,
    /// Archives and measurements.
    pub inputs: Vec<PathBuf>,
    /// The folder of all stores that are made; where absent, the current folder for measurements, and that of each
    /// measurement for what is made of it.
    pub into: Option<PathBuf>,
    /// Most parts of an import, of an enlargement that can be made in parts, and of a pyramid.
    pub parts: usize,
    /// Parts of a pass of the clustering. With one, a single job makes the model.
    pub cluster_parts: usize,
    /// Processors of a task.
    pub cpus: usize,
    /// Memory that the program may use, unless it needs more.
    pub memory_bytes: u64,
    /// Time limit of every task, instead of an estimate.
    pub minutes: Option<u32>,
    /// What the tile is, if that is said.
    pub tile: Option<tile::Choice>,
    /// Number of clusters, if it is said.
    pub clusters: Option<usize>,
    /// What is made of each model.
    pub surface: Option<Surface>,
    /// Whether pyramids are made of the enlargements.
    pub pyramids: bool,
    /// Options of sbatch.
    pub sbatch: Vec<String>,
}

impl Options {
    /// Whether materials are divided into parts.
    fn in_parts(&self) -> bool {
        self.parts > 1 || self.cluster_parts > 1
    }
}

/// An enlargement.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Its size.
    pub size: Size,
    /// The method, as the command line names it.
    pub method: String,
    /// The method, as it is unless more is said.
    pub by: By,
}

/// Parts that the work on a material is divided into: no more than there are units of work in the largest.
#[derive(Clone, Copy, Debug)]
struct Parts {
    import: usize,
    cluster: usize,
    enlarge: usize,
    pyramid: usize,
}

impl Parts {
    /// `known` holds what is known of `materials` materials.
    fn of(options: &Options, known: &[Facts], materials: usize) -> Self {
        let views = known.iter().map(|facts| facts.description.views.len()).max();
        // What is not known may have any number of views.
        let views = views.filter(|_| known.len() == materials).unwrap_or(usize::MAX);
        let (mut enlarge, mut pyramid) = (1, 1);
        if let Some(Surface { size, by, .. }) = &options.surface {
            enlarge = match by {
                // They go from the top down.
                By::Paper(_) | By::Quilt(_) => 1,
                By::Coherent(_) | By::Patches(_) => blocks_of(*size),
            };
            pyramid = size.height.div_ceil(deepzoom::TILE_SIDE);
        }
        let [import, enlarge, pyramid] =
            [views, enlarge, pyramid].map(|units| options.parts.min(units).max(1));
        Self { import, cluster: options.cluster_parts, enlarge, pyramid }
    }
}

/// A material: what it is read from, and what is made of it. All paths are absolute.
struct Material {
    archive: Option<PathBuf>,
    measurement: PathBuf,
    model: PathBuf,
    plane: Option<PathBuf>,
    pyramid: Option<PathBuf>,
}

impl Material {
    fn outputs(&self) -> impl Iterator<Item = &Path> {
        let measurement = self.archive.is_some().then_some(&self.measurement);
        measurement
            .into_iter()
            .chain([&self.model])
            .chain(&self.plane)
            .chain(&self.pyramid)
            .map(PathBuf::as_path)
    }
}

/// A script to write.
struct Script {
    name: &'static str,
    text: Vec<u8>,
    /// Whether it may be run by its name.
    is_run: bool,
}

/// A stage of the work, as an array of tasks.
#[derive(Clone, Debug)]
pub struct Job {
    script: &'static str,
    what: &'static str,
    command: String,
    /// Tasks of one material.
    tasks: usize,
    /// The setting that says how many these are.
    parts: Option<&'static str>,
    need: Need,
}

impl Job {
    /// What it is called.
    pub fn name(&self) -> &'static str {
        self.script.trim_end_matches(".sh")
    }

    /// Tasks that one material takes.
    pub fn tasks(&self) -> usize {
        self.tasks
    }

    /// Memory that Slurm is asked for, MiB a task.
    pub fn asked_mib(&self) -> u64 {
        self.need.slurm_mib
    }

    /// Time limit of a task, minutes.
    pub fn minutes(&self) -> u64 {
        self.need.minutes
    }
}

/// Scripts that are ready to be written.
pub struct Plan {
    folder: PathBuf,
    scripts: Vec<Script>,
    /// The jobs in their order.
    pub jobs: Vec<Job>,
    /// Number of materials.
    pub materials: usize,
    /// What could not be told, a sentence each.
    pub notes: Vec<String>,
}

/// Looks at the materials and works out what their jobs need.
///
/// # Errors
/// An input that is not there or is no archive and no measurement, two that would be made into one, and more tasks than
/// an array has.
pub fn plan(options: &Options) -> Result<Plan> {
    let (materials, known, notes) = look(options)?;
    let tasks = [options.parts, options.cluster_parts, if options.in_parts() { 1 } else { materials.len() }];
    if let Some(tasks) = tasks.into_iter().find(|&tasks| tasks > MOST_TASKS) {
        return Err(Error::usage(format!(
            "an array of {tasks} tasks, expected at most {MOST_TASKS}, which is what Slurm takes unless it is set up \
             otherwise"
        ))
        .hint("choose fewer parts, or give the materials in several lists, each with another --out"));
    }
    let mut outputs: Vec<&Path> = materials.iter().flat_map(Material::outputs).collect();
    outputs.sort_unstable();
    if let Some(twice) = outputs.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Error::usage(format!("two materials would both become {}", twice[0].display()))
            .hint("rename one of them, or give them in two lists"));
    }
    let parts = Parts::of(options, &known, materials.len());
    let needs = Needs::of(options, parts, &known);
    let (scripts, jobs) = scripts::write(options, &materials, parts, &needs);
    Ok(Plan { folder: options.folder.clone(), scripts, jobs, materials: materials.len(), notes })
}

/// The materials, what is known of them, and what is not.
fn look(options: &Options) -> Result<(Vec<Material>, Vec<Facts>, Vec<String>)> {
    let (mut materials, mut known, mut notes) = (Vec::new(), Vec::new(), Vec::new());
    for input in &options.inputs {
        recognise::expect_readable(input)?;
        let (archive, measurement) = match kind_of(input) {
            Ok(measurement::KIND) => {
                known.push(Facts::of_measurement(Measurement::open(input)?.description().clone()));
                (None, absolute(input)?)
            }
            Ok(kind) => {
                return Err(Error::usage(format!(
                    "{} is {kind}, expected an archive or a measurement",
                    input.display()
                )));
            }
            Err(_) => {
                match archive::open(std::slice::from_ref(input), &archive::Options::default()) {
                    Ok(source) => known.push(Facts::of_archive(source.as_ref())),
                    // What is missing may be said by options of the import.
                    Err(error) if matches!(error.kind(), ErrorKind::Input | ErrorKind::Usage) => notes.push(format!(
                        "{error}; if the import needs options, write them into import_options in settings.sh: time and \
                         memory are not estimated for this archive"
                    )),
                    Err(error) => return Err(error),
                }
                let into = options.into.clone().unwrap_or_default();
                (Some(absolute(input)?), absolute(&import::default_store(input, &into))?)
            }
        };
        materials.push(material(archive, measurement, options)?);
    }
    Ok((materials, known, notes))
}

fn material(archive: Option<PathBuf>, measurement: PathBuf, options: &Options) -> Result<Material> {
    let beside = |of: &Path, endings: &[&str], new: &str| match &options.into {
        Some(folder) => absolute(&folder.join(with_ending(of, endings, new))),
        None => Ok(of.with_file_name(with_ending(of, endings, new))),
    };
    let model = beside(&measurement, &[".zarr"], ".model.zarr")?;
    let plane = beside(&model, &[".model.zarr"], ".enlarged.zarr")?;
    let pyramid = beside(&model, &[".model.zarr"], ".dzi")?;
    let plane = options.surface.is_some().then_some(plane);
    Ok(Material { archive, measurement, model, plane, pyramid: options.pyramids.then_some(pyramid) })
}

/// A path from the root, without following links: other nodes may see them otherwise.
fn absolute(path: &Path) -> Result<PathBuf> {
    // What ends in a slash has no name to make others of.
    let path: PathBuf = path.components().collect();
    std::path::absolute(&path).map_err(|error| Error::io("find", &path, error))
}

impl Plan {
    /// The folder of the scripts.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Writes the scripts into their folder; found, if the same ones are there.
    ///
    /// # Errors
    /// Those of writing, and scripts of other jobs in the same place.
    pub fn run(&self, context: &Context<'_>) -> Result<Made> {
        std::fs::create_dir_all(&self.folder).map_err(|error| Error::io("make", &self.folder, error))?;
        let path = |script: &Script| self.folder.join(script.name);
        let prepare = |script: &Script| {
            prepare_bytes(&path(script), context.existing, &script.text).map_err(|error| match error.kind() {
                ErrorKind::Recipe => {
                    error.hint("choose another folder (--out), or write all scripts anew by --force")
                }
                _ => error,
            })
        };
        let ready = self.scripts.iter().map(prepare).collect::<Result<Vec<_>>>()?;
        let made = publish_all(ready)?;
        for path in self.scripts.iter().filter(|script| script.is_run).map(path) {
            let all = |error| Error::io("make executable", &path, error);
            let mut permissions = std::fs::metadata(&path).map_err(all)?.permissions();
            if permissions.mode() & 0o111 == 0 {
                // Whoever may read it may run it.
                permissions.set_mode(permissions.mode() | (permissions.mode() & 0o444) >> 2);
                std::fs::set_permissions(&path, permissions).map_err(all)?;
            }
        }
        Ok(made)
    }
}
