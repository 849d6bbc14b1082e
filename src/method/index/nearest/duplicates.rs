//! Texels of equal normals: they are searched as one and told apart afterwards.

use super::tree::squared_distance;

/// The distinct normals of a tile, in the order of the first texel of each, and the texels of each.
pub(super) struct Duplicates {
    pub(super) normals: Vec<[f32; 3]>,
    /// Where the texels of each begin, and where those of the last end.
    starts: Vec<u32>,
    /// Ascending for each normal, at most as many as are ever wanted.
    texels: Vec<u32>,
}

impl Duplicates {
    /// Of normals whose order gives the texel numbers, for the `count` nearest.
    pub(super) fn new(normals: &[[f32; 3]], count: usize) -> Self {
        let bits = |texel: u32| normals[texel as usize].map(f32::to_bits);
        let mut order: Vec<u32> = (0..normals.len() as u32).collect();
        order.sort_unstable_by_key(|&texel| (bits(texel), texel));
        let mut groups: Vec<&[u32]> = order.chunk_by(|&a, &b| bits(a) == bits(b)).collect();
        groups.sort_unstable_by_key(|group| group[0]);
        let mut duplicates = Self { normals: Vec::new(), starts: vec![0], texels: Vec::new() };
        for group in groups {
            duplicates.normals.push(normals[group[0] as usize]);
            duplicates.texels.extend(&group[..group.len().min(count)]);
            duplicates.starts.push(duplicates.texels.len() as u32);
        }
        duplicates
    }

    /// Whether every normal has one texel, so that their numbers are the same.
    pub(super) fn are_none(&self) -> bool {
        self.texels.len() == self.normals.len() && self.texels.iter().zip(0..).all(|(&texel, n)| texel == n)
    }

    /// Puts texels in the place of the distinct normals nearest to a query, as many as there is room for. `buffer` is
    /// overwritten.
    pub(super) fn tell_apart(&self, query: [f32; 3], found: &mut [u32], buffer: &mut Vec<(f64, u32)>) {
        buffer.clear();
        let mut ties = false;
        for &number in found.iter() {
            let Some(&normal) = self.normals.get(number as usize) else { break };
            let distance = squared_distance(query, normal);
            let ties_with_last = buffer.last().is_some_and(|&(last, _)| last == distance);
            if buffer.len() >= found.len() && !ties_with_last {
                break;
            }
            ties |= ties_with_last;
            let [from, to] = [0, 1].map(|end| self.starts[number as usize + end] as usize);
            buffer.extend(self.texels[from..to].iter().map(|&texel| (distance, texel)));
        }
        if ties {
            // The distinct normals of a tie that did not find room begin with later texels than those that did.
            buffer.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        }
        for (found, &(_, texel)) in found.iter_mut().zip(&*buffer) {
            *found = texel;
        }
    }

    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&self.normals[..]) + size_of_val(&self.starts[..]) + size_of_val(&self.texels[..])
    }
}
