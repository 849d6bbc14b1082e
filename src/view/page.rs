//! The page: its programs put together in one script, its style, and the material.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::error::{Error, Result};

/// The programs, each after those that it uses.
const MODULES: &[&str] = &[
    include_str!("web/data.js"),
    include_str!("web/directions.js"),
    include_str!("web/palette.js"),
    include_str!("web/coherent.js"),
    include_str!("web/gl.js"),
    include_str!("web/synthesis.js"),
    include_str!("web/tiles.js"),
    include_str!("web/shaders.js"),
    include_str!("web/state.js"),
    include_str!("web/renderer.js"),
    include_str!("web/inspector.js"),
    include_str!("web/dome.js"),
    include_str!("web/gestures.js"),
    include_str!("web/panel.js"),
    include_str!("web/main.js"),
];

const FRAME: &str = include_str!("web/page.html");
const STYLE: &str = include_str!("web/page.css");

/// The page with the material in it.
pub(super) fn whole(name: &str, packed: &[u8]) -> Result<String> {
    put_together(name, "connect-src 'none'", "", &STANDARD.encode(packed))
}

/// The page that asks its server for the material.
pub(super) fn served(name: &str) -> Result<String> {
    put_together(name, "connect-src 'self'", " data-address=\"material\"", "")
}

fn put_together(name: &str, policy: &str, address: &str, material: &str) -> Result<String> {
    let mut page = FRAME.to_owned();
    let script = bundle();
    for (place, text) in [
        ("{{policy}}", policy),
        ("{{style}}", STYLE),
        ("{{address}}", address),
        ("{{script}}", &script),
        ("{{material}}", material),
        // Last, since a name may hold anything.
        ("{{title}}", &escaped(name)),
    ] {
        let (before, after) = page
            .split_once(place)
            .ok_or_else(|| Error::internal(format!("the page has no place {place}")))?;
        page = [before, text, after].concat();
    }
    Ok(page)
}

/// The modules as one script: they share one scope, so that what they say of each other falls away.
fn bundle() -> String {
    let lines = MODULES.iter().flat_map(|module| module.lines());
    let kept = lines.filter(|line| !line.starts_with("import "));
    kept.flat_map(|line| [line.strip_prefix("export ").unwrap_or(line), "\n"]).collect()
}

/// Text as HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_page_has_all_its_parts_and_asks_for_nothing() {
        let page = whole("<b> & co", b"material").unwrap();
        assert!(page.contains("<title>&lt;b&gt; &amp; co"));
        assert!(page.contains(&STANDARD.encode(b"material")));
        let places = ["policy", "title", "style", "address", "script", "material"];
        assert!(places.iter().all(|place| !page.contains(&format!("{{{{{place}}}}}"))));
        assert!(!page.contains("\nimport ") && !page.contains("\nexport "));
        assert!(!page.contains("http://") && !page.contains("https://"), "the page asks for something");
        assert!(served("x").unwrap().contains("data-address=\"material\""));
    }

    #[test]
    fn modules_are_where_those_find_them_that_use_them() {
        let mut known: Vec<&str> = Vec::new();
        for module in MODULES {
            for line in module.lines().filter(|line| line.starts_with("import ")) {
                let (names, from) = line.split_once(" from ").unwrap();
                assert!(from.starts_with("\"./") && from.ends_with(".js\";"), "{line}");
                for name in names.trim_start_matches("import").trim_matches([' ', '{', '}']).split(", ") {
                    assert!(known.contains(&name), "{line}: {name} comes later, or from nowhere");
                }
            }
            for line in module.lines() {
                let Some(exported) = line.strip_prefix("export ") else { continue };
                let words = exported.trim_start_matches("async ");
                let name =
                    words.split([' ', '(', '{']).filter(|word| !word.is_empty() && *word != "*").nth(1);
                let name = name.unwrap();
                assert!(!known.contains(&name), "{name} is there twice");
                known.push(name);
            }
        }
    }
}
