//! HDF5 archives: what is written is read back, and whatever else a file may be is an error.
//!
//! A program of its own: HDF5 locks the files that it has open, and a process that another test starts meanwhile would
//! inherit the lock and keep it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout)]

use std::os::unix::fs::FileExt;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::RwLock;
use std::time::{Duration, Instant};

use ::hdf5::filters::ScaleOffset;
use ::hdf5::types::{FixedAscii, VarLenUnicode};
use ::hdf5::{Dataset, File, Group, H5Type};
use btfkit::archive::hdf5::{Archive, Writer};
use btfkit::shape::{Size, Window};
use btfkit::{ErrorKind, Result};
use btfkit_formats::{ContainerKind, Contents, Direction, Limits, SampleType, Samples, f16};
use ndarray::{Array2, Array4, ArrayD};
use serde_json::{Map, json};

const SIZE: Size = Size { height: 19, width: 33 };

fn directions(count: usize) -> Vec<Direction> {
    (0..count).map(|n| Direction::from_degrees(7.0 * n as f64, 40.0 * n as f64)).collect()
}

fn contents(size: Size, views: usize, lights: usize, channels: &[&str], sample_type: SampleType) -> Contents {
    Contents {
        format: String::new(),
        width: size.width as u32,
        height: size.height as u32,
        channels: channels.iter().map(|name| (*name).to_owned()).collect(),
        sample_type,
        views: directions(views),
        lights: directions(lights),
        linear: !matches!(sample_type, SampleType::U8),
        cosine_included: !matches!(sample_type, SampleType::F16),
        assumptions: Vec::new(),
        remarks: Vec::new(),
    }
}

/// Samples of a view that differ everywhere.
fn view_samples(contents: &Contents, view: usize) -> Samples {
    let texels = (contents.width * contents.height) as usize;
    let count = texels * contents.lights.len() * contents.channels.len();
    let numbers = (0..count).map(|n| ((n + view * count) as u32).wrapping_mul(2_654_435_761) >> 8);
    match contents.sample_type {
        SampleType::U8 => Samples::U8(numbers.map(|n| n as u8).collect()),
        SampleType::U16 => Samples::U16(numbers.map(|n| n as u16).collect()),
        SampleType::F16 => Samples::F16(numbers.map(|n| f16::from_f32(n as f32 / 1e6)).collect()),
        SampleType::F32 => Samples::F32(numbers.map(|n| n as f32 / 1e6).collect()),
    }
}

/// A slice of samples.
fn pick(samples: &Samples, places: impl Iterator<Item = usize>) -> Samples {
    match samples {
        Samples::U8(list) => Samples::U8(places.map(|n| list[n]).collect()),
        Samples::U16(list) => Samples::U16(places.map(|n| list[n]).collect()),
        Samples::F16(list) => Samples::F16(places.map(|n| list[n]).collect()),
        Samples::F32(list) => Samples::F32(places.map(|n| list[n]).collect()),
    }
}

fn write(path: &Path, contents: &Contents, luminance: bool) {
    // A writer replaces nothing.
    if path.exists() {
        std::fs::remove_file(path).unwrap();
    }
    let attributes =
        json!({"white": 0.75, "version": "0.1", "recipe": {"stage": "import", "views": [[0.5, 1]]}});
    let mut writer = Writer::create(path, contents, attributes.as_object().unwrap()).unwrap();
    let codes = vec![7; (contents.width * contents.height) as usize * contents.lights.len()];
    for view in 0..contents.views.len() {
        writer
            .write_view(view, &view_samples(contents, view), luminance.then_some(codes.as_slice()))
            .unwrap();
    }
    writer.finish().unwrap();
}

fn open(path: &Path) -> Result<Archive> {
    Archive::open(path, &Limits::default())
}

/// Held while a test has files open, so that no process is started which would inherit them and their locks.
static FILES: RwLock<()> = RwLock::new(());

/// The message of an error that must be one of the input.
fn refused(path: &Path) -> String {
    let Err(error) = open(path) else { panic!("{} is read", path.display()) };
    assert_eq!(error.kind(), ErrorKind::Input, "{error}");
    assert!(error.to_string().contains(&path.display().to_string()), "{error}");
    error.to_string()
}

#[test]
fn what_is_written_is_read_back_for_every_type() {
    let _files = FILES.read();
    let folder = tempfile::tempdir().unwrap();
    for (sample_type, channels) in [
        (SampleType::U8, &["R", "G", "B"][..]),
        (SampleType::U16, &["Y"][..]),
        (SampleType::F16, &["X", "Y", "Z"][..]),
        (SampleType::F32, &["400", "500", "600", "700.5"][..]),
    ] {
        let path = folder.path().join(sample_type.name());
        let contents = contents(SIZE, 3, 5, channels, sample_type);
        write(&path, &contents, sample_type == SampleType::U8);
        assert_eq!(ContainerKind::recognise(&std::fs::read(&path).unwrap()), Some(ContainerKind::Hdf5));
        let archive = open(&path).unwrap();
        let found = archive.contents();
        assert_eq!((found.width, found.height, &found.channels), (33, 19, &contents.channels));
        assert_eq!((&found.views, &found.lights), (&contents.views, &contents.lights));
        assert_eq!((found.linear, found.cosine_included), (contents.linear, contents.cosine_included));
        assert_eq!(found.sample_type, sample_type);
        assert!(found.remarks.contains(&("white".to_owned(), "0.75".to_owned())), "{:?}", found.remarks);
        let recipe = ("recipe".to_owned(), r#"{"stage":"import","views":[[0.5,1]]}"#.to_owned());
        assert!(found.remarks.contains(&recipe), "{:?}", found.remarks);

        let (n, lights) = (channels.len(), 5);
        let whole = view_samples(&contents, 2);
        assert_eq!(archive.read_view(2, SIZE.window()).unwrap(), whole);
        let window = Window { y: 3, x: 14, size: Size::new(14, 5) };
        let places = (3..17).flat_map(|y| (14..19).map(move |x| y * 33 + x));
        let part = places.flat_map(|texel| texel * lights * n..(texel + 1) * lights * n);
        assert_eq!(archive.read_view(2, window).unwrap(), pick(&whole, part));
        let images = (1..4).flat_map(|light| {
            (0..SIZE.texels()).flat_map(move |texel| (0..n).map(move |c| (texel * lights + light) * n + c))
        });
        assert_eq!(archive.read_images(2, 1..4).unwrap(), pick(&whole, images));
    }
}

#[test]
fn one_archive_serves_several_threads() {
    let _files = FILES.read();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    let contents = contents(SIZE, 6, 3, &["Y"], SampleType::U16);
    write(&path, &contents, false);
    let archive = open(&path).unwrap();
    std::thread::scope(|scope| {
        for view in 0..6 {
            let (archive, truth) = (&archive, view_samples(&contents, view));
            scope.spawn(move || assert_eq!(archive.read_view(view, SIZE.window()).unwrap(), truth));
        }
    });
}

#[test]
fn what_there_is_none_of_is_an_error_and_not_a_panic() {
    let _files = FILES.read();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    write(&path, &contents(SIZE, 2, 3, &["Y"], SampleType::U8), false);
    let archive = open(&path).unwrap();
    assert!(archive.read_images(2, 0..1).is_err());
    assert!(archive.read_images(0, 2..4).is_err());
    assert!(archive.read_view(0, Window { y: 10, x: 0, size: Size::new(10, 1) }).is_err());
    assert!(archive.read_view(0, Window { y: usize::MAX, x: 0, size: Size::new(1, 1) }).is_err());
    let mut limits = Limits::default();
    limits.max_decoded_bytes = 1000;
    let archive = Archive::open(&path, &limits).unwrap();
    assert!(archive.read_view(0, SIZE.window()).unwrap_err().to_string().contains("1881 bytes"));
}

#[test]
fn a_file_appears_whole_or_not_at_all() {
    let _files = FILES.read();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    let contents = contents(SIZE, 2, 3, &["Y"], SampleType::U8);
    let begun = || Writer::create(&path, &contents, &Map::new()).unwrap();
    let files = || std::fs::read_dir(folder.path()).unwrap().count();
    let mut writer = begun();
    writer.write_view(0, &view_samples(&contents, 0), None).unwrap();
    assert_eq!((path.exists(), files()), (false, 1));
    assert!(writer.finish().unwrap_err().to_string().contains("samples of 1 view"));
    assert_eq!(files(), 0);

    let mut writer = begun();
    let codes = vec![0; SIZE.texels() * 3];
    writer.write_view(0, &view_samples(&contents, 0), Some(&codes)).unwrap();
    writer.write_view(1, &view_samples(&contents, 1), None).unwrap();
    assert!(writer.finish().is_err());

    let mut writer = begun();
    let short = Samples::U8(vec![0; SIZE.texels() * 3 - 1]);
    let other = Samples::U16(vec![0; SIZE.texels() * 3]);
    assert!(writer.write_view(0, &short, None).is_err());
    assert!(writer.write_view(0, &other, None).is_err());
    assert!(writer.write_view(2, &view_samples(&contents, 1), None).is_err());
    drop(writer);
    let long = json!({"recipe": "x".repeat(60_001)});
    assert!(Writer::create(&path, &contents, long.as_object().unwrap()).is_err());
    assert_eq!(files(), 0);
}

#[test]
fn integers_of_fewer_bits_than_their_type_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    let contents = contents(Size::new(16, 16), 1, 2, &["Y"], SampleType::U16);
    write(&path, &contents, false);
    assert!(open(&path).unwrap().contents().assumptions.is_empty());
    // A type message of unsigned 16-bit integers: size 2, offset 0, precision 16.
    let mut bytes = std::fs::read(&path).unwrap();
    let message = [0x10, 0, 0, 0, 2, 0, 0, 0, 0, 0, 16, 0];
    let places: Vec<usize> = (0..bytes.len() - 12).filter(|&at| bytes[at..at + 12] == message).collect();
    assert!(!places.is_empty());
    places.into_iter().for_each(|at| bytes[at + 10] = 12);
    sum_headers_again(&mut bytes);
    std::fs::write(&path, bytes).unwrap();
    let found = open(&path).unwrap();
    assert!(found.contents().assumptions[0].contains("precision of reflectance"));
}

/// Writes the checksums of all object headers of version 2 anew: signature, version, flags, times and limits where the
/// flags say so, the length of the messages, the messages, the checksum.
fn sum_headers_again(bytes: &mut [u8]) {
    let starts: Vec<usize> =
        (0..bytes.len() - 16).filter(|&at| bytes[at..].starts_with(b"OHDR\x02")).collect();
    for start in starts {
        let flags = bytes[start + 5];
        let skipped = if flags & 0x20 != 0 { 16 } else { 0 } + if flags & 0x10 != 0 { 4 } else { 0 };
        let (at, width) = (start + 6 + skipped, 1 << (flags & 3));
        let length =
            bytes[at..at + width].iter().rev().fold(0, |length, &byte| length << 8 | usize::from(byte));
        let end = at + width + length;
        let sum = lookup3(&bytes[start..end]);
        bytes[end..end + 4].copy_from_slice(&sum.to_le_bytes());
    }
}

/// Bob Jenkins' hash that HDF5 sums its metadata with (`hashlittle` of lookup3.c, from 0).
fn lookup3(bytes: &[u8]) -> u32 {
    let mut state = [0xdead_beef_u32.wrapping_add(bytes.len() as u32); 3];
    let blocks = bytes.len().div_ceil(12);
    for (number, block) in bytes.chunks(12).enumerate() {
        let mut padded = [0; 12];
        padded[..block.len()].copy_from_slice(block);
        for (word, four) in state.iter_mut().zip(padded.chunks_exact(4)) {
            *word = word.wrapping_add(u32::from_le_bytes([four[0], four[1], four[2], four[3]]));
        }
        let [mut a, mut b, mut c] = state;
        if number + 1 < blocks {
            for turns in [[4, 6, 8], [16, 19, 4]] {
                a = a.wrapping_sub(c) ^ c.rotate_left(turns[0]);
                c = c.wrapping_add(b);
                b = b.wrapping_sub(a) ^ a.rotate_left(turns[1]);
                a = a.wrapping_add(c);
                c = c.wrapping_sub(b) ^ b.rotate_left(turns[2]);
                b = b.wrapping_add(a);
            }
        } else {
            for (turns, last) in [([14, 11, 25], false), ([16, 4, 14], false), ([24, 0, 0], true)] {
                c = (c ^ b).wrapping_sub(b.rotate_left(turns[0]));
                if last {
                    break;
                }
                a = (a ^ c).wrapping_sub(c.rotate_left(turns[1]));
                b = (b ^ a).wrapping_sub(a.rotate_left(turns[2]));
            }
        }
        state = [a, b, c];
    }
    state[2]
}

/// A list of images in an order of its own, as h5py leaves it without being asked for anything.
fn image_list(path: &Path, views: usize, lights: usize) -> File {
    image_list_as(path, views, lights, |file, color| dataset(file, "ground_color", color))
}

/// The same with samples written by `write`.
fn image_list_as(
    path: &Path,
    views: usize,
    lights: usize,
    write: impl Fn(&File, &ArrayD<f32>) -> Dataset,
) -> File {
    let xy = |d: &Direction| d.vector();
    let pairs: Vec<(usize, usize)> =
        (0..lights).flat_map(|l| (0..views).rev().map(move |v| (v, l))).collect();
    let of = |pick: &dyn Fn(&(usize, usize)) -> Direction| {
        let list: Vec<f32> = pairs
            .iter()
            .flat_map(|p| xy(&pick(p))[..2].iter().map(|&c| c as f32).collect::<Vec<_>>())
            .collect();
        Array2::from_shape_vec((pairs.len(), 2), list).unwrap()
    };
    let file = File::create(path).unwrap();
    let (view_list, light_list) = (directions(views), directions(lights));
    dataset(&file, "ground_camera_dir", &of(&|p| view_list[p.0]).into_dyn());
    dataset(&file, "ground_light", &of(&|p| light_list[p.1]).into_dyn());
    let color = Array4::from_shape_fn((pairs.len(), 4, 6, 3), |(n, y, x, c)| {
        (pairs[n].0 * 10_000 + pairs[n].1 * 1000 + y * 100 + x * 10 + c) as f32
    });
    write(&file, &color.into_dyn());
    file
}

fn dataset<T: H5Type>(group: &Group, name: &str, data: &ArrayD<T>) -> Dataset {
    group.new_dataset_builder().with_data(data).create(name).unwrap()
}

#[test]
fn a_list_of_images_in_any_order_is_read_as_views_and_lights() {
    let _files = FILES.read();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("real_felt_full_factor1.hdf5");
    drop(image_list(&path, 3, 4));
    let archive = open(&path).unwrap();
    let contents = archive.contents();
    assert_eq!((contents.width, contents.height, contents.sample_type), (6, 4, SampleType::F32));
    assert_eq!((contents.views.len(), contents.lights.len(), contents.linear), (3, 4, true));
    // Views in the order in which they are met: the last first.
    let theta: Vec<i64> = contents.views.iter().map(|d| d.theta_rad.to_degrees().round() as i64).collect();
    assert_eq!(theta, [14, 7, 0]);
    let value = |v: usize, l: usize, y: usize, x: usize, c: usize| {
        ((2 - v) * 10_000 + l * 1000 + y * 100 + x * 10 + c) as f32
    };
    let images: Vec<f32> = (1..3)
        .flat_map(|l| {
            (0..4).flat_map(move |y| (0..6).flat_map(move |x| (0..3).map(move |c| value(1, l, y, x, c))))
        })
        .collect();
    assert_eq!(archive.read_images(1, 1..3).unwrap(), Samples::F32(images));
    let window = Window { y: 2, x: 1, size: Size::new(2, 3) };
    let texels: Vec<f32> = (2..4)
        .flat_map(|y| {
            (1..4).flat_map(move |x| (0..4).flat_map(move |l| (0..3).map(move |c| value(0, l, y, x, c))))
        })
        .collect();
    assert_eq!(archive.read_view(0, window).unwrap(), Samples::F32(texels));
}

#[test]
fn a_list_of_images_with_holes_or_with_directions_for_every_pixel_is_refused() {
    let _files = FILES.read();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("random.hdf5");
    let replace = |name: &str, data: ArrayD<f32>| {
        let file = image_list(&path, 3, 4);
        file.unlink(name).unwrap();
        dataset(&file, name, &data);
        drop(file);
        refused(&path)
    };
    let mut lights = Array2::<f32>::zeros((12, 2)).into_dyn();
    lights[[11, 0]] = 0.5;
    let told = replace("ground_light", lights);
    assert!(
        told.contains("3 views and 2 lights: of 6 pairs 2 missing, and 8 images of a pair that another has"),
        "{told}"
    );
    let told = replace("ground_camera_dir", ArrayD::zeros(vec![12, 4, 6, 2]));
    assert!(told.contains("near-field"), "{told}");
    let told = replace("ground_light", ArrayD::zeros(vec![11, 2]));
    assert!(told.contains("expected [12, 2]"), "{told}");
    let told = replace("ground_color", ArrayD::zeros(vec![12, 4, 6, 4]));
    assert!(told.contains("4 channels"), "{told}");
    let told = replace("ground_color", ArrayD::zeros(vec![12, 4, 6]));
    assert!(told.contains("expected [image, y, x, channel]"), "{told}");
    let file = image_list(&path, 3, 4);
    file.unlink("ground_light").unwrap();
    drop(file);
    assert!(refused(&path).contains("no dataset ground_light"));
}

/// A measurement to be spoilt.
fn small(path: &Path) -> File {
    write(path, &contents(Size::new(4, 4), 2, 3, &["Y"], SampleType::U8), false);
    File::open_rw(path).unwrap()
}

#[test]
fn attributes_that_do_not_fit_are_refused() {
    let _files = FILES.read();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    let with = |spoil: &dyn Fn(&File)| {
        let file = small(&path);
        spoil(&file);
        drop(file);
        refused(&path)
    };
    let told = with(&|file| file.delete_attr("kind").unwrap());
    assert!(told.contains("attribute kind"), "{told}");
    let told = with(&|file| file.attr("format").unwrap().write_scalar(&2i64).unwrap());
    assert!(told.contains("format: got 2, expected 1"), "{told}");
    for name in ["kind", "transfer", "radiometry"] {
        let told = with(&|file| {
            file.delete_attr(name).unwrap();
            let text: VarLenUnicode = "linear".parse().unwrap();
            file.new_attr::<VarLenUnicode>().create(name).unwrap().write_scalar(&text).unwrap();
        });
        assert!(told.contains(name) && told.contains("fixed length"), "{told}");
    }
    let told = with(&|file| file.dataset("reflectance").unwrap().delete_attr("channels").unwrap());
    assert!(told.contains("reflectance: attribute channels"), "{told}");
    let told = with(&|file| {
        let directions = file.dataset("light_direction").unwrap();
        directions.write(&Array2::from_elem((3, 2), 2.0f64)).unwrap();
    });
    assert!(told.contains("light_direction: got theta 2"), "{told}");
}

#[test]
fn an_attribute_of_another_program_is_no_obstacle() {
    let _files = FILES.read();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    let file = small(&path);
    let note: VarLenUnicode = "seen".parse().unwrap();
    file.new_attr::<VarLenUnicode>().create("note").unwrap().write_scalar(&note).unwrap();
    drop(file);
    let names: Vec<String> =
        open(&path).unwrap().contents().remarks.iter().map(|(name, _)| name.clone()).collect();
    assert_eq!(names, ["recipe", "version", "white"]);
}

#[test]
fn data_that_lie_elsewhere_are_refused() {
    let _files = FILES.read();
    let folder = tempfile::tempdir().unwrap();
    let (path, other) = (folder.path().join("a.h5"), folder.path().join("other.h5"));
    drop(small(&other));
    let with = |make: &dyn Fn(&File)| {
        let file = small(&path);
        file.unlink("reflectance").unwrap();
        make(&file);
        drop(file);
        refused(&path)
    };
    let other_name = other.to_str().unwrap();
    let told = with(&|file| file.link_external(other_name, "reflectance", "reflectance").unwrap());
    assert!(told.contains("a link to another name or another file"), "{told}");
    let told = with(&|file| file.link_soft("/view_direction", "reflectance").unwrap());
    assert!(told.contains("a link to another name or another file"), "{told}");
    let told = with(&|file| drop(file.create_group("reflectance").unwrap()));
    assert!(told.contains("not a dataset"), "{told}");
    let told = with(&|file| {
        let builder = file.new_dataset::<u8>().shape([2, 4, 4, 3, 1]).no_chunk();
        builder.external("raw.bin", 0, 96).create("reflectance").unwrap();
    });
    assert!(told.contains("raw.bin"), "{told}");
    let told = with(&|file| {
        let builder = file.new_dataset::<u8>().shape([2, 4, 4, 3, 1]).no_chunk();
        let shape = [2, 4, 4, 3, 1];
        builder.virtual_map(other_name, "reflectance", shape, .., shape, ..).create("reflectance").unwrap();
    });
    assert!(told.contains("a view of other datasets"), "{told}");
}

#[test]
fn more_than_the_file_holds_is_refused_before_it_is_read() {
    let _files = FILES.read();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    let with = |make: &dyn Fn(&File)| {
        let file = small(&path);
        file.unlink("reflectance").unwrap();
        make(&file);
        drop(file);
        refused(&path)
    };
    const HUGE: usize = 1 << 30;
    let chunked = |shape: [usize; 5], chunk: [usize; 5]| {
        with(&|file| {
            let made = file.new_dataset::<u8>().shape(shape).chunk(chunk).deflate(1).create("reflectance");
            made.unwrap();
        })
    };
    let told = chunked([2, HUGE, HUGE, 3, 1], [1, 64, 64, 3, 1]);
    assert!(told.contains("chunks in a file of"), "{told}");
    let told = chunked([HUGE, HUGE, HUGE, 3, 1], [1, 64, 64, 3, 1]);
    assert!(told.contains("that can be held"), "{told}");
    let told = chunked([2, 4, 4, 3, 1], [1, 4, 4, 3, 1]);
    assert!(told.contains("got 0 chunks, expected 2"), "{told}");
    let told = chunked([2, HUGE, 4, 3, 1], [1, HUGE, 1, 1, 1]);
    assert!(told.contains("expected at most 268435456 bytes each"), "{told}");
    let told = with(&|file| {
        file.new_dataset::<u8>().shape([2, 4, 4, 3, 1]).no_chunk().create("reflectance").unwrap();
    });
    assert!(told.contains("got 0 bytes of data"), "{told}");
}

#[test]
fn other_types_and_other_filters_are_refused_by_name() {
    let _files = FILES.read();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    let file = small(&path);
    file.unlink("reflectance").unwrap();
    let made = dataset(&file, "reflectance", &ArrayD::<i32>::zeros(vec![2, 4, 4, 3, 1]));
    made.new_attr_builder()
        .with_data(&[FixedAscii::<1>::from_ascii("Y").unwrap()])
        .create("channels")
        .unwrap();
    drop((made, file));
    let told = refused(&path);
    assert!(told.contains("samples of type int32"), "{told}");

    let file = small(&path);
    file.unlink("reflectance").unwrap();
    let data = ArrayD::<u8>::zeros(vec![2, 4, 4, 3, 1]);
    let builder = file.new_dataset_builder().with_data(&data).chunk([1, 4, 4, 3, 1]);
    builder.scale_offset(ScaleOffset::Integer(4)).create("reflectance").unwrap();
    drop(file);
    let told = refused(&path);
    assert!(told.contains("the filter scale-offset"), "{told}");
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    let _files = FILES.read();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    drop(small(&path));
    let whole = std::fs::read(&path).unwrap();
    for end in (0..whole.len()).step_by(7).chain([whole.len() - 1]) {
        std::fs::write(&path, &whole[..end]).unwrap();
        refused(&path);
    }
}

/// Tells the process that [`flip_bits`] starts where its file is, and which flips it is to make.
const HARMED: &str = "BTFKIT_HARMED_HDF5";

/// Reads a file with one bit flipped, for every n-th bit. Run in a process of its own, since the C library may end it.
#[test]
#[ignore = "run by the tests of flipped bits"]
fn harmed() {
    let Ok(job) = std::env::var(HARMED) else { return };
    let job: Vec<&str> = job.split('|').collect();
    let (path, step) = (PathBuf::from(job[0]), job[2].parse().unwrap());
    let whole = std::fs::read(&path).unwrap();
    let truth = read_all(&path).unwrap();
    let log = std::fs::File::create(path.with_extension("log")).unwrap();
    let harmed = path.with_extension("harmed");
    for bit in (job[1].parse().unwrap()..whole.len() * 8).step_by(step) {
        log.write_all_at(format!("{bit:12}").as_bytes(), 0).unwrap();
        let mut bytes = whole.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        std::fs::write(&harmed, &bytes).unwrap();
        let outcome = match read_all(&harmed) {
            Err(_) => b"e",
            Ok(found) if found == truth => b"=",
            Ok(_) => b"x",
        };
        log.write_all_at(outcome, 16 + bit as u64).unwrap();
    }
    log.write_all_at(b"        done", 0).unwrap();
}

/// What a file says of itself, and all of its samples.
fn read_all(path: &Path) -> Result<(Contents, Vec<Samples>)> {
    let archive = open(path)?;
    let contents = archive.contents().clone();
    let lights = 0..contents.lights.len();
    let views = 0..contents.views.len();
    let samples: Result<Vec<Samples>> = views.map(|view| archive.read_images(view, lights.clone())).collect();
    Ok((contents, samples?))
}

/// What became of the readings of a file with one bit flipped.
#[derive(Debug, Default)]
struct Flips {
    errors: usize,
    unnoticed: usize,
    read_wrongly: usize,
    /// Bits that ended the process, and how it ended.
    ended: Vec<(usize, ExitStatus)>,
}

/// Flips every `step`-th bit of a file and reads it, in processes of their own; `BTFKIT_FLIP_EVERY` sets another step.
fn flip_bits(path: &Path, step: usize) -> Flips {
    let bits = std::fs::metadata(path).unwrap().len() as usize * 8;
    let step = std::env::var("BTFKIT_FLIP_EVERY").map_or(step, |n| n.parse().unwrap());
    let log = path.with_extension("log");
    let mut flips = Flips::default();
    let mut next = 0;
    while next < bits {
        let status = wait(&mut start_reader(path, next, step), &log);
        let log = std::fs::read(&log).unwrap();
        let count = |outcome| log.iter().skip(16).filter(|&&o| o == outcome).count();
        flips.errors += count(b'e');
        flips.unnoticed += count(b'=');
        flips.read_wrongly += count(b'x');
        let reached = String::from_utf8_lossy(&log[..12]).trim().to_owned();
        if reached == "done" {
            break;
        }
        let bit = reached.parse().unwrap();
        flips.ended.push((bit, status));
        next = bit + step;
    }
    println!("{} of {bits} bits flipped: {flips:?}", bits.div_ceil(step));
    flips
}

/// With no more memory than a small file can ask for.
fn start_reader(path: &Path, first: usize, step: usize) -> Child {
    let _no_files_open = FILES.write();
    Command::new("sh")
        .args(["-c", "ulimit -v 4000000; ulimit -c 0; exec \"$0\" --exact harmed --ignored"])
        .arg(std::env::current_exe().unwrap())
        .env(HARMED, format!("{}|{first}|{step}", path.display()))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Waits for a reader to end, and ends one that makes no progress.
fn wait(child: &mut Child, log: &Path) -> ExitStatus {
    let (mut size, mut since) = (None, Instant::now());
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        std::thread::sleep(Duration::from_millis(20));
        let found = std::fs::metadata(log).ok().map(|data| data.len());
        if found != size {
            (size, since) = (found, Instant::now());
        } else if since.elapsed() > Duration::from_secs(30) {
            child.kill().unwrap();
        }
    }
}

/// What is written here bears checksums throughout: whatever is flipped, an error or the truth.
#[test]
fn a_flipped_bit_of_what_is_written_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    {
        let _files = FILES.read();
        write(&path, &contents(Size::new(4, 4), 2, 3, &["Y"], SampleType::U8), false);
    }
    let flips = flip_bits(&path, 9);
    // What goes unnoticed is space that is not used, and names of dimensions, which are not read.
    assert!(flips.errors > 1000, "{flips:?}");
    assert!(flips.read_wrongly == 0 && flips.ended.is_empty(), "{flips:?}");
}

/// Files in HDF5's older layout have no checksums, and the C library believes what they say: here and there it ends the
/// process. Counted and printed, since only the library can mend it; no panic of ours, and no hang.
#[test]
fn a_flipped_bit_of_a_file_without_checksums_brings_down_nothing_but_the_c_library() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.hdf5");
    {
        let _files = FILES.read();
        drop(image_list_as(&path, 2, 2, |file, color| {
            let builder = file.new_dataset_builder().with_data(color).chunk([1, 4, 4, 3]);
            builder.shuffle().deflate(1).fletcher32().create("ground_color").unwrap()
        }));
    }
    let flips = flip_bits(&path, 19);
    assert!(flips.errors > 0 && flips.unnoticed > 0, "{flips:?}");
    let killed = |status: &ExitStatus| matches!(status.signal(), Some(signal) if signal != 9);
    assert!(flips.ended.iter().all(|(_, status)| killed(status)), "a panic or a hang: {flips:?}");
}
