//! Words for numbers in messages.

use std::fmt::Display;

/// `1 view`, `9 views`: a number and what it counts, whose plural follows the rules of English.
pub fn counted<N: Copy + Display + PartialEq + From<u8>>(number: N, thing: &str) -> String {
    if number == N::from(1) { format!("{number} {thing}") } else { format!("{number} {}", plural(thing)) }
}

/// The plural of the last word of a name.
fn plural(thing: &str) -> String {
    let ends = |endings: &[&str]| endings.iter().any(|ending| thing.ends_with(ending));
    match thing.strip_suffix('y') {
        Some(stem) if !ends(&["ay", "ey", "oy", "uy"]) => format!("{stem}ies"),
        _ if ends(&["s", "x", "ch", "sh"]) => format!("{thing}es"),
        _ => format!("{thing}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::counted;

    #[test]
    fn one_is_singular_and_every_other_number_is_not() {
        let told = [0_u64, 1, 2].map(|number| counted(number, "level"));
        assert_eq!(told, ["0 levels", "1 level", "2 levels"]);
        assert_eq!(counted(1_usize, "damaged chunk"), "1 damaged chunk");
        let several = ["copy", "way", "batch", "index"].map(|thing| counted(3_u32, thing));
        assert_eq!(several, ["3 copies", "3 ways", "3 batches", "3 indexes"]);
    }
}
