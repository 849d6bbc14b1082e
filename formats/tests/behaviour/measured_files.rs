//! One view of a measured material, where its 81 files lie beside the checkout.

use std::fs;
use std::path::{Path, PathBuf};

use btfkit_formats::jpeg::{decode, header};
use btfkit_formats::ubo2003::{Catalogue, directions_81, parse_name};
use btfkit_formats::zip::{ZipIndex, ZipWriter};
use btfkit_formats::{ErrorKind, Limits};

fn files_below(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files_below(&path, files);
        } else {
            files.push(path);
        }
    }
}

/// Names and bytes of the files, if they are there.
fn wallpaper_view_0() -> Option<Vec<(String, Vec<u8>)>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/ubo2003-wallpaper-view0");
    if !folder.is_dir() {
        println!("no measured files beside the checkout: nothing was read");
        return None;
    }
    let mut files = Vec::new();
    files_below(&folder, &mut files);
    let named = files.iter().map(|path| {
        let name = path.strip_prefix(&folder).unwrap().to_str().unwrap().to_owned();
        (name, fs::read(path).unwrap())
    });
    Some(named.collect())
}

#[test]
fn one_measured_view_is_read_as_published() {
    let Some(files) = wallpaper_view_0() else { return };
    let limits = Limits::default();
    let catalogue = Catalogue::from_names(files.iter().map(|(name, _)| name.as_str())).unwrap();
    assert_eq!(catalogue.lights(), directions_81());
    assert_eq!(catalogue.views(), &directions_81()[..1]);

    let mut ring_means = vec![Vec::new(); 6];
    for (light, direction) in catalogue.lights().iter().enumerate() {
        let (name, bytes) = &files[catalogue.image(0, light).unwrap()];
        assert_eq!(parse_name(name).unwrap().number, Some(81 * light as u32));
        assert!(header(bytes, &limits).unwrap().progressive);
        let image = decode(bytes, &limits).unwrap();
        assert_eq!((image.width, image.height, image.channels), (256, 256, 3));
        let sum: u64 = image.samples.iter().map(|&s| u64::from(s)).sum();
        ring_means[(direction.theta_deg() / 15.0) as usize].push(sum as f64 / image.samples.len() as f64);
    }
    // The means of the rings of light, theta 0 to 75, as another decoder found them.
    for (ring, expected) in ring_means.iter().zip([150.0, 141.0, 129.0, 110.0, 85.0, 52.0]) {
        let mean = ring.iter().sum::<f64>() / ring.len() as f64;
        assert!((mean - expected).abs() < 1.0, "{mean} where {expected} was expected");
    }
}

#[test]
fn a_measured_file_cut_anywhere_near_its_end_is_an_error() {
    let Some(files) = wallpaper_view_0() else { return };
    let (_, bytes) = files.iter().find(|(name, _)| parse_name(name).is_some()).unwrap();
    let ends = (0..bytes.len()).step_by(997).chain(bytes.len() - 64..bytes.len());
    for end in ends {
        let error = decode(&bytes[..end], &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Malformed, "{end}: {error}");
    }
}

#[test]
fn measured_files_survive_a_zip() {
    let Some(files) = wallpaper_view_0() else { return };
    let mut writer = ZipWriter::new(Vec::new());
    for (name, bytes) in &files {
        writer.write_entry(name, bytes).unwrap();
    }
    let zip = writer.finish().unwrap();
    let index = ZipIndex::open(&zip, &Limits::default()).unwrap();
    for (i, (name, bytes)) in files.iter().enumerate() {
        assert_eq!(index.entries()[i].name(), name);
        assert_eq!(*index.read(&zip, i).unwrap(), **bytes);
    }
}
