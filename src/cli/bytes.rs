//! Amounts of bytes, from text and for people.

use btfkit::stage::cluster::curve::ratio_text;

/// Bytes from text such as 512MiB, 1.5GiB, 2GB, 2G or 1000000: units with an `i`, and a letter alone, are powers of
/// 1024, `kB`, `MB`, `GB` and `TB` powers of 1000.
///
/// # Errors
/// What was expected.
pub(super) fn parse_bytes(text: &str) -> Result<u64, String> {
    let expected = || {
        format!(
            "expected a size above 0 such as 512MiB, 1.5GiB (powers of 1024) or 2GB (of 1000), got {text:?}"
        )
    };
    let trimmed = text.trim();
    let end = trimmed.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(trimmed.len());
    let (number, unit) = trimmed.split_at(end);
    let scale: u64 = match unit.trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1,
        "k" | "kib" => 1 << 10,
        "m" | "mib" => 1 << 20,
        "g" | "gib" => 1 << 30,
        "t" | "tib" => 1 << 40,
        "kb" => 1_000,
        "mb" => 1_000_000,
        "gb" => 1_000_000_000,
        "tb" => 1_000_000_000_000,
        _ => return Err(expected()),
    };
    let (whole, part) = number.split_once('.').unwrap_or((number, ""));
    let is_digits = |text: &str| text.chars().all(|c| c.is_ascii_digit());
    if (whole.is_empty() && part.is_empty()) || !is_digits(part) {
        return Err(expected());
    }
    let whole: u64 = if whole.is_empty() { 0 } else { whole.parse().map_err(|_| expected())? };
    // In whole numbers, so that what is written is what is meant; a part of a byte is left out.
    let digits = &part[..part.len().min(12)];
    let numerator: u128 = if digits.is_empty() { 0 } else { digits.parse().map_err(|_| expected())? };
    let fraction = numerator * u128::from(scale) / 10_u128.pow(digits.len() as u32);
    let bytes = whole.checked_mul(scale).and_then(|bytes| bytes.checked_add(u64::try_from(fraction).ok()?));
    bytes.filter(|&bytes| bytes > 0).ok_or_else(expected)
}

/// Bytes for people.
pub(super) fn bytes_text(bytes: u64) -> String {
    indicatif::HumanBytes(bytes).to_string()
}

/// How many times smaller bytes are than a whole: `1:7.3`.
pub(super) fn part_text(bytes: u64, whole: u64) -> String {
    ratio_text(whole as f64 / bytes.max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::parse_bytes;

    #[test]
    fn units_of_1024_and_of_1000_and_decimals_are_read() {
        for (text, bytes) in [
            ("1000000", 1_000_000),
            ("1b", 1),
            ("512MiB", 512 << 20),
            ("512 mib", 512 << 20),
            ("2G", 2 << 30),
            ("2GiB", 2 << 30),
            ("2GB", 2_000_000_000),
            ("1.5GiB", 3 << 29),
            ("1.5gb", 1_500_000_000),
            (".5k", 512),
            ("1.MB", 1_000_000),
            ("64KB", 64_000),
            ("0.0000001TB", 100_000),
            ("1tib", 1 << 40),
            ("1tb", 1_000_000_000_000),
            ("1mib", 1 << 20),
            ("1kib", 1 << 10),
            // Digits beyond a byte are left out, however many there are.
            ("1.50000000000000000000000000000000000001k", 1536),
            ("16777215TiB", ((1 << 24) - 1) << 40),
        ] {
            assert_eq!(parse_bytes(text), Ok(bytes), "{text}");
        }
    }

    #[test]
    fn anything_else_is_refused_with_what_was_expected() {
        for text in [
            "",
            "GiB",
            "0",
            "0.0001",
            "-1GiB",
            "1,5GiB",
            "1.5.5GiB",
            "1e9",
            "2XB",
            "99999999999999999999",
            ".",
            "1 2",
            "16777216TiB",
            "nan",
            "½GiB",
        ] {
            assert!(parse_bytes(text).is_err_and(|error| error.contains("2GB")), "{text}");
        }
    }
}
