//! What a tile takes, every byte counted, and of what that is a part.

use serde::Serialize;

use super::kept::bytes_below;
use super::values::By;
use crate::error::Result;
use crate::store::measurement::Description;
use crate::store::model::components::raw_bytes;
use crate::store::model::{Model, Stage};

/// Bytes of something that is kept.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Part {
    /// What it is.
    pub name: &'static str,
    /// As plain numbers.
    pub raw_bytes: u64,
    /// As they are stored, compressed.
    pub coded_bytes: u64,
}

/// The parts that give the values of a tile.
#[derive(Clone, Debug, Serialize)]
pub struct Ledger {
    /// All of them, but for what is common to all ways to keep a tile: the directions.
    pub parts: Vec<Part>,
    /// Bytes of the tile's raw samples.
    pub tile_bytes: u64,
    /// Bytes of the raw samples of the whole measurement.
    pub measurement_bytes: u64,
}

impl Ledger {
    /// Of a model, by what is used of it.
    ///
    /// # Errors
    /// Those of reading what its stages left.
    pub(crate) fn of_model(model: &Model, by: By, measured: &Description, texels: usize) -> Result<Self> {
        let stored = |arrays: &[&str]| arrays.iter().map(|name| bytes_below(&model.path().join(name))).sum();
        let part = |name, raw_bytes, arrays: &[&str]| Part { name, raw_bytes, coded_bytes: stored(arrays) };
        let parts = match by {
            By::Clusters => {
                let report = model.cluster_report()?;
                vec![
                    part("index", report.index_bytes, &["index"]),
                    part("representatives", report.representative_bytes, &["representatives"]),
                ]
            }
            By::Components => {
                let report: super::components::Report = model.report(Stage::Components)?;
                let arrays = ["mean", "basis", "basis_scale", "coefficients", "coefficient_scale"];
                vec![part("components", report.bytes, &arrays)]
            }
        };
        Ok(Self::of_parts(parts, measured, texels))
    }

    /// Of a packed file.
    pub(crate) fn of_packed(
        file_bytes: u64,
        components: usize,
        measured: &Description,
        texels: usize,
    ) -> Self {
        let brdf = measured.views.len() * measured.texel_samples();
        let raw_bytes = raw_bytes(components, brdf, texels);
        Self::of_parts(
            vec![Part { name: "packed file", raw_bytes, coded_bytes: file_bytes }],
            measured,
            texels,
        )
    }

    fn of_parts(parts: Vec<Part>, measured: &Description, texels: usize) -> Self {
        Self { parts, tile_bytes: measured.bytes_of(texels), measurement_bytes: measured.bytes() }
    }

    /// Bytes of all parts as plain numbers.
    pub fn raw_bytes(&self) -> u64 {
        self.parts.iter().map(|part| part.raw_bytes).sum()
    }

    /// Bytes of all parts as they are stored.
    pub fn coded_bytes(&self) -> u64 {
        self.parts.iter().map(|part| part.coded_bytes).sum()
    }
}
