//! The hot loops, each beside its plain form or its parts: `cargo bench`.
//!
//! Whole stages are measured by `scripts/bench`.
#![allow(clippy::expect_used)]

use btfkit::color::{LightnessCodes, Transfer};
use btfkit::kernel::Kernel;
use btfkit::kernel::counting::{STRIP, lower_medians};
use btfkit::kernel::predict::{self, Deltas, Numbers, Predictor, Shape};
use btfkit::method::cluster::points::Arrangement;
use btfkit::method::field::{Boundary, CarKind, Extent, Field, Gains, Options, Synthesis, fit};
use btfkit::random::Hash;
use btfkit_formats::{Direction, SampleType, Samples};
use divan::counter::{BytesCount, ItemsCount};
use divan::{Bencher, black_box};

fn main() {
    divan::main();
}

/// 81 views by 81 lights, as in the Bonn sets.
fn arrangement() -> Arrangement {
    let views: Vec<Direction> = btfkit_formats::ubo2003::directions_81()
        .iter()
        .map(|angles| Direction::from_degrees(angles.theta_deg(), angles.phi_deg()))
        .collect();
    Arrangement::new(&views, 81)
}

fn bytes(count: usize, salt: u32) -> Vec<u8> {
    let hash = Hash::new(1, salt);
    (0..count.div_ceil(16) as u32)
        .flat_map(|n| hash.words(n, 0, 0).map(u32::to_le_bytes))
        .flatten()
        .take(count)
        .collect()
}

fn normals(count: u32, salt: u32) -> Vec<[f32; 3]> {
    let hash = Hash::new(2, salt);
    let normal = |n| {
        let [x, y, ..] = hash.normals(n, 0, 0).map(|z| 0.2 * z);
        let length = (x * x + y * y + 1.0).sqrt();
        [x / length, y / length, 1.0 / length].map(|v| v as f32)
    };
    (0..count).map(normal).collect()
}

/// Distances of (1): 64 texels to 256 centres, in tiles.
#[divan::bench(args = Kernel::available())]
fn distances(bencher: Bencher<'_, '_>, kernel: Kernel) {
    let arrangement = arrangement();
    let (points, centres) = (bytes(64 * arrangement.stride(), 0), bytes(256 * arrangement.stride(), 1));
    let mut found = vec![0; 64 * 256];
    bencher.counter(ItemsCount::new(64usize * 256)).bench_local(|| {
        kernel.distances(
            black_box(&points),
            &centres,
            arrangement.stride(),
            arrangement.groups(),
            black_box(&mut found),
        );
    });
}

/// The same, each texel and centre by themselves.
#[divan::bench(args = Kernel::available())]
fn distances_one_by_one(bencher: Bencher<'_, '_>, kernel: Kernel) {
    let arrangement = arrangement();
    let stride = arrangement.stride();
    let (points, centres) = (bytes(64 * stride, 0), bytes(256 * stride, 1));
    bencher.counter(ItemsCount::new(64usize * 256)).bench_local(|| {
        let mut sum = 0;
        for point in black_box(&points).chunks_exact(stride) {
            for centre in centres.chunks_exact(stride) {
                let [distance] = kernel.row_distances(point, [centre], arrangement.groups());
                sum += distance;
            }
        }
        sum
    });
}

/// Medians of 76 texels, as many as a cluster has of 256 in a tile of 137x142.
#[divan::bench(args = Kernel::available())]
fn medians(bencher: Bencher<'_, '_>, kernel: Kernel) {
    let bytes = bytes(76 * 6784, 2);
    let strips = bytes.as_chunks::<STRIP>().0;
    let mut medians = [0; STRIP];
    bencher.counter(BytesCount::new(76usize * 6784)).bench_local(|| {
        for strip in 0..6784 / STRIP {
            let rows: Vec<&[u8; STRIP]> = (0..76).map(|row| &strips[row * (6784 / STRIP) + strip]).collect();
            lower_medians(kernel, black_box(&rows), &mut medians);
        }
        medians
    });
}

const CHUNK: Shape = Shape { rows: 16, columns: 16, lights: 81 };

/// A chunk of 8-bit colours: a ramp with noise.
fn colours() -> Vec<u8> {
    let noise = bytes(CHUNK.samples() * 3, 3);
    let ramp = |n: usize| (n / 243 % 16 * 3 + n / 3888 * 2 + n % 243 / 3) as u8;
    noise.iter().enumerate().map(|(n, noise)| ramp(n).wrapping_add(noise % 8)).collect()
}

/// Residuals of a chunk, the choice of the modes included.
#[divan::bench(args = predict::Kernel::available())]
fn prediction(bencher: Bencher<'_, '_>, kernel: predict::Kernel) {
    let samples = colours();
    let mut predictor = Predictor::<u8>::new(kernel, CHUNK, 3, Numbers::Integer);
    let (mut residuals, mut modes) = (vec![0; samples.len()], Vec::new());
    bencher.counter(BytesCount::new(samples.len())).bench_local(|| {
        predictor.forward(black_box(&samples), black_box(&mut residuals), &mut modes);
    });
}

/// The samples of a chunk from its residuals.
#[divan::bench(args = predict::Kernel::available())]
fn prediction_undone(bencher: Bencher<'_, '_>, kernel: predict::Kernel) {
    let samples = colours();
    let mut predictor = Predictor::<u8>::new(kernel, CHUNK, 3, Numbers::Integer);
    let (mut residuals, mut modes) = (vec![0; samples.len()], Vec::new());
    predictor.forward(&samples, &mut residuals, &mut modes);
    let mut back = vec![0; samples.len()];
    bencher.counter(BytesCount::new(samples.len())).bench_local(|| {
        predictor.inverse(black_box(&residuals), &modes, black_box(&mut back));
    });
}

/// The differences of a chunk that stock readers undo, and back.
#[divan::bench(args = predict::Kernel::available())]
fn deltas(bencher: Bencher<'_, '_>, kernel: predict::Kernel) {
    let samples = colours();
    let mut deltas = Deltas::<u8>::new(kernel, CHUNK, 3);
    let (mut bytes, mut back) = (vec![0; samples.len()], vec![0; samples.len()]);
    bencher.counter(BytesCount::new(2 * samples.len())).bench_local(|| {
        deltas.forward(black_box(&samples), black_box(&mut bytes));
        deltas.inverse(black_box(&bytes), black_box(&mut back));
    });
}

/// L* codes of 8-bit colours.
#[divan::bench]
fn lightness_codes(bencher: Bencher<'_, '_>) {
    let channels = ["R", "G", "B"].map(str::to_owned);
    let codes = LightnessCodes::new(Transfer::Srgb, SampleType::U8, &channels, 1.0).expect("known channels");
    let samples = Samples::U8(bytes(3 << 16, 0));
    let mut found = vec![0; 1 << 16];
    bencher
        .counter(ItemsCount::new(1usize << 16))
        .bench_local(|| codes.fill(black_box(&samples), &mut found));
}

/// Rows of a synthesised field, 1024 texels wide.
#[divan::bench(args = [CarKind::Car3d, CarKind::Car2d])]
fn synthesis(bencher: Bencher<'_, '_>, kind: CarKind) {
    // White noise smoothed by its neighbours, so that the fit takes a neighbourhood of some size.
    let noise: Vec<f64> = normals(64 * 64, 2).into_iter().flatten().map(f64::from).collect();
    let smooth =
        (0..noise.len()).map(|n| (0..5).map(|k| noise[(n + k * 195) % noise.len()]).sum::<f64>() / 5.0);
    let field = Field::new(64, 64, 3, smooth.collect()).expect("64 x 64 x 3 samples");
    let options = Options { kind, levels: Some(3), gains: Gains::None, boundary: Boundary::Periodic };
    let model = fit(&field, &options).expect("a field that can be fitted");
    let mut row = vec![0.0; 1024 * 3];
    bencher
        .counter(ItemsCount::new(64usize * 1024))
        .with_inputs(|| {
            Synthesis::new(&model, 1, 64, 1024, Extent::Endless, Kernel::fastest()).expect("a sound model")
        })
        .bench_local_values(|mut field| {
            for _ in 0..64 {
                field.next_row(black_box(&mut row)).expect("64 rows");
            }
        });
}
