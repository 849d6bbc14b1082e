//! Runs units of work, each done or not done, with a bounded number in flight.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::error::Result;
use crate::run::Context;

/// Units that may be in flight: one a thread, fewer where memory does not allow it, at least one.
pub fn in_flight(context: &Context<'_>, unit_bytes: u64) -> usize {
    let affordable = context.memory_bytes / unit_bytes.max(1);
    (context.threads.max(1) as u64).min(affordable).max(1) as usize
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
    std::thread::scope(|scope| {
        for _ in 0..in_flight.max(1) {
            scope.spawn(|| {
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
            });
        }
    });
    let mut results = results.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    results.sort_by_key(|(number, _)| *number);
    results.into_iter().map(|(_, result)| result).collect()
}
