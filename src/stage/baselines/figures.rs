//! Figures of how near a tile is to the measured one, summed up view by view.

use btfkit_formats::Samples;
use serde::Serialize;

use crate::color::{Decoder, LightnessCodes, ciede2000, lab};
use crate::error::Result;
use crate::shape::Size;
use crate::store::measurement::Description;

/// Texels whose colours are compared, at most, under all pairs.
const COLOUR_TEXELS: usize = 256;

/// Pictures whose structure is compared, at most about: those of pairs evenly spread.
const PICTURES: usize = 400;

/// Side of the windows of the structural similarity.
const WINDOW: usize = 8;

/// What a representation keeps.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Figures {
    /// Peak signal-to-noise ratio of the stored samples, dB; none unless they differ.
    pub psnr_db: Option<f64>,
    /// Mean |dL*|.
    pub lightness: f64,
    /// Mean CIEDE2000.
    pub ciede2000: f64,
    /// Structural similarity of L* (Wang et al. 2004), windows of 8 x 8 texels; 1 is equal.
    pub ssim: f64,
    /// Mean |gradient of L*| as a part of the measured one: below 1 is blur.
    pub sharpness: f64,
}

/// Sums of figures.
#[derive(Clone, Debug, Default)]
pub(super) struct Sums {
    squares: f64,
    samples: u64,
    codes: u64,
    code_count: u64,
    colour: f64,
    colour_count: u64,
    ssim: f64,
    windows: u64,
    /// Of the representation and of the measurement.
    gradients: [f64; 2],
}

impl Sums {
    pub(super) fn add(&mut self, more: &Self) {
        self.squares += more.squares;
        self.samples += more.samples;
        self.codes += more.codes;
        self.code_count += more.code_count;
        self.colour += more.colour;
        self.colour_count += more.colour_count;
        self.ssim += more.ssim;
        self.windows += more.windows;
        self.gradients = [0, 1].map(|side| self.gradients[side] + more.gradients[side]);
    }

    pub(super) fn figures(&self) -> Figures {
        let mean = |sum: f64, count: u64| sum / count.max(1) as f64;
        let [own, measured] = self.gradients;
        let psnr = -10.0 * (self.squares / self.samples.max(1) as f64).log10();
        Figures {
            psnr_db: (self.squares > 0.0).then_some(psnr),
            lightness: mean(self.codes as f64, self.code_count) / 2.55,
            ciede2000: mean(self.colour, self.colour_count),
            ssim: if self.windows > 0 { self.ssim / self.windows as f64 } else { 1.0 },
            sharpness: if measured > 0.0 { own / measured } else { 1.0 },
        }
    }
}

/// What all views have in common.
pub(super) struct Judge {
    decoder: Decoder,
    codes: LightnessCodes,
    size: Size,
    /// Lights and channels.
    texel: [usize; 2],
    /// Of so many pairs of directions one's picture is looked at, and of so many texels one's colours.
    strides: [usize; 2],
}

/// The measured side of a view.
pub(super) struct OfView<'a> {
    judge: &'a Judge,
    measured: &'a Samples,
    /// L* codes [texel, light].
    codes: Vec<u8>,
    /// Lights whose pictures are looked at.
    lights: Vec<usize>,
}

impl Judge {
    pub(super) fn new(description: &Description, size: Size) -> Result<Self> {
        let pairs = description.views.len() * description.lights.len();
        Ok(Self {
            decoder: description.decoder()?,
            codes: description.codes()?,
            size,
            texel: [description.lights.len(), description.n_channels()],
            strides: [pairs.div_ceil(PICTURES), size.texels().div_ceil(COLOUR_TEXELS)],
        })
    }

    pub(super) fn of_view<'a>(&'a self, view: usize, measured: &'a Samples) -> Result<OfView<'a>> {
        let [lights, _] = self.texel;
        let shown = (0..lights).filter(|light| (view * lights + light).is_multiple_of(self.strides[0]));
        Ok(OfView { judge: self, measured, codes: self.codes.of(measured), lights: shown.collect() })
    }
}

impl OfView<'_> {
    /// Sums of samples of the same texels under the same view, [texel, light, channel].
    pub(super) fn sums(&self, samples: &Samples) -> Sums {
        let Judge { decoder, texel: [lights, channels], size, .. } = self.judge;
        let codes = self.judge.codes.of(samples);
        let mut sums = Sums::default();
        for at in 0..samples.len() {
            let [a, b] = [self.measured.value(at), samples.value(at)].map(|value| value.unwrap_or(0.0));
            if (a - b).is_finite() {
                sums.squares += (a - b) * (a - b);
                sums.samples += 1;
            }
        }
        sums.codes = self.codes.iter().zip(&codes).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
        sums.code_count = codes.len() as u64;
        for pair in
            (0..size.texels()).step_by(self.judge.strides[1]).flat_map(|t| t * lights..(t + 1) * lights)
        {
            let [a, b] = [self.measured, samples].map(|list| lab(decoder.rgb(list, pair * channels)));
            sums.colour += ciede2000(a, b);
            sums.colour_count += 1;
        }
        for &light in &self.lights {
            let picture = |codes: &[u8]| -> Vec<f64> {
                codes.iter().skip(light).step_by(*lights).map(|&code| f64::from(code)).collect()
            };
            let (measured, own) = (picture(&self.codes), picture(&codes));
            sums.gradients[0] += gradient(&own, *size);
            sums.gradients[1] += gradient(&measured, *size);
            let (similarity, windows) = similarity(&measured, &own, *size);
            sums.ssim += similarity;
            sums.windows += windows;
        }
        sums
    }
}

/// Sum of the lengths of the steps to the right and down.
fn gradient(picture: &[f64], Size { height, width }: Size) -> f64 {
    let mut sum = 0.0;
    for y in 0..height.saturating_sub(1) {
        for x in 0..width.saturating_sub(1) {
            let at = y * width + x;
            sum += (picture[at + 1] - picture[at]).hypot(picture[at + width] - picture[at]);
        }
    }
    sum
}

/// Sum of the structural similarity over windows that overlap by half, and how many there are.
fn similarity(a: &[f64], b: &[f64], Size { height, width }: Size) -> (f64, u64) {
    const STABLE: [f64; 2] = [(0.01 * 255.0) * (0.01 * 255.0), (0.03 * 255.0) * (0.03 * 255.0)];
    let (mut sum, mut windows) = (0.0, 0);
    for y in (0..(height + 1).saturating_sub(WINDOW)).step_by(WINDOW / 2) {
        for x in (0..(width + 1).saturating_sub(WINDOW)).step_by(WINDOW / 2) {
            let mut moments = [0.0; 5];
            for row in y..y + WINDOW {
                let range = row * width + x..row * width + x + WINDOW;
                for (a, b) in a[range.clone()].iter().zip(&b[range]) {
                    let more = [*a, *b, a * a, b * b, a * b];
                    moments = std::array::from_fn(|n| moments[n] + more[n]);
                }
            }
            let [a, b, aa, bb, ab] = moments.map(|moment| moment / (WINDOW * WINDOW) as f64);
            let (of_a, of_b, of_both) = (aa - a * a, bb - b * b, ab - a * b);
            sum += (2.0 * a * b + STABLE[0]) * (2.0 * of_both + STABLE[1])
                / ((a * a + b * b + STABLE[0]) * (of_a + of_b + STABLE[1]));
            windows += 1;
        }
    }
    (sum, windows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pictures_are_similar_by_one_and_blur_lowers_both_figures() {
        let size = Size::new(20, 24);
        let sharp: Vec<f64> = (0..480).map(|n| f64::from((n * 37 % 101) as u8)).collect();
        let (sum, windows) = similarity(&sharp, &sharp, size);
        assert!(windows == 4 * 5 && (sum / windows as f64 - 1.0).abs() < 1e-12);
        let blurred: Vec<f64> =
            (0..480).map(|n| (sharp[n] + sharp[(n + 1) % 480] + sharp[(n + 24) % 480]) / 3.0).collect();
        let (blurred_sum, _) = similarity(&sharp, &blurred, size);
        assert!(blurred_sum < 0.95 * sum && gradient(&blurred, size) < 0.8 * gradient(&sharp, size));
        assert_eq!(gradient(&[5.0; 480], size), 0.0);
        assert_eq!(similarity(&sharp[..9], &sharp[..9], Size::new(3, 3)), (0.0, 0));
    }
}
