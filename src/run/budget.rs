//! What `--memory` allows: the program's own share, what a stage needs at least, and what the system leaves.

use crate::error::{Error, ErrorKind, NO_THREADS, Result};
use crate::words::counted;

/// What the program takes before any work: its code, tables, the stacks and buffers of its threads.
pub(crate) const OWN_BYTES: u64 = 12 << 20;

/// The least stack of the main thread.
const STACK_BYTES: u64 = 256 << 10;

/// Memory that the work may use, and who says so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Allowance {
    /// Bytes.
    pub bytes: u64,
    /// What is enough for all that is to be done, where that is known to be more than what is asked for first; else 0.
    pub enough: u64,
    /// Whether the system leaves no more (`ulimit -v`), whatever `--memory` says.
    pub by_system: bool,
}

impl Allowance {
    /// What `--memory` allows and the system leaves.
    pub fn new(option_bytes: u64) -> Self {
        match address_space_left() {
            Some(left) if left < option_bytes => Self { bytes: left, enough: 0, by_system: true },
            _ => Self { bytes: option_bytes, enough: 0, by_system: false },
        }
    }

    /// Checks what cannot be done without against what is allowed. `otherwise` is what else helps, if anything does.
    ///
    /// # Errors
    /// With what it needs and what to do: [`ErrorKind::Usage`], or [`ErrorKind::Internal`] where the system leaves no
    /// more.
    pub fn require(self, what: &str, needed: u64, otherwise: &str) -> Result<()> {
        let needed = needed.max(OWN_BYTES);
        if needed <= self.bytes {
            return Ok(());
        }
        let mib = needed.div_ceil(1 << 20);
        let found = format!("{what} takes {mib} MiB of memory, {} allowed", amount(self.bytes));
        let or = if otherwise.is_empty() { String::new() } else { format!("; or {otherwise}") };
        Err(if self.by_system {
            Error::new(ErrorKind::Internal, format!("{found} by the limit of the address space"))
                .hint(format!("raise that limit (ulimit -v){or}"))
        } else {
            Error::usage(found).hint(match self.enough.div_ceil(1 << 20) {
                enough if enough > mib => {
                    format!("--memory {enough}MiB, or more, allows it and what follows{or}")
                }
                _ => format!("--memory {mib}MiB, or more, allows it{or}"),
            })
        })
    }
}

/// An allowance, of which parts are taken one after the other by what stays in memory.
#[derive(Clone, Copy, Debug)]
pub struct Room {
    allowance: Allowance,
    taken: u64,
}

impl Room {
    /// All that is allowed, beside what the program itself takes.
    pub fn new(allowance: Allowance) -> Self {
        Self { allowance, taken: OWN_BYTES }
    }

    /// Checks that there is room for so many bytes beside what is taken already.
    ///
    /// # Errors
    /// As [`Allowance::require`].
    pub fn require(&self, what: &str, bytes: u64) -> Result<()> {
        let beside = if self.taken > OWN_BYTES { ", with all that is beside it," } else { "" };
        self.allowance.require(&format!("{what}{beside}"), self.taken.saturating_add(bytes), "")
    }

    /// Takes so many bytes.
    ///
    /// # Errors
    /// As [`Self::require`].
    pub fn take(&mut self, what: &str, bytes: u64) -> Result<()> {
        self.require(what, bytes)?;
        self.taken = self.taken.saturating_add(bytes);
        Ok(())
    }

    /// Gives back so many bytes that were taken.
    pub fn give_back(&mut self, bytes: u64) {
        self.taken = self.taken.saturating_sub(bytes).max(OWN_BYTES);
    }

    /// Bytes that are left.
    pub fn left(&self) -> u64 {
        self.allowance.bytes.saturating_sub(self.taken)
    }
}

/// `64 MiB are`, in whole units, rounded down.
fn amount(bytes: u64) -> String {
    let (number, unit) = match bytes {
        0..1024 => return format!("{} {}", counted(bytes, "byte"), if bytes == 1 { "is" } else { "are" }),
        1024..0x10_0000 => (bytes >> 10, "KiB"),
        _ => (bytes >> 20, "MiB"),
    };
    format!("{number} {unit} {}", if number == 1 { "is" } else { "are" })
}

/// The error of threads that the system does not start.
pub fn cannot_start(threads: usize, error: &dyn std::fmt::Display) -> Error {
    Error::new(ErrorKind::Io, format!("cannot start {}: {error}", counted(threads, "thread")))
        .hint(NO_THREADS)
}

/// Bytes that the process may still map where its address space is limited (`ulimit -v`); half of what is left, since
/// what is mapped is more than what is used.
#[allow(clippy::disallowed_methods)] // the system's own files
pub(crate) fn address_space_left() -> Option<u64> {
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let used = std::fs::read_to_string("/proc/self/statm").ok()?;
    space_left(&limits, &used)
}

/// Checks that the main thread has a stack to work on (`ulimit -s`): without one the program would end without a word.
///
/// # Errors
/// [`ErrorKind::Internal`].
#[allow(clippy::disallowed_methods)] // the system's own files
pub fn expect_stack() -> Result<()> {
    let limits = std::fs::read_to_string("/proc/self/limits").unwrap_or_default();
    match limit(&limits, "Max stack size") {
        Some(bytes) if bytes < STACK_BYTES => {
            let found =
                format!("the stack is limited to {} KiB, {} are needed", bytes >> 10, STACK_BYTES >> 10);
            Err(Error::new(ErrorKind::Internal, found).hint("raise that limit (ulimit -s 8192)"))
        }
        _ => Ok(()),
    }
}

/// A limit of the process, of its table of limits; none where there is no limit.
fn limit(limits: &str, name: &str) -> Option<u64> {
    limits.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
}

/// Lets all threads allocate from one arena: each of its own reserves 64 MiB of address space, so that with `ulimit -v`
/// little remains to be used. To be called before threads are started.
pub fn spare_address_space() {
    const M_ARENA_MAX: i32 = -8;
    tune_allocator(M_ARENA_MAX, 1);
}

/// Lets large buffers go back to the system when they are freed. Left alone, glibc raises its threshold to the size of
/// whatever was freed, up to 32 MiB, and takes later buffers out of a heap that shrinks only at its end: memory that is
/// free but resident. To be called before any work.
pub fn return_large_buffers() {
    const M_TRIM_THRESHOLD: i32 = -1;
    const M_MMAP_THRESHOLD: i32 = -3;
    tune_allocator(M_MMAP_THRESHOLD, 1 << 20);
    tune_allocator(M_TRIM_THRESHOLD, 2 << 20);
}

/// Sets a parameter of glibc's allocator; where it is refused, or where there is another allocator, nothing changes.
#[allow(unsafe_code)]
fn tune_allocator(parameter: i32, value: i32) {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        unsafe extern "C" {
            safe fn mallopt(parameter: i32, value: i32) -> i32;
        }
        let _ = mallopt(parameter, value);
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    let _ = (parameter, value);
}

fn space_left(limits: &str, used: &str) -> Option<u64> {
    const PAGE_BYTES: u64 = 4096;
    let limit = limit(limits, "Max address space")?;
    let pages: u64 = used.split_whitespace().next()?.parse().ok()?;
    Some(limit.saturating_sub(pages * PAGE_BYTES) / 2)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_limit_of_the_address_space_is_read_and_none_is_none() {
        let limits = |soft: &str| {
            format!("Limit Soft Hard Units\nMax address space         {soft}   unlimited   bytes\n")
        };
        assert_eq!(space_left(&limits("409600000"), "50000 1 1"), Some((409_600_000 - 204_800_000) / 2));
        assert_eq!(space_left(&limits("unlimited"), "50000 1 1"), None);
    }

    #[test]
    fn what_is_needed_is_said() {
        let by = |bytes, by_system| {
            Allowance { bytes, enough: 0, by_system }.require("a tile", 70 << 20, "make it smaller")
        };
        let told = |bytes| by(bytes, false).unwrap_err().to_string();
        assert_eq!(told(64 << 20), "a tile takes 70 MiB of memory, 64 MiB are allowed");
        assert_eq!(told(1 << 20), "a tile takes 70 MiB of memory, 1 MiB is allowed");
        assert_eq!(told(2500), "a tile takes 70 MiB of memory, 2 KiB are allowed");
        assert_eq!(told(1), "a tile takes 70 MiB of memory, 1 byte is allowed");
        assert_eq!(told(0), "a tile takes 70 MiB of memory, 0 bytes are allowed");
        let hint = by(1, false).unwrap_err().guidance().unwrap().to_owned();
        assert_eq!(hint, "--memory 70MiB, or more, allows it; or make it smaller");
        let error = by(64 << 20, true).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Internal);
        let hint = error.guidance().unwrap();
        assert!(hint.contains("ulimit -v") && !hint.contains("--memory"), "{hint}");
        assert!(by(70 << 20, false).is_ok());
    }
}
