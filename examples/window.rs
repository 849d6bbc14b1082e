//! A window of a model's endless plane: which texel of the tile each of its texels is.
//!
//! ```text
//! cargo run --release --example window -- MODEL Y X HEIGHT WIDTH SEED [JITTER [JOINS_HEIGHT JOINS_WIDTH]] > texels
//! ```
//!
//! Writes row * width + column of the tile, u32, little endian, row by row. JITTER is in parts of 256; of a surface that
//! joins at its own borders the sides are given too.

use std::io::Write;
use std::path::Path;

use btfkit::coherent::{Plane, Variation};
use btfkit::error::{Error, Result};
use btfkit::kernel::Kernel;
use btfkit::shape::Size;
use btfkit::store::model::Model;

fn main() -> std::process::ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let written = window(&arguments).and_then(|texels| {
        let bytes: Vec<u8> = texels.iter().flat_map(|texel| texel.to_le_bytes()).collect();
        std::io::stdout().write_all(&bytes).map_err(|error| Error::internal(error.to_string()))
    });
    match written {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "{error}");
            std::process::ExitCode::FAILURE
        }
    }
}

fn window(arguments: &[String]) -> Result<Vec<u32>> {
    let usage = || Error::usage("MODEL Y X HEIGHT WIDTH SEED [JITTER [JOINS_HEIGHT JOINS_WIDTH]]");
    let numbers: Vec<i64> = arguments
        .iter()
        .skip(1)
        .map(|text| text.parse())
        .collect::<std::result::Result<_, _>>()
        .map_err(|_| usage())?;
    let &[y, x, height, width, seed, ref more @ ..] = &numbers[..] else { return Err(usage()) };
    let size = |height: i64, width: i64| Size::new(height.max(0) as usize, width.max(0) as usize);
    let model = Model::open(Path::new(&arguments[0]))?;
    let plane = Plane::new(model.tile()?.size, &model.index()?, &model.appearance()?, Kernel::fastest())?;
    let mut variation: Variation = plane.variation(seed as u32);
    match more {
        [] => {}
        [jitter] => variation.jitter = *jitter as u32,
        [jitter, joins @ ..] => {
            variation.jitter = *jitter as u32;
            let &[height, width] = joins else { return Err(usage()) };
            variation.wrap = Some(size(height, width));
        }
    }
    plane.window(&variation, y, x, size(height, width))
}
