//! The texts beside the tiles: the description that viewers read, and a viewer of our own.

use serde_json::json;

use super::Encoding;
use super::pyramid::Pyramid;
use crate::error::{Error, Result};

/// The viewer; the token below stands where the picture is described.
const VIEWER: &str = include_str!("viewer.html");

/// Replaced in [`VIEWER`].
const TOKEN: &str = "/*PICTURE*/null";

/// The description, XML.
pub(crate) fn description(pyramid: &Pyramid, encoding: Encoding) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <Image xmlns=\"http://schemas.microsoft.com/deepzoom/2008\" Format=\"{}\" Overlap=\"{}\" TileSize=\"{}\">\n\
         \x20 <Size Width=\"{}\" Height=\"{}\"/>\n\
         </Image>\n",
        encoding.ending(),
        pyramid.overlap,
        pyramid.side,
        pyramid.size.width,
        pyramid.size.height
    )
}

/// The viewer's page, which finds the tiles beside itself.
pub(crate) fn viewer(pyramid: &Pyramid, encoding: Encoding, name: &str) -> Result<String> {
    let picture = json!({
        "name": name, "width": pyramid.size.width, "height": pyramid.size.height,
        "tile": pyramid.side, "overlap": pyramid.overlap, "ending": encoding.ending(),
    });
    // A name must not end the script.
    let picture = picture.to_string().replace('<', "\\u003c");
    let (before, after) = VIEWER
        .split_once(TOKEN)
        .ok_or_else(|| Error::internal("the viewer's page has no place for its picture"))?;
    Ok(format!("{before}{picture}{after}"))
}
