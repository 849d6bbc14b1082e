//! The Zarr codec `numcodecs.delta` of whole numbers without sign, which zarrs lacks.

use std::num::NonZeroU64;
use std::sync::Arc;

use btfkit_formats::SampleType;
use serde::{Deserialize, Serialize};
use zarrs::array::codec::api::{
    ArrayCodecTraits, ArrayPartialDecoderTraits, ArrayToArrayCodecTraits, Codec, CodecError,
    CodecMetadataOptions, CodecPluginV3, CodecTraits, CodecTraitsV3, PartialDecoderCapability,
    PartialEncoderCapability,
};
use zarrs::array::{
    ArrayBytes, ArraySubset, CodecOptions, DataType, FillValue, Indexer, RecommendedConcurrency, data_type,
};
use zarrs::metadata::Configuration;
use zarrs::metadata::v3::MetadataV3;
use zarrs::plugin::{PluginCreateError, ZarrVersion};
use zarrs_storage::StorageError;

/// Array to array: each element's difference from the one before it in C order, modulo 2^bits.
#[derive(Clone, Debug)]
pub(super) struct DeltaCodec {
    bytes: usize,
}

/// As numcodecs writes them: numpy's type strings of the elements before and after.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    dtype: String,
    astype: String,
}

const NAMES: [(&str, usize); 2] = [("|u1", 1), ("<u2", 2)];

impl DeltaCodec {
    /// For integers as wide as these samples.
    pub(super) fn new(samples: SampleType) -> Self {
        Self { bytes: samples.bytes() }
    }

    fn name(&self) -> &'static str {
        if self.bytes == 1 { NAMES[0].0 } else { NAMES[1].0 }
    }

    fn check(&self, data_type: &DataType) -> Result<(), CodecError> {
        let expected = if self.bytes == 1 { data_type::uint8() } else { data_type::uint16() };
        if *data_type == expected {
            return Ok(());
        }
        Err(CodecError::UnsupportedDataType(data_type.clone(), "numcodecs.delta".to_owned()))
    }

    fn map(&self, mut bytes: Vec<u8>, f: impl Fn(u16, u16) -> (u16, u16)) -> Vec<u8> {
        let mut before = 0;
        if self.bytes == 1 {
            for byte in &mut bytes {
                let (value, next) = f(u16::from(*byte), before);
                (*byte, before) = (value as u8, next);
            }
        } else {
            for pair in bytes.as_chunks_mut().0 {
                let (value, next) = f(u16::from_ne_bytes(*pair), before);
                (*pair, before) = (value.to_ne_bytes(), next);
            }
        }
        bytes
    }
}

zarrs::plugin::impl_extension_aliases!(DeltaCodec, v3: "numcodecs.delta");

inventory::submit! {
    CodecPluginV3::new::<DeltaCodec>()
}

impl CodecTraitsV3 for DeltaCodec {
    fn create(metadata: &MetadataV3) -> Result<Codec, PluginCreateError> {
        let Settings { dtype, astype } = metadata.to_typed_configuration()?;
        let found = NAMES.iter().find(|(name, _)| *name == dtype && dtype == astype);
        let bytes = found.map(|&(_, bytes)| bytes).ok_or_else(|| {
            PluginCreateError::Other(format!(
                "numcodecs.delta of {dtype} as {astype}: expected |u1 or <u2 for both"
            ))
        })?;
        Ok(Codec::ArrayToArray(Arc::new(Self { bytes })))
    }
}

impl CodecTraits for DeltaCodec {
    fn as_any(&self) -> &dyn std::any::Any {
        self
    }

    fn configuration(&self, _version: ZarrVersion, _options: &CodecMetadataOptions) -> Option<Configuration> {
        let mut configuration = serde_json::Map::new();
        configuration.insert("dtype".to_owned(), self.name().into());
        configuration.insert("astype".to_owned(), self.name().into());
        Some(configuration.into())
    }

    fn partial_decoder_capability(&self) -> PartialDecoderCapability {
        // It decodes all for any part. Saying so would make zarrs 0.23 keep the array in front of the next codec with
        // the shape that is behind it, which fails where that is a transposition.
        PartialDecoderCapability { partial_read: true, partial_decode: true }
    }

    fn partial_encoder_capability(&self) -> PartialEncoderCapability {
        PartialEncoderCapability { partial_encode: false }
    }
}

impl ArrayCodecTraits for DeltaCodec {
    fn recommended_concurrency(
        &self,
        _shape: &[NonZeroU64],
        _data_type: &DataType,
    ) -> Result<RecommendedConcurrency, CodecError> {
        Ok(RecommendedConcurrency::new_maximum(1))
    }
}

impl ArrayToArrayCodecTraits for DeltaCodec {
    fn into_dyn(self: Arc<Self>) -> Arc<dyn ArrayToArrayCodecTraits> {
        self
    }

    fn encoded_data_type(&self, decoded_data_type: &DataType) -> Result<DataType, CodecError> {
        self.check(decoded_data_type)?;
        Ok(decoded_data_type.clone())
    }

    fn encode<'a>(
        &self,
        bytes: ArrayBytes<'a>,
        _shape: &[NonZeroU64],
        data_type: &DataType,
        _fill_value: &FillValue,
        _options: &CodecOptions,
    ) -> Result<ArrayBytes<'a>, CodecError> {
        self.check(data_type)?;
        let bytes = bytes.into_fixed()?.into_owned();
        Ok(ArrayBytes::new_flen(self.map(bytes, |value, before| (value.wrapping_sub(before), value))))
    }

    fn decode<'a>(
        &self,
        bytes: ArrayBytes<'a>,
        _shape: &[NonZeroU64],
        data_type: &DataType,
        _fill_value: &FillValue,
        _options: &CodecOptions,
    ) -> Result<ArrayBytes<'a>, CodecError> {
        self.check(data_type)?;
        let bytes = bytes.into_fixed()?.into_owned();
        let sum = |value: u16, before: u16| (value.wrapping_add(before), value.wrapping_add(before));
        Ok(ArrayBytes::new_flen(self.map(bytes, sum)))
    }

    // The default would decode the part alone.
    fn partial_decoder(
        self: Arc<Self>,
        input: Arc<dyn ArrayPartialDecoderTraits>,
        shape: &[NonZeroU64],
        data_type: &DataType,
        fill_value: &FillValue,
        _options: &CodecOptions,
    ) -> Result<Arc<dyn ArrayPartialDecoderTraits>, CodecError> {
        let (shape, data_type, fill_value) = (shape.to_vec(), data_type.clone(), fill_value.clone());
        Ok(Arc::new(PartOfWhole { input, codec: self, shape, data_type, fill_value }))
    }
}

/// Decodes a whole chunk for any part of it.
struct PartOfWhole {
    input: Arc<dyn ArrayPartialDecoderTraits>,
    codec: Arc<DeltaCodec>,
    shape: Vec<NonZeroU64>,
    data_type: DataType,
    fill_value: FillValue,
}

impl ArrayPartialDecoderTraits for PartOfWhole {
    fn data_type(&self) -> &DataType {
        &self.data_type
    }

    fn exists(&self) -> Result<bool, StorageError> {
        self.input.exists()
    }

    fn size_held(&self) -> usize {
        self.input.size_held()
    }

    fn partial_decode(
        &self,
        indexer: &dyn Indexer,
        options: &CodecOptions,
    ) -> Result<ArrayBytes<'_>, CodecError> {
        let extent: Vec<u64> = self.shape.iter().map(|n| n.get()).collect();
        let whole = self.input.partial_decode(&ArraySubset::new_with_shape(extent.clone()), options)?;
        let whole = self.codec.decode(whole, &self.shape, &self.data_type, &self.fill_value, options)?;
        Ok(whole.extract_array_subset(indexer, &extent, &self.data_type)?.into_owned())
    }

    fn supports_partial_decode(&self) -> bool {
        false
    }
}
