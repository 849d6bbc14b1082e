//! Where the matrices of a factorised container lie: DFMF, FMF and PVF.

use super::color::ColorModel;
use super::header::{Header, length};
use super::scalar::Scalar;
use super::signature::BonnKind;
use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, ErrorKind, Result};

/// The payload of a factorised container.
#[derive(Debug)]
pub(super) struct Factors {
    blocks: Vec<Block>,
    sharing: Sharing,
    channels: usize,
    lights: usize,
    pub(super) color: ColorModel,
    /// The logarithm of every sample is stored.
    pub(super) log: bool,
    /// Columns and rows of a height map that lies in front of the matrices.
    pub(super) height_map: Option<(u32, u32)>,
    /// Both orientations fit the sizes.
    pub(super) ambiguous: bool,
}

/// What has a product of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sharing {
    Channel,
    Nothing,
    View,
}

/// One product of a left and a right matrix, both of rows of `rank` scalars.
#[derive(Debug)]
struct Block {
    scalar: Scalar,
    rank: usize,
    /// Bytes from the start of the file.
    left: usize,
    right: usize,
    /// One scalar for each row of the left matrix.
    mean: Option<usize>,
    /// Left rows belong to pixels, right ones to directions; usually it is the other way round.
    transposed: bool,
}

/// Rows of a matrix, one for each light or each pixel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rows {
    start: usize,
    stride: usize,
    len: usize,
}

impl Rows {
    /// The bytes of one row.
    pub(super) fn row<'a>(&self, bytes: &'a [u8], index: usize) -> Option<&'a [u8]> {
        let start = index.checked_mul(self.stride)?.checked_add(self.start)?;
        bytes.get(start..start.checked_add(self.len)?)
    }
}

/// One factor of a product, as the decoder takes it: rows, and what may stand behind each of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Factor {
    pub(super) rows: Rows,
    /// `None` if the container has no means; they are one more component, whose other factor is 1.
    pub(super) last: Option<Last>,
}

/// The component that a mean adds.
#[derive(Debug, Clone, Copy)]
pub(super) enum Last {
    One,
    Mean(Rows),
}

/// The product that gives the samples of one view and channel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Product {
    pub(super) scalar: Scalar,
    pub(super) rank: usize,
    pub(super) lights: Factor,
    pub(super) pixels: Factor,
}

/// Row counts that a container's plane and directions ask for.
struct Sizes {
    /// Rows that the right matrix may have: for pixels, for directions.
    pixels: u64,
    directions: u64,
    /// Left rows for each pixel or direction.
    interleaved: u64,
}

impl Sizes {
    /// Whether the matrices are transposed, and whether that could be told.
    fn orientation(&self, left: u32, right: u32) -> Result<(bool, bool)> {
        let (left, right) = (u64::from(left), u64::from(right));
        let rows = |number: u64| number.checked_mul(self.interleaved);
        let usual = rows(self.directions) == Some(left) && right == self.pixels;
        let transposed = rows(self.pixels) == Some(left) && right == self.directions;
        if usual || transposed {
            return Ok((!usual, usual && transposed));
        }
        let Sizes { pixels, directions, interleaved } = self;
        let expected = format!(
            "{interleaved} x {directions} and {} (directions, pixels) or {interleaved} x {pixels} \
             and {directions}",
            counted(*pixels, "row")
        );
        Err(Error::malformed(format!("matrices of {left} and {}", counted(right, "row")), expected))
    }
}

impl Factors {
    /// Reads all but the matrices and checks that these are there.
    pub(super) fn read(reader: &mut Reader<'_>, kind: BonnKind, header: &Header) -> Result<Factors> {
        match kind {
            BonnKind::Dfmf => Factors::read_dfmf(reader, header),
            BonnKind::Pvf => Factors::read_pvf(reader, header),
            _ => Factors::read_fmf(reader, kind == BonnKind::FmfExtended, header),
        }
    }

    fn new(sharing: Sharing, header: &Header) -> Factors {
        Factors {
            blocks: Vec::new(),
            sharing,
            channels: header.channels.len(),
            lights: header.lights.len(),
            color: ColorModel::Rgb,
            log: false,
            height_map: None,
            ambiguous: false,
        }
    }

    fn read_dfmf(reader: &mut Reader<'_>, header: &Header) -> Result<Factors> {
        let mut factors = Factors::new(Sharing::Channel, header);
        let _largest_rank = reader.u32_le()?;
        let at = reader.position();
        let code = reader.i32_le()?;
        let mean = triple(reader)?;
        let matrix = [triple(reader)?, triple(reader)?, triple(reader)?];
        let model = ColorModel::from_code(code, mean, matrix);
        let checked = model.and_then(|model| model.check_channels(factors.channels).map(|()| model));
        factors.color = checked.map_err(|error| error.at(at))?;
        let sizes = sizes(header, true, 1);
        for _ in 0..factors.channels {
            let scalar = scalar(reader)?;
            let at = reader.position();
            let (rank, left, right) = (reader.u32_le()?, reader.u32_le()?, reader.u32_le()?);
            factors.push_product(reader, scalar, (rank, left, right), &sizes).map_err(|e| e.at(at))?;
        }
        Ok(factors)
    }

    fn read_fmf(reader: &mut Reader<'_>, extended: bool, header: &Header) -> Result<Factors> {
        let mut factors = Factors::new(Sharing::Nothing, header);
        if extended {
            factors.read_extension(reader)?;
        }
        let at = reader.position();
        let declared_rank = reader.u32_le()?;
        let scalar = scalar(reader)?;
        let (rank, left, right) = (reader.u32_le()?, reader.u32_le()?, reader.u32_le()?);
        if rank > declared_rank {
            let expected = format!("at most the {declared_rank} declared before");
            return Err(Error::malformed(counted(rank, "component"), expected).at(at));
        }
        let sizes = sizes(header, true, factors.channels);
        factors.push_product(reader, scalar, (rank, left, right), &sizes).map_err(|e| e.at(at))?;
        Ok(factors)
    }

    fn read_extension(&mut self, reader: &mut Reader<'_>) -> Result<()> {
        let at = reader.position();
        let version = reader.u8()?;
        if version > 2 {
            let found = format!("an extension header of version {version}");
            return Err(Error::new(ErrorKind::Unsupported, found, "version 0 to 2").at(at));
        }
        if version >= 1 {
            self.log = reader.u32_le()? != 0;
        }
        if version >= 2 {
            let (width, height) = (reader.u32_le()?, reader.u32_le()?);
            let pixels = length(width).saturating_mul(length(height));
            reader.take(pixels.saturating_mul(Scalar::F16.bytes()))?;
            self.height_map = (pixels > 0).then_some((width, height));
        }
        Ok(())
    }

    fn read_pvf(reader: &mut Reader<'_>, header: &Header) -> Result<Factors> {
        let mut factors = Factors::new(Sharing::View, header);
        // The older form has these two numbers in front, where the header was read.
        if header.version > 0 {
            let _largest_rank = reader.u32_le()?;
            let at = reader.position();
            let slots = reader.u32_le()?;
            if usize::try_from(slots) != Ok(header.views.len()) {
                let found = format!("{} for {}", counted(slots, "slot"), counted(header.views.len(), "view"));
                return Err(Error::malformed(found, "a slot for each view").at(at));
            }
        }
        let sizes = sizes(header, false, factors.channels);
        for _ in 0..header.views.len() {
            let scalar = scalar(reader)?;
            let at = reader.position();
            let (rank, right, left) = (reader.u32_le()?, reader.u32_le()?, reader.u32_le()?);
            let orientation = sizes.orientation(left, right).map_err(|e| e.at(at))?;
            let rank = self::rank(rank).map_err(|e| e.at(at))?;
            let _eigenvalues = matrix(reader, 1, rank, scalar)?;
            let mean = matrix(reader, left, 1, scalar)?;
            let left = matrix(reader, left, rank, scalar)?;
            let right = matrix(reader, right, rank, scalar)?;
            factors.push(Block { scalar, rank, left, right, mean: Some(mean), transposed: orientation.0 });
            factors.ambiguous |= orientation.1;
        }
        Ok(factors)
    }

    /// Singular values, left and right matrix, as DFMF and FMF have them.
    fn push_product(
        &mut self,
        reader: &mut Reader<'_>,
        scalar: Scalar,
        (rank, left, right): (u32, u32, u32),
        sizes: &Sizes,
    ) -> Result<()> {
        let (transposed, ambiguous) = sizes.orientation(left, right)?;
        let rank = self::rank(rank)?;
        let _singular_values = matrix(reader, 1, rank, scalar)?;
        let left = matrix(reader, left, rank, scalar)?;
        let right = matrix(reader, right, rank, scalar)?;
        self.push(Block { scalar, rank, left, right, mean: None, transposed });
        self.ambiguous |= ambiguous;
        Ok(())
    }

    fn push(&mut self, block: Block) {
        self.blocks.push(block);
    }

    /// Whether all scalars are of half precision.
    pub(super) fn all_half(&self) -> bool {
        self.blocks.iter().all(|block| block.scalar == Scalar::F16)
    }

    /// Types and ranks of the products, for people.
    pub(super) fn describe(&self) -> String {
        let mut scalars: Vec<&str> = self.blocks.iter().map(|block| block.scalar.name()).collect();
        scalars.dedup();
        let ranks = self.blocks.iter().map(|block| block.rank);
        let (least, most) = (ranks.clone().min().unwrap_or(0), ranks.clone().max().unwrap_or(0));
        let rank = if least == most {
            format!("rank {most}")
        } else if self.sharing == Sharing::View {
            format!("rank {least} to {most}")
        } else {
            format!("rank {}", ranks.map(|rank| rank.to_string()).collect::<Vec<_>>().join(" + "))
        };
        format!("{}, {rank}", scalars.join(" and "))
    }

    /// Whether any product has its pixels on the left.
    pub(super) fn any_transposed(&self) -> bool {
        self.blocks.iter().any(|block| block.transposed)
    }

    /// The product for a view and a channel; `None` if there are none such.
    pub(super) fn product(&self, view: usize, channel: usize) -> Option<Product> {
        let (block, interleaved, first_direction) = match self.sharing {
            Sharing::Channel => (self.blocks.get(channel)?, 1, view.checked_mul(self.lights)?),
            Sharing::Nothing => (self.blocks.first()?, self.channels, view.checked_mul(self.lights)?),
            Sharing::View => (self.blocks.get(view)?, self.channels, 0),
        };
        let channel = if interleaved == 1 { 0 } else { channel };
        let (first_left, first_right) =
            if block.transposed { (0, first_direction) } else { (first_direction, 0) };
        let first_left = first_left.checked_mul(interleaved)?.checked_add(channel)?;
        let rows = |start: usize, first: usize, step: usize, rank: usize| {
            let len = rank.checked_mul(block.scalar.bytes())?;
            let start = len.checked_mul(first)?.checked_add(start)?;
            Some(Rows { start, stride: len.checked_mul(step)?, len })
        };
        let mut left = Factor { rows: rows(block.left, first_left, interleaved, block.rank)?, last: None };
        let mut right = Factor { rows: rows(block.right, first_right, 1, block.rank)?, last: None };
        if let Some(mean) = block.mean {
            left.last = Some(Last::Mean(rows(mean, first_left, interleaved, 1)?));
            right.last = Some(Last::One);
        }
        let (lights, pixels) = if block.transposed { (right, left) } else { (left, right) };
        Some(Product { scalar: block.scalar, rank: block.rank, lights, pixels })
    }
}

fn sizes(header: &Header, all_views: bool, interleaved: usize) -> Sizes {
    let count = |number: usize| u64::try_from(number).unwrap_or(u64::MAX);
    let views = if all_views { count(header.views.len()) } else { 1 };
    Sizes {
        pixels: u64::from(header.width).saturating_mul(u64::from(header.height)),
        directions: views.saturating_mul(count(header.lights.len())),
        interleaved: count(interleaved),
    }
}

fn rank(rank: u32) -> Result<usize> {
    if rank == 0 {
        return Err(Error::malformed("no components", "at least one"));
    }
    Ok(length(rank))
}

fn scalar(reader: &mut Reader<'_>) -> Result<Scalar> {
    let at = reader.position();
    Scalar::from_code(reader.u8()?).map_err(|error| error.at(at))
}

/// Skips a matrix and says where it starts.
fn matrix(reader: &mut Reader<'_>, rows: u32, rank: usize, scalar: Scalar) -> Result<usize> {
    let start = reader.position();
    let len = length(rows).checked_mul(rank).and_then(|number| number.checked_mul(scalar.bytes()));
    reader.take(len.unwrap_or(usize::MAX))?;
    Ok(start)
}

fn triple(reader: &mut Reader<'_>) -> Result<[f32; 3]> {
    Ok([reader.f32_le()?, reader.f32_le()?, reader.f32_le()?])
}
