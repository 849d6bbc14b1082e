//! Drawing on a sheet: pictures, lines and text.

use font8x8::UnicodeFonts;

use super::Picture;
use crate::shape::Size;

/// Side of a character at scale 1, pixels.
pub const CHARACTER: usize = 8;

/// Colour of text.
pub(crate) const INK: [f32; 3] = [0.1, 0.1, 0.12];

/// Colour of the paper.
const PAPER: [f32; 3] = [1.0; 3];

/// A sheet of white paper. What lies beyond its edges is not drawn.
pub struct Canvas {
    size: Size,
    pixels: Vec<[f32; 3]>,
}

impl Canvas {
    /// An empty sheet.
    pub fn new(size: Size) -> Self {
        Self { size, pixels: vec![PAPER; size.texels()] }
    }

    /// What was drawn.
    pub fn into_picture(self) -> Picture {
        Picture::display(self.size, self.pixels)
    }

    fn set(&mut self, y: usize, x: usize, color: [f32; 3]) {
        if y < self.size.height && x < self.size.width {
            self.pixels[y * self.size.width + x] = color;
        }
    }

    /// A picture with its top left corner there.
    pub fn put(&mut self, top: usize, left: usize, picture: &Picture) {
        for (n, &pixel) in picture.pixels.iter().enumerate() {
            self.set(top + n / picture.size.width, left + n % picture.size.width, pixel);
        }
    }

    /// A filled rectangle.
    pub fn fill(&mut self, [top, left]: [usize; 2], size: Size, color: [f32; 3]) {
        for n in 0..size.texels() {
            self.set(top + n / size.width, left + n % size.width, color);
        }
    }

    /// A filled disc around a row and column.
    pub(crate) fn disc(&mut self, [y, x]: [usize; 2], radius: usize, color: [f32; 3]) {
        let side = 2 * radius + 1;
        for n in 0..side * side {
            let (down, right) = (n / side, n % side);
            let square = down.abs_diff(radius).pow(2) + right.abs_diff(radius).pow(2);
            // Of the radius and a half, so that small discs are round.
            if square <= radius * (radius + 1) && y + down >= radius && x + right >= radius {
                self.set(y + down - radius, x + right - radius, color);
            }
        }
    }

    /// A straight line of a width from one row and column to another.
    pub fn line(&mut self, from: [usize; 2], to: [usize; 2], width: usize, color: [f32; 3]) {
        let steps = from[0].abs_diff(to[0]).max(from[1].abs_diff(to[1])).max(1);
        for step in 0..=steps {
            let [y, x] = [0, 1].map(|axis| {
                // To the nearest pixel.
                (2 * (from[axis] * (steps - step) + to[axis] * step) + steps) / (2 * steps)
            });
            let corner = [y.saturating_sub(width / 2), x.saturating_sub(width / 2)];
            self.fill(corner, Size::new(width, width), color);
        }
    }

    /// A line of text, its top left corner there.
    pub fn text(&mut self, top: usize, left: usize, text: &str) {
        self.large_text([top, left], 1, text);
    }

    /// The same in characters `scale` times as large.
    pub(crate) fn large_text(&mut self, [top, left]: [usize; 2], scale: usize, text: &str) {
        for [y, x] in dots(text) {
            self.fill([top + scale * y, left + scale * x], Size::new(scale, scale), INK);
        }
    }

    /// The same read from below: the first character's top left corner is the text's bottom left one.
    pub(crate) fn upward_text(&mut self, [bottom, left]: [usize; 2], scale: usize, text: &str) {
        for [y, x] in dots(text) {
            let top = bottom.saturating_sub(scale * (x + 1));
            self.fill([top, left + scale * y], Size::new(scale, scale), INK);
        }
    }

    /// Whether nothing but these colours and paper lies in a rectangle of the sheet.
    pub fn is_free(&self, [top, left]: [usize; 2], size: Size, besides: &[[f32; 3]]) -> bool {
        let (bottom, right) = (top + size.height, left + size.width);
        bottom <= self.size.height
            && right <= self.size.width
            && (top..bottom).all(|y| {
                let row = &self.pixels[y * self.size.width..][left..right];
                row.iter().all(|pixel| *pixel == PAPER || besides.contains(pixel))
            })
    }
}

/// Size of a line of text.
pub fn text_size(scale: usize, text: &str) -> Size {
    Size::new(CHARACTER * scale, CHARACTER * scale * text.chars().count())
}

/// Row and column of each dot of a line of text. Characters that the font lacks are left blank.
fn dots(text: &str) -> impl Iterator<Item = [usize; 2]> {
    text.chars().enumerate().flat_map(|(number, character)| {
        let glyph = font8x8::BASIC_FONTS.get(character).unwrap_or_default();
        let dots = (0..CHARACTER * CHARACTER).map(|n| [n / CHARACTER, n % CHARACTER]);
        dots.filter(move |&[y, x]| glyph[y] >> x & 1 == 1).map(move |[y, x]| [y, CHARACTER * number + x])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows and columns of the dark pixels.
    fn dark(canvas: Canvas) -> Vec<[usize; 2]> {
        let picture = canvas.into_picture();
        let places = (0..picture.pixels.len()).filter(|&n| picture.pixels[n] == INK);
        places.map(|n| [n / picture.size.width, n % picture.size.width]).collect()
    }

    #[test]
    fn upward_text_is_text_turned_by_a_quarter() {
        let (mut flat, mut upward) = (Canvas::new(Size::new(40, 40)), Canvas::new(Size::new(40, 40)));
        flat.large_text([4, 2], 2, "Lk");
        upward.upward_text([37, 4], 2, "Lk");
        let mut turned: Vec<[usize; 2]> = dark(flat).into_iter().map(|[y, x]| [38 - x, y]).collect();
        turned.sort_unstable();
        assert!(!turned.is_empty());
        assert_eq!(dark(upward), turned);
    }

    #[test]
    fn a_line_joins_its_ends_and_takes_their_place() {
        let mut canvas = Canvas::new(Size::new(9, 9));
        canvas.line([7, 1], [1, 4], 1, INK);
        assert!(canvas.is_free([0, 0], Size::new(1, 9), &[]));
        assert!(
            !canvas.is_free([0, 0], Size::new(2, 9), &[]) && canvas.is_free([0, 0], Size::new(9, 9), &[INK])
        );
        assert!(!canvas.is_free([5, 5], Size::new(5, 2), &[]), "beyond the edge nothing is free");
        let dark = dark(canvas);
        assert_eq!((dark[0], dark[6], dark.len()), ([1, 4], [7, 1], 7));
    }
}
