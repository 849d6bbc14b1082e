//! The dialect of the library that its authors publish: chunk 6 is one image.

use super::chunks::Chunks;
use super::document::Described;
use super::layout::{DEFAULT_ORDER, Entity, Layout};
use crate::reader::Reader;
use crate::utia::Number;
use crate::words::counted;
use crate::{Error, ErrorKind, Limits, Result, request};

const IMAGES: u64 = 1;
const HEIGHT: u64 = 2;
const WIDTH: u64 = 3;
const PLANES: u64 = 4;
const ORDER: u64 = 5;
const DATA: u64 = 6;

/// Number and type of the image, before its samples.
const DATA_HEAD_BYTES: usize = 16;

pub(super) fn describe(chunks: &Chunks<'_>, limits: &Limits) -> Result<Described> {
    if let Some(chunk) = chunks.one(ORDER)?
        && !chunk.numbers().eq([IMAGES, HEIGHT, WIDTH, PLANES])
    {
        let found = "another data order in a file of the library";
        return Err(Error::new(ErrorKind::Unsupported, found, "1, 2, 3, 4").at(chunk.at));
    }
    let mut layout = Layout {
        images: chunks.number(IMAGES, 0)?,
        tiles: 1,
        height: chunks.number(HEIGHT, 0)?,
        width: chunks.number(WIDTH, 0)?,
        planes: chunks.number(PLANES, 0)?,
        order: DEFAULT_ORDER,
        entities: Vec::new(),
    };
    request::plane(layout.width, layout.height, layout.planes, limits)?;
    let count = chunks.all(DATA).count();
    if u64::try_from(count) != Ok(layout.images) || count == 0 {
        // Older states of the library had other ids, and wrote files that it cannot read itself.
        let expected = format!("{}, as chunk 1 says, and at least one", layout.images);
        return Err(Error::malformed(format!("{} 6 of image data", counted(count, "chunk")), expected));
    }
    let samples = layout.entity_samples().and_then(|samples| usize::try_from(samples).ok());
    let mut entities = vec![None; count];
    for chunk in chunks.all(DATA) {
        let wrong = |found: String, expected: &'static str| Error::malformed(found, expected).at(chunk.at);
        let mut head = Reader::new(chunk.data);
        let (Ok(index), Ok(id)) = (head.u64_le(), head.u64_le()) else {
            return Err(chunk.wrong_size("number and type of an image, and its samples"));
        };
        let Some(number) = Number::from_library_id(id) else {
            return Err(wrong(format!("data type {id}"), "1 to 11"));
        };
        let size = samples
            .and_then(|samples| samples.checked_mul(number.bytes()))
            .and_then(|size| size.checked_add(DATA_HEAD_BYTES)?.checked_next_multiple_of(8));
        if size != Some(chunk.data.len()) {
            return Err(chunk.wrong_size("16, and the samples of an image, padded to a multiple of 8"));
        }
        let slot = usize::try_from(index).ok().and_then(|index| entities.get_mut(index));
        let at = chunk.data_at.checked_add(DATA_HEAD_BYTES);
        match (slot, at) {
            (Some(slot @ None), Some(at)) => *slot = Some(Entity { number, at }),
            (Some(_), _) => return Err(wrong(format!("image {index} a second time"), "once")),
            (None, _) => return Err(wrong(format!("image {index} of {count}"), "a smaller number")),
        }
    }
    layout.entities = entities.into_iter().flatten().collect();
    Ok(Described {
        format: "BIG as its library writes it".to_owned(),
        layout,
        directions: None,
        no_directions: "no directions, as in all files of the library",
        color_space: String::new(),
        remarks: Vec::new(),
    })
}
