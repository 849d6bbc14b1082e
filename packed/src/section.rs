//! Sections: the parts of a file that each make the model finer, with their checksums.

use crate::bytes::Reader;
use crate::error::Result;

/// What stands before the payload of a section.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Section<'a> {
    /// Components from this section on.
    pub(crate) components: usize,
    /// Peak signal-to-noise ratio in hundredths of a dB, 0 where it is not known.
    pub(crate) centibels: u16,
    /// Codes of the strengths of the components that begin here.
    pub(crate) strengths: Vec<u16>,
    /// The coded planes.
    pub(crate) payload: &'a [u8],
}

/// A section, or that it is not as it was written.
pub(crate) enum Found<'a> {
    Section(Section<'a>),
    Damaged,
}

impl<'a> Section<'a> {
    /// Appends it.
    pub(crate) fn write(&self, bytes: &mut Vec<u8>) {
        let start = bytes.len();
        bytes.extend((self.payload.len() as u32).to_le_bytes());
        bytes.extend((self.components as u16).to_le_bytes());
        bytes.extend(self.centibels.to_le_bytes());
        self.strengths.iter().for_each(|code| bytes.extend(code.to_le_bytes()));
        bytes.extend(self.payload);
        bytes.extend(crc32fast::hash(&bytes[start..]).to_le_bytes());
    }

    /// Reads one after one of so many components.
    ///
    /// # Errors
    /// Where the file ends before.
    pub(crate) fn read(reader: &mut Reader<'a>, file: &'a [u8], before: usize) -> Result<Found<'a>> {
        let start = reader.at();
        let length = reader.u32()? as usize;
        let components = usize::from(reader.u16()?);
        let centibels = reader.u16()?;
        let Some(begun) = components.checked_sub(before) else { return Ok(Found::Damaged) };
        let strengths = (0..begun).map(|_| reader.u16()).collect::<Result<_>>()?;
        let payload = reader.take(length)?;
        let covered = file.get(start..reader.at()).unwrap_or_default();
        if crc32fast::hash(covered) != reader.u32()? {
            return Ok(Found::Damaged);
        }
        Ok(Found::Section(Self { components, centibels, strengths, payload }))
    }
}
