use std::path::PathBuf;

use btfkit::error::Result;
use btfkit::run::{Context, progress};
use btfkit::store::measurement;
use btfkit::store::model::Stage;
use btfkit::words::counted;
use clap::Args;

use super::Console;
use super::appearance::{appearance_plan, print_appearance};
use super::cluster::{ClusterOptions, cluster_options, print_clusters, run_clusters};
use super::each::{Ended, Line, each};
use super::fit::{FitOptions, fit_plan, print_field};
use super::normals::{NormalsOptions, normals_plan, print_normals};
use super::outputs::{Naming, Pair};
use super::tile::{Seed, TileOptions, print_tile, tile_plan};

/// Make a model of a measurement: runs tile, cluster, normals, fit and appearance
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf model wood.zarr wood.model.zarr
  btf model leather.zarr --clusters 128 --mrf 2d --tile 128x128
  btf model cloth.zarr --lattice '15.2,0;0,18.4'
  btf model stores/*.zarr --into models            one model each; a bad one does not stop the others
Stages that are already done with the same options are not run again.")]
pub(super) struct Model {
    /// The measurement, and the model to make [default: the measurement's name with .model.zarr]; or many measurements
    #[arg(required = true, value_name = "MEASUREMENT")]
    paths: Vec<PathBuf>,
    /// Make one model for each measurement, in this folder [default: beside each measurement]
    #[arg(long, value_name = "DIR")]
    into: Option<PathBuf>,
    #[command(flatten)]
    seed: Seed,
    /// Print what the first stage would do, and do nothing
    #[arg(long)]
    dry_run: bool,
    #[command(flatten, next_help_heading = "Tile")]
    tile: TileOptions,
    #[command(flatten, next_help_heading = "Clusters")]
    cluster: ClusterOptions,
    #[command(flatten, next_help_heading = "Normals")]
    normals: NormalsOptions,
    #[command(flatten, next_help_heading = "Random field, for --method paper")]
    fit: FitOptions,
}

impl Model {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<Ended> {
        let naming = Naming { reads: measurement::KIND, ending: None, becomes: ".model.zarr" };
        let pairs = naming.pairs(&self.paths, self.into.as_deref())?;
        if let [pair] = pairs.as_slice() {
            return self.one(pair, context, console).map(|_| Ended::Done);
        }
        let name = |pair: &Pair| pair.input.display().to_string();
        each(&pairs, name, false, context, console, |pair| {
            let clusters = self.one(pair, context, if self.dry_run { console } else { console.silent() })?;
            let clusters = clusters.map(|clusters| counted(clusters, "cluster"));
            Ok((
                Line::Text(format!(
                    "{}: {}",
                    pair.output.display(),
                    clusters.unwrap_or("planned".to_owned())
                )),
                None,
            ))
        })
    }

    /// Makes one model; tells how many clusters it has, unless nothing but a plan was asked for.
    fn one(&self, pair: &Pair, context: &Context<'_>, console: Console) -> Result<Option<usize>> {
        let Pair { input: measurement, output: model } = pair;
        let plan = tile_plan(measurement, model, &self.tile, self.seed.seed)?;
        if self.dry_run {
            return console.plan(&plan.summary()).map(|()| None);
        }
        let begin = |stage: Stage| {
            let number = 1 + Stage::ALL.iter().position(|&other| other == stage).unwrap_or(0);
            let stage = progress::Stage { number, of: Stage::ALL.len(), name: stage.name() };
            context.progress.stage(Some(stage));
        };
        context.tell_follow_up();
        context.tell_enough(plan.enough_for_model(
            &cluster_options(measurement, model, &self.cluster, self.seed.seed),
            context.threads,
        ));
        // A line may be told only while no bar is drawn.
        let console = console.brief();
        let print = |found: bool, print: &dyn Fn(Console)| {
            context.progress.pause(&mut || print(console.found(found)));
        };
        begin(Stage::Tile);
        let found = plan.is_done();
        let tile = plan.run(context)?;
        print(found, &|console| print_tile(&tile, console));
        begin(Stage::Cluster);
        let (found, clusters) = run_clusters(measurement, model, &self.cluster, self.seed.seed, context)?;
        print(found, &|console| print_clusters(&clusters, console));
        begin(Stage::Normals);
        let plan = normals_plan(measurement, model, &self.normals)?;
        let (found, normals) = (plan.is_done(), plan.run(context)?);
        print(found, &|console| print_normals(&normals, console));
        begin(Stage::Fit);
        let plan = fit_plan(model, &self.fit)?;
        let (found, field) = (plan.is_done(), plan.run(context)?);
        print(found, &|console| print_field(&field, console));
        begin(Stage::Appearance);
        let plan = appearance_plan(model, &self.tile.lattice)?;
        let (found, appearance) = (plan.is_done(), plan.run(context)?);
        print(found, &|console| print_appearance(&appearance, model, console));
        context.progress.stage(None);
        Ok(Some(clusters.clusters))
    }
}
