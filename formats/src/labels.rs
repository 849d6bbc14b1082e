//! The labels that stand before numbers in names: `tl`, `phi_v`, `light`.

use crate::fields::{Component, Field, NumberPrefix, Side};

/// Words that say what a number is, before the word of its side.
const COMPONENTS: [(&str, Component); 7] = [
    ("theta", Component::Theta),
    ("t", Component::Theta),
    ("phi", Component::Phi),
    ("p", Component::Phi),
    ("x", Component::X),
    ("y", Component::Y),
    ("z", Component::Z),
];

/// Words of the light (or what comes in) and of the view (or what goes out).
const SIDES: [(&str, Side); 6] = [
    ("light", Side::Light),
    ("l", Side::Light),
    ("i", Side::Light),
    ("view", Side::View),
    ("v", Side::View),
    ("o", Side::View),
];

/// What may stand between a label and its number, or between two angles of one label.
pub(crate) const SEPARATORS: [char; 5] = ['_', '-', ' ', '=', ','];

/// The field whose label a text ends with, separators aside.
pub(crate) fn number_label(before: &str) -> Option<Field> {
    COMPONENTS.iter().find_map(|&(word, component)| {
        SIDES.iter().find_map(|&(of, side)| {
            let labels = [format!("{word}{of}"), format!("{word}_{of}")];
            labels.iter().any(|label| ends_with_word(before, label)).then_some(Field::new(side, component))
        })
    })
}

/// The side whose label a text ends with, separators aside.
pub(crate) fn direction_label(before: &str) -> Option<Side> {
    SIDES.iter().find_map(|&(word, side)| ends_with_word(before, word).then_some(side))
}

/// Whether a text, less the separators at its end, ends with this word in any case, with no letter before it.
pub(crate) fn ends_with_word(text: &str, word: &str) -> bool {
    let text = text.trim_end_matches(SEPARATORS);
    let start = text.len().checked_sub(word.len());
    start.and_then(|start| text.split_at_checked(start)).is_some_and(|(before, found)| {
        found.eq_ignore_ascii_case(word) && !before.ends_with(char::is_alphabetic)
    })
}

/// Whether a text begins with a label and what it is for: `pl30`, `phi_l-30`, `v45_60`. A field of a pattern counts
/// as a number.
pub(crate) fn starts_with_label(text: &str) -> bool {
    fn after<'a>(text: &'a str, word: &str) -> Option<&'a str> {
        let (found, rest) = text.split_at_checked(word.len())?;
        found.eq_ignore_ascii_case(word).then_some(rest)
    }
    let number = |rest: &str| rest.starts_with('{') || NumberPrefix::of(rest).is_some();
    // One label may begin with another.
    let of_side = |rest: &str, shared: bool| {
        SIDES.iter().filter_map(|(side, _)| after(rest, side)).any(|rest| {
            let rest = rest.trim_start_matches(SEPARATORS);
            let second = || {
                let first = NumberPrefix::of(rest)?;
                rest.get(first.all..)?.strip_prefix(SEPARATORS)
            };
            number(rest) && (!shared || rest.starts_with('{') || second().is_some_and(number))
        })
    };
    let own =
        |rest: &str| of_side(rest, false) || rest.strip_prefix('_').is_some_and(|rest| of_side(rest, false));
    of_side(text, true) || COMPONENTS.iter().filter_map(|(word, _)| after(text, word)).any(own)
}
