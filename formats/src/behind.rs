//! What stands behind a number in a name. Only what is known may: `tl4point5`, `tl4_p5` and `tl0.5pi` would else be
//! read as the 4 and the 0.5 that they begin with, and nobody would be told.

use crate::labels::starts_with_label;

/// What the angle of a name is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unit {
    Degrees,
    Radians,
}

/// Whether more digits may follow behind a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Digits {
    /// They may be the fraction: `tl7_5`.
    Doubted,
    /// A pattern says that other numbers follow: `15_30`.
    Separate,
}

/// The forms that are read, for messages.
pub(crate) const KNOWN_FORMS: &str = "an angle like 4.5 (fractions with a point), then deg, °, rad or nothing, then the \
     end of the name, the next label, or one of _ - , . ; and blanks before other words";

/// Units that are read, the longest first where one begins with another.
const UNITS: [(&str, Unit); 10] = [
    ("degrees", Unit::Degrees),
    ("degree", Unit::Degrees),
    ("degs", Unit::Degrees),
    ("deg", Unit::Degrees),
    ("\u{b0}", Unit::Degrees),
    // Typed for the degree sign: the ordinal indicator.
    ("\u{ba}", Unit::Degrees),
    ("radians", Unit::Radians),
    ("radian", Unit::Radians),
    ("rads", Unit::Radians),
    ("rad", Unit::Radians),
];

/// Other units as words of their own. Right behind a number any word that is not known is refused.
const OTHER_UNITS: [&str; 30] = [
    "grad",
    "grads",
    "gradian",
    "gradians",
    "grade",
    "grades",
    "gon",
    "gons",
    "turn",
    "turns",
    "rev",
    "revs",
    "revolution",
    "revolutions",
    "cycle",
    "cycles",
    "mil",
    "mils",
    "pi",
    "\u{3c0}",
    "tau",
    "arcmin",
    "arcsec",
    "minute",
    "minutes",
    "second",
    "seconds",
    "hours",
    "percent",
    "pct",
];

/// What stands before a unit in `mrad`, `centidegrees`, `arcminutes`.
const MULTIPLES: [&str; 16] = [
    "m", "c", "d", "k", "u", "n", "\u{b5}", "\u{3bc}", "milli", "centi", "deci", "kilo", "micro", "nano",
    "arc", "half",
];

/// Words for the decimal point, an exponent or a factor, where digits follow.
const IN_NUMBERS: [&str; 17] = [
    "p", "pt", "pnt", "point", "punkt", "d", "dot", "dp", "dec", "decimal", "comma", "coma", "komma",
    "virgule", "e", "x", "times",
];

/// Numbers in words, which are a fraction behind a word for the decimal point: `4_point_five`.
const NUMBERS: [&str; 13] =
    ["zero", "oh", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "half", "quarter"];

/// Marks behind which other words may stand.
const MARKS: &str = "_- \t,;.:|=+()[]{}<>#@~&/\\\u{2013}\u{2014}\u{a0}";

/// Of these, the ones that a unit may follow: `0.5_rad`, `0.5 (rad)`.
const BEFORE_UNITS: [char; 7] = ['_', '-', ' ', '(', '[', '{', '<'];

/// Of these, the ones that a whole number of its own may follow: that of a copy, `(2)`.
const BRACKETS: [char; 4] = ['(', '[', '{', '<'];

/// Of these, the ones that begin another word: `@2x`, `#3`, `~1`.
const SIGNS: [char; 3] = ['#', '@', '~'];

/// Of these, the ones that may separate numbers in a pattern.
const BETWEEN_NUMBERS: &str = "_- \t=+()[]{}<>#@~&/\\";

/// The unit of a number, by the text that follows it up to the end of the name (or of this part of a path).
///
/// # Errors
/// What follows, where it is not known: other units, letters right behind the number, digits that may be its fraction.
pub(crate) fn unit_behind(rest: &str, digits: Digits) -> Result<Unit, String> {
    if starts_with_label(rest) {
        return Ok(Unit::Degrees);
    }
    let (unit, after) = stated_unit(rest).unwrap_or((Unit::Degrees, rest));
    let marks = after.find(|c: char| !MARKS.contains(c)).unwrap_or(after.len());
    let Some((marks, next)) = after.split_at_checked(marks) else { return Ok(unit) };
    if next.is_empty() || starts_with_label(next) {
        return Ok(unit);
    }
    let separate = digits == Digits::Separate && marks.chars().all(|mark| BETWEEN_NUMBERS.contains(mark));
    let known = match next.chars().next() {
        _ if marks.is_empty() => false,
        Some(c) if c.is_numeric() => separate || is_counter(marks, next),
        Some(c) if c.is_alphabetic() => !is_part_of_number(next),
        _ => false,
    };
    if known { Ok(unit) } else { Err(excerpt(rest)) }
}

/// A unit that is read, right behind the number, behind marks or in brackets, and what follows it: not a letter
/// (`radial`) but for the next label.
fn stated_unit(rest: &str) -> Option<(Unit, &str)> {
    let word = rest.trim_start_matches(BEFORE_UNITS);
    UNITS.iter().find_map(|&(name, unit)| {
        let (found, after) = word.split_at_checked(name.len())?;
        let ends = !after.starts_with(char::is_alphabetic) || starts_with_label(after);
        (found.eq_ignore_ascii_case(name) && ends).then_some((unit, after))
    })
}

/// Whether the text of a pattern behind an angle in degrees names another unit.
pub(crate) fn names_another_unit(text: &str) -> bool {
    let word = text.trim_start_matches(BEFORE_UNITS);
    let label = starts_with_label(text) || starts_with_label(word);
    !label && (matches!(stated_unit(text), Some((Unit::Radians, _))) || is_other_unit(&first_word(word).0))
}

/// Whether a word behind a mark belongs to the number before it: another unit, or a decimal point in words.
fn is_part_of_number(text: &str) -> bool {
    let (word, after) = first_word(text);
    let digits = after.trim_start_matches(['_', '-', ' ', '.']).starts_with(char::is_numeric);
    let next = first_word(after.trim_start_matches(['_', '-', ' ', '.'])).0;
    let in_words = NUMBERS.contains(&next.as_str());
    let fraction = |word: &str| ["half", "quarter"].contains(&word);
    is_other_unit(&word)
        || (digits || in_words) && IN_NUMBERS.contains(&word.as_str())
        || fraction(&word)
        || word == "and" && (in_words || next == "a")
}

/// Whether a number is no part of the angle before it: a whole one right behind a bracket, as that of a copy is, `(2)`
/// but not `(+0.5)`, or whatever stands behind a sign that only other words have, `@2x`.
fn is_counter(marks: &str, next: &str) -> bool {
    let after = next.trim_start_matches(|c: char| c.is_ascii_digit());
    let fraction = |text: &str| text.starts_with(|c: char| c.is_numeric());
    let is_whole = !after.starts_with(|c: char| c.is_alphanumeric())
        && !after.strip_prefix(['.', ',']).is_some_and(fraction);
    marks.ends_with(SIGNS) || is_whole && marks.ends_with(BRACKETS)
}

/// The letters that a text begins with, small, and the rest.
fn first_word(text: &str) -> (String, &str) {
    let end = text.find(|c: char| !c.is_alphabetic()).unwrap_or(text.len());
    let (word, after) = text.split_at_checked(end).unwrap_or((text, ""));
    (word.to_lowercase(), after)
}

fn is_other_unit(word: &str) -> bool {
    let multiple = |unit: &str| word.strip_suffix(unit).is_some_and(|before| MULTIPLES.contains(&before));
    let known = || OTHER_UNITS.into_iter().chain(UNITS.into_iter().map(|(unit, _)| unit));
    word == "g" || OTHER_UNITS.contains(&word) || known().any(multiple)
}

/// The beginning of what was found, for messages.
fn excerpt(rest: &str) -> String {
    const MOST: usize = 12;
    let start: String = rest.chars().take(MOST).collect();
    if start.len() < rest.len() { format!("{start}...") } else { start }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_known_behind_a_number_is_refused() {
        for rest in [
            "(+0.5)",
            "(0.5)",
            "[2x]",
            "(gon)",
            " (mrad)",
            ",5",
            "p5",
            "P5_x",
            "d5",
            "D5_",
            "e+01",
            "d-1",
            "E1",
            ".3",
            "'5",
            "\u{b7}5",
            "\u{66b}5",
            "\u{66b}\u{665}",
            "\u{ff0e}\u{ff15}",
            "\u{ff0c}5",
            "\u{2396}5",
            "\u{2009}5",
            "\u{2212}5",
            ";5",
            ":5",
            "*5",
            "`5",
            "\u{bd}",
            "\u{ff15}",
            "\u{665}",
            "point5",
            "dot5",
            " .5",
            "pt5",
            "comma5",
            "_p5",
            "..5",
            "pi",
            "g",
            "rev",
            "mil",
            "arcmin",
            "cdeg",
            "x10",
            "_pt_5",
            "-dot-5",
            " point 5",
            "_x10",
            "_mil",
            " arcmin",
            "-cdeg_",
            "_pi_",
            "e5",
            "b",
            "deg30",
            "\u{b0}30",
            "deg_30",
            "%",
            "*10",
            "^2",
            "'",
            "\u{2032}",
            "rad5",
            "px5",
            "_5deg",
            "_.5",
            "+1",
            "grad",
            "Gon_pl5",
            "_gon",
            "gradpl",
            "mrad_",
            " turns",
            "_grads",
            "degC",
            "ev2",
            "d",
            "\u{d7}10",
            "\u{3c0}",
        ] {
            assert!(unit_behind(rest, Digits::Doubted).is_err(), "{rest}");
        }
    }

    #[test]
    fn known_units_marks_words_and_labels_are_read() {
        for rest in [
            "",
            "deg",
            "\u{b0}",
            "_",
            "_pl5",
            "pl5",
            "pl-30",
            "_radial",
            "_gradient",
            "_gone",
            "deg_pl5",
            "\u{b0}pl5",
            "degpl5",
            " deg",
            "_degrees_x",
            " (2)",
            "(2)",
            "@2x",
            "~1",
            "#3",
            "po5",
            "po-5.5",
            "phi_v=3",
            ",pl5",
            ".pl5",
            "_v45_60",
            "v45_60",
            " rectified",
            "_exposure3",
            "_v2",
            "_HDR",
            "__pl5",
            "\u{2013}pl5",
            "_konrad",
            "_x_rad",
            ".",
            "_pi30",
            "pi30",
        ] {
            assert_eq!(unit_behind(rest, Digits::Doubted), Ok(Unit::Degrees), "{rest}");
        }
        for rest in [
            "rad",
            "RAD_",
            "radpl5",
            "radians",
            "_rad",
            " rad_",
            "-radian.x",
            "_rads",
            "(rad)",
            " [rad]_",
            "_(radians)",
        ] {
            assert_eq!(unit_behind(rest, Digits::Doubted), Ok(Unit::Radians), "{rest}");
        }
        for rest in ["_5", "-5", " 5", "_-5", "deg_30"] {
            assert!(
                unit_behind(rest, Digits::Separate).is_ok() && unit_behind(rest, Digits::Doubted).is_err(),
                "{rest}"
            );
        }
        assert!(unit_behind(" .5", Digits::Separate).is_err());
    }
}
