//! Which texels of a measurement are clustered, in the order in which its chunks pass by.
//!
//! Blocks and parts are fixed by the texels alone, never by memory, threads or shards.

use std::ops::Range;

use crate::shape::{Size, Window};
use crate::texel::cluster::seeding::subset;

/// Most texels of a block.
const BLOCK_TEXELS: usize = 4096;

/// Parts are about this many.
const PARTS: usize = 16;

/// Tells the draw of the sample from those of first centres.
const SAMPLE: u32 = u32::MAX;

/// Texels that lie side by side and are read at once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// The smallest window of the measurement that holds them; one row of chunks.
    pub window: Window,
    /// Their slots.
    pub slots: Range<usize>,
}

/// Texels to cluster. A slot is a texel's place in the order of reading; its number is what ties go by.
#[derive(Clone, Debug)]
pub struct Selection {
    blocks: Vec<Block>,
    parts: Vec<Range<usize>>,
    /// Number of the texel of each slot.
    numbers: Vec<u32>,
    /// Place of each slot's texel in the window of its block, counted row by row.
    places: Vec<u32>,
}

impl Selection {
    /// The texels at these rows and columns of the measurement, numbered as they come; chunks have `chunk_side`
    /// texels a side. A texel may come more than once.
    pub fn new(sources: &[[u32; 2]], chunk_side: usize) -> Self {
        let side = chunk_side as u32;
        let most_columns = (BLOCK_TEXELS / (chunk_side * chunk_side)).max(1) as u32;
        let mut order: Vec<u32> = (0..sources.len() as u32).collect();
        let place = |number: u32| {
            let [row, column] = sources[number as usize];
            (row / side, column / side / most_columns, row, column)
        };
        order.sort_by_key(|&number| (place(number), number));
        let mut selection = Self { blocks: vec![], parts: vec![], numbers: order, places: vec![] };
        let mut start = 0;
        let together = |a: &u32, b: &u32| (place(*a).0, place(*a).1) == (place(*b).0, place(*b).1);
        for block in selection.numbers.chunk_by(together) {
            let rows = block.iter().map(|&number| sources[number as usize][0] as usize);
            let columns = block.iter().map(|&number| sources[number as usize][1] as usize);
            let extent = |values: &mut dyn Iterator<Item = usize>| {
                values.fold((usize::MAX, 0), |(least, most), value| (value.min(least), value.max(most)))
            };
            let ((top, bottom), (left, right)) = (extent(&mut rows.clone()), extent(&mut columns.clone()));
            let window = Window { y: top, x: left, size: Size::new(bottom - top + 1, right - left + 1) };
            selection.places.extend(
                rows.zip(columns)
                    .map(|(row, column)| ((row - top) * window.size.width + column - left) as u32),
            );
            selection.blocks.push(Block { window, slots: start..start + block.len() });
            start += block.len();
        }
        let part_texels = sources.len().div_ceil(PARTS);
        let (mut first, mut texels) = (0, 0);
        for (number, block) in selection.blocks.iter().enumerate() {
            texels += block.slots.len();
            if texels >= part_texels || number + 1 == selection.blocks.len() {
                selection.parts.push(first..number + 1);
                (first, texels) = (number + 1, 0);
            }
        }
        selection
    }

    /// Number of texels.
    pub fn texels(&self) -> usize {
        self.numbers.len()
    }

    /// The blocks, in the order of reading.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Runs of blocks that a process assigns and sums up at once.
    pub fn parts(&self) -> &[Range<usize>] {
        &self.parts
    }

    /// The slots of a run of blocks.
    pub fn slots_of(&self, blocks: &Range<usize>) -> Range<usize> {
        let blocks = &self.blocks[blocks.clone()];
        let start = blocks.first().map_or(0, |block| block.slots.start);
        start..blocks.last().map_or(start, |block| block.slots.end)
    }

    /// Texel numbers of some slots.
    pub fn numbers(&self, slots: Range<usize>) -> &[u32] {
        &self.numbers[slots]
    }

    /// Places of some slots' texels in the window of their block.
    pub fn places(&self, slots: Range<usize>) -> &[u32] {
        &self.places[slots]
    }

    /// `count` texels drawn without preference, as ascending texel numbers; all where there are no more.
    pub fn sample(&self, count: usize, seed: u64) -> Vec<u32> {
        subset(self.texels(), count, seed, SAMPLE)
    }

    /// Puts what lies by slots in the order of texel numbers.
    pub fn by_number<T: Copy + Default>(&self, by_slot: &[T]) -> Vec<T> {
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
        let selection = Selection::new(&sources, 16);
        let mut seen = vec![false; sources.len()];
        for block in selection.blocks() {
            assert_eq!(block.window.y / 16, (block.window.y + block.window.size.height - 1) / 16);
            let slots = block.slots.clone();
            for (&number, &place) in selection.numbers(slots.clone()).iter().zip(selection.places(slots)) {
                let place = place as usize;
                let row = block.window.y + place / block.window.size.width;
                let column = block.window.x + place % block.window.size.width;
                assert_eq!(sources[number as usize], [row as u32, column as u32]);
                assert!(!std::mem::replace(&mut seen[number as usize], true));
            }
        }
        assert!(seen.iter().all(|&seen| seen));
        assert_eq!(selection.by_number(&selection.numbers), (0..5000).collect::<Vec<u32>>());
    }

    #[test]
    fn parts_cover_all_blocks_and_samples_are_spread() {
        let size = Size::new(400, 500);
        let sources: Vec<[u32; 2]> = (0..400).flat_map(|y| (0..500).map(move |x| [y, x])).collect();
        let selection = Selection::new(&sources, 16);
        assert!(selection.blocks().iter().all(|block| block.slots.len() <= BLOCK_TEXELS));
        let slots: Vec<Range<usize>> =
            selection.parts().iter().map(|part| selection.slots_of(part)).collect();
        assert_eq!((slots[0].start, slots[slots.len() - 1].end), (0, size.texels()));
        assert!(slots[..slots.len() - 1].iter().all(|slots| slots.len() >= size.texels() / PARTS));
        assert!(slots.windows(2).all(|pair| pair[0].end == pair[1].start));
        let sample = selection.sample(10_000, 7);
        assert_eq!(sample.len(), 10_000);
        assert!(sample.windows(2).all(|pair| pair[0] < pair[1]));
        let quarter = |part: usize| sample.iter().filter(|&&n| n as usize / 50_000 == part).count();
        assert!((0..4).all(|part| (2300..2700).contains(&quarter(part))));
        assert_ne!(sample, selection.sample(10_000, 8));
        assert_eq!(selection.sample(300_000, 7).len(), size.texels());
    }
}
