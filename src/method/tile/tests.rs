//! Tiles of made planes, whose periods and borders are known.
#![allow(clippy::unwrap_used)]
use super::*;
use crate::lattice::Lattice;
use crate::random::Hash;

/// A plane with a periodic pattern of the given periods.
fn periodic(size: Size, period: [usize; 2]) -> Features {
    let hash = Hash::new(1, 0);
    let codes = (0..size.texels())
        .flat_map(|n| {
            let (y, x) = (n / size.width % period[0], n % size.width % period[1]);
            hash.words(y as u32, x as u32, 0).map(|word| word as u8)
        })
        .collect();
    Features { size, count: 4, codes }
}

#[test]
fn a_periodic_plane_gives_a_tile_of_whole_periods() {
    let features = periodic(Size::new(90, 100), [24, 32]);
    let range = SearchRange::for_plane(features.size, &Lattice::None).unwrap();
    let patch = search(&features, &range, 1);
    assert_eq!((patch.height % 24, patch.width % 32), (0, 0), "{patch:?}");
    let tile = cut(&features, patch).tile;
    // Every tile texel equals the plane's at its place, so the cut cannot be told.
    for (number, source) in tile.source.iter().enumerate() {
        let (y, x) = (number / tile.size.width, number % tile.size.width);
        let (here, there) = ([patch.y + y, patch.x + x], source.map(|n| n as usize));
        assert_eq!(features.texel(here), features.texel(there));
    }
}

#[test]
fn borders_join_through_texels_that_were_neighbours() {
    let features = periodic(Size::new(64, 64), [64, 64]);
    let patch = Patch { y: 2, x: 3, height: 40, width: 48, overlap: 8 };
    let Cut { tile, beyond, .. } = cut(&features, patch);
    // The first row is taken from beyond the bottom border, the first column from beyond the right
    // one: they continue the last row and the last column.
    for (x, beyond) in beyond[..48].iter().enumerate() {
        let (first, last) = (tile.source[x], tile.source[39 * 48 + x]);
        assert!(beyond & 2 != 0 && first[0] == last[0] + 1);
    }
    for y in 0..40 {
        let (first, last) = (tile.source[y * 48], tile.source[y * 48 + 47]);
        assert!(beyond[y * 48] & 1 != 0 && first[1] == last[1] + 1);
    }
}

#[test]
fn visibility_is_one_where_there_is_no_seam() {
    let features = periodic(Size::new(32, 32), [32, 32]);
    let tile = Tile::whole(features.size, true);
    let visibility = seam_visibility(&features, &tile);
    assert!((0.8..1.25).contains(&visibility), "{visibility}");
}

/// A plane of smooth noise that repeats by the lattice of two vectors, and some noise that does not.
fn with_lattice(size: Size, lattice: &Lattice, noisy: f64) -> Features {
    let hash = Hash::new(3, 0);
    let waves = lattice.waves();
    let mut codes = Vec::new();
    for n in 0..size.texels() {
        let (y, x) = ((n / size.width) as f64, (n % size.width) as f64);
        let phases: Vec<f64> = waves.iter().map(|wave| wave[0] * y + wave[1] * x).collect();
        for feature in 0..3 {
            let value: f64 = (0..6u32)
                .map(|term| {
                    let [amplitude, offset, ..] = hash.uniforms(feature, term, 0);
                    let (i, j) = [(1, 0), (0, 1), (1, 1), (2, 1), (1, 2), (2, 2)][term as usize];
                    let cycles =
                        [i, j].into_iter().zip(&phases).map(|(times, phase)| f64::from(times) * phase);
                    (0.5 + amplitude) * (std::f64::consts::TAU * (cycles.sum::<f64>() + offset)).sin()
                })
                .sum();
            let noise = hash.normals(n as u32, feature, 1)[0];
            codes.push((128.0 + 20.0 * value + 30.0 * noisy * noise).clamp(0.0, 255.0) as u8);
        }
    }
    Features { size, count: 3, codes }
}

#[test]
fn a_tile_is_cut_to_whole_cells_of_a_lattice() {
    let size = Size::new(130, 150);
    for (text, whole) in [("17.3,0;0,20.6", [17.3, 20.6]), ("0,20.6;41,0", [41.0, 20.6])] {
        let lattice: Lattice = text.parse().unwrap();
        let features = with_lattice(size, &lattice, 0.5);
        let range = SearchRange::for_plane(size, &lattice).unwrap();
        for seed in 1..4 {
            let patch = search(&features, &range, seed);
            for (side, period) in [patch.height, patch.width].into_iter().zip(whole) {
                let cells = side as f64 / period;
                assert!((cells - cells.round()).abs() * period < 0.501, "{text}, seed {seed}: {patch:?}");
            }
        }
    }
}

#[test]
fn along_ribs_sides_are_the_ordinary_ones_and_across_them_whole_periods() {
    let ribs = |text: &str| SearchRange::for_plane(Size::new(128, 128), &text.parse().unwrap()).unwrap();
    let ordinary = SearchRange::for_plane(Size::new(128, 128), &Lattice::None).unwrap();
    assert_eq!(*ordinary.sides(), [[72, 80, 88, 96, 104, 112]; 2]);
    let across = ribs("0,23.12");
    assert_eq!(across.sides()[0], ordinary.sides()[0]);
    assert_eq!(across.sides()[1], [69, 92]);
    // A period that no tile can hold is passed over.
    assert_eq!(ribs("0,130"), ordinary);
    assert!(SearchRange::for_plane(Size::new(20, 128), &Lattice::None).is_none());
}

#[test]
fn sides_of_an_oblique_lattice_bring_every_wave_around() {
    let lattice: Lattice = "8,6;-6,8".parse().unwrap();
    let range = SearchRange::for_plane(Size::new(130, 130), &lattice).unwrap();
    assert_eq!(*range.sides(), [[100], [100]]);
}

#[test]
fn the_greatest_period_that_fits_has_its_side() {
    // Five eighths of the 224 texels that an overlap leaves are more than a cell.
    let lattice: Lattice = "127.9,-0.3;0.2,127.7".parse().unwrap();
    let range = SearchRange::for_plane(Size::new(256, 256), &lattice).unwrap();
    assert_eq!(*range.sides(), [[128], [128]]);
}

#[test]
fn borders_join_where_the_plane_repeats() {
    for (size, joins) in [(Size::new(96, 80), true), (Size::new(90, 80), false), (Size::new(96, 73), false)] {
        let lattice: Lattice = "24,0;0,20".parse().unwrap();
        assert_eq!(borders_join(&with_lattice(size, &lattice, 0.1)), joins, "{size}");
    }
}
