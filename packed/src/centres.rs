//! Centres for a palette: k-means of the texels in the space of the components.

use crate::model::Model;

/// Components that distances are taken in: the strongest.
const MOST_DIMS: usize = 32;

/// Texels that centres are found from, evenly spread.
const MOST_SAMPLED: usize = 4096;

/// Rounds of assigning and averaging.
const ROUNDS: usize = 8;

/// The nearest of at most `count` centres of each texel.
pub(crate) fn nearest_of(model: &Model, count: usize) -> Vec<u16> {
    let dims = model.components.len().min(MOST_DIMS);
    let texel = |texel: usize| -> Vec<f32> {
        model.components[..dims].iter().map(|part| part.coefficients[texel] as f32).collect()
    };
    let vectors: Vec<Vec<f32>> = (0..model.texels()).map(texel).collect();
    let step = vectors.len().div_ceil(MOST_SAMPLED).max(1);
    let sample: Vec<&Vec<f32>> = vectors.iter().step_by(step).collect();
    let mut centres = first(&sample, count);
    for _ in 0..ROUNDS {
        let mut sums = vec![(vec![0.0f64; dims], 0u32); centres.len()];
        for vector in &sample {
            let (sum, count) = &mut sums[nearest(&centres, vector)];
            sum.iter_mut().zip(*vector).for_each(|(sum, &value)| *sum += f64::from(value));
            *count += 1;
        }
        for (centre, (sum, count)) in centres.iter_mut().zip(sums) {
            if count > 0 {
                *centre = sum.iter().map(|sum| (sum / f64::from(count)) as f32).collect();
            }
        }
    }
    // In the order of the strongest component: numbers beside each other are alike.
    centres.sort_by(|a, b| a.first().unwrap_or(&0.0).total_cmp(b.first().unwrap_or(&0.0)));
    vectors.iter().map(|vector| nearest(&centres, vector) as u16).collect()
}

/// First centres, each drawn with a chance in proportion to the squared distance from those before (k-means++). None is
/// drawn twice.
fn first(sample: &[&Vec<f32>], count: usize) -> Vec<Vec<f32>> {
    let mut state = 1u64;
    let mut distances = vec![f32::INFINITY; sample.len()];
    let mut centres: Vec<Vec<f32>> = sample.first().map(|&vector| vector.clone()).into_iter().collect();
    while centres.len() < count {
        let Some(last) = centres.last() else { break };
        for (distance, vector) in distances.iter_mut().zip(sample) {
            *distance = distance.min(squared(last, vector));
        }
        let all: f64 = distances.iter().map(|&distance| f64::from(distance)).sum();
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mut left = all * ((state >> 11) as f64 / (1u64 << 53) as f64);
        let drawn = distances.iter().position(|&distance| {
            left -= f64::from(distance);
            distance > 0.0 && left <= 0.0
        });
        // There are no more different texels.
        let Some(drawn) = drawn else { break };
        centres.push(sample[drawn].clone());
    }
    centres
}

fn nearest(centres: &[Vec<f32>], vector: &[f32]) -> usize {
    let mut best = (f32::INFINITY, 0);
    for (number, centre) in centres.iter().enumerate() {
        let distance = squared(centre, vector);
        if distance < best.0 {
            best = (distance, number);
        }
    }
    best.1
}

/// Squared distance, summed in one order.
fn squared(a: &[f32], b: &[f32]) -> f32 {
    let ((a, rest_a), (b, rest_b)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0f32; 8];
    for (a, b) in a.iter().zip(b) {
        sums = core::array::from_fn(|n| sums[n] + (a[n] - b[n]) * (a[n] - b[n]));
    }
    let rest: f32 = rest_a.iter().zip(rest_b).map(|(a, b)| (a - b) * (a - b)).sum();
    sums.iter().sum::<f32>() + rest
}
