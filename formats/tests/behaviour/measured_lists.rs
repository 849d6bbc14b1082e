//! Lists of real set-ups, where they lie beside the checkout.

use std::fs;
use std::path::{Path, PathBuf};

use btfkit_formats::{Angles, Catalogue, Limits, Pair, directions::directions_151, rti};

fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data").join(name);
    if !path.exists() {
        println!("no {name} beside the checkout: nothing was read");
        return None;
    }
    Some(path)
}

#[test]
fn light_lists_name_the_photographs_of_their_folder() {
    let Some(folder) = shared("uw-photometric") else { return };
    for object in ["cat", "owl", "gray", "chrome"] {
        let folder = folder.join(object);
        let bytes = fs::read(folder.join(format!("{object}.lp"))).unwrap();
        let list = rti::read_lp(&bytes, &Limits::default()).unwrap();
        assert_eq!((list.lamps.len(), list.warnings.len()), (12, 0), "{object}");
        let pair = |light| Some(Pair { view: Angles::FRONTAL, light });
        let files = list.lamps.iter().map(|lamp| (lamp.file.as_deref().unwrap(), pair(lamp.light)));
        assert!(files.clone().all(|(file, _)| folder.join(file).is_file()), "{object}");
        let set = Catalogue::from_pairs(files).unwrap();
        assert_eq!((set.views().len(), set.lights().len()), (1, 12));
        // The second column of the file is to the right: the vector of the first line.
        let [x, y, z] = list.lamps[0].light.direction().vector();
        for (found, expected) in [(x, 0.494452), (y, 0.471781), (z, 0.730027)] {
            assert!((found - expected).abs() < 1e-6, "{object}: {found} where {expected} was expected");
        }
    }
}

#[test]
fn the_151_directions_are_those_of_the_dome() {
    let Some(path) = shared("ubo2014-stats/bonn_angles.bin") else { return };
    let bytes = fs::read(path).unwrap();
    let numbers: Vec<f64> =
        bytes.chunks_exact(8).map(|eight| f64::from_le_bytes(eight.try_into().unwrap())).collect();
    assert_eq!(numbers.len(), 453);
    let list = directions_151();
    for (i, angles) in list.iter().enumerate() {
        let (azimuth, elevation) = (numbers[i], numbers[151 + i]);
        let expected = [elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin()];
        let found = angles.direction().vector();
        let apart: f64 = found.iter().zip(expected).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        assert!(apart.to_degrees() < 1e-4, "{i}: {found:?} where {expected:?} was expected");
    }
    assert_eq!(list.len(), 151);
}
