//! What a picture says of its colours, where that is not what integers are taken for: sRGB. Nothing of it is applied;
//! the caller is told.

use super::xmp;
use crate::reader::Reader;

/// Longest name of a profile that is told, characters.
const LONGEST_NAME: usize = 60;

/// Of an ICC profile (ICC.1:2022): what it is called; `None` if that is sRGB.
pub(crate) fn of_icc(profile: &[u8]) -> Option<String> {
    let Some(name) = description(profile) else {
        return Some("an ICC profile without a readable name".to_owned());
    };
    let shown: String = name.chars().take(LONGEST_NAME).collect();
    (!is_srgb(&name)).then(|| format!("the ICC profile {shown:?}"))
}

/// Whether a profile is called as those of sRGB are: `sRGB IEC61966-2.1`, `sRGB built-in`, `GIMP built-in sRGB`. There are
/// also `GIMP built-in Linear sRGB`, `sRGB-elle-V2-g10.icc` (linear) and `scRGB`: a word that is not known is stated.
fn is_srgb(name: &str) -> bool {
    const KNOWN: [&str; 12] = [
        "srgb",
        "iec",
        "built",
        "in",
        "gimp",
        "artifex",
        "icc",
        "profile",
        "color",
        "space",
        "v",
        "preference",
    ];
    let name = name.to_lowercase();
    let mut words = name.split(|c: char| !(c.is_alphanumeric() || c == '.')).filter(|word| !word.is_empty());
    // Versions and years follow words or stand alone.
    let version = |c: char| c.is_ascii_digit() || c == '.';
    let known = |word: &str| word.chars().all(version) || KNOWN.contains(&word.trim_end_matches(version));
    name.contains("srgb") && words.all(known)
}

/// Chromaticities of sRGB: red, green, blue, white.
const SRGB_CHROMATICITIES: [f64; 8] = [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329];

/// Differences of chromaticities that come from rounding.
const ROUNDING: f64 = 0.005;

/// Of chromaticities in the order red, green, blue, white, which may end early; `None` if they are those of sRGB.
pub(crate) fn of_chromaticities(found: &[f64]) -> Option<String> {
    let near = |(found, srgb): (&f64, &f64)| (found - srgb).abs() <= ROUNDING;
    let whole = found.len() >= 2 && found.len() <= SRGB_CHROMATICITIES.len();
    if whole && found.iter().zip(&SRGB_CHROMATICITIES).all(near) {
        return None;
    }
    let told: Vec<String> = found.iter().take(8).map(|value| format!("{value:.4}")).collect();
    Some(format!("the primaries {}", told.join(" ")))
}

/// Of the number of a colour space in Exif data.
pub(crate) fn of_exif_space(number: Option<u64>) -> Option<String> {
    match number {
        Some(2) => Some("the Exif colour space 2 (Adobe RGB)".to_owned()),
        Some(0xFFFF) => Some("the Exif colour space \"uncalibrated\" (Adobe RGB, perhaps)".to_owned()),
        _ => None,
    }
}

/// Of a packet of XMP: the name of a profile, else the number of a colour space; `None` if that is sRGB.
pub(crate) fn of_xmp(packet: &[u8]) -> Option<String> {
    let photoshop = xmp::values(packet, "http://ns.adobe.com/photoshop/1.0/", "photoshop", "ICCProfile");
    let text = |value: &&[u8]| String::from_utf8_lossy(value).into_owned();
    if let Some(name) = photoshop.first().map(text).filter(|name| !name.is_empty()) {
        let shown: String = name.chars().take(LONGEST_NAME).collect();
        return (!is_srgb(&name)).then(|| format!("the ICC profile {shown:?} (XMP)"));
    }
    let space = xmp::values(packet, "http://ns.adobe.com/exif/1.0/", "exif", "ColorSpace");
    of_exif_space(space.first().and_then(|value| text(value).parse().ok()))
}

/// Of the name of a colour space (`oiio:ColorSpace`, `colorInteropID`); `None` if it is what samples are taken for: sRGB,
/// or the same primaries in linear light.
pub(crate) fn of_space_name(name: &str, linear: bool) -> Option<String> {
    const LINEAR: [&str; 8] = [
        "linear",
        "scenelinear",
        "linrec709",
        "linrec709scene",
        "linsrgb",
        "linearsrgb",
        "linearrec709",
        "linearrec709srgb",
    ];
    const ENCODED: [&str; 4] = ["srgb", "srgbrec709scene", "srgbrec709display", "srgbtexture"];
    let bare: String = name.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_lowercase();
    let expected: &[&str] = if linear { &LINEAR } else { &ENCODED };
    let shown: String = name.chars().take(LONGEST_NAME).collect();
    (!bare.is_empty() && !expected.contains(&bare.as_str())).then(|| format!("the colour space {shown:?}"))
}

/// The text of the tag `desc`, in the first language that there is.
fn description(profile: &[u8]) -> Option<String> {
    let number = |reader: &mut Reader<'_>| -> Option<usize> {
        let bytes = reader.take(4).ok()?.try_into().ok()?;
        usize::try_from(u32::from_be_bytes(bytes)).ok()
    };
    let mut tags = Reader::new(profile.get(128..)?);
    let count = number(&mut tags)?;
    // A tag takes 12 bytes, so that the end of the profile ends this loop.
    for _ in 0..count {
        let is_description = tags.take(4).ok()? == b"desc";
        let (at, len) = (number(&mut tags)?, number(&mut tags)?);
        if !is_description {
            continue;
        }
        let data = profile.get(at..at.checked_add(len)?)?;
        let mut fields = Reader::new(data);
        let kind = fields.take(8).ok()?.get(..4)?;
        if kind == b"desc" {
            let len = number(&mut fields)?;
            let text = fields.take(len).ok()?;
            return Some(String::from_utf8_lossy(text).trim_end_matches('\0').to_owned());
        }
        // `mluc`: the number of records, their size, then language and country, length and place of each.
        fields.take(12).ok()?;
        let (len, at) = (number(&mut fields)?, number(&mut fields)?);
        let text = data.get(at..at.checked_add(len)?).filter(|_| kind == b"mluc")?;
        let units = text.as_chunks::<2>().0.iter().map(|&pair| u16::from_be_bytes(pair));
        return Some(char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect());
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_srgb_are_told_from_those_of_its_linear_and_wide_kin() {
        for name in [
            "sRGB",
            "sRGB IEC61966-2.1",
            "sRGB built-in",
            "GIMP built-in sRGB",
            "Artifex sRGB ICC Profile",
            "sRGB2014",
        ] {
            assert!(is_srgb(name), "{name}");
        }
        for name in [
            "GIMP built-in Linear sRGB",
            "linear sRGB",
            "Not sRGB",
            "scRGB",
            "sRGB-elle-V2-g10.icc",
            "Adobe RGB (1998)",
            "",
        ] {
            assert!(!is_srgb(name), "{name}");
        }
    }
}
