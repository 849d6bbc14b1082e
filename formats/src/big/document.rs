//! The dialect of the document "Big Image Group", version 3.0.

use super::chunks::{Chunk, Chunks};
use super::directions::{self, Directions};
use super::layout::{Axis, DEFAULT_ORDER, Entity, Layout};
use crate::utia::Number;
use crate::words::counted;
use crate::{Error, ErrorKind, Limits, Result, request};

const IMAGES: u64 = 1;
const TILES: u64 = 2;
const HEIGHT: u64 = 3;
const WIDTH: u64 = 4;
const PLANES: u64 = 5;
const ORDER: u64 = 6;
const TYPES: u64 = 7;
const DATA: u64 = 8;
const COLOR_SPACE: u64 = 9;
const PIXELS_PER_MM: u64 = 11;
/// Texts that are passed on as they are.
const TEXTS: [(u64, &str); 3] = [(10, "illuminant"), (12, "name"), (13, "text")];

/// Data type of a file without a chunk of types.
const DEFAULT_TYPE: u64 = 2;
/// One bit a sample.
const BIT: u64 = 12;

/// What a file says of itself, in either dialect.
pub(super) struct Described {
    pub(super) format: String,
    pub(super) layout: Layout,
    pub(super) directions: Option<Directions>,
    /// What is found where directions are missing.
    pub(super) no_directions: &'static str,
    pub(super) color_space: String,
    pub(super) remarks: Vec<(String, String)>,
}

pub(super) fn describe(chunks: &Chunks<'_>, limits: &Limits) -> Result<Described> {
    let mut layout = Layout {
        images: chunks.number(IMAGES, 0)?,
        tiles: chunks.number(TILES, 1)?,
        height: chunks.number(HEIGHT, 0)?,
        width: chunks.number(WIDTH, 0)?,
        planes: chunks.number(PLANES, 1)?,
        order: chunks.one(ORDER)?.map_or(Ok(DEFAULT_ORDER), order)?,
        entities: Vec::new(),
    };
    request::plane(layout.width, layout.height, layout.planes, limits)?;
    if layout.images == 0 || layout.tiles == 0 {
        let found = format!("{} of {}", counted(layout.images, "image"), counted(layout.tiles, "tile"));
        return Err(Error::malformed(found, "at least one of each"));
    }
    let Some(data) = chunks.one(DATA)? else {
        return Err(Error::malformed("no chunk of data", "one"));
    };
    layout.entities = entities(&layout, data, chunks.one(TYPES)?)?;

    let directions = directions::read(chunks, layout.images)?;
    let text = |id: u64| Ok::<_, Error>(chunks.one(id)?.map(Chunk::text).filter(|text| !text.is_empty()));
    let mut remarks = Vec::new();
    for (id, name) in TEXTS {
        if let Some(text) = text(id)? {
            remarks.push((name.to_owned(), text));
        }
    }
    if let Some(chunk) = chunks.one(PIXELS_PER_MM)? {
        remarks.push(("pixels per mm".to_owned(), f64::from_bits(chunk.number()?).to_string()));
    }
    Ok(Described {
        format: "BIG 3.0".to_owned(),
        layout,
        directions,
        no_directions: "no directions but device angles",
        color_space: text(COLOR_SPACE)?.unwrap_or_default(),
        remarks,
    })
}

/// The ids of the five dimensions, outermost first.
fn order(chunk: &Chunk<'_>) -> Result<[Axis; 5]> {
    let axes: Option<Vec<Axis>> = chunk
        .numbers()
        .map(|id| {
            let place = usize::try_from(id).ok()?.checked_sub(1)?;
            DEFAULT_ORDER.get(place).copied()
        })
        .collect();
    let axes: Option<[Axis; 5]> = axes.and_then(|list| list.try_into().ok());
    let complete = |axes: &[Axis; 5]| DEFAULT_ORDER.iter().all(|axis| axes.contains(axis));
    axes.filter(complete).ok_or_else(|| {
        let found = format!("a data order of other numbers, {}", counted(chunk.data.len(), "byte"));
        Error::malformed(found, "each of 1, 2, 3, 4, 5 once").at(chunk.at)
    })
}

/// Types and places of the outermost entities, checked against the data that are there.
fn entities(layout: &Layout, data: &Chunk<'_>, types: Option<&Chunk<'_>>) -> Result<Vec<Entity>> {
    let [outermost, ..] = layout.order;
    let count = layout.size(outermost);
    let too_large = || {
        Error::malformed(
            format!(
                "{} x {} tiles x {} rows x {} columns x {} planes in {} of data",
                counted(layout.images, "image"),
                layout.tiles,
                layout.height,
                layout.width,
                layout.planes,
                counted(data.data.len(), "byte")
            ),
            "as many samples as there are bytes for",
        )
        .at(data.at)
    };
    let samples = layout.entity_samples().and_then(|samples| usize::try_from(samples).ok());
    let Some(samples) = samples else { return Err(too_large()) };
    // A sample takes a byte at least: what follows is bounded by the data.
    let count = usize::try_from(count)
        .ok()
        .filter(|count| count.checked_mul(samples).is_some_and(|samples| samples <= data.data.len()));
    let Some(count) = count else { return Err(too_large()) };
    let mut entities = Vec::with_capacity(count);
    let mut at = data.data_at;
    for number in numbers(count, types)? {
        entities.push(Entity { number, at });
        let size = samples.checked_mul(number.bytes());
        at = size.and_then(|size| at.checked_add(size)).ok_or_else(too_large)?;
    }
    let size = at.saturating_sub(data.data_at);
    if size.checked_next_multiple_of(8) != Some(data.data.len()) {
        let expected = format!("{size}, as the dimensions say, and less than 8 of padding");
        return Err(
            Error::malformed(format!("{} of data", counted(data.data.len(), "byte")), expected).at(data.at)
        );
    }
    Ok(entities)
}

/// One type for all, or 0 and one for each of the `count` entities.
fn numbers(count: usize, types: Option<&Chunk<'_>>) -> Result<Vec<Number>> {
    let number = |id: u64| {
        let at = types.map_or(0, |chunk| chunk.at);
        Number::from_document_id(id).ok_or_else(|| match id {
            BIT => Error::new(ErrorKind::Unsupported, "samples of one bit", "whole bytes").at(at),
            _ => Error::malformed(format!("data type {id}"), "1 to 12").at(at),
        })
    };
    let Some(chunk) = types else { return Ok(vec![number(DEFAULT_TYPE)?; count]) };
    let mut ids = chunk.numbers();
    match (ids.next(), ids.len()) {
        (Some(0), rest) if rest == count => ids.map(number).collect(),
        (Some(id), 0) if id != 0 => Ok(vec![number(id)?; count]),
        (Some(0), rest) => {
            let expected = format!("one for each of {}", counted(count, "outermost entity"));
            Err(Error::malformed(format!("{} after a 0", counted(rest, "data type")), expected).at(chunk.at))
        }
        _ => Err(chunk.wrong_size("one data type, or 0 and one for each outermost entity")),
    }
}
