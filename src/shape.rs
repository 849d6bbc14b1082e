//! Sizes and windows in texels.

use std::fmt;
use std::str::FromStr;

/// Height and width in texels. Written `WIDTHxHEIGHT`, as pictures are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Number of rows.
    pub height: usize,
    /// Number of columns.
    pub width: usize,
}

impl Size {
    /// A size from rows and columns.
    pub fn new(height: usize, width: usize) -> Self {
        Self { height, width }
    }

    /// Number of texels.
    pub fn texels(self) -> usize {
        self.height * self.width
    }

    /// The window that covers all of it.
    pub fn window(self) -> Window {
        Window { y: 0, x: 0, size: self }
    }

    /// The window in its middle, as large as `most` where that fits.
    pub fn middle(self, most: Self) -> Window {
        let size = Self::new(self.height.min(most.height), self.width.min(most.width));
        Window { y: (self.height - size.height) / 2, x: (self.width - size.width) / 2, size }
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("expected WIDTHxHEIGHT such as 1024x1024, got {text:?}");
        let (width, height) = text.split_once(['x', 'X']).ok_or_else(expected)?;
        let side = |part: &str| part.trim().parse().ok().filter(|n| (1..=1 << 24).contains(n));
        Ok(Self { height: side(height).ok_or_else(expected)?, width: side(width).ok_or_else(expected)? })
    }
}

/// A rectangle of texels: its top left corner and its size. Written `x,y,width,height`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Topmost row.
    pub y: usize,
    /// Leftmost column.
    pub x: usize,
    /// Extent.
    pub size: Size,
}

impl Window {
    /// Whether all of it lies within a plane of this size.
    pub fn fits(self, plane: Size) -> bool {
        self.y.checked_add(self.size.height).is_some_and(|end| end <= plane.height)
            && self.x.checked_add(self.size.width).is_some_and(|end| end <= plane.width)
    }
}

impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{},{},{}", self.x, self.y, self.size.width, self.size.height)
    }
}

impl FromStr for Window {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let area: Area = text.parse()?;
        area.within_first_quadrant().ok_or_else(|| format!("expected x and y of at least 0, got {text:?}"))
    }
}

/// A rectangle of an endless plane, whose top left corner may have negative coordinates. Written `x,y,width,height`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    /// Topmost row.
    pub y: i64,
    /// Leftmost column.
    pub x: i64,
    /// Extent.
    pub size: Size,
}

/// Longest side of an area, and largest coordinate: what 32-bit whole numbers address.
const AREA_MOST: i64 = 1 << 31;

impl Area {
    /// The window that it is of a plane that begins at row 0 and column 0.
    pub fn within_first_quadrant(self) -> Option<Window> {
        let place = |place: i64| usize::try_from(place).ok();
        Some(Window { y: place(self.y)?, x: place(self.x)?, size: self.size })
    }
}

impl FromStr for Area {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("expected x,y,width,height such as 0,0,512,512, got {text:?}");
        let numbers: Vec<i64> = text
            .split(',')
            .map(|part| part.trim().parse())
            .collect::<Result<_, _>>()
            .map_err(|_| expected())?;
        let &[x, y, width, height] = numbers.as_slice() else { return Err(expected()) };
        let is_side = |side: i64| (1..=AREA_MOST).contains(&side);
        let is_place = |first: i64, side: i64| first >= -AREA_MOST && first <= AREA_MOST - side;
        if !is_side(width) || !is_side(height) {
            return Err(expected());
        }
        if !is_place(x, width) || !is_place(y, height) {
            return Err(format!("expected places from -2^31 to 2^31 - 1, got {text:?}"));
        }
        Ok(Self { y, x, size: Size { height: height as usize, width: width as usize } })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_window_lies_in_the_middle() {
        let window = Size::new(1000, 300).middle(Size::new(512, 512));
        assert_eq!((window.y, window.x, window.size), (244, 0, Size::new(512, 300)));
    }
}
