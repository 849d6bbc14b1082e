//! Values in a packet of XMP (ISO 16684-1): an attribute or an element of a name in a namespace, whatever its prefix.

use memchr::memmem;

/// Prefixes of one namespace that are tried.
const MOST_PREFIXES: usize = 8;

/// The values of all names `name` in `namespace`, whose usual prefix is `usual` where the packet binds none.
pub(crate) fn values<'a>(packet: &'a [u8], namespace: &str, usual: &str, name: &str) -> Vec<&'a [u8]> {
    let bound =
        memmem::find_iter(packet, namespace.as_bytes()).filter_map(|at| prefix_before(packet.get(..at)?));
    let mut prefixes: Vec<&[u8]> = bound.take(MOST_PREFIXES).collect();
    if !prefixes.contains(&usual.as_bytes()) {
        prefixes.push(usual.as_bytes());
    }
    let found = |prefix: &&[u8]| {
        let full = [prefix, &b":"[..], name.as_bytes()].concat();
        let places: Vec<usize> =
            memmem::find_iter(packet, &full).map(|at| at.saturating_add(full.len())).collect();
        places.into_iter().filter_map(|end| value(packet.get(end..)?)).collect::<Vec<_>>()
    };
    prefixes.iter().flat_map(found).collect()
}

/// The prefix of `xmlns:prefix="`, at the end of a text.
fn prefix_before(text: &[u8]) -> Option<&[u8]> {
    let text = text.strip_suffix(b"\"").or_else(|| text.strip_suffix(b"'"))?.trim_ascii_end();
    let text = text.strip_suffix(b"=")?.trim_ascii_end();
    let start = text.iter().rposition(|byte| !byte.is_ascii_alphanumeric() && !b"_-.".contains(byte))?;
    let (before, prefix) = text.split_at_checked(start)?;
    before.ends_with(b"xmlns").then(|| prefix.get(1..)).flatten()
}

/// What follows the name: `="value"` or `>value<`, attributes before the `>` aside.
fn value(rest: &[u8]) -> Option<&[u8]> {
    let rest = rest.trim_ascii_start();
    let (rest, end) = match rest.split_first()? {
        (b'=', after) => {
            let after = after.trim_ascii_start();
            let quote = *after.first()?;
            (after.get(1..)?, quote)
        }
        (b'>', after) => (after, b'<'),
        // `</tiff:Orientation>`, a longer name, or attributes of the element.
        _ => {
            let close = rest.iter().position(|&byte| byte == b'>')?;
            let attributes = rest.get(..close)?;
            if !attributes.contains(&b'=') || attributes.contains(&b'<') {
                return None;
            }
            (rest.get(close.checked_add(1)?..)?, b'<')
        }
    };
    let len = rest.iter().position(|&byte| byte == end).unwrap_or(rest.len());
    rest.get(..len).map(<[u8]>::trim_ascii)
}
