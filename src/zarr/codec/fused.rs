//! A chain as one Zarr codec: `btfkit.predictive`, and `btfkit.stock` for reading only (see [`super::fused`]).

use std::borrow::Cow;
use std::num::NonZeroU64;
use std::sync::Arc;

use btfkit_formats::SampleType;
use serde::{Deserialize, Serialize};
use zarrs::array::codec::api::{
    ArrayCodecTraits, ArrayToBytesCodecTraits, Codec, CodecError, CodecMetadataOptions, CodecPluginV3,
    CodecTraits, CodecTraitsV3, PartialDecoderCapability, PartialEncoderCapability,
};
use zarrs::array::{
    ArrayBytes, ArrayBytesRaw, BytesRepresentation, CodecOptions, DataType, FillValue, RecommendedConcurrency,
};
use zarrs::metadata::Configuration;
use zarrs::metadata::v3::MetadataV3;
use zarrs::plugin::{ExtensionName, PluginCreateError, ZarrVersion};

use super::{Chain, Chunk, ChunkCodec, extent};

/// Array to bytes, entropy coding and checksum included.
#[derive(Clone, Debug)]
pub(super) struct FusedCodec<const STOCK: bool> {
    configuration: Settings,
}

pub(super) type PredictiveCodec = FusedCodec<false>;
type StockCodec = FusedCodec<true>;

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    /// Whether the last axis is channels and the one before it lights, or lights the last.
    channel_axis: bool,
}

impl<const STOCK: bool> FusedCodec<STOCK> {
    const CHAIN: Chain = if STOCK { Chain::Stock } else { Chain::Predictive };

    pub(super) fn new(channel_axis: bool) -> Self {
        Self { configuration: Settings { channel_axis } }
    }

    fn chunk(&self, shape: &[NonZeroU64], data_type: &DataType) -> Result<Chunk, CodecError> {
        let unsupported =
            || CodecError::UnsupportedDataType(data_type.clone(), Self::CHAIN.name().to_owned());
        let name = data_type.name_v3().ok_or_else(unsupported)?;
        let samples = [SampleType::U8, SampleType::U16, SampleType::F16, SampleType::F32]
            .into_iter()
            .find(|samples| samples.name() == name)
            .ok_or_else(unsupported)?;
        let channel_axis = self.configuration.channel_axis;
        let (shape, channels) = extent(shape, channel_axis)
            .ok_or_else(|| CodecError::Other(format!("chunks of {shape:?} are too large")))?;
        Ok(Chunk { samples, shape, channels: channel_axis.then_some(channels) })
    }

    fn codec(&self, shape: &[NonZeroU64], data_type: &DataType) -> Result<(ChunkCodec, Chunk), CodecError> {
        let chunk = self.chunk(shape, data_type)?;
        if cfg!(target_endian = "big") && chunk.samples.bytes() > 1 {
            return Err(CodecError::Other("only little-endian machines can do this".to_owned()));
        }
        Ok((ChunkCodec::new(Self::CHAIN, chunk).map_err(failed)?, chunk))
    }
}

#[allow(clippy::needless_pass_by_value)] // as `map_err` hands it
fn failed(error: crate::error::Error) -> CodecError {
    CodecError::Other(format!("btfkit: {error}"))
}

zarrs::plugin::impl_extension_aliases!(PredictiveCodec, v3: "btfkit.predictive");
zarrs::plugin::impl_extension_aliases!(StockCodec, v3: "btfkit.stock");

inventory::submit! {
    CodecPluginV3::new::<PredictiveCodec>()
}
inventory::submit! {
    CodecPluginV3::new::<StockCodec>()
}

impl<const STOCK: bool> CodecTraitsV3 for FusedCodec<STOCK>
where
    Self: ExtensionName,
{
    fn create(metadata: &MetadataV3) -> Result<Codec, PluginCreateError> {
        let configuration = metadata.to_typed_configuration()?;
        Ok(Codec::ArrayToBytes(Arc::new(Self { configuration })))
    }
}

impl<const STOCK: bool> CodecTraits for FusedCodec<STOCK>
where
    Self: ExtensionName,
{
    fn as_any(&self) -> &dyn std::any::Any {
        self
    }

    fn configuration(&self, _version: ZarrVersion, _options: &CodecMetadataOptions) -> Option<Configuration> {
        let mut configuration = serde_json::Map::new();
        configuration.insert("channel_axis".to_owned(), self.configuration.channel_axis.into());
        Some(configuration.into())
    }

    fn partial_decoder_capability(&self) -> PartialDecoderCapability {
        PartialDecoderCapability { partial_read: false, partial_decode: false }
    }

    fn partial_encoder_capability(&self) -> PartialEncoderCapability {
        PartialEncoderCapability { partial_encode: false }
    }
}

impl<const STOCK: bool> ArrayCodecTraits for FusedCodec<STOCK>
where
    Self: ExtensionName,
{
    fn recommended_concurrency(
        &self,
        _shape: &[NonZeroU64],
        _data_type: &DataType,
    ) -> Result<RecommendedConcurrency, CodecError> {
        Ok(RecommendedConcurrency::new_maximum(1))
    }
}

impl<const STOCK: bool> ArrayToBytesCodecTraits for FusedCodec<STOCK>
where
    Self: ExtensionName,
{
    fn into_dyn(self: Arc<Self>) -> Arc<dyn ArrayToBytesCodecTraits> {
        self
    }

    fn encoded_representation(
        &self,
        shape: &[NonZeroU64],
        data_type: &DataType,
        _fill_value: &FillValue,
    ) -> Result<BytesRepresentation, CodecError> {
        let chunk = self.chunk(shape, data_type)?;
        // Streams that do not shrink are stored as they are; zstd alone adds a little.
        let channels = chunk.channels.unwrap_or(1);
        let header = 1 + channels + 4 * channels * chunk.samples.bytes() + 4;
        let bound = zstd::zstd_safe::compress_bound(chunk.bytes()) + header;
        Ok(BytesRepresentation::BoundedSize(bound as u64))
    }

    fn encode<'a>(
        &self,
        bytes: ArrayBytes<'a>,
        shape: &[NonZeroU64],
        data_type: &DataType,
        _fill_value: &FillValue,
        _options: &CodecOptions,
    ) -> Result<ArrayBytesRaw<'a>, CodecError> {
        let (mut codec, _) = self.codec(shape, data_type)?;
        let mut out = Vec::new();
        codec.encode(&bytes.into_fixed()?, &mut out).map_err(failed)?;
        Ok(Cow::Owned(out))
    }

    fn decode<'a>(
        &self,
        bytes: ArrayBytesRaw<'a>,
        shape: &[NonZeroU64],
        data_type: &DataType,
        _fill_value: &FillValue,
        _options: &CodecOptions,
    ) -> Result<ArrayBytes<'a>, CodecError> {
        let (mut codec, chunk) = self.codec(shape, data_type)?;
        let mut samples = vec![0; chunk.bytes()];
        codec.decode(&bytes, &mut samples).map_err(failed)?;
        Ok(ArrayBytes::new_flen(samples))
    }
}
