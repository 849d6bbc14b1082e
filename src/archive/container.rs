//! An archive in one file that computes or cuts out its images on demand.

use std::ops::Range;
use std::path::{Path, PathBuf};

use btfkit_formats::{Contents, Images, Samples};
use sha2::{Digest, Sha256};

use super::Source;
use crate::error::{Error, Result};
use crate::run::{Context, recipe};
use crate::store::mapped::MappedFile;

/// Groups that the lights of a view are read in: enough for some threads, few enough that what a group has
/// in common (a block of factors, say) is worked out seldom.
const GROUPS: usize = 8;

/// Bytes of the file that are looked at at a time.
const DIGEST_STEP: usize = 8 << 20;

/// A container, mapped.
pub(super) struct Container {
    path: PathBuf,
    file: MappedFile,
    images: Box<dyn Images>,
}

impl Container {
    /// Maps a file and opens it by `open`.
    pub(super) fn open(
        path: &Path,
        open: impl FnOnce(&[u8]) -> btfkit_formats::Result<Box<dyn Images>>,
    ) -> Result<Self> {
        let file = MappedFile::open(path).map_err(|error| Error::io("read", path, error))?;
        let images = open(file.as_ref()).map_err(|error| Error::from(error).context(path.display()))?;
        Ok(Self { path: path.to_owned(), file, images })
    }
}

impl Source for Container {
    fn path(&self) -> &Path {
        &self.path
    }

    fn contents(&self) -> &Contents {
        self.images.contents()
    }

    fn lights_at_once(&self) -> usize {
        self.contents().lights.len().div_ceil(GROUPS)
    }

    fn read_images(&self, view: usize, lights: Range<usize>) -> Result<Samples> {
        let samples = self.images.read_images(self.file.as_ref(), view, lights);
        // Pages that were read count as resident; the next group maps them again.
        self.file.release(0..self.file.as_ref().len());
        samples.map_err(|error| Error::from(error).context(self.path.display()))
    }

    fn check(&self, context: &Context<'_>) -> Result<String> {
        let mut digest = Sha256::new();
        let length = self.file.as_ref().len();
        for start in (0..length).step_by(DIGEST_STEP) {
            context.check_stop()?;
            let range = start..(start + DIGEST_STEP).min(length);
            digest.update(&self.file.as_ref()[range.clone()]);
            self.file.release(range);
        }
        Ok(recipe::hexadecimal(&digest.finalize()))
    }
}
