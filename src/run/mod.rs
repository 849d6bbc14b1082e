//! What makes long work survive: units that are done or not, recipes that tell results apart,
//! progress, and stopping on request.

pub mod budget;
pub mod progress;
pub(crate) mod read_ahead;
pub mod recipe;
pub mod shard;
pub mod units;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::error::{Error, Result};
use crate::run::budget::Allowance;
use progress::Progress;

/// What to do about a file that has the name of a result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Existing {
    /// Leave it as it is: found done if it is the result, else refused.
    #[default]
    Keep,
    /// Put the result in its place.
    Replace,
}

/// What every stage is given besides its options.
pub struct Context<'a> {
    /// Told how far the work is.
    pub progress: &'a dyn Progress,
    /// Set from outside to stop the work at the next unit.
    pub stop: &'a AtomicBool,
    /// Threads that the work may use.
    pub threads: usize,
    /// Resident memory that the work may use.
    pub memory_bytes: u64,
    /// What to do about what lies where a result is to be.
    pub existing: Existing,
    memory_by_system: bool,
    memory_enough: AtomicU64,
    follows_up: AtomicBool,
    computing: Arc<AtomicBool>,
    pool: rayon::ThreadPool,
}

impl<'a> Context<'a> {
    /// Starts a pool of `threads` threads.
    pub fn new(
        progress: &'a dyn Progress,
        stop: &'a AtomicBool,
        threads: usize,
        memory_bytes: u64,
    ) -> Result<Self> {
        let threads = threads.max(1);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|error| budget::cannot_start(threads, &error))?;
        Ok(Self {
            progress,
            stop,
            threads,
            memory_bytes,
            existing: Existing::Keep,
            memory_by_system: false,
            memory_enough: AtomicU64::new(0),
            follows_up: AtomicBool::new(false),
            computing: Arc::default(),
            pool,
        })
    }

    /// The same, with results that take the place of what is there.
    #[must_use]
    pub fn with_existing(self, existing: Existing) -> Self {
        Self { existing, ..self }
    }

    /// The same with this memory.
    #[must_use]
    pub fn with_memory(self, memory: Allowance) -> Self {
        Self { memory_bytes: memory.bytes, memory_by_system: memory.by_system, ..self }
    }

    /// Memory that the work may use, the program's own included, and who says so.
    pub fn memory(&self) -> Allowance {
        let enough = self.memory_enough.load(Ordering::Relaxed);
        Allowance { bytes: self.memory_bytes, enough, by_system: self.memory_by_system }
    }

    /// Takes note of what is enough for all that is to be done, so that it is told at once where memory is short.
    pub fn tell_enough(&self, bytes: u64) {
        self.memory_enough.store(bytes, Ordering::Relaxed);
    }

    /// Takes note that every usual stage of a model follows in this run, so that none of them need be asked for.
    pub fn tell_follow_up(&self) {
        self.follows_up.store(true, Ordering::Relaxed);
    }

    /// Whether that was told.
    pub(crate) fn follows_up(&self) -> bool {
        self.follows_up.load(Ordering::Relaxed)
    }

    /// An error of kind `Stopped` once a stop has been asked for.
    pub fn check_stop(&self) -> Result<()> {
        if self.stop.load(Ordering::Relaxed) { Err(Error::stopped()) } else { Ok(()) }
    }

    /// Checks that a stage gets the memory that it cannot do without, beside that of the program itself.
    ///
    /// # Errors
    /// As [`Allowance::require`].
    pub fn require(&self, what: &str, bytes: u64) -> Result<()> {
        self.memory().require(what, bytes.saturating_add(budget::OWN_BYTES), "")
    }

    /// Memory for the work itself.
    pub(crate) fn work_bytes(&self) -> u64 {
        self.memory_bytes.saturating_sub(budget::OWN_BYTES)
    }

    /// Runs `work` on the pool that may take long, writes nothing and does not look for a stop: while it runs,
    /// [`Self::computing`] is set, and whoever started the program may end it.
    pub(crate) fn compute<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.computing.store(true, Ordering::SeqCst);
        let result = self.install(work);
        self.computing.store(false, Ordering::SeqCst);
        result
    }

    /// Set while there is nothing to lose but time.
    pub fn computing(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.computing)
    }

    /// Runs `work` on the pool.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }
}

/// Starts a thread of a scope.
///
/// # Errors
/// [`Kind::Io`] where the system starts none.
fn spawn<'scope>(
    scope: &'scope std::thread::Scope<'scope, '_>,
    name: &str,
    work: impl FnOnce() + Send + 'scope,
) -> Result<()> {
    let started = std::thread::Builder::new().name(name.to_owned()).spawn_scoped(scope, work);
    started.map(|_| ()).map_err(|error| budget::cannot_start(1, &error))
}
