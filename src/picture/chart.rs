//! A chart of lines on logarithmic axes: what halves and doubles lies on a straight line.

use super::Picture;
use super::drawing::{Canvas, INK, text_size};
use crate::shape::Size;

/// Size of a chart.
pub const SIZE: Size = Size { height: 600, width: 900 };

/// The frame: first and last row, first and last column.
const ROWS: [usize; 2] = [64, 520];
const COLUMNS: [usize; 2] = [96, 876];

/// Columns between the frame and the first and last point; right of the last one is room for its label.
const INDENT: [usize; 2] = [36, 84];

/// Least space between two labels of an axis.
const APART: usize = 10;

/// Fewest numbers on the upright axis, where they find room.
const FEWEST_NUMBERS: usize = 5;

/// Tenths of what numbers on an axis may begin with, from few to many.
const SERIES: [&[i32]; 4] = [
    &[10],
    &[10, 20, 50],
    &[10, 15, 20, 30, 40, 50, 70],
    &[10, 12, 14, 16, 18, 20, 25, 30, 35, 40, 45, 50, 60, 70, 80, 90],
];

const GRID: [f32; 3] = [0.88, 0.88, 0.9];

/// Colours of the lines, over and over.
const CURVES: [[f32; 3]; 7] = [
    [0.1, 0.35, 0.7],
    [0.8, 0.3, 0.1],
    [0.1, 0.5, 0.3],
    [0.55, 0.2, 0.6],
    [0.6, 0.45, 0.0],
    [0.3, 0.3, 0.3],
    [0.8, 0.1, 0.45],
];

/// A chart of one line or several.
#[derive(Clone, Debug)]
pub struct Chart {
    /// What is shown.
    pub title: String,
    /// What lies to the right.
    pub right: String,
    /// What lies upwards.
    pub up: String,
    /// What the labels of points mean.
    pub labels: String,
    /// The points of each line from left to right. Those that no logarithm holds, of 0 or less, are left out.
    pub lines: Vec<Vec<Point>>,
}

/// A point of a line.
#[derive(Clone, Debug)]
pub struct Point {
    /// Where it lies to the right; a number on the axis tells it.
    pub x: f64,
    /// Where it lies upwards.
    pub y: f64,
    /// What is written beside it.
    pub label: String,
}

/// A logarithmic axis: values from first to last at pixels from first to last.
struct Axis {
    values: [f64; 2],
    pixels: [usize; 2],
}

impl Axis {
    fn at(&self, value: f64) -> usize {
        let [first, last] = self.values;
        let share = if last > first { (value / first).ln() / (last / first).ln() } else { 0.5 };
        let [from, to] = self.pixels.map(|pixel| pixel as f64);
        (from + share * (to - from)).round() as usize
    }

    fn pixels_between(&self, first: f64, last: f64) -> usize {
        self.at(first).abs_diff(self.at(last))
    }

    /// Round numbers on the axis as they are written, as few as are enough.
    fn numbers(&self, height: usize) -> Vec<(f64, String)> {
        let mut found = Vec::new();
        for series in SERIES {
            let more = self.numbers_of(series);
            let crowded =
                more.windows(2).any(|pair| self.pixels_between(pair[0].0, pair[1].0) < height + APART);
            if crowded && !found.is_empty() {
                break;
            }
            found = more;
            if found.len() >= FEWEST_NUMBERS {
                break;
            }
        }
        found
    }

    fn numbers_of(&self, series: &[i32]) -> Vec<(f64, String)> {
        let [first, last] = self.values;
        let decades = first.log10().floor() as i32..=last.log10().floor() as i32;
        let numbers = decades.flat_map(|decade| {
            series.iter().map(move |&tenths| {
                let value = f64::from(tenths) / 10.0 * 10f64.powi(decade);
                let digits = decade.min(0).unsigned_abs() as usize + usize::from(tenths % 10 != 0);
                // Above 10 all of them are whole.
                let digits = if decade > 0 { 0 } else { digits };
                (value, format!("{value:.digits$}"))
            })
        });
        numbers.filter(|(value, _)| (first..=last).contains(value)).collect()
    }
}

impl Chart {
    /// The chart as a picture.
    pub fn draw(&self) -> Picture {
        let mut canvas = Canvas::new(SIZE);
        let shown = |line: &'_ Vec<Point>| {
            line.iter().filter(|point| point.x > 0.0 && point.y > 0.0).cloned().collect()
        };
        let lines: Vec<Vec<Point>> = self.lines.iter().map(shown).collect();
        let mut points: Vec<&Point> = lines.iter().flatten().collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        let (right, up) = (Self::right_axis(&points), Self::up_axis(&points));
        Self::draw_right_axis(&mut canvas, &right, &points);
        Self::draw_up_axis(&mut canvas, &up);
        for (row, column) in [([0, 1], [0, 0]), ([1, 1], [0, 1]), ([0, 1], [1, 1]), ([0, 0], [0, 1])] {
            canvas.line([ROWS[row[0]], COLUMNS[column[0]]], [ROWS[row[1]], COLUMNS[column[1]]], 1, INK);
        }
        self.draw_names(&mut canvas);
        let place = |point: &Point| [up.at(point.y), right.at(point.x)];
        for (line, color) in lines.iter().zip(CURVES.into_iter().cycle()) {
            for pair in line.windows(2) {
                canvas.line(place(&pair[0]), place(&pair[1]), 2, color);
            }
            line.iter().for_each(|point| canvas.disc(place(point), 4, color));
        }
        for point in lines.iter().flatten() {
            draw_label(&mut canvas, place(point), &point.label);
        }
        canvas.into_picture()
    }

    fn right_axis(points: &[&Point]) -> Axis {
        let xs = points.iter().map(|point| point.x);
        let values = [xs.clone().fold(f64::INFINITY, f64::min), xs.fold(0.0, f64::max)];
        let pixels = [COLUMNS[0] + INDENT[0], COLUMNS[1] - INDENT[1]];
        Axis { values: if points.is_empty() { [1.0, 1.0] } else { values }, pixels }
    }

    fn up_axis(points: &[&Point]) -> Axis {
        let ys = points.iter().map(|point| point.y);
        let [least, most] = [ys.clone().fold(f64::INFINITY, f64::min), ys.fold(0.0, f64::max)];
        let [least, most] = if points.is_empty() { [1.0, 1.0] } else { [least, most] };
        // A little more than the values, and where they hardly differ enough that they look so.
        let more = (1.05 * (most / least).powf(0.05)).max((2.0 / (most / least)).sqrt());
        Axis { values: [least / more, most * more], pixels: [ROWS[1], ROWS[0]] }
    }

    /// Numbers below every point, or below every second, fourth and so on where they are many.
    fn draw_right_axis(canvas: &mut Canvas, axis: &Axis, points: &[&Point]) {
        let numbers: Vec<(usize, String)> =
            points.iter().map(|point| (axis.at(point.x), point.x.to_string())).collect();
        let width = |text: &str| text_size(2, text).width;
        let crowded = |every: usize| {
            let shown: Vec<&(usize, String)> = numbers.iter().step_by(every).collect();
            shown.windows(2).any(|pair| {
                let least = (width(&pair[0].1) + width(&pair[1].1)) / 2 + APART;
                pair[0].0.abs_diff(pair[1].0) < least
            })
        };
        let mut every = 1;
        while crowded(every) {
            every *= 2;
        }
        for (number, (column, text)) in numbers.iter().enumerate() {
            canvas.line([ROWS[0], *column], [ROWS[1], *column], 1, GRID);
            if number % every == 0 {
                canvas.line([ROWS[1], *column], [ROWS[1] + 6, *column], 1, INK);
                canvas.large_text([ROWS[1] + 12, column.saturating_sub(width(text) / 2)], 2, text);
            }
        }
    }

    fn draw_up_axis(canvas: &mut Canvas, axis: &Axis) {
        for (value, text) in axis.numbers(text_size(2, "0").height) {
            let row = axis.at(value);
            canvas.line([row, COLUMNS[0]], [row, COLUMNS[1]], 1, GRID);
            canvas.line([row, COLUMNS[0] - 6], [row, COLUMNS[0]], 1, INK);
            let size = text_size(2, &text);
            let corner = [row.saturating_sub(size.height / 2), (COLUMNS[0] - 8).saturating_sub(size.width)];
            canvas.large_text(corner, 2, &text);
        }
    }

    /// The title, the names of the axes and what labels mean.
    fn draw_names(&self, canvas: &mut Canvas) {
        // A long title in small letters, and its end over the edge rather than its beginning.
        let scale = if text_size(2, &self.title).width + COLUMNS[0] < SIZE.width { 2 } else { 1 };
        canvas.large_text([20, COLUMNS[0]], scale, &self.title);
        let middle = |ends: [usize; 2], text: &str| {
            ((ends[0] + ends[1]) / 2).saturating_sub(text_size(2, text).width / 2)
        };
        canvas.large_text([SIZE.height - 32, middle(COLUMNS, &self.right)], 2, &self.right);
        let bottom = SIZE.height - middle([SIZE.height - ROWS[1], SIZE.height - ROWS[0]], &self.up);
        canvas.upward_text([bottom, 10], 2, &self.up);
        let width = text_size(1, &self.labels).width;
        canvas.text(ROWS[0] - 14, COLUMNS[1].saturating_sub(width), &self.labels);
    }
}

/// Writes a label at the first place beside its point where nothing else lies; nowhere where there is none.
fn draw_label(canvas: &mut Canvas, [y, x]: [usize; 2], label: &str) {
    let size = text_size(1, label);
    let (above, below) = (y.saturating_sub(size.height + 6), y + 7);
    let left = x.saturating_sub(size.width + 6);
    let places = [[above, x + 7], [below, left], [above.saturating_sub(8), x + 7], [below + 8, left]];
    let free = |&[top, left]: &[usize; 2]| {
        let around = Size::new(size.height + 2, size.width + 4);
        canvas.is_free([top.saturating_sub(1), left.saturating_sub(2)], around, &[GRID])
    };
    if let Some([top, left]) = places.into_iter().find(free) {
        canvas.fill([top, left], size, [1.0; 3]);
        canvas.text(top, left, label);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: Vec<Point>) -> Chart {
        let [title, right, up, labels] = ["title", "right", "up", "labels"].map(str::to_owned);
        Chart { title, right, up, labels, lines: vec![points] }
    }

    fn point(x: f64, y: f64) -> Point {
        Point { x, y, label: format!("1:{x}") }
    }

    /// Whether this text, dots and blanks, is on a picture in letters of scale 1.
    fn is_written(picture: &Picture, text: &str) -> bool {
        let size = text_size(1, text);
        let mut canvas = Canvas::new(size);
        canvas.text(0, 0, text);
        let looked_for = canvas.into_picture();
        (0..=SIZE.height - size.height).any(|y| {
            (0..=SIZE.width - size.width).any(|x| {
                (0..size.texels()).all(|n| {
                    let at = (y + n / size.width) * SIZE.width + x + n % size.width;
                    (picture.pixels[at] == INK) == (looked_for.pixels[n] == INK)
                })
            })
        })
    }

    #[test]
    fn every_point_of_a_falling_line_has_its_label() {
        let points: Vec<Point> = (0..11).map(|n| point(f64::from(1 << n), 8.0 / f64::from(n + 1))).collect();
        let picture = chart(points.clone()).draw();
        assert_eq!(picture.size, SIZE);
        for point in &points {
            assert!(is_written(&picture, &point.label), "{}", point.label);
        }
        assert!(is_written(&picture, "labels") && !is_written(&picture, "1:7"));
    }

    #[test]
    fn charts_of_one_point_of_none_and_of_zero_errors_are_drawn() {
        assert!(is_written(&chart(vec![point(1.0, 0.3)]).draw(), "1:1"));
        assert_eq!(chart(Vec::new()).draw().size, SIZE);
        let with_zero = chart(vec![point(1.0, 0.3), point(2.0, 0.0)]).draw();
        assert!(is_written(&with_zero, "1:1") && !is_written(&with_zero, "1:2"));
    }

    #[test]
    fn numbers_of_an_axis_are_round_and_enough() {
        let numbers = |first: f64, last: f64| -> Vec<String> {
            let axis = Axis { values: [first, last], pixels: ROWS };
            axis.numbers(16).into_iter().map(|(_, text)| text).collect()
        };
        assert_eq!(numbers(0.03, 30.0), ["0.05", "0.1", "0.2", "0.5", "1", "2", "5", "10", "20"]);
        assert_eq!(numbers(0.9, 9.0), ["1", "1.5", "2", "3", "4", "5", "7"]);
        assert_eq!(numbers(0.1, 0.21), ["0.1", "0.12", "0.14", "0.16", "0.18", "0.2"]);
        assert_eq!(numbers(100.0, 1.2e6), ["100", "1000", "10000", "100000", "1000000"]);
    }
}
