//! BIG files: both dialects, every order and type, and all that is refused.

use btfkit_formats::big::{Big, Options, recognise};
use btfkit_formats::utia::Order;
use btfkit_formats::{Error, ErrorKind, Images, Limits, SampleType, Samples, f16};

use crate::utia_files::{IMAGE_OF, PAIRS, big_file, doubles, words};

type Chunks = Vec<(u64, Vec<u8>)>;
/// How one sample is written, as a type of the format.
type Write = fn(u64, &mut Vec<u8>);

const HEIGHT: u64 = 2;
const WIDTH: u64 = 3;
const PLANES: u64 = 3;
const TILES: u64 = 2;

/// The sample of an image, tile, row, column and plane; all differ.
fn sample(at: [u64; 5]) -> u64 {
    let [image, tile, row, column, plane] = at;
    1 + image + 6 * (tile + TILES * (row + HEIGHT * (column + WIDTH * plane)))
}

/// Samples in an order of ids, outermost first, each written by `write`.
fn data(order: [u64; 5], write: impl Fn([u64; 5], &mut Vec<u8>)) -> Vec<u8> {
    let sizes = [6, TILES, HEIGHT, WIDTH, PLANES];
    let mut out = Vec::new();
    let count: u64 = sizes.iter().product();
    for number in 0..count {
        let mut rest = number;
        let mut at = [0; 5];
        for id in order.into_iter().rev() {
            let axis = id as usize - 1;
            at[axis] = rest % sizes[axis];
            rest /= sizes[axis];
        }
        write(at, &mut out);
    }
    out
}

/// Directions of [`PAIRS`] as the file has them: light before view.
fn spherical(kind: u64, unit: f64) -> (u64, Vec<u8>) {
    let angles: Vec<f64> =
        PAIRS.iter().flat_map(|[tv, pv, ti, pi]| [*ti, *pi, *tv, *pv].map(|a| a * unit)).collect();
    (16, [words(&[kind]), doubles(&angles)].concat())
}

fn sizes() -> Chunks {
    [(1, 6), (2, TILES), (3, HEIGHT), (4, WIDTH), (5, PLANES)].map(|(id, n)| (id, words(&[n]))).to_vec()
}

/// u16 samples in the default order.
fn plain() -> Chunks {
    let mut chunks = sizes();
    chunks.push((7, words(&[7])));
    chunks.push((8, data([1, 2, 3, 4, 5], |at, out| out.extend((sample(at) as u16).to_le_bytes()))));
    chunks.push(spherical(3, 1.0));
    chunks
}

fn replaced(chunks: Chunks, id: u64, data: Vec<u8>) -> Chunks {
    let mut chunks = chunks;
    let chunk = chunks.iter_mut().find(|(other, _)| *other == id).unwrap();
    chunk.1 = data;
    chunks
}

fn tile(tile: u64) -> Options {
    let mut options = Options::default();
    options.tile = tile;
    options
}

fn ordered(order: Order) -> Options {
    let mut options = Options::default();
    options.order = order;
    options
}

fn open(chunks: &[(u64, Vec<u8>)], options: &Options) -> Result<(Vec<u8>, Big), Error> {
    let bytes = big_file(chunks);
    Big::open(&bytes, options, &Limits::default()).map(|big| (bytes, big))
}

fn refusal(chunks: &[(u64, Vec<u8>)], options: &Options) -> Error {
    match open(chunks, options) {
        Ok(_) => panic!("a file that should be refused was read"),
        Err(error) => error,
    }
}

/// Every image of a file, as whole numbers `[view][light]` of `[y, x, plane]`, must be that of [`sample`].
fn assert_samples(
    chunks: &[(u64, Vec<u8>)],
    tile_number: u64,
    expected_type: SampleType,
    of: impl Fn(&Samples) -> Vec<u64>,
) {
    let (bytes, big) = open(chunks, &tile(tile_number)).unwrap();
    let contents = big.contents();
    assert_eq!((contents.width, contents.height), (WIDTH as u32, HEIGHT as u32));
    assert_eq!(contents.sample_type, expected_type);
    for (view, images) in IMAGE_OF.iter().enumerate() {
        let found = big.read_images(&bytes, view, 0..3).unwrap();
        let mut expected = Vec::new();
        for &image in images {
            for row in 0..HEIGHT {
                for column in 0..WIDTH {
                    expected.extend(
                        (0..PLANES).map(|plane| sample([image as u64, tile_number, row, column, plane])),
                    );
                }
            }
        }
        assert_eq!(of(&found), expected);
    }
}

fn u16s(samples: &Samples) -> Vec<u64> {
    match samples {
        Samples::U16(list) => list.iter().map(|&s| s.into()).collect(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_file_of_the_document_is_read() {
    assert!(recognise(&big_file(&[])) && !recognise(b"BIG\0\0\0\0\x01"));
    for tile in [0, 1] {
        assert_samples(&plain(), tile, SampleType::U16, u16s);
    }
    let (_, big) = open(&plain(), &Options::default()).unwrap();
    let contents = big.contents();
    let degrees = |list: &[btfkit_formats::Direction]| -> Vec<(f64, f64)> {
        list.iter().map(|d| (d.theta_rad.to_degrees().round(), d.phi_rad.to_degrees().round())).collect()
    };
    assert_eq!(degrees(&contents.views), [(15.0, 30.0), (45.0, 270.0)]);
    assert_eq!(degrees(&contents.lights), [(0.0, 0.0), (60.0, 120.0), (75.0, 345.0)]);
    assert_eq!(contents.channels, ["R", "G", "B"]);
    assert!(contents.linear);
    assert!(
        contents
            .assumptions
            .iter()
            .any(|text| text.contains("ideal spherical angles") && text.contains("in degrees"))
    );
}

#[test]
fn data_may_lie_in_any_order() {
    for order in
        [[1, 3, 4, 5, 2], [1, 2, 5, 3, 4], [2, 1, 3, 4, 5], [3, 1, 2, 4, 5], [4, 5, 1, 2, 3], [5, 4, 3, 2, 1]]
    {
        let mut chunks =
            replaced(plain(), 8, data(order, |at, out| out.extend((sample(at) as u16).to_le_bytes())));
        chunks.insert(0, (6, words(&order)));
        for tile in [0, 1] {
            assert_samples(&chunks, tile, SampleType::U16, u16s);
        }
    }
}

#[test]
fn every_data_type_is_read() {
    let floats = |samples: &Samples| -> Vec<u64> {
        match samples {
            Samples::F32(list) => list.iter().map(|&s| s.round() as u64).collect(),
            Samples::F16(list) => list.iter().map(|&s| f32::from(s).round() as u64).collect(),
            other => panic!("{other:?}"),
        }
    };
    let in_type = |id: u64, write: Write| {
        let chunks = replaced(plain(), 7, words(&[id]));
        replaced(chunks, 8, data([1, 2, 3, 4, 5], |at, out| write(sample(at), out)))
    };
    assert_samples(
        &in_type(1, |s, out| out.extend(f16::from_f32(s as f32).to_le_bytes())),
        0,
        SampleType::F16,
        floats,
    );
    assert_samples(&in_type(2, |s, out| out.extend((s as f32).to_le_bytes())), 0, SampleType::F32, floats);
    assert_samples(&in_type(3, |s, out| out.extend((s as f64).to_le_bytes())), 0, SampleType::F32, floats);
    let bytes = in_type(5, |s, out| out.push(s as u8));
    assert_samples(&bytes, 0, SampleType::U8, |samples| match samples {
        Samples::U8(list) => list.iter().map(|&s| s.into()).collect(),
        other => panic!("{other:?}"),
    });
    assert!(!open(&bytes, &Options::default()).unwrap().1.contents().linear);

    // Other whole numbers are fractions of their largest: here so many ten-thousandths, 16-bit ones so many times three.
    let wide: [(u64, Write, f64); 5] = [
        (6, |s, out| out.extend((s as i16 * 3).to_le_bytes()), 3.0 / 32767.0),
        (8, |s, out| out.extend(((s as f64 * 1e-4 * f64::from(i32::MAX)) as i32).to_le_bytes()), 1e-4),
        (9, |s, out| out.extend(((s as f64 * 1e-4 * f64::from(u32::MAX)) as u32).to_le_bytes()), 1e-4),
        (10, |s, out| out.extend(((s as f64 * 1e-4 * i64::MAX as f64) as i64).to_le_bytes()), 1e-4),
        (11, |s, out| out.extend(((s as f64 * 1e-4 * u64::MAX as f64) as u64).to_le_bytes()), 1e-4),
    ];
    for (id, write, one) in wide {
        assert_samples(&in_type(id, write), 1, SampleType::F32, |samples| {
            samples.to_f32().iter().map(|&s| (f64::from(s) / one).round() as u64).collect()
        });
    }
    let (bytes, big) = open(&in_type(4, |s, out| out.push((s % 200) as u8)), &Options::default()).unwrap();
    let found = big.read_images(&bytes, 0, 0..1).unwrap();
    assert_eq!(found.to_f32()[0], 1.0 / 127.0);

    let error = refusal(&replaced(plain(), 7, words(&[12])), &Options::default());
    assert_eq!(error.kind(), ErrorKind::Unsupported, "{error}");
    let error = refusal(&replaced(plain(), 7, words(&[13])), &Options::default());
    assert_eq!(error.kind(), ErrorKind::Malformed, "{error}");
}

#[test]
fn images_may_be_of_different_types() {
    let chunks = replaced(plain(), 7, words(&[0, 2, 7, 7, 2, 3, 7]));
    let chunks = replaced(
        chunks,
        8,
        data([1, 2, 3, 4, 5], |at, out| match at[0] {
            0 | 3 => out.extend((sample(at) as f32).to_le_bytes()),
            4 => out.extend((sample(at) as f64).to_le_bytes()),
            _ => out.extend((sample(at) as u16).to_le_bytes()),
        }),
    );
    let scale = |s: f32| if s < 1.0 { (s * 65535.0).round() as u64 } else { s.round() as u64 };
    assert_samples(&chunks, 1, SampleType::F32, |samples| samples.to_f32().into_iter().map(scale).collect());
    let error = refusal(&replaced(plain(), 7, words(&[0, 2, 7])), &Options::default());
    assert!(error.to_string().contains("one for each of 6"), "{error}");
}

#[test]
fn xyz_is_divided_by_its_white() {
    let chunks = replaced(plain(), 7, words(&[2]));
    let mut chunks =
        replaced(chunks, 8, data([1, 2, 3, 4, 5], |at, out| out.extend((sample(at) as f32).to_le_bytes())));
    chunks.push((9, b"CIE XYZ".to_vec()));
    chunks.push((12, b"cloth".to_vec()));
    chunks.push((11, doubles(&[21.5])));
    let (bytes, big) = open(&chunks, &Options::default()).unwrap();
    let contents = big.contents();
    assert_eq!(contents.channels, ["X", "Y", "Z"]);
    assert_eq!(
        contents.remarks[..2],
        [("name".to_owned(), "cloth".to_owned()), ("pixels per mm".to_owned(), "21.5".to_owned())]
    );
    assert!(contents.assumptions.iter().any(|text| text.contains("divided by 100")));
    assert_eq!(big.read_images(&bytes, 0, 0..1).unwrap().to_f32()[0], sample([0; 5]) as f32 / 100.0);
}

#[test]
fn directions_come_in_several_kinds() {
    let none = || plain().into_iter().filter(|(id, _)| *id != 16).collect::<Chunks>();
    let read = |chunks: &Chunks| {
        let (bytes, big) = open(chunks, &Options::default()).unwrap();
        (big.read_images(&bytes, 1, 0..3).unwrap(), big.contents().clone())
    };
    let (expected, contents) = read(&plain());

    // Radians are known by their size; real angles are taken where there are no ideal ones.
    let mut chunks = none();
    chunks.push((16, [words(&[1]), doubles(&[7.0; 24])].concat()));
    chunks.push(spherical(4, 1f64.to_radians()));
    let (found, other) = read(&chunks);
    assert_eq!(found, expected);
    assert!(
        other.assumptions.iter().any(|text| text.contains("real spherical") && text.contains("in radians"))
    );
    for (a, b) in contents.views.iter().zip(&other.views) {
        assert!((a.theta_rad - b.theta_rad).abs() + (a.phi_rad - b.phi_rad).abs() < 1e-12);
    }

    // The same as half and difference angles, worked out here by another road: rotations of the light.
    let half_difference: Vec<f64> =
        PAIRS.iter().flat_map(|&[tv, pv, ti, pi]| to_half_difference([ti, pi], [tv, pv])).collect();
    let mut chunks = none();
    chunks.push((16, [words(&[5]), doubles(&half_difference)].concat()));
    let (found, other) = read(&chunks);
    assert_eq!(found, expected);
    for (a, b) in contents.lights.iter().chain(&contents.views).zip(other.lights.iter().chain(&other.views)) {
        let distance: f64 = a.vector().iter().zip(b.vector()).map(|(a, b)| (a - b).abs()).sum();
        assert!(distance < 1e-9);
    }

    // Device angles say nothing without the device.
    let mut chunks = none();
    let error = refusal(&chunks, &Options::default());
    assert_eq!(error.kind(), ErrorKind::Unsupported, "{error}");
    chunks.push((16, [words(&[2]), doubles(&[7.0; 24])].concat()));
    assert_eq!(refusal(&chunks, &Options::default()).kind(), ErrorKind::Unsupported);
    chunks.push((16, [words(&[2]), doubles(&[7.0; 24])].concat()));
    assert!(refusal(&chunks, &Options::default()).to_string().contains("kind 2 twice"));

    for (wrong, part) in [(f64::NAN, "image 0"), (91.0, "image 0"), (-3.0, "image 0"), (60.0, "both of view")]
    {
        let mut angles: Vec<f64> = PAIRS.iter().flat_map(|[tv, pv, ti, pi]| [*ti, *pi, *tv, *pv]).collect();
        angles[0] = wrong;
        angles[1] = 120.0;
        let chunks = replaced(plain(), 16, [words(&[3]), doubles(&angles)].concat());
        let error = refusal(&chunks, &Options::default());
        assert!(error.to_string().contains(part), "{wrong}: {error}");
    }
    let mut angles: Vec<f64> = PAIRS.iter().flat_map(|[tv, pv, ti, pi]| [*ti, *pi, *tv, *pv]).collect();
    angles[0] = 30.0;
    let error =
        refusal(&replaced(plain(), 16, [words(&[3]), doubles(&angles)].concat()), &Options::default());
    assert!(error.to_string().contains("none of view (15, 30), light (0, 0)"), "{error}");
}

/// Half and difference angles in degrees of a light and a view in degrees, by matrices.
fn to_half_difference(light: [f64; 2], view: [f64; 2]) -> [f64; 4] {
    let vector = |[theta, phi]: [f64; 2]| {
        let (theta, phi) = (theta.to_radians(), phi.to_radians());
        [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()]
    };
    let (l, v) = (vector(light), vector(view));
    let sum = [l[0] + v[0], l[1] + v[1], l[2] + v[2]];
    let length = (sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]).sqrt();
    let (theta, phi) = ((sum[2] / length).acos(), sum[1].atan2(sum[0]));
    let turned = [phi.cos() * l[0] + phi.sin() * l[1], phi.cos() * l[1] - phi.sin() * l[0], l[2]];
    let d = [
        theta.cos() * turned[0] - theta.sin() * turned[2],
        turned[1],
        theta.sin() * turned[0] + theta.cos() * turned[2],
    ];
    [theta, phi, d[2].clamp(-1.0, 1.0).acos(), d[1].atan2(d[0])].map(f64::to_degrees)
}

/// Images of one grey pixel, their number its value.
fn document_of(images: u64) -> Chunks {
    let data = (0..images).flat_map(|image| (image as u16).to_le_bytes()).collect();
    let mut chunks: Chunks = [(1, images), (3, 1), (4, 1), (7, 7)].map(|(id, n)| (id, words(&[n]))).to_vec();
    chunks.push((8, data));
    chunks
}

/// As the library writes: other ids, a chunk for each image with its number and type, padded.
fn library_of(images: u64) -> Chunks {
    let mut chunks: Chunks = [(1, images), (2, 1), (3, 1), (4, 1)].map(|(id, n)| (id, words(&[n]))).to_vec();
    chunks.push((5, words(&[1, 2, 3, 4])));
    // In any order of images.
    for image in (0..images).rev() {
        chunks.push((6, [words(&[image, 2]), (image as u16).to_le_bytes().to_vec()].concat()));
    }
    chunks.push((7, b"<MyRoot/>\0".to_vec()));
    chunks
}

#[test]
fn the_caller_may_know_the_order_in_either_dialect() {
    for dialect in [document_of, library_of] {
        let (bytes, big) = open(&dialect(6561), &ordered(Order::Ubo81)).unwrap();
        let contents = big.contents();
        assert_eq!((contents.views.len(), contents.lights.len()), (81, 81));
        assert_eq!(contents.channels, ["Y"]);
        assert!(contents.assumptions.iter().any(|text| text.contains("as the caller said")));
        // View 8 is (30, 30), light 80 is (75, 345).
        assert!((contents.views[8].theta_rad.to_degrees() - 30.0).abs() < 1e-9);
        let found = big.read_images(&bytes, 8, 79..81).unwrap();
        assert_eq!(u16s(&found), [81 * 8 + 79, 81 * 8 + 80]);

        let (bytes, big) = open(&dialect(3660), &ordered(Order::Uniform)).unwrap();
        assert_eq!((big.contents().views.len(), big.contents().lights.len()), (60, 61));
        assert_eq!(u16s(&big.read_images(&bytes, 59, 60..61).unwrap()), [3659]);

        // Nothing is guessed, and nothing is bent.
        let error = refusal(&dialect(6561), &Options::default());
        assert_eq!(error.kind(), ErrorKind::Unsupported, "{error}");
        let error = refusal(&dialect(6560), &ordered(Order::Ubo81));
        assert_eq!(error.kind(), ErrorKind::Argument, "{error}");
    }
    assert_eq!(refusal(&plain(), &ordered(Order::Ubo81)).kind(), ErrorKind::Argument);
    assert_eq!(refusal(&plain(), &tile(2)).kind(), ErrorKind::Argument);
}

#[test]
fn what_the_library_cannot_have_written_is_refused() {
    type Change = fn(&mut Chunks);
    let cases: [(&str, Change); 6] = [
        ("a second time", |chunks| chunks[5].1[..8].copy_from_slice(&words(&[0]))),
        ("image 9000 of 6561", |chunks| chunks[5].1[..8].copy_from_slice(&words(&[9000]))),
        ("data type 12", |chunks| chunks[5].1[8..16].copy_from_slice(&words(&[12]))),
        ("6 of 32 bytes", |chunks| chunks[5].1 = words(&[0, 2, 0, 0])),
        ("6560 chunks 6", |chunks| drop(chunks.remove(7))),
        ("another data order", |chunks| chunks[4].1 = words(&[4, 2, 3, 1])),
    ];
    for (part, change) in cases {
        let mut chunks = library_of(6561);
        change(&mut chunks);
        let error = refusal(&chunks, &ordered(Order::Ubo81));
        assert!(error.to_string().contains(part), "{part}: {error}");
    }
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    let whole = big_file(&plain());
    for end in 0..whole.len() {
        assert!(
            Big::open(&whole[..end], &Options::default(), &Limits::default()).is_err(),
            "{end} of {}",
            whole.len()
        );
    }
    let mut longer = whole;
    longer.push(0);
    assert!(Big::open(&longer, &Options::default(), &Limits::default()).is_err());
}

#[test]
fn a_flipped_bit_never_panics() {
    let mut chunks = plain();
    chunks.insert(3, (6, words(&[1, 2, 3, 4, 5])));
    let whole = big_file(&chunks);
    let mut read = 0;
    for bit in 0..whole.len() * 8 {
        let mut flipped = whole.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        if let Ok(big) = Big::open(&flipped, &Options::default(), &Limits::default()) {
            let lights = big.contents().lights.len();
            let images = big.read_images(&flipped, 0, 0..lights).unwrap();
            assert!(images.len() <= 8 * flipped.len());
            read += 1;
        }
    }
    // All samples, and many digits of the angles, mean something else and are read all the same.
    assert!(read > 8 * 2 * 6 * 36 && read < 8 * whole.len());
}

#[test]
fn nonsense_is_refused_with_a_reason() {
    let with = |id: u64, numbers: &[u64]| replaced(plain(), id, words(numbers));
    let cases: [(Chunks, &str); 14] = [
        (with(1, &[4_000_000_000]), "4000000000 images"),
        (with(1, &[u64::MAX]), "images"),
        (with(1, &[0]), "0 images"),
        (with(1, &[5]), "432 bytes of data"),
        (with(2, &[1 << 63]), "tiles"),
        (with(3, &[1 << 31]), "max_pixels_per_image"),
        (with(4, &[0]), "0 x 2"),
        (with(5, &[1 << 40]), "max_channels"),
        (with(3, &[1, 2]), "a chunk 3 of 16 bytes"),
        (with(7, &[]), "a chunk 7 of 0 bytes"),
        (with(16, &[3, 0, 0]), "a chunk 16 of 24 bytes"),
        ([plain(), vec![(8, vec![0; 8])]].concat(), "a second chunk 8"),
        ([plain(), vec![(6, words(&[1, 2, 3, 4, 4]))]].concat(), "a data order"),
        ([plain(), vec![(6, words(&[1, 2, 3, 4, 5, 5]))]].concat(), "a data order"),
    ];
    for (chunks, part) in cases {
        let error = refusal(&chunks, &Options::default());
        assert!(error.to_string().contains(part), "{part}: {error}");
        assert_ne!(error.kind(), ErrorKind::Argument, "{error}");
    }
    // Outermost columns, four billion of them, all of another type.
    let mut chunks = with(4, &[4_000_000_000]);
    chunks.push((6, words(&[4, 1, 2, 3, 5])));
    let bytes = big_file(&replaced(chunks, 3, words(&[1])));
    let mut limits = Limits::default();
    limits.max_pixels_per_image = u64::MAX;
    assert_eq!(Big::open(&bytes, &Options::default(), &limits).unwrap_err().kind(), ErrorKind::Malformed);

    for (length, part) in [(4, "a multiple of 8"), (1 << 62, "are left"), (u64::MAX, "are left")] {
        let bytes = [big_file(&[]), words(&[99, length]), vec![0; 4]].concat();
        let error = Big::open(&bytes, &Options::default(), &Limits::default()).unwrap_err();
        assert!(error.to_string().contains(part) && error.offset() == Some(8), "{length}: {error}");
    }
    // Chunks that nobody knows are passed over.
    assert!(open(&[plain(), vec![(99, vec![1; 24])]].concat(), &Options::default()).is_ok());
}

#[test]
fn requests_that_cannot_be_met_are_refused() {
    let (bytes, big) = open(&plain(), &Options::default()).unwrap();
    for (view, lights, bytes) in [(2, 0..1, &bytes[..]), (0, 2..4, &bytes), (0, 0..1, &bytes[1..])] {
        assert_eq!(big.read_images(bytes, view, lights).unwrap_err().kind(), ErrorKind::Argument);
    }
    let mut limits = Limits::default();
    limits.max_decoded_bytes = 2 * 3 * 3 * 2;
    let big = Big::open(&bytes, &Options::default(), &limits).unwrap();
    assert_eq!(big.read_images(&bytes, 0, 1..2).unwrap().len(), 18);
    assert_eq!(big.read_images(&bytes, 0, 1..3).unwrap_err().kind(), ErrorKind::Limit);
}
