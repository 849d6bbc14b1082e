//! What `--memory` allows: the program's own share, what a stage needs at least, and what the system leaves.

use crate::error::{Error, Kind, Result};

/// What the program takes before any work: its code, tables, the stacks and buffers of its threads.
pub const OWN_BYTES: u64 = 12 << 20;

/// Checks what cannot be done without against what is allowed.
///
/// # Errors
/// [`crate::Kind::Usage`], with what it needs.
pub fn require(what: &str, needed: u64, allowed: u64) -> Result<()> {
    if needed <= allowed {
        return Ok(());
    }
    let mib = needed.div_ceil(1 << 20);
    Err(Error::usage(format!("{what} takes {mib} MiB of memory, {} MiB are allowed", allowed >> 20))
        .hint(format!("--memory {mib}MiB, or more, allows it")))
}

/// The error of threads that the system does not start.
pub fn cannot_start(threads: usize, error: &dyn std::fmt::Display) -> Error {
    Error::new(Kind::Io, format!("cannot start {threads} threads: {error}"))
        .hint("choose fewer by --threads, or raise the limits of processes and memory (ulimit -u, ulimit -v)")
}

/// Bytes that the process may still map where its address space is limited (`ulimit -v`); half of what is left, since
/// what is mapped is more than what is used.
#[allow(clippy::disallowed_methods)] // the system's own files
pub fn address_space_left() -> Option<u64> {
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let used = std::fs::read_to_string("/proc/self/statm").ok()?;
    space_left(&limits, &used)
}

fn space_left(limits: &str, used: &str) -> Option<u64> {
    const PAGE_BYTES: u64 = 4096;
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let limit: u64 = line.split_whitespace().next()?.parse().ok()?;
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
        let error = require("a tile", 70 << 20, 64 << 20).unwrap_err();
        assert_eq!(error.to_string(), "a tile takes 70 MiB of memory, 64 MiB are allowed");
        assert!(error.guidance().unwrap().contains("--memory 70MiB"));
        assert!(require("a tile", 64 << 20, 64 << 20).is_ok());
    }
}
