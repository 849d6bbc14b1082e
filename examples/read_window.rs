//! Reads a window of an enlargement and prints the mean colour of its texels for a view and a light.
//!
//!     cargo run --release --example read_window -- big.zarr wood.model.zarr
#![allow(clippy::print_stdout)]

use std::path::Path;

use btfkit::shape::{Size, Window};
use btfkit::stage::image;
use btfkit::store::enlarged::Enlarged;
use btfkit::store::model::Model;
use btfkit::{Direction, Error, Result};

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [enlarged, model] => {
            let [view, light] = [Direction::from_degrees(0.0, 0.0), Direction::from_degrees(30.0, 90.0)];
            let window = Window { y: 100, x: 200, size: Size::new(64, 64) };
            let [r, g, b] = mean_color(Path::new(enlarged), Path::new(model), window, view, light)?;
            println!("linear RGB {r:.4} {g:.4} {b:.4}");
            Ok(())
        }
        _ => Err(Error::usage("expected an enlargement and its model")),
    }
}

/// Mean linear RGB of the texels of a window; only the chunks that it touches are read.
pub fn mean_color(
    enlarged: &Path,
    model: &Path,
    window: Window,
    view: Direction,
    light: Direction,
) -> Result<[f32; 3]> {
    let index = Enlarged::open(enlarged)?.read(window)?;
    let colors = image::cluster_colors(&Model::open(model)?, view, light)?;
    let mut sum = [0.0; 3];
    for &cluster in &index {
        for (sum, value) in sum.iter_mut().zip(colors[usize::from(cluster)]) {
            *sum += value / index.len() as f32;
        }
    }
    Ok(sum)
}
