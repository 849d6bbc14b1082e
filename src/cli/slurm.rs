use std::path::PathBuf;
use std::process::Command;

use btfkit::disk::output::Made;
use btfkit::error::{Error, ErrorKind, Result};
use btfkit::run::Context;
use btfkit::shape::Size;
use btfkit::stage::slurm::{self, MOST_TASKS, Surface};
use btfkit::stage::tile;
use btfkit::words::counted;
use clap::{Args, ValueEnum};

use super::enlarge::Method;
use super::{Console, found, number};

/// Parts of one material, unless their number is given.
const PARTS: usize = 8;

/// Write job scripts for Slurm that take materials from archives to models and surfaces
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf slurm wall.btf --size 65536x65536                   scripts in slurm/; read them, then slurm/submit.sh
  btf slurm ubo2014/*.zip --into stores --size 4096x4096  many materials: one array per stage, one task per material
  btf slurm wall.zarr --tile none --cluster-parts 8       a measurement; eight jobs share each pass of the clustering
  btf slurm wall.btf --partition long --account lab --sbatch=--qos=low --submit
The scripts are for users to read and edit: settings.sh holds what they work on. submit.sh submits them, status.sh shows
how far the stores are. A job that is stopped (time limit, preemption) or whose node is lost goes on by itself.")]
pub(super) struct Slurm {
    /// Archives and measurements
    #[arg(required = true, value_name = "ARCHIVE")]
    inputs: Vec<PathBuf>,
    /// The folder of the scripts
    #[arg(long, value_name = "DIR", default_value = "slurm")]
    out: PathBuf,
    /// Make all stores in this folder [default: measurements in the current folder, the rest beside them]
    #[arg(long, value_name = "DIR")]
    into: Option<PathBuf>,
    /// Most parts that the import, the enlargement and the pyramid of each material are divided into, a job each; small
    /// ones are divided into fewer [default: 8, or 1 for several materials]
    #[arg(long, value_name = "N", value_parser = number::count)]
    parts: Option<usize>,
    /// Number of parts that each pass of the clustering is divided into, a job each, for planes that do not fit in
    /// memory; with 1, one job makes the model
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = number::count)]
    cluster_parts: usize,
    /// Processors of each task
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=1024))]
    cpus: u32,
    /// Time limit of each task in minutes [default: estimated for each stage]
    #[arg(long, value_name = "MINUTES", value_parser = clap::value_parser!(u32).range(10..=525_600))]
    time: Option<u32>,
    /// The part of the measurement that becomes the tile, as of btf tile
    #[arg(long)]
    tile: Option<tile::Choice>,
    /// Number of clusters, as of btf cluster
    #[arg(long, value_parser = number::count)]
    clusters: Option<usize>,
    /// Also enlarge each model to this size, WIDTHxHEIGHT
    #[arg(long, allow_hyphen_values = true)]
    size: Option<Size>,
    /// How to enlarge
    #[arg(long, value_enum, default_value = "coherent", requires = "size")]
    method: Method,
    /// Also make a Deep Zoom pyramid of each enlargement
    #[arg(long, requires = "size")]
    deepzoom: bool,
    /// Slurm's partition for all jobs
    #[arg(long, value_name = "NAME")]
    partition: Option<String>,
    /// Slurm's account for all jobs
    #[arg(long, value_name = "NAME")]
    account: Option<String>,
    /// Another option of sbatch for all jobs, such as --sbatch=--qos=low; may be repeated
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    sbatch: Vec<String>,
    /// Submit the jobs
    #[arg(long)]
    submit: bool,
}

impl Slurm {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        let plan = slurm::plan(&self.options(context)?)?;
        let made = plan.run(context)?;
        let folder = plan.folder();
        console.line(format!(
            "{}: scripts for {}{}",
            folder.display(),
            counted(plan.materials, "material"),
            found(made)
        ));
        for job in &plan.jobs {
            console.line(format!(
                "  {:<9} {} for each material, {} MiB and at most {} each",
                job.name(),
                counted(job.tasks(), "task"),
                job.asked_mib(),
                counted(job.minutes() as usize, "minute")
            ));
        }
        console.notes(&plan.notes);
        let submit = folder.join("submit.sh");
        if !self.submit {
            if made == Made::Written {
                console.line(format!("look through them, then run {}", submit.display()));
            }
            return Ok(());
        }
        // Started by its name, so that the folder need not allow programs.
        let output = Command::new("bash").arg(&submit).output();
        let output = output.map_err(|error| Error::io("start bash for", &submit, error))?;
        String::from_utf8_lossy(&output.stdout).lines().for_each(|line| console.line(line));
        match output.status.code() {
            Some(0) => Ok(()),
            code => {
                let kind = if code == Some(66) { ErrorKind::Missing } else { ErrorKind::Io };
                let told = String::from_utf8_lossy(&output.stderr);
                Err(Error::list(kind, told.lines().chain(told.is_empty().then_some("submit.sh failed")))
                    .hint("the scripts are written: mend what is told above, then run submit.sh"))
            }
        }
    }

    fn options(&self, context: &Context<'_>) -> Result<slurm::Options> {
        let program = std::env::current_exe()
            .map_err(|error| Error::io("find", std::path::Path::new("this program"), error))?;
        let named =
            |option: &str, value: &Option<String>| value.as_ref().map(|value| format!("--{option}={value}"));
        let method = self.method.to_possible_value();
        let surface = self.size.map(|size| Surface {
            size,
            method: method.as_ref().map_or("coherent", |method| method.get_name()).to_owned(),
            by: self.method.usual(),
        });
        let usual = if self.inputs.len() == 1 { PARTS } else { 1 };
        let parts = self.parts.unwrap_or(usual);
        if parts.max(self.cluster_parts) > MOST_TASKS {
            return Err(Error::usage(format!(
                "got {} parts, expected at most {MOST_TASKS}: more tasks than an array of Slurm has",
                parts.max(self.cluster_parts)
            )));
        }
        let sbatch = [named("partition", &self.partition), named("account", &self.account)];
        Ok(slurm::Options {
            program,
            folder: self.out.clone(),
            inputs: self.inputs.clone(),
            into: self.into.clone(),
            parts,
            cluster_parts: self.cluster_parts,
            cpus: self.cpus as usize,
            memory_bytes: context.memory_bytes,
            minutes: self.time,
            tile: self.tile,
            clusters: self.clusters,
            surface,
            pyramids: self.deepzoom,
            sbatch: sbatch.into_iter().flatten().chain(self.sbatch.iter().cloned()).collect(),
        })
    }
}
