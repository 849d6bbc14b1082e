//! Metadata by name that change what samples or pixels mean and that no reader here applies, whatever the format has them
//! in: text chunks of PNG, attributes of OpenEXR, tags of TIFF and Exif.

/// Longest value that is told, characters.
const LONGEST: usize = 40;

/// Names without what stands before a colon, in small letters, and the values that change nothing.
const NAMES: [(&str, &[&str]); 13] = [
    ("gamma", &["1", "1.0", "0.45455", "0.454545"]),
    ("orientation", &["1", "top-left", "topleft", "normal", "horizontal (normal)"]),
    ("xmp", &[]),
    ("iccprofile", &[]),
    ("whitepoint", &[]),
    ("white-point", &[]),
    ("primarychromaticities", &[]),
    ("transferfunction", &[]),
    ("significantbits", &[]),
    ("sminsamplevalue", &[]),
    ("smaxsamplevalue", &[]),
    // The number of none in ImageJ; 0 is a straight line.
    ("calibrationfunction", &["20"]),
    ("brightness", &["0", "0.0"]),
];

/// The same of exposure, whose values differ from picture to picture: only the name is told.
const EXPOSURES: [&str; 4] = ["exptime", "exposuretime", "baselineexposure", "isospeed"];

/// The sentence on a name and its value; `None` if it says nothing of samples or pixels. A value that is no text is
/// empty.
pub(crate) fn remark(name: &str, value: &str) -> Option<String> {
    let bare = name.rsplit(':').next().unwrap_or(name).to_lowercase();
    if EXPOSURES.contains(&bare.as_str()) {
        return Some(format!("the exposure that {name} states is not applied: samples are read as stored"));
    }
    let value = value.trim_matches(|c: char| c == '\0' || c.is_whitespace());
    let (_, ordinary) = NAMES.iter().find(|(known, _)| *known == bare)?;
    if ordinary.contains(&value.to_lowercase().as_str()) {
        return None;
    }
    let shown: String = value.chars().take(LONGEST).collect();
    let shown = if shown.is_empty() { name.to_owned() } else { format!("{name} {shown:?}") };
    Some(format!("{shown} is not applied: rows, columns and samples are read as stored"))
}

/// The same of numbers.
pub(crate) fn remark_of(name: &str, values: &[f64]) -> Option<String> {
    let told: Vec<String> = values.iter().take(8).map(ToString::to_string).collect();
    remark(name, &told.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_the_meaning_of_samples_is_told_and_nothing_else() {
        for (name, value) in [
            ("Gamma", "2.2"),
            ("oiio:Gamma", "2.4"),
            ("exif:Orientation", "6"),
            ("Orientation", "rotated 90 CW"),
            ("ICCProfile", ""),
            ("xmp", ""),
            ("expTime", "0.5"),
            ("tiff:BaselineExposure", "1"),
            ("SignificantBits", "12"),
        ] {
            let told = remark(name, value).unwrap();
            assert!(told.contains(name) && told.contains("not applied"), "{told}");
        }
        for (name, value) in [
            ("Gamma", "1.0\0"),
            ("exif:Orientation", "1"),
            ("Software", "GIMP"),
            ("Comment", "gamma 2.2"),
            ("", ""),
        ] {
            assert_eq!(remark(name, value), None, "{name}");
        }
        assert_eq!(remark_of("Gamma", &[1.0]), None);
        assert!(remark_of("Gamma", &[2.2]).is_some());
    }
}
