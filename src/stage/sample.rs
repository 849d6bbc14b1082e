//! A synthetic measurement in UBO2003's layout, so that everything after it starts from an archive.

use std::path::PathBuf;

use btfkit_formats::jpeg::{EncodeOptions, encode};
use btfkit_formats::ubo2003::{Angles, directions_81, write_name};
use btfkit_formats::zip::ZipWriter;
use rayon::prelude::*;

use crate::disk::output::{self, Made};
use crate::error::{Error, Result};
use crate::run::Context;
use crate::run::progress::Counted;
use crate::sample::{MaterialKind, Scene, Surface};
use crate::shape::Size;
use crate::words::counted;

/// Memory of a texel of the surface beside its images (measured).
const TEXEL_BYTES: u64 = 500;

/// What to make.
#[derive(Clone, Debug)]
pub struct Options {
    /// The zip to write.
    pub archive: PathBuf,
    /// Which material.
    pub kind: MaterialKind,
    /// Rows and columns of its images.
    pub size: Size,
    /// Number of view directions; 81 are UBO2003's.
    pub views: usize,
    /// Number of light directions.
    pub lights: usize,
    /// Seed of the material.
    pub seed: u64,
    /// Size of its features relative to the default.
    pub scale: f64,
}

impl Options {
    /// Leather of 128 x 128 texels under the 81 x 81 directions of UBO2003, seed 1.
    pub fn new(archive: impl Into<PathBuf>) -> Self {
        Self {
            archive: archive.into(),
            kind: MaterialKind::Leather,
            size: Size::new(128, 128),
            views: 81,
            lights: 81,
            seed: 1,
            scale: 1.0,
        }
    }
}

/// What was made.
#[derive(Clone, Debug)]
pub struct Report {
    /// Whether it was there already.
    pub made: Made,
    /// Number of images.
    pub images: usize,
    /// Bytes of the archive.
    pub bytes: u64,
}

/// Directions on UBO2003's rings: its own list for 81, else the pole and as many a ring as its
/// circumference asks for, at whole degrees as the names demand.
pub fn directions(count: usize) -> Result<Vec<Angles>> {
    const RINGS_DEG: [f64; 5] = [15.0, 30.0, 45.0, 60.0, 75.0];
    const MOST: usize = 600;
    if count == 81 {
        return Ok(directions_81());
    }
    if !(1..=MOST).contains(&count) {
        return Err(Error::usage(format!("{count} directions were asked for, expected 1 to {MOST}")));
    }
    let total: f64 = RINGS_DEG.iter().map(|theta| libm::sin(theta.to_radians())).sum();
    let mut angles = vec![(0.0, 0.0)];
    let (mut asked, mut given) = (0.0, 0);
    for (number, theta) in RINGS_DEG.into_iter().enumerate() {
        asked += libm::sin(theta.to_radians()) / total * (count - 1) as f64;
        let ring = asked.round() as usize - given;
        given += ring;
        // Rings of few directions are turned against each other, so that they do not all lie in one plane.
        let turn = 0.382 * number as f64;
        angles.extend((0..ring).map(|k| (theta, (360.0 * (k as f64 + turn) / ring as f64).round() % 360.0)));
    }
    angles
        .into_iter()
        .map(|(theta, phi)| Angles::new(theta, phi).ok_or_else(|| Error::internal("an angle out of range")))
        .collect()
}

/// Renders the material and writes the archive; it appears whole or not at all.
///
/// # Errors
/// [`crate::ErrorKind::Recipe`] where another file is.
pub fn run(options: &Options, context: &Context<'_>) -> Result<Report> {
    let (views, lights) = (directions(options.views)?, directions(options.lights)?);
    let radians = |angles: &Angles| [angles.theta_deg().to_radians(), angles.phi_deg().to_radians()];
    let Size { height, width } = options.size;
    let texels = options.size.texels() as u64;
    let needed = texels * (TEXEL_BYTES + 2 * 3 * lights.len() as u64);
    context
        .require(&format!("a sample of {} under {}", options.size, counted(lights.len(), "light")), needed)?;
    let surface = Surface::new(options.kind, width, height, options.scale, options.seed)?;
    let light_angles: Vec<[f64; 2]> = lights.iter().map(radians).collect();
    context.progress.begin("sample", (views.len() * lights.len()) as u64, Counted::Items("images"));
    let scene = context.install(|| Scene::new(surface, &light_angles));

    let made = output::write_whole(&options.archive, context.existing, |output| {
        let mut zip = ZipWriter::new(output);
        for (number, view) in views.iter().enumerate() {
            context.check_stop()?;
            let images = context.install(|| {
                let points = scene.view(number as u32, radians(view));
                (0..lights.len())
                    .into_par_iter()
                    .map(|light| {
                        let samples = points.image(light).ok_or_else(|| Error::internal("no such light"))?;
                        let bytes =
                            encode(&samples, width as u32, height as u32, 3, &EncodeOptions::UBO2003)?;
                        context.progress.advance(1);
                        Ok(bytes)
                    })
                    .collect::<Result<Vec<Vec<u8>>>>()
            })?;
            for (light, bytes) in images.iter().enumerate() {
                let name = write_name(light as u32, lights[light], number as u32, *view, views.len() as u32)?;
                zip.write_entry(&name, bytes)?;
            }
        }
        zip.finish()?;
        Ok(())
    })?;
    context.progress.end();
    let bytes = std::fs::metadata(&options.archive);
    let bytes = bytes.map_err(|error| Error::io("read", &options.archive, error))?.len();
    Ok(Report { made, images: views.len() * lights.len(), bytes })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::method::stereo::Stereo;
    use btfkit_formats::Direction;

    #[test]
    fn any_number_of_directions_is_distinct_and_from_seven_on_they_span_space() {
        for count in [1, 2, 7, 9, 13, 25, 80, 81, 82, 151, 600] {
            let mut angles = directions(count).unwrap();
            let lights: Vec<Direction> =
                angles.iter().map(|a| Direction::from_degrees(a.theta_deg(), a.phi_deg())).collect();
            assert_eq!(angles.len(), count);
            assert!(count < 7 || Stereo::new(&lights).is_ok(), "{count} directions lie in one plane");
            angles.sort();
            angles.dedup();
            assert_eq!(angles.len(), count);
        }
        assert!(directions(601).is_err());
    }
}
