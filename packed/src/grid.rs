//! The bit planes of one image of whole numbers, coded by what is known around each number.
//!
//! An image has layers (the channels of a BRDF's spectrum, one of a cosine spectrum), rows and columns. Going down a
//! plane, a number is either still 0 and may become 1, or has one more bit. Rows, and whole images, that are still 0
//! say with one bit that they stay so.

use crate::quantise::value;
use crate::range_coder::{Coder, Probability};

/// Zeros around a layer, so that every number has neighbours.
const EDGE: usize = 2;

/// Classes of sums over what lies around a number in its image.
const AROUND: usize = 16;

/// Classes of sums over what lies at its place in images before.
const BEFORE: usize = 12;

/// The largest magnitude that sums have room for.
const MOST_NOW: u32 = 1 << 16;

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

/// Size of an image, and how high the frequencies of its rows and columns are.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    layers: usize,
    /// Class of the frequency of each row.
    rows: Vec<u8>,
    /// Class of the frequency of each column.
    columns: Vec<u8>,
    /// Whether magnitudes may be larger than sums have room for.
    has_large: bool,
}

impl Shape {
    /// An image with these frequencies of its rows and columns: degrees of polynomials, or numbers of half waves; of
    /// so many planes.
    pub(crate) fn new(kind: Kind, layers: usize, rows: &[usize], columns: &[usize], planes: u32) -> Self {
        let class = |&frequency: &usize| {
            let class = match kind {
                Kind::Brdf => frequency / 2,
                Kind::Image => (frequency + 1).ilog2() as usize,
            };
            class.min(SIDE - 1) as u8
        };
        let [rows, columns] = [rows, columns].map(|list| list.iter().map(class).collect());
        // The twofold of a magnitude is summed, too.
        Self { layers, rows, columns, has_large: planes >= MOST_NOW.ilog2() }
    }

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

    /// What the numbers stand for, in their order, in units of `step`.
    pub(crate) fn values(&self, shape: &Shape, step: f64) -> Vec<f64> {
        let columns = shape.columns.len();
        let mut values = vec![0.0; shape.values()];
        for (number, (to, &begun)) in values.chunks_exact_mut(columns).zip(&self.begun).enumerate() {
            if begun {
                let start = shape.row_start(number / shape.rows.len(), number % shape.rows.len());
                let numbers = self.magnitudes[start..].iter().zip(&self.negative[start..]);
                to.iter_mut()
                    .zip(numbers)
                    .for_each(|(to, (&magnitude, &negative))| *to = value(magnitude, negative, step));
            }
        }
        values
    }
}

/// The probabilities of everything that is coded of images of a kind.
#[derive(Clone)]
pub(crate) struct Contexts {
    /// Whether a number of the first layer, or of another one, becomes 1: by what lies around it and in images before,
    /// [around][before], and by its frequency and both, [row][column][both].
    by_sums: [Vec<Probability>; 2],
    by_frequency: [Vec<Probability>; 2],
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
            by_sums: [(); 2].map(|()| vec![Probability::default(); AROUND * BEFORE]),
            by_frequency: [(); 2].map(|()| vec![Probability::default(); SIDE * SIDE * AROUND]),
            more: Default::default(),
            row: Default::default(),
            image: Default::default(),
        }
    }
}

/// Sums from which on the class is the last of [`AROUND`].
const LAST: usize = 192;

/// The class of each sum up to [`LAST`]: each to 3, then two an octave.
const CLASSES: [u8; LAST + 1] = {
    let mut classes = [0; LAST + 1];
    let mut sum = 0;
    while sum <= LAST {
        classes[sum] = match sum {
            0..4 => sum as u8,
            _ => {
                let octave = sum.ilog2();
                2 * octave as u8 + (sum >> (octave - 1) & 1) as u8
            }
        };
        sum += 1;
    }
    classes
};

/// The class of a sum, of so many classes; at most [`AROUND`].
#[inline]
fn class(sum: u32, most: usize) -> usize {
    usize::from(CLASSES[(sum as usize).min(LAST)]).min(most - 1)
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
    let mut sums = Sums::new(columns);
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
            match shape.has_large {
                true => sums.of_row::<true>(shape, grid, before, layer, start),
                false => sums.of_row::<false>(shape, grid, before, layer, start),
            }
            let not_first = usize::from(layer > 0);
            let by_sums = &mut contexts.by_sums[not_first];
            let by_frequency =
                &mut contexts.by_frequency[not_first][usize::from(shape.rows[row]) * SIDE * AROUND..];
            let numbers = grid.magnitudes[start..][..columns].iter_mut().zip(&mut grid.negative[start..]);
            let known = sums.own.iter().zip(&sums.others).zip(&shape.columns);
            // What this row itself changes: the two numbers to the left.
            let (mut left, mut left_2) = (0, 0);
            for (column, ((magnitude, negative), ((own, &others), &frequency))) in
                numbers.zip(known).enumerate()
            {
                let own = own + 4 * now::<true>(left) + now::<true>(left_2);
                let number = first + column;
                let bit = wanted.magnitude(number) & 1 == 1;
                if *magnitude == 0 {
                    let by_sums = &mut by_sums[class(own, AROUND) * BEFORE + class(others, BEFORE)];
                    let by_frequency =
                        &mut by_frequency[usize::from(frequency) * AROUND + class(own + others, AROUND)];
                    if coder.bit_of_two([by_sums, by_frequency], bit) {
                        *negative = coder.even(wanted.is_negative(number));
                        *magnitude = 1;
                    }
                } else {
                    let size = (*magnitude).min(3) as usize - 1;
                    let context = &mut contexts.more[size][class(own / 8, 4)];
                    *magnitude = 2 * *magnitude + u32::from(coder.bit(context, bit));
                }
                (left_2, left) = (left, *magnitude);
            }
        }
    }
}

/// Weighted sums of magnitudes around the numbers of a row, in units of this plane's step.
struct Sums {
    /// Around each number, but for the two to its left, which the row itself changes.
    own: Vec<u32>,
    /// At and around its place in images before, with the layer before, twice as large.
    others: Vec<u32>,
}

/// A magnitude, no larger than what sums have room for; `LARGE` where it may be.
#[inline]
fn now<const LARGE: bool>(magnitude: u32) -> u32 {
    if LARGE { magnitude.min(MOST_NOW) } else { magnitude }
}

/// Twice a magnitude that is known to the plane before only, and about what is not known of it.
#[inline]
fn then<const LARGE: bool>(magnitude: u32) -> u32 {
    2 * now::<LARGE>(magnitude) + u32::from(magnitude > 0)
}

impl Sums {
    fn new(columns: usize) -> Self {
        Self { own: vec![0; columns], others: vec![0; columns] }
    }

    /// Sums of the row that begins at `start`, of what is known before it is coded.
    fn of_row<const LARGE: bool>(
        &mut self,
        shape: &Shape,
        grid: &Grid,
        before: Before<'_>,
        layer: usize,
        start: usize,
    ) {
        let (now, then) = (now::<LARGE>, then::<LARGE>);
        let (stride, columns) = (shape.stride(), shape.columns.len());
        let of = |first: usize| &grid.magnitudes[first..][..columns];
        let (above, below) = (start - stride, start + stride);
        let [up, up_left, up_right, up_2] = [above, above - 1, above + 1, above - stride].map(of);
        let [right, right_2, down, down_2, down_left, down_right] =
            [start + 1, start + 2, below, below + stride, below - 1, below + 1].map(of);
        let own = &mut self.own[..columns];
        for at in 0..columns {
            own[at] = 4 * now(up[at])
                + 2 * (now(up_left[at]) + now(up_right[at]))
                + now(up_2[at])
                + 3 * (then(right[at]) + then(down[at]))
                + then(right_2[at])
                + then(down_2[at])
                + then(down_left[at])
                + then(down_right[at]);
        }
        let others = &mut self.others[..columns];
        others.fill(0);
        let shift = before.shift;
        let finer = |magnitude: u32| now(magnitude << 1 >> shift);
        for (grid, weight) in before.grids.iter().zip([4, 2, 2]) {
            let Some(grid) = grid else { continue };
            let here = &grid.magnitudes[start..][..columns];
            for at in 0..columns {
                others[at] += weight * finer(here[at]);
            }
        }
        for grid in before.grids.iter().take(2).flatten() {
            let of = |first: usize| &grid.magnitudes[first..][..columns];
            let [left, right, up, down] = [start - 1, start + 1, above, below].map(of);
            for at in 0..columns {
                others[at] += finer(left[at]) + finer(right[at]) + finer(up[at]) + finer(down[at]);
            }
        }
        if layer > 0 {
            let here = of(start - shape.layer());
            for at in 0..columns {
                others[at] += 4 * now(here[at]);
            }
        }
    }
}
