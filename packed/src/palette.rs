//! A palette: the tile as an index into few centres, for materials that were vector-quantised before.
//!
//! An image that is constant over the texels of each centre has as many numbers as there are centres. Scaled by the
//! roots of how many texels they have, these are an orthonormal transform of such images, as the cosine transform is of
//! all: everything else of a file stays as it is.

use crate::bytes::Reader;
use crate::error::{Error, Result};
use crate::range_coder::{Coder, Decoder, Encoder, Probability};

/// Most centres.
pub(crate) const MOST_CENTRES: usize = 4096;

/// Texels around one that it may be equal to: left, above, above right, above left.
const NEIGHBOURS: usize = 4;

/// An index [y, x] into centres that all have texels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Palette {
    index: Vec<u16>,
    /// Square root of the number of texels of each centre.
    roots: Vec<f64>,
}

impl Palette {
    /// Of an index, whose centres without texels are left out.
    pub(crate) fn new(index: &[u16]) -> Self {
        let most = index.iter().map(|&centre| usize::from(centre) + 1).max().unwrap_or(0);
        let mut used = vec![false; most];
        index.iter().for_each(|&centre| used[usize::from(centre)] = true);
        let numbers: Vec<u16> = used
            .iter()
            .scan(0, |next, &used| {
                let number = *next;
                *next += u16::from(used);
                Some(number)
            })
            .collect();
        let index: Vec<u16> = index.iter().map(|&centre| numbers[usize::from(centre)]).collect();
        let count = used.iter().filter(|&&used| used).count();
        Self::of(index, count)
    }

    fn of(index: Vec<u16>, centres: usize) -> Self {
        let mut counts = vec![0.0f64; centres];
        index.iter().for_each(|&centre| counts[usize::from(centre)] += 1.0);
        Self { index, roots: counts.into_iter().map(f64::sqrt).collect() }
    }

    pub(crate) fn centres(&self) -> usize {
        self.roots.len()
    }

    /// The numbers of the centres: the mean of their texels times the root of how many they are.
    pub(crate) fn of_image(&self, image: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.roots.len()];
        image.iter().zip(&self.index).for_each(|(value, &centre)| sums[usize::from(centre)] += value);
        sums.iter().zip(&self.roots).map(|(sum, root)| sum / root).collect()
    }

    /// The image of such numbers.
    pub(crate) fn to_image(&self, numbers: &[f64]) -> Vec<f64> {
        let values: Vec<f64> = numbers.iter().zip(&self.roots).map(|(number, root)| number / root).collect();
        self.index.iter().map(|&centre| values[usize::from(centre)]).collect()
    }

    /// Appends it: the number of centres, the coded index with its length, and a checksum of all.
    pub(crate) fn write(&self, bytes: &mut Vec<u8>, width: usize) {
        let start = bytes.len();
        let mut encoder = Encoder::new();
        code(&mut encoder, &mut self.index.clone(), width, self.roots.len());
        let payload = encoder.finish();
        bytes.extend((self.roots.len() as u16).to_le_bytes());
        bytes.extend((payload.len() as u32).to_le_bytes());
        bytes.extend(payload);
        bytes.extend(crc32fast::hash(&bytes[start..]).to_le_bytes());
    }

    /// Decodes one of a tile of this size.
    ///
    /// # Errors
    /// Where it has centres without texels.
    pub(crate) fn decode(coded: &CodedPalette<'_>, [height, width]: [usize; 2]) -> Result<Self> {
        let mut index = vec![0; height * width];
        code(&mut Decoder::new(coded.payload), &mut index, width, coded.centres);
        let palette = Self::of(index, coded.centres);
        match palette.roots.iter().position(|&root| root == 0.0) {
            None => Ok(palette),
            Some(centre) => {
                let found = format!("a palette whose centre {centre} has no texels");
                Err(Error::new(found, "texels of every centre").at(coded.start))
            }
        }
    }
}

/// A palette as it lies in a file.
#[derive(Clone, Copy)]
pub(crate) struct CodedPalette<'a> {
    pub(crate) centres: usize,
    payload: &'a [u8],
    /// Byte where it begins.
    start: usize,
}

impl<'a> CodedPalette<'a> {
    /// Reads one of a tile of this size.
    ///
    /// # Errors
    /// Where it is cut or damaged, or has more centres than there may be.
    pub(crate) fn read(reader: &mut Reader<'a>, file: &'a [u8], [height, width]: [usize; 2]) -> Result<Self> {
        let start = reader.at();
        let centres = usize::from(reader.u16()?);
        let length = reader.u32()? as usize;
        let payload = reader.take(length)?;
        let covered = file.get(start..reader.at()).unwrap_or_default();
        if crc32fast::hash(covered) != reader.u32()? {
            let found = "a damaged palette: its checksum differs";
            return Err(Error::new(found, "the file as it was written").at(start));
        }
        let texels = height * width;
        if !(1..=MOST_CENTRES.min(texels)).contains(&centres) {
            let found = format!("a palette of {centres} centres for {texels} texels");
            return Err(Error::new(found, format!("1 to {}", MOST_CENTRES.min(texels))).at(start));
        }
        Ok(Self { centres, payload, start })
    }
}

/// Codes an index: whether a texel is equal to one of its neighbours, else its centre, bit by bit from the highest.
fn code(coder: &mut impl Coder, index: &mut [u16], width: usize, centres: usize) {
    let bits = usize::BITS - (centres - 1).leading_zeros();
    // By how many different neighbours were tried, and how many there are.
    let mut equal = [[Probability::default(); NEIGHBOURS + 1]; NEIGHBOURS];
    let mut tree = vec![Probability::default(); 1 << bits];
    for at in 0..index.len() {
        let (column, above) = (at % width, at >= width);
        let places = [
            (column > 0).then(|| at - 1),
            above.then(|| at - width),
            (above && column + 1 < width).then(|| at + 1 - width),
            (above && column > 0).then(|| at - 1 - width),
        ];
        let (mut near, mut count) = ([0; NEIGHBOURS], 0);
        for place in places.into_iter().flatten() {
            if !near[..count].contains(&index[place]) {
                near[count] = index[place];
                count += 1;
            }
        }
        let wanted = index[at];
        let found = (0..count).find(|&n| coder.bit(&mut equal[n][count], near[n] == wanted));
        index[at] = match found {
            Some(n) => near[n],
            None => {
                let mut node = 1usize;
                for bit in (0..bits).rev() {
                    node = 2 * node + usize::from(coder.bit(&mut tree[node], wanted >> bit & 1 == 1));
                }
                // What a damaged file says beyond the last centre is the last.
                (node - (1 << bits)).min(centres - 1) as u16
            }
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_index_comes_back_and_its_transform_is_orthonormal() {
        for (size, given) in [([1, 1], 1usize), ([9, 7], 5), ([30, 20], 64), ([3, 40], 2)] {
            let count = size[0] * size[1];
            let index: Vec<u16> = (0..count).map(|n| (n * n / 7 % (2 * given) / 2 * 3) as u16).collect();
            let palette = Palette::new(&index);
            let mut bytes = vec![7];
            palette.write(&mut bytes, size[1]);
            let mut reader = Reader::new(&bytes);
            reader.take(1).unwrap();
            let coded = CodedPalette::read(&mut reader, &bytes, size).unwrap();
            assert_eq!(Palette::decode(&coded, size).unwrap(), palette);
            assert_eq!(reader.left(), 0);
            let numbers: Vec<f64> = (0..palette.centres()).map(|k| k as f64 - 1.5).collect();
            let image = palette.to_image(&numbers);
            let back = palette.of_image(&image);
            assert!(back.iter().zip(&numbers).all(|(a, b)| (a - b).abs() < 1e-9));
            let energy = |list: &[f64]| list.iter().map(|v| v * v).sum::<f64>();
            assert!((energy(&image) - energy(&numbers)).abs() < 1e-9);
            for cut in 1..bytes.len() {
                let mut reader = Reader::new(&bytes[..cut]);
                reader.take(1).unwrap();
                assert!(CodedPalette::read(&mut reader, &bytes[..cut], size).is_err());
            }
        }
    }
}
