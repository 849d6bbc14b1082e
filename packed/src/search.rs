//! The step for a wanted size or quality.

use crate::centres::nearest_of;
use crate::encode::{Packed, Prepared};
use crate::error::{Error, Result};
use crate::model::Model;
use crate::palette::Palette;
use crate::quantise::MOST_PLANES;

/// What a packed model is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// As good as goes into so many bytes.
    Bytes(usize),
    /// As small as goes with this peak signal-to-noise ratio, dB.
    Decibels(f64),
}

/// Binary logarithms of the largest number to the first step that is tried, and of one step to the next.
const FIRST: f64 = 5.0;
const NEXT: f64 = 2.0;

/// Halvings of the interval between two such steps.
const HALVINGS: usize = 9;

/// What a finer step must gain, dB, to be tried.
const GAIN: f64 = 0.002;

/// Of the wanted bytes, the part that may be left unused.
const NEAR: f64 = 0.004;

/// Bytes below which a file has few sections: each costs a dozen.
const SMALL: usize = 1 << 14;

/// Numbers of centres of the palettes that are tried.
const CENTRES: [usize; 3] = [64, 256, 1024];

/// Texels that a centre has at least, on average.
const TEXELS_OF_A_CENTRE: usize = 8;

/// Packs a model, by cosines or by a palette, whichever is better at the target. `residual` is the squared error of the
/// model itself, over all texels and directions, if it is known; it is only needed to say how good the result is.
///
/// # Errors
/// A target that cannot be met; a model whose parts do not fit together, or that the format has no room for.
pub fn pack(model: &Model, residual: Option<f64>, target: Target) -> Result<Packed> {
    let mut best = search(&Prepared::new(model, residual, None)?, target);
    for count in CENTRES {
        if model.texels() < TEXELS_OF_A_CENTRE * count {
            break;
        }
        let wanted = match (target, &best) {
            (Target::Decibels(decibels), _) => decibels,
            (Target::Bytes(_), Ok(best)) => best.decibels,
            (Target::Bytes(_), Err(_)) => break,
        };
        let palette = Palette::new(&nearest_of(model, count));
        let prepared = Prepared::new(model, residual, Some(palette))?;
        if prepared.most_decibels() <= wanted {
            continue;
        }
        if let (Ok(found), Ok(before)) = (search(&prepared, target), &best) {
            let is_better = match target {
                Target::Bytes(_) => found.decibels > before.decibels,
                Target::Decibels(_) => found.bytes.len() < before.bytes.len(),
            };
            if is_better {
                best = Ok(found);
            }
        }
    }
    best
}

/// The step of one way.
fn search(prepared: &Prepared<'_>, target: Target) -> Result<Packed> {
    let largest = libm::log2(prepared.largest());
    if !largest.is_finite() {
        return Err(Error::new("a model of nothing but zeros", "a measurement"));
    }
    let sections = match target {
        Target::Bytes(bytes) if bytes < SMALL => 4,
        _ => 6,
    };
    let encode = |depth: f64| prepared.encode(libm::exp2(largest - depth) as f32, sections);
    let fits = |packed: &Packed| match target {
        Target::Bytes(bytes) => packed.bytes.len() <= bytes,
        Target::Decibels(decibels) => packed.decibels >= decibels,
    };
    // A file that fits is sought downwards from the finer side by bytes, and upwards from the coarser one by quality.
    let by_bytes = matches!(target, Target::Bytes(_));
    let (mut depth, mut best) = (0.0, None);
    let mut last = encode(depth)?;
    if by_bytes && !fits(&last) {
        return Err(out_of_reach(target, &last));
    }
    while fits(&last) == by_bytes {
        let next_depth = if depth == 0.0 { FIRST } else { depth + NEXT };
        let next = match next_depth < f64::from(MOST_PLANES) {
            true => Some(encode(next_depth)?),
            false => None,
        };
        let next = next.filter(|next| {
            !prepared.is_complete(&last) || next.decibels > last.decibels + GAIN || depth == 0.0
        });
        if by_bytes {
            best = Some(last);
        }
        last = match (next, best) {
            (Some(next), kept) => {
                best = kept;
                next
            }
            // There is nothing more to say.
            (None, Some(best)) => return Ok(best),
            (None, None) => return Err(out_of_reach(target, &encode(depth)?)),
        };
        depth = next_depth;
    }
    if !by_bytes {
        best = Some(last);
    }
    let (mut coarse, mut fine) = ((depth - if depth == FIRST { FIRST } else { NEXT }).max(0.0), depth);
    for _ in 0..HALVINGS {
        let middle = (coarse + fine) / 2.0;
        let packed = encode(middle)?;
        let fitting = fits(&packed);
        let near = match target {
            Target::Bytes(bytes) => fitting && packed.bytes.len() as f64 > (1.0 - NEAR) * bytes as f64,
            Target::Decibels(decibels) => fitting && packed.decibels < decibels + 0.01,
        };
        if fitting {
            best = Some(packed);
        }
        if near {
            break;
        }
        if fitting == by_bytes { coarse = middle } else { fine = middle }
    }
    best.ok_or_else(|| Error::new("no step that fits", "one"))
}

fn out_of_reach(target: Target, packed: &Packed) -> Error {
    match target {
        Target::Bytes(bytes) => Error::new(
            format!("a target of {bytes} bytes"),
            format!("at least {}, which sizes, directions and texts take", packed.bytes.len()),
        ),
        Target::Decibels(decibels) => Error::new(
            format!("a target of {decibels} dB"),
            format!("at most {:.2} dB, which these components reach", packed.decibels),
        ),
    }
}
