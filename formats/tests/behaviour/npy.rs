//! Arrays of numpy: what is written is read, by this crate and by another; what is damaged is refused.

use btfkit_formats::npy::{Archive, Beside, directions, directions_file, header, sample_bytes};
use btfkit_formats::{Direction, ErrorKind, Images, Limits, SampleType, Samples, directions as lists, f16};

const SHAPE: [u64; 5] = [2, 3, 2, 4, 3];
const IMAGE: usize = 2 * 4 * 3;

/// Samples of an array of [`SHAPE`], all different.
fn samples(sample_type: SampleType) -> Samples {
    let count = 2 * 3 * IMAGE;
    match sample_type {
        SampleType::U8 => Samples::U8((0..count).map(|i| i as u8).collect()),
        SampleType::U16 => Samples::U16((0..count).map(|i| 451 * i as u16).collect()),
        SampleType::F16 => Samples::F16((0..count).map(|i| f16::from_f32(i as f32 / 8.0)).collect()),
        SampleType::F32 => Samples::F32((0..count).map(|i| i as f32 / 7.0).collect()),
    }
}

fn file(sample_type: SampleType) -> Vec<u8> {
    [header(SHAPE, sample_type), sample_bytes(&samples(sample_type))].concat()
}

fn directions_of(count: u32) -> Vec<Direction> {
    (0..count).map(|i| Direction { theta_rad: 0.1 * f64::from(i), phi_rad: 1.0 }).collect()
}

fn beside() -> Beside {
    Beside { views: Some(directions_of(2)), lights: Some(directions_of(3)), channels: None }
}

fn open(bytes: &[u8]) -> btfkit_formats::Result<Archive> {
    Archive::open(bytes, beside(), &Limits::default())
}

/// Some of a list, whatever its type.
fn part(all: &Samples, range: std::ops::Range<usize>) -> Samples {
    match all {
        Samples::U8(list) => Samples::U8(list[range].to_vec()),
        Samples::U16(list) => Samples::U16(list[range].to_vec()),
        Samples::F16(list) => Samples::F16(list[range].to_vec()),
        Samples::F32(list) => Samples::F32(list[range].to_vec()),
    }
}

const TYPES: [SampleType; 4] = [SampleType::U8, SampleType::U16, SampleType::F16, SampleType::F32];

#[test]
fn every_image_of_every_type_is_read_back() {
    for sample_type in TYPES {
        let (bytes, all) = (file(sample_type), samples(sample_type));
        let archive = open(&bytes).unwrap();
        let contents = archive.contents();
        assert_eq!((contents.width, contents.height, contents.sample_type), (4, 2, sample_type));
        assert_eq!((&contents.views, &contents.lights), (&directions_of(2), &directions_of(3)));
        assert_eq!(contents.channels, ["R", "G", "B"]);
        assert_eq!(contents.linear, matches!(sample_type, SampleType::F16 | SampleType::F32));
        for view in 0..2 {
            for (first, last) in [(0, 3), (0, 1), (2, 3), (1, 1)] {
                let read = archive.read_images(&bytes, view, first..last).unwrap();
                assert_eq!(read, part(&all, (3 * view + first) * IMAGE..(3 * view + last) * IMAGE));
            }
        }
    }
}

#[test]
fn another_reader_agrees() {
    for sample_type in TYPES {
        let bytes = file(sample_type);
        let array = npyz::NpyFile::new(&bytes[..]).unwrap();
        assert_eq!((array.shape(), array.order()), (&SHAPE[..], npyz::Order::C));
        let read = match sample_type {
            SampleType::U8 => Samples::U8(array.into_vec().unwrap()),
            SampleType::U16 => Samples::U16(array.into_vec().unwrap()),
            SampleType::F16 => Samples::F16(array.into_vec().unwrap()),
            SampleType::F32 => Samples::F32(array.into_vec().unwrap()),
        };
        assert_eq!(read, samples(sample_type));
    }
    let bytes = directions_file(&directions_of(3));
    let list = npyz::NpyFile::new(&bytes[..]).unwrap();
    assert_eq!(list.shape(), [3, 2]);
    assert_eq!(list.into_vec::<f64>().unwrap(), [0.0, 1.0, 0.1, 1.0, 2.0 * 0.1, 1.0]);
}

/// An array as another program writes it.
fn foreign<T: npyz::Serialize>(descr: &str, order: npyz::Order, data: impl Iterator<Item = T>) -> Vec<u8> {
    use npyz::WriterBuilder;
    let mut bytes = Vec::new();
    let dtype = npyz::DType::Plain(descr.parse().unwrap());
    let options = npyz::WriteOptions::new().dtype(dtype).order(order).shape(&SHAPE);
    let mut writer = options.writer(&mut bytes).begin_nd().unwrap();
    writer.extend(data).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn big_endian_and_double_precision() {
    let all = samples(SampleType::F32);
    let Samples::F32(list) = &all else { unreachable!() };
    for bytes in [
        foreign(">f4", npyz::Order::C, list.iter().copied()),
        foreign(">f8", npyz::Order::C, list.iter().map(|&sample| f64::from(sample))),
        foreign("<f8", npyz::Order::C, list.iter().map(|&sample| f64::from(sample))),
    ] {
        let archive = open(&bytes).unwrap();
        assert_eq!(archive.contents().sample_type, SampleType::F32);
        assert_eq!(archive.read_images(&bytes, 1, 0..2).unwrap(), part(&all, 3 * IMAGE..5 * IMAGE));
    }
    let (bytes, expected) = (samples(SampleType::U16), samples(SampleType::F16));
    let (Samples::U16(integers), Samples::F16(halves)) = (&bytes, &expected) else { unreachable!() };
    for (bytes, all) in [
        (foreign(">u2", npyz::Order::C, integers.iter().copied()), &bytes),
        (foreign(">f2", npyz::Order::C, halves.iter().copied()), &expected),
    ] {
        assert_eq!(open(&bytes).unwrap().read_images(&bytes, 0, 0..3).unwrap(), part(all, 0..3 * IMAGE));
    }
    let error = open(&foreign("<f4", npyz::Order::Fortran, list.iter().copied())).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Unsupported);
    assert!(error.to_string().contains("Fortran"), "{error}");
}

#[test]
fn directions_must_be_given_and_fit() {
    let bytes = file(SampleType::U8);
    let of =
        |views, lights| Archive::open(&bytes, Beside { views, lights, channels: None }, &Limits::default());
    let (two, three) = (Some(directions_of(2)), Some(directions_of(3)));
    for (result, reason) in [
        (of(None, three.clone()), "NAME.views.npy"),
        (of(two.clone(), None), "NAME.lights.npy"),
        (of(three.clone(), three), "3 directions of views"),
        (of(two.clone(), Some(vec![directions_of(2)[1]; 3])), "lights 0 and 1 in one direction"),
        (
            of(two, Some((0..3).map(|i| Direction::from_degrees(50.0 * f64::from(i), 0.0)).collect())),
            "into the surface",
        ),
    ] {
        let error = result.unwrap_err();
        // Only what is missing can be said by an option.
        let missing = reason.starts_with("NAME");
        assert_eq!(error.kind(), if missing { ErrorKind::Argument } else { ErrorKind::Malformed });
        assert!(error.to_string().contains(reason), "{error}");
    }
}

#[test]
fn published_counts_are_named_but_not_assumed() {
    for (count, name) in [(81, "ubo81"), (151, "bonn151")] {
        let bytes = [header([1, count, 1, 1, 1], SampleType::U8), vec![0; count as usize]].concat();
        let error = Archive::open(&bytes, Beside::default(), &Limits::default()).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
        let list =
            lists::published(name).unwrap().into_iter().map(btfkit_formats::Angles::direction).collect();
        let archive = Archive::open(
            &bytes,
            Beside { views: None, lights: Some(list), channels: None },
            &Limits::default(),
        )
        .unwrap();
        assert_eq!(archive.contents().views, [Direction { theta_rad: 0.0, phi_rad: 0.0 }]);
        assert!(archive.contents().assumptions.iter().any(|text| text.contains("frontal")));
    }
}

#[test]
fn images_that_are_not_there_are_refused() {
    let bytes = file(SampleType::U8);
    let archive = open(&bytes).unwrap();
    let backwards = std::ops::Range { start: 2, end: 1 };
    for (view, lights) in [(2, 0..1), (usize::MAX, 0..1), (0, 0..4), (0, 4..4), (0, backwards)] {
        let error = archive.read_images(&bytes, view, lights).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Argument);
    }
    assert!(archive.read_images(&bytes[..bytes.len() - 1], 0, 0..1).is_err(), "bytes of another file");
    let mut limits = Limits::default();
    limits.max_decoded_bytes = 2 * IMAGE as u64;
    let archive = Archive::open(&bytes, beside(), &limits).unwrap();
    assert!(archive.read_images(&bytes, 0, 0..2).is_ok());
    assert_eq!(archive.read_images(&bytes, 0, 0..3).unwrap_err().kind(), ErrorKind::Limit);
}

#[test]
fn an_array_cut_anywhere_is_an_error() {
    let (array, list) = (file(SampleType::U16), directions_file(&directions_of(3)));
    for end in 0..array.len() {
        assert_eq!(open(&array[..end]).unwrap_err().kind(), ErrorKind::Malformed, "{end}");
    }
    for end in 0..list.len() {
        let error = directions(&list[..end], &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Malformed, "{end}");
    }
}

#[test]
fn a_flipped_bit_never_panics_and_gives_no_more_samples() {
    let (array, list) = (file(SampleType::F32), directions_file(&directions_of(3)));
    for bit in 0..array.len() * 8 {
        let mut flipped = array.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        if let Ok(archive) = open(&flipped) {
            let (views, lights) = (archive.contents().views.len(), archive.contents().lights.len());
            for view in 0..views {
                let samples = archive.read_images(&flipped, view, 0..lights).unwrap();
                assert!(samples.len() <= flipped.len());
            }
        }
    }
    for bit in 0..list.len() * 8 {
        let mut flipped = list.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        if let Ok(list) = directions(&flipped, &Limits::default()) {
            assert!(list.iter().all(|d| d.phi_rad.is_finite() && (0.0..1.6).contains(&d.theta_rad)));
        }
    }
}

#[test]
fn nonsense_sizes_are_refused() {
    let huge = u64::from(u32::MAX);
    for shape in [
        [1, 1, 1 << 31, 1 << 31, 3],
        [4_000_000_000, 1, 1, 1, 1],
        [1, 4_000_000_000, 1, 1, 1],
        [1, 1, 1, 1, huge],
        [u64::MAX; 5],
        [1 << 16, 1 << 16, 1 << 26, 1, 1 << 10],
        [1, 1, 0, 1, 1],
    ] {
        let bytes = [header(shape, SampleType::F32), vec![0; 64]].concat();
        let error = open(&bytes).unwrap_err();
        assert!(matches!(error.kind(), ErrorKind::Limit | ErrorKind::Malformed), "{shape:?}: {error}");
    }
    let axes = directions_file(&directions_of(3));
    assert!(open(&axes).unwrap_err().to_string().contains("2 dimensions"));
}
