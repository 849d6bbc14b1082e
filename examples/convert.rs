//! Converts an archive of pictures, in any format that btfkit reads, into a measurement, and prints what it holds.
//!
//!     cargo run --release --example convert -- UBO_WOOD256.zip wood.zarr
#![allow(clippy::print_stdout)]

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use btfkit::run::Context;
use btfkit::run::progress::Silent;
use btfkit::stage::import;
use btfkit::store::measurement::Measurement;
use btfkit::{Error, Result, archive};

fn main() -> Result<()> {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    match arguments.as_slice() {
        [archive, store] => convert(archive, store),
        _ => Err(Error::usage("expected an archive and the measurement to make")),
    }
}

/// Imports `from` into `store`, and prints its size and directions.
pub fn convert(from: &Path, store: &Path) -> Result<()> {
    let stop = AtomicBool::new(false);
    let context = Context::new(&Silent, &stop, 2, 1 << 30)?;
    let source = archive::open(&[from.to_owned()], &archive::Options::default())?;
    for assumption in &source.contents().assumptions {
        println!("assumed: {assumption}");
    }
    import::plan(source.as_ref(), import::Options::new(store), &context)?.run(&context)?;
    let measurement = Measurement::open(store)?;
    let description = measurement.description();
    println!(
        "{}: {} views x {} lights of {}",
        store.display(),
        description.views.len(),
        description.lights.len(),
        description.size
    );
    Ok(())
}
