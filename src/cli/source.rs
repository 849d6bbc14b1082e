//! What a reader of archives is told at the command line; the same for every command that reads one.

use std::path::{Path, PathBuf};

use btfkit::archive::{self, Source};
use btfkit::color::Transfer;
use btfkit::error::Result;
use btfkit::store::measurement::{Adaptation, Reading, Side, Type};
use btfkit::store::recognise::expect_readable;
use btfkit_formats::bonn::RowOrder;
use btfkit_formats::picture::HdrOrientation;
use clap::{Args, ValueEnum};

/// How to read an archive that does not say everything, or says it wrong.
#[derive(Args, Clone)]
#[command(next_help_heading = "Reading the archive")]
pub(super) struct SourceArgs {
    /// Curve of the samples: sRGB codes or linear values [default: the archive's; if it has none, srgb for integers and
    /// linear for floats]
    #[arg(long, value_enum)]
    pub(super) transfer: Option<Curve>,
    /// Convert samples to this type [default: keep theirs]
    #[arg(long, value_enum)]
    samples: Option<SampleName>,
    /// Which polar angles of the archive are elevations, where 90 degrees is straight above; theta is 0 there
    #[arg(long, value_enum)]
    polar: Option<Polar>,
    /// Which azimuths of the archive run clockwise
    #[arg(long, value_enum)]
    azimuth: Option<Azimuth>,
    /// Turn all directions counter-clockwise by this many degrees
    #[arg(long, value_parser = ["90", "180", "270"])]
    turn: Option<String>,
    /// Exchange rows and columns of the images
    #[arg(long)]
    transpose: bool,
    /// Exchange light and view, which the archive has the wrong way round
    #[arg(long)]
    swap: bool,
    /// Say `excluded` if the cosine of the light angle was divided out; it is then multiplied in
    #[arg(long, value_parser = ["excluded"])]
    cosine: Option<String>,
    /// Where the angles stand in file names, such as '{theta_v}_{phi_v}_{theta_i}_{phi_i}.exr' (v view, i light)
    #[arg(long, value_name = "TEXT")]
    pattern: Option<String>,
    /// A CSV table with the columns file, theta_i, phi_i, theta_v, phi_v (degrees)
    #[arg(long, value_name = "FILE", conflicts_with = "pattern")]
    table: Option<PathBuf>,
    /// The published list of directions, for an array, BIG or MIF file that has none
    #[arg(long, value_parser = ["ubo81", "bonn151", "uniform"])]
    order: Option<String>,
    /// Say `reversed` if the rows of a Bonn container begin at the bottom
    #[arg(long, value_parser = ["reversed"])]
    rows: Option<String>,
    /// Say `atrium` if the scan lines of Radiance pictures that name X first are rows, from the bottom up
    #[arg(long, value_parser = ["rules", "atrium"])]
    hdr: Option<String>,
    /// Leave out the view of this number, from 0 (btf info --directions lists them); repeat the option for more
    #[arg(long, value_name = "N")]
    drop_view: Vec<usize>,
    /// Leave out the light of this number, from 0 (btf info --directions lists them); repeat the option for more
    #[arg(long, value_name = "N")]
    drop_light: Vec<usize>,
}

#[derive(Clone, Copy, ValueEnum)]
pub(super) enum Curve {
    Srgb,
    Linear,
}

#[derive(Clone, Copy, ValueEnum)]
enum SampleName {
    U8,
    U16,
    F16,
    F32,
}

#[derive(Clone, Copy, ValueEnum)]
enum Polar {
    Elevation,
    ElevationLights,
    ElevationViews,
}

#[derive(Clone, Copy, ValueEnum)]
enum Azimuth {
    Mirrored,
    MirroredLights,
    MirroredViews,
}

impl SourceArgs {
    pub(super) fn options(&self) -> archive::Options {
        archive::Options {
            adaptation: self.adaptation(),
            pattern: self.pattern.clone(),
            table: self.table.clone(),
            order: self.order.clone(),
            rows: if self.rows.is_some() { RowOrder::BottomFirst } else { RowOrder::TopFirst },
            hdr_orientation: match self.hdr.as_deref() {
                Some("atrium") => HdrOrientation::Atrium,
                _ => HdrOrientation::Rules,
            },
        }
    }

    fn adaptation(&self) -> Adaptation {
        Adaptation {
            drop_views: self.drop_view.clone(),
            drop_lights: self.drop_light.clone(),
            swap: self.swap,
            elevations: self.polar.map(|polar| match polar {
                Polar::Elevation => Side::Both,
                Polar::ElevationLights => Side::Lights,
                Polar::ElevationViews => Side::Views,
            }),
            mirrored: self.azimuth.map(|azimuth| match azimuth {
                Azimuth::Mirrored => Side::Both,
                Azimuth::MirroredLights => Side::Lights,
                Azimuth::MirroredViews => Side::Views,
            }),
            turn_deg: self.turn.as_ref().and_then(|turn| turn.parse().ok()).unwrap_or(0),
            transpose: self.transpose,
            cosine_excluded: self.cosine.is_some(),
            transfer: self.transfer.map(|curve| match curve {
                Curve::Srgb => Transfer::Srgb,
                Curve::Linear => Transfer::Linear,
            }),
            samples: self.samples.map(|name| match name {
                SampleName::U8 => Type::U8,
                SampleName::U16 => Type::U16,
                SampleName::F16 => Type::F16,
                SampleName::F32 => Type::F32,
            }),
        }
    }

    /// Opens the archive at one path, or in pieces at several.
    pub(super) fn open(&self, paths: &[PathBuf]) -> Result<Box<dyn Source>> {
        open(paths, &self.options())
    }

    /// The same by the reading that a store was made by, unless another one is asked for.
    pub(super) fn open_as_in(&self, reading: Reading, paths: &[PathBuf]) -> Result<Box<dyn Source>> {
        open(paths, &self.options().or_as_in(reading))
    }
}

fn open(paths: &[PathBuf], options: &archive::Options) -> Result<Box<dyn Source>> {
    paths.iter().try_for_each(|path| expect_readable(path))?;
    archive::open(paths, options).map_err(|error| match paths {
        [folder] if holds_archives(folder) => {
            let todo = error.guidance().map_or(String::new(), |hint| format!("{hint}; "));
            let each = folder.join("*");
            error.hint(format!("{todo}if its archives are a measurement each, name them: {}", each.display()))
        }
        _ => error,
    })
}

/// Whether a folder holds several archives that are one file each.
fn holds_archives(folder: &Path) -> bool {
    const ENDINGS: [&str; 7] = ["zip", "btf", "h5", "hdf5", "npy", "big", "mif"];
    let is_archive = |path: PathBuf| {
        path.extension().is_some_and(|ending| ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known)))
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter(|entry| is_archive(entry.path())).take(2).count() > 1
}
