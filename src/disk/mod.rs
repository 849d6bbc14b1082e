//! Files, whatever is in them: mapped to be read, written whole or not at all, locked between processes.
//!
//! Nothing here knows what a file holds.

pub mod lock;
pub mod mapped;
pub mod output;
pub mod temporary;

/// The name of this host as temporary files bear it.
#[allow(clippy::disallowed_methods)] // a file of the system's own
pub fn host() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let name: String =
        name.trim().chars().map(|c| if c.is_ascii_alphanumeric() || c == '.' { c } else { '_' }).collect();
    if name.is_empty() { "host".to_owned() } else { name }
}
