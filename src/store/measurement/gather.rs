//! From images to texels: the samples of one chunk out of the images of a view.

use std::ops::Range;

use btfkit_formats::{SampleType, Samples, f16};

use crate::error::{Error, Result};
use crate::shape::{Size, Window};

/// The images of one view under all lights, in groups of lights that were read at once.
pub struct Images {
    size: Size,
    channels: usize,
    groups: Vec<(Range<usize>, Samples)>,
    sample_type: SampleType,
}

impl Images {
    /// Images of this size; every group of lights is [light, y, x, channel], and the groups follow one another.
    ///
    /// # Errors
    /// Groups of another size or type, or gaps between them.
    pub fn new(
        size: Size,
        channels: usize,
        sample_type: SampleType,
        groups: Vec<(Range<usize>, Samples)>,
    ) -> Result<Self> {
        let mut next = 0;
        for (lights, samples) in &groups {
            let expected = lights.len() * size.texels() * channels;
            if lights.start != next || samples.len() != expected || samples.sample_type() != sample_type {
                return Err(Error::internal(format!(
                    "lights {lights:?}: got {} samples of {}, expected {expected} of {} from light {next} on",
                    samples.len(),
                    samples.sample_type().name(),
                    sample_type.name()
                )));
            }
            next = lights.end;
        }
        Ok(Self { size, channels, groups, sample_type })
    }

    /// Number of lights.
    pub fn lights(&self) -> usize {
        self.groups.last().map_or(0, |(lights, _)| lights.end)
    }

    /// Samples of a window, [y, x, light, channel]. Beyond the plane its last row and column go on: such samples
    /// are never read, and so they cost least.
    pub(crate) fn gather(&self, window: Window) -> Samples {
        macro_rules! gathered {
            ($variant:ident, $type:ty) => {{
                let images = self.groups.iter().map(|(lights, samples)| match samples {
                    Samples::$variant(list) => (lights.clone(), list.as_slice()),
                    _ => (0..0, &[] as &[$type]),
                });
                Samples::$variant(self.gather_from(images, window))
            }};
        }
        match self.sample_type {
            SampleType::U8 => gathered!(U8, u8),
            SampleType::U16 => gathered!(U16, u16),
            SampleType::F16 => gathered!(F16, f16),
            SampleType::F32 => gathered!(F32, f32),
        }
    }

    fn gather_from<'a, T: Copy + Default + 'a>(
        &self,
        groups: impl Iterator<Item = (Range<usize>, &'a [T])>,
        window: Window,
    ) -> Vec<T> {
        let Size { height, width } = self.size;
        let (channels, lights) = (self.channels, self.lights());
        let texel = lights * channels;
        let mut texels = vec![T::default(); window.size.texels() * texel];
        let inside = window.size.width.min(width - window.x);
        for (range, list) in groups {
            let plane = height * width * channels;
            for (light, image) in range.zip(list.chunks_exact(plane)) {
                for row in 0..window.size.height {
                    let y = (window.y + row).min(height - 1);
                    let from = (y * width + window.x) * channels;
                    let from = &image[from..from + inside * channels];
                    let to = &mut texels[row * window.size.width * texel + light * channels..];
                    scatter(from, to, channels, texel);
                }
            }
        }
        if inside < window.size.width {
            for row in texels.chunks_exact_mut(window.size.width * texel) {
                for column in inside..window.size.width {
                    row.copy_within((inside - 1) * texel..inside * texel, column * texel);
                }
            }
        }
        texels
    }
}

/// Copies the pixels of a row to their places, `stride` apart.
#[inline]
fn scatter<T: Copy>(from: &[T], to: &mut [T], channels: usize, stride: usize) {
    // The common counts by name, so that a pixel is moved in registers.
    match channels {
        1 => from.iter().zip(to.iter_mut().step_by(stride)).for_each(|(from, to)| *to = *from),
        3 => {
            for (from, to) in from.as_chunks::<3>().0.iter().zip(to.chunks_mut(stride)) {
                if let Some(to) = to.first_chunk_mut::<3>() {
                    *to = *from;
                }
            }
        }
        _ => {
            for (from, to) in from.chunks_exact(channels).zip(to.chunks_mut(stride)) {
                to[..channels].copy_from_slice(from);
            }
        }
    }
}

/// Texels [y, x, light, channel] as images [light, y, x, channel].
pub(crate) fn images_of_texels(texels: &Samples, lights: usize, channels: usize) -> Samples {
    fn turned<T: Copy>(texels: &[T], lights: usize, channels: usize) -> Vec<T> {
        let texel = lights * channels;
        (0..lights)
            .flat_map(|light| {
                texels.chunks_exact(texel).flat_map(move |t| &t[light * channels..(light + 1) * channels])
            })
            .copied()
            .collect()
    }
    match texels {
        Samples::U8(list) => Samples::U8(turned(list, lights, channels)),
        Samples::U16(list) => Samples::U16(turned(list, lights, channels)),
        Samples::F16(list) => Samples::F16(turned(list, lights, channels)),
        Samples::F32(list) => Samples::F32(turned(list, lights, channels)),
    }
}

/// The bytes of samples, little-endian.
pub(crate) fn bytes(samples: &Samples) -> &[u8] {
    const { assert!(cfg!(target_endian = "little")) };
    match samples {
        Samples::U8(list) => list,
        Samples::U16(list) => bytemuck::cast_slice(list),
        Samples::F16(list) => bytemuck::cast_slice(list),
        Samples::F32(list) => bytemuck::cast_slice(list),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_window_over_the_border_holds_its_texels_and_goes_on_with_the_last() {
        let size = Size::new(3, 4);
        for channels in [1, 2, 3] {
            let sample =
                |light: usize, y: usize, x: usize, c: usize| (light * 64 + y * 16 + x * 4 + c) as u16;
            let image = |light: usize| {
                (0..3).flat_map(move |y| {
                    (0..4).flat_map(move |x| (0..channels).map(move |c| sample(light, y, x, c)))
                })
            };
            let groups = vec![
                (0..2, Samples::U16((0..2).flat_map(image).collect())),
                (2..3, Samples::U16(image(2).collect())),
            ];
            let images = Images::new(size, channels, SampleType::U16, groups).unwrap();
            let window = Window { y: 1, x: 2, size: Size::new(4, 3) };
            let Samples::U16(found) = images.gather(window) else { unreachable!() };
            let mut expected = Vec::new();
            for y in 1..5 {
                for x in 2..5 {
                    for light in 0..3 {
                        expected.extend((0..channels).map(|c| sample(light, y.min(2), x.min(3), c)));
                    }
                }
            }
            assert_eq!(found, expected, "{channels} channels");
            let whole = images.gather(size.window());
            let Samples::U16(turned) = images_of_texels(&whole, 3, channels) else { unreachable!() };
            assert_eq!(turned, (0..3).flat_map(image).collect::<Vec<_>>());
        }
    }

    #[test]
    fn groups_that_do_not_fit_are_refused() {
        let size = Size::new(1, 1);
        let of = |groups| Images::new(size, 1, SampleType::U8, groups).is_ok();
        assert!(of(vec![(0..1, Samples::U8(vec![1])), (1..2, Samples::U8(vec![2]))]));
        assert!(!of(vec![(1..2, Samples::U8(vec![1]))]));
        assert!(!of(vec![(0..1, Samples::U8(vec![1, 2]))]));
        assert!(!of(vec![(0..1, Samples::U16(vec![1]))]));
    }
}
