//! Nested causal contextual neighbourhoods I_r^c, grown by distance.

/// The largest neighbourhood offered for choice reaches this far, squared: 40 sites within radius 5.
const MAX_RADIUS_SQUARED: i32 = 25;

/// Sites s = (dy, dx) of Y_{r-s} in the half plane known before r: rows above (dy > 0, any dx) and texels to the left
/// in the same row (dy = 0, dx > 0). Each set begins with the one before it; a set holds whole rings of equal
/// distance, so it favours no direction. Sizes 2, 4, 6, 10, 12, 14, 18, ... 40.
pub(crate) fn nested() -> Vec<Vec<[i32; 2]>> {
    let mut sites = half_plane();
    sites.sort_by_key(|&[dy, dx]| (dy * dy + dx * dx, dy, dx));
    let mut sets = Vec::new();
    for n in 1..=sites.len() {
        let ends_ring = sites.get(n).is_none_or(|&next| squared(next) != squared(sites[n - 1]));
        if ends_ring {
            sets.push(sites[..n].to_vec());
        }
    }
    sets
}

/// Whether a site lies in the half plane that is known before its texel.
pub(crate) fn is_causal([dy, dx]: [i32; 2]) -> bool {
    dy > 0 || (dy == 0 && dx > 0)
}

/// The farthest row above and the farthest column to either side that the sites reach.
pub(crate) fn reach(sites: &[[i32; 2]]) -> [usize; 2] {
    let farthest = |axis: usize| sites.iter().map(|s| s[axis].unsigned_abs() as usize).max().unwrap_or(0);
    [farthest(0), farthest(1)]
}

fn squared([dy, dx]: [i32; 2]) -> i32 {
    dy * dy + dx * dx
}

fn half_plane() -> Vec<[i32; 2]> {
    let side = MAX_RADIUS_SQUARED.isqrt();
    let all = (0..=side).flat_map(|dy| (-side..=side).map(move |dx| [dy, dx]));
    all.filter(|&site| is_causal(site) && squared(site) <= MAX_RADIUS_SQUARED).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_nested_causal_and_of_the_known_sizes() {
        let sets = nested();
        let sizes: Vec<_> = sets.iter().map(Vec::len).collect();
        assert_eq!(sizes, [2, 4, 6, 10, 12, 14, 18, 22, 24, 28, 30, 34, 40]);
        for pair in sets.windows(2) {
            assert!(pair[1].starts_with(&pair[0]));
        }
        assert!(sets.iter().flatten().all(|&site| is_causal(site)));
        assert_eq!(sets[1], [[0, 1], [1, 0], [1, -1], [1, 1]]);
    }

    #[test]
    fn every_site_or_its_opposite_belongs_to_the_largest_set_but_not_both() {
        let sets = nested();
        let largest = &sets[sets.len() - 1];
        for dy in -5..=5_i32 {
            for dx in -5..=5_i32 {
                let held = [[dy, dx], [-dy, -dx]].iter().filter(|site| largest.contains(site)).count();
                let inside = (dy, dx) != (0, 0) && dy * dy + dx * dx <= 25;
                assert_eq!(held, usize::from(inside), "({dy}, {dx})");
            }
        }
    }

    #[test]
    fn reach_is_the_farthest_row_and_column() {
        assert_eq!(reach(&[[0, 3], [1, -4], [2, 1]]), [2, 4]);
        assert_eq!(reach(&[]), [0, 0]);
    }
}
