//! What to ask Slurm for: memory by the plans of the stages, time by what a byte or a texel was measured to cost.

use crate::run::budget::OWN_BYTES;
use crate::shape::Size;
use crate::stage::{cluster, deepzoom, enlarge, import, tile};
use crate::store::measurement::Description;

use super::{Options, Parts, Surface};

/// Processor time of a raw byte, nanoseconds: an import of a whole archive of JPEGs (docs/benchmarks.md).
const IMPORT_NS: f64 = 11.0;

/// The same of a clustering into [`USUAL_CLUSTERS`], with the stages after it.
const CLUSTER_NS: f64 = 25.0;

/// Clusters that [`CLUSTER_NS`] was measured with.
const USUAL_CLUSTERS: f64 = 256.0;

/// Processor time of a texel of an enlargement, nanoseconds: that of the slowest method over a whole plane.
const ENLARGE_NS: f64 = 2100.0;

/// Processor time of a texel of a Deep Zoom pyramid, nanoseconds.
const PYRAMID_NS: f64 = 120.0;

/// How many times what was estimated is asked for: machines differ, and file systems more.
const MARGIN: f64 = 4.0;

/// Minutes that are asked for beside that.
const LEAST_MINUTES: f64 = 10.0;

/// What a task is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Need {
    /// Memory that the program is told to use, MiB.
    pub(super) memory_mib: u64,
    /// Memory that Slurm is asked for, MiB.
    pub(super) slurm_mib: u64,
    /// Estimated time of the work, seconds.
    pub(super) seconds: u64,
    /// Time limit, minutes.
    pub(super) minutes: u64,
}

impl Need {
    /// Of a task that takes so much memory, and so much processor time on all its processors together.
    fn new(options: &Options, memory_bytes: u64, cpu_seconds: f64) -> Self {
        let memory_mib = options.memory_bytes.max(memory_bytes).div_ceil(1 << 20);
        let seconds = cpu_seconds / options.cpus.max(1) as f64;
        let minutes = (LEAST_MINUTES + MARGIN * seconds / 60.0).ceil() as u64;
        Self {
            memory_mib,
            slurm_mib: with_room(memory_mib),
            seconds: seconds.ceil() as u64,
            minutes: options.minutes.map_or(minutes, u64::from),
        }
    }
}

/// Memory to ask for, MiB: besides what the program promises to stay within, Slurm may count pages of mapped files and
/// of files that are being written.
fn with_room(mib: u64) -> u64 {
    mib + mib / 4 + 64
}

/// What is known of a material before any job runs.
pub(super) struct Facts {
    /// What its measurement holds, or will hold.
    pub(super) description: Description,
    /// Memory of one view of its import; 0 where there is nothing to import.
    pub(super) view_bytes: u64,
}

impl Facts {
    /// Of an archive.
    pub(super) fn of_archive(source: &dyn crate::archive::Source) -> Self {
        let description = import::describe(source, 1.0);
        let view_bytes = import::unit_bytes(&description, source);
        Self { description, view_bytes }
    }

    /// Of a measurement.
    pub(super) fn of_measurement(description: Description) -> Self {
        Self { description, view_bytes: 0 }
    }
}

/// What a task of each stage is given, for the material that takes most.
pub(super) struct Needs {
    pub(super) import: Need,
    pub(super) tile: Need,
    pub(super) assign: Need,
    pub(super) model: Need,
    pub(super) enlarge: Need,
    pub(super) pyramid: Need,
}

impl Needs {
    /// `known` holds what is known of some of the materials.
    pub(super) fn of(options: &Options, parts: Parts, known: &[Facts]) -> Self {
        let most = |of: &dyn Fn(&Facts) -> u64| known.iter().map(of).max().unwrap_or(0);
        let bytes = most(&|facts| facts.description.bytes()) as f64;
        let choice = options.tile.unwrap_or(tile::Choice::Auto);
        let mut clustering = cluster::Options::new("", "");
        if let Some(clusters) = options.clusters {
            clustering.amount = cluster::Amount::Clusters(clusters);
        }
        let model_bytes =
            most(&|facts| tile::enough_for_model(&facts.description, choice, &clustering, options.cpus));
        let view_bytes = most(&|facts| facts.view_bytes.saturating_add(OWN_BYTES));
        let clusters = options.clusters.map_or(USUAL_CLUSTERS, |clusters| clusters as f64);
        let clustering = bytes * CLUSTER_NS * 1e-9 * (clusters / USUAL_CLUSTERS).max(1.0);
        let texels = options.surface.as_ref().map_or(0.0, |surface| surface.size.texels() as f64) * 1e-9;
        let [imports, assigns, enlargements] =
            [parts.import, parts.cluster, parts.enlarge].map(|parts| parts.max(1) as f64);
        let [enlarge_bytes, pyramid_bytes] = surface_bytes(options, known);
        Self {
            import: Need::new(options, view_bytes, bytes * IMPORT_NS * 1e-9 / imports),
            tile: Need::new(options, model_bytes, clustering / 4.0),
            // A clustering takes some ten passes or more, of which the first is the longest.
            assign: Need::new(options, model_bytes, clustering / 2.0 / assigns),
            model: Need::new(options, model_bytes, clustering),
            enlarge: Need::new(options, enlarge_bytes, texels * ENLARGE_NS / enlargements),
            // Each part goes through all rows.
            pyramid: Need::new(options, pyramid_bytes, texels * PYRAMID_NS),
        }
    }
}

/// Memory that is enough for the enlargement of any material, and for its pyramid.
fn surface_bytes(options: &Options, known: &[Facts]) -> [u64; 2] {
    let Some(Surface { size, by, .. }) = &options.surface else { return [0; 2] };
    let tile_of = |facts: &Facts| match options.tile {
        Some(tile::Choice::Sized(size)) => size,
        _ => facts.description.size,
    };
    let clusters = options.clusters.unwrap_or(cluster::USUAL_CLUSTERS);
    // What the size alone takes counts also where no material is known.
    let tiles = known.iter().map(tile_of).chain([Size::new(1, 1)]);
    tiles.fold([0; 2], |[most, most_of_pyramid], tile| {
        [
            most.max(enlarge::enough_bytes(by, *size, tile, clusters)),
            most_of_pyramid.max(deepzoom::enough_bytes(*size, tile.texels(), options.cpus)),
        ]
    })
}
