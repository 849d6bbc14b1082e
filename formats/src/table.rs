//! A table beside the pictures: one row for each, its file and its directions.
//!
//! CSV with a header line. Columns, in any order and case: `file`; `theta_i`, `phi_i` of the light;
//! `theta_v`, `phi_v` of the view, all in degrees. A direction may be a vector `x_i`, `y_i`, `z_i` (`x_v`
//! ...) of any length instead. Without columns of the view all pictures have the frontal one. Other columns
//! are ignored, but for those whose names are of directions (`theta_o`, `Theta (deg)`), which are refused; so are lines that
//! start with `#` and empty ones. Columns are separated by comma, semicolon or
//! tab; numbers have a decimal point; the text is UTF-8, or UTF-16 with a byte order mark. Frame as everywhere: x right, y up, z out of the surface, phi
//! counter-clockwise from +x.
//!
//! `file` is a path inside the table's folder. Of a path that is absolute, has a drive or climbs by `..`
//! (a table from another machine) the last part counts; so a table never reaches out of its folder.

use crate::fields::{Field, Forms};
use crate::file_name::{inside_folder, parts_of, repeated};
use crate::text::utf8;
use crate::words::counted;
use crate::{Error, ErrorKind, Limits, Pair, Result};

/// The rows of a table, in its order.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// One for each picture; no file is there twice.
    pub rows: Vec<Row>,
    /// Whether the table gives views; else all are frontal.
    pub has_view: bool,
}

/// One picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Path inside the table's folder, parts separated by `/`.
    pub file: String,
    /// All folders that the table names and the file, separated by `/`, without a drive and what `..` climbs out of.
    pub path: String,
    /// Its directions.
    pub pair: Pair,
    /// Line in the table, the first is 1.
    pub line: u64,
}

const SEPARATORS: [(u8, &str); 3] = [(b',', "commas"), (b';', "semicolons"), (b'\t', "tabs")];

const FILE: &str = "file";

/// Where in a row what stands.
struct Columns {
    file: usize,
    fields: Vec<(Field, usize)>,
    forms: Forms,
}

/// Reads a table. Pairs that are missing or double are found by
/// [`Catalogue::from_pairs`](crate::Catalogue::from_pairs).
///
/// # Errors
/// [`ErrorKind::Malformed`], with line and column: no header with the columns that are needed, a row with
/// more or fewer columns than the header, a number that is none or out of range, a file without a usable name or twice.
/// [`ErrorKind::Limit`]: more rows than [`Limits::max_entries`].
pub fn read(bytes: &[u8], limits: &Limits) -> Result<Table> {
    let text = utf8(bytes)?;
    let bytes = &*text;
    let (mut reader, columns) = open(bytes)?;
    let mut rows: Vec<Row> = Vec::new();
    for record in reader.byte_records() {
        let record = record.map_err(|error| translate(&error, bytes))?;
        if u64::try_from(rows.len()).unwrap_or(u64::MAX) >= limits.max_entries {
            let found = format!("more than {}", counted(limits.max_entries, "row"));
            return Err(Error::new(ErrorKind::Limit, found, "a table within the limit of entries"));
        }
        rows.push(columns.row(&record, bytes)?);
    }
    if rows.is_empty() {
        return Err(Error::malformed("a header and no row", "one row for each picture"));
    }
    if let Some((first, again)) = repeated(rows.iter().map(|row| row.file.as_str()))
        && let (Some(first), Some(again)) = (rows.get(first), rows.get(again))
    {
        let found = format!("line {}: {:?} again, which is in line {}", again.line, again.file, first.line);
        return Err(Error::malformed(found, "every file once"));
    }
    Ok(Table { rows, has_view: columns.forms.has_view() })
}

/// The reader behind its header, by the separator that gives the columns.
fn open(bytes: &[u8]) -> Result<(csv::Reader<&[u8]>, Columns)> {
    let mut best: Option<(usize, Error)> = None;
    for (separator, name) in SEPARATORS {
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(separator)
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(bytes);
        let header = reader.byte_headers().map_err(|error| translate(&error, bytes))?;
        // The separator that splits most is the one whose problem is worth telling.
        let split = header.len();
        match Columns::of(header) {
            Ok(columns) => return Ok((reader, columns)),
            Err(found) => {
                if best.as_ref().is_none_or(|(most, _)| split > *most) {
                    let found =
                        format!("a header line of {} between {name}, {found}", counted(split, "column"));
                    let expected = "columns file, theta_i, phi_i (or x_i, y_i, z_i), and theta_v, phi_v if views vary, \
                                    all angles in degrees; rename the columns, or take others out";
                    best = Some((split, Error::malformed(found, expected)));
                }
            }
        }
    }
    Err(best.map_or_else(|| Error::malformed("nothing", "a table"), |(_, error)| error))
}

impl Columns {
    /// Sorts out the header; else what is wrong with it.
    fn of(header: &csv::ByteRecord) -> std::result::Result<Columns, String> {
        let names: Vec<String> =
            header.iter().map(|name| String::from_utf8_lossy(name).into_owned()).collect();
        let mut files = names.iter().enumerate().filter(|(_, name)| name.eq_ignore_ascii_case(FILE));
        let file = match (files.next(), files.next()) {
            (Some((file, _)), None) => file,
            (None, _) => return Err("none of them file".to_owned()),
            _ => return Err("file twice".to_owned()),
        };
        let unread = |name: &&String| Field::named(name).is_none() && looks_like_direction(name);
        if let Some(name) = names.iter().find(unread) {
            return Err(format!("of which {name:?} is named as a direction is, but not as one that is read"));
        }
        let fields: Vec<(Field, usize)> =
            names.iter().zip(0..).filter_map(|(name, column)| Some((Field::named(name)?, column))).collect();
        let given: Vec<Field> = fields.iter().map(|&(field, _)| field).collect();
        Ok(Columns { file, forms: Forms::of(&given)?, fields })
    }

    fn row(&self, record: &csv::ByteRecord, bytes: &[u8]) -> Result<Row> {
        let (line, byte) = start(record.position(), bytes);
        let wrong = |column: &str, found: String, expected: &'static str| {
            Error::malformed(format!("line {line}, column {column}: {found}"), expected).at(byte)
        };
        let cell = |column: usize| record.get(column).unwrap_or_default();
        let given = cell(self.file);
        let given_text = std::str::from_utf8(given).ok();
        let named = given_text.and_then(|text| Some((inside_folder(text)?, parts_of(text))));
        let Some((file, path)) = named else {
            let found = format!("{:?}", String::from_utf8_lossy(given));
            return Err(wrong(FILE, found, "the name of a file in the table's folder, as UTF-8"));
        };
        let mut values: Vec<(Field, f64)> = Vec::with_capacity(self.fields.len());
        for &(field, column) in &self.fields {
            let text = String::from_utf8_lossy(cell(column));
            let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
            let Some(number) = number else {
                return Err(wrong(
                    &field.name(),
                    format!("{text:?}"),
                    "a number, with a decimal point if it has a fraction",
                ));
            };
            values.push((field, number));
        }
        let value = |field| values.iter().find_map(|&(of, value)| (of == field).then_some(value));
        let pair = self.forms.pair(value).map_err(|(field, expected)| {
            let found = value(field).map(|value| value.to_string()).unwrap_or_default();
            wrong(&field.name(), found, expected)
        })?;
        Ok(Row { file, path, pair, line })
    }
}

/// Whether a column's name is one that a direction may have: `theta_o`, `thetav`, `view_theta`, `Azimuth (rad)`, `lx`.
fn looks_like_direction(name: &str) -> bool {
    const WORDS: [&str; 20] = [
        "theta",
        "azim",
        "zenith",
        "polar",
        "elev",
        "altitude",
        "inclin",
        "inciden",
        "angle",
        "tilt",
        "slant",
        "colatitude",
        "direction",
        "radian",
        "degree",
        "\u{3b8}",
        "\u{3d1}",
        "\u{3c6}",
        "\u{3d5}",
        "\u{b0}",
    ];
    // Which may be parts of other words, as in `graphic`.
    const COMPONENTS: [&str; 7] = ["phi", "t", "p", "th", "x", "y", "z"];
    const SIDES: [&str; 10] = ["i", "o", "l", "v", "light", "view", "in", "out", "r", "e"];
    let name = name.to_lowercase();
    let letters: String = name.chars().filter(|c| c.is_alphanumeric() || *c == '\u{b0}').collect();
    let of_side = |(component, side): (&str, &str)| {
        letters == format!("{component}{side}") || letters == format!("{side}{component}")
    };
    let parts =
        || COMPONENTS.into_iter().flat_map(|component| SIDES.into_iter().map(move |side| (component, side)));
    let unit = ["deg", "degs", "rad", "rads", "gon", "grad"];
    let is_word = |word: &str| word == "phi" || unit.contains(&word);
    let has_word = || name.split(|c: char| !c.is_alphabetic()).any(is_word);
    WORDS.iter().any(|word| letters.contains(word)) || parts().any(of_side) || has_word()
}

fn translate(error: &csv::Error, bytes: &[u8]) -> Error {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
            let (line, byte) = start(pos.as_ref(), bytes);
            let expected = format!("{} as in the header", counted(*expected_len, "column"));
            Error::malformed(format!("line {line}: {}", counted(*len, "column")), expected).at(byte)
        }
        _ => Error::malformed(error.to_string(), "a table of comma-separated values"),
    }
}

/// Line and byte where a record starts. The parser's own position is where the record before it ends, in
/// front of comments and, often, of a line feed.
fn start(position: Option<&csv::Position>, bytes: &[u8]) -> (u64, u64) {
    let (mut line, mut byte) = position.map_or((1, 0), |position| (position.line(), position.byte()));
    let mut rest = usize::try_from(byte).ok().and_then(|byte| bytes.get(byte..)).unwrap_or(&[]);
    while let Some((first, after)) = rest.split_first() {
        let skipped = match first {
            b'\n' => {
                line = line.saturating_add(1);
                after
            }
            b'\r' => after,
            b'#' => {
                after.iter().position(|&byte| byte == b'\n').and_then(|end| after.get(end..)).unwrap_or(&[])
            }
            _ => break,
        };
        let passed = rest.len().saturating_sub(skipped.len());
        byte = byte.saturating_add(u64::try_from(passed).unwrap_or(u64::MAX));
        rest = skipped;
    }
    (line, byte)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Angles;

    fn table(text: &str) -> Result<Table> {
        read(text.as_bytes(), &Limits::default())
    }

    fn pair([theta_i, phi_i, theta_v, phi_v]: [f64; 4]) -> Pair {
        Pair { light: Angles::new(theta_i, phi_i).unwrap(), view: Angles::new(theta_v, phi_v).unwrap() }
    }

    #[test]
    fn columns_in_any_order_case_and_separation() {
        let text = "# measured on a Monday\n\nPhi_V;FILE;theta_i;exposure;phi_i;theta_v\n\
            -90; a b.png ;15.5;1/60;360;30\r\n# dark\r\n\r\n1;\"c;d.png\";0;;5;75\n";
        for text in
            [text.to_owned(), format!("\u{feff}{text}"), text.replace("c;d", "c.d").replace(';', "\t")]
        {
            let table = table(&text).unwrap();
            assert!(table.has_view);
            assert_eq!(table.rows[0].file, "a b.png");
            assert_eq!(table.rows[0].pair, pair([15.5, 0.0, 30.0, 270.0]));
            assert_eq!(table.rows[1].pair, pair([0.0, 0.0, 75.0, 1.0]));
            assert_eq!((table.rows[0].line, table.rows[1].line), (4, 7));
        }
        assert_eq!(table(text).unwrap().rows[1].file, "c;d.png");
    }

    #[test]
    fn vectors_and_no_view() {
        let table = table("file,x_i,y_i,z_i\na.png,0,-2,2\nb.png,0,0,1e-3\n").unwrap();
        assert!(!table.has_view);
        assert_eq!(table.rows[0].pair, pair([45.0, 270.0, 0.0, 0.0]));
        assert_eq!(table.rows[1].pair, pair([0.0; 4]));
    }

    #[test]
    fn columns_that_look_like_directions_are_read_or_refused() {
        for name in [
            "theta_o",
            "thetav",
            "theta-v",
            "view_theta",
            "Theta (deg)",
            "theta_v_deg",
            "PHI",
            "Azimuth",
            "lx",
            "x_light",
            "tv",
            "elevation",
            "angle of the lamp",
            "zenith [rad]",
            "tilt",
            "\u{3b8}_v",
            "rotation_deg",
            "theta_h",
        ] {
            let error = table(&format!("file,theta_i,phi_i,{name}\na.png,1,2,3\n")).unwrap_err().to_string();
            for words in [&format!("{name:?}")[..], "named as a direction", "theta_v", "degrees", "rename"] {
                assert!(error.contains(words), "{name}: {error}");
            }
        }
        let alone = table("file;Theta (deg);Phi (deg)\na;1;2\n").unwrap_err().to_string();
        assert!(alone.contains("between semicolons") && alone.contains("Theta (deg)"), "{alone}");
        for name in [
            "exposure", "date", "light", "view", "iso", "grade", "n", "comment", "camera", "lamp", "width",
            "photo", "graphic",
        ] {
            assert!(table(&format!("file,theta_i,phi_i,{name}\na.png,1,2,3\n")).is_ok(), "{name}");
        }
    }

    #[test]
    fn files_stay_inside_the_folder() {
        let table = table("file,theta_i,phi_i\nx/a.png,0,0\n/etc/passwd,1,0\n..\\..\\c.png,2,0\n").unwrap();
        let files: Vec<_> = table.rows.iter().map(|row| row.file.as_str()).collect();
        assert_eq!(files, ["x/a.png", "passwd", "c.png"]);
    }

    #[test]
    fn errors_name_line_and_column() {
        for (text, parts) in [
            ("", &["none of them file"][..]),
            ("a.png,1,2\nb.png,3,4\n", &["3 columns between commas", "none of them file"]),
            ("file;theta_i\na;1\n", &["2 columns between semicolons", "no phi_i"]),
            ("file,file,theta_i,phi_i\n", &["file twice"]),
            ("file,theta_i,phi_i,THETA_I\n", &["theta_i twice"]),
            ("file,theta_i,phi_i,x_i,y_i,z_i\n", &["a vector"]),
            ("file,theta_i,phi_i\n", &["no row"]),
            ("file,theta_i,phi_i\na,1,2\nb,1\n", &["line 3", "2 columns", "3 columns"]),
            ("file,theta_i,phi_i\na,1,2\nb,x,2\n", &["line 3", "column theta_i", "\"x\""]),
            ("file,theta_i,phi_i\na,1,\n", &["line 2", "column phi_i", "\"\""]),
            ("file,theta_i,phi_i\na,1,inf\n", &["line 2", "column phi_i", "\"inf\""]),
            ("file,theta_i,phi_i\na,91,0\n", &["line 2", "column theta_i", "91", "0..=90"]),
            ("file;theta_i;phi_i\na;1,5;0\n", &["line 2", "column theta_i", "\"1,5\""]),
            ("file,x_i,y_i,z_i\na,1,0,-1\n", &["line 2", "column z_i", "-1", "z >= 0"]),
            ("file,x_i,y_i,z_i\na,0,0,0\n", &["line 2", "column z_i", "long enough"]),
            ("file,theta_i,phi_i\n..,1,2\n", &["line 2", "column file", "\"..\""]),
            ("file,theta_i,phi_i\n,1,2\n", &["line 2", "column file"]),
            ("file,theta_i,phi_i\na,1,2\n./a,3,4\n", &["line 3", "\"a\" again", "line 2"]),
        ] {
            let error = table(text).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Malformed);
            for part in parts {
                assert!(error.to_string().contains(part), "{text:?}: {error}");
            }
        }
        let latin = read(b"file,theta_i,phi_i\n\xe4.png,1,2\n", &Limits::default()).unwrap_err();
        assert!(latin.to_string().contains("UTF-8"), "{latin}");
        assert_eq!(latin.offset(), Some(19));
    }

    #[test]
    fn rows_are_limited() {
        let limits = Limits { max_entries: 2, ..Limits::default() };
        let text = "file,theta_i,phi_i\na,1,2\nb,3,4\n";
        assert!(read(text.as_bytes(), &limits).is_ok());
        let error = read(format!("{text}c,5,6\n").as_bytes(), &limits).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Limit);
    }
}
