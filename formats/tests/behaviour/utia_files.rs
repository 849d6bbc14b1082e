//! Small BIG and MIF files, written byte by byte from the description of the formats, independently of the readers.

/// 64-bit numbers, little-endian.
pub(crate) fn words(numbers: &[u64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// 64-bit floats, little-endian.
pub(crate) fn doubles(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// A chunk of BIG, padded to a multiple of 8 bytes.
pub(crate) fn big_chunk(id: u64, data: &[u8]) -> Vec<u8> {
    let mut padded = data.to_vec();
    padded.resize(data.len().div_ceil(8) * 8, 0);
    [words(&[id, padded.len() as u64]), padded].concat()
}

/// A BIG file of these chunks.
pub(crate) fn big_file(chunks: &[(u64, Vec<u8>)]) -> Vec<u8> {
    let mut out = vec![0x42, 0x49, 0x47, 0, 0, 0, 0, 0];
    for (id, data) in chunks {
        out.extend(big_chunk(*id, data));
    }
    out
}

/// A chunk of MIF.
pub(crate) fn mif_chunk(kind: u64, data: &[u8]) -> Vec<u8> {
    [words(&[kind, data.len() as u64]), data.to_vec()].concat()
}

/// An image chunk of MIF: number, data type, rows, columns, planes, samples.
pub(crate) fn mif_image(index: u64, data_type: u64, size: [u64; 3], samples: &[u8]) -> Vec<u8> {
    let head = words(&[index, 0, data_type, size[0], size[1], size[2]]);
    mif_chunk(0, &[head, samples.to_vec()].concat())
}

/// A MIF file of these chunks.
pub(crate) fn mif_file(chunks: &[Vec<u8>]) -> Vec<u8> {
    let mut out = words(&[0x454C_4946_2046_494D, 8, 1]);
    out.extend(chunks.concat());
    out
}

/// Two views under three lights, (theta, phi) in degrees, in an order that is neither by view nor by light:
/// `[view theta, view phi, light theta, light phi]` for each image.
pub(crate) const PAIRS: [[f64; 4]; 6] = [
    [15.0, 30.0, 0.0, 0.0],
    [45.0, 270.0, 60.0, 120.0],
    [15.0, 30.0, 75.0, 345.0],
    [45.0, 270.0, 75.0, 345.0],
    [45.0, 270.0, 0.0, 0.0],
    [15.0, 30.0, 60.0, 120.0],
];

/// The image of each view and light, in the order of their first appearance in [`PAIRS`].
pub(crate) const IMAGE_OF: [[usize; 3]; 2] = [[0, 5, 2], [4, 1, 3]];
