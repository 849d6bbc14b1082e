//! Lists of lights without names: which picture belongs to which light is told by the order of the numbers in the names
//! of the pictures, where that is plain.

use btfkit_formats::Pair;
use btfkit_formats::named::natural_order;

use super::files::{Files, is_picture};
use crate::error::{Error, Result};
use crate::words::counted;

/// The pair of each file, and what that assumes; `lights` are those of the list, in its order.
///
/// # Errors
/// Names the pictures whose order is doubtful: without numbers, with fractions, or that differ in more than a number.
pub(super) fn in_order(
    list: &str,
    files: &Files,
    lights: Vec<Pair>,
) -> Result<(Vec<Option<Pair>>, Option<String>)> {
    let mut pictures: Vec<usize> =
        (0..files.len()).filter(|&number| is_picture(files.name(number))).collect();
    pictures.sort_by(|&a, &b| natural_order(files.name(a), files.name(b)));
    if pictures.len() != lights.len() {
        return Err(Error::input(format!(
            "{list}: got {} without names and {}, expected as many",
            counted(lights.len(), "light"),
            counted(pictures.len(), "picture")
        )));
    }
    let names: Vec<&str> = pictures.iter().map(|&number| files.name(number)).collect();
    if let Some(doubt) = doubt(&names) {
        return Err(Error::input(format!("{list}: lights without names, and {doubt}"))
            .hint("put the names of the pictures into the list"));
    }
    let remark = names.first().zip(names.last()).map(|(first, last)| {
        format!(
            "the list has no names: its lights are those of the pictures in the order of the numbers in their names, from \
             {first} to {last}"
        )
    });
    let mut pairs = vec![None; files.len()];
    for (number, pair) in pictures.into_iter().zip(lights) {
        pairs[number] = Some(pair);
    }
    Ok((pairs, remark))
}

/// Why the order of names, which are sorted, may not be the one that is meant.
fn doubt(names: &[&str]) -> Option<String> {
    let small: Vec<String> = names.iter().map(|name| name.to_lowercase()).collect();
    // With folders, without the ending.
    let stem = |at: usize| small[at].rsplit_once('.').map_or(small[at].as_str(), |(stem, _)| stem);
    let own = |at: usize| stem(at).rsplit(['/', '\\']).next().unwrap_or_default();
    let all = || 0..names.len();
    let neighbours = || all().zip(all().skip(1));
    if let Some((a, b)) = neighbours().find(|&(a, b)| natural_order(&small[a], &small[b]).is_ge()) {
        return Some(format!("{} and {}, of which either may be first", names[a], names[b]));
    }
    if let Some(plain) = all().find(|&at| names.len() > 1 && !own(at).contains(char::is_numeric)) {
        return Some(format!("{}, which has no number", names[plain]));
    }
    // Two words have no order that is plain: left1.png, right2.png.
    let words = |at: usize| stem(at).replace(|c: char| c.is_ascii_digit(), " ");
    let differ = |a: usize, b: usize| !words(a).split_whitespace().eq(words(b).split_whitespace());
    let other_digits = |at: usize| names[at].contains(|c: char| c.is_numeric() && !c.is_ascii_digit());
    if let Some(at) = all().find(|&at| other_digits(at)) {
        return Some(format!("{}, whose number has digits other than 0 to 9", names[at]));
    }
    if let Some((a, b)) = neighbours().find(|&(a, b)| differ(a, b)) {
        return Some(format!("{} and {}, which differ in more than their numbers", names[a], names[b]));
    }
    // 0.5 and 0.10 are in another order as fractions than as two numbers.
    let digit = |c: char| c.is_ascii_digit();
    let has_fraction = |at: usize| {
        let parts: Vec<&str> = own(at).split(['.', ',']).collect();
        parts.windows(2).any(|pair| pair[0].ends_with(digit) && pair[1].starts_with(digit))
    };
    let at = all().find(|&at| has_fraction(at))?;
    Some(format!("{}, whose number may have a fraction", names[at]))
}
