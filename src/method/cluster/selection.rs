//! Which texels of a measurement are clustered, in the order in which its chunks pass by: row by row, or drawn, so that
//! the first blocks are a mini-batch of the whole.
//!
//! Blocks and parts are fixed by the texels alone, never by memory, threads or shards.

use std::ops::Range;

use super::seeding::subset;
use crate::random::Hash;
use crate::shape::{Size, Window};

/// Most texels of a block.
pub(crate) const BLOCK_TEXELS: usize = 4096;

/// Parts are about this many, and so are blocks of drawn chunks at least.
const PARTS: usize = 16;

/// Tells the draw of chunks from others.
const CHUNKS: u32 = u32::from_be_bytes(*b"chnk");

/// Tells the draw of the sample from those of first centres.
const SAMPLE: u32 = u32::MAX;

/// The order in which chunks pass by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// Row by row.
    Rows,
    /// Drawn without preference by this seed.
    Drawn(u64),
}

/// Texels that are read at once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Block {
    /// The smallest windows of the measurement that hold them, each within a row of chunks: one where chunks pass by row
    /// by row, one a chunk where they are drawn.
    pub windows: Vec<Window>,
    /// Their slots.
    pub slots: Range<usize>,
}

/// Texels to cluster. A slot is a texel's place in the order of reading; its number is what ties go by.
#[derive(Clone, Debug)]
pub(crate) struct Selection {
    blocks: Vec<Block>,
    /// Number of the texel of each slot.
    numbers: Vec<u32>,
    /// Place of each slot's texel in the windows of its block, counted row by row, one window after another.
    places: Vec<u32>,
}

impl Selection {
    /// The texels at these rows and columns of the measurement, numbered as they come; chunks have `chunk_side`
    /// texels a side. A texel may come more than once.
    pub(crate) fn new(sources: &[[u32; 2]], chunk_side: usize, order: Order) -> Self {
        let side = chunk_side as u32;
        let chunks = (BLOCK_TEXELS / (chunk_side * chunk_side)).max(1);
        let across = if order == Order::Rows { chunks as u32 } else { 1 };
        let window_of = |number: u32| {
            let [row, column] = sources[number as usize];
            let (row, column) = (row / side, column / side / across);
            let drawn = match order {
                Order::Rows => 0,
                Order::Drawn(seed) => Hash::new(seed, CHUNKS).words(row, column, 0)[0],
            };
            (drawn, row, column)
        };
        let mut numbers: Vec<u32> = (0..sources.len() as u32).collect();
        numbers.sort_by_cached_key(|&number| (window_of(number), sources[number as usize], number));
        let mut selection = Self { blocks: vec![], numbers, places: vec![] };
        let mut start = 0;
        let windows = || selection.numbers.chunk_by(|&a, &b| window_of(a) == window_of(b));
        // Windows of a block.
        let together = if order == Order::Rows { 1 } else { (windows().count() / PARTS).clamp(1, chunks) };
        for (count, of_window) in windows().enumerate() {
            let rows = of_window.iter().map(|&number| sources[number as usize][0] as usize);
            let columns = of_window.iter().map(|&number| sources[number as usize][1] as usize);
            let extent = |values: &mut dyn Iterator<Item = usize>| {
                values.fold((usize::MAX, 0), |(least, most), value| (value.min(least), value.max(most)))
            };
            let ((top, bottom), (left, right)) = (extent(&mut rows.clone()), extent(&mut columns.clone()));
            let window = Window { y: top, x: left, size: Size::new(bottom - top + 1, right - left + 1) };
            if count % together == 0 {
                selection.blocks.push(Block { windows: vec![], slots: start..start });
            }
            let Some(block) = selection.blocks.last_mut() else { continue };
            let before: usize = block.windows.iter().map(|window| window.size.texels()).sum();
            selection.places.extend(
                rows.zip(columns)
                    .map(|(row, column)| (before + (row - top) * window.size.width + column - left) as u32),
            );
            block.windows.push(window);
            start += of_window.len();
            block.slots.end = start;
        }
        selection
    }

    /// Number of texels.
    pub(crate) fn texels(&self) -> usize {
        self.numbers.len()
    }

    /// The blocks, in the order of reading.
    pub(crate) fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// How many of the first blocks hold `texels` texels; all where there are no more.
    pub(crate) fn first_blocks(&self, texels: usize) -> usize {
        let before = self.blocks.partition_point(|block| block.slots.end < texels);
        (before + 1).min(self.blocks.len())
    }

    /// Runs of the first `blocks` blocks that a process assigns and sums up at once.
    pub(crate) fn parts(&self, blocks: usize) -> Vec<Range<usize>> {
        let part_texels = self.slots_of(&(0..blocks)).len().div_ceil(PARTS);
        let (mut first, mut texels) = (0, 0);
        let mut parts = Vec::new();
        for (number, block) in self.blocks[..blocks].iter().enumerate() {
            texels += block.slots.len();
            if texels >= part_texels || number + 1 == blocks {
                parts.push(first..number + 1);
                (first, texels) = (number + 1, 0);
            }
        }
        parts
    }

    /// The slots of a run of blocks.
    pub(crate) fn slots_of(&self, blocks: &Range<usize>) -> Range<usize> {
        let blocks = &self.blocks[blocks.clone()];
        let start = blocks.first().map_or(0, |block| block.slots.start);
        start..blocks.last().map_or(start, |block| block.slots.end)
    }

    /// Texel numbers of some slots.
    pub(crate) fn numbers(&self, slots: Range<usize>) -> &[u32] {
        &self.numbers[slots]
    }

    /// Places of some slots' texels in the windows of their block.
    pub(crate) fn places(&self, slots: Range<usize>) -> &[u32] {
        &self.places[slots]
    }

    /// `count` texels of the first `blocks` blocks drawn without preference, as ascending texel numbers; all of these
    /// where there are no more.
    pub(crate) fn sample(&self, blocks: usize, count: usize, seed: u64) -> Vec<u32> {
        let mut among = self.numbers[self.slots_of(&(0..blocks))].to_vec();
        among.sort_unstable();
        subset(among.len(), count, seed, SAMPLE).into_iter().map(|at| among[at as usize]).collect()
    }

    /// Puts what lies by slots in the order of texel numbers.
    pub(crate) fn by_number<T: Copy + Default>(&self, by_slot: &[T]) -> Vec<T> {
        let mut by_number = vec![T::default(); by_slot.len()];
        for (&number, &value) in self.numbers.iter().zip(by_slot) {
            by_number[number as usize] = value;
        }
        by_number
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Hash;

    #[test]
    fn every_texel_is_found_once_at_its_place() {
        let hash = Hash::new(1, 0);
        let sources: Vec<[u32; 2]> =
            (0..5000).map(|n| [hash.words(n, 0, 0)[0] % 90 + 3, hash.words(n, 1, 0)[0] % 700]).collect();
        for order in [Order::Rows, Order::Drawn(3)] {
            let selection = Selection::new(&sources, 16, order);
            let mut seen = vec![false; sources.len()];
            let mut end = 0;
            for block in selection.blocks() {
                assert!(block.windows.len() <= 16 && (order != Order::Rows || block.windows.len() == 1));
                let mut texels = Vec::new();
                for window in &block.windows {
                    assert_eq!(window.y / 16, (window.y + window.size.height - 1) / 16);
                    let rows = window.y..window.y + window.size.height;
                    let columns = window.x..window.x + window.size.width;
                    texels.extend(rows.flat_map(|y| columns.clone().map(move |x| [y as u32, x as u32])));
                }
                let slots = block.slots.clone();
                assert_eq!(std::mem::replace(&mut end, slots.end), slots.start);
                for (&number, &place) in selection.numbers(slots.clone()).iter().zip(selection.places(slots))
                {
                    assert_eq!(sources[number as usize], texels[place as usize]);
                    assert!(!std::mem::replace(&mut seen[number as usize], true));
                }
            }
            assert!(seen.iter().all(|&seen| seen));
            assert_eq!(selection.by_number(&selection.numbers), (0..5000).collect::<Vec<u32>>());
        }
    }

    #[test]
    fn the_first_blocks_of_drawn_chunks_are_spread_over_the_plane() {
        let sources: Vec<[u32; 2]> = (0..400).flat_map(|y| (0..500).map(move |x| [y, x])).collect();
        let selection = Selection::new(&sources, 16, Order::Drawn(7));
        let blocks = selection.first_blocks(50_000);
        let slots = selection.slots_of(&(0..blocks));
        assert!((50_000..54_096).contains(&slots.len()), "{slots:?}");
        assert_eq!(selection.first_blocks(1), 1);
        assert_eq!(selection.first_blocks(usize::MAX), selection.blocks().len());
        let numbers = selection.numbers(slots.clone());
        let quarter = |part: usize| numbers.iter().filter(|&&n| n as usize / 50_000 == part).count();
        assert!((0..4).all(|part| (9_000..17_000).contains(&quarter(part))));
        let parts = selection.parts(blocks);
        assert_eq!((parts[0].start, parts[parts.len() - 1].end), (0, blocks));
        assert!(parts.windows(2).all(|pair| pair[0].end == pair[1].start));
        assert_ne!(numbers, Selection::new(&sources, 16, Order::Drawn(8)).numbers(slots));
    }

    #[test]
    fn parts_cover_all_blocks_and_samples_are_spread() {
        let size = Size::new(400, 500);
        let sources: Vec<[u32; 2]> = (0..400).flat_map(|y| (0..500).map(move |x| [y, x])).collect();
        let selection = Selection::new(&sources, 16, Order::Rows);
        assert!(selection.blocks().iter().all(|block| block.slots.len() <= BLOCK_TEXELS));
        let slots: Vec<Range<usize>> =
            selection.parts(selection.blocks().len()).iter().map(|part| selection.slots_of(part)).collect();
        assert_eq!((slots[0].start, slots[slots.len() - 1].end), (0, size.texels()));
        assert!(slots[..slots.len() - 1].iter().all(|slots| slots.len() >= size.texels() / PARTS));
        assert!(slots.windows(2).all(|pair| pair[0].end == pair[1].start));
        let all = selection.blocks().len();
        let sample = selection.sample(all, 10_000, 7);
        assert_eq!(sample.len(), 10_000);
        assert!(sample.windows(2).all(|pair| pair[0] < pair[1]));
        let quarter = |part: usize| sample.iter().filter(|&&n| n as usize / 50_000 == part).count();
        assert!((0..4).all(|part| (2300..2700).contains(&quarter(part))));
        assert_ne!(sample, selection.sample(all, 10_000, 8));
        assert_eq!(selection.sample(all, 300_000, 7).len(), size.texels());
        let of_few = selection.sample(2, 1000, 7);
        assert!(of_few.len() == 1000 && of_few.iter().all(|&n| selection.numbers(0..8192).contains(&n)));
    }
}
