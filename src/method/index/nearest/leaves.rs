//! A table over (x, y) of unit vectors: each entry leads to the few normals among which the nearest of every query
//! there are.
//!
//! A grid of cells covers the square around the unit circle; each cell has its own table of a power of two a side,
//! as fine as the densest normals in it call for. Squares of the table that need not be so fine share their
//! candidates.

use std::cmp::Reverse;

use rayon::prelude::*;

use super::search::{Node, Search};
use super::square::{Point, SLACK, Square};
use crate::kernel::ranking::{BATCH, Candidates};

/// Halvings of the whole square that make the grid.
const GRID_LEVEL: u32 = 6;

/// Cells on a side.
const GRID: usize = 1 << GRID_LEVEL;

/// Bits of a place: x or y from -1 to 1 in steps of 2^-22.
const PLACE_BITS: u32 = 23;

/// Squares whose candidates are sought at a time.
const TOGETHER: usize = 8;

/// Bytes of tables and candidates after which no more are made.
const ENOUGH_BYTES: usize = 64 << 20;

/// Most bytes: the last squares begun with may exceed what is enough.
pub(super) const MOST_BYTES: usize = 80 << 20;

/// Tables and candidates.
pub(super) struct Leaves {
    cells: Vec<Cell>,
    /// Numbers in `candidates` by cell, row and column. Entry 0 is 0.
    table: Vec<u32>,
    /// Number 0 has none.
    candidates: Vec<Candidates>,
}

/// Where the table of a cell starts, and the logarithm of its side.
#[derive(Clone, Copy, Default)]
struct Cell {
    start: u32,
    depth: u32,
}

impl Leaves {
    /// Over the points of a search. Where most normals are most queries will be: that is begun with, and what does
    /// not fit the memory is left to the tree.
    pub(super) fn new(points: &[Point], search: &Search<'_>) -> Self {
        let mut leaves = Self {
            cells: vec![Cell::default(); GRID * GRID],
            table: vec![0],
            candidates: vec![Candidates::new([])],
        };
        let mut held = vec![0; GRID * GRID];
        for &(normal, _) in points {
            if let [Some(x), Some(y)] = place(normal) {
                held[cell(x, y)] += 1;
            }
        }
        let mut squares = Vec::new();
        cut(Square::WHOLE, &held, &mut squares);
        squares.sort_by_key(|&(held, square)| (Reverse(held), square.level));
        for squares in squares.chunks(TOGETHER) {
            let nodes: Vec<Node> =
                squares.par_iter().map(|&(_, square)| search.refine(square, None)).collect();
            for (&(_, square), node) in squares.iter().zip(&nodes) {
                leaves.add(square, node);
            }
            if leaves.memory_bytes() > ENOUGH_BYTES {
                break;
            }
        }
        leaves
    }

    /// Adds what was found for a square that is a cell or larger.
    fn add(&mut self, square: Square, node: &Node) {
        match node {
            Node::Quarters(quarters) if square.level < GRID_LEVEL => {
                for (square, node) in square.quarters().into_iter().zip(quarters.iter()) {
                    self.add(square, node);
                }
            }
            _ => {
                let (start, depth) = (self.table.len(), node.depth());
                self.table.resize(start + (1 << (2 * depth)), 0);
                self.fill(node, start, 1 << depth, 1 << depth);
                for cell in cells(square) {
                    self.cells[cell] = Cell { start: start as u32, depth };
                }
            }
        }
    }

    /// Fills a square of a table from its first entry on; `stride` leads to the next row.
    fn fill(&mut self, node: &Node, first: usize, side: usize, stride: usize) {
        match node {
            Node::Leaf(None) => {}
            Node::Leaf(Some(candidates)) => {
                let number = self.candidates.len() as u32;
                self.candidates.push(Candidates::clone(candidates));
                for row in 0..side {
                    self.table[first + row * stride..][..side].fill(number);
                }
            }
            Node::Quarters(quarters) => {
                let half = side / 2;
                let firsts = [first, first + half, first + half * stride, first + half * stride + half];
                for (node, first) in quarters.iter().zip(firsts) {
                    self.fill(node, first, half, stride);
                }
            }
        }
    }

    /// The candidates for each query; none if it is not of unit length, has z <= 0 or lies where there is no table.
    #[inline]
    pub(super) fn find(&self, queries: &[[f32; 3]; BATCH]) -> [&Candidates; BATCH] {
        queries.map(|query| {
            let [x, y, z] = query;
            // Of a unit vector with the same x and y, the query's z is off by at most this surplus over z. Half the
            // slack is left for rounding.
            let surplus = (x * x + y * y + z * z - 1.0).abs();
            let entry = match place(query) {
                [Some(x), Some(y)] if surplus <= z * (0.5 * SLACK) => {
                    let Cell { start, depth } = self.cells[cell(x, y)];
                    let within =
                        |place: u32| (place << GRID_LEVEL & ((1 << PLACE_BITS) - 1)) >> (PLACE_BITS - depth);
                    start + (within(y) << depth) + within(x)
                }
                _ => 0,
            };
            &self.candidates[self.table[entry as usize] as usize]
        })
    }

    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&self.cells[..]) + size_of_val(&self.table[..]) + size_of_val(&self.candidates[..])
    }
}

/// Squares without normals, as large as may be, and cells with some, with how many they hold.
fn cut(square: Square, held: &[usize], squares: &mut Vec<(usize, Square)>) {
    let sum = cells(square).map(|cell| held[cell]).sum();
    if square.level < GRID_LEVEL && sum > 0 {
        square.quarters().into_iter().for_each(|quarter| cut(quarter, held, squares));
    } else if !square.is_outside() {
        squares.push((sum, square));
    }
}

/// The cells of a square that is no smaller than one.
fn cells(square: Square) -> impl Iterator<Item = usize> {
    let side = GRID >> square.level;
    let (column, row) = (square.column as usize * side, square.row as usize * side);
    (row..row + side).flat_map(move |row| (column..column + side).map(move |column| row * GRID + column))
}

/// Places of x and y, if they lie in -1..1. Rounds by at most 2^-23.
#[inline]
fn place([x, y, _]: [f32; 3]) -> [Option<u32>; 2] {
    // Numbers from 2 to 4 have one exponent: their bits count steps.
    [x, y].map(|component| {
        let place = (component + 3.0).to_bits().wrapping_sub(2.0f32.to_bits());
        (place < 1 << PLACE_BITS).then_some(place)
    })
}

/// The cell of two places.
#[inline]
fn cell(x: u32, y: u32) -> usize {
    let [column, row] = [x, y].map(|place| (place >> (PLACE_BITS - GRID_LEVEL)) as usize);
    row * GRID + column
}
