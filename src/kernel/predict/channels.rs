//! Channels apart and together: each as its difference from another.

use super::lane::Lane;
use super::{Numbers, SLACK};

/// The channel whose samples are taken from those of `channel`: green from red and blue, else the one before.
pub(super) fn base(channel: usize, channels: usize) -> Option<usize> {
    match (channels, channel) {
        (3, 1) => None,
        (3, _) => Some(1),
        (_, channel) => channel.checked_sub(1),
    }
}

#[inline(always)]
fn ordered<T: Lane>(value: T, numbers: Numbers) -> T {
    match numbers {
        Numbers::Integer => value,
        Numbers::Float => value.ordered(),
    }
}

#[inline(always)]
fn restored<T: Lane>(value: T, numbers: Numbers) -> T {
    match numbers {
        Numbers::Integer => value,
        Numbers::Float => value.unordered(),
    }
}

/// Little-endian samples, channels innermost, to one plane for each channel, [`SLACK`] apart.
#[inline(always)]
pub(super) fn split<T: Lane>(samples: &[u8], channels: usize, numbers: Numbers, planes: &mut [T]) {
    let stride = planes.len() / channels;
    let count = stride - SLACK;
    if channels == 3 {
        let (red, rest) = planes.split_at_mut(stride);
        let (green, blue) = rest.split_at_mut(stride);
        let texels = red[..count].iter_mut().zip(&mut green[..count]).zip(&mut blue[..count]);
        for (((red, green), blue), sample) in texels.zip(samples.chunks_exact(3 * T::BYTES)) {
            let of = |c: usize| ordered(T::from_le(&sample[c * T::BYTES..(c + 1) * T::BYTES]), numbers);
            let middle = of(1);
            *green = middle;
            *red = of(0).minus(middle).plus(T::HALF);
            *blue = of(2).minus(middle).plus(T::HALF);
        }
        return;
    }
    for channel in 0..channels {
        let plane = &mut planes[channel * stride..channel * stride + count];
        let of =
            |sample: &[u8], c: usize| ordered(T::from_le(&sample[c * T::BYTES..(c + 1) * T::BYTES]), numbers);
        let texels = plane.iter_mut().zip(samples.chunks_exact(channels * T::BYTES));
        match base(channel, channels) {
            None => texels.for_each(|(out, sample)| *out = of(sample, channel)),
            Some(base) => texels.for_each(|(out, sample)| {
                *out = of(sample, channel).minus(of(sample, base)).plus(T::HALF);
            }),
        }
    }
}

/// Inverse of [`split`].
#[inline(always)]
pub(super) fn join<T: Lane>(planes: &mut [T], channels: usize, numbers: Numbers, samples: &mut [u8]) {
    let stride = planes.len() / channels;
    let count = stride - SLACK;
    if channels == 3 {
        let (red, rest) = planes.split_at(stride);
        let (green, blue) = rest.split_at(stride);
        let sources = red.iter().zip(green).zip(blue);
        for (((&r, &g), &b), sample) in sources.zip(samples.chunks_exact_mut(3 * T::BYTES)) {
            for (c, value) in [r.plus(g).minus(T::HALF), g, b.plus(g).minus(T::HALF)].into_iter().enumerate()
            {
                restored(value, numbers).to_le(&mut sample[c * T::BYTES..(c + 1) * T::BYTES]);
            }
        }
        return;
    }
    for channel in 0..channels {
        if let Some(base) = base(channel, channels) {
            let (before, here) = planes.split_at_mut(channel * stride);
            let before = &before[base * stride..base * stride + count];
            for (value, &base) in here[..count].iter_mut().zip(before) {
                *value = value.plus(base).minus(T::HALF);
            }
        }
        let plane = &planes[channel * stride..channel * stride + count];
        for (&value, sample) in plane.iter().zip(samples.chunks_exact_mut(channels * T::BYTES)) {
            restored(value, numbers).to_le(&mut sample[channel * T::BYTES..(channel + 1) * T::BYTES]);
        }
    }
}

/// Planes as they are to little-endian samples, channels innermost.
#[inline(always)]
pub(super) fn interleave<T: Lane>(planes: &[T], channels: usize, samples: &mut [u8]) {
    let stride = planes.len() / channels;
    if channels == 3 {
        let sources = planes.iter().zip(&planes[stride..]).zip(&planes[2 * stride..]);
        for (((&r, &g), &b), sample) in sources.zip(samples.chunks_exact_mut(3 * T::BYTES)) {
            for (c, value) in [r, g, b].into_iter().enumerate() {
                value.to_le(&mut sample[c * T::BYTES..(c + 1) * T::BYTES]);
            }
        }
        return;
    }
    for (channel, plane) in planes.chunks_exact(stride).enumerate() {
        for (&value, sample) in plane.iter().zip(samples.chunks_exact_mut(channels * T::BYTES)) {
            value.to_le(&mut sample[channel * T::BYTES..(channel + 1) * T::BYTES]);
        }
    }
}
