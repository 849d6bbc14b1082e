//! Writing one view: chunks gathered from its images, coded and encoded by many threads, one file a shard.

use btfkit_formats::Samples;
use rayon::prelude::*;

use super::gather::{self, Images};
use super::{CHUNK_SIDE, Description, Measurement};
use crate::color::{LightnessCodes, Remarkable};
use crate::error::Result;
use crate::shape::{Size, Window};
use crate::zarr::codec::{Chain, ChunkCodec};
use crate::zarr::shard;

/// A chunk of both arrays, encoded, and what was found in it.
type Encoded = (Vec<u8>, Vec<u8>, Remarkable);

impl Measurement {
    /// Writes one view from its images, on the threads of the pool that this is called in.
    pub fn write_view(&self, view: usize, images: &Images, codes: &LightnessCodes) -> Result<Remarkable> {
        let mut found = Remarkable::default();
        for (sy, sx) in self.shards() {
            let across = self.side / CHUNK_SIDE;
            let places: Vec<Option<Window>> = (0..across * across)
                .map(|place| self.chunk_window([sy, sx], [place / across, place % across]))
                .collect();
            let encoder = || Encoders::new(&self.description, self.codec);
            let chunks: Vec<Option<Encoded>> = places
                .par_iter()
                .map_init(
                    || None,
                    |encoders, window| {
                        let Some(window) = *window else { return Ok(None) };
                        let encoders = match encoders {
                            Some(encoders) => encoders,
                            none => none.insert(encoder()?),
                        };
                        self.encode(encoders, images, codes, window).map(Some)
                    },
                )
                .collect::<Result<_>>()?;
            let (mut reflectance, mut luminance) = (Vec::new(), Vec::new());
            for chunk in chunks {
                let (samples, codes, remarkable) =
                    chunk.map_or((None, None, None), |(s, c, r)| (Some(s), Some(c), Some(r)));
                reflectance.push(samples);
                luminance.push(codes);
                found += remarkable.unwrap_or_default();
            }
            let place = [view as u64, sy, sx, 0, 0];
            // Luminance last: a view counts as done when it has both.
            self.store.write_encoded(&self.reflectance, &place, &shard::assemble(&reflectance))?;
            drop(reflectance);
            self.store.write_encoded(&self.luminance, &place[..4], &shard::assemble(&luminance))?;
        }
        Ok(found)
    }

    /// The texels of a chunk, reaching over the border of the plane; `None` if it lies wholly beyond.
    fn chunk_window(&self, shard: [u64; 2], chunk: [usize; 2]) -> Option<Window> {
        let [y, x] = [0, 1].map(|axis| shard[axis] as usize * self.side + chunk[axis] * CHUNK_SIDE);
        let Size { height, width } = self.description.size;
        (y < height && x < width).then_some(Window { y, x, size: Size::new(CHUNK_SIDE, CHUNK_SIDE) })
    }

    fn encode(
        &self,
        encoders: &mut Encoders,
        images: &Images,
        codes: &LightnessCodes,
        window: Window,
    ) -> Result<Encoded> {
        let (texels, (samples, luminance, all)) = encoders.encode(images, codes, window)?;
        let remarkable = self.inside(window, all, &texels, codes);
        Ok((samples, luminance, remarkable))
    }

    /// What was found in the part of a chunk that lies within the plane.
    fn inside(
        &self,
        window: Window,
        all: Remarkable,
        samples: &Samples,
        codes: &LightnessCodes,
    ) -> Remarkable {
        let Size { height, width } = self.description.size;
        let within =
            Size::new(window.size.height.min(height - window.y), window.size.width.min(width - window.x));
        if within == window.size || all == Remarkable::default() {
            return all;
        }
        let texel = self.description.texel_samples();
        let mut found = Remarkable::default();
        let mut unused = vec![0; within.width * self.description.lights.len()];
        for row in 0..within.height {
            let from = row * window.size.width * texel;
            if let Some(row) = samples.select(std::iter::once(from..from + within.width * texel)) {
                found += codes.fill(&row, &mut unused);
            }
        }
        found
    }
}

/// What one thread encodes with.
struct Encoders {
    samples: ChunkCodec,
    codes: ChunkCodec,
}

impl Encoders {
    fn new(description: &Description, codec: Chain) -> Result<Self> {
        Ok(Self {
            samples: ChunkCodec::new(codec, description.chunk())?,
            codes: ChunkCodec::new(codec, description.code_chunk())?,
        })
    }

    /// A window's samples, what was found in them, and both of its chunks, encoded.
    fn encode(
        &mut self,
        images: &Images,
        codes: &LightnessCodes,
        window: Window,
    ) -> Result<(Samples, Encoded)> {
        let samples = images.gather(window);
        let mut luminance = vec![0; window.size.texels() * images.lights()];
        let found = codes.fill(&samples, &mut luminance);
        let (mut encoded, mut encoded_codes) = (Vec::new(), Vec::new());
        self.samples.encode(gather::bytes(&samples), &mut encoded)?;
        self.codes.encode(&luminance, &mut encoded_codes)?;
        Ok((samples, (encoded, encoded_codes, found)))
    }
}

/// Bytes that a chunk of both arrays takes, encoded.
pub(crate) fn encoded_bytes(
    description: &Description,
    codec: Chain,
    codes: &LightnessCodes,
    images: &Images,
    window: Window,
) -> Result<usize> {
    let (_, (samples, codes, _)) = Encoders::new(description, codec)?.encode(images, codes, window)?;
    Ok(samples.len() + codes.len())
}
