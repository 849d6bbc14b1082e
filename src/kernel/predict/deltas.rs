//! The chain of differences that stock Zarr readers undo: numcodecs' `delta`, which runs over an array as if it had
//! one dimension, between transpositions.
//!
//! With axes y, x, light (l) and channel (c): over [y, x, l, c] (where there are channels), over [c, y, l, x], and
//! over [c, l, x, y]; stored as [c, x, y, l]. Where an axis begins, the difference is to the end of the axis around
//! it. No transposition reverses all axes, even without channels: numcodecs would take that for column order.

use super::channels::interleave;
use super::lane::Lane;
use super::{SLACK, Shape};

/// Differences of [`super::channels`]' planes as they lie, [y, x, l], from the channel before.
#[inline(always)]
fn over_channels<T: Lane>(samples: &[u8], channels: usize, planes: &mut [T]) {
    let stride = planes.len() / channels;
    let last = (channels - 1) * T::BYTES;
    for channel in 0..channels {
        let plane = &mut planes[channel * stride..(channel + 1) * stride - SLACK];
        let texels = samples.chunks_exact(channels * T::BYTES);
        let at = channel * T::BYTES;
        if channel > 0 {
            for (out, texel) in plane.iter_mut().zip(texels) {
                *out = T::from_le(&texel[at..]).minus(T::from_le(&texel[at - T::BYTES..]));
            }
        } else if channels > 1 {
            let before = std::iter::once(T::default())
                .chain(samples.chunks_exact(channels * T::BYTES).map(|texel| T::from_le(&texel[last..])));
            for ((out, texel), before) in plane.iter_mut().zip(texels).zip(before) {
                *out = T::from_le(texel).minus(before);
            }
        } else {
            for (out, texel) in plane.iter_mut().zip(texels) {
                *out = T::from_le(texel);
            }
        }
    }
}

/// Samples to differences, as planes of bytes over all channels, the lowest first.
#[inline(always)]
pub(super) fn forward<T: Lane>(
    samples: &[u8],
    shape: Shape,
    channels: usize,
    planes: &mut [T],
    bytes: &mut [u8],
) {
    let Shape { rows, columns, lights: n } = shape;
    let (stride, row) = (planes.len() / channels, columns * n);
    over_channels(samples, channels, planes);
    // What the first sample of a plane is taken from, after the first and after the second difference.
    let mut before = [T::default(); 2];
    let total = shape.samples() * channels;
    for channel in 0..channels {
        let plane = &mut planes[channel * stride..channel * stride + shape.samples()];
        let end = plane[shape.samples() - 1];
        for y in (0..rows).rev() {
            // The lights of the first column follow the last column of the light before.
            let first: Vec<T> = plane[y * row + row - n..(y + 1) * row].to_vec();
            let corner = if y > 0 { plane[y * row - 1] } else { before[0] };
            let here = &mut plane[y * row..(y + 1) * row];
            for x in (1..columns).rev() {
                let (left, right) = here.split_at_mut(x * n);
                for (value, &left) in right[..n].iter_mut().zip(&left[(x - 1) * n..]) {
                    *value = value.minus(left);
                }
            }
            for (light, value) in here[..n].iter_mut().enumerate() {
                *value = value.minus(if light > 0 { first[light - 1] } else { corner });
            }
        }
        before[0] = end;
        let end = plane[shape.samples() - 1];
        let bottom: Vec<T> = plane[(rows - 1) * row..].to_vec();
        for y in (1..rows).rev() {
            let (above, here) = plane.split_at_mut(y * row);
            for (value, &above) in here[..row].iter_mut().zip(&above[(y - 1) * row..]) {
                *value = value.minus(above);
            }
        }
        for x in 0..columns {
            for light in 0..n {
                let foot = match (x, light) {
                    (0, 0) => before[1],
                    (0, _) => bottom[(columns - 1) * n + light - 1],
                    _ => bottom[(x - 1) * n + light],
                };
                let value = &mut plane[x * n + light];
                *value = value.minus(foot);
            }
        }
        before[1] = end;
        for (place, bytes) in bytes.chunks_exact_mut(total).enumerate() {
            let bytes = &mut bytes[channel * shape.samples()..(channel + 1) * shape.samples()];
            for (number, bytes) in bytes.chunks_exact_mut(n).enumerate() {
                let (x, y) = (number / rows, number % rows);
                for (byte, &value) in bytes.iter_mut().zip(&plane[y * row + x * n..]) {
                    *byte = value.byte(place);
                }
            }
        }
    }
}

/// Inverse of [`forward`].
#[inline(always)]
pub(super) fn inverse<T: Lane>(
    bytes: &[u8],
    shape: Shape,
    channels: usize,
    planes: &mut [T],
    samples: &mut [u8],
) {
    let Shape { rows, columns, lights: n } = shape;
    let (stride, row) = (planes.len() / channels, columns * n);
    let total = shape.samples() * channels;
    let mut before = [T::default(); 2];
    let mut sums = vec![T::default(); row];
    for channel in 0..channels {
        let plane = &mut planes[channel * stride..channel * stride + shape.samples()];
        for (place, bytes) in bytes.chunks_exact(total).enumerate() {
            let bytes = &bytes[channel * shape.samples()..(channel + 1) * shape.samples()];
            for (number, bytes) in bytes.chunks_exact(n).enumerate() {
                let (x, y) = (number / rows, number % rows);
                for (value, &byte) in plane[y * row + x * n..].iter_mut().zip(bytes) {
                    let lower = if place == 0 { T::default() } else { *value };
                    *value = lower.or(T::at(byte, place));
                }
            }
        }
        // Along columns: their sums tell where each begins, the rest is added row to row.
        sums.fill(T::default());
        for here in plane.chunks_exact(row) {
            for (sum, &value) in sums.iter_mut().zip(here) {
                *sum = sum.plus(value);
            }
        }
        let mut start = before[1];
        for light in 0..n {
            for x in 0..columns {
                let value = &mut plane[x * n + light];
                *value = value.plus(start);
                start = start.plus(sums[x * n + light]);
            }
        }
        before[1] = start;
        for y in 1..rows {
            let (above, here) = plane.split_at_mut(y * row);
            for (value, &above) in here[..row].iter_mut().zip(&above[(y - 1) * row..]) {
                *value = value.plus(above);
            }
        }
        // Along rows likewise.
        let mut start = before[0];
        for here in plane.chunks_exact_mut(row) {
            let sums = &mut sums[..n];
            sums.fill(T::default());
            for texel in here.chunks_exact(n) {
                for (sum, &value) in sums.iter_mut().zip(texel) {
                    *sum = sum.plus(value);
                }
            }
            for (value, &sum) in here[..n].iter_mut().zip(&*sums) {
                *value = value.plus(start);
                start = start.plus(sum);
            }
            for x in 1..columns {
                let (left, right) = here.split_at_mut(x * n);
                for (value, &left) in right[..n].iter_mut().zip(&left[(x - 1) * n..]) {
                    *value = value.plus(left);
                }
            }
        }
        before[0] = start;
    }
    if channels > 1 {
        // The last channel is the sum of all differences up to it; each other one follows from the one before.
        let count = shape.samples();
        let (others, last) = planes.split_at_mut((channels - 1) * stride);
        for other in others.chunks_exact(stride) {
            for (value, &other) in last[..count].iter_mut().zip(other) {
                *value = value.plus(other);
            }
        }
        let mut sum = T::default();
        for value in &mut last[..count] {
            sum = sum.plus(*value);
            *value = sum;
        }
        let mut before = T::default();
        let (first, others) = others.split_at_mut(stride);
        for (value, &last) in first[..count].iter_mut().zip(&*last) {
            *value = value.plus(before);
            before = last;
        }
        let mut below = first;
        for here in others.chunks_exact_mut(stride) {
            for (value, &below) in here[..count].iter_mut().zip(&*below) {
                *value = value.plus(below);
            }
            below = here;
        }
    }
    interleave(planes, channels, samples);
}
