//! A viewer in a browser: a model or an enlargement as one page, from a file or from a small server of this machine.
//!
//! The page and its programs lie in `web/`; they are put together here, with the material in them, and ask for nothing
//! from anywhere. Everything that is seen is computed in the page: values by the rules of [`crate::method`], and the
//! endless plane by the coherent rule, to the bit.

mod container;
mod material;
mod page;
mod request;
mod serve;

use std::path::{Path, PathBuf};

use crate::disk::output::{Made, expect_outside_stores, prepare_bytes};
use crate::error::Result;
use crate::run::Context;
use crate::shape::Area;

pub use serve::Server;

/// What to view.
#[derive(Clone, Debug)]
pub struct Options {
    /// A model, or an enlargement.
    pub source: PathBuf,
    /// The model of an enlargement; where it is not named, it is looked for as `btf image` does.
    pub model: Option<PathBuf>,
    /// The part of an enlargement that the page holds; of a large one its top left corner where absent.
    pub window: Option<Area>,
}

/// A material, packed for the page.
pub struct Viewer {
    name: String,
    packed: Vec<u8>,
    notes: Vec<String>,
}

/// What was written.
#[derive(Clone, Debug)]
pub struct Report {
    /// Bytes of the page.
    pub bytes: u64,
    /// Whether it was there already.
    pub made: Made,
}

impl Viewer {
    /// Reads a model or an enlargement, and packs what the page needs of it.
    ///
    /// # Errors
    /// Where there is none, or more of it than a page holds.
    pub fn open(options: &Options, context: &Context<'_>) -> Result<Self> {
        let material = material::read(options, context)?;
        let packed = material.container.packed()?;
        Ok(Self { name: material.name, packed, notes: material.notes })
    }

    /// What a user should know of what the page holds.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The page with the material in it: one file that asks for nothing else.
    ///
    /// # Errors
    /// Those of putting it together.
    pub fn page(&self) -> Result<String> {
        page::whole(&self.name, &self.packed)
    }

    /// Writes the page.
    ///
    /// # Errors
    /// Those of writing, and another file of this name.
    pub fn export(&self, path: &Path, context: &Context<'_>) -> Result<Report> {
        expect_outside_stores(path)?;
        let page = self.page()?;
        let made = prepare_bytes(path, context.existing, page.as_bytes())?.publish()?;
        Ok(Report { bytes: page.len() as u64, made })
    }

    /// Starts a server of the page on this machine; port 0 is any that is free.
    ///
    /// # Errors
    /// Where the port is taken.
    pub fn serve(self, port: u16) -> Result<Server> {
        Server::start(page::served(&self.name)?, self.packed, port)
    }
}
