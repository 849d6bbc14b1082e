//! An HDF5 archive as a source; its reader opens the file itself, through the C library.

use std::ops::Range;
use std::path::{Path, PathBuf};

use btfkit_formats::{Contents, Limits, Samples};

use super::Archive;
use crate::archive::{Source, digest_of};
use crate::error::Result;
use crate::run::Context;

/// Groups that the lights of a view are read in; more only wait for the library's lock.
const GROUPS: usize = 2;

pub(in crate::archive) struct Hdf5 {
    path: PathBuf,
    archive: Archive,
}

impl Hdf5 {
    pub(in crate::archive) fn open(path: &Path, limits: &Limits) -> Result<Self> {
        Ok(Self { path: path.to_owned(), archive: Archive::open(path, limits)? })
    }
}

impl Source for Hdf5 {
    fn path(&self) -> &Path {
        &self.path
    }

    fn contents(&self) -> &Contents {
        self.archive.contents()
    }

    fn lights_at_once(&self) -> usize {
        self.contents().lights.len().div_ceil(GROUPS)
    }

    fn read_images(&self, view: usize, lights: Range<usize>) -> Result<Samples> {
        self.archive.read_images(view, lights)
    }

    fn check(&self, context: &Context<'_>) -> Result<String> {
        digest_of(&self.path, context)
    }
}
