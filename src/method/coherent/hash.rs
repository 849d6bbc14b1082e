//! The hash of a place, in 32-bit whole numbers that a browser's GPU has too.

/// A bijection of 32-bit words in which every bit depends on all (constants by C. Wellons' search).
#[inline]
pub(crate) fn mix(mut word: u32) -> u32 {
    word ^= word >> 16;
    word = word.wrapping_mul(0x21f0_aaad);
    word ^= word >> 15;
    word = word.wrapping_mul(0xd35a_2d97);
    word ^ (word >> 15)
}

/// The key of the level whose texels lie 2^`level` apart.
pub fn key(seed: u32, level: u32) -> u32 {
    mix(mix(seed).wrapping_add(level))
}

/// Two numbers of 16 bits for a place of a level: the first moves rows, the second columns.
#[inline]
pub fn place(key: u32, y: i32, x: i32) -> [i32; 2] {
    in_column(column(key, x), y)
}

/// What the places of a column have in common.
#[inline]
pub(super) fn column(key: u32, x: i32) -> u32 {
    mix(key ^ x as u32)
}

/// [`place`] of a row of a column.
#[inline]
pub(super) fn in_column(column: u32, y: i32) -> [i32; 2] {
    let word = mix(column ^ (y as u32).wrapping_mul(0x9E37_79B1));
    [(word >> 16) as i32, (word & 0xFFFF) as i32]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vectors_of_the_specification() {
        for (seed, level, y, x, expected) in [
            (1, 5, 0, 0, 0x47ef_72e0u32),
            (1, 0, -1, 7, 0x6f0f_92f9),
            (7, 3, -500, 12345, 0xa683_5104),
            (u32::MAX, 9, i32::MIN, i32::MAX, 0x1fd7_9704),
        ] {
            let [high, low] = place(key(seed, level), y, x);
            assert_eq!(
                (high as u32) << 16 | low as u32,
                expected,
                "seed {seed} level {level} place {y}, {x}"
            );
        }
    }
}
