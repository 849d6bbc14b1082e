//! An archive of single pictures, one for each pair of directions.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use btfkit_formats::ubo2003::Catalogue;
use btfkit_formats::{Contents, Direction, Limits, SampleType, Samples, jpeg};
use rayon::prelude::*;

use super::Source;
use super::files::Files;
use crate::error::{Error, Result};
use crate::run::{Context, recipe};

/// Problems that an error names one by one.
const NAMED_PROBLEMS: usize = 20;

/// Pictures whose directions are known.
pub(super) struct Pictures {
    path: PathBuf,
    files: Files,
    /// File of each image, [view, light].
    images: Vec<usize>,
    contents: Contents,
    limits: Limits,
}

impl Pictures {
    pub(super) fn open(paths: &[PathBuf], limits: Limits) -> Result<Self> {
        let path = paths.first().cloned().unwrap_or_default();
        let files = Files::list(paths, &limits)?;
        let catalogue = Catalogue::from_names(files.names()).map_err(|errors| {
            Error::input(errors.to_string()).context(path.display()).hint(
                "expected one JPEG for each pair of directions, named like `00081 tl015 pl000 tv000 pv000.jpg`",
            )
        })?;
        let direction = |a: &btfkit_formats::ubo2003::Angles| Direction::from_degrees(a.theta_deg(), a.phi_deg());
        let views: Vec<Direction> = catalogue.views().iter().map(direction).collect();
        let lights: Vec<Direction> = catalogue.lights().iter().map(direction).collect();
        let images: Vec<usize> = (0..views.len())
            .flat_map(|view| (0..lights.len()).map(move |light| (view, light)))
            .filter_map(|(view, light)| catalogue.image(view, light))
            .collect();
        let first = images.first().copied().ok_or_else(|| Error::input("no images"))?;
        let header = jpeg::header(&files.bytes(first)?, &limits)
            .map_err(|error| Error::from(error.in_entry(files.name(first))).context(path.display()))?;
        let channels: &[&str] = if header.channels == 1 { &["Y"] } else { &["R", "G", "B"] };
        let contents = Contents {
            format: "UBO2003 layout".to_owned(),
            width: header.width,
            height: header.height,
            channels: channels.iter().map(ToString::to_string).collect(),
            sample_type: SampleType::U8,
            views,
            lights,
            linear: false,
            cosine_included: true,
            assumptions: vec!["the transfer curve is sRGB".to_owned()],
            remarks: vec![("other files".to_owned(), catalogue.ignored().to_string())],
        };
        Ok(Self { path, files, images, contents, limits })
    }

    fn file(&self, view: usize, light: usize) -> usize {
        self.images[view * self.contents.lights.len() + light]
    }

    /// Checks the structure of one image; returns its checksum.
    fn check_image(&self, file: usize) -> Result<u32> {
        let bytes = self.files.bytes(file)?;
        let checksum = self.files.checksum(file, &bytes);
        let found = jpeg::check(&bytes, &self.limits).map_err(|error| error.in_entry(self.files.name(file)))?;
        let shape = (found.width, found.height, usize::from(found.channels));
        self.expect_shape(file, shape)?;
        Ok(checksum)
    }

    fn expect_shape(&self, file: usize, (width, height, channels): (u32, u32, usize)) -> Result<()> {
        let expected = (self.contents.width, self.contents.height, self.contents.channels.len());
        if (width, height, channels) == expected {
            return Ok(());
        }
        Err(Error::input(format!(
            "{}: got {width}x{height} with {channels} channels, expected {}x{} with {} like the first image",
            self.files.name(file),
            expected.0,
            expected.1,
            expected.2
        )))
    }

    fn decode(&self, file: usize) -> Result<Samples> {
        let bytes = self.files.bytes(file)?;
        let image = jpeg::decode(&bytes, &self.limits).map_err(|error| error.in_entry(self.files.name(file)))?;
        self.expect_shape(file, (image.width, image.height, usize::from(image.channels)))?;
        Ok(Samples::U8(image.samples))
    }
}

impl Source for Pictures {
    fn path(&self) -> &Path {
        &self.path
    }

    fn contents(&self) -> &Contents {
        &self.contents
    }

    fn lights_at_once(&self) -> usize {
        1
    }

    fn read_images(&self, view: usize, lights: Range<usize>) -> Result<Samples> {
        let mut samples = Samples::none(self.contents.sample_type);
        let mut problems = Vec::new();
        for light in lights {
            let file = self.file(view, light);
            match self.decode(file) {
                // The only image: no copy.
                Ok(image) if samples.is_empty() => samples = image,
                Ok(image) => {
                    samples.append(&image);
                }
                Err(error) => problems.push(error.to_string()),
            }
            self.files.release(file);
        }
        fail_on(&self.path, &problems)?;
        Ok(samples)
    }

    fn check(&self, context: &Context<'_>) -> Result<String> {
        let done = AtomicUsize::new(0);
        let checked: Vec<Result<u32>> = context.install(|| {
            self.images
                .par_iter()
                .map(|&file| {
                    context.check_stop()?;
                    let checksum = self.check_image(file);
                    self.files.release(file);
                    done.fetch_add(1, Ordering::Relaxed);
                    checksum
                })
                .collect()
        });
        context.check_stop()?;
        let problems: Vec<String> = checked.iter().filter_map(|c| Some(c.as_ref().err()?.to_string())).collect();
        fail_on(&self.path, &problems)
            .map_err(|error| error.hint("replace these images and run the same command again"))?;
        let checksums: Vec<u8> = checked.into_iter().flatten().flat_map(u32::to_le_bytes).collect();
        Ok(recipe::digest_bytes(&checksums))
    }
}

/// One error that names all problems.
pub(super) fn fail_on(archive: &Path, problems: &[String]) -> Result<()> {
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
    )))
}
