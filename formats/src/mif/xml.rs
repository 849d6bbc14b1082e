//! The XML text, parsed under limits.

use roxmltree::{Document, ParsingOptions};

use crate::text::utf8;
use crate::words::counted;
use crate::{Error, ErrorKind, Limits, Result};

/// Attributes of one element; published ones have ten at most. The parser compares each with all others of its element.
const MAX_ATTRIBUTES: usize = 256;

/// Parses a text: no document type, no namespaces, no element of very many attributes, as many nodes as a zip may have
/// entries. Nested elements cost the parser no stack.
pub(super) fn parse<'a>(text: &'a str, limits: &Limits) -> Result<Document<'a>> {
    if text.contains("xmlns") {
        return Err(Error::new(ErrorKind::Unsupported, "XML with namespaces", "none"));
    }
    if most_attributes(text) > MAX_ATTRIBUTES {
        let expected = format!("at most {MAX_ATTRIBUTES}");
        return Err(Error::new(ErrorKind::Limit, "an XML element of very many attributes", expected));
    }
    let options = ParsingOptions {
        allow_dtd: false,
        nodes_limit: u32::try_from(limits.max_entries).unwrap_or(u32::MAX),
        ..ParsingOptions::default()
    };
    Document::parse_with_options(text, options).map_err(|error| match error {
        roxmltree::Error::NodesLimitReached => {
            let expected = format!("at most {} (max_entries)", limits.max_entries);
            Error::new(ErrorKind::Limit, "more nodes of XML", expected)
        }
        other => Error::malformed(format!("XML that breaks its rules: {other}"), "well-formed XML"),
    })
}

/// The text of a chunk, of limited size: UTF-8, or UTF-16 with its mark.
pub(super) fn text(bytes: &[u8], limits: &Limits) -> Result<String> {
    if u64::try_from(bytes.len()).is_ok_and(|length| length > limits.max_entry_bytes) {
        let expected = format!("at most {} (max_entry_bytes)", limits.max_entry_bytes);
        return Err(Error::new(
            ErrorKind::Limit,
            format!("{} of XML", counted(bytes.len(), "byte")),
            expected,
        ));
    }
    let Ok(text) = String::from_utf8(utf8(bytes)?.into_owned()) else {
        return Err(Error::malformed("XML that is not UTF-8", "UTF-8"));
    };
    // Writers are not agreed on whether the text ends in a zero.
    Ok(text.trim_end_matches('\0').to_owned())
}

/// No element has more: values that are begun since the last `<`, which no value may hold.
fn most_attributes(text: &str) -> usize {
    let begins_value = |rest: &&str| rest.trim_start().starts_with(['"', '\'']);
    let of_element = |element: &str| element.split('=').skip(1).filter(begins_value).count();
    text.split('<').map(of_element).max().unwrap_or(0)
}
