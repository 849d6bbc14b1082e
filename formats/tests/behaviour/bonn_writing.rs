//! The writer of Bonn containers against files put together field by field.

use btfkit_formats::bonn::{ColorModel, Description, Scalar, Writer};
use btfkit_formats::{Direction, ErrorKind, Images};

use crate::bonn_reading::open;
use crate::bonn_support::{Btf, directions, names};

const SCALARS: [(Scalar, u8); 3] = [(Scalar::F16, 2), (Scalar::F32, 4), (Scalar::F64, 8)];

fn description(btf: &Btf) -> Description {
    let list = |angles: &[(f32, f32)]| {
        let direction =
            |&(theta, phi): &(f32, f32)| Direction { theta_rad: theta.into(), phi_rad: phi.into() };
        angles.iter().map(direction).collect()
    };
    Description {
        measurement_setup: "dome".to_owned(),
        image_sensor: String::new(),
        light_source: "flash".to_owned(),
        pixels_per_mm: 12.5,
        cosine_included: btf.cosine == 1,
        channels: btf.channels.clone(),
        views: list(&btf.views),
        lights: list(&btf.lights),
        width: btf.width,
        height: btf.height,
    }
}

/// All scalars of a DFMF file, or of an FMF file if the channels share the right matrix, in order.
fn scalars(btf: &Btf, shared: bool) -> Vec<f64> {
    let (channels, mut values) = (btf.channels.len(), Vec::new());
    for product in 0..if shared { 1 } else { channels } {
        for view in 0..btf.views.len() {
            for light in 0..btf.lights.len() {
                for channel in if shared { 0..channels } else { product..product + 1 } {
                    values.extend((0..btf.rank).map(|k| btf.left(view, light, channel, k)));
                }
            }
        }
        for pixel in 0..btf.pixels() {
            values.extend((0..btf.rank).map(|k| btf.right(pixel, product, k)));
        }
    }
    values
}

/// The file, pushed in pieces of a size.
fn write(mut writer: Writer<Vec<u8>>, values: &[f64], piece: usize) -> Vec<u8> {
    for values in values.chunks(piece) {
        writer.push(values).unwrap();
    }
    writer.finish().unwrap()
}

#[test]
fn files_are_those_that_the_format_asks_for() {
    for cosine in [0, 1] {
        let spectral = Btf { channels: names(&["400", "410", "420.5", "1000"]), ..Btf::medium() };
        for btf in [Btf { cosine, ..Btf::small() }, Btf { cosine, ..spectral }] {
            let description = description(&btf);
            let ones = vec![1.0; btf.rank];
            let lists = vec![ones.clone(); btf.channels.len()];
            for (scalar, size) in SCALARS {
                for piece in [1, 7, usize::MAX] {
                    for (model, code) in [(ColorModel::Rgb, 0), (ColorModel::LogYRatios, 11)] {
                        if code == 11 && btf.channels.len() != 3 {
                            continue;
                        }
                        let writer = Writer::dfmf(Vec::new(), &description, scalar, &model, &lists).unwrap();
                        let written = write(writer, &scalars(&btf, false), piece);
                        let expected = [btf.head("!DFMF08FCR", true), btf.dfmf(size, code, false)].concat();
                        assert!(written == expected, "DFMF {scalar:?}, pieces of {piece}");
                    }
                    let writer = Writer::fmf(Vec::new(), &description, scalar, &ones, false).unwrap();
                    let written = write(writer, &scalars(&btf, true), piece);
                    let expected = [btf.head("!FMF06FCR", true), btf.fmf(size, false)].concat();
                    assert!(written == expected, "FMF {scalar:?}, pieces of {piece}");
                    let writer = Writer::fmf(Vec::new(), &description, scalar, &ones, true).unwrap();
                    let written = write(writer, &scalars(&btf, true), piece);
                    let extension = vec![1, 1, 0, 0, 0];
                    let expected = [btf.head("!FMF12FCER", true), extension, btf.fmf(size, false)].concat();
                    assert!(written == expected, "FMF of logarithms, {scalar:?}, pieces of {piece}");
                }
            }
        }
    }
}

#[test]
fn channels_may_differ_in_rank() {
    let btf = Btf { views: directions(1), lights: directions(1), width: 2, height: 1, ..Btf::small() };
    let lists = [vec![1.0], vec![2.0, 1.0], vec![3.0, 2.0, 1.0]];
    let writer = Writer::dfmf(Vec::new(), &description(&btf), Scalar::F32, &ColorModel::Rgb, &lists).unwrap();
    let values = [
        &[2.0, 10.0, 11.0][..],
        &[1.0, 0.5, 1.0, 2.0, 3.0, 4.0],
        &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
    ];
    let bytes = write(writer, &values.concat(), 4);
    let archive = open(&bytes);
    assert_eq!(archive.contents().format, "Bonn DFMF, f32, rank 1 + 2 + 3");
    let read = archive.read_images(&bytes, 0, 0..1).unwrap().to_f32();
    assert_eq!(read, [20.0, 2.0, 32.0, 22.0, 5.0, 50.0]);
}

#[test]
fn values_that_a_scalar_cannot_hold_are_refused() {
    let btf = Btf::small();
    let pushed = |scalar, value| {
        let mut writer =
            Writer::fmf(Vec::new(), &description(&btf), scalar, &vec![1.0; btf.rank], false).unwrap();
        writer.push(&[0.0, value]).map_err(|error| error.kind())
    };
    for (scalar, most) in
        [(Scalar::F16, 65504.0), (Scalar::F32, f64::from(f32::MAX)), (Scalar::F64, f64::MAX)]
    {
        for value in [most, -most, 0.0] {
            assert_eq!(pushed(scalar, value), Ok(()), "{scalar:?} {value}");
        }
        for value in [f64::NAN, f64::INFINITY, -f64::INFINITY] {
            assert_eq!(pushed(scalar, value), Err(ErrorKind::Argument), "{scalar:?} {value}");
        }
    }
    assert_eq!(pushed(Scalar::F16, 65520.0), Err(ErrorKind::Argument));
    assert_eq!(pushed(Scalar::F32, 1e39), Err(ErrorKind::Argument));
}

#[test]
fn a_file_has_as_many_values_as_it_says() {
    let btf = Btf::small();
    let values = scalars(&btf, true);
    let start =
        || Writer::fmf(Vec::new(), &description(&btf), Scalar::F16, &vec![1.0; btf.rank], false).unwrap();
    let mut short = start();
    short.push(&values[1..]).unwrap();
    assert_eq!(short.finish().unwrap_err().kind(), ErrorKind::Argument);
    let mut long = start();
    long.push(&values).unwrap();
    assert_eq!(long.push(&[0.0]).unwrap_err().kind(), ErrorKind::Argument);
    // A DFMF file that lacks its last channels.
    let lists = vec![vec![1.0; btf.rank]; 3];
    let mut writer =
        Writer::dfmf(Vec::new(), &description(&btf), Scalar::F16, &ColorModel::Rgb, &lists).unwrap();
    writer.push(&scalars(&btf, false)[..(6 + 8) * 2]).unwrap();
    assert!(writer.finish().unwrap_err().to_string().contains("56 more"));
}

#[test]
fn what_the_format_cannot_hold_is_refused() {
    let good = description(&Btf::small());
    let refused = |change: &dyn Fn(&mut Description)| {
        let mut description = good.clone();
        change(&mut description);
        Writer::fmf(Vec::new(), &description, Scalar::F16, &[1.0], false).unwrap_err().kind()
    };
    assert!(Writer::fmf(Vec::new(), &good, Scalar::F16, &[1.0], false).is_ok());
    let changes: [&dyn Fn(&mut Description); 8] = [
        &|d| d.measurement_setup = "x".repeat(81),
        &|d| d.views.clear(),
        &|d| d.lights.clear(),
        &|d| d.channels.clear(),
        &|d| d.width = 0,
        &|d| (d.width, d.height) = (1 << 16, 1 << 16),
        &|d| d.views[0].theta_rad = -0.5,
        &|d| d.lights[0].phi_rad = f64::NAN,
    ];
    for change in changes {
        assert_eq!(refused(change), ErrorKind::Argument);
    }
    let dfmf = |model: &ColorModel, lists: &[Vec<f64>]| {
        Writer::dfmf(Vec::new(), &good, Scalar::F16, model, lists).map(drop).map_err(|e| e.kind())
    };
    let lists = vec![vec![1.0]; 3];
    assert_eq!(dfmf(&ColorModel::Rgb, &lists), Ok(()));
    assert_eq!(dfmf(&ColorModel::Lab, &lists), Err(ErrorKind::Argument));
    assert_eq!(dfmf(&ColorModel::Rgb, &lists[1..]), Err(ErrorKind::Argument));
    assert_eq!(dfmf(&ColorModel::Rgb, &[vec![1.0], Vec::new(), vec![1.0]]), Err(ErrorKind::Argument));
    let two = Description { channels: names(&["a", "b"]), ..good.clone() };
    let refused = Writer::dfmf(Vec::new(), &two, Scalar::F16, &ColorModel::LogYRatios, &lists[1..]);
    assert_eq!(refused.unwrap_err().kind(), ErrorKind::Argument);
}

#[test]
fn files_that_others_cannot_open_are_known() {
    let square = Btf { lights: directions(2), ..Btf::small() };
    let obstacles = |btf: &Btf, scalar, rank| description(btf).obstacles_elsewhere(scalar, rank);
    assert_eq!(obstacles(&square, Scalar::F16, 100), Vec::<String>::new());
    assert_eq!(obstacles(&Btf::small(), Scalar::F16, 100).len(), 1);
    assert_eq!(obstacles(&Btf { channels: names(&["Y"]), ..Btf::small() }, Scalar::F16, 1).len(), 2);
    // The sets of the Bonn dome: 151 directions, 400 x 400 pixels.
    let dome = Btf { views: directions(31), lights: directions(31), width: 400, height: 400, ..square };
    assert!(obstacles(&dome, Scalar::F32, 2236).is_empty());
    assert_eq!(obstacles(&dome, Scalar::F32, 2237).len(), 1);
}

#[test]
fn a_failing_output_is_an_io_error() {
    let btf = Btf::small();
    let mut room = [0u8; 400];
    let output = std::io::Cursor::new(&mut room[..]);
    let started = Writer::fmf(output, &description(&btf), Scalar::F64, &vec![1.0; btf.rank], false);
    let pushed = started.and_then(|mut writer| writer.push(&scalars(&btf, true)));
    assert_eq!(pushed.unwrap_err().kind(), ErrorKind::Io);
}
