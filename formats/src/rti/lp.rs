//! Light position lists, `.lp`.

use std::borrow::Cow;

use crate::file_name::{inside_folder, parts_of, repeated};
use crate::text::utf8;
use crate::words::counted;
use crate::{Angles, Error, ErrorKind, Limits, Result};

/// The lights of a fixed view, in the list's order.
#[derive(Debug, Clone, PartialEq)]
pub struct LightList {
    /// One for each photograph: all with a file, or all without, and no file twice.
    pub lamps: Vec<Lamp>,
    /// What is odd but does no harm, a sentence each.
    pub warnings: Vec<String>,
}

/// One photograph's light.
#[derive(Debug, Clone, PartialEq)]
pub struct Lamp {
    /// Path inside the list's folder, parts separated by `/`; `None` in lists without names, whose lights
    /// belong to the sorted pictures of the folder.
    pub file: Option<String>,
    /// All folders that the list names and the file, separated by `/`, without a drive and what `..` climbs out of:
    /// where a set was moved from another machine, the longest end that is there decides. Empty in lists without names.
    pub path: String,
    /// Direction to the light.
    pub light: Angles,
    /// Line in the list, the first is 1.
    pub line: usize,
}

/// Reads a light position list.
///
/// The first line is the number of photographs; then one line each: file name (which may hold spaces) and x y z, the
/// vector towards the light of any length: x right, y up, z to the camera. Fields are separated by spaces or tabs,
/// lines end in LF, CRLF or CR. The text is UTF-8, or UTF-16 with a byte order mark. Numbers have a decimal point or,
/// all of them that have a fraction, a decimal comma. A name may be quoted. A count that is not there is a warning; one
/// that is wrong is an error, as it tells of a list that is cut, or put together of two, which nothing else does. A
/// second variant has no names. Of a name that is absolute, has a drive or climbs by `..` (a list from another machine)
/// the last part counts, so a list never reaches out of its folder.
///
/// # Errors
/// [`ErrorKind::Malformed`], with the line: no light at all, another number of them than the first line says, a line that is none, a vector of no length or into the
/// surface, names on some lines only, no usable name, a name twice. [`ErrorKind::Limit`]: more lights than
/// [`Limits::max_directions`].
pub fn read_lp(bytes: &[u8], limits: &Limits) -> Result<LightList> {
    let bytes = utf8(bytes)?;
    let mut count = None;
    let mut lamps: Vec<Lamp> = Vec::new();
    let mut marks = Marks::default();
    for (number, line) in lines(&bytes) {
        let text = String::from_utf8_lossy(line);
        let text = text.trim();
        if text.is_empty() {
            continue;
        }
        if lamps.is_empty() && count.is_none() && text.bytes().all(|byte| byte.is_ascii_digit()) {
            count = Some((text.to_owned(), number));
            continue;
        }
        if u64::try_from(lamps.len()).unwrap_or(u64::MAX) >= limits.max_directions {
            let found = format!("more than {}", counted(limits.max_directions, "light"));
            return Err(Error::new(ErrorKind::Limit, found, "a list within the limit of directions"));
        }
        let lamp = lamp(text, number, &mut marks)?;
        if let Some(first) = lamps.first()
            && first.file.is_some() != lamp.file.is_some()
        {
            let has = |lamp: &Lamp| if lamp.file.is_some() { "with" } else { "without" };
            let found =
                format!("line {number} {} a name, line {} {} one", has(&lamp), first.line, has(first));
            return Err(Error::malformed(found, "a name on every line, or on none"));
        }
        lamps.push(lamp);
    }
    if lamps.is_empty() {
        return Err(Error::malformed("a list of no lights", "a file name and x y z on each line"));
    }
    let named: Vec<(usize, &str)> =
        lamps.iter().filter_map(|lamp| Some((lamp.line, lamp.file.as_deref()?))).collect();
    if let Some((first, again)) = repeated(named.iter().map(|&(_, file)| file))
        && let (Some((first, file)), Some((again, _))) = (named.get(first), named.get(again))
    {
        let found = format!("line {again}: {file:?} again, which is in line {first}");
        return Err(Error::malformed(found, "every file once"));
    }
    let last = lamps.last().map_or(0, |lamp| lamp.line);
    let warnings = require_count(count.as_ref(), lamps.len(), last)?.into_iter().collect();
    Ok(LightList { lamps, warnings })
}

/// Numbered lines without their ends; a CRLF makes an empty line more, which does not count.
fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let mut number = 0usize;
    bytes.split_inclusive(|byte| matches!(byte, b'\n' | b'\r')).scan(b'\n', move |ended_by, line| {
        if line != b"\n" || *ended_by != b'\r' {
            number = number.saturating_add(1);
        }
        *ended_by = line.last().copied().unwrap_or_default();
        Some((number, line))
    })
}

/// Reads a line that is not blank.
fn lamp(text: &str, line: usize, marks: &mut Marks) -> Result<Lamp> {
    let wrong = |found: String, expected: Cow<'static, str>| {
        Err(Error::malformed(format!("line {line}: {found}"), expected))
    };
    let mut name = text;
    let mut vector = [0.0; 3];
    for component in vector.iter_mut().rev() {
        let number = name.rsplit(char::is_whitespace).next().unwrap_or(name);
        let Some(value) = marks.number(number) else {
            return wrong(
                format!("{number:?} in {text:?}"),
                "a file name (or none) and three numbers x y z".into(),
            );
        };
        *component = value;
        name = name.strip_suffix(number).unwrap_or_default().trim_end();
    }
    if marks.point && marks.comma {
        return wrong(
            format!("a decimal comma in a list with decimal points, or the other way round, in {text:?}"),
            "one of the two in all lines".into(),
        );
    }
    let light = match Angles::from_vector(vector) {
        Ok(light) => light,
        Err(expected) => return wrong(format!("the light {vector:?}"), expected.into()),
    };
    // A fourth number: which three are the light, or whether the first is of the name, cannot be known.
    let last = name.rsplit(char::is_whitespace).next().unwrap_or(name);
    if last.contains(|c: char| c.is_ascii_digit()) && Marks::default().number(last).is_some() {
        return wrong(
            format!("the number {last:?} before the last three in {text:?}"),
            "a file name (or none) and three numbers x y z; take other columns away, and give a file that is \
             called by a number its ending"
                .into(),
        );
    }
    if name.is_empty() {
        return Ok(Lamp { file: None, path: String::new(), light, line });
    }
    // Names in another encoding than UTF-8 are of no use, but their folders do not matter.
    let name = unquoted(name);
    match inside_folder(name).filter(|file| !file.contains(char::REPLACEMENT_CHARACTER)) {
        Some(file) => Ok(Lamp { file: Some(file), path: parts_of(name), light, line }),
        None => {
            wrong(format!("the name {name:?}"), "the name of a file in the list's folder, as UTF-8".into())
        }
    }
}

/// The decimal marks that a list has used so far.
#[derive(Debug, Default)]
struct Marks {
    point: bool,
    comma: bool,
}

impl Marks {
    /// A number with a decimal point or a decimal comma.
    fn number(&mut self, text: &str) -> Option<f64> {
        self.point |= text.contains('.');
        match text.split_once(',') {
            None => text.parse().ok(),
            Some((whole, fraction)) => {
                self.comma = true;
                let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
                let exponentless = fraction.split(['e', 'E']).next().is_some_and(digits);
                let plain = digits(whole.trim_start_matches(['-', '+'])) && exponentless;
                format!("{whole}.{fraction}").parse().ok().filter(|_| plain)
            }
        }
    }
}

/// The number in the list's first line is that of its lights; without one, what to know of it.
fn require_count(count: Option<&(String, usize)>, lights: usize, last: usize) -> Result<Option<String>> {
    match count {
        None => Ok(Some(format!("the list does not begin with its number of lights; it has {lights}"))),
        Some((count, _)) if count.parse() == Ok(lights) => Ok(None),
        Some((count, line)) => Err(Error::malformed(
            format!(
                "line {line} gives {count} as the number of lights, up to line {last} there are {lights}"
            ),
            "as many; the list is cut or put together of others, or else mend its count",
        )),
    }
}

/// A name without the quotes that a spreadsheet puts around one with blanks.
fn unquoted(name: &str) -> &str {
    let within = |quote| name.strip_prefix(quote).and_then(|name| name.strip_suffix(quote));
    within('"').or_else(|| within('\'')).unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(text: &str) -> LightList {
        read_lp(text.as_bytes(), &Limits::default()).unwrap()
    }

    fn angles(theta: f64, phi: f64) -> Angles {
        Angles::new(theta, phi).unwrap()
    }

    #[test]
    fn names_with_spaces_tabs_and_any_line_end() {
        let text = "2\n\ta file 1.jpg\t0 -5e2\t500\n  C:\\my scans\\b 2.JPG 0.0 0 +.5 \n\n";
        for end in ["\n", "\r\n", "\r"] {
            let list = list(&text.replace('\n', end));
            assert_eq!(list.warnings, [""; 0]);
            let expected = [
                ("a file 1.jpg", "a file 1.jpg", angles(45.0, 270.0), 2),
                ("b 2.JPG", "my scans/b 2.JPG", angles(0.0, 0.0), 3),
            ];
            let expected = expected.map(|(file, path, light, line)| Lamp {
                file: Some(file.to_owned()),
                path: path.to_owned(),
                light,
                line,
            });
            assert_eq!(list.lamps, expected, "{end:?}");
        }
    }

    #[test]
    fn a_missing_count_is_a_warning_and_a_wrong_one_an_error() {
        assert!(list("\u{feff}a.png 0 0 1\nb.png 0 1 1").warnings[0].contains("it has 2"));
        assert!(list("\u{feff}2\na.png 0 0 1\nb.png 0 1 1").warnings.is_empty());
        assert!(list("\n 002 \na.png 0 0 1\nb.png 0 1 1").warnings.is_empty());
        for (text, words) in [
            ("7\na.png 0 0 1\n", "line 1 gives 7 as the number of lights, up to line 2 there are 1"),
            (
                "\n1\na.png 0 0 1\n\nb.png 0 1 1",
                "line 2 gives 1 as the number of lights, up to line 5 there are 2",
            ),
            ("0\na.png 0 0 1\n", "gives 0 as the number"),
            ("3\n0 0 1\n0 1 1\n", "gives 3 as the number"),
            ("99999999999999999999999\na.png 0 0 1\n", "there are 1"),
        ] {
            let error = read_lp(text.as_bytes(), &Limits::default()).unwrap_err();
            assert!(error.to_string().contains(words), "{error}");
        }
    }

    #[test]
    fn quotes_and_the_end_mark_of_dos_belong_to_nothing() {
        let plain = list("2\na b.png 0 0 1\nc.png 0 1 1\n");
        assert_eq!(list("2\n\"a b.png\" 0 0 1\n'c.png'\t0 1 1\n\x1A"), plain);
        assert_eq!(list("2\na b.png 0 0 1\nc.png 0 1 1\x1A"), plain);
    }

    #[test]
    fn other_separators_and_comments_are_refused_by_line() {
        for line in [
            "a.png;0.1;0.2;0.9",
            "a.png; 0.1; 0.2; 0.9",
            "a.png,0.1,0.2,0.9",
            "a.png 0;1;1",
            "a.png 0,1,1",
            "\"a.png\",0,0,1",
            "# lights of the dome",
            "// x y z",
            "a.png 0\u{66b}5 0 1",
            "a.png 0d5 0 1",
            "a.png 0 0 1 # top",
            "a.png 0 0 1\x1A\nb.png 0 0 1",
        ] {
            let error = read_lp(format!("1\n{line}\n").as_bytes(), &Limits::default()).unwrap_err();
            assert!(error.to_string().contains("line 2: "), "{line}: {error}");
        }
    }

    #[test]
    fn lists_without_names() {
        let list = list("0 0 1\r\n1 0 1\r\n");
        assert!(list.lamps.iter().all(|lamp| lamp.file.is_none()));
        assert_eq!(list.lamps[1].light, angles(45.0, 0.0));
        assert_eq!(list.warnings.len(), 1);
    }

    #[test]
    fn folders_of_unknown_encoding_do_not_matter() {
        let limits = Limits::default();
        let list = read_lp(b"1\n/home/j\xfcrgen/a.png 0 0 1", &limits).unwrap();
        assert_eq!(list.lamps[0].file.as_deref(), Some("a.png"));
        assert!(read_lp(b"1\nj\xfcrgen.png 0 0 1", &limits).unwrap_err().to_string().contains("UTF-8"));
    }

    #[test]
    fn decimal_commas_are_read_where_no_point_is() {
        let commas = list("3\nphoto1.png 0,707106781 0 0,707106781\nb, c.png -1,5 +0,0 1,5e0\nd.png 0 0 1\n");
        let points = list("3\nphoto1.png 0.707106781 0 0.707106781\nb, c.png -1.5 +0.0 1.5e0\nd.png 0 0 1\n");
        assert_eq!(commas, points);
        for text in [
            "1\na 0,5 0.5 1\n",
            "1\na 1,000.5 0 1\n",
            "2\na 0,5 0 1\nb 0.5 0 1\n",
            "1\na 0,1,2 0 1\n",
            "1\na ,5 0 1\n",
            "1\na 5, 0 1\n",
            "1\na.png,0.1,0.2,0.3\n",
            "1\na 0.1, 0.2, 0.3\n",
        ] {
            let error = read_lp(text.as_bytes(), &Limits::default()).unwrap_err();
            assert!(error.to_string().contains("line "), "{text:?}: {error}");
        }
    }

    #[test]
    fn errors_name_the_line() {
        for (text, parts) in [
            ("", &["no lights"][..]),
            ("12\n", &["no lights"]),
            ("1\na.png 0 1\n", &["line 2", "\"a.png\"", "x y z"]),
            ("1\na.png 0 1 x\n", &["line 2", "\"x\""]),
            ("1\na.png 0 0 0\n", &["line 2", "[0.0, 0.0, 0.0]", "long enough"]),
            ("1\na.png 1 0 -0.1\n", &["line 2", "[1.0, 0.0, -0.1]", "z >= 0"]),
            ("1\na.png nan 0 1\n", &["line 2", "NaN", "finite"]),
            ("2\na.png 0 0 1\n1 0 1\n", &["line 3 without a name", "line 2 with one"]),
            ("2\na.png 0 0 1\n3\n", &["line 3", "\"3\""]),
            ("2\n2\na.png 0 0 1\n", &["line 2", "\"2\""]),
            ("1\n/ 0 0 1\n", &["line 2", "\"/\""]),
            ("1\np0.png 1 0.1 0.8 1\n", &["line 2", "\"1\" before", "three numbers"]),
            ("1\np0.png\t-1,5\t0\t0\t1\n", &["line 2", "\"-1,5\" before", "three numbers"]),
            ("1\n7\ta b.png\t1 .1 .8 1 \n", &["line 2", "\"1\" before", "three numbers"]),
            ("p0.png 0.1 0.8 1 255\n", &["line 1", "\"0.1\" before", "three numbers"]),
            ("0 0 1 255\n", &["line 1", "\"0\" before", "three numbers"]),
            ("2\r\na.png 0 0 1\r\nx/../a.png 1 0 1\r\n", &["line 3", "\"a.png\" again", "line 2"]),
        ] {
            let error = read_lp(text.as_bytes(), &Limits::default()).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Malformed);
            for part in parts {
                assert!(error.to_string().contains(part), "{text:?}: {error}");
            }
        }
    }

    #[test]
    fn lights_are_limited() {
        let limits = Limits { max_directions: 1, ..Limits::default() };
        let error = read_lp(b"4000000000\na 0 0 1\n", &limits).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Malformed);
        let error = read_lp(b"2\na 0 0 1\nb 0 1 1\n", &limits).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Limit);
    }
}
