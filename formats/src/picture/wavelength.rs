//! Wavelengths in the names of channels.

/// Channels of electromagnetic waves that reflectance is measured in; outside, a number is no wavelength.
const RANGE_NM: std::ops::RangeInclusive<f64> = 100.0..=100_000.0;

/// The wavelength in nanometres that a channel is named after, if it is.
///
/// Read are a number (decimal point or decimal comma), with or without the unit `nm` or `um`, and with or without
/// a quantity before it: `450`, `450.5`, `450nm`, `0.45um`, and `S0.450,000000nm` or `T.450,000000nm` as spectral
/// OpenEXR files name emission and reflectance. Of a band, `400.00-430.00nm` as some renderers name theirs, it is the middle.
///
/// ```
/// use btfkit_formats::picture::wavelength_nm;
/// assert_eq!(wavelength_nm("450nm"), Some(450.0));
/// assert_eq!(wavelength_nm("S0.450,500000nm"), Some(450.5));
/// assert_eq!(wavelength_nm("400.00-430.00nm"), Some(415.0));
/// assert_eq!(wavelength_nm("R"), None);
/// ```
pub fn wavelength_nm(name: &str) -> Option<f64> {
    let (_, bare) = quantity(name);
    let (number, nm_per_unit) = match (bare.strip_suffix("nm"), bare.strip_suffix("um")) {
        (Some(number), _) => (number, 1.0),
        (_, Some(number)) => (number, 1000.0),
        _ => (bare, 1.0),
    };
    let wavelength = |text: &str| {
        let number = text.trim().replace(',', ".");
        // The standard parser takes signs, exponents and "inf" too, which no name of a channel has.
        let plain = number.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
        number.parse::<f64>().ok().filter(|_| plain).map(|number| number * nm_per_unit)
    };
    let middle = match number.split_once('-') {
        None => wavelength(number)?,
        Some((from, to)) => {
            let (from, to) = (wavelength(from)?, wavelength(to)?);
            Some((from + to) / 2.0).filter(|_| from < to)?
        }
    };
    RANGE_NM.contains(&middle).then_some(middle)
}

/// What the wavelength is one of (`S0` .. `S3` Stokes components of emission, `T` reflectance; else nothing), and the rest of the name.
pub(super) fn quantity(name: &str) -> (&str, &str) {
    match name.split_once('.') {
        Some((before @ ("S0" | "S1" | "S2" | "S3" | "T"), rest)) => (before, rest),
        _ => ("", name),
    }
}

#[cfg(test)]
mod tests {
    use super::wavelength_nm;

    #[test]
    fn names_of_wavelengths_are_read() {
        for (name, expected) in [
            ("450", 450.0),
            ("450.5", 450.5),
            ("450,5", 450.5),
            ("450nm", 450.0),
            ("450 nm", 450.0),
            ("0.45um", 450.0),
            ("S0.450,250000nm", 450.25),
            ("T.700,000000nm", 700.0),
            ("400.00-430.00nm", 415.0),
            ("0,4-0,43um", 415.0),
        ] {
            assert_eq!(wavelength_nm(name), Some(expected), "{name}");
        }
    }

    #[test]
    fn other_names_are_not() {
        for name in [
            "R",
            "Y",
            "",
            "nm",
            "C0",
            "3",
            "-450",
            "4e2",
            "inf",
            "450.5.5",
            "450m",
            "w450",
            "NaN",
            "430-400nm",
            "-430nm",
            "400-nm",
            "S0.R",
            "S0.",
        ] {
            assert_eq!(wavelength_nm(name), None, "{name}");
        }
    }
}
