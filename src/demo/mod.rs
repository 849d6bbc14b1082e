//! placeholder
use crate::error::Result;
use crate::run::Context;
use crate::sample::Kind;
use std::path::PathBuf;
/// p
pub struct Options {
    /// p
    pub folder: PathBuf,
    /// p
    pub kind: Kind,
}
/// p
pub fn run(_: &Options, _: &Context<'_>) -> Result<PathBuf> {
    Ok(PathBuf::new())
}
