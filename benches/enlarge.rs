//! What an enlarged index is made of, kernel by kernel: `cargo bench --bench enlarge`.
//!
//! `scripts/bench-enlarge` runs it beside the same work of others, with `--cpu`: the same work timed by the processor
//! instead of the clock, which other programs disturb; prints a JSON object a line.
#![allow(clippy::expect_used, clippy::print_stdout)]

mod processor;

use btfkit::kernel::Kernel;
use btfkit::kernel::car::{Coefficients, Ends, Field};
use btfkit::random::Hash;
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use processor::median_ns;
use serde_json::json;

fn main() {
    if std::env::args().any(|argument| argument == "--cpu") {
        by_processor();
    } else {
        divan::main();
    }
}

fn by_processor() {
    let texels = HEIGHT * WIDTH;
    for kernel in Kernel::available() {
        let mut row = vec![0.0; 3 * WIDTH];
        let ns = median_ns(3 * texels, || (0..HEIGHT).for_each(|_| noise_row(kernel, &mut row)));
        println!("{}", json!({"work": "noise", "kernel": format!("{kernel:?}"), "cpu_ns": ns}));
    }
    let noise = noise_in_memory();
    for (kernel, sites) in cases() {
        let mut field = Car::new(sites).field(kernel);
        let car = median_ns(texels, || car_rows(&mut field, &noise));
        let both = median_ns(texels, || noise_and_car_rows(&mut field, kernel));
        for (work, ns) in [("car", car), ("noise and car", both)] {
            let kernel = format!("{kernel:?}");
            println!("{}", json!({"work": work, "kernel": kernel, "neighbours": sites, "cpu_ns": ns}));
        }
    }
}

/// Texels of a row, and rows.
const WIDTH: usize = 1024;
const HEIGHT: usize = 256;

/// A row of noise of three channels.
fn noise_row(kernel: Kernel, row: &mut [f32]) {
    let hash = Hash::new(1, 0);
    for (channel, row) in row.chunks_exact_mut(WIDTH).enumerate() {
        hash.normal_row(kernel, 5, black_box(-256), channel as u32, row);
    }
    black_box(row);
}

/// A normal is an item.
#[divan::bench(args = Kernel::available())]
fn noise(bencher: Bencher<'_, '_>, kernel: Kernel) {
    let mut row = vec![0.0; 3 * WIDTH];
    bencher.counter(ItemsCount::new(3 * WIDTH)).bench_local(|| noise_row(kernel, &mut row));
}

/// Rows of three channels.
fn noise_in_memory() -> Vec<f32> {
    let mut noise = vec![0.0; HEIGHT * 3 * WIDTH];
    for (row, noise) in noise.chunks_exact_mut(WIDTH).enumerate() {
        Hash::new(1, 0).normal_row(Kernel::fastest(), row as i32, 0, 0, noise);
    }
    noise
}

/// A field of three channels and `sites` neighbours, nearest first; noise is there already.
struct Car {
    sites: Vec<[i32; 2]>,
    gamma: Vec<f64>,
}

impl Car {
    fn new(count: usize) -> Self {
        let all = (0..6).flat_map(|dy| (-6..=6).map(move |dx| [dy, dx]));
        let mut sites: Vec<[i32; 2]> = all.filter(|&[dy, dx]| dy > 0 || dx > 0).collect();
        sites.sort_by_key(|[dy, dx]| (dy * dy + dx * dx, *dy, *dx));
        sites.truncate(count);
        let weight = |&[dy, dx]: &[i32; 2]| 1.0 / f64::from(1 + dy * dy + dx * dx);
        let sum: f64 = sites.iter().map(weight).sum();
        let of = |site| {
            (0..9).map(move |n| if n % 4 == 0 { 0.95 * weight(site) / sum } else { 1e-4 * f64::from(n) })
        };
        let gamma = sites.iter().flat_map(of).collect();
        Self { sites, gamma }
    }

    fn field(&self, kernel: Kernel) -> Field {
        let factor = [1.0, 0.0, 0.0, 0.1, 1.0, 0.0, 0.1, 0.1, 1.0];
        let coefficients =
            Coefficients { channels: 3, sites: &self.sites, gamma: &self.gamma, factor: &factor };
        Field::new(kernel, coefficients, WIDTH, Ends::Open)
    }
}

/// Rows of a field from noise in memory.
fn car_rows(field: &mut Field, noise: &[f32]) {
    for noise in black_box(noise).chunks_exact(3 * WIDTH) {
        field.advance(|channel, at, out| out.copy_from_slice(&noise[channel * WIDTH + at..][..out.len()]));
    }
    black_box(field.row(0, 2)[WIDTH - 1]);
}

/// The same with its noise.
fn noise_and_car_rows(field: &mut Field, kernel: Kernel) {
    let hash = Hash::new(1, 0);
    for row in 0..HEIGHT as i32 {
        field.advance(|channel, at, out| hash.normal_row(kernel, row, at as i32, channel as u32, out));
    }
    black_box(field.row(0, 2)[WIDTH - 1]);
}

/// A texel is an item.
#[divan::bench(args = cases())]
fn car(bencher: Bencher<'_, '_>, (kernel, sites): &(Kernel, usize)) {
    let noise = noise_in_memory();
    let mut field = Car::new(*sites).field(*kernel);
    bencher.counter(ItemsCount::new(HEIGHT * WIDTH)).bench_local(|| car_rows(&mut field, &noise));
}

/// A texel is an item.
#[divan::bench(args = cases())]
fn noise_and_car(bencher: Bencher<'_, '_>, (kernel, sites): &(Kernel, usize)) {
    let mut field = Car::new(*sites).field(*kernel);
    bencher.counter(ItemsCount::new(HEIGHT * WIDTH)).bench_local(|| noise_and_car_rows(&mut field, *kernel));
}

fn cases() -> Vec<(Kernel, usize)> {
    let of = |sites| Kernel::available().into_iter().map(move |kernel| (kernel, sites));
    [20, 40].into_iter().flat_map(of).collect()
}
