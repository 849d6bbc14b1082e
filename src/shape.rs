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
        let expected = || format!("expected x,y,width,height such as 0,0,512,512, got {text:?}");
        let numbers: Vec<usize> = text
            .split(',')
            .map(|part| part.trim().parse())
            .collect::<Result<_, _>>()
            .map_err(|_| expected())?;
        match numbers[..] {
            [x, y, width, height] if width > 0 && height > 0 => {
                Ok(Self { y, x, size: Size { height, width } })
            }
            _ => Err(expected()),
        }
    }
}
