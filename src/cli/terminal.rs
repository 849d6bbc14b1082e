//! The terminal's width, and text wrapped to it. What goes to a file or a pipe is never wrapped.

use std::io::{stderr, stdout};
use std::os::fd::AsFd;

use unicode_width::UnicodeWidthStr;

/// The narrowest terminal that text is wrapped for.
const LEAST_WIDTH: usize = 24;

/// Columns of the terminal that standard output is.
pub(super) fn of_output() -> Option<usize> {
    columns(&stdout())
}

/// Columns of the terminal that standard error is.
pub(super) fn of_errors() -> Option<usize> {
    columns(&stderr())
}

fn columns(stream: &impl AsFd) -> Option<usize> {
    let (width, _) = terminal_size::terminal_size_of(stream)?;
    Some(usize::from(width.0)).filter(|&width| width >= LEAST_WIDTH)
}

/// Columns that a text takes.
pub(super) fn width_of(text: &str) -> usize {
    text.width()
}

/// A text whose lines are broken between words to fit `width` columns, where there is a width; further lines of a line
/// begin at the column of its text: behind a label, or as far in as the line itself.
pub(super) fn wrapped(text: &str, width: Option<usize>) -> String {
    let Some(width) = width else { return text.to_owned() };
    let line = |line: &str| {
        let indent = hanging_indent(line).min(width / 2);
        pieces(line, width, width.saturating_sub(indent)).join(&format!("\n{}", " ".repeat(indent)))
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// Where the text of a line begins: behind its leading spaces, or behind a label that two spaces end.
fn hanging_indent(line: &str) -> usize {
    let leading = line.len() - line.trim_start().len();
    if leading > 0 {
        return leading;
    }
    let Some(end) = line.find("  ") else { return 2 };
    let rest = &line[end..];
    width_of(&line[..end]) + rest.len() - rest.trim_start().len()
}

/// The pieces of a line: the first of at most `first` columns, the others of at most `other`. A word that is longer
/// has a piece of its own.
pub(super) fn pieces(line: &str, first: usize, other: usize) -> Vec<String> {
    if width_of(line) <= first {
        return vec![line.to_owned()];
    }
    let mut pieces = Vec::new();
    let mut piece = String::new();
    // Spaces stay with the word behind them, so that labels and indents keep theirs.
    let mut begin = 0;
    let mut words = Vec::new();
    let mut in_word = false;
    for (at, char) in line.char_indices() {
        if char == ' ' && in_word {
            words.push(&line[begin..at]);
            (begin, in_word) = (at, false);
        } else if char != ' ' {
            in_word = true;
        }
    }
    words.push(&line[begin..]);
    for word in words {
        let room = if pieces.is_empty() { first } else { other };
        if piece.trim().is_empty() || width_of(&piece) + width_of(word) <= room {
            piece.push_str(word);
        } else {
            pieces.push(std::mem::replace(&mut piece, word.trim_start().to_owned()));
        }
    }
    pieces.push(piece);
    pieces
}

#[cfg(test)]
mod tests {
    use super::wrapped;

    #[test]
    fn lines_break_between_words_and_go_on_under_their_text() {
        let text = "clusters  256 after 12 passes; mean\n          0.5\nbtf: one two three four five six\n  a hint of many words too";
        let expected = "clusters  256 after 12\n          passes; mean\n          0.5\nbtf: one two three four\n  five six\n  a hint of many words\n  too";
        assert_eq!(wrapped(text, Some(24)), expected);
        assert_eq!(wrapped(text, None), text);
        assert_eq!(wrapped(text, Some(200)), text);
    }

    #[test]
    fn no_word_is_lost_however_narrow_it_is() {
        let text = "label  some words and averyveryverylongwordthatfitsnowhere and on";
        for width in 1..80 {
            let told = wrapped(text, Some(width));
            assert_eq!(
                told.split_whitespace().collect::<Vec<_>>(),
                text.split_whitespace().collect::<Vec<_>>(),
                "{width}"
            );
        }
    }
}
