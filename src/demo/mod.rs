//! The whole method on a synthetic material, and a page that explains the run with its pictures and figures.
//!
//! [`run`] makes a sample, runs every stage on it, and writes one self-contained HTML page with the
//! pictures and figures. Everything stays in one folder; running again goes on where a run stopped.

mod figures;
mod page;
mod pictures;
pub(crate) mod second_tile;
mod story;
mod times;

use std::path::{Path, PathBuf};

use serde_json::json;

pub use times::Step;

use crate::archive;
use crate::demo::figures::Figures;
use crate::demo::pictures::{Embedded, Workshop, write_and_embed};
use crate::demo::story::Section;
use crate::demo::times::Times;
use crate::disk::output::expect_outside_stores;
use crate::disk::temporary::write_file;
use crate::error::Result;
use crate::lattice::LatticeChoice;
use crate::method::cluster::centre::CentreRule;
use crate::method::cluster::lloyd::Limits;
use crate::run::progress::Counted;
use crate::run::shard::Shard;
use crate::run::{Context, units};
use crate::sample::MaterialKind;
use crate::shape::Size;
use crate::stage::cluster::Amount;
use crate::stage::tile::Choice;
use crate::stage::{appearance, cluster, compare, enlarge, fit, import, normals, sample, tile};
use crate::store::enlarged::Enlarged;
use crate::store::measurement::Measurement;
use crate::store::model::{Model, Stage};
use crate::view::{self, Viewer};
use crate::zarr::codec::Chain;

/// What to demonstrate.
#[derive(Clone, Debug)]
pub struct Options {
    /// Folder for everything that is made.
    pub folder: PathBuf,
    /// Which material.
    pub kind: MaterialKind,
}

/// What was made.
#[derive(Clone, Debug)]
pub struct Report {
    /// The page.
    pub page: PathBuf,
    /// Every step and its time, in the order of the run.
    pub steps: Vec<Step>,
}

/// Settings of the run; where the program has a default for one, that default.
struct Settings {
    kind: MaterialKind,
    sample: Size,
    directions: usize,
    clusters: usize,
    passes: usize,
    tolerance: f64,
    enlarged: Size,
    candidates: usize,
    seed: u64,
}

impl Settings {
    fn new(kind: MaterialKind) -> Self {
        Self {
            kind,
            sample: Size { height: 176, width: 176 },
            directions: 81,
            clusters: 256,
            passes: 50,
            tolerance: 1e-4,
            enlarged: Size { height: 1024, width: 1024 },
            candidates: 16,
            seed: 1,
        }
    }

    /// Name of the material, as the program takes it.
    fn material(&self) -> &'static str {
        match self.kind {
            MaterialKind::Wood => "wood",
            MaterialKind::Leather => "leather",
        }
    }
}

/// Names of what is made, relative to the folder.
mod names {
    pub(super) const ARCHIVE: &str = "sample.zip";
    pub(super) const MEASUREMENT: &str = "measurement.zarr";
    pub(super) const MODEL: &str = "material.model.zarr";
    pub(super) const ENLARGED: &str = "enlarged.zarr";
    pub(super) const BY_PAPER: &str = "enlarged-by-paper.zarr";
    pub(super) const PICTURES: &str = "pictures";
    pub(super) const PAGE: &str = "index.html";
    pub(super) const VIEWER: &str = "view.html";
    pub(super) const RECORD: &str = "demo.json";
}

/// Memory that a picture of the enlarged size takes while it is made and encoded: 1024 x 1024 values
/// twice, display bytes, two encoded files.
const PICTURE_BYTES: u64 = 40 << 20;

/// Runs the demo, or goes on with it.
///
/// # Errors
/// [`crate::ErrorKind::Recipe`] where the folder holds the demo of another material, and whatever the stages
/// report.
pub fn run(options: &Options, context: &Context<'_>) -> Result<Report> {
    run_with(&Settings::new(options.kind), &options.folder, context)
}

fn run_with(settings: &Settings, folder: &Path, context: &Context<'_>) -> Result<Report> {
    let place = |name: &str| folder.join(name);
    expect_outside_stores(&place(names::RECORD))?;
    let recipe = json!({
        "stage": "demo",
        "material": settings.material(),
        "size": [settings.sample.height, settings.sample.width],
        "directions": settings.directions,
        "clusters": settings.clusters,
        "enlarged": [settings.enlarged.height, settings.enlarged.width],
        "seed": settings.seed,
    });
    let mut times = Times::open(place(names::RECORD), recipe)?;
    let [archive, measurement, model, enlarged, by_paper] =
        [names::ARCHIVE, names::MEASUREMENT, names::MODEL, names::ENLARGED, names::BY_PAPER].map(place);
    measure(settings, &archive, &measurement, &mut times, context)?;
    analyse(settings, &measurement, &model, &mut times, context)?;
    let coherent = enlarge::coherent::Options { jitter: None, keep_source: true, keep_normals: false };
    let paper = enlarge::paper::Options {
        candidates: Some(settings.candidates),
        keep_normals: true,
        band_rows: None,
    };
    for (step, output, by) in [
        ("enlarge", &enlarged, enlarge::By::Coherent(coherent)),
        ("enlarge by the paper's rule", &by_paper, enlarge::By::Paper(paper)),
    ] {
        let found = Enlarged::open(output).is_ok_and(|enlarged| enlarged.is_whole());
        times.time(step, found, || {
            let options = enlarge_options(settings, &model, output, by);
            enlarge::plan(&options)?.run(context).map(|_| ())
        })?;
    }

    // These are made anew by every run: they read what the stages left and take a few seconds.
    let compare = compare::Options {
        model: model.clone(),
        measurement: measurement.clone(),
        by: Some(compare::By::Clusters),
        tile_of: None,
    };
    let compared =
        times.time("compare", false, || compare::run(&compare::open(&compare, context)?, context))?;
    let workshop = Workshop::open([&measurement, &model, &enlarged, &by_paper], settings.seed, context)?;
    let places = [&archive, &measurement, &model, &enlarged].map(PathBuf::as_path);
    let figures = Figures::gather(&workshop, compared, places, context)?;
    let mut sections = story::sections(&figures, settings);
    let pictures = place(names::PICTURES);
    let embedded = times.time("pictures", false, || embed(&sections, &workshop, &pictures, context))?;
    times.time("viewer", false, || {
        let viewer =
            Viewer::open(&view::Options { source: model.clone(), model: None, window: None }, context)?;
        write_file(&place(names::VIEWER), viewer.page()?.as_bytes())
    })?;
    sections.push(story::times(&times.steps));
    let page = place(names::PAGE);
    write_file(&page, page::render(&story::title(settings), &sections, &embedded).as_bytes())?;
    Ok(Report { page, steps: times.steps })
}

/// Makes the sample and imports it.
fn measure(
    settings: &Settings,
    archive: &Path,
    store: &Path,
    times: &mut Times,
    context: &Context<'_>,
) -> Result<()> {
    let found = archive.exists();
    times.time("sample", found, || {
        if found {
            return Ok(());
        }
        let options = sample::Options {
            archive: archive.to_owned(),
            kind: settings.kind,
            size: settings.sample,
            views: settings.directions,
            lights: settings.directions,
            seed: settings.seed,
            scale: 1.0,
        };
        sample::run(&options, context).map(|_| ())
    })?;
    let found = Measurement::open(store).is_ok_and(|m| m.views_done() == settings.directions);
    times.time("import", found, || {
        let source = archive::open(&[archive.to_owned()], &archive::Options::default())?;
        let options =
            import::Options { store: store.to_owned(), white: 1.0, codec: Chain::Stock, shard: Shard::WHOLE };
        import::plan(source.as_ref(), options, context)?.run(context).map(|_| ())
    })
}

/// Analyses the measurement.
fn analyse(
    settings: &Settings,
    measurement: &Path,
    model: &Path,
    times: &mut Times,
    context: &Context<'_>,
) -> Result<()> {
    let found = |stage: Stage| Model::open(model).is_ok_and(|model| model.has(stage).unwrap_or(false));
    let (measurement, model) = (measurement.to_owned(), model.to_owned());
    times.time("tile", found(Stage::Tile), || {
        let (measurement, model) = (measurement.clone(), model.clone());
        let (choice, lattice) = (Choice::Cut, LatticeChoice::Auto);
        let options = tile::Options { measurement, model, choice, lattice, seed: settings.seed };
        tile::plan(&options)?.run(context).map(|_| ())
    })?;
    times.time("cluster", found(Stage::Cluster), || {
        let options = cluster::Options {
            measurement: measurement.clone(),
            model: model.clone(),
            amount: Amount::Clusters(settings.clusters),
            centre: CentreRule::Median,
            representatives: cluster::Representation::Texel,
            first: None,
            sample: None,
            restarts: 1,
            time: None,
            limits: Limits { passes: settings.passes, tolerance: settings.tolerance },
            seed: settings.seed,
        };
        cluster::plan(&options)?.run(context).map(|_| ())
    })?;
    times.time("normals", found(Stage::Normals), || {
        let (measurement, model) = (measurement.clone(), model.clone());
        normals::plan(&normals::Options { measurement, model, robust: false })?.run(context).map(|_| ())
    })?;
    times.time("fit", found(Stage::Fit), || {
        fit::plan(&fit::Options::of(model.clone()))?.run(context).map(|_| ())
    })?;
    times.time("appearance", found(Stage::Appearance), || {
        let options = appearance::Options { model: model.clone(), lattice: LatticeChoice::Auto };
        appearance::plan(&options)?.run(context).map(|_| ())
    })
}

/// How the model is enlarged by one of the methods.
fn enlarge_options(settings: &Settings, model: &Path, output: &Path, by: enlarge::By) -> enlarge::Options {
    enlarge::Options {
        model: model.to_owned(),
        output: output.to_owned(),
        size: settings.enlarged,
        seeds: settings.seed..=settings.seed,
        tileable: false,
        by,
        shard: Shard::WHOLE,
    }
}

/// Makes the pictures of all sections, in their order.
fn embed(
    sections: &[Section],
    workshop: &Workshop,
    folder: &Path,
    context: &Context<'_>,
) -> Result<Vec<Embedded>> {
    let shots: Vec<_> = sections.iter().flat_map(Section::shots).collect();
    context.progress.begin("pictures", shots.len() as u64, Counted::Items("pictures"));
    let in_flight = units::in_flight(context, "a picture", PICTURE_BYTES)?;
    let embedded = units::for_each(context, &shots, in_flight, |shot| {
        let path = folder.join(&shot.file).with_extension("png");
        let embedded = write_and_embed(&workshop.picture(shot.subject, context)?, &path)?;
        context.progress.advance(1);
        Ok(embedded)
    })?;
    context.progress.end();
    Ok(embedded)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::run::progress::Silent;

    #[test]
    fn a_small_demo_runs_to_its_page_and_runs_again_without_redoing_stages() {
        let settings = Settings {
            sample: Size::new(64, 64),
            directions: 13,
            clusters: 16,
            enlarged: Size::new(96, 80),
            ..Settings::new(MaterialKind::Wood)
        };
        let folder = tempfile::tempdir().unwrap();
        let stop = AtomicBool::new(false);
        let context = Context::new(&Silent, &stop, 2, 256 << 20).unwrap();
        let first = run_with(&settings, folder.path(), &context).unwrap();
        let page = std::fs::read_to_string(&first.page).unwrap();
        let pictures = std::fs::read_dir(folder.path().join(names::PICTURES)).unwrap().count();
        assert_eq!(page.matches("<figure>").count(), pictures);
        assert_eq!(page.matches("src=\"data:image/").count(), pictures);
        let text: String = page.lines().filter(|line| !line.contains("<img")).collect();
        assert!(text.contains("From 169 photographs of wood"));
        assert!(text.contains("<iframe src=\"view.html\""));
        let viewer = std::fs::read_to_string(folder.path().join("view.html")).unwrap();
        assert!(viewer.contains("<canvas id=\"picture\""));
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");

        let modified = |name: &str| std::fs::metadata(folder.path().join(name)).unwrap().modified().unwrap();
        let made = ["sample.zip", "material.model.zarr/index", "enlarged.zarr/index/c/0/0"];
        let before = made.map(modified);
        let second = run_with(&settings, folder.path(), &context).unwrap();
        assert_eq!(made.map(modified), before);
        for (first, second) in first.steps.iter().zip(&second.steps) {
            let anew = ["compare", "pictures", "viewer"].contains(&first.name.as_str());
            assert!(anew || first.seconds == second.seconds, "{first:?} became {second:?}");
        }
    }
}
