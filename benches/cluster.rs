//! Our side of `scripts/bench-cluster`: clusters a corner of a measurement in memory.
//!
//!     cargo bench --bench cluster -- MEASUREMENT WIDTHxHEIGHT CLUSTERS FOLDER PASSES...
//!
//! Writes what the peers need to FOLDER (`scripts/peers/cluster.py` says what), and prints a JSON object a line.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use btfkit::kernel::Kernel;
use btfkit::method::cluster::centre::CentreRule;
use btfkit::method::cluster::lloyd::{self, Limits, Method};
use btfkit::method::cluster::points::{Arrangement, Points, WEIGHT_ONE};
use btfkit::method::cluster::seeding;
use btfkit::run::Context;
use btfkit::run::progress::Silent;
use btfkit::shape::Size;
use btfkit::store::measurement::Measurement;
use serde_json::json;

/// Seconds of the processor that all threads of this process have used, those that ended too.
fn cpu() -> f64 {
    const TICKS_A_SECOND: f64 = 100.0;
    let text = fs::read_to_string("/proc/self/stat").unwrap();
    // Name and state come first; user and system time are fields 14 and 15.
    let fields: Vec<&str> = text.rsplit_once(')').unwrap().1.split_whitespace().collect();
    (fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap()) / TICKS_A_SECOND
}

/// What `work` returns, and the seconds of the processor and of the clock that it took.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64, f64) {
    let (start, clock) = (cpu(), Instant::now());
    let result = work();
    (result, cpu() - start, clock.elapsed().as_secs_f64())
}

fn read(measurement: &Measurement, size: Size) -> Points {
    let description = measurement.description();
    let arrangement = Arrangement::new(&description.views, description.lights.len());
    let mut vectors = vec![0; size.texels() * arrangement.stride()];
    for view in 0..description.views.len() {
        arrangement.insert_view(
            &mut vectors,
            view,
            &measurement.read_luminance(view, size.window()).unwrap(),
        );
    }
    Points { arrangement, vectors }
}

fn write_for_peers(points: &Points, seeds: &[u32], folder: &Path) {
    let arrangement = &points.arrangement;
    // Padding bears its group's weight, but is equal in all vectors.
    let weights: Vec<f64> = arrangement
        .groups()
        .iter()
        .flat_map(|group| (group.start..group.end).map(|_| f64::from(group.weight) / WEIGHT_ONE))
        .collect();
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("vectors.bin"), &points.vectors).unwrap();
    fs::write(folder.join("weights.bin"), weights.iter().flat_map(|w| w.to_le_bytes()).collect::<Vec<u8>>())
        .unwrap();
    fs::write(folder.join("seeds.bin"), seeds.iter().flat_map(|s| s.to_le_bytes()).collect::<Vec<u8>>())
        .unwrap();
    let shape = json!({
        "texels": points.len(), "stride": arrangement.stride(), "clusters": seeds.len(), "codes_per_lightness": 2.55,
        "directions_weight": arrangement.weight_sum() as f64 / WEIGHT_ONE,
    });
    fs::write(folder.join("shape.json"), shape.to_string()).unwrap();
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let [measurement, size, clusters, folder, passes @ ..] = arguments.as_slice() else {
        println!("usage: cargo bench --bench cluster -- MEASUREMENT WIDTHxHEIGHT CLUSTERS FOLDER PASSES...");
        return;
    };
    let points = read(&Measurement::open(Path::new(measurement)).unwrap(), size.parse().unwrap());
    let clusters: usize = clusters.parse().unwrap();
    let stop = AtomicBool::new(false);
    for threads in [1, 2] {
        let context = Context::new(&Silent, &stop, threads, u64::MAX).unwrap();
        let kernel = Kernel::fastest();
        let seed = || context.install(|| seeding::draw(&points, clusters, 1, 0, kernel, &context)).unwrap();
        let (seeds, cpu_seconds, wall_seconds) = timed(seed);
        println!(
            "{}",
            json!({"peer": "btfkit k-means++", "threads": threads, "cpu_seconds": cpu_seconds, "wall_seconds": wall_seconds})
        );
        write_for_peers(&points, &seeds, Path::new(folder));
        for passes in passes {
            let passes: usize = passes.parse().unwrap();
            for (name, rule, columns) in [
                ("btfkit k-medians", CentreRule::Median, clusters),
                ("btfkit k-medians, 16 columns of bounds", CentreRule::Median, 16),
                ("btfkit k-means under (1)", CentreRule::Mean, clusters),
            ] {
                let method = Method {
                    rule,
                    limits: Limits { passes, tolerance: -1.0 },
                    columns,
                    kernel,
                    deadline: None,
                };
                let run =
                    || context.install(|| lloyd::run(&points, points.vectors_of(&seeds), method, &context));
                let (found, cpu_seconds, wall_seconds) = timed(run);
                let found = found.unwrap();
                println!(
                    "{}",
                    json!({
                        "peer": name, "threads": threads, "passes": found.passes.len(), "cpu_seconds": cpu_seconds,
                        "wall_seconds": wall_seconds, "objective": found.mean_lightness_error(),
                    })
                );
            }
        }
    }
}
