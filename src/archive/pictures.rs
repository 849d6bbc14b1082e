//! An archive of single pictures, one for each pair of directions.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use btfkit_formats::picture::{self, DecodeOptions, PictureHeader};
use btfkit_formats::{Angles, Assumption, Catalogue, Contents, Limits, SampleType, Samples};

use super::catalogue::{self, Found};
use super::files::Files;
use super::{Options, Source};
use crate::error::{Error, ErrorKind, Result};
use crate::run::units::each_at_once;
use crate::run::{Context, recipe};
use crate::words::counted;

/// Problems that an error names one by one.
const NAMED_PROBLEMS: usize = 20;

/// Pictures whose directions are known.
pub(super) struct Pictures {
    path: PathBuf,
    files: Files,
    /// Which file is the image of a view and a light.
    catalogue: Catalogue,
    /// What to know of the files that are no images.
    notes: Vec<String>,
    contents: Contents,
    /// What the first picture asks for; no picture is turned.
    orientation: u8,
    /// Whether the first picture's scan lines are columns, so that there are two ways to read it.
    scanlines_are_columns: bool,
    /// What the first picture says of its colours; nothing of it is applied.
    profile: Option<String>,
    /// What of the first picture is read and what is not.
    remarks: Vec<String>,
    /// What the largest picture takes while it is decoded.
    bytes_in_use: u64,
    decoding: DecodeOptions,
    limits: Limits,
    /// CRC-32 of each image when all were checked, in the order of the catalogue's.
    checked: OnceLock<Vec<u32>>,
}

impl Pictures {
    pub(super) fn open(paths: &[PathBuf], options: &Options, limits: Limits) -> Result<Self> {
        let path = paths.first().cloned().unwrap_or_default();
        let files = Files::list(paths, &limits)?;
        let Found { catalogue, format, mut assumptions, lists } =
            catalogue::find(&path, &files, options, &limits)?;
        let directions = |angles: &[Angles]| angles.iter().map(|a| a.direction()).collect::<Vec<_>>();
        let (views, lights) = (directions(catalogue.views()), directions(catalogue.lights()));
        let images = catalogue.images();
        let first = images.first().copied().ok_or_else(|| Error::input("no images"))?;
        let header = picture::header(&files.bytes(first)?, &limits)
            .map_err(|error| Error::from(error.in_entry(files.name(first))).context(path.display()))?;
        files.release(first);
        if !header.linear {
            assumptions.push(Assumption::transfer("the pictures' transfer curve is sRGB"));
        }
        if let Some(profile) = &header.profile {
            assumptions.push(format!("{profile}, which the pictures state, is not applied").into());
        }
        if header.scanlines_are_columns {
            assumptions
                .push(format!("scan lines that are columns: read as {:?}", options.hdr_orientation).into());
        }
        if header.orientation != 1 {
            let asked = header.orientation;
            assumptions.push(
                format!("the orientation {asked} that the pictures ask for is not applied: rows and columns are as stored")
                    .into(),
            );
        }
        assumptions.extend(header.remarks.iter().cloned().map(Assumption::from));
        let contents = Contents {
            format,
            width: header.width,
            height: header.height,
            channels: header.channels.clone(),
            sample_type: header.sample_type,
            views,
            lights,
            linear: header.linear,
            cosine_included: true,
            assumptions,
            remarks: Vec::new(),
        };
        let decoding = DecodeOptions { hdr_orientation: options.hdr_orientation };
        let bytes_in_use = images.iter().map(|&file| files.bytes_in_use(file)).max().unwrap_or(0);
        let notes = notes_of(&files, images, catalogue.ignored().saturating_sub(lists) + files.hidden());
        let PictureHeader { orientation, scanlines_are_columns, profile, remarks, .. } = header;
        Ok(Self {
            path,
            files,
            catalogue,
            notes,
            contents,
            orientation,
            scanlines_are_columns,
            profile,
            remarks,
            bytes_in_use,
            decoding,
            limits,
            checked: OnceLock::new(),
        })
    }

    /// The options that these pictures have a use for.
    pub(super) fn uses(&self) -> &'static [&'static str] {
        if self.scanlines_are_columns {
            &["--pattern", "--table", "--hdr"]
        } else {
            &["--pattern", "--table"]
        }
    }

    /// Checks the structure of one image; returns its checksum.
    fn check_image(&self, file: usize) -> Result<u32> {
        let bytes = self.files.bytes(file)?;
        let checksum = self.files.checksum(file, &bytes);
        let found =
            picture::check(&bytes, &self.limits).map_err(|error| error.in_entry(self.files.name(file)))?;
        self.expect_like_first(file, (found.width, found.height, &found.channels, found.sample_type))?;
        if found.orientation != self.orientation {
            return Err(Error::input(format!(
                "{}: asks for the orientation {}, expected {} like the first image; orientations are not applied, \
                 so take them out of all pictures (exiftool -Orientation= *)",
                self.files.name(file),
                found.orientation,
                self.orientation
            )));
        }
        if found.scanlines_are_columns != self.scanlines_are_columns {
            let told = |are_columns: bool| if are_columns { "X" } else { "Y" };
            return Err(Error::input(format!(
                "{}: names {} first in its header, expected {} like the first image; write all pictures alike",
                self.files.name(file),
                told(found.scanlines_are_columns),
                told(self.scanlines_are_columns)
            )));
        }
        if found.profile != self.profile {
            let told =
                |profile: &Option<String>| profile.clone().unwrap_or_else(|| "sRGB or nothing".to_owned());
            return Err(Error::input(format!(
                "{}: states {} for its colours, expected {} like the first image; profiles are not applied, so convert \
                 all pictures to one",
                self.files.name(file),
                told(&found.profile),
                told(&self.profile)
            )));
        }
        if found.remarks != self.remarks {
            let told = |remarks: &[String]| match remarks {
                [] => "the whole file is the picture".to_owned(),
                list => list.join("; "),
            };
            return Err(Error::input(format!(
                "{}: got {}, expected, like the first image, {}",
                self.files.name(file),
                told(&found.remarks),
                told(&self.remarks)
            )));
        }
        Ok(checksum)
    }

    fn expect_like_first(&self, file: usize, found: (u32, u32, &Vec<String>, SampleType)) -> Result<()> {
        let Contents { width, height, channels, sample_type, .. } = &self.contents;
        if found == (*width, *height, channels, *sample_type) {
            return Ok(());
        }
        let told = |(width, height, channels, sample_type): (u32, u32, &Vec<String>, SampleType)| {
            format!("{width}x{height} of {} {}", channels.join(" "), sample_type.name())
        };
        Err(Error::input(format!(
            "{}: got {}, expected {} like the first image",
            self.files.name(file),
            told(found),
            told((*width, *height, channels, *sample_type))
        )))
    }

    /// File of an image, and its number among all that are read.
    fn image(&self, view: usize, light: usize) -> Result<(usize, usize)> {
        let place = self.catalogue.place(view, light);
        place
            .and_then(|place| Some((*self.catalogue.images().get(place)?, place)))
            .ok_or_else(|| Error::internal(format!("no image of view {view} and light {light}")))
    }

    fn decode(&self, file: usize, number: usize) -> Result<Samples> {
        let bytes = self.files.bytes(file)?;
        let checked = self.checked.get().and_then(|all| all.get(number));
        if checked.is_some_and(|&checked| checked != self.files.checksum(file, &bytes)) {
            return Err(Error::input(format!(
                "{}: the picture was changed after it had been checked",
                self.files.name(file)
            )));
        }
        let image = picture::decode_with(&bytes, &self.decoding, &self.limits)
            .map_err(|error| error.in_entry(self.files.name(file)))?;
        let found = (image.width, image.height, &image.channels, image.samples.sample_type());
        self.expect_like_first(file, found)?;
        Ok(image.samples)
    }
}

impl Source for Pictures {
    fn path(&self) -> &Path {
        &self.path
    }

    fn contents(&self) -> &Contents {
        &self.contents
    }

    fn lights_at_once(&self) -> usize {
        1
    }

    fn bytes_beside_image(&self) -> u64 {
        self.bytes_in_use
    }

    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    fn read_images(&self, view: usize, lights: Range<usize>) -> Result<Samples> {
        let mut samples = Samples::none(self.contents.sample_type);
        let mut problems = Vec::new();
        for light in lights {
            let (file, number) = self.image(view, light)?;
            match self.decode(file, number) {
                // The only image: no copy.
                Ok(image) if samples.is_empty() => samples = image,
                Ok(image) => {
                    samples.append(&image);
                }
                Err(error) => problems.push(error.to_string()),
            }
            self.files.release(file);
        }
        fail_on(&self.path, &problems)?;
        Ok(samples)
    }

    fn check(&self, context: &Context<'_>) -> Result<String> {
        let largest = self.bytes_in_use;
        context.require(&format!("checking pictures of up to {} MiB", largest.div_ceil(1 << 20)), largest)?;
        let checked: Vec<Result<u32>> = context.install(|| {
            each_at_once(self.catalogue.images(), largest, context, |&file| {
                context.check_stop()?;
                let checksum = self.check_image(file);
                self.files.release(file);
                checksum
            })
        });
        context.check_stop()?;
        let problems: Vec<String> =
            checked.iter().filter_map(|c| Some(c.as_ref().err()?.to_string())).collect();
        fail_on(&self.path, &problems)
            .map_err(|error| error.hint("replace these images and run the same command again"))?;
        let checksums: Vec<u32> = checked.into_iter().flatten().collect();
        let bytes: Vec<u8> = checksums.iter().copied().flat_map(u32::to_le_bytes).collect();
        // What is read from now on must be what was checked, also where the source is checked again.
        let found = self.checked.get_or_init(|| checksums.clone());
        if *found != checksums {
            return Err(Error::input(format!("{}: pictures were changed meanwhile", self.path.display())));
        }
        Ok(recipe::digest_bytes(&bytes))
    }
}

/// How many files are no images, and which of them are pictures.
fn notes_of(files: &Files, images: &[usize], ignored: usize) -> Vec<String> {
    let mut left = vec![true; files.len()];
    images.iter().for_each(|&number| left[number] = false);
    let count = (ignored > 0).then(|| format!("{} ignored", counted(ignored, "other file")));
    count.into_iter().chain(catalogue::left_out(files, left.into_iter())).collect()
}

/// One error that names all problems.
pub(super) fn fail_on(archive: &Path, problems: &[String]) -> Result<()> {
    if problems.is_empty() {
        return Ok(());
    }
    let mut lines = vec![format!("{}: {}", archive.display(), counted(problems.len(), "unusable image"))];
    lines.extend(problems.iter().take(NAMED_PROBLEMS).map(|problem| format!("  {problem}")));
    if problems.len() > NAMED_PROBLEMS {
        lines.push(format!("  and {} more", problems.len() - NAMED_PROBLEMS));
    }
    Err(Error::list(ErrorKind::Input, lines))
}
