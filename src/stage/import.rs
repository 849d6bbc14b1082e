//! Archive to measurement: decode the images of a view, transpose them texel by texel, write one shard.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use btfkit_formats::jpeg;
use serde::Serialize;
use serde_json::{Value, json};

use crate::archive::Archive;
use crate::color::{LightnessCodes, Transfer};
use crate::error::{Error, Result};
use crate::run::progress::Counted;
use crate::run::recipe::{self, METHOD};
use crate::run::{Context, units};
use crate::shape::Size;
use crate::store::measurement::{Description, Measurement};
use crate::texel::direction::Direction;

/// Lights decoded before their samples are put in place: writes of 16 x 3 bytes a texel instead of 3.
const LIGHTS_AT_ONCE: usize = 16;

/// Problems that an error names one by one.
const NAMED_PROBLEMS: usize = 20;

/// What to import and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// A zip or a folder.
    pub archive: PathBuf,
    /// The measurement store to make.
    pub store: PathBuf,
    /// Transfer curve of the samples.
    pub transfer: Transfer,
    /// Reflectance that counts as L* = 100.
    pub white: f64,
}

/// An import, ready to run.
pub struct Plan {
    archive: Archive,
    store: PathBuf,
    description: Description,
    recipe: Value,
}

/// How an import went.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Views in the store before this run.
    pub views_found: usize,
    /// Views written by this run.
    pub views_written: usize,
    /// Samples of this run's views brighter than white, stored with the code of L* = 100.
    pub clipped: u64,
}

/// Lists the archive, checks that all images have one size, and fixes the recipe.
pub fn plan(options: &Options) -> Result<Plan> {
    let archive = Archive::open(&options.archive)?;
    let (header, checksums) = check_images(&archive)?;
    let degrees = |angles: &[btfkit_formats::ubo2003::Angles]| -> Vec<[f64; 2]> {
        angles.iter().map(|angles| [angles.theta_deg(), angles.phi_deg()]).collect()
    };
    let direction = |angles: &btfkit_formats::ubo2003::Angles| {
        Direction::from_degrees(angles.theta_deg(), angles.phi_deg())
    };
    let description = Description {
        size: Size::new(header.height as usize, header.width as usize),
        channels: usize::from(header.channels),
        views: archive.catalogue().views().iter().map(direction).collect(),
        lights: archive.catalogue().lights().iter().map(direction).collect(),
        transfer: options.transfer,
        white: options.white,
    };
    let recipe = json!({
        "stage": "import",
        "method": METHOD,
        "layout": "ubo2003",
        "size": [header.height, header.width, u32::from(header.channels)],
        "views": degrees(archive.catalogue().views()),
        "lights": degrees(archive.catalogue().lights()),
        "images": recipe::digest_bytes(&checksums),
        "transfer": options.transfer,
        "white": options.white,
    });
    Ok(Plan { archive, store: options.store.clone(), description, recipe })
}

/// Checks the structure of every image (not its pixels) and that all have one size; returns the first header and
/// the checksums of all, in the order of the directions.
fn check_images(archive: &Archive) -> Result<(jpeg::Header, Vec<u8>)> {
    let (views, lights) = (archive.catalogue().views().len(), archive.catalogue().lights().len());
    let mut first = None;
    let mut checksums = Vec::with_capacity(4 * views * lights);
    let mut problems = Vec::new();
    for (view, light) in (0..views).flat_map(|view| (0..lights).map(move |light| (view, light))) {
        let header = archive.image_bytes(view, light).and_then(|bytes| {
            checksums.extend(archive.checksum(view, light, &bytes).to_le_bytes());
            jpeg::check(&bytes, archive.limits())
                .map_err(|error| error.in_entry(archive.image_name(view, light)).into())
        });
        archive.release(view, light);
        match (header, &first) {
            (Err(error), _) => problems.push(error.to_string()),
            (Ok(header), None) => first = Some(header),
            (Ok(found), Some(expected)) => {
                let shape = |h: &jpeg::Header| (h.width, h.height, h.channels);
                if shape(&found) != shape(expected) {
                    problems.push(format!(
                        "{}: got {}x{} with {} channels, expected {}x{} with {} like the first image",
                        archive.image_name(view, light),
                        found.width,
                        found.height,
                        found.channels,
                        expected.width,
                        expected.height,
                        expected.channels
                    ));
                }
            }
        }
    }
    fail_on(archive.path(), &problems, "replace these images and run the same command again")?;
    let first = first.ok_or_else(|| Error::input(format!("{}: no images", archive.path().display())))?;
    Ok((first, checksums))
}

impl Plan {
    /// What would be done, for people and schedulers.
    pub fn summary(&self) -> Value {
        json!({
            "stage": "import",
            "store": self.store,
            "size": self.description.size.to_string(),
            "views": self.description.views.len(),
            "lights": self.description.lights.len(),
            "channels": self.description.channels,
            "raw_bytes": self.description.bytes(),
            "unit": "view",
            "unit_memory_bytes": self.unit_bytes(),
            "recipe": self.recipe,
        })
    }

    /// What the measurement will hold.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Memory of one view in flight: samples, codes, a group of images, a shard and its encoding.
    fn unit_bytes(&self) -> u64 {
        let view = self.description.view_bytes();
        let images = (self.description.size.texels() * self.description.channels * LIGHTS_AT_ONCE) as u64;
        2 * view + 2 * view / self.description.channels as u64 + images + self.description.shard_bytes()
    }

    /// Imports the views that are not in the store yet.
    pub fn run(&self, context: &Context<'_>) -> Result<Report> {
        let measurement = Measurement::create(&self.store, self.description.clone(), &self.recipe)?;
        let views: Vec<usize> =
            (0..self.description.views.len()).filter(|&view| !measurement.has_view(view)).collect();
        let lights = self.description.lights.len() as u64;
        context.progress.begin("import", views.len() as u64 * lights, Counted::Items("images"));
        let codes =
            LightnessCodes::new(self.description.transfer, self.description.channels, self.description.white);
        let clipped = AtomicU64::new(0);
        let in_flight = units::in_flight(context, self.unit_bytes());
        let problems = units::for_each(context, &views, in_flight, |&view| {
            let (samples, problems) = self.decode_view(view, context)?;
            if problems.is_empty() {
                let (luminance, over) = self.luminance(&samples, &codes);
                clipped.fetch_add(over, Ordering::Relaxed);
                measurement.write_view(view, samples, luminance)?;
            }
            Ok(problems)
        })?;
        context.progress.end();
        let hint = "replace these images, delete the unfinished store and import again";
        fail_on(self.archive.path(), &problems.concat(), hint)?;
        Ok(Report {
            views_found: self.description.views.len() - views.len(),
            views_written: views.len(),
            clipped: clipped.into_inner(),
        })
    }

    /// Samples of a view [y, x, light, channel], and what is wrong with its images.
    fn decode_view(&self, view: usize, context: &Context<'_>) -> Result<(Vec<u8>, Vec<String>)> {
        let (lights, channels) = (self.description.lights.len(), self.description.channels);
        let texel_bytes = lights * channels;
        let mut samples = vec![0; self.description.size.texels() * texel_bytes];
        let mut problems = Vec::new();
        for first in (0..lights).step_by(LIGHTS_AT_ONCE) {
            context.check_stop()?;
            let last = (first + LIGHTS_AT_ONCE).min(lights);
            let mut images = Vec::with_capacity(LIGHTS_AT_ONCE);
            for light in first..last {
                let name = self.archive.image_name(view, light);
                let image = self.archive.image_bytes(view, light).and_then(|bytes| {
                    jpeg::decode(&bytes, self.archive.limits()).map_err(|error| error.in_entry(name).into())
                });
                self.archive.release(view, light);
                match image {
                    Ok(image) => images.push(image.samples),
                    Err(error) => problems.push(error.to_string()),
                }
                context.progress.advance(1);
            }
            if images.len() == last - first {
                let group = first * channels..last * channels;
                for (texel, to) in samples.chunks_exact_mut(texel_bytes).enumerate() {
                    for (to, image) in to[group.clone()].chunks_exact_mut(channels).zip(&images) {
                        to.copy_from_slice(&image[texel * channels..(texel + 1) * channels]);
                    }
                }
            }
        }
        Ok((samples, problems))
    }

    /// L* codes [y, x, light] of a view's samples, and how many samples are brighter than white.
    fn luminance(&self, samples: &[u8], codes: &LightnessCodes) -> (Vec<u8>, u64) {
        let mut clipped = 0;
        let luminance = samples
            .chunks_exact(self.description.channels)
            .map(|sample| {
                let (code, over) = codes.code(sample);
                clipped += u64::from(over);
                code
            })
            .collect();
        (luminance, clipped)
    }
}

/// One error that names all problems.
fn fail_on(archive: &Path, problems: &[String], hint: &str) -> Result<()> {
    if problems.is_empty() {
        return Ok(());
    }
    let mut lines: Vec<&str> = problems.iter().take(NAMED_PROBLEMS).map(String::as_str).collect();
    let more = format!("and {} more", problems.len().saturating_sub(NAMED_PROBLEMS));
    if problems.len() > NAMED_PROBLEMS {
        lines.push(&more);
    }
    Err(Error::input(format!(
        "{}: {} unusable images\n  {}",
        archive.display(),
        problems.len(),
        lines.join("\n  ")
    ))
    .hint(hint))
}
