//! A list of images, each with a direction to the viewer and one to the light (NeuralBTF's files).

use std::ops::Range;

use btfkit_formats::{Assumption, Contents, Limits, SampleType};
use hdf5::H5Type;

use super::dataset::{File, Table, side};
use super::grid::Grid;
use crate::error::{Error, Result};
use crate::words::counted;

/// The samples, [image, y, x, channel].
pub(super) const COLOR: &str = "ground_color";
const LIGHT: &str = "ground_light";
const VIEW: &str = "ground_camera_dir";

/// Images by their number in the list.
pub(super) struct ImageList {
    color: Table,
    grid: Grid,
}

impl ImageList {
    pub(super) fn open(file: &File, limits: &Limits) -> Result<(Self, Contents)> {
        let color = file.table(COLOR, limits)?;
        let pixels = limits.max_pixels_per_image;
        let [count, height, width, channels] = color.extents([
            ("image", limits.max_entries),
            ("y", pixels),
            ("x", pixels),
            ("channel", limits.max_channels),
        ])?;
        if channels != 3 {
            return Err(color.error(format!("got {}, expected R, G, B", counted(channels, "channel"))));
        }
        if color.sample_type()? != SampleType::F32 {
            return Err(color.error("expected samples of type float32"));
        }
        let views = read_directions(file, VIEW, count, limits)?;
        let lights = read_directions(file, LIGHT, count, limits)?;
        let grid = Grid::of(&views, &lights, limits).map_err(|what| file.error(what))?;
        let contents = Contents {
            format: format!("HDF5, list of {}", counted(count, "image")),
            width: side(width, &color)?,
            height: side(height, &color)?,
            channels: ["R", "G", "B"].map(str::to_owned).to_vec(),
            sample_type: SampleType::F32,
            views: grid.views.clone(),
            lights: grid.lights.clone(),
            linear: true,
            cosine_included: true,
            assumptions: vec![
                Assumption::azimuths(
                    "Directions are taken to be x right and y up in the picture, towards light and viewer.",
                ),
                "Row 0 of an image is taken to be the top.".into(),
                Assumption::cosine("The cosine of the light's angle is taken to be in the samples."),
            ],
            remarks: Vec::new(),
        };
        Ok((Self { color, grid }, contents))
    }

    /// Appends a window of the images of a view, [light, y, x, channel]. Neighbours in the list are read at once.
    pub(super) fn read_images<T: H5Type>(
        &self,
        view: usize,
        lights: Range<usize>,
        [y, x]: [Range<usize>; 2],
    ) -> Result<Vec<T>> {
        let images: Vec<usize> = lights.map(|light| self.grid.image(view, light)).collect();
        let mut samples = Vec::new();
        for run in images.chunk_by(|a, b| a + 1 == *b) {
            let &[first, ..] = run else { continue };
            samples.extend(self.color.read::<T>(&[first..first + run.len(), y.clone(), x.clone(), 0..3])?);
        }
        Ok(samples)
    }
}

/// x and y of the directions of all images.
fn read_directions(file: &File, name: &'static str, count: usize, limits: &Limits) -> Result<Vec<[f64; 2]>> {
    let table = file.table(name, limits)?;
    match *table.shape() {
        [n, 2] if n == count => Ok(table.read_floats()?.chunks_exact(2).map(|xy| [xy[0], xy[1]]).collect()),
        [_, _, _, ..] => Err(near_field(&table)),
        _ => Err(table.error(format!("got the shape {:?}, expected [{count}, 2]", table.shape()))),
    }
}

fn near_field(table: &Table) -> Error {
    table.error(format!(
        "got the shape {:?}: a direction for every pixel (near-field), expected one for every image",
        table.shape()
    ))
}
