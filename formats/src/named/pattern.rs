//! Where the angles stand in a name: the pattern's text, and matching names with it.

use std::collections::HashMap;
use std::fmt;
use std::str::FromStr;

use crate::behind::{Digits, Unit, names_another_unit, unit_behind};
use crate::fields::{Field, Forms, NumberPrefix};
use crate::file_name::picture_stem;
use crate::words::counted;
use crate::{Doubt, Error, ErrorKind, Pair, Result};

/// Longest text of a pattern, bytes.
const MAX_BYTES: usize = 1024;

/// Where the angles stand in the names of pictures.
///
/// | in the pattern | in a name |
/// | --- | --- |
/// | `{theta_i}` `{phi_i}` | angles of the light, a decimal number in degrees; theta 0..=90, phi any |
/// | `{theta_v}` `{phi_v}` | angles of the view |
/// | `{theta_i:rad}` ... | the same in radians |
/// | `{theta_i:deg}` ... | degrees, whatever text stands behind (without it another unit there is refused) |
/// | `{x_i}` `{y_i}` `{z_i}`, `{x_v}` ... | a vector towards the light or the viewer, of any length |
/// | `{n}` | digits that do not matter |
/// | `{*}` | anything within one part of the path, or nothing; behind a number not `,5`, `p5`, `rad`, `x10` and the like |
/// | other text | itself, without regard to ASCII case |
///
/// A pattern with `/` is compared with as many parts from the end of a path as it has; one without, with the
/// file's name. One that ends in no picture's extension fits all of them. Numbers take all digits that
/// follow, so there must be text between two fields, but for a `{*}` after a number. The light must be there;
/// without the view all names have the frontal one.
///
/// ```
/// use btfkit_formats::{Angles, named::Pattern};
///
/// # fn main() -> Result<(), btfkit_formats::Error> {
/// let pattern: Pattern = "view_{theta_v}_{phi_v}/{*}_{theta_i}_{phi_i}.exr".parse()?;
/// let pair = pattern.angles("wool/view_0_0/patch 7_37.5_-90.EXR").unwrap();
/// assert_eq!(Some(pair.light), Angles::new(37.5, 270.0));
/// assert_eq!(pattern.angles("wool/view_0_0/mean.exr"), None);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    text: String,
    /// Tokens of each part of the path.
    parts: Vec<Vec<Token>>,
    /// The text ends in a picture's extension.
    has_extension: bool,
    forms: Forms,
}

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Text(String),
    Number { field: Field, unit: Option<Unit> },
    Digits,
    Anything,
}

impl Pattern {
    /// Reads the text of a pattern.
    ///
    /// # Errors
    /// [`ErrorKind::Argument`]: an unknown field, a brace without its partner, two fields side by side, a field twice, a
    /// direction in part, no light.
    pub fn parse(text: &str) -> Result<Pattern> {
        let wrong = |found: String, expected| Error::new(ErrorKind::Argument, found, expected);
        if text.len() > MAX_BYTES {
            return Err(wrong(format!("a pattern of {}", counted(text.len(), "byte")), "at most 1024 bytes"));
        }
        let parts: Vec<Vec<Token>> = text.split('/').map(tokens).collect::<Result<_>>()?;
        let fields: Vec<Field> = parts
            .iter()
            .flatten()
            .filter_map(|token| match token {
                Token::Number { field, .. } => Some(*field),
                _ => None,
            })
            .collect();
        let forms = Forms::of(&fields).map_err(|found| {
            wrong(
                format!("pattern {text:?} with {found}"),
                "theta and phi (or x, y, z) of the light, and of the view if any",
            )
        })?;
        Ok(Pattern { text: text.to_owned(), parts, has_extension: picture_stem(text).is_some(), forms })
    }

    /// Directions that a name gives; `None` if it is no picture, does not fit, or gives impossible angles.
    pub fn angles(&self, name: &str) -> Option<Pair> {
        let values = self.values(name)?;
        self.forms.pair(|field| value_of(&values, field)).ok()
    }

    /// What is odd about the directions of a name that fits.
    pub fn doubt(&self, name: &str) -> Option<Doubt> {
        let values = self.values(name)?;
        self.forms.doubt(|field| value_of(&values, field))
    }

    /// Values of the fields; `None` if the name is no picture or does not fit.
    pub(super) fn values(&self, name: &str) -> Option<Vec<(Field, f64)>> {
        let stem = picture_stem(name)?;
        let mut left = if self.has_extension { name } else { stem };
        let mut values = Vec::new();
        for (depth, tokens) in self.parts.iter().rev().enumerate() {
            let more = self.parts.len().saturating_sub(depth) > 1;
            let part = match left.rsplit_once(['/', '\\']) {
                Some((above, part)) => {
                    left = above;
                    part
                }
                // Only the pattern's first part may be the path's first.
                None if more => return None,
                None => left,
            };
            if !fits(tokens, part, &mut values, &mut HashMap::new()) {
                return None;
            }
        }
        Some(values)
    }

    /// Whether names give the view; else all images have the frontal one.
    pub fn has_view(&self) -> bool {
        self.forms.has_view()
    }
}

impl fmt::Display for Pattern {
    /// The text that [`Pattern::parse`] reads.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for Pattern {
    type Err = Error;

    fn from_str(text: &str) -> Result<Pattern> {
        Pattern::parse(text)
    }
}

fn value_of(values: &[(Field, f64)], field: Field) -> Option<f64> {
    values.iter().find_map(|&(of, value)| (of == field).then_some(value))
}

/// Tokens of one part of the path.
fn tokens(part: &str) -> Result<Vec<Token>> {
    let wrong = |found, expected| Err(Error::new(ErrorKind::Argument, found, expected));
    let mut tokens: Vec<Token> = Vec::new();
    let mut left = part;
    while !left.is_empty() {
        let after_number = matches!(tokens.last(), Some(Token::Number { .. } | Token::Digits));
        let until = left.find(['{', '}']).unwrap_or(left.len());
        let (text, rest) = left.split_at_checked(until).unwrap_or((left, ""));
        if !text.is_empty() {
            if after_number && text.starts_with(|c: char| c.is_ascii_digit()) {
                return wrong(
                    format!("a digit right after a field in {part:?}"),
                    "other text there, as numbers take all digits",
                );
            }
            if let Some(Token::Number { field, unit: None }) = tokens.last()
                && field.is_angle()
                && names_another_unit(left)
            {
                let name = field.name();
                return wrong(
                    format!("{text:?} behind {{{name}}}, which is in degrees"),
                    "{theta_i:rad} and so on for radians, {theta_i:deg} where they are degrees all the same; other units are not read",
                );
            }
            tokens.push(Token::Text(text.to_owned()));
        }
        if rest.is_empty() {
            break;
        }
        let Some((field, rest)) = rest.strip_prefix('{').and_then(|rest| rest.split_once('}')) else {
            return wrong(format!("a brace without its partner in {part:?}"), "fields such as {theta_i}");
        };
        let token = token(field)?;
        let joined = text.is_empty()
            && match tokens.last() {
                None | Some(Token::Text(_)) => false,
                Some(Token::Anything) => true,
                Some(Token::Number { .. } | Token::Digits) => token != Token::Anything,
            };
        if joined {
            return wrong(format!("two fields side by side in {part:?}"), "text between them");
        }
        tokens.push(token);
        left = rest;
    }
    Ok(tokens)
}

/// What stands between braces.
fn token(text: &str) -> Result<Token> {
    let (name, unit) = text.split_once(':').map_or((text, None), |(name, unit)| (name, Some(unit)));
    let token = match (name, Field::named(name), unit) {
        ("*", _, None) => Some(Token::Anything),
        ("n", _, None) => Some(Token::Digits),
        (_, Some(field), None) => Some(Token::Number { field, unit: None }),
        (_, Some(field), Some("deg")) if field.is_angle() => {
            Some(Token::Number { field, unit: Some(Unit::Degrees) })
        }
        (_, Some(field), Some("rad")) if field.is_angle() => {
            Some(Token::Number { field, unit: Some(Unit::Radians) })
        }
        _ => None,
    };
    let expected = "theta_i, phi_i, x_i, y_i, z_i, the same with _v, :rad after an angle, n or *";
    token.ok_or_else(|| Error::new(ErrorKind::Argument, format!("the field {{{text}}}"), expected))
}

/// Whether the text is what the tokens say, from its first byte to its last; the numbers of the fields are
/// appended.
///
/// `failed` keeps the time linear in the text's length for each `{*}`: by the tokens that are left, the longest
/// rest of the text that a `{*}` was tried on in vain, as then no shorter one can fit.
fn fits(
    tokens: &[Token],
    text: &str,
    values: &mut Vec<(Field, f64)>,
    failed: &mut HashMap<usize, usize>,
) -> bool {
    let Some((token, later)) = tokens.split_first() else { return text.is_empty() };
    match token {
        Token::Text(expected) => text.split_at_checked(expected.len()).is_some_and(|(found, rest)| {
            found.eq_ignore_ascii_case(expected) && fits(later, rest, values, failed)
        }),
        Token::Digits => {
            let rest = text.trim_start_matches(|c: char| c.is_ascii_digit());
            rest.len() < text.len() && fits(later, rest, values, failed)
        }
        Token::Number { field, unit } => {
            let Some(NumberPrefix { whole, all }) = NumberPrefix::of(text) else { return false };
            let lengths = [Some(all), Some(whole).filter(|&whole| whole != all)];
            lengths.into_iter().flatten().any(|length| {
                let Some((number, rest)) = text.split_at_checked(length) else { return false };
                let Ok(value) = number.parse::<f64>() else { return false };
                if later.first() == Some(&Token::Anything) {
                    match unit_behind(rest, Digits::Separate) {
                        Ok(Unit::Degrees) => {}
                        Ok(Unit::Radians) if *unit == Some(Unit::Radians) => {}
                        _ => return false,
                    }
                }
                let radians = *unit == Some(Unit::Radians);
                let before = values.len();
                values.push((*field, if radians { value.to_degrees() } else { value }));
                let fit = fits(later, rest, values, failed);
                if !fit {
                    values.truncate(before);
                }
                fit
            })
        }
        Token::Anything => {
            if failed.get(&tokens.len()).is_some_and(|&longest| text.len() <= longest) {
                return false;
            }
            let mut starts = text.char_indices().map(|(at, _)| at).chain([text.len()]);
            let fit = starts.any(|at| text.get(at..).is_some_and(|rest| fits(later, rest, values, failed)));
            if !fit {
                failed.insert(tokens.len(), text.len());
            }
            fit
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Angles;

    /// (theta_i, phi_i, theta_v, phi_v) in degrees, rounded.
    fn angles(pattern: &str, name: &str) -> Option<[f64; 4]> {
        let pair = Pattern::parse(pattern).unwrap().angles(name)?;
        let (l, v) = (pair.light, pair.view);
        Some([l.theta_deg(), l.phi_deg(), v.theta_deg(), v.phi_deg()].map(|a| (a * 1e6).round() / 1e6))
    }

    #[test]
    fn another_unit_is_never_read_as_degrees() {
        for pattern in ["tl{theta_i}rad_pl{phi_i}rad", "{theta_i}_{phi_i}_gon", "{theta_i} grad {phi_i}"] {
            let error = Pattern::parse(pattern).unwrap_err().to_string();
            assert!(error.contains("which is in degrees") && error.contains(":rad"), "{error}");
        }
        for pattern in [
            "{theta_i}pi_{phi_i}pi",
            "{theta_i}mil {phi_i}mil",
            "{theta_i}_arcmin_{phi_i}",
            "{theta_i}cdeg_{phi_i}",
        ] {
            assert!(Pattern::parse(pattern).is_err(), "{pattern}");
        }
        assert!(angles("ti{theta_i}_pi{phi_i}", "ti15_pi30.png").is_some());
        assert!(angles("{theta_i:deg}mil_{phi_i:deg}g", "15mil_30g.png").is_some());
        assert!(angles("{theta_i:rad}rad {phi_i:rad}rad", "0.5rad 1rad.png").is_some());
        assert!(angles("{theta_i:rad}{*}_{phi_i:rad}{*}", "0.5rad_1rad.png").is_some());
        assert_eq!(angles("{theta_i}{*}_{phi_i}{*}", "15_30rad.png"), None);
        assert!(angles("{theta_i}_{phi_i}_radius{n}", "15_30_radius7.png").is_some());
        assert!(angles("{theta_i}deg_{phi_i}\u{b0}{*}", "15deg_30\u{b0}.png").is_some());
    }

    #[test]
    fn fields_are_found_where_the_pattern_says() {
        for (pattern, name, expected) in [
            ("{theta_v}_{phi_v}_{theta_i}_{phi_i}.exr", "a/30_60_15.5_-90.exr", [15.5, 270.0, 30.0, 60.0]),
            ("{theta_i}-{phi_i}", "15--30.png", [15.0, 330.0, 0.0, 0.0]),
            ("{theta_i}.{phi_i}.{n}", "15.30.7.jpg", [15.0, 30.0, 0.0, 0.0]),
            ("{theta_i}.{phi_i}", "15.5.30.jpg", [15.5, 30.0, 0.0, 0.0]),
            ("{theta_i:rad} {phi_i:rad}", "0.785398163 1.570796327.tif", [45.0, 90.0, 0.0, 0.0]),
            ("{x_i},{y_i},{z_i}", "0,-5,5.hdr", [45.0, 270.0, 0.0, 0.0]),
            ("V{theta_v}_{phi_v}/L{theta_i}_{phi_i}.JPG", "m\\v10_20\\l30_40.jpg", [30.0, 40.0, 10.0, 20.0]),
            ("{*}l{theta_i}_{phi_i}{*}", "all l5 l7_80 l9_10.png", [7.0, 80.0, 0.0, 0.0]),
            ("{*}1_{theta_i}_{phi_i}", "1_1_3_4.png", [3.0, 4.0, 0.0, 0.0]),
            ("ä{theta_i}ö{phi_i}", "ä1ö2.png", [1.0, 2.0, 0.0, 0.0]),
        ] {
            assert_eq!(angles(pattern, name), Some(expected), "{pattern} on {name}");
        }
    }

    #[test]
    fn names_that_do_not_fit() {
        for (pattern, name) in [
            ("{theta_i}_{phi_i}", "15_30.txt"),
            ("{theta_i}_{phi_i}.exr", "15_30.png"),
            ("{theta_i}_{phi_i}", "15_30_45.png"),
            ("{theta_i}_{phi_i}", "a15_30.png"),
            ("{theta_i}_{phi_i}", "95_30.png"),
            ("{theta_i}_{phi_i}", "._15_30.png"),
            ("{theta_i}_{phi_i}_{n}", "15_30_-1.png"),
            ("a/{theta_i}_{phi_i}", "15_30.png"),
            ("a/{theta_i}_{phi_i}", "b/15_30.png"),
            ("{x_i}_{y_i}_{z_i}", "0_0_0.png"),
            ("l{theta_i}{*}_p{phi_i}{*}", "l7point5_p30.png"),
            ("l{theta_i}{*}_p{phi_i}{*}", "l7 .5_p30.png"),
            ("l{theta_i}{*}_p{phi_i}{*}", "l7_p30x10.png"),
            ("l{theta_i}{*}_p{phi_i}{*}", "l7,5_p30.png"),
            ("l{theta_i}{*}_p{phi_i}{*}", "l7_p30e1.png"),
            ("ä{theta_i}_{phi_i}", "é1_2.png"),
            ("é{theta_i}_{phi_i}", "e1_2.png"),
        ] {
            assert_eq!(angles(pattern, name), None, "{pattern} on {name}");
        }
    }

    #[test]
    fn angles_that_cannot_be_meant_are_told_apart_from_names_that_do_not_fit() {
        let doubt = |pattern: &str, name: &str| Pattern::parse(pattern).unwrap().doubt(name);
        let impossible = |text: &str| Some(Doubt::Impossible(text.to_owned()));
        let polar = "l{theta_i}_{phi_i}_v{theta_v}_{phi_v}";
        for (pattern, name, expected) in [
            (polar, "l15_30_v0_0.png", None),
            (polar, "l15_-360_v0_360.png", None),
            (polar, "l95_30_v0_0.png", impossible("theta 95 phi 30")),
            (polar, "l15_30_v-5_0.png", impossible("theta -5 phi 0")),
            (polar, "l15_400_v120_0.png", impossible("theta 120 phi 0")),
            (polar, "l15_4000_v0_0.png", impossible("theta 15 phi 4000")),
            (polar, "l15_400_v0_0.png", Some(Doubt::WholeTurns("phi 400".to_owned()))),
            (polar, "l95_30.png", None),
            (polar, "l95_30_v0_0.txt", None),
            ("{theta_i:rad}_{phi_i:rad}", "1.7_0.png", impossible("theta 97.4028 phi 0")),
        ] {
            assert_eq!(doubt(pattern, name), expected, "{name}");
        }
        assert!(matches!(doubt("{x_i}_{y_i}_{z_i}", "1_0_-1.png"), Some(Doubt::Impossible(_))));
    }

    #[test]
    fn a_pattern_says_whether_it_has_the_view() {
        let pattern = Pattern::parse("{theta_i}_{phi_i}").unwrap();
        assert!(!pattern.has_view());
        assert_eq!(pattern.angles("1_2.png").unwrap().view, Angles::FRONTAL);
        assert!(Pattern::parse("{theta_i}_{phi_i}_{x_v}_{y_v}_{z_v}").unwrap().has_view());
    }

    #[test]
    fn patterns_that_are_none() {
        for (pattern, reason) in [
            ("", "no direction of the light"),
            ("{theta_v}_{phi_v}", "no direction of the light"),
            ("{theta_i}", "no phi_i"),
            ("{theta_i}_{phi_i}_{theta_i}", "theta_i twice"),
            ("{theta_i}_{phi_i}_{x_i}_{y_i}_{z_i}", "a vector"),
            ("{theta_i}{phi_i}", "side by side"),
            ("{*}{theta_i}_{phi_i}", "side by side"),
            ("{theta_i}_{phi_i}{n}", "side by side"),
            ("{theta_i}_{phi_i}{*}{*}", "side by side"),
            ("{theta_i}0_{phi_i}", "a digit right after"),
            ("{theta_i_{phi_i}", "the field {theta_i_{phi_i}"),
            ("theta_i}_{phi_i}", "partner"),
            ("{theta_i}_{phi_i", "partner"),
            ("{theta_o}_{phi_i}", "{theta_o}"),
            ("{theta_i:grad}_{phi_i}", "grad"),
            ("{x_i:rad}_{y_i}_{z_i}", "rad"),
            ("{n:rad}_{theta_i}_{phi_i}", "n:rad"),
            (&"x".repeat(1025), "1025 bytes"),
        ] {
            let error = Pattern::parse(pattern).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Argument);
            assert!(error.to_string().contains(reason), "{pattern}: {error}");
        }
    }

    #[test]
    fn many_stars_on_a_long_name_take_no_time() {
        let pattern = Pattern::parse(&format!("{{theta_i}}_{{phi_i}}{}b", "{*}a".repeat(200))).unwrap();
        let name = format!("1_2_{}.png", "a".repeat(20_000));
        assert_eq!(pattern.angles(&name), None);
        assert!(pattern.angles(&name.replace(".png", "b.png")).is_some());
    }
}
