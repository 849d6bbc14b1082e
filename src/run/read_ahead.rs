//! Reads the next items while one is in use: two stations, a bounded channel between them.
//!
//! Values come in the order of the items, so no result depends on who was faster.

use crossbeam_channel::bounded;

use crate::error::Result;
use crate::run::{Context, spawn};

/// Values in flight where memory allows it: one in use, the next one being read or waiting for its turn.
pub(crate) const IN_FLIGHT: usize = 2;

/// Values that may be in flight: [`IN_FLIGHT`], or 1 where memory does not hold so many of `value_bytes`.
pub(crate) fn in_flight(allowed_bytes: u64, value_bytes: u64) -> usize {
    if value_bytes.saturating_mul(IN_FLIGHT as u64) <= allowed_bytes { IN_FLIGHT } else { 1 }
}

/// Gives `work` what `read` makes of the items, in their order. At most `in_flight` values exist at any time, the one
/// that `work` has in hand included; with 1 each is read when it is asked for.
///
/// `read` runs on the pool, `work` on the calling thread; called on a thread of a pool, items are read when asked for,
/// since waiting there would keep `read` from running. After an error nothing more is read. `work` may end before the
/// items do.
///
/// # Errors
/// Those of `work`, which is given those of `read`, and [`crate::ErrorKind::Stopped`] once a stop is asked for;
/// [`crate::ErrorKind::Io`] where the system starts no thread.
pub(crate) fn with<I: Send, T: Send, R>(
    context: &Context<'_>,
    in_flight: usize,
    items: impl IntoIterator<Item = I, IntoIter: Send>,
    mut read: impl FnMut(I) -> Result<T> + Send,
    work: impl FnOnce(&mut dyn Iterator<Item = Result<T>>) -> Result<R>,
) -> Result<R> {
    let mut failed = false;
    let mut values = items.into_iter().map_while(move |item| {
        if failed {
            return None;
        }
        let value = context.check_stop().and_then(|()| context.install(|| read(item)));
        failed = value.is_err();
        Some(value)
    });
    let Some(waiting) = in_flight.checked_sub(2).filter(|_| rayon::current_thread_index().is_none()) else {
        return work(&mut values);
    };
    // Beside those that wait, one is in use and one is being read.
    let (sender, receiver) = bounded(waiting);
    std::thread::scope(|scope| {
        spawn(scope, "read ahead", move || {
            // Nobody listens any more once the work has ended.
            values.try_for_each(|value| sender.send(value)).ok();
        })?;
        work(&mut receiver.into_iter())
    })
}

/// [`with`] for work that takes one value after the other.
///
/// # Errors
/// Those of [`with`].
pub(crate) fn for_each<I: Send, T: Send>(
    context: &Context<'_>,
    in_flight: usize,
    items: impl IntoIterator<Item = I, IntoIter: Send>,
    read: impl FnMut(I) -> Result<T> + Send,
    mut each: impl FnMut(T) -> Result<()>,
) -> Result<()> {
    with(context, in_flight, items, read, |values| {
        for value in values {
            each(value?)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::error::{Error, ErrorKind};
    use crate::run::progress::Silent;
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

    fn context(stop: &AtomicBool) -> Context<'_> {
        Context::new(&Silent, stop, 1, 1 << 20).unwrap()
    }

    #[test]
    fn values_come_in_order_and_the_next_is_read_while_one_is_in_use() {
        let stop = AtomicBool::new(false);
        let (begun, wait) = bounded(100);
        let mut found = Vec::new();
        let read = |item: usize| {
            begun.send(item).unwrap();
            Ok(10 * item)
        };
        for_each(&context(&stop), 2, 0..100, read, |value| {
            found.push(value);
            // Hangs unless the next item is begun before this one's work ends.
            while found.len() < 100 && wait.recv().unwrap() != found.len() {}
            Ok(())
        })
        .unwrap();
        assert_eq!(found, (0..100).map(|item| 10 * item).collect::<Vec<_>>());
    }

    /// A value that is counted while it lives.
    struct Counted<'a>(&'a AtomicUsize);

    impl Drop for Counted<'_> {
        fn drop(&mut self) {
            self.0.fetch_sub(1, Ordering::SeqCst);
        }
    }

    #[test]
    fn no_more_values_exist_than_may_be_in_flight() {
        let stop = AtomicBool::new(false);
        for in_flight in 1..5 {
            let (alive, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
            let read = |_: usize| {
                most.fetch_max(alive.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                Ok(Counted(&alive))
            };
            let slow = |value: Counted<'_>| {
                std::thread::sleep(std::time::Duration::from_micros(100));
                drop(value);
                Ok(())
            };
            for_each(&context(&stop), in_flight, 0..200, read, slow).unwrap();
            assert!(most.into_inner() <= in_flight);
            assert_eq!(alive.into_inner(), 0);
        }
    }

    #[test]
    fn whoever_fails_ends_both_stations() {
        let stop = AtomicBool::new(false);
        for in_flight in 1..4 {
            let read = AtomicUsize::new(0);
            let count = |item: usize| {
                read.fetch_add(1, Ordering::SeqCst);
                if item == 5 { Err(Error::input("item 5")) } else { Ok(item) }
            };
            let mut used = 0;
            let error = for_each(&context(&stop), in_flight, 0..1000, count, |_| {
                used += 1;
                Ok(())
            });
            assert_eq!((error.unwrap_err().to_string(), used), ("item 5".to_owned(), 5));
            assert_eq!(read.swap(0, Ordering::SeqCst), 6);
            let error = for_each(&context(&stop), in_flight, 0..1000, count, |_| Err(Error::usage("work")));
            assert_eq!(error.unwrap_err().kind(), ErrorKind::Usage);
            assert!(read.into_inner() <= in_flight.max(2));
        }
    }

    #[test]
    fn a_stop_ends_the_reading_and_an_early_end_is_none_of_an_error() {
        let stop = AtomicBool::new(false);
        for in_flight in 1..4 {
            let first = with(&context(&stop), in_flight, 0.., Ok, |values| values.next().unwrap());
            assert_eq!(first.unwrap(), 0);
            let stopping = |item: usize| {
                stop.store(item == 3, Ordering::SeqCst);
                Ok(item)
            };
            let error = for_each(&context(&stop), in_flight, 0.., stopping, |_| Ok(())).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Stopped);
            stop.store(false, Ordering::SeqCst);
        }
    }

    #[test]
    fn on_a_thread_of_the_pool_nothing_waits_for_the_pool() {
        let stop = AtomicBool::new(false);
        let context = context(&stop);
        let mut sum = 0;
        context.install(|| {
            for_each(&context, 3, 0..10, Ok, |item| {
                sum += item;
                Ok(())
            })
            .unwrap();
        });
        assert_eq!(sum, 45);
    }

    #[test]
    fn where_memory_does_not_hold_two_one_is_in_flight() {
        assert_eq!([10, 50, 51, 1000].map(|bytes| in_flight(100, bytes)), [2, 2, 1, 1]);
        assert_eq!(in_flight(100, u64::MAX), 1);
    }
}
