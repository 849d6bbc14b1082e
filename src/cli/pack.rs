use std::path::PathBuf;
use std::str::FromStr;

use btfkit::error::Result;
use btfkit::run::Context;
use btfkit::stage::pack::{self, Quality};
use btfkit::words::counted;
use clap::Args;

use super::bytes::parse_bytes;
use super::{Console, as_json, bytes_text, found, number};

/// Pack the components of a model into one small file, about a thousand times smaller than the samples of its tile
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf pack wood.model.zarr wood.btfc
  btf pack wood.model.zarr wood.btfc --quality 1:580           sharper
  btf pack wood.model.zarr wood.btfc --quality 40kB
  btf pack wood.model.zarr wood.btfc --quality 34dB --licence CC-BY-4.0 --texel-mm 0.25
`btf components` finds the components, `btf info` says what the file holds, and `btf unpack` makes a model of it again. \
The file can be cut after any of the byte counts that `btf info` lists: what is left is a coarser model.")]
pub(super) struct Pack {
    /// The model with components
    model: PathBuf,
    /// The file to write: NAME.btfc
    #[arg(value_name = "FILE")]
    output: PathBuf,
    /// How small: at most this many bytes (40000, 40kB, 40KiB), or this many times smaller than the tile's samples
    /// (1:2000). Or how good: at least this peak signal-to-noise ratio (34dB)
    #[arg(long, value_name = "BYTES|1:RATIO|DB", default_value = "1:2000")]
    quality: QualityArg,
    /// Licence of the material, kept in the file
    #[arg(long, value_name = "TEXT")]
    licence: Option<String>,
    /// Side of a texel in millimetres, kept in the file
    #[arg(long, value_name = "MM", value_parser = number::positive)]
    texel_mm: Option<f64>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// A quality as it is given.
#[derive(Clone, Copy, Debug, PartialEq)]
struct QualityArg(Quality);

impl FromStr for QualityArg {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let expected = || format!("expected bytes (40kB), a ratio (1:2000) or decibels (34dB), got {text:?}");
        let trimmed = text.trim();
        let above = |number: &str, least: f64| {
            let value: f64 = number.trim().parse().map_err(|_| expected())?;
            if value.is_finite() && value > least { Ok(value) } else { Err(expected()) }
        };
        if let Some(ratio) = trimmed.strip_prefix("1:") {
            return above(ratio, 1.0).map(|ratio| Self(Quality::Ratio(ratio)));
        }
        let lower = trimmed.to_ascii_lowercase();
        if let Some(number) = lower.strip_suffix("db") {
            return above(number, 0.0).map(|decibels| Self(Quality::Decibels(decibels)));
        }
        parse_bytes(trimmed).map(|bytes| Self(Quality::Bytes(bytes))).map_err(|_| expected())
    }
}

impl Pack {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        let report = pack::pack(
            &pack::Options {
                model: self.model.clone(),
                output: self.output.clone(),
                quality: self.quality.0,
                licence: self.licence.clone(),
                texel_mm: self.texel_mm,
            },
            context,
        )?;
        if self.json {
            return console.plan(&as_json(&report)?);
        }
        console.line(format!(
            "{}: {}, 1:{:.0} of the tile's samples, {}, PSNR {}{}",
            self.output.display(),
            bytes_text(report.bytes),
            report.tile_bytes as f64 / report.bytes as f64,
            counted(report.components, "component"),
            report.psnr_db.map_or("not known".to_owned(), |psnr| format!("{psnr:.2} dB")),
            report.made.map_or("", found)
        ));
        if report.components == 0 {
            console.notes(&["no component fits into so few bytes: every texel of the file looks the same; \
                             --quality 1:200 means 200 times smaller, --quality 200 means 200 bytes"
                .to_owned()]);
        }
        if let Some(more) = report.more {
            console.notes(&[format!(
                "all {} of the model are in the file; at the same size, more of them may be nearer to the measurement: {more}",
                counted(report.components, "component")
            )]);
        }
        Ok(())
    }
}

/// Make a model of a packed file: its tile and its components, which `btf image` shows
#[derive(Args)]
#[command(after_help = "\
Example:
  btf unpack wood.btfc again.model.zarr")]
pub(super) struct Unpack {
    /// The packed model
    file: PathBuf,
    /// The model to write
    model: PathBuf,
}

impl Unpack {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        let restored = pack::unpack(&self.file, &self.model, context)?;
        console.line(format!(
            "{}: {}, {}{}",
            self.model.display(),
            restored.size,
            counted(restored.components, "component"),
            if restored.found { ", found done" } else { "" }
        ));
        console.notes(&restored.notes);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quality_is_bytes_a_ratio_or_decibels() {
        for (text, quality) in [
            ("1:2000", Quality::Ratio(2000.0)),
            ("1: 580.5", Quality::Ratio(580.5)),
            ("34dB", Quality::Decibels(34.0)),
            ("29.5 db", Quality::Decibels(29.5)),
            ("40000", Quality::Bytes(40_000)),
            ("40KiB", Quality::Bytes(40 << 10)),
        ] {
            assert_eq!(text.parse(), Ok(QualityArg(quality)), "{text}");
        }
        for text in ["", "1:", "1:0", "1:nan", "-3dB", "dB", "0", "2:1", "fine"] {
            assert!(text.parse::<QualityArg>().is_err(), "{text}");
        }
    }
}
