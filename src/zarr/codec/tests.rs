#![allow(clippy::unwrap_used)]

use std::borrow::Cow;
use std::path::Path;

use btfkit_formats::f16;
use serde_json::json;
use zarrs::array::codec::api::ArrayToBytesCodecTraits as _;
use zarrs::array::{
    Array, ArrayBuilder, ArrayBytes, ArraySubset, CodecOptions, DataType, FillValue, data_type,
};

use super::*;
use crate::zarr::storage::MappedStorage;

const TYPES: [SampleType; 4] = [SampleType::U8, SampleType::U16, SampleType::F16, SampleType::F32];

/// One sample of the fixtures in `python/tests`, which knows the same formula.
fn sample(samples: SampleType, [y, x, l, c]: [u32; 4]) -> Vec<u8> {
    let mixed = y.wrapping_mul(73_856_093)
        ^ x.wrapping_mul(19_349_663)
        ^ l.wrapping_mul(83_492_791)
        ^ c.wrapping_mul(2_654_435_761);
    let noise = (mixed.wrapping_mul(2_654_435_761) >> 24) % 8;
    let value = 60 + 3 * y + 5 * x + 7 * (l * l % 11) + 20 * c + noise;
    let float = value as f32 / 255.0 - 0.5;
    match samples {
        SampleType::U8 => vec![value as u8],
        SampleType::U16 => (value as u16 * 131).to_le_bytes().to_vec(),
        SampleType::F16 => f16::from_f32(float).to_le_bytes().to_vec(),
        SampleType::F32 => float.to_le_bytes().to_vec(),
    }
}

/// The box of the fixtures' samples that begins at a row and column.
fn chunk_samples(chunk: &Chunk, row: usize, column: usize) -> Vec<u8> {
    let Shape { rows, columns, lights } = chunk.shape;
    let mut bytes = Vec::new();
    for (y, x) in (row..row + rows).flat_map(|y| (column..column + columns).map(move |x| (y, x))) {
        for (l, c) in (0..lights).flat_map(|l| (0..chunk.channels.unwrap_or(1)).map(move |c| (l, c))) {
            bytes.extend(sample(chunk.samples, [y as u32, x as u32, l as u32, c as u32]));
        }
    }
    bytes
}

fn data_type_of(samples: SampleType) -> DataType {
    match samples {
        SampleType::U8 => data_type::uint8(),
        SampleType::U16 => data_type::uint16(),
        SampleType::F16 => data_type::float16(),
        SampleType::F32 => data_type::float32(),
    }
}

fn kinds() -> impl Iterator<Item = (Chain, Chunk)> {
    let shapes = [(16, 16, 81), (8, 8, 5), (1, 1, 1), (3, 1, 4), (2, 3, 1)];
    let shapes = shapes.map(|(rows, columns, lights)| Shape { rows, columns, lights });
    let channels = [None, Some(1), Some(2), Some(3)];
    let chunks = shapes.into_iter().flat_map(move |shape| {
        channels.into_iter().flat_map(move |channels| TYPES.map(|samples| Chunk { samples, shape, channels }))
    });
    chunks.flat_map(|chunk| [Chain::Stock, Chain::Predictive].map(|chain| (chain, chunk)))
}

fn extents(chunk: &Chunk) -> Vec<u64> {
    let Shape { rows, columns, lights } = chunk.shape;
    [1, rows, columns, lights].into_iter().chain(chunk.channels).map(|extent| extent as u64).collect()
}

#[test]
fn the_chain_of_codecs_reads_our_bytes_and_we_read_its() {
    for (chain, chunk) in kinds() {
        let codecs = chunk_codecs(chain, &chunk).unwrap().chain();
        let shape: Vec<NonZeroU64> =
            extents(&chunk).into_iter().map(|n| NonZeroU64::new(n).unwrap()).collect();
        let (data_type, fill) = (data_type_of(chunk.samples), FillValue::new(vec![0; chunk.samples.bytes()]));
        let options = CodecOptions::default();
        let mut codec = ChunkCodec::new(chain, chunk).unwrap();
        // More than one, so that what is kept from the first would show.
        for row in [0, 40] {
            let samples = chunk_samples(&chunk, row, 3);
            let array_bytes = ArrayBytes::new_flen(samples.clone());
            let expected = codecs.encode(array_bytes, &shape, &data_type, &fill, &options).unwrap();
            let mut bytes = b"before".to_vec();
            codec.encode(&samples, &mut bytes).unwrap();
            // zstd packs differences with other parameters here than the chain's codec does, to the same format.
            let tuned = chain == Chain::Stock && chunk.has_deltas();
            assert!(tuned || bytes[6..] == *expected, "{chain:?} {chunk:?}");
            let mut back = vec![1; samples.len()];
            codec.decode(&expected, &mut back).unwrap();
            assert!(back == samples, "{chain:?} {chunk:?}");
            let mut back = vec![1; samples.len()];
            codec.decode(&bytes[6..], &mut back).unwrap();
            assert!(back == samples, "{chain:?} {chunk:?}");
            let decoded = codecs.decode(Cow::Owned(bytes[6..].to_vec()), &shape, &data_type, &fill, &options);
            assert!(*decoded.unwrap().into_fixed().unwrap() == samples, "{chain:?} {chunk:?}");
        }
    }
}

/// An array of 7 x 11 texels in shards of 4 x 8 and chunks of 4 x 4.
fn build(storage: Arc<MappedStorage>, chain: Chain, chunk: &Chunk) -> Array<MappedStorage> {
    let codecs = chunk_codecs(chain, chunk).unwrap();
    let of = |rows: u64, columns: u64| {
        let mut extents = extents(chunk);
        (extents[1], extents[2]) = (rows, columns);
        extents
    };
    let fill = FillValue::new(vec![0; chunk.samples.bytes()]);
    let array = ArrayBuilder::new(of(7, 11), of(4, 8), data_type_of(chunk.samples), fill)
        .subchunk_shape(extents(chunk))
        .array_to_array_codecs(codecs.array_to_array)
        .array_to_bytes_codec(codecs.array_to_bytes)
        .bytes_to_bytes_codecs(codecs.bytes_to_bytes)
        .build(storage, &name_of(chain, chunk))
        .unwrap();
    let options = zarrs::array::ArrayMetadataOptions::default().with_include_zarrs_metadata(false);
    array.store_metadata_opt(&options).unwrap();
    array
}

fn name_of(chain: Chain, chunk: &Chunk) -> String {
    let channels = chunk.channels.map_or("none".to_owned(), |channels| channels.to_string());
    format!("/{}-{}-{channels}", chain.name(), chunk.samples.name())
}

fn fixture_kinds() -> impl Iterator<Item = (Chain, Chunk)> {
    let shape = Shape { rows: 4, columns: 4, lights: 9 };
    let chunk = move |samples, channels| Chunk { samples, shape, channels };
    let chunks = TYPES.map(|samples| chunk(samples, Some(3))).into_iter();
    let chunks = chunks.chain([chunk(SampleType::U8, None), chunk(SampleType::U16, Some(1))]);
    chunks.flat_map(|chunk| [Chain::Stock, Chain::Predictive].map(|chain| (chain, chunk)))
}

fn check_fixture(array: &Array<MappedStorage>, chunk: &Chunk) {
    let whole = Chunk { shape: Shape { rows: 7, columns: 11, ..chunk.shape }, ..*chunk };
    let read = |subset: &ArraySubset| -> Vec<u8> {
        let found = array.retrieve_array_subset_opt::<ArrayBytes<'_>>(subset, &CodecOptions::default());
        found.unwrap().into_fixed().unwrap().into_owned()
    };
    assert!(read(&array.subset_all()) == chunk_samples(&whole, 0, 0), "{}", array.path());
    // A part that begins and ends within chunks.
    let part = Chunk { shape: Shape { rows: 3, columns: 6, ..chunk.shape }, ..*chunk };
    let mut start = vec![0; array.dimensionality()];
    (start[1], start[2]) = (2, 3);
    let subset = ArraySubset::new_with_start_shape(start, extents(&part)).unwrap();
    assert!(read(&subset) == chunk_samples(&part, 2, 3), "{}", array.path());
}

/// Writes the fixtures of `python/tests` where `BTFKIT_WRITE_FIXTURES` says.
#[test]
fn sharded_arrays_are_read_as_they_were_written_and_name_their_chain() {
    let folder = tempfile::tempdir().unwrap();
    let wanted = std::env::var_os("BTFKIT_WRITE_FIXTURES");
    let folder = wanted.as_deref().map_or(folder.path(), Path::new);
    let storage = Arc::new(MappedStorage::new(folder));
    for (chain, chunk) in fixture_kinds() {
        let array = build(storage.clone(), chain, &chunk);
        let whole = Chunk { shape: Shape { rows: 7, columns: 11, ..chunk.shape }, ..chunk };
        let samples = ArrayBytes::new_flen(chunk_samples(&whole, 0, 0));
        array.store_array_subset(&array.subset_all(), samples).unwrap();
        let array = Array::open(storage.clone(), &name_of(chain, &chunk)).unwrap();
        check_fixture(&array, &chunk);
        let metadata = std::fs::read(folder.join(&name_of(chain, &chunk)[1..]).join("zarr.json")).unwrap();
        let metadata: serde_json::Value = serde_json::from_slice(&metadata).unwrap();
        assert_eq!(Chain::of(&metadata["codecs"], &chunk), Some(chain), "{}", metadata["codecs"]);
        let mut reading = metadata.clone();
        reading["codecs"] = fused(reading["codecs"].take(), &chunk);
        assert_eq!(reading != metadata, chain == Chain::Stock);
        let reading = serde_json::from_value(reading).unwrap();
        let array = Array::new_with_metadata(storage.clone(), &name_of(chain, &chunk), reading).unwrap();
        check_fixture(&array, &chunk);
    }
}

#[test]
fn the_chain_of_foreign_codecs_is_none() {
    let chunk = Chunk {
        samples: SampleType::U8,
        shape: Shape { rows: 16, columns: 16, lights: 81 },
        channels: Some(3),
    };
    let plain = json!([{"name": "bytes"}, {"name": "zstd", "configuration": {"level": 1, "checksum": true}}]);
    assert_eq!(Chain::of(&plain, &chunk), None);
    let other = json!([{"name": "btfkit.predictive", "configuration": {"channel_axis": false}}]);
    assert_eq!(Chain::of(&other, &chunk), None);
    assert_eq!(Chain::of(&other, &Chunk { channels: None, ..chunk }), Some(Chain::Predictive));
}

/// Fixtures in the project: written by this program at an earlier time, and by Python.
#[test]
fn committed_fixtures_are_still_read() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("python/tests/fixtures");
    for writer in ["rust.zarr", "python.zarr"] {
        let storage = Arc::new(MappedStorage::new(&root.join(writer)));
        for (chain, chunk) in fixture_kinds() {
            // zarr-python does not write the stock chain: numcodecs' delta hands on an array without its shape.
            if (writer, chain) != ("python.zarr", Chain::Stock) {
                check_fixture(&Array::open(storage.clone(), &name_of(chain, &chunk)).unwrap(), &chunk);
            }
        }
    }
}

#[test]
fn damaged_bytes_are_refused() {
    let shape = Shape { rows: 3, columns: 4, lights: 5 };
    for chain in [Chain::Stock, Chain::Predictive] {
        for samples in TYPES {
            let chunk = Chunk { samples, shape, channels: Some(3) };
            let mut codec = ChunkCodec::new(chain, chunk).unwrap();
            let samples = chunk_samples(&chunk, 0, 0);
            let (mut bytes, mut back) = (Vec::new(), vec![0; samples.len()]);
            codec.encode(&samples, &mut bytes).unwrap();
            for length in 0..bytes.len() {
                assert!(codec.decode(&bytes[..length], &mut back).is_err(), "{chunk:?} cut at {length}");
            }
            for bit in 0..8 * bytes.len() {
                bytes[bit / 8] ^= 1 << (bit % 8);
                // A few bits of a zstd header say nothing about its content.
                let found = codec.decode(&bytes, &mut back);
                assert!(found.is_err() || (chain == Chain::Stock && back == samples), "{chunk:?} bit {bit}");
                bytes[bit / 8] ^= 1 << (bit % 8);
            }
        }
    }
}

/// What a checksum cannot tell: bytes that were made to mislead.
#[test]
fn nonsense_with_a_right_checksum_is_refused() {
    let shape = Shape { rows: 3, columns: 4, lights: 5 };
    let chunk = Chunk { samples: SampleType::U16, shape, channels: Some(2) };
    let mut codec = ChunkCodec::new(Chain::Predictive, chunk).unwrap();
    let (mut bytes, mut back) = (Vec::new(), vec![0; chunk.bytes()]);
    codec.encode(&chunk_samples(&chunk, 0, 0), &mut bytes).unwrap();
    let body = bytes.len() - 4;
    let mut refused = |mut bytes: Vec<u8>, expected: &str| {
        let checksum = crc32fast::hash(&bytes).to_le_bytes();
        bytes.extend(checksum);
        let error = codec.decode(&bytes, &mut back).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    let with = |at: usize, byte: u8| {
        let mut changed = bytes[..body].to_vec();
        changed[at] = byte;
        changed
    };
    refused(with(0, 2), "layout version 2");
    refused(with(1, 3), "not a mode");
    refused(with(6, 0xff), "streams end at byte");
    refused(bytes[..body - 1].to_vec(), "streams end at byte");
    refused([&bytes[..body], &[0]].concat(), "streams end at byte");
    refused(bytes[..10].to_vec(), "expected");
    // A frame that holds more, and one that holds less, than a plane.
    for (length, expected) in [(61, "zstd"), (59, "a zstd frame of 59 bytes")] {
        let frame = zstd::bulk::compress(&vec![0; length], 1).unwrap();
        let mut header = vec![1, 0, 0];
        (0..4).for_each(|_| header.extend((frame.len() as u32).to_le_bytes()));
        refused([header, frame.repeat(4)].concat(), expected);
    }
}
