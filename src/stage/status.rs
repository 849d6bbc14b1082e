//! How much of a store is there, by what lies on the disk and nothing else: for schedulers, and for people who wait.

use std::path::Path;

use serde::Serialize;

use crate::error::Result;
use crate::stage::deepzoom::{self, TilesFound};
use crate::stage::enlarge::blocks_done;
use crate::stage::verify::is_pyramid;
use crate::store::enlarged::{self, Enlarged};
use crate::store::kind_of;
use crate::store::measurement::{self, Measurement};
use crate::store::model::{self, Model, Stage};
use crate::zarr::metadata::OLDEST_FORMAT;

/// How much of a store is there.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Status {
    /// measurement, model, enlarged or deepzoom.
    pub kind: &'static str,
    /// What its units are, in the singular: view, stage, block, tile.
    pub unit: &'static str,
    /// How many there are to be.
    pub units: usize,
    /// How many are there.
    pub done: usize,
    /// Which units there are to be, by their numbers from 0: each pair is how many numbers, and how many units bear each
    /// of them. By its number a unit belongs to a part of the work; only tiles, of one row, share one.
    #[serde(skip)]
    numbers: Vec<[usize; 2]>,
    /// The number of each unit that is there.
    #[serde(skip)]
    done_numbers: Vec<usize>,
    /// Whether it was declared finished: a store with all units may still lack its checksums, which the same command
    /// writes when it is run again.
    pub finished: bool,
}

impl Status {
    fn new(
        kind: &'static str,
        unit: &'static str,
        numbers: Vec<[usize; 2]>,
        done_numbers: Vec<usize>,
        finished: bool,
    ) -> Self {
        // However many a store claims to have, this is only told.
        let all = |sum: usize, &[count, each]: &[usize; 2]| sum.saturating_add(count.saturating_mul(each));
        let units = numbers.iter().fold(0, all);
        Self { kind, unit, units, done: done_numbers.len(), numbers, done_numbers, finished }
    }

    /// Whether nothing is left to be done.
    pub fn is_complete(&self) -> bool {
        self.done == self.units && self.finished
    }

    /// The shards, of so many, that have something left to do; ascending.
    pub fn shards_left(&self, parts: usize) -> Vec<usize> {
        let mut done = vec![0; parts];
        self.done_numbers.iter().for_each(|number| done[number % parts] += 1);
        // However many units a store claims to have, only parts and what is there are counted.
        let of_part = |part: usize| {
            let each =
                |&[count, each]: &[usize; 2]| count.saturating_sub(part).div_ceil(parts).saturating_mul(each);
            self.numbers.iter().map(each).fold(0, usize::saturating_add)
        };
        let left: Vec<usize> = (0..parts).filter(|&part| done[part] < of_part(part)).collect();
        // Whichever shard ends last declares a store finished; one is needed to do it.
        if left.is_empty() && !self.finished { vec![0] } else { left }
    }
}

/// Looks at a measurement, a model, an enlarged index or a Deep Zoom pyramid.
///
/// # Errors
/// Where there is none of these, or its attributes are damaged.
pub fn of(path: &Path) -> Result<Status> {
    if is_pyramid(path) {
        let TilesFound { grids, done_rows, finished } = deepzoom::tiles(path)?;
        let rows = grids.iter().map(|grid| [grid.height, grid.width]).collect();
        return Ok(Status::new("deepzoom", "tile", rows, done_rows, finished));
    }
    match kind_of(path)? {
        model::KIND => {
            let model = Model::open(path)?;
            let mut done = Vec::new();
            for (number, stage) in Stage::ALL.into_iter().enumerate() {
                if model.has(stage)? && model.has_arrays(stage)? {
                    done.push(number);
                }
            }
            Ok(Status::new(model::KIND, "stage", vec![[Stage::ALL.len(), 1]], done, true))
        }
        enlarged::KIND => {
            let enlarged = Enlarged::open(path)?;
            let (units, done) = blocks_done(&enlarged);
            let finished = enlarged.is_finished()? || enlarged.format() == OLDEST_FORMAT;
            Ok(Status::new(enlarged::KIND, "block", vec![[units, 1]], done, finished))
        }
        _ => {
            let measurement = Measurement::open(path)?;
            let units = measurement.description().views.len();
            let done = (0..units).filter(|&view| measurement.has_view(view)).collect();
            let finished = measurement.is_finished()? || measurement.format() == OLDEST_FORMAT;
            Ok(Status::new(measurement::KIND, "view", vec![[units, 1]], done, finished))
        }
    }
}

/// Numbers as the arrays of Slurm are written: `3,7-9`.
pub fn as_array(numbers: &[usize]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b);
    let run = |run: &[usize]| match run {
        [one] => one.to_string(),
        [first, .., last] => format!("{first}-{last}"),
        [] => String::new(),
    };
    runs.map(run).collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_follow_each_other_are_written_as_a_range() {
        assert_eq!(as_array(&[3, 7, 8, 9]), "3,7-9");
        assert_eq!(as_array(&[0, 1]), "0-1");
        assert_eq!(as_array(&[]), "");
    }

    #[test]
    fn shards_with_missing_units_are_left_and_one_that_declares_the_end() {
        let status = |missing: &[usize], finished| {
            let done = (0..81).filter(|unit| !missing.contains(unit)).collect();
            Status::new(measurement::KIND, "view", vec![[81, 1]], done, finished)
        };
        assert_eq!(status(&[1, 5, 6, 80], false).shards_left(4), [0, 1, 2]);
        assert_eq!(status(&[], false).shards_left(4), [0]);
        assert_eq!(status(&[], true).shards_left(4), [0; 0]);
        assert!(status(&[], true).is_complete() && !status(&[], false).is_complete());
    }

    #[test]
    fn units_that_share_a_number_belong_to_one_shard() {
        // Levels of 3 x 2, 2 x 1 and 1 x 1 rows and columns of tiles; of row 1 one tile is missing.
        let levels = vec![[1, 1], [2, 1], [3, 2]];
        let status = |done: &[usize]| Status::new("deepzoom", "tile", levels.clone(), done.to_vec(), true);
        let one_missing = status(&[0, 0, 0, 0, 1, 1, 2, 2]);
        assert_eq!((one_missing.units, one_missing.done), (9, 8));
        assert_eq!(one_missing.shards_left(2), [1]);
        assert_eq!(one_missing.shards_left(5), [1]);
        assert_eq!(status(&[0, 0, 0, 0, 1, 1, 1, 2, 2]).shards_left(2), [0; 0]);
        assert_eq!(status(&[]).shards_left(4), [0, 1, 2]);
        // What a store claims is not counted one by one.
        let claimed = Status::new("deepzoom", "tile", vec![[usize::MAX, usize::MAX]; 2], Vec::new(), false);
        assert_eq!(claimed.shards_left(2), [0, 1]);
    }
}
