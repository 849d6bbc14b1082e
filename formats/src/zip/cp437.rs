//! Names in the character set of the first IBM PC, which zips have where no flag says UTF-8 (APPNOTE, appendix D).

/// The characters of the bytes from 128; those below are ASCII.
const UPPER: &str = "ÇüéâäàåçêëèïîìÄÅÉæÆôöòûùÿÖÜ¢£¥₧ƒáíóúñÑªº¿⌐¬½¼¡«»░▒▓│┤╡╢╖╕╣║╗╝╜╛┐└┴┬├─┼╞╟╚╔╩╦╠═╬╧╨╤╥╙╘╒╓╫╪┘┌█▄▌▐▀αßΓπΣσµτΦΘΩδ∞φε∩≡±≥≤⌠⌡÷≈°∙·√ⁿ²■\u{a0}";

/// The text that these bytes are in code page 437.
pub(super) fn decode(bytes: &[u8]) -> String {
    let upper: Vec<char> = UPPER.chars().collect();
    let character = |&byte: &u8| {
        let above = byte.checked_sub(128).and_then(|at| upper.get(usize::from(at)));
        above.copied().unwrap_or(char::from(byte))
    };
    bytes.iter().map(character).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_is_a_character_of_its_own() {
        assert_eq!(UPPER.chars().count(), 128);
        let all: Vec<u8> = (0..=255).collect();
        let text = decode(&all);
        let distinct: std::collections::HashSet<char> = text.chars().collect();
        assert_eq!(distinct.len(), 256);
        assert_eq!(decode(b"Gr\x81n \xe1"), "Grün ß");
    }
}
