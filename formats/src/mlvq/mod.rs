//! MLVQ databases: a whole 81 x 81 BTF in a few megabytes, by multi-level vector quantisation (Havran, Filip and
//! Myszkowski 2010).
//!
//! A file `binary.btf` is 18 lines of text, the first of them `4627`, and 13 tables. It has nothing to do with the
//! `.btf` files of Bonn. The directions are those of UBO2003, and so is the convention of azimuths: decoded pictures
//! agree with the original photographs.
//!
//! Tables of real numbers are stored in bytes, of which a zero may mean the table's minimum or its maximum: see
//! [`ZeroBytes`].

mod functions;
mod header;
mod table;
mod zero_bytes;

use std::ops::Range;

use functions::Functions;
use header::{Header, SIGNATURE};
use zero_bytes::Resolved;

pub use zero_bytes::ZeroBytes;

use crate::reader::Reader;
use crate::ubo2003::{Angles, directions_81};
use crate::words::counted;
use crate::{Assumption, Contents, Direction, Images, Limits, Result, SampleType, Samples, request};

/// Whether the first line is that of a database.
pub fn recognise(bytes: &[u8]) -> bool {
    bytes.starts_with(SIGNATURE)
}

/// An open database. It holds the tables, a few times the size of the file.
#[derive(Debug, Clone)]
pub struct Database {
    contents: Contents,
    functions: Functions,
    directions: Vec<Angles>,
    opened_bytes: usize,
    limits: Limits,
}

impl Database {
    /// Reads header and tables of `bytes`, the whole file, and resolves the zero bytes: by `known` where it says
    /// something (a file `zero_bytes.txt` beside the database; see [`ZeroBytes::parse`]), else by a rule.
    ///
    /// The rule takes for every entry the end of its table's range that is nearer to a wanted value. Rows of 1D
    /// luminance sum to 1; a scale makes the mean of the function that it scales that of its neighbours over alpha,
    /// view theta, view phi or the surface; a colour is near to those beside it over beta. Each table has its minimum
    /// and its maximum at least once.
    ///
    /// # Errors
    /// [`ErrorKind::Malformed`](crate::ErrorKind::Malformed) for whatever breaks the format, bytes after the last table
    /// included; [`ErrorKind::Unsupported`](crate::ErrorKind::Unsupported) for several materials, other numbers of
    /// directions, HDR or other codings; [`ErrorKind::Argument`](crate::ErrorKind::Argument) where `known` contradicts
    /// a table: places that it has not, values that are neither end of its range, or not that of a byte that is not
    /// ambiguous; [`ErrorKind::Limit`](crate::ErrorKind::Limit) for too many pixels.
    pub fn open(bytes: &[u8], known: &ZeroBytes, limits: &Limits) -> Result<Database> {
        let mut reader = Reader::new(bytes);
        let header = Header::read(&mut reader, limits)?;
        let mut functions = Functions::read(&mut reader, &header)?;
        let resolved = zero_bytes::resolve_all(&mut functions, known)?;
        let directions = directions_81();
        let list: Vec<Direction> =
            directions.iter().map(|a| Direction::from_degrees(a.theta_deg(), a.phi_deg())).collect();
        let contents = Contents {
            format: format!("MLVQ database, {}", counted(header.functions_4d, "reflectance function")),
            width: header.width,
            height: header.height,
            channels: ["R", "G", "B"].map(String::from).to_vec(),
            sample_type: SampleType::F32,
            views: list.clone(),
            lights: list,
            linear: false,
            cosine_included: true,
            assumptions: assumptions(resolved),
            remarks: vec![("material".to_owned(), header.name)],
        };
        Ok(Database { contents, functions, directions, opened_bytes: bytes.len(), limits: limits.clone() })
    }
}

fn assumptions(resolved: Resolved) -> Vec<Assumption> {
    let mut list = vec![
        Assumption::transfer(
            "The samples are display values through the sRGB curve: the photographs that were compressed are 8-bit and say nothing.",
        ),
        Assumption::cosine("The cosine of the light's angle is in the samples, as it is in UBO2003."),
        "The directions are the 81 of UBO2003, as the file gives only their number.".into(),
    ];
    let Resolved { known, by_rule } = resolved;
    if known > 0 {
        list.push(
            format!("Ambiguous zero bytes of the tables, read as zero_bytes.txt says: {known}.").into(),
        );
    }
    if by_rule > 0 {
        list.push(format!(
            "Ambiguous zero bytes of the tables, resolved by continuity: {by_rule}. Each is its table's minimum or maximum, \
             whichever fits its neighbours."
        ).into());
    }
    list
}

impl Images for Database {
    fn contents(&self) -> &Contents {
        &self.contents
    }

    fn read_images(&self, bytes: &[u8], view: usize, lights: Range<usize>) -> Result<Samples> {
        request::check(&self.contents, self.opened_bytes, bytes, view, &lights)?;
        let count = request::samples(&self.contents, lights.len(), &self.limits)?;
        let mut samples = vec![0.0; count];
        let lights = self.directions.get(lights).unwrap_or(&[]);
        if let Some(&view) = self.directions.get(view)
            && !lights.is_empty()
        {
            let view = self.functions.view(view);
            let image_samples = count.checked_div(lights.len()).unwrap_or(0);
            for (image, &light) in samples.chunks_exact_mut(image_samples).zip(lights) {
                self.functions.fill(&self.functions.evaluate(&view, light), image);
            }
        }
        Ok(Samples::F32(samples))
    }
}

/// Samples of a database as 8-bit display codes, rounded, and clipped at 255: as the photographs were that it was made
/// from.
///
/// ```
/// assert_eq!(btfkit_formats::mlvq::display_codes(&[0.0, 0.5, 1.0, 1.3]), [0, 128, 255, 255]);
/// ```
pub fn display_codes(samples: &[f32]) -> Vec<u8> {
    samples.iter().map(|&value| (value * 255.0).round() as u8).collect()
}
