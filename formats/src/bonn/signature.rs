//! The first bytes: which container, and whether rotations are in it.

/// The containers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BonnKind {
    /// Decorrelated full matrix factorisation: one product of two matrices for each channel.
    Dfmf,
    /// Full matrix factorisation: one product for all channels.
    Fmf,
    /// The same with an extension header.
    FmfExtended,
    /// Per view factorisation: one product, and a mean, for each view.
    Pvf,
    /// Bidirectional images: all samples, uncompressed.
    Bdi,
}

/// One way to read the first bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Signature {
    pub(super) kind: BonnKind,
    /// Text of the signature, without a terminator in the file.
    pub(super) text: &'static str,
    /// Whether rotations follow the plane's size (in [`BonnKind::Bdi`]: the mask).
    pub(super) rotations: bool,
}

const fn signature(kind: BonnKind, text: &'static str, rotations: bool) -> Signature {
    Signature { kind, text, rotations }
}

/// Longer ones first: the longest that matches is meant, unless its header contradicts.
const SIGNATURES: [Signature; 9] = [
    signature(BonnKind::Dfmf, "!DFMF08FCR", true),
    signature(BonnKind::FmfExtended, "!FMF12FCER", true),
    signature(BonnKind::Bdi, "!BDIF06R2!", true),
    signature(BonnKind::Dfmf, "!DFMF08FC", false),
    signature(BonnKind::FmfExtended, "!FMF12FCE", false),
    signature(BonnKind::Fmf, "!FMF06FCR", true),
    signature(BonnKind::Pvf, "!PVF06FCR", true),
    signature(BonnKind::Fmf, "!FMF06FC", false),
    signature(BonnKind::Pvf, "!PVF06FC", false),
];

/// All readings of the first bytes, the longest first. There are two where an `R` follows a signature that is
/// complete without it: it may be the first byte of the header's size.
pub(super) fn readings(bytes: &[u8]) -> impl Iterator<Item = Signature> {
    SIGNATURES.into_iter().filter(|signature| bytes.starts_with(signature.text.as_bytes()))
}

/// Which of the containers the bytes begin like, if any. Ten bytes are enough.
///
/// ```
/// use btfkit_formats::bonn::{BonnKind, recognise};
///
/// assert_eq!(recognise(b"!DFMF08FCR..."), Some(BonnKind::Dfmf));
/// assert_eq!(recognise(b"4627\n1\n"), None); // the unrelated `.btf` of the MLVQ databases
/// ```
pub fn recognise(bytes: &[u8]) -> Option<BonnKind> {
    readings(bytes).next().map(|signature| signature.kind)
}
