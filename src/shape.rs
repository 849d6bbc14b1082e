//! Sizes and windows in texels.

use std::fmt;
use std::str::FromStr;

/// Longest side of a size that is written as text.
pub const MOST_SIDE: usize = 1 << 24;

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

    /// Reads `WIDTHxHEIGHT`, each from 1 to `most`.
    ///
    /// # Errors
    /// What was expected, and what was found.
    pub fn up_to(text: &str, most: usize) -> Result<Self, String> {
        let expected =
            || format!("expected WIDTHxHEIGHT such as 1024x1024, each from 1 to {most}, got {text:?}");
        let (width, height) = text.split_once(['x', 'X']).ok_or_else(expected)?;
        let side = |part: &str| part.trim().parse().ok().filter(|n| (1..=most).contains(n));
        Ok(Self { height: side(height).ok_or_else(expected)?, width: side(width).ok_or_else(expected)? })
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
        Self::up_to(text, MOST_SIDE)
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
    pub(crate) fn within_first_quadrant(self) -> Option<Window> {
        let place = |place: i64| usize::try_from(place).ok();
        Some(Window { y: place(self.y)?, x: place(self.x)?, size: self.size })
    }
}

/// A whole number of any length; one that 64 bits do not hold is the largest or the least that they do.
fn whole_number(text: &str) -> Option<i64> {
    let text = text.trim();
    let (digits, beyond) = match text.strip_prefix('-') {
        Some(digits) => (digits, i64::MIN),
        None => (text.strip_prefix('+').unwrap_or(text), i64::MAX),
    };
    let is_number = !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit());
    is_number.then(|| text.parse().unwrap_or(beyond))
}

impl FromStr for Area {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("expected x,y,width,height such as 0,0,512,512, got {text:?}");
        let numbers: Vec<i64> =
            text.split(',').map(whole_number).collect::<Option<_>>().ok_or_else(expected)?;
        let &[x, y, width, height] = numbers.as_slice() else { return Err(expected()) };
        let is_side = |side: i64| (1..=AREA_MOST).contains(&side);
        let is_place = |first: i64, side: i64| first >= -AREA_MOST && first <= AREA_MOST - side;
        if !is_side(width) || !is_side(height) {
            return Err(format!("expected a width and a height from 1 to {AREA_MOST}, got {text:?}"));
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
    fn a_size_or_an_area_that_is_too_large_is_told_its_limits() {
        for text in ["0x5", "16777217x1", "5x99999999999999999999", "-1x5"] {
            assert!(text.parse::<Size>().is_err_and(|told| told.contains("from 1 to 16777216")), "{text}");
        }
        assert!("16777216x1".parse::<Size>().is_ok());
        assert!(Size::up_to("65537x1", 65536).is_err_and(|told| told.contains("from 1 to 65536,")));
        for text in ["0,0,0,5", "0,0,5,-1", "0,0,5000000000,1", "0,0,1,99999999999999999999"] {
            assert!(text.parse::<Area>().is_err_and(|told| told.contains("from 1 to 2147483648")), "{text}");
        }
        for text in ["99999999999999999999,0,1,1", "0,-99999999999999999999,1,1", "2147483648,0,1,1"] {
            assert!(text.parse::<Area>().is_err_and(|told| told.contains("places from -2^31")), "{text}");
        }
        for text in ["", "1,2,3", "1,2,3,4,5", "a,0,1,1", "1.5,0,1,1", "-,0,1,1"] {
            assert!(text.parse::<Area>().is_err_and(|told| told.contains("x,y,width,height")), "{text}");
        }
    }

    #[test]
    fn the_window_lies_in_the_middle() {
        let window = Size::new(1000, 300).middle(Size::new(512, 512));
        assert_eq!((window.y, window.x, window.size), (244, 0, Size::new(512, 300)));
    }
}
