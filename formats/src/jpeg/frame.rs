//! The frame header of a JPEG, and its scans measured against it (ITU-T T.81, B.2.2 and B.2.3).

use super::Header;
use super::marker::{entropy_coded, segment};
use super::means::Means;
use super::progress::{Band, Progress};
use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, ErrorKind, Limits, Result};

/// Blocks that one component may have in a coded unit together with others (T.81, B.2.3).
const MAX_BLOCKS_PER_UNIT: u64 = 10;

/// Sampling factors: blocks of a component in a coded unit, side by side and below each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Sampling {
    pub(super) horizontal: u8,
    pub(super) vertical: u8,
}

#[derive(Debug)]
struct Component {
    id: u8,
    sampling: Sampling,
    /// Number of its quantisation table.
    quantisation: u8,
    progress: Progress,
}

impl Component {
    fn blocks_per_mcu(&self) -> u64 {
        u64::from(self.sampling.horizontal).saturating_mul(u64::from(self.sampling.vertical))
    }
}

/// Components and coded units of a frame.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    pub(super) width: u16,
    pub(super) height: u16,
    /// Number and sampling of each component.
    pub(super) components: Vec<(u8, Sampling)>,
    /// Numbers of their quantisation tables.
    pub(super) quantisation: Vec<u8>,
    /// The largest factors that divide those of all components: without them the picture is the same.
    pub(super) common: Sampling,
    most: Sampling,
}

impl Grid {
    /// Blocks of a component that are not wholly beyond the picture.
    pub(super) fn blocks(&self, sampling: Sampling) -> (usize, usize) {
        let blocks = |length: u16, factor: u8, most: u8| {
            let unit = usize::from(most.max(1)).saturating_mul(8);
            usize::from(length).saturating_mul(usize::from(factor)).div_ceil(unit)
        };
        (
            blocks(self.width, sampling.horizontal, self.most.horizontal),
            blocks(self.height, sampling.vertical, self.most.vertical),
        )
    }

    /// Coded units side by side and below each other.
    pub(super) fn units(&self) -> (usize, usize) {
        self.blocks(Sampling { horizontal: 1, vertical: 1 })
    }

    /// The same picture without the common factors, so that its units are smaller.
    pub(super) fn reduced(&self) -> Grid {
        let reduced = |of: Sampling| Sampling {
            horizontal: of.horizontal.checked_div(self.common.horizontal).unwrap_or(1),
            vertical: of.vertical.checked_div(self.common.vertical).unwrap_or(1),
        };
        Grid {
            width: self.width,
            height: self.height,
            components: self.components.iter().map(|&(id, sampling)| (id, reduced(sampling))).collect(),
            quantisation: self.quantisation.clone(),
            common: Sampling { horizontal: 1, vertical: 1 },
            most: reduced(self.most),
        }
    }
}

/// What a decoder must be handed instead of the file.
#[derive(Debug)]
pub(super) enum Arrangement {
    /// The file as it is.
    Ordinary,
    /// The file with the sampling factors at this byte set to 1: those of a single component mean nothing.
    OneComponent(usize),
    /// The file with its scans put together.
    ScatteredScans(Grid),
}

/// A scan that was stepped over.
#[derive(Debug)]
pub(super) struct Scanned {
    /// Where each interval of its data ends.
    pub(super) ends: Vec<usize>,
    /// What of it is the first scan of means in a progressive file.
    pub(super) means: Option<Means>,
}

/// The frame header and what its scans have sent so far.
#[derive(Debug)]
pub(super) struct Frame {
    pub(super) header: Header,
    components: Vec<Component>,
    /// Largest sampling factors of all components.
    horizontal_max: u8,
    vertical_max: u8,
    /// Where the sampling factors of the first component stand.
    pub(super) sampling_at: usize,
    scans: usize,
}

impl Frame {
    /// Reads the segment that follows a frame marker.
    pub(super) fn read(reader: &mut Reader<'_>, progressive: bool, limits: &Limits) -> Result<Frame> {
        let at = reader.position();
        let mut fields = Reader::new(segment(reader)?);
        let relative = |e: Error| e.at(at);
        let precision = fields.u8().map_err(relative)?;
        let height = u32::from(fields.u16().map_err(relative)?);
        let width = u32::from(fields.u16().map_err(relative)?);
        let channels = fields.u8().map_err(relative)?;

        let unsupported =
            |found: String, expected| Error::new(ErrorKind::Unsupported, found, expected).at(at);
        if precision != 8 {
            return Err(unsupported(format!("{} a sample", counted(precision, "bit")), "8"));
        }
        if width == 0 || height == 0 {
            return Err(Error::malformed(format!("{width} x {height} pixels"), "at least 1 x 1").at(at));
        }
        if channels != 1 && channels != 3 {
            return Err(unsupported(counted(channels, "component"), "1 or 3"));
        }
        let pixels = u64::from(width).saturating_mul(u64::from(height));
        if pixels > limits.max_pixels_per_image {
            let expected =
                format!("at most {} (max_pixels_per_image)", counted(limits.max_pixels_per_image, "pixel"));
            let found = format!("{width} x {height} pixels");
            return Err(Error::new(ErrorKind::Limit, found, expected).at(at));
        }
        let mut components = Vec::new();
        for _ in 0..channels {
            let id = fields.u8().map_err(relative)?;
            let factors = fields.u8().map_err(relative)?;
            let sampling = Sampling { horizontal: factors >> 4, vertical: factors & 15 };
            // The decoder checks that the quantisation table exists.
            let quantisation = fields.u8().map_err(relative)?;
            let component = Component { id, sampling, quantisation, progress: Progress::new() };
            if components.iter().any(|c: &Component| c.id == component.id) {
                return Err(Error::malformed(format!("two components {}", component.id), "one").at(at));
            }
            components.push(component);
        }
        if !fields.rest().is_empty() {
            return Err(Error::malformed("bytes after the last component", "none").at(at));
        }
        require_known_sampling(&components, progressive).map_err(relative)?;
        let header = Header { width, height, channels, progressive, orientation: 1 };
        let horizontal_max = components.iter().map(|c| c.sampling.horizontal).max().unwrap_or(1);
        let vertical_max = components.iter().map(|c| c.sampling.vertical).max().unwrap_or(1);
        // Behind the segment's length, precision, size, number of components, and the first one's own number.
        let sampling_at = at.saturating_add(9);
        Ok(Frame { header, components, horizontal_max, vertical_max, sampling_at, scans: 0 })
    }

    /// What a decoder is to be handed, once all scans have been read.
    pub(super) fn arrangement(&self) -> Arrangement {
        if let [only] = self.components.as_slice() {
            let plain = only.sampling == Sampling { horizontal: 1, vertical: 1 };
            return if plain { Arrangement::Ordinary } else { Arrangement::OneComponent(self.sampling_at) };
        }
        // The decoder knows factors that are powers of two.
        let odd = self.components.iter().any(|c| [c.sampling.horizontal, c.sampling.vertical].contains(&3));
        if self.header.progressive || self.scans == 1 && !odd {
            return Arrangement::Ordinary;
        }
        let side = |length: u32| u16::try_from(length).unwrap_or(u16::MAX);
        Arrangement::ScatteredScans(Grid {
            width: side(self.header.width),
            height: side(self.header.height),
            components: self.components.iter().map(|c| (c.id, c.sampling)).collect(),
            quantisation: self.components.iter().map(|c| c.quantisation).collect(),
            common: common_factors(&self.components),
            most: Sampling { horizontal: self.horizontal_max, vertical: self.vertical_max },
        })
    }

    /// Reads a scan header and steps over the scan's data. `restart_interval` counts coded units; 0 is none.
    pub(super) fn read_scan(&mut self, reader: &mut Reader<'_>, restart_interval: u64) -> Result<Scanned> {
        let at = reader.position();
        let relative = |e: Error| e.at(at);
        let mut fields = Reader::new(segment(reader)?);
        let count = fields.u8().map_err(relative)?;
        let (mut selected, mut slots) = (Vec::new(), Vec::new());
        for _ in 0..count {
            let id = fields.u8().map_err(relative)?;
            // The numbers of the Huffman tables; the decoder checks that they exist.
            slots.push(fields.u8().map_err(relative)?);
            let Some(position) = self.components.iter().position(|c| c.id == id) else {
                return Err(
                    Error::malformed(format!("a scan of component {id}"), "one of the frame's").at(at)
                );
            };
            selected.push(position);
        }
        let (first, last) = (fields.u8().map_err(relative)?, fields.u8().map_err(relative)?);
        let approximation = fields.u8().map_err(relative)?;
        if !fields.rest().is_empty() {
            return Err(Error::malformed("bytes after the scan header", "none").at(at));
        }
        let band = Band { first, last, high: approximation >> 4, low: approximation & 15 };
        self.require_legal_band(&selected, band).map_err(relative)?;
        self.require_legal_unit(&selected).map_err(relative)?;
        self.scans = self.scans.saturating_add(1);
        for &position in &selected {
            let Some(component) = self.components.get_mut(position) else { continue };
            let sent = component.progress.send(band);
            sent.map_err(|found| {
                Error::malformed(format!("in component {}: {found}", component.id), "each bit once, in order")
                    .at(at)
            })?;
        }

        let data_at = reader.position();
        let data = entropy_coded(reader)?;
        let (units, blocks) = self.scan_size(&selected);
        // Every block starts with a Huffman code or bit of its mean, and in sequential files has at least
        // one code more; the shortest code is one bit. Without this a few bytes could claim any size.
        let bits = if band.first > 0 {
            0
        } else if self.header.progressive {
            blocks
        } else {
            blocks.saturating_mul(2)
        };
        if data.bytes < bits.div_ceil(8) {
            return Err(Error::malformed(
                format!("a scan of {}", counted(data.bytes, "byte")),
                format!("at least {}, one bit a code", bits.div_ceil(8)),
            )
            .at(data_at));
        }
        let restarts = match restart_interval {
            0 => 0,
            interval => units.div_ceil(interval).saturating_sub(1),
        };
        if data.restarts != restarts {
            return Err(Error::malformed(
                format!("a scan with {}", counted(data.restarts, "restart marker")),
                format!("{restarts}"),
            )
            .at(data_at));
        }
        let is_first_of_means = self.header.progressive && band.first == 0 && band.high == 0;
        let means = is_first_of_means.then(|| {
            // The coded unit of a single component is a block.
            let blocks = |&position: &usize| match selected.len() {
                1 => 1,
                _ => self.components.get(position).map_or(0, Component::blocks_per_mcu),
            };
            let members = selected.iter().map(blocks).zip(slots.iter().map(|slot| slot >> 4)).collect();
            Means { members, units, data: data_at..reader.position() }
        });
        Ok(Scanned { ends: data.ends, means })
    }

    fn require_legal_band(&self, selected: &[usize], band: Band) -> Result<()> {
        let Band { first, last, high, low } = band;
        let repeated = selected.iter().enumerate().any(|(i, p)| selected.iter().take(i).any(|q| q == p));
        if selected.is_empty() || repeated {
            return Err(Error::malformed("a scan of no component, or of one twice", "each at most once"));
        }
        let legal = if !self.header.progressive {
            (first, last, high, low) == (0, 63, 0, 0)
        } else if first == 0 {
            last == 0 && low <= 13
        } else {
            selected.len() == 1 && first <= last && last <= 63 && low <= 13
        };
        if legal {
            return Ok(());
        }
        Err(Error::malformed(
            format!("a scan of coefficients {first}..={last}, bits {high} to {low}"),
            "parameters that this kind of JPEG allows",
        ))
    }

    /// Components of a scan stand in the order of the frame, and their coded unit has a largest size (T.81, B.2.3).
    fn require_legal_unit(&self, selected: &[usize]) -> Result<()> {
        if !selected.is_sorted() {
            return Err(Error::malformed("a scan of components in another order", "the order of the frame"));
        }
        let components = selected.iter().filter_map(|&position| self.components.get(position));
        let blocks = components.map(Component::blocks_per_mcu).fold(0, u64::saturating_add);
        if selected.len() > 1 && blocks > MAX_BLOCKS_PER_UNIT {
            return Err(Error::malformed(
                format!("a scan whose coded unit has {}", counted(blocks, "block")),
                "at most 10",
            ));
        }
        Ok(())
    }

    /// Minimum coded units and blocks in a scan of the `selected` components (T.81, A.2).
    fn scan_size(&self, selected: &[usize]) -> (u64, u64) {
        let width = u64::from(self.header.width);
        let height = u64::from(self.header.height);
        let (h_max, v_max) = (u64::from(self.horizontal_max.max(1)), u64::from(self.vertical_max.max(1)));
        let components = selected.iter().filter_map(|&position| self.components.get(position));
        if let &[only] = selected {
            let Some(component) = self.components.get(only) else { return (0, 0) };
            let columns = width
                .saturating_mul(u64::from(component.sampling.horizontal))
                .div_ceil(h_max.saturating_mul(8));
            let rows = height
                .saturating_mul(u64::from(component.sampling.vertical))
                .div_ceil(v_max.saturating_mul(8));
            let blocks = columns.saturating_mul(rows);
            return (blocks, blocks);
        }
        let columns = width.div_ceil(h_max.saturating_mul(8));
        let units = columns.saturating_mul(height.div_ceil(v_max.saturating_mul(8)));
        let per_unit = components.map(Component::blocks_per_mcu).fold(0, u64::saturating_add);
        (units, units.saturating_mul(per_unit))
    }

    /// The components' ids, in their order.
    pub(super) fn ids(&self) -> impl Iterator<Item = u8> {
        self.components.iter().map(|component| component.id)
    }

    /// Refuses a frame whose end, at byte `at`, comes before all of its coefficients have.
    pub(super) fn require_complete(&self, at: usize) -> Result<()> {
        for component in &self.components {
            if let Some(k) = component.progress.first_incomplete() {
                return Err(Error::malformed(
                    format!("the end of the image before the last bit of coefficient {k}"),
                    format!("all scans of component {}", component.id),
                )
                .at(at));
            }
        }
        Ok(())
    }
}

/// The largest factors that divide those of all components.
fn common_factors(components: &[Component]) -> Sampling {
    let common = |of: fn(&Component) -> u8| {
        let divides = |factor: &u8| components.iter().all(|c| of(c).checked_rem(*factor) == Some(0));
        (1..=4).rev().find(divides).unwrap_or(1)
    };
    Sampling { horizontal: common(|c| c.sampling.horizontal), vertical: common(|c| c.sampling.vertical) }
}

/// One component, or three the first of which has the most blocks, 1, 2 or 4 for each of another's. So are 4:4:4,
/// 4:2:2, 4:4:0, 4:2:0, 4:1:1 and 4:1:0. Stranger samplings are where decoders differ.
fn require_known_sampling(components: &[Component], progressive: bool) -> Result<()> {
    let both = |c: &Component| [c.sampling.horizontal, c.sampling.vertical];
    // Three blocks of each component are three times one; of a progressive file that is left to be said.
    let most_blocks = |factor: &u8| (1..=4).contains(factor) && !(progressive && *factor == 3);
    let legal = components.iter().all(|c| components.len() == 1 || both(c).iter().all(most_blocks))
        && components.iter().all(|c| both(c).iter().all(|factor| (1..=4).contains(factor)));
    let common = common_factors(components);
    let most = components.first().map_or([1, 1], both);
    let known = components.len() == 1
        || components.iter().all(|c| {
            let ratio = |(of, most): (u8, u8)| most.checked_rem(of) == Some(0);
            both(c).into_iter().zip(most).all(ratio)
        }) && most
            .into_iter()
            .zip([common.horizontal, common.vertical])
            .all(|(most, common)| matches!(most.checked_div(common), Some(1 | 2 | 4)));
    if legal && known {
        return Ok(());
    }
    let factors: Vec<String> =
        components.iter().map(|c| format!("{}x{}", c.sampling.horizontal, c.sampling.vertical)).collect();
    let found = format!("sampling factors {}", factors.join(", "));
    Err(Error::new(
        ErrorKind::Unsupported,
        found,
        "1 to 4, and 1, 2 or 4 times as many of the first component as of each other; re-encode the picture",
    ))
}
