//! What the segments before a JPEG's first scan say of its colours (ICC.1:2022, B.4; Exif 2.3).

use super::marker;
use crate::picture::{orientation, profile};
use crate::reader::Reader;

/// What is said if it is not sRGB; nothing where the segments are damaged, as whoever reads the picture finds that.
pub(crate) fn profile(bytes: &[u8]) -> Option<String> {
    let mut reader = Reader::new(bytes);
    let _ = reader.take(2);
    let (mut icc, mut exif) = (Vec::new(), None);
    while let Ok(code) = marker::next(&mut reader) {
        if matches!(code, marker::SOS | marker::EOI) {
            break;
        }
        let Ok(segment) = marker::segment(&mut reader) else { break };
        match code {
            // The number of this part and of all of them, then its bytes.
            marker::APP2 if segment.starts_with(b"ICC_PROFILE\0") => {
                icc.extend_from_slice(segment.get(14..).unwrap_or_default());
            }
            marker::APP1 => {
                let block = segment.strip_prefix(orientation::EXIF);
                exif = exif.or_else(|| block.and_then(profile::of_exif));
            }
            _ => {}
        }
    }
    if icc.is_empty() { exif } else { profile::of_icc(&icc) }
}
