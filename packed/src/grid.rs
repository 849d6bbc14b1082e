//! The bit planes of one image of whole numbers, coded by what is known around each number.
//!
//! An image has layers (the channels of a BRDF's spectrum, one of a cosine spectrum), rows and columns. Going down a
//! plane, a number is either still 0 and may become 1, or has one more bit. Rows, and whole images, that are still 0
//! say with one bit that they stay so.

use crate::range_coder::{Coder, Probability};

/// Zeros around a layer, so that every number has neighbours.
const EDGE: usize = 2;

/// Classes of sums over what lies around a number in its image.
const AROUND: usize = 16;

/// Classes of sums over what lies at its place in images before.
const BEFORE: usize = 12;

/// Classes of frequencies.
const FREQUENCIES: usize = SIDE * SIDE;

/// Classes of the frequencies of rows, and of columns.
const SIDE: usize = 6;

/// The kinds of images, each with probabilities of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A spectrum over directions.
    Brdf,
    /// A cosine spectrum.
    Image,
}

/// Size of an image, and which frequencies its rows and columns have.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    pub(crate) kind: Kind,
    pub(crate) layers: usize,
    /// Frequency of each row.
    pub(crate) rows: Vec<u16>,
    /// Frequency of each column.
    pub(crate) columns: Vec<u16>,
}

impl Shape {
    pub(crate) fn values(&self) -> usize {
        self.layers * self.rows.len() * self.columns.len()
    }

    fn stride(&self) -> usize {
        self.columns.len() + 2 * EDGE
    }

    fn layer(&self) -> usize {
        (self.rows.len() + 2 * EDGE) * self.stride()
    }

    /// Where the first number of a row lies.
    fn row_start(&self, layer: usize, row: usize) -> usize {
        layer * self.layer() + (row + EDGE) * self.stride() + EDGE
    }

    /// The class of the frequency of a row and a column.
    fn frequency(&self, row: usize, column: usize) -> usize {
        let class = |frequency: u16| {
            let class = match self.kind {
                Kind::Brdf => usize::from(frequency) / 2,
                Kind::Image => (frequency + 1).ilog2() as usize,
            };
            class.min(SIDE - 1)
        };
        SIDE * class(self.rows[row]) + class(self.columns[column])
    }
}

/// What is known of the numbers of one image.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    /// Magnitudes to the plane that was coded last, with zeros around each layer.
    magnitudes: Vec<u32>,
    negative: Vec<bool>,
    /// Whether a row has a number that is not 0.
    begun: Vec<bool>,
}

impl Grid {
    pub(crate) fn new(shape: &Shape) -> Self {
        let count = shape.layers * shape.layer();
        Self {
            magnitudes: vec![0; count],
            negative: vec![false; count],
            begun: vec![false; shape.layers * shape.rows.len()],
        }
    }

    /// The numbers in their order: magnitude and whether they are negative.
    pub(crate) fn numbers<'a>(&'a self, shape: &'a Shape) -> impl Iterator<Item = (u32, bool)> + 'a {
        let starts =
            (0..shape.layers).flat_map(move |layer| (0..shape.rows.len()).map(move |row| (layer, row)));
        starts.flat_map(move |(layer, row)| {
            let start = shape.row_start(layer, row);
            (start..start + shape.columns.len()).map(|at| (self.magnitudes[at], self.negative[at]))
        })
    }
}

/// The probabilities of everything that is coded of images of a kind.
#[derive(Clone)]
pub(crate) struct Contexts {
    /// Whether a number becomes 1: by what lies around it and in images before, and by both and its frequency.
    by_sums: Vec<Probability>,
    by_frequency: Vec<Probability>,
    /// One more bit of a number, by the number and by what lies around it.
    more: [[Probability; 4]; 3],
    /// Whether a row begins, by its neighbours and by the image before.
    row: [[Probability; 8]; 2],
    /// Whether an image begins, by whether there is one before.
    image: [Probability; 2],
}

impl Contexts {
    pub(crate) fn new() -> Self {
        Self {
            by_sums: vec![Probability::default(); AROUND * BEFORE * 2],
            by_frequency: vec![Probability::default(); AROUND * FREQUENCIES * 2],
            more: Default::default(),
            row: Default::default(),
            image: Default::default(),
        }
    }
}

/// A class of a sum: each to 3, then two an octave.
fn class(sum: u32, most: usize) -> usize {
    let class = match sum {
        0..4 => sum as usize,
        _ => {
            let octave = sum.ilog2();
            2 * octave as usize + (sum >> (octave - 1) & 1) as usize
        }
    };
    class.min(most - 1)
}

/// Images of the same shape that were coded before, the nearest first, to the plane `shift` planes below the one that is
/// coded.
#[derive(Clone, Copy)]
pub(crate) struct Before<'a> {
    pub(crate) grids: [Option<&'a Grid>; 3],
    pub(crate) shift: u32,
}

/// The numbers that an encoder codes to plane `low`; none in a decoder.
#[derive(Clone, Copy)]
pub(crate) struct Wanted<'a> {
    pub(crate) numbers: &'a [i32],
    pub(crate) low: u32,
}

impl Wanted<'_> {
    fn magnitude(&self, number: usize) -> u32 {
        self.numbers.get(number).map_or(0, |value| value.unsigned_abs() >> self.low)
    }

    fn is_negative(&self, number: usize) -> bool {
        self.numbers.get(number).is_some_and(|&value| value < 0)
    }

    fn any(&self, mut numbers: core::ops::Range<usize>) -> bool {
        !self.numbers.is_empty() && numbers.any(|number| self.magnitude(number) > 0)
    }
}

/// Codes one plane of an image.
pub(crate) fn code_plane(
    coder: &mut impl Coder,
    contexts: &mut Contexts,
    shape: &Shape,
    grid: &mut Grid,
    before: Before<'_>,
    wanted: Wanted<'_>,
) {
    let (rows, columns) = (shape.rows.len(), shape.columns.len());
    if !grid.begun.contains(&true) {
        let class = usize::from(before.grids[0].is_some());
        if !coder.bit(&mut contexts.image[class], wanted.any(0..shape.values())) {
            return;
        }
    }
    for layer in 0..shape.layers {
        for row in 0..rows {
            let flag = layer * rows + row;
            let first = flag * columns;
            if !grid.begun[flag] {
                let neighbours = [
                    row > 0 && grid.begun[flag - 1],
                    row + 1 < rows && grid.begun[flag + 1],
                    before.grids[0].is_some_and(|grid| grid.begun[flag]),
                ];
                let class = neighbours.iter().fold(0, |class, &begun| 2 * class + usize::from(begun));
                let any = wanted.any(first..first + columns);
                let context = &mut contexts.row[usize::from(layer > 0)][class];
                grid.begun[flag] = coder.bit(context, any);
                if !grid.begun[flag] {
                    continue;
                }
            }
            let start = shape.row_start(layer, row);
            for column in 0..columns {
                let at = start + column;
                let sums = around(shape, grid, before, layer, at);
                let number = first + column;
                let bit = wanted.magnitude(number) & 1 == 1;
                let known = grid.magnitudes[at];
                if known == 0 {
                    let chroma = usize::from(layer > 0);
                    let [own, others] = [class(sums[0], AROUND), class(sums[1], BEFORE)];
                    let frequency = shape.frequency(row, column);
                    let by_sums = &mut contexts.by_sums[(own * BEFORE + others) * 2 + chroma];
                    let both = class(sums[0] + sums[1], AROUND);
                    let by_frequency =
                        &mut contexts.by_frequency[(both * FREQUENCIES + frequency) * 2 + chroma];
                    if coder.bit_of_two([by_sums, by_frequency], bit) {
                        grid.negative[at] = coder.even(wanted.is_negative(number));
                        grid.magnitudes[at] = 1;
                    }
                } else {
                    let size = known.min(3) as usize - 1;
                    let context = &mut contexts.more[size][class(sums[0] / 8, 4)];
                    grid.magnitudes[at] = 2 * known + u32::from(coder.bit(context, bit));
                }
            }
        }
    }
}

/// Weighted sums of magnitudes in units of this plane's step: around a number; and at and around its place in images
/// before, with the layer before, twice as large.
#[inline]
fn around(shape: &Shape, grid: &Grid, before: Before<'_>, layer: usize, at: usize) -> [u32; 2] {
    let stride = shape.stride();
    let m = &grid.magnitudes;
    // Numbers behind this one are known to the plane before only.
    let now = |at: usize| m[at].min(1 << 16);
    let then = |at: usize| 2 * now(at) + u32::from(m[at] > 0);
    let own = 4 * (now(at - 1) + now(at - stride))
        + 2 * (now(at - stride - 1) + now(at - stride + 1))
        + 3 * (then(at + 1) + then(at + stride))
        + now(at - 2)
        + now(at - 2 * stride)
        + then(at + 2)
        + then(at + 2 * stride)
        + then(at + stride - 1)
        + then(at + stride + 1);
    let of_grid = |grid: &Grid, weights: [u32; 2]| {
        let m = |at: usize| (grid.magnitudes[at] << 1 >> before.shift).min(1 << 16);
        weights[0] * m(at) + weights[1] * (m(at - 1) + m(at + 1) + m(at - stride) + m(at + stride))
    };
    let [first, second, third] = before.grids;
    let mut sum = first.map_or(0, |grid| of_grid(grid, [4, 1]));
    sum += second.map_or(0, |grid| of_grid(grid, [2, 1]));
    sum += third.map_or(0, |grid| of_grid(grid, [2, 0]));
    if layer > 0 {
        sum += 4 * now(at - shape.layer());
    }
    [own, sum]
}
