//! MIF ("Multi-Image Format" 1, UTIA Prague): numbered images, and an XML text that says what they are.
//!
//! Every chunk is a 64-bit type, a 64-bit length and data, little-endian, without alignment; the first one is the signature and the
//! version. A `btf` element of the XML names a list of directions and the images that it is about.

mod chunks;
mod description;
mod xml;

use std::ops::Range;

use chunks::{Chunks, Image, SIGNATURE};
use description::Description;

use crate::utia::{self, Colors, Grid, Opened, Order, transfer};
use crate::{Assumption, Contents, Error, Images, Limits, Result, Samples, request};

/// What the caller chooses, or knows about a file that the file does not say.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Options {
    /// The directions of a file that has no list of them, nor the name of an order.
    pub order: Order,
    /// The id of the `btf` element, such as "btf0"; needed only where a file has several.
    pub btf: Option<String>,
}

/// Whether the bytes begin with the signature of a MIF file.
pub fn recognise(bytes: &[u8]) -> bool {
    bytes.starts_with(SIGNATURE)
}

/// An open MIF file.
#[derive(Debug, Clone)]
pub struct Mif {
    opened: Opened,
    /// In the order of the pairs that the grid was made of.
    images: Vec<Image>,
}

impl Mif {
    /// Reads the heads of all chunks of `bytes`, the whole file, and the XML. No samples are read.
    ///
    /// # Errors
    /// - [`ErrorKind::Malformed`]: chunks that leave the file or have other sizes than their head says, images twice, bad XML, images
    ///   of a `btf` element that are not there or not alike, directions that are no grid of views and lights (the missing pairs
    ///   are named).
    /// - [`ErrorKind::Unsupported`]: another version; mipmaps; no XML or no directions, unless [`Options::order`] gives them.
    /// - [`ErrorKind::Argument`]: no `btf` element of that id, or several and none chosen; an order for a file that has its own.
    /// - [`ErrorKind::Limit`]: more pixels, channels, directions, images or XML than `limits` allows.
    pub fn open(bytes: &[u8], options: &Options, limits: &Limits) -> Result<Mif> {
        let chunks = Chunks::read(bytes, limits)?;
        let description = match chunks.xml {
            Some((bytes, at)) => xml::text(bytes, limits)
                .and_then(|text| description::read(&xml::parse(&text, limits)?, options))
                .map_err(|e| e.at(at))?,
            None => Description::of_images(options.order, chunks.images.len())?,
        };
        let images: Vec<Image> = description
            .images
            .iter()
            .map(|&index| {
                let missing =
                    || Error::malformed(format!("no image {index}"), "every image of the directions");
                chunks.images.get(&index).copied().ok_or_else(missing)
            })
            .collect::<Result<_>>()?;
        let Some(&first) = images.first() else {
            return Err(Error::malformed("no images", "at least one"));
        };
        if let Some(other) = images.iter().find(|image| image.size() != first.size()) {
            let [height, width, planes] = other.size();
            let expected = format!("{:?}, as the first", first.size());
            return Err(
                Error::malformed(format!("an image of [{height}, {width}, {planes}]"), expected).at(other.at)
            );
        }
        let [height, width, planes] = first.size();
        let (width, height) = request::plane(width, height, planes, limits)?;
        let planes = usize::try_from(planes).unwrap_or(usize::MAX);
        let labels = description.labels.filter(|labels| labels.len() == planes);
        let colors = Colors::new(planes, &description.color_space, labels);
        let sample_type = colors.sample_type(images.iter().map(|image| image.number));
        let (linear, transfer) = transfer(sample_type);
        let grid = Grid::from_pairs(&description.pairs, limits)?;

        let mut assumptions: Vec<Assumption> =
            description.assumptions.into_iter().map(Assumption::from).collect();
        assumptions.extend(utia::assumptions());
        assumptions.extend(colors.assumptions.into_iter().map(Assumption::from));
        assumptions.push(transfer);
        let mut remarks = description.remarks;
        let others = chunks.images.len().saturating_sub(images.len());
        if others > 0 {
            remarks.push(("other images".to_owned(), others.to_string()));
        }
        let contents = Contents {
            format: "MIF 1".to_owned(),
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
        Ok(Mif { opened, images })
    }
}

impl Images for Mif {
    fn contents(&self) -> &Contents {
        &self.opened.contents
    }

    fn read_images(&self, bytes: &[u8], view: usize, lights: Range<usize>) -> Result<Samples> {
        self.opened.read(bytes, view, lights, |place, unit, samples| {
            let image = self.images.get(place)?;
            image.number.append(samples, bytes.get(image.samples()?)?, unit);
            Some(())
        })
    }
}
