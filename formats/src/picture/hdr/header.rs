//! The text before the pixels of a Radiance picture: variables, an empty line, the resolution line.

use crate::picture::profile::of_chromaticities;
use crate::picture::size::{Size, unsupported};
use crate::picture::{HdrOrientation, aspect};
use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, Limits, Result, SampleType};

/// Longest line and longest header that are read; programs that process a picture add a line each.
const MAX_LINE: usize = 4096;
const MAX_LINES: usize = 1024;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axis {
    X,
    Y,
}

/// One half of the resolution line: `-Y 480`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Extent {
    axis: Axis,
    increasing: bool,
    len: u32,
}

#[derive(Debug, Clone)]
pub(super) struct Header {
    pub(super) width: u32,
    pub(super) height: u32,
    xyz: bool,
    /// Primaries that are not those of sRGB, in words.
    pub(super) profile: Option<String>,
    /// Of pixels that are not square.
    pub(super) remarks: Vec<String>,
    /// Product of all exposures and colour corrections, by channel.
    factors: [f64; 3],
    /// Scan lines follow each other along the first axis, pixels in a scan line along the second.
    extents: [Extent; 2],
}

impl Header {
    pub(super) fn read(reader: &mut Reader<'_>, limits: &Limits) -> Result<Header> {
        match line(reader)? {
            "#?RADIANCE" | "#?RGBE" => {}
            other => {
                return Err(Error::malformed(format!("{other:?}"), "\"#?RADIANCE\" or \"#?RGBE\"").at(0usize));
            }
        }
        let mut said = Said { xyz: None, profile: None, factors: [1.0; 3], aspect: 1.0 };
        for _ in 0..MAX_LINES {
            let at = reader.position();
            let text = line(reader)?;
            if text.is_empty() {
                return Header::read_resolution(reader, said, limits);
            }
            said.hear(text).map_err(|e| e.at(at))?;
        }
        Err(Error::malformed(format!("{MAX_LINES} lines"), "an empty line that ends the header")
            .at(reader.position()))
    }

    fn read_resolution(reader: &mut Reader<'_>, said: Said, limits: &Limits) -> Result<Header> {
        let at = reader.position();
        let Said { xyz: Some(xyz), profile, factors, aspect } = said else {
            return Err(Error::malformed("no FORMAT line", "one before the empty line").at(at));
        };
        // Primaries say nothing of X, Y and Z.
        let profile = profile.filter(|_| !xyz);
        let text = line(reader)?;
        let wrong =
            || Error::malformed(format!("the resolution line {text:?}"), "one like \"-Y 480 +X 640\"").at(at);
        let mut words = text.split_ascii_whitespace();
        let mut extent = || Extent::parse(words.next()?, words.next()?);
        let (Some(first), Some(second)) = (extent(), extent()) else { return Err(wrong()) };
        if words.next().is_some() {
            return Err(wrong());
        }
        let (width, height) = match (first.axis, second.axis) {
            (Axis::Y, Axis::X) => (second.len, first.len),
            (Axis::X, Axis::Y) => (first.len, second.len),
            _ => return Err(wrong()),
        };
        let size = Size::within((u64::from(width), u64::from(height)), 3, SampleType::F32, at, limits)?;
        // PIXASPECT is the height of a pixel over its width.
        let remarks = aspect::remark(1.0 / aspect, "PIXASPECT").into_iter().collect();
        let extents = [first, second];
        Ok(Header { width: size.width, height: size.height, xyz, profile, remarks, factors, extents })
    }

    pub(super) fn scanlines(&self) -> u32 {
        self.extents[0].len
    }

    pub(super) fn scanline_len(&self) -> usize {
        usize::try_from(self.extents[1].len).unwrap_or(usize::MAX)
    }

    /// The axis along which the pixels of a scan line lie.
    pub(super) fn scanline_axis(&self) -> Axis {
        self.extents[1].axis
    }

    pub(super) fn factors(&self) -> [f64; 3] {
        self.factors
    }

    pub(super) fn channel_names(&self) -> Vec<String> {
        let names = if self.xyz { ["X", "Y", "Z"] } else { ["R", "G", "B"] };
        names.map(str::to_owned).to_vec()
    }

    /// Where the pixels of the file belong.
    pub(super) fn placement(&self, orientation: HdrOrientation) -> Result<Placement> {
        let (width, height) = (self.width, self.height);
        let [first, second] = self.extents;
        // +X n -Y n
        let as_atrium = (first.axis, first.increasing, second.increasing) == (Axis::X, true, false);
        if orientation == HdrOrientation::Atrium && as_atrium {
            if width != height {
                let found = format!("{width} x {height} pixels in scan lines that are columns");
                return Err(unsupported(found, "a square picture for the reading of the ATRIUM sets"));
            }
            return Ok(Placement::new(width, [Axis::Y, Axis::X], [false, true], [height, width]));
        }
        // The sign tells whether x grows to the right and y grows upwards along the file.
        let forward = |extent: Extent| extent.increasing == (extent.axis == Axis::X);
        let axes = [first.axis, second.axis];
        Ok(Placement::new(width, axes, [forward(first), forward(second)], [first.len, second.len]))
    }
}

impl Extent {
    fn parse(sign_and_axis: &str, len: &str) -> Option<Extent> {
        let (increasing, axis) = match sign_and_axis {
            "+X" => (true, Axis::X),
            "-X" => (false, Axis::X),
            "+Y" => (true, Axis::Y),
            "-Y" => (false, Axis::Y),
            _ => return None,
        };
        // The standard parser takes a sign as well.
        let digits = len.bytes().all(|byte| byte.is_ascii_digit());
        let len = len.parse().ok().filter(|_| digits)?;
        Some(Extent { axis, increasing, len })
    }
}

/// Turns (scan line, position in it) into the number of a pixel, row by row from the top.
pub(super) struct Placement {
    start: usize,
    /// Added for each scan line, and for each position in it; wrapping, so that they may go backwards.
    steps: [usize; 2],
}

impl Placement {
    fn new(width: u32, axes: [Axis; 2], forward: [bool; 2], lens: [u32; 2]) -> Placement {
        let [width, first, second] =
            [width, lens[0], lens[1]].map(|n| usize::try_from(n).unwrap_or(usize::MAX));
        let mut start = 0usize;
        let mut steps = [0usize; 2];
        for (((step, axis), forward), len) in steps.iter_mut().zip(axes).zip(forward).zip([first, second]) {
            *step = if axis == Axis::X { 1 } else { width };
            if !forward {
                start = start.wrapping_add(step.wrapping_mul(len.wrapping_sub(1)));
                *step = step.wrapping_neg();
            }
        }
        Placement { start, steps }
    }

    pub(super) fn pixel(&self, scanline: usize, position: usize) -> usize {
        let along = self.steps[0].wrapping_mul(scanline).wrapping_add(self.steps[1].wrapping_mul(position));
        self.start.wrapping_add(along)
    }
}

/// The next line without its end.
fn line<'a>(reader: &mut Reader<'a>) -> Result<&'a str> {
    let at = reader.position();
    let rest = reader.rest();
    let within = rest.get(..rest.len().min(MAX_LINE)).unwrap_or_default();
    let Some(len) = within.iter().position(|&byte| byte == b'\n') else {
        let found = format!("{} without an end of line", counted(within.len(), "byte"));
        return Err(Error::malformed(found, "a line of the header").at(at));
    };
    let text = reader.take(len)?;
    reader.take(1)?;
    std::str::from_utf8(text).map_err(|_| Error::malformed("a line that is no text", "text (UTF-8)").at(at))
}

/// What the variables of a header say.
struct Said {
    xyz: Option<bool>,
    profile: Option<String>,
    factors: [f64; 3],
    aspect: f64,
}

/// The variables that say what samples and pixels mean.
const VARIABLES: [&str; 6] = ["FORMAT", "EXPOSURE", "COLORCORR", "PRIMARIES", "GAMMA", "PIXASPECT"];

impl Said {
    /// One `NAME=value` line, blanks and case of the name aside; comments, commands and other names say nothing about the
    /// samples. Nor do lines that begin with a tab: these were copied from the pictures that this one was made of.
    fn hear(&mut self, text: &str) -> Result<()> {
        if text.starts_with(['\t', '#']) {
            return Ok(());
        }
        let Some((name, value)) = text.split_once('=') else { return expect_no_variable(text) };
        let Some(name) = VARIABLES.into_iter().find(|known| known.eq_ignore_ascii_case(name.trim())) else {
            return Ok(());
        };
        let numbers = || -> Option<Vec<f64>> {
            let list = value.split_ascii_whitespace().map(|word| word.parse().ok());
            list.collect::<Option<Vec<f64>>>().filter(|list| list.iter().all(|number| number.is_finite()))
        };
        let positive = |wanted: usize| {
            let are =
                |list: &Vec<f64>| list.len() == wanted && list.iter().all(|n| n.is_normal() && *n > 0.0);
            numbers().filter(are).ok_or_else(|| {
                let expected = if wanted == 1 { "a positive number" } else { "3 positive numbers" };
                Error::malformed(format!("{text:?}"), expected)
            })
        };
        match name {
            "FORMAT" => {
                let found = match value.trim() {
                    "32-bit_rle_rgbe" => false,
                    "32-bit_rle_xyze" => true,
                    other => {
                        let found = format!("FORMAT={other}");
                        return Err(unsupported(found, "32-bit_rle_rgbe or 32-bit_rle_xyze"));
                    }
                };
                if self.xyz.is_some_and(|before| before != found) {
                    return Err(Error::malformed("two FORMAT lines that differ", "one"));
                }
                self.xyz = Some(found);
            }
            "EXPOSURE" | "COLORCORR" => {
                let numbers = positive(if name == "EXPOSURE" { 1 } else { 3 })?;
                for (factor, number) in self.factors.iter_mut().zip(numbers.iter().cycle()) {
                    *factor *= number;
                }
                if !self.factors.iter().all(|factor| factor.is_normal()) {
                    let expected = "a product within double precision";
                    return Err(Error::malformed("exposures out of range", expected));
                }
            }
            "PIXASPECT" => self.aspect *= positive(1)?.first().copied().unwrap_or(1.0),
            "PRIMARIES" => {
                self.profile = match numbers() {
                    Some(numbers) => of_chromaticities(&numbers),
                    None => Some(format!("the primaries {:?}", value.trim())),
                };
            }
            // GAMMA is not of the format, but written by common code; what another value would mean is not agreed upon.
            _ if value.trim().parse() != Ok(1.0f64) => {
                return Err(unsupported(format!("{text:?}"), "GAMMA=1, samples in linear light"));
            }
            _ => {}
        }
        Ok(())
    }
}

/// That a line without `=` is no variable that was written in another way: `EXPOSURE 2`, `gamma: 2.2`.
fn expect_no_variable(text: &str) -> Result<()> {
    let end = text.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (word, rest) = text.split_at_checked(end).unwrap_or((text, ""));
    let value = rest.trim_matches(|c: char| c == ':' || c.is_whitespace());
    let number = value.split_ascii_whitespace().next().is_some_and(|first| first.parse::<f64>().is_ok());
    if number && VARIABLES.iter().any(|known| known.eq_ignore_ascii_case(word)) {
        return Err(Error::malformed(format!("{text:?}"), "a variable as NAME=value"));
    }
    Ok(())
}
