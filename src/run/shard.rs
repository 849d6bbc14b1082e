//! Part of the units of a stage, so that many jobs share the work: `K/N`, or what a scheduler says in its variables.

use std::str::FromStr;

/// Part `part` of `parts` of the units of a stage: every `parts`-th.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// 0-based.
    pub part: usize,
    /// At least 1.
    pub parts: usize,
}

impl Default for Shard {
    fn default() -> Self {
        Self::WHOLE
    }
}

impl Shard {
    /// All units.
    pub const WHOLE: Self = Self { part: 0, parts: 1 };

    /// Whether a unit belongs to this part.
    pub fn has(self, unit: usize) -> bool {
        unit % self.parts == self.part
    }

    /// What of a whole was looked at, for people.
    pub(crate) fn looked_at(self, count: usize, of: &str) -> String {
        format!(
            "part {} of {}: {count} of {of} looked at, and what all have in common",
            self.part, self.parts
        )
    }

    /// The part that a scheduler gave to this process, by the variables that `variable` looks up.
    ///
    /// # Errors
    /// Says which variables are missing, or do not give a part.
    pub fn of_scheduler(variable: impl Fn(&str) -> Option<String>) -> Result<Self, String> {
        let number = |name: &str| -> Result<Option<usize>, String> {
            let Some(text) = variable(name) else { return Ok(None) };
            let wrong = |_| format!("{name}: got {text:?}, expected a whole number, 0 or more");
            text.trim().parse().map(Some).map_err(wrong)
        };
        if let Some(task) = number("SLURM_ARRAY_TASK_ID")? {
            let [least, most, count] = ["MIN", "MAX", "COUNT"].map(|what| format!("SLURM_ARRAY_TASK_{what}"));
            let (Some(least), Some(most), Some(count)) = (number(&least)?, number(&most)?, number(&count)?)
            else {
                return Err(format!(
                    "SLURM_ARRAY_TASK_ID is {task}, but {least}, {most} or {count} is not set"
                ));
            };
            // Of an array with holes the count says nothing about how many parts there were meant to be.
            if most.checked_sub(least).and_then(|range| range.checked_add(1)) != Some(count) {
                return Err(format!(
                    "a Slurm array of {count} tasks from {least} to {most} has holes: write the parts as a number, \
                     --shard $SLURM_ARRAY_TASK_ID/N"
                ));
            }
            return Self::checked(task.wrapping_sub(least), count, "SLURM_ARRAY_TASK_ID");
        }
        for [part, parts] in
            [["SLURM_PROCID", "SLURM_NTASKS"], ["OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"]]
        {
            if let (Some(part_number), Some(parts_number)) = (number(part)?, number(parts)?) {
                return Self::checked(part_number, parts_number, part);
            }
        }
        let counted_elsewhere = ["HQ_TASK_ID", "JOB_COMPLETION_INDEX", "PBS_ARRAY_INDEX"];
        Err(match counted_elsewhere.iter().find(|name| variable(name).is_some()) {
            Some(name) => format!("{name} says which part, but not of how many: write --shard ${name}/N"),
            None => "no scheduler's variables are set (SLURM_ARRAY_TASK_ID, SLURM_PROCID): write --shard K/N"
                .to_owned(),
        })
    }

    fn checked(part: usize, parts: usize, name: &str) -> Result<Self, String> {
        if part < parts {
            return Ok(Self { part, parts });
        }
        Err(format!("{name} gives part {part} of {parts}, expected 0 to {}", parts.saturating_sub(1)))
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "env" {
            return Self::of_scheduler(|name| std::env::var(name).ok());
        }
        let expected = || format!("expected K/N with K from 0 to N - 1, such as 0/4, or env, got {text:?}");
        let (part, parts) = text.split_once('/').ok_or_else(expected)?;
        let number = |text: &str| text.trim().parse::<usize>().map_err(|_| expected());
        let shard = Self { part: number(part)?, parts: number(parts)? };
        if shard.part < shard.parts { Ok(shard) } else { Err(expected()) }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn every_unit_belongs_to_one_part_and_parts_differ_by_one_unit_at_most() {
        for parts in 1..9 {
            let shards: Vec<Shard> =
                (0..parts).map(|part| format!("{part}/{parts}").parse().unwrap()).collect();
            assert!((0..81).all(|unit| shards.iter().filter(|shard| shard.has(unit)).count() == 1));
            let counts: Vec<usize> =
                shards.iter().map(|shard| (0..81).filter(|&unit| shard.has(unit)).count()).collect();
            assert!(counts.iter().max().unwrap() - counts.iter().min().unwrap() <= 1, "{counts:?}");
        }
        for text in ["", "1", "4/4", "-1/2", "0/0", "a/b", "ENV"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }

    fn of(variables: &[(&str, &str)]) -> Result<Shard, String> {
        Shard::of_scheduler(|name| {
            variables.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn schedulers_say_which_part_and_what_is_not_clear_is_refused() {
        let array = |task: &'static str, least: &'static str, most: &'static str, count: &'static str| {
            let names = [
                "SLURM_ARRAY_TASK_ID",
                "SLURM_ARRAY_TASK_MIN",
                "SLURM_ARRAY_TASK_MAX",
                "SLURM_ARRAY_TASK_COUNT",
            ];
            // A step of a job has these too; the array decides.
            let all = names
                .into_iter()
                .zip([task, least, most, count])
                .chain([("SLURM_PROCID", "0"), ("SLURM_NTASKS", "1")]);
            of(&all.collect::<Vec<_>>())
        };
        assert_eq!(array("0", "0", "6", "7").unwrap(), Shard { part: 0, parts: 7 });
        assert_eq!(array("12", "10", "12", "3").unwrap(), Shard { part: 2, parts: 3 });
        // --array=3,7 and --array=0-8:2 have fewer tasks than their range.
        assert!(array("3", "3", "7", "2").unwrap_err().contains("has holes"));
        assert!(array("4", "0", "8", "5").unwrap_err().contains("has holes"));
        assert!(array("9", "0", "6", "7").unwrap_err().contains("part 9 of 7"));
        assert!(array("1", "2", "8", "7").is_err());
        assert!(array("x", "0", "6", "7").unwrap_err().contains("SLURM_ARRAY_TASK_ID"));
        assert!(of(&[("SLURM_ARRAY_TASK_ID", "1")]).unwrap_err().contains("is not set"));
        assert_eq!(of(&[("SLURM_PROCID", "3"), ("SLURM_NTASKS", "4")]).unwrap(), Shard { part: 3, parts: 4 });
        assert!(of(&[("HQ_TASK_ID", "3")]).unwrap_err().contains("--shard $HQ_TASK_ID/N"));
        assert!(of(&[]).unwrap_err().contains("--shard K/N"));
    }
}
