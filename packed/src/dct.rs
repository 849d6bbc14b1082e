//! The orthonormal cosine transform (DCT-II) of an image, and its inverse (DCT-III), of any size.
//!
//! Even lengths are halved (Lee 1984), the odd rest is summed as it stands: the order of all sums is fixed.

use core::f64::consts::PI;

use crate::turn::transposed;

/// The transform of lengths `height` and `width`.
pub(crate) struct Dct {
    size: [usize; 2],
    axes: [Axis; 2],
}

impl Dct {
    pub(crate) fn new(size: [usize; 2]) -> Self {
        Self { size, axes: size.map(Axis::new) }
    }

    /// Transforms an image [y, x].
    pub(crate) fn forward(&self, image: &mut [f64]) {
        self.both(image, Axis::forward);
    }

    /// Transforms back.
    pub(crate) fn inverse(&self, image: &mut [f64]) {
        self.both(image, Axis::inverse);
    }

    fn both(&self, image: &mut [f64], along: fn(&Axis, &mut [f64], usize)) {
        let [height, width] = self.size;
        along(&self.axes[0], image, width);
        let mut turned = transposed(image, height, width);
        along(&self.axes[1], &mut turned, height);
        image.copy_from_slice(&transposed(&turned, width, height));
    }
}

/// The transform of one length, of many columns at once.
struct Axis {
    length: usize,
    /// cos(pi k / (2 length)), for all k of a period.
    cosines: Vec<f64>,
}

impl Axis {
    fn new(length: usize) -> Self {
        let cosine = |k: usize| libm::cos(PI * k as f64 / (2 * length) as f64);
        Self { length, cosines: (0..4 * length).map(cosine).collect() }
    }

    /// cos(pi (2 place + 1) frequency / (2 length)) of a length that goes into this axis's.
    fn cosine(&self, length: usize, place: usize, frequency: usize) -> f64 {
        self.cosines[((2 * place + 1) * frequency % (4 * length)) * (self.length / length)]
    }

    /// Rows of `width` columns.
    fn forward(&self, rows: &mut [f64], width: usize) {
        let mut spare = vec![0.0; rows.len()];
        self.sums(rows, &mut spare, width);
        self.scale(rows, width);
    }

    fn inverse(&self, rows: &mut [f64], width: usize) {
        self.scale(rows, width);
        let mut spare = vec![0.0; rows.len()];
        self.waves(rows, &mut spare, width);
    }

    /// Makes the transform orthonormal.
    fn scale(&self, rows: &mut [f64], width: usize) {
        let [first, others] = [1.0, 2.0].map(|part: f64| (part / self.length as f64).sqrt());
        for (frequency, row) in rows.chunks_exact_mut(width).enumerate() {
            let scale = if frequency == 0 { first } else { others };
            row.iter_mut().for_each(|value| *value *= scale);
        }
    }

    /// Row k becomes the sum of all rows times their cosines of frequency k.
    fn sums(&self, rows: &mut [f64], spare: &mut [f64], width: usize) {
        let length = rows.len() / width;
        if length % 2 == 1 {
            return weighted(rows, spare, width, |frequency, place| self.cosine(length, place, frequency));
        }
        let half = length / 2;
        {
            let (sums, differences) = spare.split_at_mut(half * width);
            for place in 0..half {
                let scale = 0.5 / self.cosine(length, place, 1);
                let front = &rows[place * width..][..width];
                let back = &rows[(length - 1 - place) * width..][..width];
                let to =
                    sums[place * width..][..width].iter_mut().zip(&mut differences[place * width..][..width]);
                for ((front, back), (sum, difference)) in front.iter().zip(back).zip(to) {
                    *sum = front + back;
                    *difference = (front - back) * scale;
                }
            }
            let (spare_a, spare_b) = rows.split_at_mut(half * width);
            self.sums(sums, spare_a, width);
            self.sums(differences, spare_b, width);
        }
        let (even, odd) = spare.split_at(half * width);
        for frequency in 0..half {
            rows[2 * frequency * width..][..width].copy_from_slice(&even[frequency * width..][..width]);
            let to = &mut rows[(2 * frequency + 1) * width..][..width];
            to.copy_from_slice(&odd[frequency * width..][..width]);
            if frequency + 1 < half {
                let next = &odd[(frequency + 1) * width..][..width];
                to.iter_mut().zip(next).for_each(|(to, next)| *to += next);
            }
        }
    }

    /// Each row becomes the sum of all rows times the cosines of their frequencies at its place.
    fn waves(&self, rows: &mut [f64], spare: &mut [f64], width: usize) {
        let length = rows.len() / width;
        if length % 2 == 1 {
            return weighted(rows, spare, width, |place, frequency| self.cosine(length, place, frequency));
        }
        let half = length / 2;
        {
            let (even, odd) = spare.split_at_mut(half * width);
            for frequency in 0..half {
                even[frequency * width..][..width].copy_from_slice(&rows[2 * frequency * width..][..width]);
                let to = &mut odd[frequency * width..][..width];
                to.copy_from_slice(&rows[(2 * frequency + 1) * width..][..width]);
                if frequency > 0 {
                    let before = &rows[(2 * frequency - 1) * width..][..width];
                    to.iter_mut().zip(before).for_each(|(to, before)| *to += before);
                }
            }
            let (spare_a, spare_b) = rows.split_at_mut(half * width);
            self.waves(even, spare_a, width);
            self.waves(odd, spare_b, width);
        }
        let (even, odd) = spare.split_at(half * width);
        for place in 0..half {
            let scale = 0.5 / self.cosine(length, place, 1);
            let (front, back) = rows.split_at_mut(half * width);
            let front = &mut front[place * width..][..width];
            let back = &mut back[(half - 1 - place) * width..][..width];
            let parts = even[place * width..][..width].iter().zip(&odd[place * width..][..width]);
            for ((front, back), (a, b)) in front.iter_mut().zip(back).zip(parts) {
                let b = b * scale;
                (*front, *back) = (a + b, a - b);
            }
        }
    }
}

/// Each row becomes the sum of all rows, each times its weight there.
fn weighted(rows: &mut [f64], spare: &mut [f64], width: usize, weight: impl Fn(usize, usize) -> f64) {
    spare.fill(0.0);
    // Of a spectrum most rows are nothing but zeros, which add nothing.
    let is_some = |row: &&[f64]| row.iter().any(|&value| value != 0.0);
    let given: Vec<(usize, &[f64])> =
        rows.chunks_exact(width).enumerate().filter(|(_, row)| is_some(row)).collect();
    for (at, to) in spare.chunks_exact_mut(width).enumerate() {
        for &(number, from) in &given {
            let weight = weight(at, number);
            to.iter_mut().zip(from).for_each(|(to, from)| *to += weight * from);
        }
    }
    rows.copy_from_slice(spare);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(count: usize) -> Vec<f64> {
        (0..count).map(|n| ((n * n * 31 + n * 7) % 101) as f64 - 50.0).collect()
    }

    #[test]
    fn the_transform_is_the_orthonormal_dct_of_its_definition() {
        let (height, width) = (12, 7);
        let given = image(height * width);
        let mut found = given.clone();
        Dct::new([height, width]).forward(&mut found);
        let scale = |k: usize, n: usize| ((if k == 0 { 1.0 } else { 2.0 }) / n as f64).sqrt();
        let wave =
            |k: usize, at: usize, n: usize| (PI * (2 * at + 1) as f64 * k as f64 / (2 * n) as f64).cos();
        for u in 0..height {
            for v in 0..width {
                let sum: f64 = (0..height * width)
                    .map(|n| given[n] * wave(u, n / width, height) * wave(v, n % width, width))
                    .sum();
                let expected = sum * scale(u, height) * scale(v, width);
                assert!((found[u * width + v] - expected).abs() < 1e-9, "{u} {v}");
            }
        }
    }

    #[test]
    fn every_size_comes_back_with_the_same_energy() {
        for size in [[1, 1], [1, 8], [3, 2], [64, 64], [96, 50], [17, 128], [13, 1]] {
            let given = image(size[0] * size[1]);
            let dct = Dct::new(size);
            let mut found = given.clone();
            dct.forward(&mut found);
            let energy = |list: &[f64]| list.iter().map(|v| v * v).sum::<f64>();
            assert!((energy(&found) / energy(&given) - 1.0).abs() < 1e-12);
            dct.inverse(&mut found);
            assert!(found.iter().zip(&given).all(|(a, b)| (a - b).abs() < 1e-9), "{size:?}");
        }
    }
}
