//! How much a file may ask for.

/// Upper bounds on what reading a file may cost. A file that claims more is refused with
/// [`ErrorKind::Limit`](crate::ErrorKind::Limit) before anything of that size is allocated.
///
/// The defaults are generous for BTF archives (UBO2003: 6561 entries of 55 kB, 65 536 pixels each)
/// and harmless for a laptop.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Limits {
    /// Width times height of one image, pixels. Default 2^26.
    pub max_pixels_per_image: u64,
    /// Scans of one JPEG; each is a pass over the whole image. Default 100.
    pub max_scans_per_image: u32,
    /// Uncompressed size of one zip entry, bytes. Default 2^28.
    pub max_entry_bytes: u64,
    /// Entries of one zip. Default 2^20.
    pub max_entries: u64,
    /// View or light directions of one archive. Default 2^16.
    pub max_directions: u64,
    /// Channels of one image: spectral sets have tens. Default 1024.
    pub max_channels: u64,
    /// Bytes of all samples that one call may return or work on. Default 2^32.
    pub max_decoded_bytes: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            max_pixels_per_image: 1 << 26,
            max_scans_per_image: 100,
            max_entry_bytes: 1 << 28,
            max_entries: 1 << 20,
            max_directions: 1 << 16,
            max_channels: 1 << 10,
            max_decoded_bytes: 1 << 32,
        }
    }
}
