//! Which archive in one file a file is, told by its first bytes.

use crate::{big, bonn, mif, mlvq};

/// The beginning of every `.npy` file.
const NPY_MAGIC: &[u8] = b"\x93NUMPY";

/// The first bytes of an HDF5 superblock.
const HDF5_SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

/// An archive that is one file and no zip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContainerKind {
    /// A container of Bonn: DFMF, FMF, PVF or BDI ([`bonn`]).
    Bonn,
    /// A database of multilevel vector quantisation ([`mlvq`]).
    Mlvq,
    /// UTIA's BIG ([`big`]).
    Big,
    /// MIF ([`mif`]).
    Mif,
    /// A numpy array ([`crate::npy`]).
    Npy,
    /// HDF5, which this crate does not read.
    Hdf5,
}

impl ContainerKind {
    /// The container that begins with these bytes; `None` if it is none.
    pub fn recognise(head: &[u8]) -> Option<Self> {
        type Fits = fn(&[u8]) -> bool;
        const KINDS: [(ContainerKind, Fits); 6] = [
            (ContainerKind::Bonn, |head| bonn::recognise(head).is_some()),
            (ContainerKind::Mlvq, mlvq::recognise),
            (ContainerKind::Big, big::recognise),
            (ContainerKind::Mif, mif::recognise),
            (ContainerKind::Npy, |head| head.starts_with(NPY_MAGIC)),
            (ContainerKind::Hdf5, is_hdf5),
        ];
        KINDS.into_iter().find(|(_, fits)| fits(head)).map(|(kind, _)| kind)
    }

    /// What it is called, with its article.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bonn => "a Bonn BTF archive",
            Self::Mlvq => "an MLVQ database",
            Self::Big => "a UTIA BIG archive",
            Self::Mif => "a MIF archive",
            Self::Npy => "a numpy array",
            Self::Hdf5 => "an HDF5 file",
        }
    }
}

/// Whether there is a superblock, at byte 0 or, after a block of the user's own, at 512 times a power of two.
fn is_hdf5(bytes: &[u8]) -> bool {
    let mut places = std::iter::once(0).chain((9..usize::BITS).map(|power| 1 << power));
    places.any(|at| bytes.get(at..).is_some_and(|rest| rest.starts_with(HDF5_SIGNATURE)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_signature_of_hdf5_is_found_after_a_block_of_the_users_own_and_nowhere_else() {
        for at in [0, 512, 1024, 4096] {
            let mut file = vec![0; at];
            file.extend(HDF5_SIGNATURE);
            assert_eq!(ContainerKind::recognise(&file), Some(ContainerKind::Hdf5), "{at}");
            assert_eq!(ContainerKind::recognise(&file[..file.len() - 1]), None, "{at}");
        }
        for at in [1, 256, 511, 513, 1536] {
            let mut file = vec![0; at];
            file.extend(HDF5_SIGNATURE);
            assert_eq!(ContainerKind::recognise(&file), None, "{at}");
        }
    }
}
