//! The colour of a material at a place of its texture, seen from one direction and lit from another.

use btfkit_formats::Direction;

use super::locate::{Located, Locator};
use super::table::{ClusterTable, Mixture, Tinted, Values};
use crate::error::{Error, Result};
use crate::shape::Size;

/// Which entry of a model each texel of a texture is. Column 0, row 0 is the top left texel.
pub trait Texels {
    /// The entry of a texel, of any column and row: a texture says itself how it goes on beyond its borders.
    ///
    /// # Errors
    /// Those of reading or making the texture.
    fn entry(&mut self, column: i64, row: i64) -> Result<usize>;
}

/// An index that lies in memory.
#[derive(Clone, Copy, Debug)]
pub struct Whole<'a> {
    size: Size,
    wraps: bool,
    index: &'a [u16],
}

impl<'a> Whole<'a> {
    /// `index` [y, x]; where it `wraps` it repeats, else its border goes on.
    ///
    /// # Errors
    /// An index of another size, or of no texel.
    pub fn new(size: Size, wraps: bool, index: &'a [u16]) -> Result<Self> {
        if index.len() != size.texels() || index.is_empty() {
            return Err(Error::input(format!("an index of {} texels is none of {size}", index.len())));
        }
        Ok(Self { size, wraps, index })
    }
}

impl Texels for Whole<'_> {
    #[inline]
    fn entry(&mut self, column: i64, row: i64) -> Result<usize> {
        let within = |place: i64, side: usize| place_within(place, side, self.wraps);
        let at = within(row, self.size.height) * self.size.width + within(column, self.size.width);
        Ok(usize::from(self.index[at]))
    }
}

/// A place within a side that repeats, or whose border goes on.
#[inline]
pub(crate) fn place_within(place: i64, side: usize, wraps: bool) -> usize {
    let side = side as i64;
    match place {
        place if (0..side).contains(&place) => place as usize,
        place if wraps => place.rem_euclid(side) as usize,
        place => place.clamp(0, side - 1) as usize,
    }
}

/// A material: its values, and the directions that they were measured under.
pub struct Evaluator<V = ClusterTable> {
    views: Locator,
    lights: Locator,
    values: V,
}

impl<V: Values> Evaluator<V> {
    /// `views` and `lights` with their triangles, as a model stores them.
    pub fn new(views: (&[Direction], &[[u16; 3]]), lights: (&[Direction], &[[u16; 3]]), values: V) -> Self {
        Self { views: Locator::new(views.0, views.1), lights: Locator::new(lights.0, lights.1), values }
    }

    /// The measured views that stand for a unit vector in the frame of the surface: x right, y up, z out of it.
    #[inline]
    pub fn view(&self, view: [f32; 3]) -> Located {
        self.views.locate(view)
    }

    /// The measured lights that stand for one.
    #[inline]
    pub fn light(&self, light: [f32; 3]) -> Located {
        self.lights.locate(light)
    }

    /// How many lights were measured.
    pub fn lights(&self) -> usize {
        self.lights.directions()
    }

    /// Its values.
    pub fn values(&self) -> &V {
        &self.values
    }

    /// Linear RGB at a place (columns to the right and rows down, in texels; the middle of the first texel is 0.5, 0.5)
    /// under a white light. Both directions are unit vectors in the frame of the surface, and neither is below it.
    ///
    /// # Errors
    /// Those of [`Texels::entry`].
    #[inline]
    pub fn value(
        &self,
        texels: &mut impl Texels,
        place: [f64; 2],
        view: [f32; 3],
        light: [f32; 3],
    ) -> Result<[f32; 3]> {
        let (view, light) = (self.view(view), self.light(light));
        self.at(texels, place, &Mixture { views: &view.shares, lights: &tinted(&light, [1.0; 3]) })
    }

    /// The same for views and lights that were located: bilinear between the four texels around the place, whose values
    /// are looked up and mixed first, as indices cannot be averaged.
    ///
    /// # Errors
    /// Those of [`Texels::entry`].
    #[inline]
    pub fn at(&self, texels: &mut impl Texels, [u, v]: [f64; 2], mixture: &Mixture<'_>) -> Result<[f32; 3]> {
        let [(column, right), (row, down)] = [u, v].map(|place| {
            let first = (place - 0.5).floor();
            (first as i64, (place - 0.5 - first) as f32)
        });
        let mut sum = [0.0f32; 3];
        for (below, by_row) in [(0, 1.0 - down), (1, down)] {
            for (beside, by_column) in [(0, 1.0 - right), (1, right)] {
                let weight = by_row * by_column;
                if weight > 0.0 {
                    let entry = texels.entry(column + beside, row + below)?;
                    let value = self.values.of(entry, mixture);
                    sum = std::array::from_fn(|c| sum[c] + weight * value[c]);
                }
            }
        }
        Ok(sum)
    }

    /// Linear RGB of every entry under lights and views that are the same everywhere: a flat picture seen and lit from
    /// afar is a look-up in it.
    pub fn palette(&self, mixture: &Mixture<'_>) -> Vec<[f32; 3]> {
        (0..self.values.entries()).map(|entry| self.values.of(entry, mixture)).collect()
    }
}

/// A located light with a colour.
#[inline]
pub fn tinted(light: &Located, color: [f32; 3]) -> [Tinted; 3] {
    light.shares.map(|share| {
        let [r, g, b] = color.map(|channel| channel * share.weight * light.cosine_ratio);
        Tinted { number: share.number, weights: [r, g, b, 0.0] }
    })
}

/// A flat picture: the colour of each texel's entry.
///
/// # Errors
/// An entry beyond the palette, and a picture of another size than the index.
pub fn look_up<T: Copy>(index: &[u16], palette: &[T], picture: &mut [T]) -> Result<()> {
    if index.len() != picture.len() {
        return Err(Error::internal("a picture of another size than its index"));
    }
    expect_entries(index, palette.len())?;
    let Some(&last) = palette.last() else { return Ok(()) };
    // Padded to what a number can be, so that none has to be checked while colours are copied.
    if let Some(narrow) = padded::<T, 256>(palette, last) {
        index.iter().zip(picture).for_each(|(&entry, to)| *to = narrow[usize::from(entry as u8)]);
    } else {
        index.iter().zip(picture).for_each(|(&entry, to)| *to = palette[usize::from(entry)]);
    }
    Ok(())
}

/// Checks that a model has all clusters that an index refers to.
///
/// # Errors
/// Where it has not.
pub(crate) fn expect_entries(index: &[u16], clusters: usize) -> Result<()> {
    match index.iter().max() {
        Some(&cluster) if usize::from(cluster) >= clusters => Err(Error::input(format!(
            "the index refers to cluster {cluster}, beyond the {clusters} of the model"
        ))),
        _ => Ok(()),
    }
}

/// A palette with so many colours, where it has no more.
fn padded<T: Copy, const N: usize>(palette: &[T], last: T) -> Option<[T; N]> {
    (palette.len() <= N).then(|| std::array::from_fn(|n| palette.get(n).copied().unwrap_or(last)))
}
