//! An archive on disk: one zip of everything, or folders of images. Bytes come from memory maps.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use btfkit_formats::Limits;
use btfkit_formats::ubo2003::Catalogue;
use btfkit_formats::zip::ZipIndex;

use crate::error::{Error, Result};
use crate::store::mapped::MappedFile;

/// Folders below the archive's own that are looked into.
const FOLDER_DEPTH: usize = 8;

/// A UBO2003 archive, listed but not decoded.
pub struct Archive {
    path: PathBuf,
    container: Container,
    /// Names as in the container.
    names: Vec<String>,
    catalogue: Catalogue,
    limits: Limits,
}

enum Container {
    Zip { file: MappedFile, index: ZipIndex },
    Folder { files: Vec<PathBuf> },
}

impl Archive {
    /// Lists a zip or a folder and sorts out its images by the angles in their names.
    ///
    /// # Errors
    /// Names every missing and every duplicate image; says where a zip is damaged, or that it is none.
    pub fn open(path: &Path) -> Result<Self> {
        let limits = Limits::default();
        let data = fs::metadata(path).map_err(|error| Error::io("read", path, error))?;
        let (container, names) = if data.is_dir() {
            let files = list_folder(path)?;
            let names = files.iter().map(|file| file.to_string_lossy().into_owned()).collect();
            (Container::Folder { files }, names)
        } else {
            let file = MappedFile::open(path).map_err(|error| Error::io("read", path, error))?;
            let index = ZipIndex::open(file.as_ref(), &limits).map_err(|error| {
                Error::from(error)
                    .context(path.display())
                    .hint("expected a zip archive in UBO2003's layout, or a folder of its images")
            })?;
            // Listing has touched a header beside every image.
            file.release(0..file.as_ref().len());
            let names = index.entries().iter().map(|entry| entry.name().to_owned()).collect();
            (Container::Zip { file, index }, names)
        };
        let names: Vec<String> = names;
        let catalogue = Catalogue::from_names(names.iter().map(String::as_str)).map_err(|errors| {
            Error::input(errors.to_string()).context(path.display()).hint(
                "expected one JPEG for each pair of directions, named like `00081 tl015 pl000 tv000 pv000.jpg`",
            )
        })?;
        Ok(Self { path: path.to_owned(), container, names, catalogue, limits })
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its directions and images.
    pub fn catalogue(&self) -> &Catalogue {
        &self.catalogue
    }

    /// Limits that its images are decoded under.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Name of the image of a pair of directions.
    pub fn image_name(&self, view: usize, light: usize) -> &str {
        self.catalogue.image(view, light).map_or("", |entry| &self.names[entry])
    }

    /// Encoded bytes of the image of a pair of directions.
    pub fn image_bytes(&self, view: usize, light: usize) -> Result<Cow<'_, [u8]>> {
        let entry = self
            .catalogue
            .image(view, light)
            .ok_or_else(|| Error::internal(format!("no image of view {view}, light {light}")))?;
        match &self.container {
            Container::Zip { file, index } => index
                .read(file.as_ref(), entry)
                .map_err(|error| Error::from(error).context(self.path.display())),
            Container::Folder { files } => {
                let file = &files[entry];
                fs::read(file).map(Cow::Owned).map_err(|error| Error::io("read", file, error))
            }
        }
    }

    /// Gives back the memory of an image that has been used: pages of a mapped archive count as resident.
    pub fn release(&self, view: usize, light: usize) {
        if let Container::Zip { file, index } = &self.container
            && let Some(entry) =
                self.catalogue.image(view, light).and_then(|entry| index.entries().get(entry))
        {
            file.release(entry.compressed_range());
        }
    }

    /// CRC-32 of an image whose bytes these are: the same in a zip, which has it listed, and in a folder.
    pub fn checksum(&self, view: usize, light: usize, bytes: &[u8]) -> u32 {
        match (&self.container, self.catalogue.image(view, light)) {
            (Container::Zip { index, .. }, Some(entry)) => index.entries()[entry].crc32(),
            _ => crc32fast::hash(bytes),
        }
    }
}

/// Files below a folder, sorted by path. Links to files are followed, links to folders are not.
fn list_folder(root: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut folders = vec![(root.to_owned(), 0)];
    while let Some((folder, depth)) = folders.pop() {
        let entries = fs::read_dir(&folder).map_err(|error| Error::io("list", &folder, error))?;
        for entry in entries {
            let entry = entry.map_err(|error| Error::io("list", &folder, error))?;
            let path = entry.path();
            let linked = entry.file_type().is_ok_and(|kind| kind.is_symlink());
            // A link that leads nowhere is no image; the hole that it leaves is reported as such.
            let Ok(data) = fs::metadata(&path) else { continue };
            if data.is_file() {
                files.push(path);
            } else if data.is_dir() && !linked && depth < FOLDER_DEPTH {
                folders.push((path, depth + 1));
            }
        }
    }
    files.sort();
    Ok(files)
}
