//! The frame header of a JPEG, and its scans measured against it (ITU-T T.81, B.2.2 and B.2.3).

use super::Header;
use super::marker::{entropy_coded, segment};
use super::progress::{Band, Progress};
use crate::reader::Reader;
use crate::{Error, ErrorKind, Limits, Result};

#[derive(Debug)]
struct Component {
    id: u8,
    horizontal: u8,
    vertical: u8,
    progress: Progress,
}

impl Component {
    fn blocks_per_mcu(&self) -> u64 {
        u64::from(self.horizontal).saturating_mul(u64::from(self.vertical))
    }
}

/// The frame header and what its scans have sent so far.
#[derive(Debug)]
pub(super) struct Frame {
    pub(super) header: Header,
    components: Vec<Component>,
    /// Largest sampling factors of all components.
    horizontal_max: u8,
    vertical_max: u8,
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
            return Err(unsupported(format!("{precision} bits a sample"), "8"));
        }
        if width == 0 || height == 0 {
            return Err(Error::malformed(format!("{width} x {height} pixels"), "at least 1 x 1").at(at));
        }
        if channels != 1 && channels != 3 {
            return Err(unsupported(format!("{channels} components"), "1 or 3"));
        }
        let pixels = u64::from(width).saturating_mul(u64::from(height));
        if pixels > limits.max_pixels_per_image {
            let expected = format!("at most {} pixels (max_pixels_per_image)", limits.max_pixels_per_image);
            let found = format!("{width} x {height} pixels");
            return Err(Error::new(ErrorKind::Limit, found, expected).at(at));
        }
        let mut components = Vec::new();
        for _ in 0..channels {
            let component = Component {
                id: fields.u8().map_err(relative)?,
                progress: Progress::new(),
                ..sampling(fields.u8().map_err(relative)?)
            };
            // The number of the quantisation table; the decoder checks that it exists.
            fields.u8().map_err(relative)?;
            if components.iter().any(|c: &Component| c.id == component.id) {
                return Err(Error::malformed(format!("two components {}", component.id), "one").at(at));
            }
            components.push(component);
        }
        if !fields.rest().is_empty() {
            return Err(Error::malformed("bytes after the last component", "none").at(at));
        }
        require_known_sampling(&components).map_err(relative)?;
        let header = Header { width, height, channels, progressive };
        let horizontal_max = components.iter().map(|c| c.horizontal).max().unwrap_or(1);
        let vertical_max = components.iter().map(|c| c.vertical).max().unwrap_or(1);
        Ok(Frame { header, components, horizontal_max, vertical_max })
    }

    /// Reads a scan header and steps over the scan's data. `restart_interval` counts coded units; 0 is none.
    pub(super) fn read_scan(&mut self, reader: &mut Reader<'_>, restart_interval: u64) -> Result<()> {
        let at = reader.position();
        let relative = |e: Error| e.at(at);
        let mut fields = Reader::new(segment(reader)?);
        let count = fields.u8().map_err(relative)?;
        let mut selected = Vec::new();
        for _ in 0..count {
            let id = fields.u8().map_err(relative)?;
            // The numbers of the Huffman tables; the decoder checks that they exist.
            fields.u8().map_err(relative)?;
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
                format!("a scan of {} bytes", data.bytes),
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
                format!("a scan with {} restart markers", data.restarts),
                format!("{restarts}"),
            )
            .at(data_at));
        }
        Ok(())
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

    /// Minimum coded units and blocks in a scan of the `selected` components (T.81, A.2).
    fn scan_size(&self, selected: &[usize]) -> (u64, u64) {
        let width = u64::from(self.header.width);
        let height = u64::from(self.header.height);
        let (h_max, v_max) = (u64::from(self.horizontal_max.max(1)), u64::from(self.vertical_max.max(1)));
        let components = selected.iter().filter_map(|&position| self.components.get(position));
        if let &[only] = selected {
            let Some(component) = self.components.get(only) else { return (0, 0) };
            let columns =
                width.saturating_mul(u64::from(component.horizontal)).div_ceil(h_max.saturating_mul(8));
            let rows = height.saturating_mul(u64::from(component.vertical)).div_ceil(v_max.saturating_mul(8));
            let blocks = columns.saturating_mul(rows);
            return (blocks, blocks);
        }
        let columns = width.div_ceil(h_max.saturating_mul(8));
        let units = columns.saturating_mul(height.div_ceil(v_max.saturating_mul(8)));
        let per_unit = components.map(Component::blocks_per_mcu).fold(0, u64::saturating_add);
        (units, units.saturating_mul(per_unit))
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

/// A component with the sampling factors in `byte` and nothing else known.
fn sampling(byte: u8) -> Component {
    Component { id: 0, horizontal: byte >> 4, vertical: byte & 15, progress: Progress::new() }
}

/// Grey, 4:4:4, 4:2:2, 4:4:0 and 4:2:0 as everybody writes them. Stranger samplings are where decoders differ.
fn require_known_sampling(components: &[Component]) -> Result<()> {
    let known = components.iter().enumerate().all(|(i, c)| {
        let most = if i == 0 && components.len() > 1 { 2 } else { 1 };
        (1..=most).contains(&c.horizontal) && (1..=most).contains(&c.vertical)
    });
    if known {
        return Ok(());
    }
    let factors: Vec<String> =
        components.iter().map(|c| format!("{}x{}", c.horizontal, c.vertical)).collect();
    let found = format!("sampling factors {}", factors.join(", "));
    Err(Error::new(
        ErrorKind::Unsupported,
        found,
        "1x1 or 2x1 or 1x2 or 2x2 for the first of three components, else 1x1",
    ))
}
