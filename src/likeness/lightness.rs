use super::{mean, variance};
use crate::shape::{Size, Window};

/// A picture of L* values, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Lightness {
    /// Rows and columns.
    pub size: Size,
    /// Values, row by row; of L* from 0 to 100.
    pub values: Vec<f64>,
}

impl Lightness {
    /// A picture of values.
    pub fn new(size: Size, values: Vec<f64>) -> Self {
        debug_assert_eq!(values.len(), size.texels());
        Self { size, values }
    }

    /// A picture of L* codes, round(2.55 L*).
    pub fn of_codes(size: Size, codes: impl IntoIterator<Item = u8>) -> Self {
        Self::new(size, codes.into_iter().map(|code| f64::from(code) / 2.55).collect())
    }

    /// A part of it.
    pub fn part(&self, window: Window) -> Self {
        let rows = self.values.chunks_exact(self.size.width).skip(window.y).take(window.size.height);
        let values = rows.flat_map(|row| &row[window.x..window.x + window.size.width]).copied().collect();
        Self { size: window.size, values }
    }

    /// The part of another size, whose first texel is at a row and column, of the plane that repeats it.
    pub fn repeated(&self, y: usize, x: usize, size: Size) -> Self {
        let value = |n: usize| {
            let (row, column) = (y + n / size.width, x + n % size.width);
            self.values[row % self.size.height * self.size.width + column % self.size.width]
        };
        Self { size, values: (0..size.texels()).map(value).collect() }
    }

    /// Mean of its values.
    pub fn mean(&self) -> f64 {
        mean(&self.values)
    }

    /// Standard deviation of its values.
    pub(crate) fn deviation(&self) -> f64 {
        variance(&self.values).sqrt()
    }

    /// Means of squares of `side` texels; what is left over at the right and below is left out.
    pub(super) fn reduced(&self, side: usize) -> Self {
        let size = Size::new(self.size.height / side, self.size.width / side);
        let mut values = vec![0.0; size.texels()];
        for (row, to) in values.chunks_exact_mut(size.width).enumerate() {
            for down in 0..side {
                let from = &self.values[(row * side + down) * self.size.width..][..size.width * side];
                for (to, square) in to.iter_mut().zip(from.chunks_exact(side)) {
                    *to += square.iter().sum::<f64>();
                }
            }
        }
        values.iter_mut().for_each(|value| *value /= (side * side) as f64);
        Self { size, values }
    }
}
