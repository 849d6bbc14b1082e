//! The 18 lines of text that a database begins with.

use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, ErrorKind, Limits, Result, request};

/// Longest line that is looked for; published ones have 170 characters.
const MAX_LINE_BYTES: usize = 4096;

/// First line of every database.
pub(super) const SIGNATURE: &[u8] = b"4627\n";

/// Sizes of all tables. Functions are numbered per level: 1D over beta, 2D over alpha, 3D over the view's
/// theta, 4D over the view's phi.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Header {
    pub(super) name: String,
    pub(super) width: u32,
    pub(super) height: u32,
    /// Nodes of beta are even in its sine; else in beta itself.
    pub(super) even_in_sine: bool,
    pub(super) beta_nodes: usize,
    pub(super) alpha_nodes: usize,
    pub(super) theta_nodes: usize,
    pub(super) phi_nodes: usize,
    pub(super) luminances_1d: usize,
    pub(super) colors: usize,
    pub(super) color_rows: usize,
    pub(super) functions_2d: usize,
    pub(super) luminances_2d: usize,
    pub(super) colors_2d: usize,
    pub(super) functions_3d: usize,
    pub(super) functions_4d: usize,
}

/// One line, without its end, and where it starts.
struct Line<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Line<'a> {
    fn read(reader: &mut Reader<'a>) -> Result<Line<'a>> {
        let at = reader.position();
        let rest = reader.rest();
        let Some(length) = rest.iter().take(MAX_LINE_BYTES).position(|&byte| byte == b'\n') else {
            return Err(Error::malformed("no end of a header line", "a line feed").at(at));
        };
        let text = reader.take(length)?;
        reader.take(1)?;
        Ok(Line { text, at })
    }

    fn shown(&self) -> String {
        format!("{:?}", String::from_utf8_lossy(self.text))
    }

    fn malformed(&self, expected: &'static str) -> Error {
        Error::malformed(self.shown(), expected).at(self.at)
    }

    fn words(&self) -> impl DoubleEndedIterator<Item = &'a [u8]> {
        self.text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
    }

    fn numbers<const N: usize>(&self, expected: &'static str) -> Result<[i64; N]> {
        let numbers: Option<Vec<i64>> = self.words().map(number).collect();
        numbers.and_then(|list| list.try_into().ok()).ok_or_else(|| self.malformed(expected))
    }

    /// The only value that this reader understands.
    fn require(&self, value: i64, what: &'static str) -> Result<()> {
        let [found] = self.numbers("one number")?;
        if found == value {
            return Ok(());
        }
        let error = Error::new(ErrorKind::Unsupported, format!("{what} {found}"), value.to_string());
        Err(error.at(self.at))
    }
}

fn number(word: &[u8]) -> Option<i64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

impl Header {
    /// Reads all lines; the reader then stands at the first table.
    pub(super) fn read(reader: &mut Reader<'_>, limits: &Limits) -> Result<Header> {
        let signature = Line::read(reader)?;
        if signature.text != SIGNATURE.trim_ascii_end() {
            return Err(signature.malformed("the line 4627 of an MLVQ database"));
        }
        Line::read(reader)?.require(1, "format")?;
        Line::read(reader)?; // the encoder's own path
        Line::read(reader)?.require(1, "number of materials that are loaded")?;
        Line::read(reader)?.require(1, "number of materials")?;
        Line::read(reader)?.require(1, "flag of shared tables")?;
        Line::read(reader)?.require(0, "flag of 3D and 4D functions")?;
        Line::read(reader)?.require(0, "flag of compactness")?;
        Line::read(reader)?.require(2, "number of colour planes")?;
        Line::read(reader)?.require(81, "number of views")?;
        Line::read(reader)?.require(81, "number of lights")?;
        Line::read(reader)?; // tile size of the encoder

        let shape = Line::read(reader)?;
        let [sine, beta, z0, alpha, z1, theta, z2, phi, z3, z4, z5, coding] =
            shape.numbers("12 numbers of the parametrisation")?;
        if [z0, z1, z2, z3, z4, z5, coding].iter().any(|&flag| flag != 0) || !(0..=1).contains(&sine) {
            let expected = "`0/1 nB 0 nA 0 nT 0 nP 0 0 0 0`";
            return Err(Error::new(ErrorKind::Unsupported, shape.shown(), expected).at(shape.at));
        }
        let nodes = |count: i64, least: usize| match usize::try_from(count) {
            Ok(count) if (least..=360).contains(&count) => Ok(count),
            _ => {
                let expected = format!("{least} to 360");
                Err(Error::new(
                    ErrorKind::Unsupported,
                    format!("{} of an angle", counted(count, "node")),
                    expected,
                )
                .at(shape.at))
            }
        };
        Line::read(reader)?; // 10 zeros

        let sizes = Line::read(reader)?;
        let [n1, colors, color_rows, n2, n2_luminance, n2_color, n3, zero3, n4, zero4] =
            sizes.numbers("10 numbers of table sizes")?;
        if zero3 != 0 || zero4 != 0 {
            let expected = "zeros at the 8th and 10th place";
            return Err(Error::new(ErrorKind::Unsupported, sizes.shown(), expected).at(sizes.at));
        }
        let rows = |count: i64| match usize::try_from(count) {
            Ok(count) if count > 0 => Ok(count),
            _ => Err(sizes.malformed("positive table sizes")),
        };
        Line::read(reader)?; // the encoder's metric
        Line::read(reader)?;

        let last = Line::read(reader)?;
        let mut from_the_end = last.words().rev();
        let expected = "a name, three paths, row and column offset, rows, columns, HDR scale";
        let hdr = from_the_end.next().and_then(|word| std::str::from_utf8(word).ok()?.parse::<f64>().ok());
        let (columns, rows_y) = (from_the_end.next().and_then(number), from_the_end.next().and_then(number));
        let (Some(hdr), Some(width), Some(height), Some(name)) = (hdr, columns, rows_y, last.words().next())
        else {
            return Err(last.malformed(expected));
        };
        if hdr != 0.0 {
            return Err(Error::new(ErrorKind::Unsupported, format!("HDR scale {hdr}"), "0: display values")
                .at(last.at));
        }
        let side = |side: i64| u64::try_from(side).map_err(|_| last.malformed(expected));
        let (width, height) =
            request::plane(side(width)?, side(height)?, 3, limits).map_err(|error| error.at(last.at))?;
        Ok(Header {
            name: String::from_utf8_lossy(name).into_owned(),
            width,
            height,
            even_in_sine: sine == 1,
            beta_nodes: nodes(beta, 3)?,
            alpha_nodes: nodes(alpha, 2)?,
            theta_nodes: nodes(theta, 2)?,
            phi_nodes: nodes(phi, 1)?,
            luminances_1d: rows(n1)?,
            colors: rows(colors)?,
            color_rows: rows(color_rows)?,
            functions_2d: rows(n2)?,
            luminances_2d: rows(n2_luminance)?,
            colors_2d: rows(n2_color)?,
            functions_3d: rows(n3)?,
            functions_4d: rows(n4)?,
        })
    }
}
