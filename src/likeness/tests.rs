//! Agreement with a judge of the same definitions written in Python.
#![allow(clippy::unwrap_used)]

use super::{Judge, Lightness};
use crate::shape::{Size, Window};

/// What the judge in Python says of pictures of one kind and size.
struct Known {
    is_weave: bool,
    side: usize,
    /// The five measures and the excess peak of: a held-out crop, a repeated tile, coarse steps of grey, a smoothed
    /// crop, and two pictures together.
    judged: [([f64; 5], f64); 5],
}

// Made by a judge in Python (numpy 2.4.6, pyrtools 1.1.1) on the very same pictures, which are made of whole numbers.
const KNOWN: [Known; 4] = [
    Known {
        is_weave: false,
        side: 128,
        judged: [
            ([0.923805, 1.031747, 1.011655, 1.400328, 0.835603], -0.004506),
            ([1.957592, 2.321149, 2.438856, 1.939136, 1.268240], 0.624264),
            ([12.206459, 1.384933, 1.344887, 1.615613, 1.343773], -0.040324),
            ([2.290751, 1.989512, 1.677434, 2.284322, 0.929148], 0.025497),
            ([1.607278, 1.510630, 1.344545, 1.842325, 0.882375], 0.010496),
        ],
    },
    Known {
        is_weave: false,
        side: 96,
        judged: [
            ([0.973862, 0.922444, 0.917336, 0.898187, 1.181925], 0.007703),
            ([1.531152, 1.708209, 1.811385, 1.163581, 1.157168], 0.604028),
            ([9.027085, 1.139576, 1.105335, 1.167104, 1.629399], -0.015193),
            ([1.779128, 1.804634, 1.330601, 1.672569, 1.216459], 0.041948),
            ([1.376495, 1.363539, 1.123968, 1.285378, 1.199192], 0.024825),
        ],
    },
    Known {
        is_weave: true,
        side: 128,
        judged: [
            ([1.019340, 1.108436, 1.240670, 1.379653, 0.912827], -0.005336),
            ([2.348710, 2.303327, 2.821380, 1.482383, 1.602670], 0.650705),
            ([15.802422, 1.121125, 1.266427, 1.398650, 1.013242], -0.007074),
            ([3.932413, 2.059349, 2.397206, 2.302158, 2.161269], 0.013863),
            ([2.475877, 1.583892, 1.818938, 1.840905, 1.537048], 0.004264),
        ],
    },
    Known {
        is_weave: true,
        side: 96,
        judged: [
            ([0.953164, 1.044672, 1.048736, 0.969754, 1.096989], -0.006609),
            ([1.721074, 1.942180, 2.139403, 1.080981, 1.386246], 0.551268),
            ([11.083661, 1.044162, 1.064670, 0.981044, 1.206889], -0.008134),
            ([2.841883, 1.689125, 1.829811, 1.760324, 2.098874], 0.006043),
            ([1.897524, 1.366898, 1.439274, 1.365039, 1.597932], -0.000283),
        ],
    },
];

/// Eight random bits of a place.
fn noise(y: i64, x: i64, seed: u32) -> i64 {
    use crate::method::coherent::hash::mix;
    i64::from(mix((y as u32).wrapping_mul(0x9E37_79B1) ^ mix((x as u32).wrapping_add(seed))) >> 24)
}

/// Their sum over a rectangle of so many texels to each side.
fn sum_around(y: i64, x: i64, [rows, columns]: [i64; 2], seed: u32) -> i64 {
    let row = |i: i64| (-columns..=columns).map(|j| noise(y + i, x + j, seed)).sum::<i64>();
    (-rows..=rows).map(row).sum()
}

/// A square of an endless picture: noise of three scales, or squares of threads that lie across each other.
fn square(is_weave: bool, top: i64, left: i64, side: usize) -> Lightness {
    let value = |n: usize| {
        let (y, x) = (top + (n / side) as i64, left + (n % side) as i64);
        if is_weave {
            let thread = if ((y >> 3) + (x >> 3)) & 1 == 0 {
                sum_around(y, x, [0, 5], 4)
            } else {
                sum_around(y, x, [5, 0], 5)
            };
            thread as f64 / 30.0
        } else {
            let middle = sum_around(y, x, [2, 2], 2) as f64 / 5.0;
            let wide = sum_around(y, x, [6, 6], 3) as f64 / 13.0;
            (noise(y, x, 1) as f64 + middle + wide) / 40.0
        }
    };
    Lightness::new(Size::new(side, side), (0..side * side).map(value).collect())
}

#[test]
fn the_judge_agrees_with_one_in_python_to_a_thousandth() {
    for Known { is_weave, side, judged } in KNOWN {
        let size = Size::new(side, side);
        let reals = [(0, 0), (0, 300), (300, 0), (300, 300)].map(|(y, x)| square(is_weave, y, x, side));
        let judge = Judge::new(&reals).unwrap();
        let held_out = square(is_weave, 600, 100, side);
        let tile = held_out.part(Window { y: 0, x: 0, size: Size::new(40, 40) }).repeated(0, 0, size);
        let steps = held_out.values.iter().map(|value| (value / 8.0).round_ties_even() * 8.0).collect();
        let wide = square(is_weave, 600, 99, side + 2);
        let smooth = wide.values.chunks_exact(side + 2).take(side);
        let smooth = smooth.flat_map(|row| row.windows(3).map(|v| (v[0] + v[1] + v[2]) / 3.0)).collect();
        let smooth = Lightness::new(size, smooth);
        let pictures = [
            vec![held_out.clone()],
            vec![tile],
            vec![Lightness::new(size, steps)],
            vec![smooth.clone()],
            vec![held_out, smooth],
        ];
        for (number, (pictures, (measures, excess_peak))) in pictures.iter().zip(judged).enumerate() {
            let found = judge.judge(pictures).unwrap();
            for (found, expected) in found.measures.iter().zip(measures) {
                assert!((found - expected).abs() < 1e-3, "{side}, picture {number}: {found}, not {expected}");
            }
            assert_eq!(found.j, found.measures.into_iter().reduce(f64::max).unwrap());
            assert!((found.excess_peak - excess_peak).abs() < 1e-3, "{side}, picture {number}: {found:?}");
        }
    }
}

#[test]
fn what_cannot_be_judged_is_refused() {
    let crop = |seed: i64| square(false, 0, 200 * seed, 64);
    let judge = Judge::new(&[crop(0), crop(1)]).unwrap();
    let flat = Lightness::new(Size::new(64, 64), vec![30.0; 64 * 64]);
    let verdict = judge.judge(std::slice::from_ref(&flat)).unwrap();
    assert!(verdict.measures.iter().all(|measure| measure.is_finite()) && verdict.j > 3.0, "{verdict:?}");
    for reals in [
        vec![],
        vec![crop(0)],
        vec![crop(0), crop(0)],
        vec![crop(0), flat.clone()],
        vec![crop(0), square(false, 0, 0, 66)],
        vec![square(false, 0, 0, 60), square(false, 0, 100, 60)],
        vec![crop(0), Lightness::new(flat.size, vec![f64::NAN; 64 * 64])],
    ] {
        assert!(Judge::new(&reals).is_err());
    }
    assert!(judge.judge(&[]).is_err() && judge.judge(&[square(false, 0, 0, 60)]).is_err());
}
