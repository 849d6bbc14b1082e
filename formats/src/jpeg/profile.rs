//! What the segments before a JPEG's first scan say of its colours (ICC.1:2022, B.4; Exif 2.3; XMP), and of pixels that
//! are not square (JFIF).

use super::marker;
use crate::picture::{aspect, exif, orientation, profile};
use crate::reader::Reader;

/// What is said if it is not sRGB; nothing where the segments are damaged, as whoever reads the picture finds that.
pub(crate) fn profile(bytes: &[u8]) -> Option<String> {
    let (mut icc, mut exif, mut xmp) = (Vec::new(), None, None);
    for (code, segment) in segments(bytes) {
        match code {
            // The number of this part and of all of them, then its bytes.
            marker::APP2 if segment.starts_with(b"ICC_PROFILE\0") => {
                icc.extend_from_slice(segment.get(14..).unwrap_or_default());
            }
            marker::APP1 => {
                let (block, packet) =
                    (segment.strip_prefix(exif::MARK), segment.strip_prefix(orientation::XMP));
                exif = exif.or_else(|| block.and_then(exif::colours));
                xmp = xmp.or_else(|| packet.and_then(profile::of_xmp));
            }
            _ => {}
        }
    }
    if icc.is_empty() { exif.or(xmp) } else { profile::of_icc(&icc) }
}

/// What is said of pixels that are not square (JFIF) and of samples (Exif), a sentence each.
pub(crate) fn remarks(bytes: &[u8]) -> Vec<String> {
    let jfif = segments(bytes).find_map(|(code, segment)| {
        // Version and unit, then how many pixels there are to it, across and down.
        let (head, rest) = segment.split_at_checked(8).filter(|_| code == marker::APP0)?;
        let [across_high, across, down_high, down, ..] = *rest else { return None };
        let density = |bytes| f64::from(u16::from_be_bytes(bytes));
        head.starts_with(b"JFIF\0").then(|| {
            aspect::of_densities(
                density([across_high, across]),
                density([down_high, down]),
                "the densities of JFIF",
            )
        })
    });
    let exif = segments(bytes)
        .filter(|(code, _)| *code == marker::APP1)
        .find_map(|(_, segment)| segment.strip_prefix(exif::MARK).map(exif::unapplied));
    jfif.flatten().into_iter().chain(exif.unwrap_or_default()).collect()
}

/// Markers and segments before the first scan.
fn segments(bytes: &[u8]) -> impl Iterator<Item = (u8, &[u8])> {
    let mut reader = Reader::new(bytes);
    let _ = reader.take(2);
    std::iter::from_fn(move || {
        let code =
            marker::next(&mut reader).ok().filter(|code| !matches!(*code, marker::SOS | marker::EOI))?;
        Some((code, marker::segment(&mut reader).ok()?))
    })
}
