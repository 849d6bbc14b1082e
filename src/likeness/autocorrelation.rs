//! Does a picture repeat itself? Its autocorrelation far from 0.

use rustfft::num_complex::Complex;

use super::Lightness;
use crate::shape::Size;
use crate::signal::fourier::Fourier;

/// Shifts of at least so many texels down or across are far: not the texture's own grain.
pub(crate) const FAR: usize = 12;

/// The largest circular autocorrelation at a far shift, -1 to 1; 0 of a picture that does not change, or that is too
/// small to have far shifts.
pub(crate) fn far_peak(picture: &Lightness) -> f64 {
    let Size { height, width } = picture.size;
    let mean = picture.mean();
    let fourier = Fourier::new(picture.size);
    let mut spectrum = fourier.forward_real(picture.values.iter().map(|value| value - mean));
    spectrum.iter_mut().for_each(|value| *value = Complex::new(value.norm_sqr(), 0.0));
    let correlations = fourier.inverse(&spectrum);
    let energy = correlations.first().map_or(0.0, |value| value.re);
    let far = |n: usize| {
        let (y, x) = (n / width, n % width);
        y.min(height - y).max(x.min(width - x)) >= FAR
    };
    let peak = (0..correlations.len()).filter(|&n| far(n)).map(|n| correlations[n].re).reduce(f64::max);
    peak.filter(|_| energy > 0.0).map_or(0.0, |peak| peak / energy)
}

/// Correlation of a picture with itself shifted by whole texels, over where both lie; 0 where they do not overlap.
pub(crate) fn at_shift(picture: &Lightness, [down, right]: [isize; 2]) -> f64 {
    let Size { height, width } = picture.size;
    let (rows, columns) = (down.unsigned_abs(), right.unsigned_abs());
    if rows >= height || columns >= width {
        return 0.0;
    }
    // The pair of a shift and of its opposite is the same.
    let (above, below) = if down < 0 { (rows, 0) } else { (0, rows) };
    let (before, after) = if right < 0 { (columns, 0) } else { (0, columns) };
    let part = |top: usize, left: usize| {
        (0..height - rows)
            .flat_map(move |y| picture.values[(y + top) * width + left..][..width - columns].iter().copied())
    };
    super::correlation(part(above, before), part(below, after))
}

/// The largest correlation within a texel of a shift.
pub(crate) fn near_shift(picture: &Lightness, shift: [f64; 2]) -> f64 {
    let [y, x] = shift.map(|n| n.round() as isize);
    let around = (-1..=1).flat_map(|down| (-1..=1).map(move |right| [y + down, x + right]));
    around.map(|shift| at_shift(picture, shift)).fold(-1.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Hash;

    #[test]
    fn what_repeats_has_a_peak_at_its_period_and_noise_has_none() {
        let (size, hash) = (Size::new(96, 90), Hash::new(2, 0));
        let noise = |y: usize, x: usize| hash.uniforms(y as u32, x as u32, 0)[0];
        let picture = |value: &dyn Fn(usize, usize) -> f64| {
            let values = (0..size.texels()).map(|n| value(n / size.width, n % size.width)).collect();
            Lightness::new(size, values)
        };
        // A period of (16, 3): rows are moved to the right by 3 every 16.
        let sheared = picture(&|y, x| noise(y % 16, (x + 90 - y / 16 * 3) % 90));
        let rough = picture(&|y, x| noise(y, x));
        assert!((at_shift(&sheared, [16, 3]) - 1.0).abs() < 1e-9);
        assert!((at_shift(&sheared, [-16, -3]) - 1.0).abs() < 1e-9);
        assert!(near_shift(&sheared, [15.4, 3.6]) > 0.999 && at_shift(&sheared, [16, -3]) < 0.2);
        assert!(far_peak(&picture(&|y, x| noise(y % 16, x))) > 0.999 && far_peak(&rough) < 0.2);
        assert!(near_shift(&rough, [16.0, 3.0]) < 0.2 && at_shift(&rough, [96, 0]) == 0.0);
        assert_eq!(far_peak(&picture(&|_, _| 4.0)), 0.0);
    }
}
