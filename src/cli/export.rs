use std::path::{Path, PathBuf};

use btfkit::error::{Error, ErrorKind, Result};
use btfkit::picture::Ending;
use btfkit::run::Context;
use btfkit::stage::export::{self, Format, Source};
use clap::{Args, ValueEnum};

use super::deepzoom::Deepzoom;
use super::given::Given;
use super::{Console, bytes_text, found};

/// Where it is said which options have an effect.
const WHICH: &str = "; btf export --help says which options are for which formats";

/// Write a measurement for other programs (zip, EXR, PNG, HDF5, npy, Bonn), or a picture to zoom into (Deep Zoom)
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf export wood.zarr wood.npy                       for numpy, with two arrays of directions
  btf export wood.zarr wood.h5                        for h5py and MATLAB
  btf export wood.zarr wood-exr --to exr              a folder of linear pictures
  btf export wood.zarr wood.zip --quality 95          JPEGs named as in UBO2003 (lossy)
  btf export wood.zarr wood.btf --rank 100            for Bonn's viewers; exact, but large, without --rank
  btf export wood-4k.zarr wood.dzi --deepzoom --light 60,90 --format jpeg
                                                      tiles for OpenSeadragon and others, and wood.html to look at them
npy, PNG, HDF5, and EXR and Bonn's containers of halves or floats are lossless: importing them gives the same samples.
Deep Zoom shows measurements, models and enlargements of any size, as `btf image` does. If it is interrupted, run the
same command again. --rank reads the measurement many times: minutes for a small one, hours for a large one.")]
pub(super) struct Export {
    /// The measurement, or a packed model; with --deepzoom also a model or an enlargement
    store: PathBuf,
    /// The file or folder to make
    output: PathBuf,
    /// Format [default: by the ending of the name: .zip (UBO2003), .npy, .h5 or .hdf5, .btf (DFMF), .dzi (Deep Zoom)]
    #[arg(long, value_enum, conflicts_with = "deepzoom")]
    to: Option<FormatName>,
    /// Number of components to keep in a Bonn container [default: all, which is exact]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    rank: Option<u32>,
    /// Quality of JPEGs, 1 to 100 [default: 100, for Deep Zoom tiles 90]
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=100))]
    quality: Option<u8>,
    #[command(flatten)]
    deepzoom: Deepzoom,
}

#[derive(Clone, Copy, ValueEnum)]
enum FormatName {
    Ubo2003,
    Exr,
    Png,
    Npy,
    Hdf5,
    Dfmf,
    Fmf,
}

impl Export {
    /// Whether the same command goes on where it was stopped: tiles are kept.
    pub(super) fn goes_on(&self) -> bool {
        self.to.is_none() && self.deepzoom.is_meant(&self.output)
    }

    pub(super) fn run(&self, given: &Given, context: &Context<'_>, console: Console) -> Result<()> {
        if self.goes_on() {
            let is_idle = |name: &str| name == "rank" || name == "quality" && !self.deepzoom.is_jpeg();
            given.refuse(is_idle, "in a Deep Zoom pyramid like this one", WHICH)?;
            self.deepzoom.refuse_idle(given, &self.store)?;
            return self.deepzoom.run(&self.store, &self.output, self.quality, context, console);
        }
        let format = match self.to {
            Some(FormatName::Ubo2003) => Format::Ubo2003,
            Some(FormatName::Exr) => Format::Exr,
            Some(FormatName::Png) => Format::Png,
            Some(FormatName::Npy) => Format::Npy,
            Some(FormatName::Hdf5) => Format::Hdf5,
            Some(FormatName::Dfmf) => Format::Dfmf,
            Some(FormatName::Fmf) => Format::Fmf,
            None => of_name(&self.output).ok_or_else(|| {
                let error = Error::new(
                    ErrorKind::Usage,
                    format!("{}: no format goes by this name", self.output.display()),
                );
                let formats = "--to says which: ubo2003, exr, png, npy, hdf5, dfmf, fmf";
                match Ending::of(&self.output, &Ending::ALL) {
                    Ok(_) => error.hint(format!(
                        "one picture: btf image {} --out {}; all of a measurement: {formats}",
                        self.store.display(),
                        self.output.display()
                    )),
                    Err(_) => error.hint(formats),
                }
            })?,
        };
        if self.output.extension().is_some_and(|ending| ending == "dzi") {
            return Err(Error::usage(
                "--to asks for another format than the Deep Zoom pyramid that .dzi stands for",
            )
            .hint("leave out --to, or name the result otherwise"));
        }
        // Both of Bonn's containers are called .btf.
        let goes_by = if format == Format::Fmf { Format::Dfmf } else { format };
        if of_name(&self.output).is_some_and(|named| named != goes_by) {
            let output = self.output.display();
            return Err(Error::usage(format!(
                "{output}: --to asks for another format than this ending stands for"
            ))
            .hint("leave out --to, or name the result otherwise"));
        }
        let (what, used) = match format {
            Format::Ubo2003 => ("a zip of JPEGs", "quality"),
            Format::Dfmf | Format::Fmf => ("a Bonn container", "rank"),
            Format::Exr | Format::Png => ("a folder of pictures", ""),
            Format::Npy => ("a numpy array", ""),
            Format::Hdf5 => ("an HDF5 file", ""),
        };
        let is_idle = |name: &str| ["rank", "quality"].contains(&name) && name != used;
        given.refuse(is_idle, &format!("in {what}"), WHICH)?;
        given.refuse_all::<Deepzoom>(&format!("in {what}"), WHICH)?;
        let source = Source::open(&self.store, context)?;
        let options = export::Options {
            output: self.output.clone(),
            format,
            rank: self.rank.map(|rank| rank as usize),
            quality: self.quality.unwrap_or(100),
        };
        let report = export::run(&source, &options, context)?;
        console.line(format!(
            "{}: {}{}",
            self.output.display(),
            bytes_text(report.bytes),
            found(report.made)
        ));
        console.notes(&report.warnings);
        Ok(())
    }
}

fn of_name(path: &Path) -> Option<Format> {
    Some(match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "zip" => Format::Ubo2003,
        "npy" => Format::Npy,
        "h5" | "hdf5" => Format::Hdf5,
        "btf" => Format::Dfmf,
        _ => return None,
    })
}
