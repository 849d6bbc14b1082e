//! Finding a pattern by the labels that stand before the numbers in names.

use std::collections::HashMap;

use super::Pattern;
use crate::behind::{Digits, KNOWN_FORMS, Unit, unit_behind};
use crate::fields::{Component, Field, NumberPrefix, Side};
use crate::file_name::{base, picture_stem};
use crate::labels::{SEPARATORS, direction_label, ends_with_word, number_label};
use crate::{Error, ErrorKind, Result};

/// What one label is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Labels {
    /// Each number has its own: `tl15_pl30`.
    Numbers,
    /// Theta and phi share one: `l15_30`.
    Directions,
}

/// Finds the pattern of a folder's pictures; names that are no pictures do not count.
///
/// Two ways of labelling are known, in any order of the labels and without regard to case. A label for each
/// number: `tl` or `theta_l`, `pl` or `phi_l`, or `x_l`, `y_l`, `z_l`, with or without the underscore, where
/// the side `l`, `i` or `light` is the light and `v`, `o` or `view` the view: `tv15_pv30_tl45_pl60`,
/// `thetaI=15 phiI=30`, `ti_15_pi_30_to_0_po_0`. Or a label for theta and phi together: `l15_30_v45_60`.
/// Angles are in degrees, or in radians where `rad` stands behind each. The label may be in the file's name or, for one
/// side, in that of its folder, or of one above that whose label is plain (`view_30_45`, `tv30_pv45`).
/// Numbers without a label become `{n}`, the rest of the first name stays as it is. Names that fit may have angles that
/// no direction has: [`Pattern::doubt`] tells them.
///
/// ```
/// use btfkit_formats::named::recognise;
///
/// let pattern = recognise(["wool 7 L15_0 V0_0.png", "wool 7 L15_90 V0_0.png", "notes.txt"]).unwrap();
/// assert_eq!(pattern.to_string(), "wool {n} L{theta_i}_{phi_i} V{theta_v}_{phi_v}");
/// assert!(recognise(["15_30_45_60.png"]).is_err(), "which is theta, which is the light?");
/// ```
///
/// # Errors
/// [`ErrorKind::Unsupported`], with the names: no picture; no labels, or not those of a whole light (and view); a
/// picture that does not fit the pattern of the first; two pictures of the same directions.
pub fn recognise<'a>(names: impl IntoIterator<Item = &'a str>) -> Result<Pattern> {
    let pictures: Vec<&str> = names.into_iter().filter(|name| picture_stem(name).is_some()).collect();
    let unsupported = |found: String, expected| Error::new(ErrorKind::Unsupported, found, expected);
    let Some(&first) = pictures.first() else {
        return Err(unsupported("no picture".to_owned(), "pictures with angles in their names"));
    };
    let pattern = pattern_of(first).ok_or_else(|| {
        if let Some(unread) = unread_behind(first) {
            return unsupported(format!("the name {first:?} with {unread}"), KNOWN_FORMS);
        }
        let what = match base(first).contains(|c: char| c.is_ascii_digit()) {
            true => "whose numbers carry no labels of a whole direction, in one unit",
            false => "which has no numbers",
        };
        unsupported(
            format!("the name {first:?}, {what}"),
            "labels like `tl15_pl30_tv0_pv0` or `l15_30_v0_0`, degrees with decimal points, or a pattern that says what \
             is what",
        )
    })?;
    let mut seen = HashMap::new();
    for &name in &pictures {
        let Some(pair) = pattern.angles(name) else {
            if pattern.values(name).is_some() {
                continue;
            }
            if let Some(unread) = unread_behind(name) {
                return Err(unsupported(format!("the name {name:?} with {unread}"), KNOWN_FORMS));
            }
            let found =
                format!("the name {name:?}, which does not fit the pattern {:?}", pattern.to_string());
            return Err(unsupported(found, "all pictures named alike, or a pattern for those that count"));
        };
        let bits = [pair.view, pair.light].map(|a| (a.theta_deg().to_bits(), a.phi_deg().to_bits()));
        if let Some(earlier) = seen.insert(bits, name) {
            let found = format!("{earlier:?} and {name:?}, both {pair}");
            return Err(unsupported(found, "one picture for each pair of directions, or a pattern"));
        }
    }
    Ok(pattern)
}

/// The pattern that a picture's labels give.
fn pattern_of(name: &str) -> Option<Pattern> {
    [Labels::Numbers, Labels::Directions].into_iter().find_map(|labels| labels.pattern_of(name))
}

impl Labels {
    /// The pattern of the name alone if that has light and view, else with its folder.
    fn pattern_of(self, name: &str) -> Option<Pattern> {
        let stem = picture_stem(name)?;
        let file = self.fields_of(base(stem))?;
        let parse = |text: &str| Pattern::parse(text).ok().filter(|pattern| pattern.values(name).is_some());
        if !units_agree(&file) {
            return None;
        }
        let alone = parse(&file);
        if alone.as_ref().is_some_and(Pattern::has_view) {
            return alone;
        }
        let above = stem.rsplit_once(['/', '\\']).map(|(above, _)| base(above));
        let folder = above.and_then(|above| self.fields_of(above));
        // A folder with labels whose numbers cannot be read is not passed over.
        if folder.is_none() && above.is_some_and(|above| !above.contains(['{', '}'])) {
            return None;
        }
        let below = format!("{}/{file}", folder.as_deref().unwrap_or("{*}"));
        if !units_agree(&below) {
            return None;
        }
        if let Some(both) = folder.and_then(|_| parse(&below)).filter(Pattern::has_view) {
            return Some(both);
        }
        self.with_folder_above(stem, below, parse, alone)
    }

    /// The pattern with the label of a folder above the picture's own, `below` being that of the two. Names of folders
    /// of the user's own lie there as well (`set_v2`), so only plain labels count.
    fn with_folder_above(
        self,
        stem: &str,
        mut below: String,
        parse: impl Fn(&str) -> Option<Pattern>,
        alone: Option<Pattern>,
    ) -> Option<Pattern> {
        let parts: Vec<&str> = stem.rsplit(['/', '\\']).skip(2).take(MOST_FOLDERS).collect();
        for part in parts {
            let plain = has_plain_label(part);
            let fields = self.fields_of(part);
            // One that cannot be read is not passed over.
            if plain && fields.is_none() {
                return None;
            }
            let fields = fields.filter(|_| plain);
            below = format!("{}/{below}", fields.as_deref().unwrap_or("{*}"));
            if !units_agree(&below) {
                return None;
            }
            if let Some(found) = parse(&below).filter(|found| plain && found.has_view()) {
                return Some(found);
            }
        }
        alone
    }

    /// One part of a path with fields for its numbers; `None` if it has braces, which a pattern cannot have.
    fn fields_of(self, part: &str) -> Option<String> {
        if part.contains(['{', '}']) {
            return None;
        }
        let dashes_separate = dashes_separate(part);
        let mut pattern = String::new();
        let mut left = part;
        while let Some((mut before, number)) = split_at_digit(left) {
            let own = number_label(before).zip(NumberPrefix::of(number));
            let shared = direction_label(before).and_then(|side| two_angles(side, number));
            let found = match (self, own, shared) {
                // What looks like a light or a view that cannot be read is not passed over.
                (Labels::Directions, None, None) if unread_direction(before, number).is_some() => {
                    return None;
                }
                (_, None, None) => None,
                (Labels::Numbers, Some((field, prefix)), _) => {
                    let signed =
                        before.strip_suffix('-').filter(|rest| !dashes_separate || rest.ends_with('-'));
                    before = signed.filter(|_| field.may_be_negative()).unwrap_or(before);
                    let unit = unit_behind(number.get(prefix.all..)?, Digits::Doubted).ok()?;
                    Some((braced(field, unit), prefix.all))
                }
                (Labels::Directions, None, Some((fields, length)))
                    if !another_number(number.get(length..)?) =>
                {
                    Some((fields, length))
                }
                // Both ways of labelling, or a label with three numbers: what is meant cannot be known.
                _ => return None,
            };
            let digits = || number.len().saturating_sub(after_digits(number).len());
            let (fields, length) = found.unwrap_or_else(|| ("{n}".to_owned(), digits()));
            pattern.push_str(before);
            pattern.push_str(&fields);
            left = number.get(length..)?;
        }
        pattern.push_str(left);
        Some(pattern)
    }
}

/// What stands before the first digit, and the rest.
fn split_at_digit(text: &str) -> Option<(&str, &str)> {
    text.split_at_checked(text.find(|c: char| c.is_ascii_digit())?)
}

fn after_digits(text: &str) -> &str {
    text.trim_start_matches(|c: char| c.is_ascii_digit())
}

/// Whether a dash before a number is no sign: so it is where one stands before theta or z, which are never
/// negative.
fn dashes_separate(part: &str) -> bool {
    let mut left = part;
    while let Some((before, number)) = split_at_digit(left) {
        if before.ends_with('-') && number_label(before).is_some_and(|field| !field.may_be_negative()) {
            return true;
        }
        left = after_digits(number);
    }
    false
}

/// What stands behind the number of a label in a name and is not known, for messages: `"point5" behind the 4 of ...`.
pub fn unread_behind(name: &str) -> Option<String> {
    let parts = picture_stem(name)?.rsplit(['/', '\\']).take(MOST_FOLDERS);
    parts.into_iter().find_map(|part| {
        let mut left = part;
        while let Some((before, number)) = split_at_digit(left) {
            let unread = match number_label(before) {
                Some(_) => behind_first(number),
                None => unread_direction(before, number),
            };
            if unread.is_some() {
                return unread;
            }
            left = after_digits(number);
        }
        None
    })
}

/// The same for the number of a label that theta and phi share, if it is none of these.
fn unread_direction(before: &str, number: &str) -> Option<String> {
    let side = direction_label(before)?;
    let fraction = NumberPrefix::of(number)?.all;
    let theta = number.get(fraction..)?;
    match theta.strip_prefix(SEPARATORS).filter(|phi| NumberPrefix::of(phi).is_some()) {
        Some(phi) if two_angles(side, number).is_none() => behind_first(phi),
        Some(_) => None,
        None => behind_first(number),
    }
}

fn behind_first(number: &str) -> Option<String> {
    let (value, rest) = number.split_at_checked(NumberPrefix::of(number)?.all)?;
    let unknown = unit_behind(rest, Digits::Doubted).err()?;
    Some(format!("{unknown:?} behind the angle {value}"))
}

/// Whether nothing but separators stands before the next number.
fn another_number(text: &str) -> bool {
    text.trim_start_matches(SEPARATORS).starts_with(|c: char| c.is_ascii_digit())
}

/// Fields for theta and phi, one separator between them, and their length in the text.
fn two_angles(side: Side, text: &str) -> Option<(String, usize)> {
    let theta = NumberPrefix::of(text)?.all;
    let rest = text.get(theta..)?;
    let separator = rest.chars().next().filter(|c| SEPARATORS.contains(c))?;
    let phi = rest.strip_prefix(separator)?;
    let after = phi.get(NumberPrefix::of(phi)?.all..)?;
    let unit = unit_behind(after, Digits::Doubted).ok()?;
    let [theta, phi] =
        [Component::Theta, Component::Phi].map(|component| braced(Field::new(side, component), unit));
    Some((format!("{theta}{separator}{phi}"), text.len().checked_sub(after.len())?))
}

fn braced(field: Field, unit: Unit) -> String {
    let unit = if unit == Unit::Radians && field.is_angle() { ":rad" } else { "" };
    format!("{{{}{unit}}}", field.name())
}

/// Whether all angles of a pattern are in one unit: a single `rad` may be meant for all of them.
fn units_agree(pattern: &str) -> bool {
    let radians = pattern.matches(":rad}").count();
    let angles = ["{theta_", "{phi_"].map(|start| pattern.matches(start).count());
    radians == 0 || radians == angles.iter().sum::<usize>()
}

/// Folders above the picture's own that are looked at for labels.
const MOST_FOLDERS: usize = 8;

/// Whether a folder's name has a label that no other name would have: a whole word, or one of theta.
fn has_plain_label(part: &str) -> bool {
    let mut left = part;
    while let Some((before, number)) = split_at_digit(left) {
        let word = ["light", "view"].iter().any(|word| ends_with_word(before, word));
        if word || number_label(before).is_some_and(|field| !field.may_be_negative()) {
            return true;
        }
        left = after_digits(number);
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recognised(names: &[&str]) -> String {
        recognise(names.iter().copied()).unwrap().to_string()
    }

    #[test]
    fn labels_in_any_order_and_spelling() {
        for (name, pattern) in [
            ("tv15_pv30_tl45_pl60.png", "tv{theta_v}_pv{phi_v}_tl{theta_i}_pl{phi_i}"),
            ("00081 TL015 PL000 TV000 PV000.jpg", "{n} TL{theta_i} PL{phi_i} TV{theta_v} PV{phi_v}"),
            ("wool07_ti15.5po30pi-45to0.exr", "wool{n}_ti{theta_i}po{phi_v}pi{phi_i}to{theta_v}"),
            ("theta_i_15_phi_i_30.tif", "theta_i_{theta_i}_phi_i_{phi_i}"),
            (
                "thetaI=15 phiI=30 thetaO=0 phiO=0.tif",
                "thetaI={theta_i} phiI={phi_i} thetaO={theta_v} phiO={phi_v}",
            ),
            ("theta_l-15-phi_l-30.png", "theta_l-{theta_i}-phi_l-{phi_i}"),
            ("tl-15_pl-30.png", "tl-{theta_i}_pl-{phi_i}"),
            ("pl--30_tl-15.png", "pl-{phi_i}_tl-{theta_i}"),
            ("tl15_pl-30.png", "tl{theta_i}_pl{phi_i}"),
            ("x_l-0.5_y_l0.1_z_l0.8.hdr", "x_l{x_i}_y_l{y_i}_z_l{z_i}"),
            ("L15_30_V0_0_007.png", ""),
            ("007_L15.5_30_V0_0.png", "{n}_L{theta_i}_{phi_i}_V{theta_v}_{phi_v}"),
            ("a/b7 light-15-30.png", "b{n} light-{theta_i}-{phi_i}"),
            ("m/tv10_pv20/tl30_pl40.png", "tv{theta_v}_pv{phi_v}/tl{theta_i}_pl{phi_i}"),
            ("m/view_10_20/light_30_40.png", "view_{theta_v}_{phi_v}/light_{theta_i}_{phi_i}"),
            ("wool_v2_tl15_pl30.png", "wool_v{n}_tl{theta_i}_pl{phi_i}"),
            ("v2_3_tl15_pl30.png", ""),
            ("tl15_pl30_v45_0.png", ""),
            ("theta15_phi30.png", ""),
            ("15_30_45_60.png", ""),
            ("l1_v2.png", ""),
            ("tl15.png", ""),
            ("atl15_apl30.png", ""),
            ("tv15_pv30.png", ""),
            ("tl15_pl30_theta_i20.png", ""),
            ("tl95_pl30.png", "tl{theta_i}_pl{phi_i}"),
            ("tl7,5_pl0.png", ""),
            ("tl7_5_pl0.png", ""),
            ("tl7-5_pl0.png", ""),
            ("tl7p5_pl0.png", ""),
            ("tl7 5_pl0.png", ""),
            ("tl4.5e+01_pl0.png", ""),
            ("tl7_pl22,5.png", ""),
            ("l15_30,5_v0_0.png", ""),
            ("l15_30p5_v0_0.png", ""),
            ("l15,5_30_v0_0.png", ""),
            ("{tl15_pl30}.png", ""),
            ("tl7d5_pl0.png", ""),
            ("tl7\u{66b}5_pl0.png", ""),
            ("{wool}/tl15_pl30.png", "tl{theta_i}_pl{phi_i}"),
            ("wool 7,5/tl15_pl30.png", "tl{theta_i}_pl{phi_i}"),
            ("tv7.5_pv22.5/tl15_pl30.png", "tv{theta_v}_pv{phi_v}/tl{theta_i}_pl{phi_i}"),
            ("tv7,5_pv22,5/tl15_pl30.png", ""),
            ("tv7_pv22,5/tl15_pl30.png", ""),
            ("tv7p5_pv22/tl15_pl30.png", ""),
            ("tv7\u{66b}5_pv22/tl15_pl30.png", ""),
            ("tv7_5_pv22/tl15_pl30.png", ""),
            ("a\\tv7,5_pv22\\tl15_pl30.png", ""),
            ("view_7,5_20/light_30_40.png", ""),
            ("view_7_20,5/light_30_40.png", ""),
            (
                "view_030_045/exposure1/light_30_40.png",
                "view_{theta_v}_{phi_v}/exposure{n}/light_{theta_i}_{phi_i}",
            ),
            ("m/tv3_pv4/{a}/b/tl1_pl2.png", "tv{theta_v}_pv{phi_v}/{*}/b/tl{theta_i}_pl{phi_i}"),
            ("light_3_4/raw/view_1_2.png", "light_{theta_i}_{phi_i}/raw/view_{theta_v}_{phi_v}"),
            ("view_7,5_20/a/light_30_40.png", ""),
            ("view_1_2_3/a/light_30_40.png", ""),
            ("/home/v2_3/a/light_30_40.png", "light_{theta_i}_{phi_i}"),
            ("overview_1_2/a/light_30_40.png", "light_{theta_i}_{phi_i}"),
            ("/l15_30.png", "l{theta_i}_{phi_i}"),
            ("tl0.26rad_pl1.57rad.png", "tl{theta_i:rad}rad_pl{phi_i:rad}rad"),
            (
                "TL0.26RAD PL1.57rad_TV0rad-pv0 rad.png",
                "TL{theta_i:rad}RAD PL{phi_i:rad}rad_TV{theta_v:rad}rad-pv{phi_v:rad} rad",
            ),
            ("l0.26_1.57rad_v0_0rad.png", "l{theta_i:rad}_{phi_i:rad}rad_v{theta_v:rad}_{phi_v:rad}rad"),
            ("tl0.26_pl1.57_rad.png", ""),
            ("tl0.26rad_pl1.57rad_tv0_pv0.png", ""),
            ("tv0_pv0/tl0.26rad_pl1.57rad.png", ""),
            ("view_0_0/a/tl0.26rad_pl1.57rad.png", ""),
            ("tv0_pv0/a/tl0.26rad_pl1.57rad.png", ""),
            ("tl15deg_pl30\u{b0}.png", "tl{theta_i}deg_pl{phi_i}\u{b0}"),
            ("tl0.26radpl1.57rad.png", ""),
            ("tl15grad_pl30grad.png", ""),
            ("tl15_pl30_gon.png", ""),
            ("l15_30gon_v0_0gon.png", ""),
            ("tl15deg30_pl30.png", ""),
            ("tl4point5_pl0.png", ""),
            ("tl4 .5_pl0.png", ""),
            ("tl4_pt5_pl0.png", ""),
            ("tl4_point_five_pl0.png", ""),
            ("tl4 Point Five pl0.png", ""),
            ("tl4_and_a_half_pl0.png", ""),
            ("l15_30_v4_half_0.png", ""),
            ("tl4_pl0_point_blank.png", "tl{theta_i}_pl{phi_i}_point_blank"),
            ("tl4_pl0_two_sides.png", "tl{theta_i}_pl{phi_i}_two_sides"),
            ("tl4_pl0..5.png", ""),
            ("tl0.5pi_pl0pi.png", ""),
            ("tl4mil_pl0mil.png", ""),
            ("tl4x10_pl0.png", ""),
            ("l15_30_v4point5_0.png", ""),
            ("l15_30point5_v0_0.png", ""),
            ("l15_30_v0_0x10.png", ""),
            ("view_4point5_20/light_30_40.png", ""),
            ("tv4_5p5_pv0/tl30_pl40.png", ""),
            ("wool_v2_l15_30.png", "wool_v{n}_l{theta_i}_{phi_i}"),
        ] {
            let found = recognise([name]).map(|pattern| pattern.to_string()).unwrap_or_default();
            assert_eq!(found, pattern, "{name}");
        }
    }

    #[test]
    fn all_pictures_must_fit() {
        let names = ["tl0_pl0.png", "tl15_pl30.png", "readme.txt", "tl15_pl-60.5.png"];
        assert_eq!(recognised(&names), "tl{theta_i}_pl{phi_i}");
        let error = recognise(names.into_iter().chain(["mask.png"])).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported);
        assert!(error.to_string().contains("mask.png"), "{error}");
    }

    #[test]
    fn pictures_of_one_pair_are_ambiguous() {
        let error = recognise(["a1 tl15_pl30.png", "a2 tl15_pl390.png"]).unwrap_err();
        assert!(
            error.to_string().contains("a1 tl15_pl30.png") && error.to_string().contains("a2 "),
            "{error}"
        );
        assert!(recognise(["a1 tl15_pl30.png", "a2 tl15_pl31.png"]).is_ok());
    }

    #[test]
    fn no_picture_is_no_pattern() {
        assert!(recognise([]).is_err());
        assert!(recognise(["tl15_pl30.txt"]).is_err());
    }
}
