//! BDI: all samples, uncompressed, one reflectance function after another.

use std::ops::Range;

use super::header::{Header, length, read_rotations};
use super::images::Plane;
use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, ErrorKind, Limits, Result, f16};

/// Bytes of one sample.
const SAMPLE: usize = 2;

/// Bytes of the length in front of each chunk.
const CHUNK_HEADER: usize = 4;

/// Where the reflectance functions lie.
#[derive(Debug)]
pub(super) struct Bdi {
    channels: usize,
    lights: usize,
    /// Bytes of one function: `[view, light, channel]`.
    function: usize,
    /// Where the mask starts, if functions of pixels that it excludes are left out.
    mask: Option<usize>,
    /// Pixels that the mask excludes.
    pub(super) missing: usize,
    /// Where the first chunk starts, at its length.
    chunks: usize,
    functions_per_chunk: usize,
}

impl Bdi {
    /// Reads what follows the plane's size and checks that all chunks are there.
    pub(super) fn read(
        reader: &mut Reader<'_>,
        header: &Header,
        limits: &Limits,
    ) -> Result<(Bdi, Vec<[f32; 9]>)> {
        let at = reader.position();
        let scan_lines = reader.u32_le()?;
        if scan_lines == 0 {
            return Err(Error::malformed("chunks of no scan lines", "at least one").at(at));
        }
        let at = reader.position();
        let sparse = match reader.u8()? {
            0 => false,
            1 => {
                let found = "chunks compressed by bzip2";
                return Err(Error::new(ErrorKind::Unsupported, found, "uncompressed chunks").at(at));
            }
            2 => true,
            other => {
                let found = format!("compression {other}");
                return Err(Error::malformed(found, "0 (full), 1 (bzip2) or 2 (sparse)").at(at));
            }
        };
        let mask = reader.position();
        let pixels = length(header.width).saturating_mul(length(header.height));
        let missing = reader.take(pixels)?.iter().filter(|&&present| present == 0).count();
        let rotations = read_rotations(reader, limits)?;

        let sizes = [header.views.len(), header.lights.len(), header.channels.len()];
        let function = sizes.into_iter().fold(SAMPLE, usize::saturating_mul);
        let bdi = Bdi {
            channels: header.channels.len(),
            lights: header.lights.len(),
            function,
            mask: sparse.then_some(mask),
            missing,
            chunks: reader.position(),
            functions_per_chunk: length(header.width).saturating_mul(length(scan_lines)),
        };
        let mut functions = if sparse { pixels.saturating_sub(missing) } else { pixels };
        if functions == 0 {
            return Err(Error::malformed("a mask that excludes all pixels", "at least one").at(mask));
        }
        while functions > 0 {
            let here = functions.min(bdi.functions_per_chunk);
            let at = reader.position();
            let declared = length(reader.u32_le()?);
            let expected = here.saturating_mul(function);
            if declared != expected {
                let expected =
                    format!("{expected}, {} of {}", counted(here, "function"), counted(function, "byte"));
                return Err(
                    Error::malformed(format!("a chunk of {}", counted(declared, "byte")), expected).at(at)
                );
            }
            reader.take(declared)?;
            functions = functions.saturating_sub(here);
        }
        Ok((bdi, rotations))
    }

    /// Whether functions of excluded pixels are left out.
    pub(super) fn is_sparse(&self) -> bool {
        self.mask.is_some()
    }

    /// The images of a view under a range of lights, `[light, y, x, channel]`; excluded pixels are 0.
    /// `samples` is the number of samples.
    pub(super) fn images(
        &self,
        bytes: &[u8],
        plane: Plane,
        view: usize,
        lights: Range<usize>,
        samples: usize,
    ) -> Result<Vec<f16>> {
        let mut images = vec![f16::ZERO; samples];
        let pixels = plane.pixels();
        let mask = match self.mask {
            Some(start) => {
                bytes.get(start..start.saturating_add(pixels)).map(Some).ok_or_else(|| gone(start))?
            }
            None => None,
        };
        let image = pixels.saturating_mul(self.channels);
        let mut stored = 0usize;
        let mut pixel = 0usize;
        for (first, len) in plane.runs(0..pixels) {
            for place in first..first.saturating_add(len) {
                let present = mask.is_none_or(|mask| mask.get(pixel).is_some_and(|&byte| byte != 0));
                pixel = pixel.saturating_add(1);
                if !present {
                    continue;
                }
                let function = self.function(bytes, stored, view, &lights)?;
                stored = stored.saturating_add(1);
                let spectra = function.chunks_exact(SAMPLE.saturating_mul(self.channels));
                for (image, spectrum) in images.chunks_exact_mut(image).zip(spectra) {
                    let places = image.chunks_exact_mut(self.channels).nth(place).unwrap_or_default();
                    for (sample, &pair) in places.iter_mut().zip(spectrum.as_chunks::<SAMPLE>().0) {
                        *sample = f16::from_le_bytes(pair);
                    }
                }
            }
        }
        if images.iter().any(|sample| !sample.is_finite()) {
            let found = format!("a value that is not finite in view {view}, lights {lights:?}");
            return Err(Error::malformed(found, "finite reflectances"));
        }
        Ok(images)
    }

    /// The bytes for a view and lights of the function that is stored as number `stored`.
    fn function<'a>(
        &self,
        bytes: &'a [u8],
        stored: usize,
        view: usize,
        lights: &Range<usize>,
    ) -> Result<&'a [u8]> {
        let place = || {
            let chunk = stored.checked_div(self.functions_per_chunk)?;
            let headers = chunk.checked_add(1)?.checked_mul(CHUNK_HEADER)?;
            let start = stored.checked_mul(self.function)?.checked_add(headers)?;
            let start = start.checked_add(self.chunks)?;
            let spectrum = self.channels.checked_mul(SAMPLE)?;
            let first = view.checked_mul(self.lights)?.checked_add(lights.start)?;
            let start = first.checked_mul(spectrum)?.checked_add(start)?;
            bytes.get(start..lights.len().checked_mul(spectrum)?.checked_add(start)?)
        };
        place().ok_or_else(|| gone(self.chunks))
    }
}

fn gone(at: usize) -> Error {
    Error::malformed("the end of the data", "the chunks that were there when the archive was opened").at(at)
}
