//! Text from outside (names in archives, attributes of stores, paths) made harmless for terminals and logs.
//!
//! A name may hold an escape sequence that changes what a terminal shows, a line break that looks like another message,
//! or a mark that turns the direction of what follows. All are shown as escapes, `\u{1b}` say.

use std::borrow::Cow;
use std::fmt::Write;

/// Whether a character is shown as an escape: controls (C0, DEL, C1), separators of lines and paragraphs, marks that
/// turn the direction of text, and marks that cannot be seen.
fn is_harmful(c: char) -> bool {
    c.is_control()
        || matches!(c,
            '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}'
            | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}

/// One line of text: line breaks are escaped too.
pub fn escaped(text: &str) -> Cow<'_, str> {
    escaped_by(text, is_harmful, |c, to| {
        let _ = write!(to, "{}", c.escape_default());
    })
}

/// Lines of text, each as by [`escaped`].
pub fn escaped_lines(text: &str) -> Cow<'_, str> {
    let harmful = |c| c != '\n' && is_harmful(c);
    escaped_by(text, harmful, |c, to| {
        let _ = write!(to, "{}", c.escape_default());
    })
}

/// JSON that says the same: what is harmful can only lie within its strings, but for the line breaks and spaces between.
pub fn escaped_json(json: &str) -> Cow<'_, str> {
    let harmful = |c| c != '\n' && is_harmful(c);
    escaped_by(json, harmful, |c, to| {
        for unit in c.encode_utf16(&mut [0; 2]) {
            let _ = write!(to, "\\u{unit:04x}");
        }
    })
}

fn escaped_by(
    text: &str,
    harmful: impl Fn(char) -> bool,
    escape: impl Fn(char, &mut String),
) -> Cow<'_, str> {
    if !text.contains(&harmful) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if harmful(c) {
            escape(c, &mut escaped);
        } else {
            escaped.push(c);
        }
    }
    Cow::Owned(escaped)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Everything that a terminal or a log could be led astray by, and a letter of each kind that it could not.
    const HARMFUL: &str = "\u{1b}[31m\u{7}\u{0}\r\t\u{7f}\u{9b}31m\u{85}\u{2028}\u{2029}\u{202a}\u{202e}\u{2066}\u{2069}\u{200f}\u{61c}\u{feff}\u{e0041}";
    const HARMLESS: &str = "a \"b\" \\ \u{e9} \u{5e0}\u{430}\u{4e2d} \u{1f600} <b>";

    #[test]
    fn nothing_harmful_is_left_and_nothing_else_is_changed() {
        let shown = escaped(HARMFUL);
        assert!(shown.chars().all(|c| c.is_ascii_graphic()), "{shown}");
        assert!(shown.starts_with("\\u{1b}[31m\\u{7}\\u{0}\\r\\t\\u{7f}"), "{shown}");
        assert_eq!(escaped(HARMLESS), HARMLESS);
        assert_eq!(escaped("a\nb"), "a\\nb");
        assert_eq!(escaped_lines("a\nb\u{1b}"), "a\nb\\u{1b}");
    }

    #[test]
    fn json_keeps_its_meaning() {
        let value = serde_json::json!({"name": HARMFUL, "lines": "a\nb", "harmless": HARMLESS});
        let text = serde_json::to_string_pretty(&value).unwrap();
        let shown = escaped_json(&text);
        assert!(!shown.chars().any(|c| c != '\n' && is_harmful(c)), "{shown}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).unwrap(), value);
    }
}
