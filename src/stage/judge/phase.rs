//! Crops of a regular material are compared in phase.
//!
//! Two crops of one weave differ in where its threads lie, and some measures see that. How much real crops differ so is
//! decided by where they were cut, and an enlargement is free to begin anywhere in a cell. So its crops are moved, within
//! one cell of the lattice, to where each agrees best with one of the real crops, its partner. It is compared with the
//! others only: then its crops are out of phase with them exactly as the real crops are with each other.

use rustfft::num_complex::Complex;

use crate::lattice::Lattice;
use crate::likeness::Lightness;
use crate::shape::{Size, Window};
use crate::signal::fourier::Fourier;

/// Rows and columns that hold one cell of a lattice, at most `side` each; none without a lattice.
pub(super) fn cell(lattice: &Lattice, side: usize) -> Option<Size> {
    let vectors = lattice.vectors();
    let extent = |axis: usize| {
        let sum: f64 = vectors.iter().map(|vector| vector[axis].abs()).sum();
        // A period of ribs may be all but parallel to an axis.
        (sum.round() as usize).clamp(1, side)
    };
    (!vectors.is_empty()).then(|| Size::new(extent(0), extent(1)))
}

/// The part of a plane in which a crop may be moved by less than a cell: it begins with the crop as far as it fits.
pub(super) fn around(crop: Window, cell: Size, plane: Size) -> Window {
    let along = |start: usize, side: usize, cell: usize, length: usize| {
        let reach = (side + cell - 1).min(length);
        (start.min(length - reach), reach)
    };
    let (y, height) = along(crop.y, crop.size.height, cell.height, plane.height);
    let (x, width) = along(crop.x, crop.size.width, cell.width, plane.width);
    Window { y, x, size: Size::new(height, width) }
}

/// Row and column of the part of a picture, of the size of a partner, that has the largest covariance with it; the first
/// of equals.
pub(super) fn best_place(picture: &Lightness, partner: &Lightness) -> [usize; 2] {
    let fourier = Fourier::new(picture.size);
    let (width, mean) = (picture.size.width, partner.mean());
    let mut padded = vec![0.0; picture.size.texels()];
    for (to, from) in padded.chunks_exact_mut(width).zip(partner.values.chunks_exact(partner.size.width)) {
        to.iter_mut().zip(from).for_each(|(to, from)| *to = from - mean);
    }
    let spectrum = fourier.forward_real(picture.values.iter().copied());
    let partner_spectrum = fourier.forward_real(padded);
    let product: Vec<Complex<f64>> =
        spectrum.iter().zip(&partner_spectrum).map(|(of, other)| of * other.conj()).collect();
    let covariance = fourier.inverse(&product);
    let rows = picture.size.height - partner.size.height + 1;
    let columns = width - partner.size.width + 1;
    let places = (0..rows).flat_map(|y| (0..columns).map(move |x| [y, x]));
    let at = |[y, x]: [usize; 2]| covariance[y * width + x].re;
    places.reduce(|best, place| if at(place) > at(best) { place } else { best }).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn weave(y: usize, x: usize, size: Size) -> Lightness {
        let value = |n: usize| {
            let (y, x) = ((y + n / size.width) as f64, (x + n % size.width) as f64);
            50.0 + 20.0 * (y * std::f64::consts::TAU / 18.0).sin() * (x * std::f64::consts::TAU / 23.0).cos()
                + (y + 0.3 * x) / 50.0
        };
        Lightness::new(size, (0..size.texels()).map(value).collect())
    }

    #[test]
    fn a_crop_is_moved_into_phase_within_one_cell() {
        let side = Size::new(64, 64);
        let lattice = Lattice::TwoDirections([[18.0, 0.0], [0.0, 23.0]]);
        let cell = cell(&lattice, 64).unwrap();
        assert_eq!(cell, Size::new(18, 23));
        for (y, x) in [(0, 0), (5, 7), (17, 22), (36, 46)] {
            let place = best_place(&weave(y, x, Size::new(81, 86)), &weave(90, 92, side));
            assert_eq!([(y + place[0]) % 18, (x + place[1]) % 23], [0, 0], "{y}, {x}");
        }
    }

    #[test]
    fn a_crop_stays_in_the_plane() {
        let crop = Window { y: 100, x: 0, size: Size::new(64, 64) };
        let moved = around(crop, Size::new(18, 1), Size::new(164, 64));
        assert_eq!(moved, Window { y: 83, x: 0, size: Size::new(81, 64) });
        let narrow = around(Window { y: 0, x: 0, ..crop }, Size::new(18, 40), Size::new(70, 70));
        assert_eq!(narrow.size, Size::new(70, 70));
    }

    #[test]
    fn only_a_lattice_has_cells_and_none_is_larger_than_a_crop() {
        assert_eq!(cell(&Lattice::None, 64), None);
        let ribs = Lattice::OneDirection { period: [0.04, 23.12] };
        assert_eq!(cell(&ribs, 64), Some(Size::new(1, 23)));
        let large = Lattice::TwoDirections([[127.9, -0.3], [0.2, 127.7]]);
        assert_eq!(cell(&large, 96), Some(Size::new(96, 96)));
    }
}
