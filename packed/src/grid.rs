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
            sums.of_row(shape, grid, before, layer, start);
            for column in 0..columns {
                let at = start + column;
                let own = sums.own[column] + 4 * now(grid.magnitudes[at - 1]) + now(grid.magnitudes[at - 2]);
                let others = sums.others[column];
                let number = first + column;
                let bit = wanted.magnitude(number) & 1 == 1;
                let known = grid.magnitudes[at];
                if known == 0 {
                    let chroma = usize::from(layer > 0);
                    let classes = class(own, AROUND) * BEFORE + class(others, BEFORE);
                    let frequency = shape.frequency(row, column);
                    let by_sums = &mut contexts.by_sums[classes * 2 + chroma];
                    let both = class(own + others, AROUND);
                    let by_frequency =
                        &mut contexts.by_frequency[(both * FREQUENCIES + frequency) * 2 + chroma];
                    if coder.bit_of_two([by_sums, by_frequency], bit) {
                        grid.negative[at] = coder.even(wanted.is_negative(number));
                        grid.magnitudes[at] = 1;
                    }
                } else {
                    let size = known.min(3) as usize - 1;
                    let context = &mut contexts.more[size][class(own / 8, 4)];
                    grid.magnitudes[at] = 2 * known + u32::from(coder.bit(context, bit));
                }
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

/// A magnitude, no larger than what sums have room for.
#[inline]
fn now(magnitude: u32) -> u32 {
    magnitude.min(1 << 16)
}

/// Twice a magnitude that is known to the plane before only, and about what is not known of it.
#[inline]
fn then(magnitude: u32) -> u32 {
    2 * now(magnitude) + u32::from(magnitude > 0)
}

impl Sums {
    fn new(columns: usize) -> Self {
        Self { own: vec![0; columns], others: vec![0; columns] }
    }

    /// Sums of the row that begins at `start`, of what is known before it is coded.
    fn of_row(&mut self, shape: &Shape, grid: &Grid, before: Before<'_>, layer: usize, start: usize) {
        let (stride, columns) = (shape.stride(), shape.columns.len());
        self.own.fill(0);
        let mut add = |first: usize, of: fn(u32) -> u32, weight: u32| {
            let row = &grid.magnitudes[first..][..columns];
            self.own.iter_mut().zip(row).for_each(|(sum, &magnitude)| *sum += weight * of(magnitude));
        };
        let (above, below) = (start - stride, start + stride);
        add(above, now, 4);
        add(above - 1, now, 2);
        add(above + 1, now, 2);
        add(above - stride, now, 1);
        add(start + 1, then, 3);
        add(below, then, 3);
        add(start + 2, then, 1);
        add(below + stride, then, 1);
        add(below - 1, then, 1);
        add(below + 1, then, 1);
        self.others.fill(0);
        let shift = before.shift;
        for (grid, [here, beside]) in before.grids.iter().zip([[4, 1], [2, 1], [2, 0]]) {
            let Some(grid) = grid else { continue };
            let mut add = |first: usize, weight: u32| {
                let row = &grid.magnitudes[first..][..columns];
                let pairs = self.others.iter_mut().zip(row);
                pairs.for_each(|(sum, &magnitude)| *sum += weight * now(magnitude << 1 >> shift));
            };
            add(start, here);
            if beside > 0 {
                [start - 1, start + 1, above, below].into_iter().for_each(|first| add(first, beside));
            }
        }
        if layer > 0 {
            let row = &grid.magnitudes[start - shape.layer()..][..columns];
            self.others.iter_mut().zip(row).for_each(|(sum, &magnitude)| *sum += 4 * now(magnitude));
        }
    }
}
