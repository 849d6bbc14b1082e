//! The sorting networks, written once for each set of instructions.

/// Compares pairs of keys one by one, the lesser to the first place. Written out, so that keys stay in registers.
macro_rules! compare {
    ($keys:ident, $min:ident, $max:ident: $(($a:literal, $b:literal))*) => {
        $(($keys[$a], $keys[$b]) = ($min($keys[$a], $keys[$b]), $max($keys[$a], $keys[$b]));)*
    };
}

/// Defines the parts of a kernel that need no shuffling.
macro_rules! networks {
    ($features:literal, $register:ty, $min:ident, $max:ident, $sub:ident) => {
        /// The keys in order, lane by lane.
        #[target_feature(enable = $features)]
        #[inline]
        fn sort(mut keys: [$register; RANKS]) -> [$register; RANKS] {
            // Sixty comparisons (Green 1969).
            compare! { keys, $min, $max:
                (0, 1) (2, 3) (4, 5) (6, 7) (8, 9) (10, 11) (12, 13) (14, 15)
                (0, 2) (4, 6) (8, 10) (12, 14) (1, 3) (5, 7) (9, 11) (13, 15)
                (0, 4) (8, 12) (1, 5) (9, 13) (2, 6) (10, 14) (3, 7) (11, 15)
                (0, 8) (1, 9) (2, 10) (3, 11) (4, 12) (5, 13) (6, 14) (7, 15)
                (5, 10) (6, 9) (3, 12) (13, 14) (4, 8) (7, 11) (1, 2)
                (1, 4) (7, 13) (2, 8) (11, 14)
                (2, 4) (5, 6) (9, 10) (11, 13) (3, 8) (7, 12)
                (6, 8) (10, 12) (3, 5) (7, 9)
                (3, 4) (5, 6) (7, 8) (9, 10) (11, 12)
                (6, 7) (8, 9)
            }
            keys
        }

        /// The lower half of two runs of keys in order, in order, and the least of the upper half.
        #[target_feature(enable = $features)]
        #[inline]
        fn lower_half(a: &[$register; RANKS], b: &[$register; RANKS]) -> ([$register; RANKS], $register) {
            // One run backwards after the other rises and falls once: of such a run, the minima and maxima of its
            // halves are again two, none of the first above any of the second.
            let mut keys = *a;
            let mut next = $max(a[0], b[RANKS - 1]);
            for rank in 0..RANKS {
                keys[rank] = $min(a[rank], b[RANKS - 1 - rank]);
                next = $min(next, $max(a[rank], b[RANKS - 1 - rank]));
            }
            compare! { keys, $min, $max:
                (0, 8) (1, 9) (2, 10) (3, 11) (4, 12) (5, 13) (6, 14) (7, 15)
                (0, 4) (1, 5) (2, 6) (3, 7) (8, 12) (9, 13) (10, 14) (11, 15)
                (0, 2) (1, 3) (4, 6) (5, 7) (8, 10) (9, 11) (12, 14) (13, 15)
                (0, 1) (2, 3) (4, 5) (6, 7) (8, 9) (10, 11) (12, 13) (14, 15)
            }
            (keys, next)
        }

        /// The least keys of three unsorted runs, in order, and the least difference of keys that follow each other
        /// among them and the next one.
        #[target_feature(enable = $features)]
        #[inline]
        fn least(runs: [[$register; RANKS]; 3]) -> ([$register; RANKS], $register) {
            let [a, b, c] = runs;
            let (ab, next_ab) = lower_half(&sort(a), &sort(b));
            let (keys, next) = lower_half(&ab, &sort(c));
            let mut gap = $sub($min(next, next_ab), keys[RANKS - 1]);
            for rank in 1..RANKS {
                gap = $min(gap, $sub(keys[rank], keys[rank - 1]));
            }
            (keys, gap)
        }
    };
}
