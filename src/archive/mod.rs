//! Archives as they come: anything with the images of one material under every pair of a view and a light.
//!
//! [`open`] recognises what lies at a path by its content; whatever it is, the rest of the program sees a
//! [`Source`]. [`adapt`] wraps a source to mend what is known to be wrong with an archive.

pub(crate) mod adapt;
mod catalogue;
mod container;
pub(crate) mod directions;
mod files;
pub mod hdf5;
mod instead;
mod matching;
mod packed;
mod pictures;
mod plausibility;
mod unnamed;

use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

use btfkit_formats::bonn::RowOrder;
use btfkit_formats::picture::HdrOrientation;
use btfkit_formats::{Contents, Limits, Samples};
use sha2::{Digest, Sha256};

use crate::color::Remarkable;
use crate::error::{Error, ErrorKind, Result};
use crate::run::{Context, recipe};
use crate::store::measurement::{Adaptation, Reading};

/// Bytes that tell one container from another.
const HEAD_BYTES: u64 = 4096;

/// Longest list or table that is read.
const MAX_LIST_BYTES: u64 = 64 << 20;

/// Bytes of a file that are digested at a time.
const DIGEST_STEP_BYTES: usize = 4 << 20;

/// A measurement that can be read image by image.
pub trait Source: Send + Sync {
    /// Where it lies, for messages.
    fn path(&self) -> &Path;

    /// Sizes, directions, and how its samples are meant.
    fn contents(&self) -> &Contents;

    /// How many images of a view are best read at once.
    fn lights_at_once(&self) -> usize;

    /// Bytes that reading an image takes beside its samples, at most: those of its file, mapped ones too.
    fn bytes_beside_image(&self) -> u64 {
        0
    }

    /// The images of one view under a range of lights, [light, y, x, channel].
    fn read_images(&self, view: usize, lights: Range<usize>) -> Result<Samples>;

    /// The same, and what was found in the samples before they were converted to another type, where they were: clipped
    /// as `white` says, negative, not finite.
    fn read_counted(
        &self,
        view: usize,
        lights: Range<usize>,
        _white: f64,
    ) -> Result<(Samples, Option<Remarkable>)> {
        Ok((self.read_images(view, lights)?, None))
    }

    /// How the archive is read where more than one way is possible; a part of the recipe of all that is made of it.
    fn reading(&self) -> Reading {
        Reading::default()
    }

    /// What only this kind of archive has to tell for [`notes`], a sentence each.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// Looks at the whole archive without decoding it, and returns a digest of everything that its samples
    /// depend on.
    ///
    /// # Errors
    /// Names every unusable image.
    fn check(&self, context: &Context<'_>) -> Result<String>;
}

/// What a reader is told because the archive does not say it, or says it wrong.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// What is mended.
    pub adaptation: Adaptation,
    /// Where the angles stand in the names of pictures.
    pub pattern: Option<String>,
    /// A table of files and their directions.
    pub table: Option<PathBuf>,
    /// The directions of an archive that has none: a published list or order by its name.
    pub order: Option<String>,
    /// Row order of Bonn containers.
    pub rows: RowOrder,
    /// How Radiance pictures are read whose scan lines are columns.
    pub hdr_orientation: HdrOrientation,
}

impl Options {
    /// These options, or where they ask for no reading of their own, those by which a store was made: of what a reading
    /// says only; where the directions stand is asked anew.
    pub fn or_as_in(self, reading: Reading) -> Self {
        if Reading::of(&self) != Reading::default() {
            return self;
        }
        let Reading { adaptation, order, bottom_row_first, columns_as_rows } = reading;
        Self {
            adaptation,
            order,
            rows: if bottom_row_first { RowOrder::BottomFirst } else { RowOrder::TopFirst },
            hdr_orientation: if columns_as_rows { HdrOrientation::Atrium } else { HdrOrientation::Rules },
            ..self
        }
    }

    /// Refuses options that say nothing about an archive.
    fn expect_used(&self, uses: &[&str], source: &dyn Source) -> Result<()> {
        let given = [
            ("--pattern", self.pattern.is_some(), "pictures"),
            ("--table", self.table.is_some(), "pictures"),
            (
                "--order",
                self.order.is_some(),
                "BIG and MIF files, and for arrays without directions of their own",
            ),
            ("--rows", self.rows == RowOrder::BottomFirst, "Bonn's containers"),
            (
                "--hdr",
                self.hdr_orientation == HdrOrientation::Atrium,
                "Radiance pictures whose headers name X first",
            ),
        ];
        match given.into_iter().find(|(option, is_given, _)| *is_given && !uses.contains(option)) {
            Some((option, _, whose)) => Err(Error::usage(format!(
                "{}: {option} changes nothing, it is for {whose}; this is {}",
                source.path().display(),
                source.contents().format
            ))),
            None => Ok(()),
        }
    }
}

impl Reading {
    /// Every option by its name, so that a new one is not forgotten.
    fn of(options: &Options) -> Self {
        let Options {
            adaptation,
            // What these two find is in every recipe: the directions, and the digest of the images in their order.
            pattern: _,
            table: _,
            order,
            rows,
            hdr_orientation,
        } = options;
        Self {
            adaptation: adaptation.clone(),
            order: order.clone(),
            bottom_row_first: *rows == RowOrder::BottomFirst,
            columns_as_rows: *hdr_orientation == HdrOrientation::Atrium,
        }
    }
}

/// All images of a view, in the groups of lights that are best read at once: what a reader maps stays small.
///
/// # Errors
/// Names every unusable image of the view.
pub(crate) fn read_groups(source: &dyn Source, view: usize) -> Result<Vec<(Range<usize>, Samples)>> {
    let lights = source.contents().lights.len();
    let step = source.lights_at_once().clamp(1, lights.max(1));
    let (mut groups, mut problems) = (Vec::new(), Vec::new());
    for first in (0..lights).step_by(step) {
        let group = first..(first + step).min(lights);
        match source.read_images(view, group.clone()) {
            Ok(samples) => groups.push((group, samples)),
            Err(error) if error.kind() == ErrorKind::Input => problems.push(error.to_string()),
            Err(error) => return Err(error),
        }
    }
    problems.dedup();
    match problems.is_empty() {
        true => Ok(groups),
        false => Err(Error::list(ErrorKind::Input, problems.iter().flat_map(|problem| problem.lines()))),
    }
}

/// Recognises and opens an archive: the file or folder at one path, or the pieces at several.
///
/// # Errors
/// Says what was found where nothing is recognised.
pub fn open(paths: &[PathBuf], options: &Options) -> Result<Box<dyn Source>> {
    let limits = Limits::default();
    let mut reading = Reading::of(options);
    let single = match paths {
        [path] if path.is_file() => container::recognise(path, options, &limits)?,
        _ => None,
    };
    let (source, uses): (Box<dyn Source>, _) = match single {
        Some(recognised) => {
            // Databases of display values come from 8-bit images.
            reading.adaptation.samples = reading.adaptation.samples.or(recognised.samples);
            (recognised.source, recognised.uses)
        }
        None => {
            instead::expect_no_store(paths)?;
            let opened = pictures::Pictures::open(paths, options, limits);
            let pictures = opened.map_err(|error| instead::of_containers(paths).unwrap_or(error))?;
            let uses = pictures.uses();
            (Box::new(pictures), uses)
        }
    };
    options.expect_used(uses, source.as_ref())?;
    plausibility::require_channels(source.contents())
        .map_err(|error| error.context(source.path().display()))?;
    adapt::adapt(source, reading)
}

/// What a user should know of an archive that its samples do not depend on, a sentence each.
pub fn notes(source: &dyn Source) -> Vec<String> {
    let contents = source.contents();
    let elevations = source.reading().adaptation.elevations;
    let doubts = plausibility::near_directions(contents)
        .into_iter()
        .chain(plausibility::doubtful_angles(contents, elevations));
    source.notes().into_iter().chain(plausibility::single_channel(contents)).chain(doubts).collect()
}

/// The bytes of a small file beside an archive: a list, a table.
fn read_beside(path: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut file = files::regular(path)?.take(MAX_LIST_BYTES + 1);
    file.read_to_end(&mut bytes).map_err(|error| Error::io("read", path, error))?;
    list_of_bounded_size(&path.display().to_string(), &bytes)?;
    Ok(bytes)
}

/// Refuses a list that is too large to be one.
fn list_of_bounded_size(name: &str, bytes: &[u8]) -> Result<()> {
    if bytes.len() as u64 <= MAX_LIST_BYTES {
        return Ok(());
    }
    Err(Error::input(format!("{name}: got more than {MAX_LIST_BYTES} bytes, expected a list of pictures")))
}

/// SHA-256 of a file's bytes.
fn digest_of(path: &Path, context: &Context<'_>) -> Result<String> {
    let failed = |error| Error::io("read", path, error);
    let mut file = files::regular(path)?;
    let mut digest = Sha256::new();
    let mut piece = vec![0; DIGEST_STEP_BYTES];
    loop {
        context.check_stop()?;
        match file.read(&mut piece).map_err(failed)? {
            0 => return Ok(recipe::hexadecimal(&digest.finalize())),
            length => digest.update(&piece[..length]),
        }
    }
}
