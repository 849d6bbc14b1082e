//! A packed model as an archive: the samples that it stands for, so that all stages can be run on them.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use btfkit_formats::{Contents, Samples};

use super::{Source, digest_of};
use crate::error::{Error, Result};
use crate::run::Context;
use crate::store::measurement::gather::images_of_texels;
use crate::store::packed::{Packed, PackedFile};

/// Groups that the lights of a view are read in.
const GROUPS: usize = 8;

/// A packed model.
pub(super) struct PackedArchive {
    path: PathBuf,
    contents: Contents,
    notes: Vec<String>,
    memory_bytes: u64,
    digest: String,
    /// Decoded when the first image is asked for: then its memory has been asked for, too.
    packed: Mutex<Option<Arc<Packed>>>,
}

impl PackedArchive {
    /// Opens one.
    ///
    /// # Errors
    /// A file that is none, or is damaged before its first plane ends.
    pub(super) fn open(path: &Path) -> Result<Self> {
        let file = PackedFile::open(path)?;
        let format = format!("packed model, {} components", file.outline.components());
        let contents = Contents { remarks: file.outline.texts.clone(), ..file.description.contents(format) };
        let (notes, memory_bytes) = (file.notes(), file.outline.memory_bytes());
        let (path, digest) = (path.to_owned(), file.digest);
        Ok(Self { path, contents, notes, memory_bytes, digest, packed: Mutex::default() })
    }

    fn packed(&self) -> Result<Arc<Packed>> {
        let mut kept = self.packed.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(packed) = &*kept {
            return Ok(Arc::clone(packed));
        }
        let file = PackedFile::open(&self.path)?;
        if file.digest != self.digest {
            let what = "the file was changed while it was read";
            return Err(Error::input(format!("{}: {what}", self.path.display())));
        }
        let model = file.decode()?;
        let packed = Arc::new(Packed::of(file, model));
        *kept = Some(Arc::clone(&packed));
        Ok(packed)
    }
}

impl Source for PackedArchive {
    fn path(&self) -> &Path {
        &self.path
    }

    fn contents(&self) -> &Contents {
        &self.contents
    }

    fn lights_at_once(&self) -> usize {
        self.contents.lights.len().div_ceil(GROUPS)
    }

    fn bytes_beside_image(&self) -> u64 {
        self.memory_bytes
    }

    fn read_images(&self, view: usize, lights: Range<usize>) -> Result<Samples> {
        let packed = self.packed()?;
        let description = &packed.description;
        let texels = packed.samples(view, lights.clone(), description.size.window());
        Ok(images_of_texels(&texels, lights.len(), description.n_channels()))
    }

    fn notes(&self) -> Vec<String> {
        let coarser = "samples are those that the packed model stands for: what it left out is lost";
        [coarser.to_owned()].into_iter().chain(self.notes.clone()).collect()
    }

    fn check(&self, context: &Context<'_>) -> Result<String> {
        digest_of(&self.path, context)
    }
}
