//! Pictures of what is not light: cluster numbers, normals, seams, differences.

use crate::picture::Picture;
use crate::shape::Size;

/// A colour for each cluster that says how light it is among all of them, from dark blue over green to light yellow.
/// `colors` are the linear RGB of the clusters, results display RGB.
pub(crate) fn by_lightness(colors: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let luminance = |cluster: usize| {
        let [red, green, blue] = colors[cluster];
        0.2126 * red + 0.7152 * green + 0.0722 * blue
    };
    let mut order: Vec<usize> = (0..colors.len()).collect();
    order.sort_by(|&a, &b| luminance(a).total_cmp(&luminance(b)));
    let mut ramp = vec![[0.0; 3]; colors.len()];
    for (rank, &cluster) in order.iter().enumerate() {
        let at = rank as f64 / colors.len().max(2).saturating_sub(1) as f64;
        ramp[cluster] = hsv(0.68 - 0.53 * at, 0.85 - 0.35 * at, 0.35 + 0.65 * at);
    }
    ramp
}

/// Normals as (n + 1) / 2: x to the right in red, y upwards in green, z towards the viewer in blue.
pub fn normals(size: Size, normals: &[[f32; 3]]) -> Picture {
    Picture::display(size, normals.iter().map(|normal| normal.map(|n| (n + 1.0) / 2.0)).collect())
}

/// A picture with the texels taken from beyond a border tinted: beyond the right one (bit 0) orange,
/// beyond the bottom one (bit 1) blue.
pub fn seams(picture: &Picture, beyond: &[u8]) -> Picture {
    let bytes = picture.bytes();
    let pixels = bytes
        .chunks_exact(3)
        .zip(beyond)
        .map(|(pixel, &beyond)| {
            let tint = match beyond & 3 {
                1 => [1.0, 0.55, 0.1],
                2 => [0.15, 0.5, 1.0],
                3 => [0.75, 0.3, 0.9],
                _ => [0.0; 3],
            };
            let share = if beyond == 0 { 0.0 } else { 0.5 };
            std::array::from_fn(|c| (1.0 - share) * f32::from(pixel[c]) / 255.0 + share * tint[c])
        })
        .collect();
    Picture::display(picture.size, pixels)
}

/// Differences of two pictures in display values, `gain` times, around mid grey.
pub fn difference(first: &Picture, second: &Picture, gain: f32) -> Picture {
    let pixels = first
        .bytes()
        .chunks_exact(3)
        .zip(second.bytes().chunks_exact(3))
        .map(|(a, b)| std::array::from_fn(|c| 0.5 + gain * (f32::from(b[c]) - f32::from(a[c])) / 255.0))
        .collect();
    Picture::display(first.size, pixels)
}

/// Display RGB of hue, saturation and value, all 0..1.
fn hsv(hue: f64, saturation: f64, value: f64) -> [f32; 3] {
    [5.0, 3.0, 1.0].map(|n| {
        let k = (n + hue * 6.0) % 6.0;
        (value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0)) as f32
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lighter_clusters_have_lighter_colours() {
        // Green counts more than red, and red more than blue.
        let colors = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3], [1.0, 0.0, 0.0]];
        let ramp = by_lightness(&colors);
        let lightest: Vec<f32> =
            [2, 1, 3, 0].map(|cluster: usize| ramp[cluster].iter().copied().fold(0.0, f32::max)).to_vec();
        assert!(lightest.is_sorted_by(|a, b| a < b), "{lightest:?}");
    }
}
