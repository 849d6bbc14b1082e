//! Small work on planes of numbers: smoothing, slopes, height from slopes, displacement.

use crate::shape::Size;

/// A plane of numbers, row by row.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    pub(super) size: Size,
    pub(super) values: Vec<f64>,
}

impl Plane {
    pub(super) fn new(size: Size, values: Vec<f64>) -> Self {
        Self { size, values }
    }

    fn at(&self, y: isize, x: isize) -> f64 {
        // Borders are mirrored.
        let reflect = |at: isize, length: usize| {
            let last = length as isize - 1;
            let at = if at < 0 { -at } else { at };
            (if at > last { 2 * last - at } else { at }).clamp(0, last) as usize
        };
        self.values[reflect(y, self.size.height) * self.size.width + reflect(x, self.size.width)]
    }

    fn map(&self, value: impl Fn(isize, isize) -> f64) -> Self {
        let Size { height, width } = self.size;
        let values = (0..height * width).map(|n| value((n / width) as isize, (n % width) as isize)).collect();
        Self { size: self.size, values }
    }

    pub(super) fn zip(&self, other: &Self, value: impl Fn(f64, f64) -> f64) -> Self {
        let values = self.values.iter().zip(&other.values).map(|(&a, &b)| value(a, b)).collect();
        Self { size: self.size, values }
    }

    pub(super) fn mean(&self) -> f64 {
        self.values.iter().sum::<f64>() / self.values.len().max(1) as f64
    }

    /// Mean square about the mean.
    pub(super) fn variance(&self) -> f64 {
        let mean = self.mean();
        self.values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / self.values.len().max(1) as f64
    }

    /// Smoothed by the binomial kernel [1 4 6 4 1] / 16 along both axes.
    pub(super) fn smoothed(&self) -> Self {
        const KERNEL: [(isize, f64); 5] = [(-2, 0.0625), (-1, 0.25), (0, 0.375), (1, 0.25), (2, 0.0625)];
        let rows = self.map(|y, x| KERNEL.iter().map(|&(d, weight)| weight * self.at(y, x + d)).sum());
        self.map(|y, x| KERNEL.iter().map(|&(d, weight)| weight * rows.at(y + d, x)).sum())
    }

    /// Mean over squares of side 2 `reach` + 1.
    fn blurred(&self, reach: isize) -> Self {
        let count = (2 * reach + 1) as f64;
        let rows = self.map(|y, x| (-reach..=reach).map(|d| self.at(y, x + d)).sum::<f64>() / count);
        self.map(|y, x| (-reach..=reach).map(|d| rows.at(y + d, x)).sum::<f64>() / count)
    }

    /// What is left when everything larger than about 2 `reach` texels is taken away.
    pub(super) fn details(&self, reach: isize) -> Self {
        // Twice a box is nearly a tent: fewer side lobes.
        self.zip(&self.blurred(reach).blurred(reach), |value, blurred| value - blurred)
    }

    /// Slope along x, to the right.
    pub(super) fn slope_x(&self) -> Self {
        self.map(|y, x| (self.at(y, x + 1) - self.at(y, x - 1)) / 2.0)
    }

    /// Slope along y, upwards in the picture.
    pub(super) fn slope_y(&self) -> Self {
        self.map(|y, x| (self.at(y - 1, x) - self.at(y + 1, x)) / 2.0)
    }

    /// The values at least `border` away from the border.
    pub(super) fn inner(&self, border: usize) -> Vec<f64> {
        let Size { height, width } = self.size;
        let rows = self.values.chunks_exact(width).take(height.saturating_sub(border)).skip(border);
        rows.flat_map(|row| &row[border.min(width)..width.saturating_sub(border).max(border.min(width))])
            .copied()
            .collect()
    }
}

/// Heights whose slopes are nearest to (p, q), q upwards: (laplace - leak) h = dp/dx + dq/dy by conjugate gradients.
/// The leak lets go of structure much larger than 2 pi / sqrt(leak) texels, which slopes hardly tell.
pub(super) fn height_of_slopes(p: &Plane, q: &Plane) -> Plane {
    const LEAK: f64 = 0.01;
    const ROUNDS: usize = 150;
    let Size { height, width } = p.size;
    let at = |y: usize, x: usize| y * width + x;
    // Minus the gradient's adjoint of the slopes between neighbours.
    let mut residual = vec![0.0; p.values.len()];
    for y in 0..height {
        for x in 0..width {
            if x + 1 < width {
                let slope = (p.values[at(y, x)] + p.values[at(y, x + 1)]) / 2.0;
                residual[at(y, x)] -= slope;
                residual[at(y, x + 1)] += slope;
            }
            if y + 1 < height {
                let slope = -(q.values[at(y, x)] + q.values[at(y + 1, x)]) / 2.0;
                residual[at(y, x)] -= slope;
                residual[at(y + 1, x)] += slope;
            }
        }
    }
    let apply = |h: &[f64]| -> Vec<f64> {
        let mut out: Vec<f64> = h.iter().map(|value| LEAK * value).collect();
        for y in 0..height {
            for x in 0..width {
                for other in [(x + 1 < width).then(|| at(y, x + 1)), (y + 1 < height).then(|| at(y + 1, x))]
                    .into_iter()
                    .flatten()
                {
                    let step = h[at(y, x)] - h[other];
                    out[at(y, x)] += step;
                    out[other] -= step;
                }
            }
        }
        out
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut solution = vec![0.0; residual.len()];
    let mut direction = residual.clone();
    let mut power = dot(&residual, &residual);
    let enough = 1e-10 * power;
    for _ in 0..ROUNDS {
        if power <= enough {
            break;
        }
        let image = apply(&direction);
        let step = power / dot(&direction, &image);
        solution.iter_mut().zip(&direction).for_each(|(h, d)| *h += step * d);
        residual.iter_mut().zip(&image).for_each(|(r, i)| *r -= step * i);
        let next = dot(&residual, &residual);
        direction.iter_mut().zip(&residual).for_each(|(d, r)| *d = r + next / power * *d);
        power = next;
    }
    Plane::new(p.size, solution)
}

/// How far, in texels (down, right), a plane is displaced against another, and their correlation there and where
/// they lie. Both should have their coarse structure taken away. `reach` bounds the search.
pub(super) struct Displacement {
    pub(super) down: f64,
    pub(super) right: f64,
    pub(super) correlation: f64,
    pub(super) correlation_in_place: f64,
}

/// By normalised cross-correlation, the peak refined by parabolas. None if the best is at the end of the search: there
/// is no peak.
pub(super) fn displacement(of: &Plane, against: &Plane, reach: usize) -> Option<Displacement> {
    let Size { height, width } = of.size;
    if height < 4 * reach || width < 4 * reach {
        return None;
    }
    let across = 2 * reach + 1;
    let scores: Vec<f64> =
        (0..across * across).map(|n| correlation(against, of, reach, n / across, n % across)).collect();
    let best = (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b]))?;
    let (y, x) = (best / across, best % across);
    let refine = |before: f64, peak: f64, after: f64| {
        let curvature = before - 2.0 * peak + after;
        if curvature < 0.0 { 0.5 * (before - after) / curvature } else { 0.0 }
    };
    let inside = |at: usize| at > 0 && at + 1 < across;
    if !inside(y) || !inside(x) {
        return None;
    }
    let down = refine(scores[best - across], scores[best], scores[best + across]);
    let right = refine(scores[best - 1], scores[best], scores[best + 1]);
    Some(Displacement {
        down: y as f64 - reach as f64 + down,
        right: x as f64 - reach as f64 + right,
        correlation: scores[best],
        correlation_in_place: scores[reach * across + reach],
    })
}

/// Correlation of the middle of `fixed` with the part of `moved` that begins at (y, x).
fn correlation(fixed: &Plane, moved: &Plane, reach: usize, y: usize, x: usize) -> f64 {
    let Size { height, width } = fixed.size;
    let (rows, columns) = (height - 2 * reach, width - 2 * reach);
    let mut sums = [0.0; 5];
    for row in 0..rows {
        let a = &fixed.values[(row + reach) * width + reach..][..columns];
        let b = &moved.values[(row + y) * width + x..][..columns];
        for (a, b) in a.iter().zip(b) {
            sums[0] += a;
            sums[1] += b;
            sums[2] += a * a;
            sums[3] += b * b;
            sums[4] += a * b;
        }
    }
    let n = (rows * columns) as f64;
    let covariance = sums[4] / n - sums[0] * sums[1] / (n * n);
    let variances = (sums[2] / n - (sums[0] / n).powi(2)) * (sums[3] / n - (sums[1] / n).powi(2));
    if variances > 0.0 { covariance / variances.sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn hills(dy: f64, dx: f64) -> Plane {
        let size = Size::new(60, 72);
        let value = |n: usize| {
            let (y, x) = ((n / 72) as f64 - dy, (n % 72) as f64 - dx);
            (0.4 * x + 0.1 * y).sin() + (0.13 * x - 0.37 * y).cos() + (0.05 * x * y / 20.0).sin()
        };
        Plane::new(size, (0..size.texels()).map(value).collect())
    }

    #[test]
    fn slopes_give_back_the_height() {
        let hills = hills(0.0, 0.0);
        let height = height_of_slopes(&hills.slope_x(), &hills.slope_y());
        let (a, b) = (height.details(8), hills.details(8));
        assert!(correlation(&a, &b, 6, 6, 6) > 0.98, "{}", correlation(&a, &b, 6, 6, 6));
    }

    #[test]
    fn a_displacement_is_found_with_its_sign() {
        let found = displacement(&hills(2.0, -3.4), &hills(0.0, 0.0), 6).unwrap();
        assert!(
            (found.down - 2.0).abs() < 0.1 && (found.right + 3.4).abs() < 0.1,
            "{} {}",
            found.down,
            found.right
        );
        assert!(found.correlation > 0.98 && found.correlation_in_place < 0.8);
    }
}
