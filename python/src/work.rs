//! Runs what takes long: on a thread of its own, without Python's lock, while the caller's thread tells the progress
//! and looks for Ctrl-C.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use btfkit::run::progress::{Counted, Progress, Stage};
use btfkit::run::{Context, Existing};
use btfkit::{Error, Result};
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;

use crate::errors::or_raise;

/// How often progress is told and Ctrl-C is looked for.
const INTERVAL: Duration = Duration::from_millis(50);

/// Memory that work may use unless it is told otherwise, as for the program.
const MEMORY_BYTES: u64 = 1 << 30;

/// What work may use, and whom it tells.
#[derive(Default)]
pub(crate) struct Terms {
    /// Called with the step, how much of it is done, and how much there is.
    pub(crate) progress: Option<Py<PyAny>>,
    /// All processors where absent.
    pub(crate) threads: Option<usize>,
    /// Bytes.
    pub(crate) memory: Option<u64>,
    /// Whether results that exist are replaced.
    pub(crate) force: bool,
}

/// What the work tells, for the caller's thread to hand on.
#[derive(Default)]
struct Told {
    step: Mutex<Step>,
    done: AtomicU64,
    notices: Mutex<Vec<String>>,
}

#[derive(Clone, Default, PartialEq)]
struct Step {
    stage: Option<Stage>,
    title: String,
    total: u64,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Progress for Told {
    fn begin(&self, title: &str, total: u64, _: Counted) {
        let mut step = lock(&self.step);
        title.clone_into(&mut step.title);
        step.total = total;
        self.done.store(0, Ordering::Relaxed);
    }

    fn advance(&self, count: u64) {
        self.done.fetch_add(count, Ordering::Relaxed);
    }

    fn remark(&self, _: &str) {}

    fn end(&self) {}

    fn notice(&self, text: &str) {
        lock(&self.notices).push(text.to_owned());
    }

    fn stage(&self, stage: Option<Stage>) {
        lock(&self.step).stage = stage;
    }
}

impl Told {
    /// Hands on what is new: notices as warnings, and the step, where it or its count is not as `last` has it.
    fn tell(&self, py: Python<'_>, to: Option<&Py<PyAny>>, last: &mut (Step, u64)) -> PyResult<()> {
        for notice in std::mem::take(&mut *lock(&self.notices)) {
            warn(py, &notice)?;
        }
        let Some(to) = to else { return Ok(()) };
        let now = (lock(&self.step).clone(), self.done.load(Ordering::Relaxed));
        if now != *last && !now.0.title.is_empty() {
            let Step { stage, title, total } = &now.0;
            let name = stage.map_or_else(|| title.clone(), |stage| format!("{stage}, {title}"));
            to.call1(py, (name, now.1.min(*total), *total))?;
            *last = now;
        }
        Ok(())
    }
}

/// A `UserWarning`.
pub(crate) fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    let text = std::ffi::CString::new(text.replace('\0', "\\0"))?;
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)
}

/// Runs `act` to its end, or until Ctrl-C or an exception of the progress function stops it; that exception is raised
/// then, and the same call goes on where the work was left.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    terms: &Terms,
    act: impl FnOnce(&Context<'_>) -> Result<T> + Send,
) -> PyResult<T> {
    let (stop, told) = (AtomicBool::new(false), Told::default());
    let threads =
        terms.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    let existing = if terms.force { Existing::Replace } else { Existing::Keep };
    let memory = terms.memory.unwrap_or(MEMORY_BYTES);
    let (mut exception, mut last) = (None, (Step::default(), 0));
    let result = py.detach(|| {
        let (sender, receiver) = channel();
        std::thread::scope(|scope| {
            let (told, stop) = (&told, &stop);
            let worker =
                std::thread::Builder::new().name("btfkit".to_owned()).spawn_scoped(scope, move || {
                    let result = Context::new(told, stop, threads, memory)
                        .map(|context| context.with_existing(existing))
                        .and_then(|context| act(&context));
                    // The receiver lives as long as the scope.
                    let _ = sender.send(result);
                });
            if let Err(error) = worker {
                return Err(Error::internal(format!("cannot start a thread: {error}")));
            }
            loop {
                match receiver.recv_timeout(INTERVAL) {
                    Ok(result) => return result,
                    Err(RecvTimeoutError::Disconnected) => {
                        return Err(Error::internal(
                            "a fault of btfkit; what it said stands on standard error",
                        ));
                    }
                    Err(RecvTimeoutError::Timeout) if exception.is_some() => {}
                    Err(RecvTimeoutError::Timeout) => {
                        let heard = Python::attach(|py| {
                            py.check_signals()?;
                            told.tell(py, terms.progress.as_ref(), &mut last)
                        });
                        if let Err(error) = heard {
                            exception = Some(error);
                            stop.store(true, Ordering::Relaxed);
                        }
                    }
                }
            }
        })
    });
    if let Some(exception) = exception {
        return Err(exception);
    }
    let value = or_raise(py, result)?;
    told.tell(py, terms.progress.as_ref(), &mut last)?;
    Ok(value)
}
