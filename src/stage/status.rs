//! How much of a store is there, by what lies on the disk and nothing else: for schedulers, and for people who wait.

use std::path::Path;

use serde::Serialize;

use crate::error::Result;
use crate::stage::enlarge::blocks_done;
use crate::store::enlarged::{self, Enlarged};
use crate::store::kind_of;
use crate::store::measurement::{self, Measurement};
use crate::store::model::{self, Model, Stage};
use crate::zarr::metadata::OLDEST_FORMAT;

/// How much of a store is there.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Status {
    /// measurement, model or enlarged.
    pub kind: &'static str,
    /// What its units are, in the singular: view, stage, block.
    pub unit: &'static str,
    /// How many there are to be.
    pub units: usize,
    /// How many are there.
    pub done: usize,
    /// Their numbers, from 0, ascending.
    #[serde(skip)]
    pub done_units: Vec<usize>,
    /// Whether it was declared finished: a store with all units may still lack its checksums, which the same command
    /// writes when it is run again.
    pub finished: bool,
}

impl Status {
    fn new(
        kind: &'static str,
        unit: &'static str,
        units: usize,
        done_units: Vec<usize>,
        finished: bool,
    ) -> Self {
        Self { kind, unit, units, done: done_units.len(), done_units, finished }
    }

    /// Whether nothing is left to be done.
    pub fn is_complete(&self) -> bool {
        self.done == self.units && self.finished
    }

    /// The shards, of so many, that have something left to do; ascending.
    pub fn shards_left(&self, parts: usize) -> Vec<usize> {
        let mut done = vec![0; parts];
        self.done_units.iter().for_each(|unit| done[unit % parts] += 1);
        // However many units a store claims to have, only parts and what is there are counted.
        let of_part = |part: usize| self.units.saturating_sub(part).div_ceil(parts);
        let left: Vec<usize> = (0..parts).filter(|&part| done[part] < of_part(part)).collect();
        // Whichever shard ends last declares a store finished; one is needed to do it.
        if left.is_empty() && !self.finished { vec![0] } else { left }
    }
}

/// Looks at a measurement, a model or an enlarged index.
///
/// # Errors
/// Where there is none of these, or its attributes are damaged.
pub fn of(path: &Path) -> Result<Status> {
    match kind_of(path)? {
        model::KIND => {
            let model = Model::open(path)?;
            let mut done = Vec::new();
            for (number, stage) in Stage::ALL.into_iter().enumerate() {
                if model.has(stage)? && model.has_arrays(stage)? {
                    done.push(number);
                }
            }
            Ok(Status::new(model::KIND, "stage", Stage::ALL.len(), done, true))
        }
        enlarged::KIND => {
            let enlarged = Enlarged::open(path)?;
            let (units, done) = blocks_done(&enlarged);
            let finished = enlarged.is_finished()? || enlarged.format() == OLDEST_FORMAT;
            Ok(Status::new(enlarged::KIND, "block", units, done, finished))
        }
        _ => {
            let measurement = Measurement::open(path)?;
            let units = measurement.description().views.len();
            let done = (0..units).filter(|&view| measurement.has_view(view)).collect();
            let finished = measurement.is_finished()? || measurement.format() == OLDEST_FORMAT;
            Ok(Status::new(measurement::KIND, "view", units, done, finished))
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
            Status::new(measurement::KIND, "view", 81, done, finished)
        };
        assert_eq!(status(&[1, 5, 6, 80], false).shards_left(4), [0, 1, 2]);
        assert_eq!(status(&[], false).shards_left(4), [0]);
        assert_eq!(status(&[], true).shards_left(4), [0; 0]);
        assert!(status(&[], true).is_complete() && !status(&[], false).is_complete());
    }
}
