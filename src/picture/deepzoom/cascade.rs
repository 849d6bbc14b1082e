//! All levels of a pyramid from the rows of the picture, from the top down in one go.
//!
//! Each level keeps the display values of the rows that its next tiles need, and of linear values one row at
//! most: every second one waits for its partner. A pixel of a smaller level is the mean, in linear light, of the 2 x 2
//! pixels that it stands for, or at an odd border of the one or two that there are. Nothing is clipped before
//! the display curve.

use super::pyramid::Pyramid;
use crate::error::Result;
use crate::picture::Meaning;
use crate::shape::Size;

/// Receives the tiles of a level, a row of tiles at a time.
pub(crate) trait Sink {
    /// `rows` are the display values of the rows of level `level` that tile row `tile_row` is made of.
    fn tile_row(&self, level: u32, tile_row: usize, rows: &[u8]) -> Result<()>;
}

/// The levels, the largest first.
pub(crate) struct Cascade {
    levels: Vec<Level>,
    meaning: Meaning,
}

struct Level {
    number: u32,
    size: Size,
    /// Display values of the rows from `first` on.
    rows: Vec<u8>,
    first: usize,
    /// Rows received.
    received: usize,
    /// The row of tiles that is made next.
    tile_row: usize,
    /// An even row that waits for its partner.
    waiting: Option<Vec<[f32; 3]>>,
}

impl Cascade {
    pub(crate) fn new(pyramid: &Pyramid, meaning: Meaning) -> Self {
        let level = |number| Level {
            number,
            size: pyramid.level(number),
            rows: Vec::with_capacity(rows_kept(pyramid) * pyramid.level(number).width * 3),
            first: 0,
            received: 0,
            tile_row: 0,
            waiting: None,
        };
        Self { levels: (0..=pyramid.top()).rev().map(level).collect(), meaning }
    }

    /// Memory that the levels of a pyramid take, bytes.
    pub(crate) fn memory_bytes(pyramid: &Pyramid) -> u64 {
        let of_level = |number| {
            let linear = 2 * size_of::<[f32; 3]>();
            pyramid.level(number).width as u64 * (rows_kept(pyramid) * 3 + linear) as u64
        };
        (0..=pyramid.top()).map(of_level).sum()
    }

    /// Takes the next row of the picture and passes on the tiles that it completes.
    pub(crate) fn push(&mut self, pyramid: &Pyramid, row: &[[f32; 3]], sink: &impl Sink) -> Result<()> {
        let mut row = std::borrow::Cow::Borrowed(row);
        for level in &mut self.levels {
            level.take(pyramid, self.meaning, &row, sink)?;
            let last = level.received == level.size.height;
            row = match level.waiting.take() {
                Some(upper) => means(&upper, Some(&row)).into(),
                None if last => means(&row, None).into(),
                None => {
                    level.waiting = Some(row.into_owned());
                    return Ok(());
                }
            };
        }
        Ok(())
    }
}

/// Rows of display values that a level keeps at most.
fn rows_kept(pyramid: &Pyramid) -> usize {
    pyramid.side + 2 * pyramid.overlap
}

impl Level {
    fn take(
        &mut self,
        pyramid: &Pyramid,
        meaning: Meaning,
        row: &[[f32; 3]],
        sink: &impl Sink,
    ) -> Result<()> {
        let row_bytes = 3 * self.size.width;
        let end = self.rows.len();
        self.rows.resize(end + row_bytes, 0);
        meaning.encode(row, &mut self.rows[end..]);
        self.received += 1;
        // Where no more rows are left than tiles share, two rows of tiles are complete at once.
        let tile_rows = pyramid.grid(self.size).height;
        while self.tile_row < tile_rows && self.received == pyramid.span(self.size.height, self.tile_row).end
        {
            sink.tile_row(self.number, self.tile_row, &self.rows)?;
            self.tile_row += 1;
            let kept = pyramid.span(self.size.height, self.tile_row).start.min(self.received);
            self.rows.drain(..(kept - self.first) * row_bytes);
            self.first = kept;
        }
        Ok(())
    }
}

/// Means of two by two pixels of two rows, or of the last row alone.
fn means(upper: &[[f32; 3]], lower: Option<&[[f32; 3]]>) -> Vec<[f32; 3]> {
    let sum = |pair: &[[f32; 3]]| match pair {
        [left, right] => [0, 1, 2].map(|c| left[c] + right[c]),
        _ => pair[0],
    };
    let lower = lower.map(|row| row.chunks(2));
    let mut lower = lower.into_iter().flatten();
    let mean = |pair: &[[f32; 3]]| {
        let (above, below) = (sum(pair), lower.next().map(sum));
        let count = pair.len() * if below.is_some() { 2 } else { 1 };
        let share = 1.0 / count as f32;
        [0, 1, 2].map(|c| (above[c] + below.map_or(0.0, |below| below[c])) * share)
    };
    upper.chunks(2).map(mean).collect()
}
