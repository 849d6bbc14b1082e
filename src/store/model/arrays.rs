//! The arrays of a stage: which there are, and how they are opened and checked.

use super::appearance::{self, AppearanceReport};
use super::entries::Entry;
use super::normals::normals_layout;
use super::{Model, Stage, clusters, components, field, tile};
use crate::error::{Error, Result};
use crate::zarr::checksums::DIGITS;
use crate::zarr::{Array, DAMAGED, Layout, Named};
use serde_json::Value;

impl Model {
    /// The arrays of a stage with this report.
    pub(super) fn arrays(&self, stage: Stage, report: &Value) -> Result<Vec<(String, Layout<'static>)>> {
        Ok(match stage {
            Stage::Tile => {
                tile::arrays(&self.typed(stage, report)?, &self.directions()?, self.store.format())
            }
            Stage::Cluster => {
                let clusters::ClusterReport { clusters, .. } = self.typed(stage, report)?;
                let [views, lights] = self.directions()?.map(|list| list.len());
                let (channels, samples) = self.values()?;
                clusters::arrays(self.tile_report()?.size(), [clusters, views, lights], &channels, samples)
            }
            Stage::Normals => vec![("normals".to_owned(), normals_layout(self.tile_report()?.size()))],
            Stage::Fit => field::arrays(&self.typed(stage, report)?),
            Stage::Appearance => {
                let report: AppearanceReport = self.typed(stage, report)?;
                appearance::arrays(&report, self.clusters()?)
            }
            Stage::Components => components::arrays(&self.components_shape(&self.typed(stage, report)?)?),
        })
    }

    /// Opens an array of a stage.
    pub(super) fn open_array(&self, stage: Stage, name: &str, layout: &Layout<'_>) -> Result<Array> {
        self.open_array_of(stage, &self.done(stage)?, name, layout)
    }

    /// The same of a stage whose entry has been read.
    pub(super) fn open_array_of(
        &self,
        stage: Stage,
        entry: &Entry,
        name: &str,
        layout: &Layout<'_>,
    ) -> Result<Array> {
        let array = self.store.open_array(name, layout).map_err(|error| match error.kind() {
            crate::error::ErrorKind::Missing => {
                error.hint(format!("to make it again: {}", self.command(stage)))
            }
            _ => error,
        })?;
        let Some(kept) = &entry.checksums else { return Ok(array) };
        let kept = kept.get(name).map(String::as_str).unwrap_or_default();
        let found = self.store.unless_made_anew(self.store.checksums(&array))?;
        if found == kept {
            return Ok(array);
        }
        self.store.expect_unchanged()?;
        let row = (0..array.grid()[0]).find(|&row| {
            let digits = row as usize * DIGITS..(row as usize + 1) * DIGITS;
            kept.get(digits.clone()) != found.get(digits)
        });
        let mut place = vec![0; array.shape().len()];
        place[0] = row.unwrap_or(0);
        let file = self.store.chunk_path(&array, &place);
        let what = "its checksum is not the one that was kept: another chunk in its place, or a damaged one";
        Err(Error::input(format!("{}: {what}", file.display())).hint(DAMAGED))
    }

    /// Reads an array of a stage.
    pub(super) fn read<T: Named>(&self, stage: Stage, name: &str, layout: &Layout<'_>) -> Result<Vec<T>> {
        let array = self.open_array(stage, name, layout)?;
        self.store.read_box(&array, &vec![0; array.shape().len()], array.shape())
    }
}
