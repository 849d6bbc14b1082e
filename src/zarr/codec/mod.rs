//! How a chunk of samples is packed: two chains of Zarr codecs, and the same without Zarr's machinery in between.
//!
//! [`Chain::Stock`] is read by zarr-python as it is installed; [`Chain::Predictive`] packs better and faster, and
//! is read by zarr-python with `python/btfkit_zarr`. `docs/reference/codec.md` has the bytes and what was measured.

mod delta;
mod fused;
mod pack;

use std::num::NonZeroU64;
use std::str::FromStr;
use std::sync::Arc;

use btfkit_formats::SampleType;
use serde_json::{Value, json};
use zarrs::array::codec::api::{
    ArrayToArrayCodecTraits, ArrayToBytesCodecTraits, BytesToBytesCodecTraits, CodecMetadataOptions,
};
use zarrs::array::codec::{BytesCodec, CodecChain, ShuffleCodec, TransposeCodec, TransposeOrder, ZstdCodec};
use zarrs::metadata::v3::MetadataV3;

use crate::error::{Error, Result};
use crate::kernel::predict::Shape;
use delta::DeltaCodec;
use fused::PredictiveCodec;
pub use pack::{ChunkCodec, MOST_CHANNELS};

/// Level of the zstd codec: after a prediction higher levels hardly pack better, only slower.
const ZSTD_LEVEL: i32 = 1;

/// A chain of codecs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chain {
    /// Codecs that zarr-python brings with it.
    Stock,
    /// `btfkit.predictive`.
    Predictive,
}

impl Chain {
    /// The name of the chain, as recipes and the command line have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stock => "stock",
            Self::Predictive => "predictive",
        }
    }

    /// The chain that an array's metadata name for chunks of this kind, if it is one of ours.
    ///
    /// `codecs` is the member `codecs` of its `zarr.json`; the chain is looked for in its shards too.
    pub fn of(codecs: &Value, chunk: &Chunk) -> Option<Self> {
        let found: Vec<MetadataV3> = serde_json::from_value(codecs.pointer(inner(codecs))?.clone()).ok()?;
        let is_found = |chain: &Self| {
            chunk_codecs(*chain, chunk).is_ok_and(|codecs| codecs.metadata().as_ref() == Some(&found))
        };
        [Self::Stock, Self::Predictive].into_iter().find(is_found)
    }
}

/// A list of codecs in one way of writing: what has no configuration may be written as a name, or without it.
pub(super) fn plainly(codecs: &Value) -> Value {
    let named = |name: Value, configuration: Value| json!({"name": name, "configuration": configuration});
    match codecs {
        Value::Array(list) => list
            .iter()
            .map(|codec| match codec {
                Value::String(name) => named(name.as_str().into(), json!({})),
                other => plainly(other),
            })
            .collect(),
        Value::Object(members) => {
            let mut members: serde_json::Map<String, Value> =
                members.iter().map(|(name, value)| (name.clone(), plainly(value))).collect();
            if members.contains_key("name") {
                members.entry("configuration").or_insert_with(|| json!({}));
            }
            Value::Object(members)
        }
        other => other.clone(),
    }
}

/// Where in a list of codecs those of chunks are.
fn inner(codecs: &Value) -> &'static str {
    let sharding = codecs.pointer("/0/name").is_some_and(|name| name == "sharding_indexed");
    if sharding { "/0/configuration/codecs" } else { "" }
}

/// The same codecs in fewer steps, for an array to be read with: [`Chain::Stock`] becomes one codec, as zarrs' own
/// transpositions are some fifty times as slow. Anything else stays. Not to be written to disk.
pub fn fused(mut codecs: Value, chunk: &Chunk) -> Value {
    if Chain::of(&codecs, chunk) == Some(Chain::Stock)
        && let Some(inner) = codecs.pointer_mut(inner(&codecs))
    {
        let configuration = json!({"channel_axis": chunk.channels.is_some()});
        *inner = json!([{"name": "btfkit.stock", "configuration": configuration}]);
    }
    codecs
}

impl FromStr for Chain {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let chain = [Self::Stock, Self::Predictive].into_iter().find(|chain| chain.name() == text);
        chain.ok_or_else(|| format!("expected stock or predictive, got {text:?}"))
    }
}

/// A chunk of [view, y, x, light, channel] (or without channel) of one view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chunk {
    /// Type of its samples.
    pub samples: SampleType,
    /// Its extent without channels.
    pub shape: Shape,
    /// Its channels; `None` where the array has no such dimension.
    pub channels: Option<usize>,
}

impl Chunk {
    /// Bytes of its samples.
    pub fn bytes(&self) -> usize {
        self.values() * self.samples.bytes()
    }

    /// Number of its samples.
    fn values(&self) -> usize {
        self.shape.samples() * self.channels.unwrap_or(1)
    }

    /// Whether its samples are whole numbers of whose differences [`Chain::Stock`] takes.
    ///
    /// numcodecs would take an array with one long axis, or two that are swapped, for one in column order.
    fn has_deltas(&self) -> bool {
        let Shape { rows, columns, lights } = self.shape;
        matches!(self.samples, SampleType::U8 | SampleType::U16)
            && rows > 1
            && columns > 1
            && lights * self.channels.unwrap_or(1) > 1
    }
}

/// The codecs of a chunk, as an array (or the shards of an array) takes them.
#[derive(Clone, Debug)]
pub struct Codecs {
    /// Array to array.
    pub array_to_array: Vec<Arc<dyn ArrayToArrayCodecTraits>>,
    /// Array to bytes.
    pub array_to_bytes: Arc<dyn ArrayToBytesCodecTraits>,
    /// Bytes to bytes.
    pub bytes_to_bytes: Vec<Arc<dyn BytesToBytesCodecTraits>>,
}

impl Codecs {
    /// As metadata say it, or nothing.
    fn metadata(&self) -> Option<Vec<MetadataV3>> {
        let named = self.chain().create_metadatas(&CodecMetadataOptions::default());
        // Written and read, for what has no configuration may be written in two ways.
        serde_json::from_value(serde_json::to_value(named).ok()?).ok()
    }

    fn chain(&self) -> CodecChain {
        let Self { array_to_array, array_to_bytes, bytes_to_bytes } = self.clone();
        CodecChain::new(array_to_array, array_to_bytes, bytes_to_bytes)
    }
}

/// The codecs of chunks of this kind.
///
/// # Errors
/// None that can come about: the library's constructors ask for them.
pub fn chunk_codecs(chain: Chain, chunk: &Chunk) -> Result<Codecs> {
    if chain == Chain::Predictive {
        return Ok(Codecs {
            array_to_array: Vec::new(),
            array_to_bytes: Arc::new(PredictiveCodec::new(chunk.channels.is_some())),
            bytes_to_bytes: Vec::new(),
        });
    }
    let transpose = |order: &[usize]| -> Result<Arc<dyn ArrayToArrayCodecTraits>> {
        let order = TransposeOrder::new(order).map_err(|error| Error::internal(error.to_string()))?;
        Ok(Arc::new(TransposeCodec::new(order)))
    };
    let delta = || -> Arc<dyn ArrayToArrayCodecTraits> { Arc::new(DeltaCodec::new(chunk.samples)) };
    let mut array_to_array = Vec::new();
    if chunk.has_deltas() {
        // Axes view, y, x, light, channel; see `kernel::predict::deltas`.
        if chunk.channels.is_some_and(|channels| channels > 1) {
            array_to_array.push(delta());
        }
        let (first, then): (&[usize], &[usize]) = match chunk.channels {
            Some(_) => (&[0, 4, 1, 3, 2], &[0, 1, 3, 4, 2]),
            None => (&[0, 1, 3, 2], &[0, 2, 3, 1]),
        };
        array_to_array.extend([transpose(first)?, delta(), transpose(then)?, delta(), transpose(then)?]);
    } else if chunk.samples.bytes() > 1 {
        let order: &[usize] = if chunk.channels.is_some() { &[0, 3, 1, 2, 4] } else { &[0, 3, 1, 2] };
        array_to_array.push(transpose(order)?);
    }
    let mut bytes_to_bytes: Vec<Arc<dyn BytesToBytesCodecTraits>> = Vec::new();
    let array_to_bytes = if chunk.samples.bytes() > 1 {
        bytes_to_bytes.push(Arc::new(ShuffleCodec::new(chunk.samples.bytes())));
        BytesCodec::little()
    } else {
        BytesCodec::new(None)
    };
    // The frame's own checksum: zarrs does not verify a crc32c codec when it reads a part of a shard.
    bytes_to_bytes.push(Arc::new(ZstdCodec::new(ZSTD_LEVEL, true)));
    Ok(Codecs { array_to_array, array_to_bytes: Arc::new(array_to_bytes), bytes_to_bytes })
}

/// Rows, columns and lights of a chunk whose last axes they are, followed by channels where `channel_axis` says so;
/// axes before them count as rows. `None` where it is too large.
fn extent(shape: &[NonZeroU64], channel_axis: bool) -> Option<(Shape, usize)> {
    let mut axes = shape.iter().rev().map(|extent| usize::try_from(extent.get()).ok());
    let mut next = || axes.next().unwrap_or(Some(1));
    let channels = if channel_axis { next()? } else { 1 };
    let (lights, columns) = (next()?, next()?);
    let rows = axes.try_fold(1usize, |product, extent| product.checked_mul(extent?))?;
    let values = [rows, columns, lights, channels].into_iter().try_fold(1usize, usize::checked_mul)?;
    values.checked_mul(16)?;
    (channels <= MOST_CHANNELS).then_some((Shape { rows, columns, lights }, channels))
}

fn damaged(what: impl Into<String>) -> Error {
    Error::input(what)
}

#[cfg(test)]
mod tests;
