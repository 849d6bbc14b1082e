//! The field against its equation in f64, and the kernels against each other.

use super::*;
use crate::random::Hash;

/// Sites nearest first, as neighbourhoods grow, and stable coefficients for them.
struct Case {
    channels: usize,
    sites: Vec<[i32; 2]>,
    gamma: Vec<f64>,
    factor: Vec<f64>,
}

impl Case {
    fn new(channels: usize, count: usize) -> Self {
        let all = (0..6).flat_map(|dy| (-5..=5).map(move |dx| [dy, dx]));
        let mut sites: Vec<[i32; 2]> = all.filter(|&[dy, dx]| dy > 0 || dx > 0).collect();
        sites.sort_by_key(|[dy, dx]| (dy * dy + dx * dx, *dy, *dx));
        sites.truncate(count);
        let hash = Hash::new(4, 0);
        let weights: f64 = sites.iter().map(|&s| weight(s)).sum();
        let mut gamma = Vec::new();
        for (n, &site) in sites.iter().enumerate() {
            for to in 0..channels {
                for from in 0..channels {
                    let spread = hash.normals(n as u32, to as u32, from as u32)[0] / channels as f64;
                    let own = if to == from { 0.9 } else { 0.2 * spread };
                    gamma.push(weight(site) / weights * own);
                }
            }
        }
        let factor = (0..channels * channels).map(|n| {
            let (to, from) = (n / channels, n % channels);
            if from > to { f64::NAN } else { 1.0 / (1 + to - from) as f64 }
        });
        Self { channels, sites, gamma, factor: factor.collect() }
    }

    fn coefficients(&self) -> Coefficients<'_> {
        Coefficients { channels: self.channels, sites: &self.sites, gamma: &self.gamma, factor: &self.factor }
    }

    /// Rows of the equation, texel by texel, `[row][channel][width]`, between zeros.
    fn expected(&self, height: usize, width: usize) -> Vec<f64> {
        let c = self.channels;
        let mut field = vec![0.0; height * c * width];
        let mut z = vec![0.0; c * width];
        for y in 0..height {
            for channel in 0..c {
                for x in 0..width {
                    let mut one = [0.0];
                    noise(y, channel, x, &mut one);
                    z[channel * width + x] = f64::from(one[0]);
                }
            }
            for x in 0..width {
                for to in 0..c {
                    let mut sum: f64 = (0..=to).map(|j| self.factor[to * c + j] * z[j * width + x]).sum();
                    for (s, [dy, dx]) in self.sites.iter().enumerate() {
                        let (row, column) = (y as i32 - dy, x as i32 - dx);
                        if row >= 0 && (0..width as i32).contains(&column) {
                            for from in 0..c {
                                let neighbour = field[(row as usize * c + from) * width + column as usize];
                                sum += self.gamma[(s * c + to) * c + from] * neighbour;
                            }
                        }
                    }
                    field[(y * c + to) * width + x] = sum;
                }
            }
        }
        field
    }
}

fn weight([dy, dx]: [i32; 2]) -> f64 {
    1.0 / f64::from(1 + dy * dy + dx * dx)
}

fn noise(y: usize, channel: usize, x: usize, out: &mut [f32]) {
    Hash::new(1, 2).normal_row(Kernel::Plain, y as i32, x as i32, channel as u32, out);
}

fn made(kernel: Kernel, case: &Case, height: usize, width: usize, ends: Ends) -> Vec<f32> {
    let mut field = Field::new(kernel, case.coefficients(), width, ends);
    let mut rows = Vec::new();
    for y in 0..height {
        field.advance(|channel, x, out| noise(y, channel, x, out));
        (0..case.channels).for_each(|channel| rows.extend_from_slice(field.row(0, channel)));
    }
    rows
}

#[test]
fn rows_are_those_of_the_equation_in_every_kernel_to_the_bit() {
    let shapes = [(1, 1, 40), (1, 20, 700), (2, 6, 321), (3, 20, 1000), (3, 40, 333), (4, 14, 90)];
    for (channels, sites, width) in
        shapes.into_iter().chain([(5, 12, 65), (7, 3, 30), (17, 4, 50), (3, 0, 9)])
    {
        let case = Case::new(channels, sites);
        let plain = made(Kernel::Plain, &case, 12, width, Ends::Open);
        for (n, (found, expected)) in plain.iter().zip(case.expected(12, width)).enumerate() {
            let error = (f64::from(*found) - expected).abs();
            assert!(
                error < 1e-5 * expected.abs().max(1.0),
                "{channels} channels, value {n}: {found}, {expected}"
            );
        }
        for kernel in Kernel::available() {
            for ends in [Ends::Open, Ends::Ring { lead: 100 }] {
                let [reference, found] =
                    [Kernel::Plain, kernel].map(|kernel| made(kernel, &case, 12, width, ends));
                assert!(
                    reference.iter().zip(&found).all(|(a, b)| a.to_bits() == b.to_bits()),
                    "{channels} channels, {kernel:?}, {ends:?}"
                );
            }
        }
    }
}

/// A ring that is as wide as a part of an open row is periodic must continue it: noise of period 37.
#[test]
fn a_ring_is_the_period_of_an_endless_row() {
    let case = Case::new(3, 20);
    let (height, period, lead) = (20, 37, 200);
    let periodic = |y: usize, channel: usize, x: usize, out: &mut [f32]| {
        let mut all = vec![0.0; period];
        noise(y, channel, 0, &mut all);
        out.iter_mut().enumerate().for_each(|(n, z)| *z = all[(x + n) % period]);
    };
    let mut ring = Field::new(Kernel::Plain, case.coefficients(), period, Ends::Ring { lead });
    let mut open = Field::new(Kernel::Plain, case.coefficients(), 21 * period, Ends::Open);
    for y in 0..height {
        ring.advance(|channel, x, out| periodic(y, channel, x, out));
        open.advance(|channel, x, out| periodic(y, channel, x, out));
        for channel in 0..3 {
            // Far from both ends of the open row.
            let middle = &open.row(0, channel)[10 * period..11 * period];
            for (a, b) in ring.row(0, channel).iter().zip(middle) {
                assert!((a - b).abs() < 1e-5, "row {y}: {a}, {b}");
            }
        }
    }
}

#[test]
fn rows_put_back_continue_the_field() {
    let case = Case::new(2, 14);
    for ends in [Ends::Open, Ends::Ring { lead: 50 }] {
        let mut field = Field::new(Kernel::fastest(), case.coefficients(), 40, ends);
        (0..9).for_each(|y| field.advance(|channel, x, out| noise(y, channel, x, out)));
        let mut other = Field::new(Kernel::fastest(), case.coefficients(), 40, ends);
        for above in 0..field.depth() {
            let row: Vec<f32> = (0..2).flat_map(|channel| field.row(above, channel).to_vec()).collect();
            other.replace(above, &row);
        }
        for field in [&mut field, &mut other] {
            field.advance(|channel, x, out| noise(9, channel, x, out));
        }
        assert_eq!(field.row(0, 1), other.row(0, 1));
    }
}
