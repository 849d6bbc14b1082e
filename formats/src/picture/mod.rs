//! Single pictures in the formats that laboratories use, told apart by their first bytes.
//!
//! Every reader is strict: a picture that is cut, or whose parts contradict each other, is an error and never a
//! picture with a grey half. [`header()`] decodes no pixel, [`check()`] walks the whole file, [`decode()`] reads it.
//!
//! | format | samples | channels | what [`check()`] does |
//! | --- | --- | --- | --- |
//! | JPEG | U8 | Y; R, G, B | walks the markers and scans, see [`jpeg::check`] |
//! | PNG | U8, U16 | Y; R, G, B | walks the chunks and verifies their CRC-32 |
//! | TIFF | U8, U16, F16, F32 | Y; R, G, B; C0, C1, ... | finds every strip or tile inside the file, with enough bytes |
//! | Radiance | F32 | R, G, B; X, Y, Z | **decodes**: only the run lengths tell where a scan line ends |
//! | OpenEXR | F16, F32 | as named | finds every chunk of the offset table, with enough bytes |
//!
//! An alpha channel is dropped if it is opaque everywhere and refused otherwise: what lies behind a
//! half-transparent pixel is not in the file. Profiles, gamma and primaries are not applied.

mod alpha;
pub(crate) mod aspect;
pub(crate) mod exif;
pub mod exr;
mod foreign;
mod hdr;
pub(crate) mod orientation;
pub mod png;
pub(crate) mod profile;
mod size;
mod tiff;
pub(crate) mod unapplied;
mod wavelength;
pub(crate) mod xmp;

pub use foreign::foreign;
pub use wavelength::wavelength_nm;

use crate::words::counted;
use crate::{Error, ErrorKind, Limits, Result, SampleType, Samples, jpeg};

/// The format of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// ITU-T T.81, baseline or progressive; see [`jpeg`].
    Jpeg,
    /// ISO/IEC 15948: any bit depth, grey, colour or palette, interlaced too.
    Png,
    /// TIFF 6.0 and BigTIFF: strips or tiles; uncompressed, LZW, deflate or PackBits.
    Tiff,
    /// Radiance RGBE or XYZE (`.hdr`, `.pic`).
    Hdr,
    /// OpenEXR 2: one flat part in scan lines or tiles, every compression but HTJ2K.
    Exr,
}

/// A decoded picture of any of the formats.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: u32,
    /// Rows; row 0 is the top.
    pub height: u32,
    /// Names of the channels: "Y"; "R", "G", "B"; or as the file names them (wavelengths).
    pub channels: Vec<String>,
    /// `[y, x, channel]`.
    pub samples: Samples,
}

impl Picture {
    /// For the writers: there is a sample for every pixel and channel.
    fn require_whole(&self) -> Result<()> {
        let pixels = u64::from(self.width).saturating_mul(u64::from(self.height));
        let expected =
            u64::try_from(self.channels.len()).map_or(u64::MAX, |channels| pixels.saturating_mul(channels));
        if expected == 0 || u64::try_from(self.samples.len()).ok() != Some(expected) {
            let found = counted(self.samples.len(), "sample");
            let wanted = format!("{} x {} x {} and not 0", self.height, self.width, self.channels.len());
            return Err(Error::new(ErrorKind::Argument, found, wanted));
        }
        Ok(())
    }
}

/// What the header of a picture says.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureHeader {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Names of the channels, as in [`Picture::channels`].
    pub channels: Vec<String>,
    /// Type of the samples.
    pub sample_type: SampleType,
    /// Samples are proportional to reflectance (Radiance, OpenEXR, TIFF of floats); else display values.
    pub linear: bool,
    /// A Radiance picture whose resolution line names X first, so that [`HdrOrientation`] matters.
    pub scanlines_are_columns: bool,
    /// How the picture asks a viewer to turn it (Exif in JPEG, `eXIf` in PNG, tag 274 in TIFF, XMP): 1..=8, 1 being as
    /// stored and what is meant where it says nothing. Samples are handed out as stored.
    pub orientation: u8,
    /// What the picture says of its colours, to stand before "is not applied", where that is not sRGB: the name of an
    /// ICC profile, a gamma, code points, primaries, levels of black and white.
    pub profile: Option<String>,
    /// What of the picture is read and what is not (layer, channels, window, crop, pixels that are not square), a
    /// sentence each.
    pub remarks: Vec<String>,
}

/// How a Radiance picture is read whose resolution line is `+X n -Y n`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum HdrOrientation {
    /// By the rules of the format: a scan line is a column, the first one at the left, from its top down.
    #[default]
    Rules,
    /// As the Bonn ATRIUM sets are read by their extractor: a scan line is a row, the first one at the bottom.
    /// Square pictures only, since for others the two numbers do not tell which is the length of a row.
    Atrium,
}

/// What a file does not say of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct DecodeOptions {
    /// Of Radiance pictures whose [`PictureHeader::scanlines_are_columns`].
    pub hdr_orientation: HdrOrientation,
}

/// The format that the first bytes announce, if it is one that is read here.
pub fn recognise(bytes: &[u8]) -> Option<Format> {
    const STARTS: [(&[u8], Format); 9] = [
        (b"\xFF\xD8\xFF", Format::Jpeg),
        (png::SIGNATURE, Format::Png),
        (b"II\x2A\0", Format::Tiff),
        (b"MM\0\x2A", Format::Tiff),
        (b"II\x2B\0", Format::Tiff),
        (b"MM\0\x2B", Format::Tiff),
        (b"#?RADIANCE\n", Format::Hdr),
        (b"#?RGBE\n", Format::Hdr),
        (exr::MAGIC, Format::Exr),
    ];
    STARTS.iter().find(|(start, _)| bytes.starts_with(start)).map(|&(_, format)| format)
}

/// Reads the header only: of what follows, nothing is looked at.
///
/// # Errors
/// Like [`decode()`], for the header.
pub fn header(bytes: &[u8], limits: &Limits) -> Result<PictureHeader> {
    match require_format(bytes)? {
        Format::Jpeg => jpeg::header(bytes, limits).map(|header| of_jpeg(header, bytes)),
        Format::Png => png::header(bytes, limits),
        Format::Tiff => tiff::header(bytes, limits),
        Format::Hdr => hdr::header(bytes, limits),
        Format::Exr => exr::header(bytes, limits),
    }
}

/// Walks the whole file and finds what [`decode()`] finds in its structure, without decoding a pixel where the
/// format allows that; see the table in the [module](self).
///
/// # Errors
/// Like [`decode()`], but for errors in compressed data and for alpha that is not opaque.
pub fn check(bytes: &[u8], limits: &Limits) -> Result<PictureHeader> {
    match require_format(bytes)? {
        Format::Jpeg => jpeg::check(bytes, limits).map(|header| of_jpeg(header, bytes)),
        Format::Png => png::check(bytes, limits),
        Format::Tiff => tiff::check(bytes, limits),
        Format::Hdr => hdr::check(bytes, limits),
        Format::Exr => exr::check(bytes, limits),
    }
}

/// [`decode_with()`] the default options.
///
/// # Errors
/// See [`decode_with()`].
pub fn decode(bytes: &[u8], limits: &Limits) -> Result<Picture> {
    decode_with(bytes, &DecodeOptions::default(), limits)
}

/// Decodes a picture.
///
/// # Errors
/// - [`ErrorKind::Malformed`]: cut anywhere, damaged, or contradicting itself.
/// - [`ErrorKind::Unsupported`]: no format that is known here, or a variant that is not read: several pictures in one
///   file, alpha that is not opaque, sample types other than those of [`SampleType`].
/// - [`ErrorKind::Limit`]: more pixels, channels or bytes than `limits` allows.
pub fn decode_with(bytes: &[u8], options: &DecodeOptions, limits: &Limits) -> Result<Picture> {
    match require_format(bytes)? {
        Format::Jpeg => {
            let image = jpeg::decode(bytes, limits)?;
            Ok(Picture {
                width: image.width,
                height: image.height,
                channels: grey_or_rgb(image.channels == 1),
                samples: Samples::U8(image.samples),
            })
        }
        Format::Png => png::decode(bytes, limits),
        Format::Tiff => tiff::decode(bytes, limits),
        Format::Hdr => hdr::decode(bytes, options.hdr_orientation, limits),
        Format::Exr => exr::decode(bytes, limits),
    }
}

fn require_format(bytes: &[u8]) -> Result<Format> {
    // A Canon raw file begins as a TIFF does.
    if let Some((what, way_out)) = foreign("", bytes) {
        return Err(Error::new(ErrorKind::Unsupported, what, format!("a picture that is read; {way_out}")));
    }
    recognise(bytes).ok_or_else(|| {
        let start = bytes.get(..bytes.len().min(8)).unwrap_or_default();
        Error::new(
            ErrorKind::Unsupported,
            format!("a file that starts with {start:02x?}"),
            "a picture in JPEG, PNG, TIFF, Radiance or OpenEXR format",
        )
        .at(0usize)
    })
}

fn of_jpeg(header: jpeg::Header, bytes: &[u8]) -> PictureHeader {
    PictureHeader {
        width: header.width,
        height: header.height,
        channels: grey_or_rgb(header.channels == 1),
        sample_type: SampleType::U8,
        linear: false,
        scanlines_are_columns: false,
        orientation: header.orientation,
        profile: jpeg::profile::profile(bytes),
        remarks: jpeg::profile::remarks(bytes),
    }
}

fn grey_or_rgb(grey: bool) -> Vec<String> {
    let names: &[&str] = if grey { &["Y"] } else { &["R", "G", "B"] };
    names.iter().map(|&name| name.to_owned()).collect()
}
