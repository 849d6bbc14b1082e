//! Minimum-error paths through an overlap.

/// Finds the path of least total cost through a strip of `length` steps and `breadth` places,
/// moving by at most one place a step.
///
/// `cost` is laid out [step][place]. Ties go to the smaller place. Returns the place at each step
/// and the total cost. With `closed`, the last place is also within one of the first, so that the
/// path joins itself where a strip wraps.
pub(crate) fn least_path(cost: &[u64], length: usize, breadth: usize, closed: bool) -> (Vec<usize>, u64) {
    if !closed {
        return least_path_between(cost, length, breadth, None);
    }
    (0..breadth)
        .map(|start| least_path_between(cost, length, breadth, Some(start)))
        .min_by_key(|(_, total)| *total)
        .unwrap_or_default()
}

/// The least path that starts at `start` and ends within one place of it, or anywhere.
fn least_path_between(
    cost: &[u64],
    length: usize,
    breadth: usize,
    start: Option<usize>,
) -> (Vec<usize>, u64) {
    const CLOSED_OFF: u64 = u64::MAX / 4;
    let mut total: Vec<u64> = (0..breadth)
        .map(|place| if start.is_none_or(|start| start == place) { cost[place] } else { CLOSED_OFF })
        .collect();
    let mut came_from = vec![0u8; length * breadth];
    for step in 1..length {
        let row = &cost[step * breadth..(step + 1) * breadth];
        let mut next = vec![0; breadth];
        for place in 0..breadth {
            let (from, best) = (place.saturating_sub(1)..=(place + 1).min(breadth - 1))
                .map(|from| (from, total[from]))
                .min_by_key(|(_, sum)| *sum)
                .unwrap_or((place, CLOSED_OFF));
            next[place] = best.saturating_add(row[place]);
            came_from[step * breadth + place] = (from + 1 - place) as u8;
        }
        total = next;
    }
    let end = (0..breadth)
        .filter(|&place| start.is_none_or(|start| start.abs_diff(place) <= 1))
        .min_by_key(|&place| total[place])
        .unwrap_or(0);
    let mut path = vec![end; length];
    for step in (1..length).rev() {
        path[step - 1] = path[step] + usize::from(came_from[step * breadth + path[step]]) - 1;
    }
    (path, total[end])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_path_follows_the_valley() {
        let cost = [9, 1, 9, 9, 9, 1, 9, 9, 9, 9, 1, 9, 9, 1, 9, 9];
        assert_eq!(least_path(&cost, 4, 4, false), (vec![1, 1, 2, 1], 4));
    }

    #[test]
    fn a_closed_path_joins_itself() {
        // The open path drifts from place 0 to place 3; closed, it must return.
        let cost = [0, 5, 5, 5, 5, 0, 5, 5, 5, 5, 0, 5, 5, 5, 5, 0];
        assert_eq!(least_path(&cost, 4, 4, false).0, [0, 1, 2, 3]);
        let (path, total) = least_path(&cost, 4, 4, true);
        assert!(path[0].abs_diff(path[3]) <= 1, "{path:?}");
        assert_eq!(total, path.iter().enumerate().map(|(step, place)| cost[step * 4 + place]).sum::<u64>());
    }

    #[test]
    fn no_path_found_by_brute_force_is_cheaper() {
        let cost: Vec<u64> = (0..5 * 4).map(|i| (i * 7919 % 31) as u64).collect();
        let mut best = u64::MAX;
        for code in 0..4usize.pow(5) {
            let path: Vec<usize> = (0..5).map(|step| code / 4usize.pow(step) % 4).collect();
            if path.windows(2).all(|pair| pair[0].abs_diff(pair[1]) <= 1) {
                best = best.min(path.iter().enumerate().map(|(step, place)| cost[step * 4 + place]).sum());
            }
        }
        assert_eq!(least_path(&cost, 5, 4, false).1, best);
    }
}
