//! Runs units of work, each done or not done, with a bounded number in flight.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::error::Result;
use crate::run::{Context, spawn};

/// Units that may be in flight: one a thread, fewer where memory does not allow it. `what` one of them is stands in the
/// error.
///
/// # Errors
/// Where memory does not even allow one.
pub(crate) fn in_flight(context: &Context<'_>, what: &str, unit_bytes: u64) -> Result<usize> {
    in_flight_beside(context, what, unit_bytes, 0)
}

/// The same beside bytes that are kept until the end.
///
/// # Errors
/// As [`in_flight`].
pub(crate) fn in_flight_beside(
    context: &Context<'_>,
    what: &str,
    unit_bytes: u64,
    kept_bytes: u64,
) -> Result<usize> {
    context.require(what, unit_bytes.saturating_add(kept_bytes))?;
    let affordable = context.work_bytes().saturating_sub(kept_bytes) / unit_bytes.max(1);
    Ok((context.threads.max(1) as u64).min(affordable).max(1) as usize)
}

/// Works on every item on the threads of the pool that this is called in, on fewer of them where half the memory does
/// not hold an item of `bytes` for each: results take the other half. They are in the order of the items.
pub(crate) fn each_at_once<U: Sync, T: Send>(
    items: &[U],
    bytes: u64,
    context: &Context<'_>,
    work: impl Fn(&U) -> T + Sync,
) -> Vec<T> {
    let affordable = (context.work_bytes() / 2 / bytes.max(1)).max(1);
    let together = match context.threads as u64 > affordable {
        true => items.len().div_ceil(affordable as usize).max(1),
        false => 1,
    };
    items.par_chunks(together).flat_map_iter(|chunk| chunk.iter().map(&work)).collect()
}

/// Runs `work` on every unit, at most `in_flight` at a time, in the order given.
///
/// Workers start no new unit once a stop is asked for or a unit has failed. Returns what the units
/// returned, in their order, or the error of the first unit (by order) that failed.
pub fn for_each<U: Sync, T: Send>(
    context: &Context<'_>,
    units: &[U],
    in_flight: usize,
    work: impl Fn(&U) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let next = AtomicUsize::new(0);
    let failed = std::sync::atomic::AtomicBool::new(false);
    let results: Mutex<Vec<(usize, Result<T>)>> = Mutex::new(Vec::with_capacity(units.len()));
    let worker = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(unit) = units.get(number) else { break };
            if failed.load(Ordering::Relaxed) {
                break;
            }
            let result = context.check_stop().and_then(|()| work(unit));
            failed.fetch_or(result.is_err(), Ordering::Relaxed);
            results.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((number, result));
        }
    };
    std::thread::scope(|scope| -> Result<()> {
        for number in 0..in_flight.clamp(1, units.len().max(1)) {
            match spawn(scope, "unit", worker) {
                // Fewer do as well, if there is one.
                Err(error) if number == 0 => return Err(error),
                Err(_) => break,
                Ok(()) => {}
            }
        }
        Ok(())
    })?;
    let mut results = results.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    results.sort_by_key(|(number, _)| *number);
    results.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::error::{Error, ErrorKind};
    use crate::run::budget;
    use crate::run::progress::Silent;
    use std::sync::atomic::AtomicBool;
    use std::time::Duration;

    fn context(stop: &AtomicBool) -> Context<'_> {
        Context::new(&Silent, stop, 4, budget::OWN_BYTES + 100).unwrap()
    }

    #[test]
    fn results_come_in_the_order_of_the_units_whoever_ends_first() {
        let stop = AtomicBool::new(false);
        let results = for_each(&context(&stop), &[40, 0, 20, 0], 4, |&delay| {
            std::thread::sleep(Duration::from_millis(delay));
            Ok(delay)
        });
        assert_eq!(results.unwrap(), [40, 0, 20, 0]);
    }

    #[test]
    fn a_failure_or_a_stop_ends_the_work() {
        let stop = AtomicBool::new(false);
        let done = AtomicUsize::new(0);
        let units: Vec<usize> = (0..1000).collect();
        let failing = |&unit: &usize| {
            done.fetch_add(1, Ordering::Relaxed);
            if unit == 3 { Err(Error::input("unit 3")) } else { Ok(()) }
        };
        let error = for_each(&context(&stop), &units, 1, failing).unwrap_err();
        assert_eq!((error.kind(), done.into_inner()), (ErrorKind::Input, 4));
        stop.store(true, Ordering::Relaxed);
        let error = for_each(&context(&stop), &units, 2, |_| Ok(())).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Stopped);
    }

    #[test]
    fn memory_bounds_the_units_in_flight() {
        let stop = AtomicBool::new(false);
        let in_flight = |bytes| in_flight(&context(&stop), "a unit", bytes);
        assert_eq!([10, 30, 60, 100].map(|bytes| in_flight(bytes).unwrap()), [4, 3, 1, 1]);
        assert_eq!(in_flight(101).unwrap_err().kind(), ErrorKind::Usage);
    }
}
