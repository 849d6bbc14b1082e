//! Windows of the coherent rule, kernel by kernel: `cargo bench --bench coherent`.
//!
//! `scripts/bench-enlarge` runs it beside numba on the same model, with `--cpu MODEL`: timed by the processor instead of
//! the clock, which other programs disturb; prints a JSON object a line.
#![allow(clippy::expect_used, clippy::print_stdout)]

mod processor;

use std::path::Path;

use btfkit::kernel::Kernel;
use btfkit::lattice::WaveCounts;
use btfkit::method::coherent::fit::fit;
use btfkit::method::coherent::{FEATURES, Plane};
use btfkit::random::Hash;
use btfkit::shape::Size;
use btfkit::store::model::Model;
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use processor::median_ns;
use serde_json::json;

/// Rows and columns of a window.
const SIDES: [usize; 3] = [64, 512, 1024];

fn main() {
    let mut arguments = std::env::args();
    if arguments.any(|argument| argument == "--cpu") {
        by_processor(Path::new(&arguments.next().expect("a model after --cpu")));
    } else {
        divan::main();
    }
}

fn by_processor(model: &Path) {
    let model = Model::open(model).expect("a model");
    let (tile, index) = (model.tile().expect("a tile").size, model.index().expect("an index"));
    let appearance = model.appearance().expect("an appearance");
    for kernel in Kernel::available() {
        let plane = Plane::new(tile, &index, &appearance, kernel).expect("a plane");
        for side in SIDES {
            let cpu_ns = median_ns(side * side, || window(&plane, side));
            let kernel = format!("{kernel:?}");
            println!("{}", json!({"work": "coherent", "kernel": kernel, "side": side, "cpu_ns": cpu_ns}));
        }
    }
}

fn window(plane: &Plane, side: usize) {
    let variation = plane.variation(black_box(1));
    black_box(plane.window(&variation, 0, 0, Size::new(side, side)).expect("a window"));
}

/// A plane of 256 x 256 texels in blotches of about 12 texels, grainy, of 64 clusters.
fn plane(kernel: Kernel) -> Plane {
    const SIDE: usize = 256;
    let hash = Hash::new(1, 0);
    let level = |y: usize, x: usize| {
        let blotch = hash.normals((y / 12) as u32, (x / 12) as u32, 1)[0];
        blotch + 0.3 * hash.normals(y as u32, x as u32, 2)[0]
    };
    let index: Vec<u16> =
        (0..SIDE * SIDE).map(|n| (32.0 + 12.0 * level(n / SIDE, n % SIDE)).clamp(0.0, 63.0) as u16).collect();
    let features: Vec<[i8; FEATURES]> =
        (0..64).map(|n| std::array::from_fn(|f| ((4 * n - 126) / (f as i32 + 1)) as i8)).collect();
    let size = Size::new(SIDE, SIDE);
    let appearance = fit(size.window(), false, &index, features, WaveCounts::default());
    Plane::new(size, &index, &appearance, kernel).expect("a plane")
}

/// A texel is an item.
#[divan::bench(args = cases())]
fn windows(bencher: Bencher<'_, '_>, (kernel, side): &(Kernel, usize)) {
    let plane = plane(*kernel);
    bencher.counter(ItemsCount::new(side * side)).bench_local(|| window(&plane, *side));
}

fn cases() -> Vec<(Kernel, usize)> {
    Kernel::available().into_iter().flat_map(|kernel| SIDES.map(|side| (kernel, side))).collect()
}

/// What is made of a model before its first window: the appearance of every level. A texel of the exemplar is an item.
#[divan::bench]
fn levels(bencher: Bencher<'_, '_>) {
    bencher
        .counter(ItemsCount::new(256usize * 256))
        .bench_local(|| black_box(plane(Kernel::fastest())).bytes());
}
