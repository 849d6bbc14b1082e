//! Makes several enlargements of one model, each from another seed, so that they show different pieces of the same
//! material.
//!
//!     cargo run --release --example enlarge_many -- wood.model.zarr pieces 4
#![allow(clippy::print_stdout)]

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use btfkit::run::Context;
use btfkit::run::progress::Silent;
use btfkit::shape::Size;
use btfkit::stage::enlarge;
use btfkit::{Error, Result};

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [model, folder, count] => {
            let count = count.parse().map_err(|_| Error::usage(format!("expected a number, got {count}")))?;
            enlarge_many(Path::new(model), Path::new(folder), count).map(|_| ())
        }
        _ => Err(Error::usage("expected a model, a folder, and a number of enlargements")),
    }
}

/// Makes `count` enlargements of 512 x 512 texels in a folder, and returns where they are.
pub fn enlarge_many(model: &Path, folder: &Path, count: u64) -> Result<Vec<PathBuf>> {
    let stop = AtomicBool::new(false);
    let context = Context::new(&Silent, &stop, 2, 1 << 30)?;
    let mut made = Vec::new();
    for seed in 1..=count {
        let output = folder.join(format!("piece-{seed}.zarr"));
        let options = enlarge::Options::new(model, &output, Size::new(512, 512));
        enlarge::plan(&enlarge::Options { seeds: seed..=seed, ..options })?.run(&context)?;
        println!("{}", output.display());
        made.push(output);
    }
    Ok(made)
}
