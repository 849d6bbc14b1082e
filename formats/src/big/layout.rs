//! Where the samples of an image lie.

use crate::Samples;
use crate::utia::Number;

/// The dimensions of the data, by the ids of the document less one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axis {
    Image,
    Tile,
    Row,
    Column,
    Plane,
}

/// Images, tiles, rows, columns, planes: the order of the document unless a file says otherwise.
pub(super) const DEFAULT_ORDER: [Axis; 5] = [Axis::Image, Axis::Tile, Axis::Row, Axis::Column, Axis::Plane];

/// The samples of one index of the outermost dimension, which are of one type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Entity {
    pub(super) number: Number,
    pub(super) at: usize,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    pub(super) images: u64,
    pub(super) tiles: u64,
    pub(super) height: u64,
    pub(super) width: u64,
    pub(super) planes: u64,
    /// Outermost first.
    pub(super) order: [Axis; 5],
    /// As many as the outermost dimension has indices.
    pub(super) entities: Vec<Entity>,
}

impl Layout {
    pub(super) fn size(&self, axis: Axis) -> u64 {
        match axis {
            Axis::Image => self.images,
            Axis::Tile => self.tiles,
            Axis::Row => self.height,
            Axis::Column => self.width,
            Axis::Plane => self.planes,
        }
    }

    /// Samples of one index of the outermost dimension.
    pub(super) fn entity_samples(&self) -> Option<u64> {
        self.order.iter().skip(1).try_fold(1u64, |product, &axis| product.checked_mul(self.size(axis)))
    }

    pub(super) fn numbers(&self) -> impl Iterator<Item = Number> {
        self.entities.iter().map(|entity| entity.number)
    }

    /// Samples between neighbours along an axis, inside an entity; 0 along the outermost.
    fn stride(&self, axis: Axis) -> Option<u64> {
        let place = self.order.iter().position(|&other| other == axis)?;
        if place == 0 {
            return Some(0);
        }
        let inner = self.order.iter().skip(place.checked_add(1)?);
        inner.clone().try_fold(1u64, |product, &axis| product.checked_mul(self.size(axis)))
    }

    /// Appends `[y, x, plane]` of one image and tile; `None` where `bytes` are not those that the layout is of.
    pub(super) fn append_image(
        &self,
        bytes: &[u8],
        [image, tile]: [u64; 2],
        unit: f32,
        samples: &mut Samples,
    ) -> Option<()> {
        let outermost = *self.order.first()?;
        let [of_image, of_tile, of_row, of_column, of_plane] = [
            self.stride(Axis::Image)?,
            self.stride(Axis::Tile)?,
            self.stride(Axis::Row)?,
            self.stride(Axis::Column)?,
            self.stride(Axis::Plane)?,
        ];
        let start = image.checked_mul(of_image)?.checked_add(tile.checked_mul(of_tile)?)?;
        let run = |entity: u64, first: u64, count: u64, samples: &mut Samples| {
            let entity = self.entities.get(usize::try_from(entity).ok()?)?;
            let size = entity.number.bytes();
            let from = entity.at.checked_add(usize::try_from(first).ok()?.checked_mul(size)?)?;
            let to = from.checked_add(usize::try_from(count).ok()?.checked_mul(size)?)?;
            entity.number.append(samples, bytes.get(from..to)?, unit);
            Some(())
        };
        // The order of every writer that is known: an image is one run of samples.
        if outermost == Axis::Image
            && [of_row, of_column, of_plane] == [self.width.checked_mul(self.planes)?, self.planes, 1]
        {
            let count = self.height.checked_mul(self.width)?.checked_mul(self.planes)?;
            return run(image, start, count, samples);
        }
        for row in 0..self.height {
            for column in 0..self.width {
                for plane in 0..self.planes {
                    let entity = match outermost {
                        Axis::Image => image,
                        Axis::Tile => tile,
                        Axis::Row => row,
                        Axis::Column => column,
                        Axis::Plane => plane,
                    };
                    let first = start
                        .checked_add(row.checked_mul(of_row)?)?
                        .checked_add(column.checked_mul(of_column)?)?
                        .checked_add(plane.checked_mul(of_plane)?)?;
                    run(entity, first, 1, samples)?;
                }
            }
        }
        Some(())
    }
}
