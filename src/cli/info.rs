use std::path::{Path, PathBuf};

use btfkit::error::{Error, Result};
use btfkit::lattice::Lattice;
use btfkit::names::ends_with;
use btfkit::run::Context;
use btfkit::stage::about::{self, About, Grown, Kept, Measured, Modelled, Pyramidal, Samples};
use btfkit::stage::deepzoom::recipe::PyramidRecipe;
use btfkit::stage::verify::is_pyramid;
use btfkit::stage::{estimate, import, pack};
use btfkit::store::model::Stage;
use btfkit::store::recognise::VERSION_2;
use btfkit::words::counted;
use btfkit::zarr::codec::Chain;
use clap::Args;
use serde::Serialize;
use serde_json::Value;

use super::each::{Ended, Line, each};
use super::given::Given;
use super::source::SourceArgs;
use super::table::{row, table};
use super::tile::steps;
use super::{Console, as_json, bytes_text, part_text};

/// Show what an archive or a store holds, and how large an archive will be once imported
#[derive(Args)]
#[command(after_help = "\
Archives are recognised by their content:
  zips and folders of pictures (JPEG, PNG, TIFF, Radiance, OpenEXR) with angles in their names, a table or an .lp list;
  Bonn .btf (DFMF, FMF, PVF, BDI); MLVQ databases; UTIA BIG and MIF; numpy arrays; HDF5.

Examples:
  btf info UBO_WOOD256.zip
  btf info scans/ --pattern '{theta_v}_{phi_v}_{theta_i}_{phi_i}.png'
  btf info wood.zarr
  btf info wood.zarr --directions                   the number and the angles of each view and light
  btf info wood.model.zarr --json
  btf info archives/*                               one line each, and a count")]
pub(super) struct Info {
    /// Archives and stores; if there are several, each gets one line
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// The archives are pieces of one measurement
    #[arg(long)]
    pieces: bool,
    /// Also list the number and the angles of each view and light, as options such as --drop-view count them (--json has
    /// them anyway)
    #[arg(long, conflicts_with = "json")]
    directions: bool,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    source: SourceArgs,
}

/// What an archive holds, and how large its store will be.
#[derive(Serialize)]
struct Archive {
    kind: &'static str,
    format: String,
    #[serde(flatten)]
    samples: Samples,
    /// Bytes of the store by each chain of codecs, about.
    store_bytes: Vec<(&'static str, u64)>,
    remarks: Vec<(String, String)>,
    notes: Vec<String>,
    assumptions: Vec<String>,
}

/// What was found at one input.
#[derive(Serialize)]
#[serde(untagged)]
enum Told {
    Archive(Box<Archive>),
    Store(About),
    Packed(Box<pack::About>),
}

type Rows = Vec<Vec<String>>;

impl Info {
    pub(super) fn run(&self, given: &Given, context: &Context<'_>, console: Console) -> Result<Ended> {
        if self.paths.len() > 1 && !self.pieces {
            given.refuse_these(&["directions"], "of many inputs, which get one line each")?;
            let name = |path: &PathBuf| path.display().to_string();
            return each(&self.paths, name, self.json, context, console, |path| {
                let told = self.look(std::slice::from_ref(path), given, context)?;
                let line =
                    if self.json { Line::Json(as_json(&told)?) } else { Line::Text(in_short(&rows(&told))) };
                Ok((line, None))
            });
        }
        let told = self.look(&self.paths, given, context)?;
        if self.json {
            console.plan(&as_json(&told)?)?;
        } else {
            console.text(&table(&rows(&told)));
            if self.directions {
                console.text(&table(&directions(&told)?));
            }
        }
        Ok(Ended::Done)
    }

    /// Looks at one store, or at one archive in pieces perhaps.
    fn look(&self, paths: &[PathBuf], given: &Given, context: &Context<'_>) -> Result<Told> {
        let first = paths.first().map_or(Path::new(""), PathBuf::as_path);
        let is_zarr = ["zarr.json"].iter().chain(&VERSION_2).any(|name| first.join(name).exists());
        // A store that has lost its metadata is no archive.
        let is_named_so = ends_with(first, ".zarr");
        if is_zarr || is_named_so || is_pyramid(first) {
            given.refuse_for_stores(paths)?;
            return about::store(first).map(Told::Store);
        }
        if pack::is_packed(first) {
            given.refuse_for_stores(paths)?;
            return pack::about(first).map(|about| Told::Packed(Box::new(about)));
        }
        let source = self.source.open(paths)?;
        let contents = source.contents();
        let bytes =
            |codec: Chain| Ok((codec.name(), estimate::store_bytes(source.as_ref(), codec, context)?));
        Ok(Told::Archive(Box::new(Archive {
            kind: "archive",
            format: contents.format.to_string(),
            samples: Samples::of(&import::describe(source.as_ref(), 1.0)),
            store_bytes: [Chain::Stock, Chain::Predictive].into_iter().map(bytes).collect::<Result<_>>()?,
            remarks: contents.remarks.clone(),
            notes: btfkit::archive::notes(source.as_ref()),
            assumptions: contents.assumptions.iter().map(|assumption| assumption.text.clone()).collect(),
        })))
    }
}

/// What tells an input apart from others, of what is told of it.
fn in_short(rows: &[Vec<String>]) -> String {
    const TOLD: [&str; 7] = ["views", "lights", "clusters", "views done", "method", "seed", "shards done"];
    let told = rows.iter().filter_map(|row| match row.as_slice() {
        [name, value] if name == "kind" || name == "size" => Some(value.clone()),
        // How far a model's stages are.
        [name, value] if Stage::ALL.iter().any(|stage| stage.name() == name) => {
            Some(format!("{name} {value}"))
        }
        [name, value] if TOLD.contains(&name.as_str()) => {
            let value = value.split_once(',').map_or(value.as_str(), |(first, _)| first);
            Some(format!("{name} {value}"))
        }
        _ => None,
    });
    told.collect::<Vec<_>>().join(", ")
}

/// A row for each view and each light: its number and its angles.
fn directions(told: &Told) -> Result<Rows> {
    let none = || {
        Error::usage("--directions changes nothing here: there are no directions in it")
            .hint("name a measurement, a model or an archive")
    };
    let [views, lights] = match told {
        Told::Archive(archive) => [&archive.samples.views, &archive.samples.lights],
        Told::Store(About::Measurement(about)) => [&about.samples.views, &about.samples.lights],
        Told::Store(About::Model(about)) => {
            let both = about.directions.as_ref().ok_or_else(none)?;
            [&both.views, &both.lights]
        }
        _ => return Err(none()),
    };
    let mut rows = vec![row!["", "number", "theta", "phi"]];
    for (name, list) in [("view", views), ("light", lights)] {
        rows.extend(list.angles_deg.iter().enumerate().map(|(number, [theta, phi])| {
            // What rounds to a whole turn is 0.
            let phi = (phi * 100.0).round() / 100.0 % 360.0;
            row![name, number, format!("{theta:.2}"), format!("{phi:.2}")]
        }));
    }
    Ok(rows)
}

fn rows(told: &Told) -> Rows {
    match told {
        Told::Archive(archive) => of_archive(archive),
        Told::Store(About::Measurement(about)) => of_measurement(about),
        Told::Store(About::Model(about)) => of_model(about),
        Told::Store(About::Enlarged(about)) => of_enlarged(about),
        Told::Store(About::Deepzoom(about)) => of_pyramid(about),
        Told::Packed(about) => of_packed(about),
    }
}

fn of_archive(archive: &Archive) -> Rows {
    let mut rows = vec![row!["kind", format!("archive, {}", archive.format)]];
    rows.extend(of_samples(&archive.samples));
    for (codec, bytes) in &archive.store_bytes {
        rows.push(row![format!("store, about ({codec})"), bytes_text(*bytes)]);
    }
    rows.extend(archive.remarks.iter().map(|(name, value)| row![name, value]));
    rows.extend(archive.notes.iter().map(|note| row!["note", note]));
    rows.extend(archive.assumptions.iter().map(|assumption| row!["assumed", assumption]));
    rows
}

/// Rows that tell what a measurement, or an archive as a measurement, holds.
fn of_samples(samples: &Samples) -> Rows {
    let directions = |list: &about::Directions| {
        let [low, high] = list.theta_deg;
        format!("{}, theta {low:.1} to {high:.1} degrees", list.count)
    };
    let channels = match samples.channels.as_slice() {
        [first, .., last] if samples.channels.len() > 4 => {
            format!("{} channels, {first} to {last}", samples.channels.len())
        }
        names => names.join(" "),
    };
    let Samples { width, height, samples: of_type, .. } = samples;
    vec![
        row!["views", directions(&samples.views)],
        row!["lights", directions(&samples.lights)],
        row!["size", format!("{width}x{height}, {channels}, {of_type}")],
        row!["transfer", samples.transfer],
        row!["raw", bytes_text(samples.raw_bytes)],
    ]
}

/// Rows that all stores have.
fn of_kept(kept: &Kept) -> Rows {
    vec![
        row!["on disk", bytes_text(kept.stored_bytes)],
        row!["made by", format!("btf {}, layout {}", kept.version, kept.layout)],
    ]
}

fn of_measurement(about: &Measured) -> Rows {
    let mut rows = vec![row!["kind", "measurement"]];
    rows.extend(of_samples(&about.samples));
    rows.push(row!["white", about.white]);
    rows.push(row!["views done", format!("{} of {}", about.views_done, about.samples.views.count)]);
    rows.push(row!["codec", about.codec]);
    rows.extend(about.archive.iter().map(|format| row!["archive", format]));
    if !about.read_with.is_empty() {
        rows.push(row!["read with", about.read_with.join(" ")]);
    }
    rows.push(row!["digest", about.digest]);
    rows.extend(of_kept(&about.kept));
    rows.extend(about.assumptions.iter().map(|assumption| row!["assumed", assumption]));
    rows
}

fn of_packed(about: &pack::About) -> Rows {
    let ([width, height], [views, lights]) = (about.size, about.directions);
    let ratio = |of: u64| format!("the file is {} of them", part_text(about.bytes as u64, of));
    let mut rows = vec![
        row!["kind", about.kind],
        row!["size", format!("{width}x{height}, {}", about.channels.join(" "))],
        row!["views", views],
        row!["lights", lights],
        row!["borders join", yes(about.wraps)],
        row![
            "coefficients",
            about.centres.map_or("by cosines".to_owned(), |n| format!("by a palette of {n}"))
        ],
        row![
            "bytes",
            match about.centres {
                None => format!("{}, of these {} of the header", about.bytes, about.header_bytes),
                Some(_) =>
                    format!("{}, of these {} of the header and the palette", about.bytes, about.header_bytes),
            }
        ],
        row!["unpacked arrays", format!("{}, {}", bytes_text(about.raw_bytes), ratio(about.raw_bytes))],
    ];
    if let Some(raw) = about.tile_bytes {
        let text = format!("{}, {}", bytes_text(raw), ratio(raw));
        let what = if about.whole_measurement { ", all of the measurement" } else { "" };
        rows.push(row!["the tile's raw samples", format!("{text}{what}")]);
    }
    for (number, plane) in about.planes.iter().enumerate() {
        let quality =
            if plane.psnr_db > 0.0 { format!("{:.2} dB", plane.psnr_db) } else { "not known".to_owned() };
        let to =
            format!("to byte {}, {}, PSNR {quality}", plane.bytes, counted(plane.components, "component"));
        rows.push(row![format!("plane {}", number + 1), to]);
    }
    rows.extend(about.texts.iter().map(|(name, text)| row![name, text]));
    rows.extend(about.notes.iter().map(|note| row!["note", note]));
    rows
}

/// Bytes as a part of a tile and of a measurement.
fn of_both(bytes: u64, tile: u64, measurement: u64) -> String {
    format!(
        "{}, {} of the tile's raw {}, {} of the measurement's raw {}",
        bytes_text(bytes),
        part_text(bytes, tile),
        bytes_text(tile),
        part_text(bytes, measurement),
        bytes_text(measurement)
    )
}

/// The word for what is or is not so.
fn yes(is_so: bool) -> &'static str {
    if is_so { "yes" } else { "no" }
}

/// A lattice in words, and as `--lattice` takes it.
fn lattice_text(lattice: &Lattice) -> String {
    match lattice {
        Lattice::None => "none".to_owned(),
        _ => format!("steps of {} (--lattice '{lattice:.2}')", steps(lattice)),
    }
}

/// A value of a recipe for people.
fn in_words(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Object(members) => {
            let members = members.iter().map(|(name, value)| format!("{name} {}", in_words(value)));
            members.collect::<Vec<_>>().join(", ")
        }
        other => other.to_string(),
    }
}

fn of_model(about: &Modelled) -> Rows {
    let mut rows = vec![row!["kind", "model"]];
    let asked = |stage: &str, name: &str| {
        let recipe =
            about.stages.iter().find(|done| done.stage == stage).and_then(|done| done.recipe.as_ref());
        recipe.and_then(|recipe| recipe.get(name)).filter(|value| !value.is_null()).map(in_words)
    };
    for done in &about.stages {
        let word = match (done.done, done.recipe.is_some()) {
            (true, _) => "done",
            (false, true) => "arrays are missing",
            (false, false) => "not run",
        };
        rows.push(row![done.stage, word]);
        match done.stage {
            "tile" => {
                let Some(tile) = &about.tile else { continue };
                let [rows_measured, columns] = tile.measurement_size;
                rows.push(row!["  size", tile.size()]);
                rows.push(row!["  of", format!("a measurement of {columns}x{rows_measured}")]);
                rows.extend(about.measurement.iter().map(|digest| row!["  measurement's digest", digest]));
                rows.push(row!["  borders join", yes(tile.wraps)]);
                rows.extend(asked("tile", "tile").map(|tile| row!["  asked for", tile]));
                rows.push(row!["  lattice", lattice_text(&tile.lattice)]);
                rows.push(row!["  seam visibility", format!("{:.2}", tile.seam_visibility)]);
            }
            "cluster" => {
                let Some(report) = &about.cluster else { continue };
                rows.push(row!["  clusters", report.clusters]);
                rows.extend(report.taken_from.iter().map(|(name, _)| row!["  taken from", name]));
                for (number, pass) in report.passes.iter().enumerate() {
                    let found = format!(
                        "weighted mean |dL*| {:.4} to centres, {} moved",
                        pass.mean_lightness_error,
                        counted(pass.moved, "texel")
                    );
                    rows.push(row![format!("  pass {}", number + 1), found]);
                }
                for name in ["amount", "centre", "representatives", "first", "sample", "restarts"] {
                    rows.extend(asked("cluster", name).map(|value| row![format!("  {name}"), value]));
                }
                rows.push(row!["  representatives", bytes_text(report.representative_bytes)]);
                rows.push(row!["  index", bytes_text(report.index_bytes)]);
                rows.push(row![
                    "  both",
                    of_both(
                        report.representative_bytes + report.index_bytes,
                        report.tile_bytes,
                        report.measurement_bytes
                    )
                ]);
            }
            "normals" => {
                let Some(report) = &about.normals else { continue };
                rows.push(row!["  view, lights", format!("{}, {}", report.view, report.lights)]);
                rows.push(row!["  spread", format!("{:.2} degrees", report.spread_deg)]);
            }
            "fit" => {
                let Some(report) = &about.field else { continue };
                rows.push(row![
                    "  field",
                    format!("{}, {}", report.mrf, counted(report.levels.len(), "level"))
                ]);
                for (name, label) in
                    [("field", "  channels"), ("gains", "  gains"), ("marginals", "  marginals")]
                {
                    rows.extend(asked("fit", name).map(|value| row![label, value]));
                }
                let etas: Vec<String> = report.levels.iter().map(|level| level.eta.to_string()).collect();
                rows.push(row!["  neighbours", etas.join(", ")]);
                rows.push(row!["  autocovariance error", format!("{:.4}", report.autocovariance_error)]);
            }
            "components" => {
                let Some(report) = &about.components else { continue };
                rows.push(row!["  components", report.components]);
                rows.extend(report.note().map(|note| row!["  note", note]));
                rows.extend(report.psnr_db.map(|psnr| row!["  PSNR", format!("{psnr:.2} dB")]));
                let text = format!(
                    "{}, {} of the tile's raw {}",
                    bytes_text(report.bytes),
                    part_text(report.bytes, report.tile_bytes),
                    bytes_text(report.tile_bytes)
                );
                rows.push(row!["  arrays", text]);
                rows.extend(report.texts.iter().map(|(name, text)| row![format!("  {name}"), text]));
            }
            _ => {
                let Some(report) = &about.appearance else { continue };
                let [y, x, height, width] = report.exemplar;
                rows.push(row!["  exemplar", format!("{width}x{height} from {x},{y}")]);
                rows.push(row!["  levels", report.levels.len()]);
                let lattice = report.found.parse().map(|lattice| lattice_text(&lattice));
                rows.push(row!["  lattice", lattice.unwrap_or_else(|_| report.found.clone())]);
            }
        }
        rows.extend(asked(done.stage, "seed").map(|seed| row!["  seed", seed]));
    }
    rows.extend(of_kept(&about.kept));
    rows
}

fn of_enlarged(about: &Grown) -> Rows {
    let unknown = || "not known".to_owned();
    let mut rows = vec![
        row!["kind", "enlarged"],
        row!["size", format!("{}x{}", about.width, about.height)],
        row!["method", format!("{:?}", about.method).to_lowercase()],
        row!["seed", about.seed],
        row!["tileable", yes(about.tileable)],
    ];
    rows.extend(about.options.iter().map(|(name, value)| row![name, value]));
    rows.extend([
        row!["source", if about.source { "kept" } else { "not kept" }],
        row!["normals", if about.normals { "kept" } else { "not kept" }],
        row!["model", about.model.as_deref().unwrap_or("not known")],
        row!["tile", about.tile.map_or_else(unknown, |[width, height]| format!("{width}x{height}"))],
        row!["clusters", about.clusters.map_or_else(unknown, |clusters| clusters.to_string())],
        row!["shards done", format!("{} of {}", about.shards_done, about.shards)],
    ]);
    rows.extend(of_kept(&about.kept));
    rows
}

fn of_pyramid(about: &Pyramidal) -> Rows {
    let mut rows = vec![
        row!["kind", "deepzoom"],
        row!["size", format!("{}x{}", about.width, about.height)],
        row!["levels", about.levels],
        row![
            "tiles",
            format!(
                "{} of {} and {} overlap, {}",
                about.tiles, about.tile_side, about.overlap, about.tile_format
            )
        ],
        row!["finished", yes(about.kept.finished)],
    ];
    let PyramidRecipe { view, light, exposure, .. } = &about.recipe;
    rows.extend(
        [("view", view), ("light", light)].map(|(name, [theta, phi])| row![name, format!("{theta},{phi}")]),
    );
    rows.push(row!["exposure", exposure]);
    rows.extend(of_kept(&about.kept));
    rows
}
