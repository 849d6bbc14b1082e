//! Fitting a model to a field: mean, (2D: Karhunen-Loeve,) pyramid, and at each level the causal neighbourhood of the
//! highest evidence that the level can carry and that gives a stable field.

mod budget;
pub mod car;
mod choice;
mod gain;
mod level;
pub mod neighbourhood;
#[cfg(test)]
mod recursion;
pub(crate) mod second_order;
mod spectrum;
pub(crate) mod stability;

use super::karhunen_loeve;
use super::model::{CarKind, Model, Options};
use super::raster::Field;
use choice::{Choice, Fitted};

use crate::error::{Error, Result};

/// A model of more levels is taken if it has less than this share of the error.
const WORTH_A_LEVEL: f64 = 0.98;

/// Fits a model to a field of any number of channels.
///
/// Where the number of levels is left open, it is the one whose synthesis has the least error of autocovariance. Band
/// means, which a border that does not wrap leaves, are subtracted and dropped, so that the mean of a synthesis is
/// that of the data.
///
/// # Errors
/// When a sample is not finite, or the field or a level is too small for two neighbours.
pub fn fit(field: &Field, options: &Options) -> Result<Model> {
    if let Some(n) = field.samples.iter().position(|value| !value.is_finite()) {
        let texel = n / field.channels;
        return Err(Error::input(format!(
            "texel (row {}, column {}) of the field to model is {}",
            texel / field.width,
            texel % field.width,
            field.samples[n]
        )));
    }
    let (centred, mean) = field.centred();
    let (centred, transform) = match options.kind {
        CarKind::Car3d => (centred, None),
        CarKind::Car2d => {
            let transform = karhunen_loeve::transform(&centred)?;
            (karhunen_loeve::project(&centred, &transform), Some(transform))
        }
    };
    let pyramid = Fitted::new(&centred, options)?;
    let least = options.levels.unwrap_or(1);
    let choices = (least..=pyramid.most_levels()).map(|levels| pyramid.choice(levels, options.gains));
    let Choice { levels, covariance, autocovariance_error } = choices
        .reduce(|best, next| {
            let (best, next) = (best?, next?);
            Ok(if next.autocovariance_error < WORTH_A_LEVEL * best.autocovariance_error {
                next
            } else {
                best
            })
        })
        .ok_or_else(|| Error::internal("a pyramid of no levels"))??;
    let covariance = match &transform {
        None => covariance,
        Some(t) => t.transpose() * covariance * t,
    };
    Ok(Model { kind: options.kind, mean, transform, levels, covariance, autocovariance_error })
}

#[cfg(test)]
pub(super) mod tests {
    #![allow(clippy::unwrap_used)]
    use nalgebra::DMatrix;

    use super::*;
    use crate::kernel::Kernel;
    use crate::method::field::Boundary;
    use crate::method::field::model::tests::single;
    use crate::method::field::{Extent, Gains, Synthesis, pyramid};
    use crate::random::Hash;

    const OPTIONS: Options =
        Options { kind: CarKind::Car3d, levels: None, gains: Gains::None, boundary: Boundary::Periodic };

    /// Noise smoothed twice by a periodic kernel: a random field that has every scale up to some texels.
    fn smooth(height: usize, width: usize, channels: usize) -> Field {
        let hash = Hash::new(21, 0);
        let samples = (0..(height * width * channels) as u32).map(|i| hash.normals(i, 0, 0)[0]).collect();
        let noise = Field::new(height, width, channels, samples).unwrap();
        let coarse = pyramid::reduce(&noise, Boundary::Periodic);
        let mut field = pyramid::expand(&coarse, height, width, Boundary::Periodic).unwrap();
        for texel in field.samples.chunks_exact_mut(channels) {
            for c in 1..channels {
                texel[c] += 0.7 * texel[c - 1];
            }
        }
        field.samples.iter_mut().zip(&noise.samples).for_each(|(value, n)| *value += 0.1 * n);
        field
    }

    #[test]
    fn any_number_of_channels_fits_in_both_kinds_and_one_channel_alike() {
        for channels in 1..=4 {
            let field = smooth(48, 48, channels);
            for boundary in [Boundary::Periodic, Boundary::Mirrored] {
                let [joint, scalar] = [CarKind::Car3d, CarKind::Car2d].map(|kind| {
                    let model = fit(&field, &Options { kind, levels: Some(2), boundary, ..OPTIONS }).unwrap();
                    model.check().unwrap();
                    assert_eq!([model.levels[0].size, model.levels[1].size], [[48, 48], [24, 24]]);
                    assert!(model.levels.iter().all(|level| level.note.is_none()));
                    model.levels
                });
                if channels == 1 {
                    for (a, b) in joint.iter().zip(&scalar) {
                        assert_eq!(
                            (&a.gamma, &a.sigma, a.log_evidence),
                            (&b.gamma, &b.sigma, b.log_evidence)
                        );
                        assert!(a.neighbourhood.len() > 2);
                    }
                }
            }
        }
    }

    #[test]
    fn a_known_field_is_estimated_back() {
        let sites = [[0, 1], [1, 0], [1, -1], [1, 1]];
        // Joint: two channels that feed each other. Scalar: the same sites, one row a channel.
        let joint = single(
            CarKind::Car3d,
            &sites,
            &[
                0.5, 0.1, 0.3, 0.0, 0.1, -0.05, -0.1, 0.0, //
                -0.2, 0.4, 0.1, 0.3, 0.0, 0.1, 0.0, -0.1,
            ],
            &[1.0, 0.4, 0.4, 0.5],
        );
        let scalar = single(CarKind::Car2d, &sites, &[0.5, 0.3, 0.1, -0.1, 0.2, -0.4, 0.1, 0.3], &[1.0, 0.3]);
        for truth in [joint, scalar] {
            let field = synthesised(&truth, 4, 400, 400);
            let options =
                Options { kind: truth.kind, levels: Some(1), boundary: Boundary::Mirrored, ..OPTIONS };
            let found = fit(&field, &options).unwrap();
            let (level, expected) = (&found.levels[0], &truth.levels[0]);
            assert_eq!(level.neighbourhood, expected.neighbourhood);
            let mut gamma = level.gamma.clone();
            let mut sigma = level.sigma.clone();
            if let Some(t) = &found.transform {
                // The channels are independent already: T is a permutation, nearly.
                let order: Vec<usize> = t.row_iter().map(|row| row.transpose().icamax()).collect();
                for (row, &channel) in order.iter().enumerate() {
                    gamma.set_row(channel, &level.gamma.row(row));
                    sigma.set_row(channel, &level.sigma.row(row));
                }
            }
            // Standard errors are below 0.003 for 160000 texels.
            assert!((&gamma - &expected.gamma).amax() < 0.012, "{gamma} against {}", expected.gamma);
            assert!((&sigma - &expected.sigma).amax() < 0.02, "{sigma} against {}", expected.sigma);
        }
    }

    /// Level by level, as it is before the collapse.
    #[test]
    fn every_level_of_a_synthesis_has_the_variance_of_the_data() {
        let field = smooth(128, 128, 3);
        for kind in [CarKind::Car3d, CarKind::Car2d] {
            let model = fit(&field, &Options { kind, levels: Some(3), ..OPTIONS }).unwrap();
            let centred = field.centred().0;
            let data =
                model.transform.as_ref().map_or(centred.clone(), |t| karhunen_loeve::project(&centred, t));
            let bands = pyramid::decompose(&data, 3, Boundary::Periodic).unwrap();
            for (level, band) in model.levels.iter().zip(&bands) {
                let alone = Model {
                    mean: vec![0.0; 3],
                    transform: model.transform.as_ref().map(|_| DMatrix::identity(3, 3)),
                    levels: vec![level.clone()],
                    ..model.clone()
                };
                let found = synthesised(&alone, 1, 512, 512).second_moments().diagonal();
                let ratio = found.component_div(&band.second_moments().diagonal());
                assert!(ratio.iter().all(|r| (r - 1.0).abs() < 0.1), "{kind:?} {:?}: {ratio}", level.size);
            }
        }
    }

    #[test]
    fn gains_make_up_for_what_independent_levels_lose() {
        let field = smooth(128, 128, 2);
        let expected = field.centred().0.second_moments();
        for kind in [CarKind::Car3d, CarKind::Car2d] {
            let [plain, matched] = [Gains::None, Gains::Matched].map(|gains| {
                let model = fit(&field, &Options { kind, levels: Some(3), gains, ..OPTIONS }).unwrap();
                let made = synthesised(&model, 1, 512, 512).centred().0.second_moments();
                let told = &model.covariance;
                assert!((&made - told).norm() < 0.05 * told.norm(), "{kind:?} {gains:?}: {made} for {told}");
                (made[(0, 0)] / expected[(0, 0)], model.autocovariance_error)
            });
            assert!(plain.0 < 0.85 && (matched.0 - 1.0).abs() < 0.08, "{plain:?}, {matched:?}");
            assert!(matched.1 < 0.7 * plain.1, "{plain:?}, {matched:?}");
        }
    }

    #[test]
    fn the_number_of_levels_is_that_of_least_error() {
        let field = smooth(96, 96, 2);
        let options = Options { gains: Gains::Matched, ..OPTIONS };
        let error = |levels| fit(&field, &Options { levels, ..options }).unwrap().autocovariance_error;
        let chosen = fit(&field, &options).unwrap();
        let errors: Vec<f64> = (1..=3).map(|levels| error(Some(levels))).collect();
        let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(errors.iter().all(|&e| e >= chosen.autocovariance_error), "{errors:?}");
        assert_eq!(
            errors.get(chosen.levels.len() - 1).copied().unwrap_or(least),
            chosen.autocovariance_error
        );
    }

    /// A field that grows by 1.3 from row to row, along a diagonal if `shift` is 1.
    fn exploding(shift: usize) -> Field {
        let hash = Hash::new(2, 0);
        let mut samples = vec![0.0; 40 * 40];
        for y in 1..40 {
            for x in 0..40 - shift {
                samples[y * 40 + x] =
                    1.3 * samples[(y - 1) * 40 + x + shift] + hash.normals(y as u32, x as u32, 0)[0];
            }
        }
        Field::new(40, 40, 1, samples).unwrap()
    }

    #[test]
    fn an_unstable_neighbourhood_is_shrunk_and_at_last_damped_and_the_model_says_so() {
        for kind in [CarKind::Car3d, CarKind::Car2d] {
            let options = Options { kind, levels: Some(1), boundary: Boundary::Mirrored, ..OPTIONS };
            // The growth shows to sets with the upper right neighbour only, which begin at four.
            let shrunk = fit(&exploding(1), &options).unwrap();
            // It shows to all sets, and no smaller one is left.
            let damped = fit(&exploding(0), &options).unwrap();
            for (model, is_damped) in [(shrunk, false), (damped, true)] {
                model.check().unwrap();
                let level = &model.levels[0];
                let note = level.note.as_ref().unwrap();
                assert_eq!(level.neighbourhood.len(), 2);
                assert!(!is_damped || level.radius > 0.9, "more than needed: {}", level.radius);
                assert_eq!(note.contains(", 2 neighbours have radius 1."), is_damped, "{note}");
                assert!(note.contains("4 neighbours have radius 1."), "{note}");
                let how = if is_damped { ", Gamma damped" } else { "" };
                assert!(note.ends_with(&format!("2 taken{how}, radius {:.4}", level.radius)), "{note}");
            }
        }
    }

    #[test]
    fn a_constant_field_has_a_model_of_nothing_but_its_mean() {
        let field = Field::new(16, 16, 3, [0.1, 0.2, 0.9].repeat(256)).unwrap();
        for kind in [CarKind::Car3d, CarKind::Car2d] {
            let model = fit(&field, &Options { kind, ..OPTIONS }).unwrap();
            let copy = synthesised(&model, 1, 5, 5);
            assert!(copy.samples.iter().zip(&field.samples).all(|(a, b)| (a - b).abs() < 1e-7));
        }
    }

    #[test]
    fn fields_that_cannot_be_modelled_are_refused() {
        let mut field = smooth(16, 16, 2);
        assert!(fit(&field, &Options { levels: Some(5), ..OPTIONS }).is_err());
        field.samples[100] = f64::NAN;
        let message = fit(&field, &OPTIONS).unwrap_err().to_string();
        assert!(message.contains("row 3, column 2"), "{message}");
        assert!(fit(&smooth(2, 2, 3), &OPTIONS).is_err());
    }

    /// A whole field.
    pub(in crate::method::field) fn synthesised(
        model: &Model,
        seed: u64,
        height: usize,
        width: usize,
    ) -> Field {
        let extent = Extent::Endless;
        let mut synthesis = Synthesis::new(model, seed, height, width, extent, Kernel::fastest()).unwrap();
        let channels = model.channels();
        let mut row = vec![0.0; width * channels];
        let mut samples = Vec::new();
        for _ in 0..height {
            synthesis.next_row(&mut row).unwrap();
            samples
                .extend((0..width * channels).map(|n| f64::from(row[n % channels * width + n / channels])));
        }
        Field::new(height, width, channels, samples).unwrap()
    }
}
