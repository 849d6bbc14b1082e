//! Places of a grid in C order: the last axis runs fastest.

/// The places from the corner `first` up to, not with, `end`; none where an axis is empty.
pub(super) fn places(first: &[u64], end: &[u64]) -> impl Iterator<Item = Vec<u64>> {
    let (first, end) = (first.to_vec(), end.to_vec());
    let is_empty = first.iter().zip(&end).any(|(first, end)| first >= end);
    let begin = (!is_empty).then(|| first.clone());
    std::iter::successors(begin, move |place| {
        let mut next = place.clone();
        advance(&mut next, &first, &end).then_some(next)
    })
}

/// The next place between two corners; false after the last.
pub(super) fn advance(place: &mut [u64], first: &[u64], end: &[u64]) -> bool {
    for axis in (0..place.len()).rev() {
        place[axis] += 1;
        if place[axis] < end[axis] {
            return true;
        }
        place[axis] = first[axis];
    }
    false
}

#[cfg(test)]
mod tests {
    use super::places;

    #[test]
    fn places_come_in_c_order_and_an_empty_axis_has_none() {
        let found: Vec<_> = places(&[1, 0, 2], &[3, 2, 4]).collect();
        let expected: Vec<_> =
            (1..3).flat_map(|a| (0..2).flat_map(move |b| (2..4).map(move |c| vec![a, b, c]))).collect();
        assert_eq!(found, expected);
        assert_eq!(places(&[0, 3], &[2, 3]).count(), 0);
        assert_eq!(places(&[], &[]).count(), 1, "a single element has one place");
    }
}
