//! What the diagnoses look at, gathered in one pass over the views.

use btfkit_formats::SampleType;

use super::source::Views;
use crate::color::samples::{linear, scaled};
use crate::color::{LUMINANCE_WEIGHTS, Transfer, srgb_decode, srgb_encode};
use crate::error::Result;
use crate::run::progress::Counted;
use crate::run::{Context, units};
use crate::shape::Size;
use crate::store::measurement::Description;
use crate::words::counted;
use btfkit_formats::Direction;

/// The window in the middle of the plane that is looked at texel by texel.
const WINDOW: Size = Size { height: 192, width: 192 };

/// Side of a thumbnail.
const THUMBNAIL_SIDE: usize = 16;

/// Texels along a side at which the other readings of the transfer curve are tried.
const TRIED_SIDE: usize = 32;

/// Share of what the other images of the view or of the light promise below which an image is black.
pub(super) const BLACK: f64 = 0.02;

/// Difference of luminance, relative to the largest, up to which an image is plain: noise alone makes more.
const PLAIN: f32 = 1e-3;

/// Number of readings of the transfer curve: see [`Image::means`].
pub(crate) const READINGS: usize = 3;

/// The reading that the description declares.
pub(crate) const DECLARED: usize = 1;

/// What is known of one image.
#[derive(Clone, Debug, Default)]
pub struct Image {
    /// Mean luminance read with one sRGB decoding fewer than declared, as declared, with one more.
    /// All three over the same lattice of texels.
    pub means: [f64; READINGS],
    /// Mean luminance as declared, over all texels.
    pub mean: f64,
    /// Samples that are not finite.
    pub not_finite: u64,
    /// Samples below zero, and the least of them (0 if there are none).
    pub negative: u64,
    /// The least sample below zero.
    pub least: f32,
    /// The largest finite sample on the scale of 1.0 = reflectance 1 or display white.
    pub largest: f32,
    /// How many samples have the value `largest`.
    pub at_largest: u64,
    /// The least and the largest luminance of its texels; both are 0 where nothing is finite.
    pub range: [f32; 2],
    /// Hash of all samples.
    pub hash: u64,
    /// Mean luminance of each cell of a lattice, row by row.
    pub thumbnail: Vec<f32>,
}

/// What was gathered.
pub struct Statistics {
    /// View directions.
    pub views: Vec<Direction>,
    /// Light directions.
    pub lights: Vec<Direction>,
    /// Transfer curve as declared.
    pub transfer: Transfer,
    /// The largest sample there can be: the type's for integers, the largest found for floats.
    pub largest: f32,
    /// Size of the images.
    pub size: Size,
    /// Samples of one image.
    pub samples: u64,
    /// Images, [view, light].
    pub images: Vec<Image>,
    /// See [`relative`].
    relative: Vec<f64>,
    /// The view nearest to the normal.
    pub frontal: usize,
    /// Rows and columns of the window in the middle of the plane.
    pub window: Size,
    /// Luminance of the frontal view in that window, [y, x, light].
    pub frontal_luminance: Vec<f32>,
    /// Mean luminance over all lights in that window, [y, x], of every view.
    pub view_means: Vec<Vec<f32>>,
}

impl Statistics {
    /// The image of a view and a light.
    pub fn image(&self, view: usize, light: usize) -> &Image {
        &self.images[view * self.lights.len() + light]
    }

    /// Share of an image's samples that have the largest value of all.
    pub(crate) fn clipped_share(&self, view: usize, light: usize) -> f64 {
        let image = self.image(view, light);
        if image.largest >= self.largest { image.at_largest as f64 / self.samples.max(1) as f64 } else { 0.0 }
    }

    /// Whether every texel of an image is as bright as the others. One texel alone is no image.
    pub(crate) fn is_plain(&self, view: usize, light: usize) -> bool {
        let [least, largest] = self.image(view, light).range;
        self.size.texels() > 1 && largest - least <= PLAIN * largest.abs().max(least.abs())
    }

    /// Whether an image is so much darker than others of its view or of its light that nothing was photographed.
    pub(crate) fn is_black(&self, view: usize, light: usize) -> bool {
        self.relative[view * self.lights.len() + light] < BLACK
    }

    /// Light of the darkest image as a share of that of its like.
    pub(crate) fn darkest(&self) -> f64 {
        self.relative.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// Mean of each image, the light's cosine divided out, over the median of its view or of its light, whichever is
/// larger.
fn relative(images: &[Image], lights: &[Direction]) -> Vec<f64> {
    let n = lights.len().max(1);
    let cosine = |light: usize| lights[light].theta_rad.cos().max(0.05);
    let values: Vec<f64> = images.iter().enumerate().map(|(at, image)| image.mean / cosine(at % n)).collect();
    let of_view: Vec<f64> = values.chunks(n).map(|view| median(view.iter().copied())).collect();
    let of_light: Vec<f64> =
        (0..n).map(|light| median(values.iter().skip(light).step_by(n).copied())).collect();
    let promised = |at: usize| of_view[at / n].max(of_light[at % n]).max(f64::MIN_POSITIVE);
    values.iter().enumerate().map(|(at, value)| value / promised(at)).collect()
}

/// The median of numbers, 0 of none.
pub(super) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// Median absolute deviation from the median, scaled to the standard deviation of a Gaussian.
pub(super) fn deviation(values: &[f64]) -> f64 {
    let middle = median(values.iter().copied());
    1.4826 * median(values.iter().map(|value| (value - middle).abs()))
}

/// What one view gives.
struct ViewStatistics {
    images: Vec<Image>,
    mean: Vec<f32>,
    luminance: Vec<f32>,
    float: bool,
}

/// Reads every view once, as many at a time as memory allows.
pub(crate) fn gather(source: &dyn Views, context: &Context<'_>) -> Result<Statistics> {
    let description = source.description();
    let views: Vec<usize> = (0..description.views.len()).collect();
    let frontal = frontal_view(&description.views);
    context.progress.begin("check", views.len() as u64, Counted::Items("views"));
    let what = format!(
        "checking views of {} under {}",
        description.size,
        counted(description.lights.len(), "light")
    );
    let unit_bytes = description.view_bytes() + source.reading_bytes();
    let in_flight = units::in_flight_beside(context, &what, unit_bytes, kept_bytes(description))?;
    let parts = units::for_each(context, &views, in_flight, |&view| {
        let part = of_view(source, view, view == frontal)?;
        context.progress.advance(1);
        Ok(part)
    })?;
    context.progress.end();
    let found = parts.iter().flat_map(|part| &part.images).map(|image| image.largest).fold(0.0, f32::max);
    let largest = if parts.iter().any(|part| part.float) { found } else { 1.0 };
    let (mut images, mut view_means, mut frontal_luminance) = (Vec::new(), Vec::new(), Vec::new());
    for part in parts {
        images.extend(part.images);
        view_means.push(part.mean);
        if !part.luminance.is_empty() {
            frontal_luminance = part.luminance;
        }
    }
    Ok(Statistics {
        views: description.views.clone(),
        lights: description.lights.clone(),
        transfer: description.transfer,
        largest,
        size: description.size,
        samples: (description.size.texels() * description.n_channels()) as u64,
        relative: relative(&images, &description.lights),
        images,
        frontal,
        window: description.size.middle(WINDOW).size,
        frontal_luminance,
        view_means,
    })
}

/// Bytes of what is gathered of all views: images with their thumbnails, and the windows.
fn kept_bytes(description: &Description) -> u64 {
    let (views, lights) = (description.views.len(), description.lights.len());
    let window = description.size.middle(WINDOW).size.texels();
    let thumbnail = THUMBNAIL_SIDE.min(description.size.height) * THUMBNAIL_SIDE.min(description.size.width);
    let of_images = views * lights * (size_of::<Image>() + thumbnail * size_of::<f32>());
    (of_images + window * (views + lights) * size_of::<f32>()) as u64
}

/// The view nearest to the surface normal, the first of equals.
fn frontal_view(views: &[Direction]) -> usize {
    (0..views.len()).min_by(|&a, &b| views[a].theta_rad.total_cmp(&views[b].theta_rad)).unwrap_or(0)
}

/// Luminance of three channels, the mean of any other number of them.
fn brightness(channels: usize, value: impl Fn(usize) -> f64) -> f64 {
    match channels {
        3 => (0..3).map(|channel| LUMINANCE_WEIGHTS[channel] * value(channel)).sum(),
        n => (0..n).map(value).sum::<f64>() / n.max(1) as f64,
    }
}

/// The curves of [`Image::means`]: one sRGB decoding fewer than declared, as declared, one more.
struct Readings {
    curves: [fn(f64) -> f64; READINGS],
    /// Their values for 8-bit samples.
    table: Vec<[f64; READINGS]>,
}

impl Readings {
    fn new(transfer: Transfer, sample_type: SampleType) -> Self {
        let curves: [fn(f64) -> f64; READINGS] = match transfer {
            Transfer::Srgb => [|s| s, srgb_decode, |s| srgb_decode(srgb_decode(s))],
            Transfer::Linear => [srgb_encode, |s| s, srgb_decode],
        };
        let codes = if sample_type == SampleType::U8 { 0..256 } else { 0..0 };
        let table = codes.map(|code| curves.map(|curve| curve(f64::from(code) / 255.0))).collect();
        Self { curves, table }
    }

    fn of(&self, stored: &[f32]) -> [f64; READINGS] {
        std::array::from_fn(|reading| {
            brightness(stored.len(), |channel| {
                match self.table.get((stored[channel] * 255.0).round() as usize) {
                    Some(values) => values[reading],
                    None => self.curves[reading](f64::from(stored[channel])),
                }
            })
        })
    }
}

/// Sums over the texels of one view.
struct Sums<'a> {
    description: &'a Description,
    images: Vec<Image>,
    /// Rows and columns of the thumbnails.
    cells: Size,
    tried: u64,
    readings: Readings,
}

fn of_view(source: &dyn Views, view: usize, frontal: bool) -> Result<ViewStatistics> {
    let description = source.description();
    let Size { height, width } = description.size;
    let (lights, channels) = (description.lights.len(), description.n_channels());
    let samples = source.read_view(view, description.size.window())?;
    let window = description.size.middle(WINDOW);
    let mut sums = Sums::new(description, samples.sample_type());
    let mut mean = Vec::with_capacity(window.size.texels());
    let mut kept = Vec::new();
    for y in 0..height {
        let row = y * width * lights * channels..(y + 1) * width * lights * channels;
        let stored = scaled(&samples, row.clone());
        let decoded = linear(&samples, row, description.transfer);
        let light: Vec<f32> = decoded.chunks_exact(channels).map(luminance_of).collect();
        sums.add_row(y, &stored, &light);
        if (window.y..window.y + window.size.height).contains(&y) {
            let inside = &light[window.x * lights..(window.x + window.size.width) * lights];
            mean.extend(inside.chunks_exact(lights).map(|texel| texel.iter().sum::<f32>() / lights as f32));
            if frontal {
                kept.extend_from_slice(inside);
            }
        }
    }
    let float =
        matches!(samples.sample_type(), btfkit_formats::SampleType::F16 | btfkit_formats::SampleType::F32);
    Ok(ViewStatistics { images: sums.images(), mean, luminance: kept, float })
}

/// Brightness of linear samples; what is not finite counts as black.
fn luminance_of(sample: &[f32]) -> f32 {
    let value = brightness(sample.len(), |channel| f64::from(sample[channel])) as f32;
    if value.is_finite() { value } else { 0.0 }
}

impl<'a> Sums<'a> {
    fn new(description: &'a Description, sample_type: SampleType) -> Self {
        let Size { height, width } = description.size;
        let cells = Size::new(THUMBNAIL_SIDE.min(height), THUMBNAIL_SIDE.min(width));
        let readings = Readings::new(description.transfer, sample_type);
        let image = Image {
            thumbnail: vec![0.0; cells.texels()],
            largest: f32::NEG_INFINITY,
            range: [f32::INFINITY, f32::NEG_INFINITY],
            hash: 0xcbf2_9ce4_8422_2325,
            ..Image::default()
        };
        Self { description, images: vec![image; description.lights.len()], cells, tried: 0, readings }
    }

    /// Adds a row of texels: samples as stored [x, light, channel] and luminance [x, light].
    fn add_row(&mut self, y: usize, stored: &[f32], light: &[f32]) {
        let Size { height, width } = self.description.size;
        let (lights, channels) = (self.images.len(), self.description.n_channels());
        let (step_y, step_x) = (height.div_ceil(TRIED_SIDE), width.div_ceil(TRIED_SIDE));
        let cell_row = y * self.cells.height / height * self.cells.width;
        for (x, (stored, light)) in
            stored.chunks_exact(lights * channels).zip(light.chunks_exact(lights)).enumerate()
        {
            let cell = cell_row + x * self.cells.width / width;
            let tried = y.is_multiple_of(step_y) && x.is_multiple_of(step_x);
            self.tried += u64::from(tried);
            for ((image, sample), &light) in
                self.images.iter_mut().zip(stored.chunks_exact(channels)).zip(light)
            {
                image.mean += f64::from(light);
                image.range = [image.range[0].min(light), image.range[1].max(light)];
                image.thumbnail[cell] += light;
                sample.iter().for_each(|&s| image.add_sample(s));
                if tried {
                    let read = self.readings.of(sample);
                    let finite = read.iter().all(|value| value.is_finite());
                    image
                        .means
                        .iter_mut()
                        .zip(read)
                        .for_each(|(sum, value)| *sum += if finite { value } else { 0.0 });
                }
            }
        }
    }

    /// The images with their sums turned into means.
    fn images(self) -> Vec<Image> {
        let Size { height, width } = self.description.size;
        let counts = |cells: usize, texels: usize| -> Vec<usize> {
            (0..texels).fold(vec![0; cells], |mut counts, at| {
                counts[at * cells / texels] += 1;
                counts
            })
        };
        let (rows, columns) = (counts(self.cells.height, height), counts(self.cells.width, width));
        let mut images = self.images;
        for image in &mut images {
            image.mean /= self.description.size.texels() as f64;
            image.means.iter_mut().for_each(|sum| *sum /= self.tried.max(1) as f64);
            for (number, cell) in image.thumbnail.iter_mut().enumerate() {
                *cell /= (rows[number / columns.len()] * columns[number % columns.len()]) as f32;
            }
        }
        images
    }
}

impl Image {
    fn add_sample(&mut self, sample: f32) {
        self.hash =
            (self.hash ^ u64::from(sample.to_bits())).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
        if !sample.is_finite() {
            self.not_finite += 1;
            return;
        }
        if sample < 0.0 {
            self.negative += 1;
            self.least = self.least.min(sample);
        }
        if sample > self.largest {
            self.largest = sample;
            self.at_largest = 0;
        }
        self.at_largest += u64::from(sample == self.largest);
    }
}
