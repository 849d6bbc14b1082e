//! Chunks of directions: a kind, then four angles for every image.

use std::f64::consts::FRAC_PI_2;

use super::chunks::{Chunk, Chunks};
use crate::ubo2003::Angles;
use crate::utia::{Pair, below_the_surface, light_and_view};
use crate::{Direction, Error, Result};

const DIRECTIONS: u64 = 16;

/// Kinds that can be read, the best first: ideal angles are those of a grid, real ones only almost.
const KINDS: [(u64, &str, bool); 4] = [
    (3, "ideal spherical angles", false),
    (4, "real spherical angles", false),
    (5, "ideal half-difference angles", true),
    (6, "real half-difference angles", true),
];

/// Bytes of the kind, and of the angles of one image.
const HEAD_BYTES: usize = 8;
const IMAGE_BYTES: usize = 32;

pub(super) struct Directions {
    pub(super) pairs: Vec<Pair>,
    pub(super) assumptions: Vec<String>,
}

/// The directions of the best kind that the file has; none if it has device angles at most.
pub(super) fn read(chunks: &Chunks<'_>, images: u64) -> Result<Option<Directions>> {
    let mut kinds: Vec<(u64, &Chunk<'_>)> = Vec::new();
    for chunk in chunks.all(DIRECTIONS) {
        let size =
            usize::try_from(images).ok().and_then(|n| n.checked_mul(IMAGE_BYTES)?.checked_add(HEAD_BYTES));
        let Some(kind) = chunk.numbers().next().filter(|_| size == Some(chunk.data.len())) else {
            return Err(chunk.wrong_size("a kind of directions, and four angles for every image"));
        };
        if !(1..=6).contains(&kind) {
            return Err(Error::malformed(format!("directions of kind {kind}"), "1 to 6").at(chunk.at));
        }
        if kinds.iter().any(|&(other, _)| other == kind) {
            return Err(Error::malformed(format!("directions of kind {kind} twice"), "once").at(chunk.at));
        }
        kinds.push((kind, chunk));
    }
    for (kind, name, half_difference) in KINDS {
        if let Some((_, chunk)) = kinds.iter().find(|&&(other, _)| other == kind) {
            return parse(chunk, name, half_difference).map(Some);
        }
    }
    Ok(None)
}

fn parse(chunk: &Chunk<'_>, name: &str, half_difference: bool) -> Result<Directions> {
    let angles: Vec<f64> = chunk.numbers().skip(1).map(f64::from_bits).collect();
    let (images, _) = angles.as_chunks::<4>();
    let largest_theta = images.iter().flat_map(|&[a, _, b, _]| [a, b]).fold(0.0, f64::max);
    let in_degrees = largest_theta > FRAC_PI_2 + 1e-6;
    let to_degrees = |angle: f64| if in_degrees { angle } else { angle.to_degrees() };
    let pairs: Result<Vec<Pair>> = images
        .iter()
        .enumerate()
        .map(|(image, four)| {
            let [first_theta, first_phi, second_theta, second_phi] = four.map(to_degrees);
            let pair = if half_difference {
                light_and_view(
                    Direction::from_degrees(first_theta, first_phi),
                    Direction::from_degrees(second_theta, second_phi),
                )
            } else {
                Angles::new(first_theta, first_phi)
                    .zip(Angles::new(second_theta, second_phi))
                    .map(|(light, view)| Pair { view, light })
            };
            pair.ok_or_else(|| {
                Error::malformed(below_the_surface(image), "theta from 0 to 90 degrees").at(chunk.at)
            })
        })
        .collect();
    let order = if half_difference {
        "of the half vector, then of the difference vector"
    } else {
        "of the light, then of the view"
    };
    let unit = if in_degrees { "degrees" } else { "radians" };
    Ok(Directions {
        pairs: pairs?,
        assumptions: vec![format!(
            "Of the directions the {name} are taken, as theta and phi {order}, in {unit} (by their size): the format's document says neither."
        )],
    })
}
