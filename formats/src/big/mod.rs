//! BIG ("Big Image Group" 3.0, UTIA Prague): all images of a material in one file of chunks.
//!
//! After eight bytes of signature every chunk is a 64-bit id, a 64-bit length and data, little-endian, all multiples of 8 bytes.
//! Two dialects share the signature, and both are read:
//!
//! - that of the format's document: one data chunk, in an order of images, tiles, rows, columns and planes that the file gives, and
//!   directions for every image;
//! - that of the library which writes such files: other ids, one data chunk for each image, no directions.
//!
//! In the document chunk 5 is a number of planes (8 bytes), in the library the order of the data (32 bytes): so they are told apart.

mod chunks;
mod directions;
mod document;
mod layout;
mod library;

use std::ops::Range;

use chunks::{Chunks, SIGNATURE};
use layout::Layout;

use crate::utia::{self, Colors, Grid, Opened, Order, transfer};
use crate::words::counted;
use crate::{Assumption, Contents, Error, ErrorKind, Images, Limits, Result, Samples, request};

/// What the caller knows about a file that the file does not say.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Options {
    /// The directions of a file that has none of its own.
    pub order: Order,
    /// Which tile of every image is read, from 0.
    pub tile: u64,
}

/// Whether the bytes begin with the signature of a BIG file.
pub fn recognise(bytes: &[u8]) -> bool {
    bytes.starts_with(SIGNATURE)
}

/// An open BIG file.
#[derive(Debug, Clone)]
pub struct Big {
    opened: Opened,
    layout: Layout,
    tile: u64,
}

impl Big {
    /// Reads the chunks of `bytes`, the whole file. No samples are read.
    ///
    /// # Errors
    /// - [`ErrorKind::Malformed`]: chunks that leave the file or have other sizes than their kind, chunks twice, data of another size than
    ///   the dimensions say, directions that are no grid of views and lights (the missing pairs are named).
    /// - [`ErrorKind::Unsupported`]: one bit a sample; directions as device angles only; none at all, unless
    ///   [`Options::order`] gives them.
    /// - [`ErrorKind::Argument`]: an order for a file that has its own, or of another number of images; a tile that is not there.
    /// - [`ErrorKind::Limit`]: more pixels, channels or directions than `limits` allows.
    pub fn open(bytes: &[u8], options: &Options, limits: &Limits) -> Result<Big> {
        let chunks = Chunks::read(bytes)?;
        let described = if chunks.is_library()? {
            library::describe(&chunks, limits)?
        } else {
            document::describe(&chunks, limits)?
        };
        let layout = described.layout;
        let (width, height) = request::plane(layout.width, layout.height, layout.planes, limits)?;
        if options.tile >= layout.tiles {
            let expected = format!("less than {}", layout.tiles);
            return Err(Error::new(ErrorKind::Argument, format!("tile {}", options.tile), expected));
        }
        let (pairs, assumptions) = match (described.directions, options.order) {
            (Some(directions), Order::Stated) => (directions.pairs, directions.assumptions),
            (Some(_), order) => {
                let found = format!("an order of images, {order:?}, for a file that has directions");
                return Err(Error::new(ErrorKind::Argument, found, "the order that is stated"));
            }
            (None, Order::Stated) => {
                let expected = "spherical or half-difference angles, or an order of images from the caller";
                return Err(Error::new(ErrorKind::Unsupported, described.no_directions, expected));
            }
            (None, order) => {
                let text = format!("The directions are those of the order {order:?}, as the caller said.");
                (order.pairs(), vec![text])
            }
        };
        if u64::try_from(pairs.len()) != Ok(layout.images) {
            return Err(Error::new(
                ErrorKind::Argument,
                counted(layout.images, "image"),
                format!("{} for the order {:?}", pairs.len(), options.order),
            ));
        }
        let grid = Grid::from_pairs(&pairs, limits)?;
        let planes = usize::try_from(layout.planes).unwrap_or(usize::MAX);
        let colors = Colors::new(planes, &described.color_space, None);
        let sample_type = colors.sample_type(layout.numbers());
        let mut assumptions: Vec<Assumption> = assumptions.into_iter().map(Assumption::from).collect();
        assumptions.extend(utia::assumptions());
        let (linear, transfer) = transfer(sample_type);
        assumptions.extend(colors.assumptions.into_iter().map(Assumption::from));
        assumptions.push(transfer);
        if described.color_space.is_empty() {
            assumptions
                .push("The planes are named by their number only: the file gives no colour space.".into());
        }
        let mut remarks = described.remarks;
        if layout.tiles > 1 {
            remarks.push(("tile".to_owned(), format!("{} of {}", options.tile, layout.tiles)));
        }
        let contents = Contents {
            format: described.format,
            width,
            height,
            channels: colors.channels,
            sample_type,
            views: grid.views.clone(),
            lights: grid.lights.clone(),
            linear,
            cosine_included: true,
            assumptions,
            remarks,
        };
        let opened = Opened { contents, grid, unit: colors.unit, bytes: bytes.len(), limits: limits.clone() };
        Ok(Big { opened, layout, tile: options.tile })
    }
}

impl Images for Big {
    fn contents(&self) -> &Contents {
        &self.opened.contents
    }

    fn read_images(&self, bytes: &[u8], view: usize, lights: Range<usize>) -> Result<Samples> {
        self.opened.read(bytes, view, lights, |place, unit, samples| {
            self.layout.append_image(bytes, [u64::try_from(place).ok()?, self.tile], unit, samples)
        })
    }
}
