//! Textures of a scene: in memory, or made or read piece by piece when they are needed.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::error::Result;
use crate::method::value::evaluator::{Texels, place_within};
use crate::shape::{Area, Size};

/// Rows and columns of a piece.
pub const PIECE_SIDE: usize = 512;

/// Bytes of a piece.
pub const PIECE_BYTES: u64 = (PIECE_SIDE * PIECE_SIDE * size_of::<u32>()) as u64;

/// Which entry of a model each texel is.
pub enum Texture {
    /// All of it, row by row.
    Whole {
        /// Rows and columns.
        size: Size,
        /// Whether it repeats; if not, its outermost texels are continued.
        wraps: bool,
        /// As many as the size says.
        index: Vec<u32>,
    },
    /// Piece by piece.
    Pieces(Pieces),
}

/// Makes or reads the entries of an area, row by row.
pub type Maker = Box<dyn Fn(Area) -> Result<Vec<u32>> + Send + Sync>;

/// A texture of which only the most recently used pieces are kept.
pub struct Pieces {
    make: Maker,
    /// Its size and whether it repeats; none where it is endless.
    bounds: Option<(Size, bool)>,
    most: usize,
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    /// By row and column of the piece, with the time of the last use.
    pieces: HashMap<[i64; 2], (Arc<Piece>, u64)>,
    time: u64,
}

/// A piece; narrower and lower at the far borders.
struct Piece {
    width: usize,
    entries: Vec<u32>,
}

impl Pieces {
    /// A texture made by `make`, of which at most so many bytes are kept, but at least one piece.
    pub fn new(make: Maker, bounds: Option<(Size, bool)>, bytes: u64) -> Self {
        let most = (bytes / PIECE_BYTES).max(1) as usize;
        Self { make, bounds, most, kept: Mutex::default() }
    }

    fn piece(&self, place: [i64; 2]) -> Result<Arc<Piece>> {
        {
            let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
            kept.time += 1;
            let time = kept.time;
            if let Some((piece, used)) = kept.pieces.get_mut(&place) {
                *used = time;
                return Ok(Arc::clone(piece));
            }
        }
        // Not under the lock: two threads may make the same piece, and none waits for another's.
        let [y, x] = place.map(|number| number * PIECE_SIDE as i64);
        let side = |first: i64, end: Option<usize>| {
            end.map_or(PIECE_SIDE, |end| PIECE_SIDE.min((end as i64 - first).max(0) as usize))
        };
        let size = self.bounds.map(|(size, _)| size);
        let size = Size::new(side(y, size.map(|size| size.height)), side(x, size.map(|size| size.width)));
        let piece = Arc::new(Piece { width: size.width, entries: (self.make)(Area { y, x, size })? });
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.pieces.len() >= self.most {
            let oldest = kept.pieces.iter().min_by_key(|(_, (_, used))| *used).map(|(&place, _)| place);
            oldest.and_then(|place| kept.pieces.remove(&place));
        }
        let time = kept.time;
        kept.pieces.insert(place, (Arc::clone(&piece), time));
        Ok(piece)
    }
}

impl Texture {
    /// A reader for one thread.
    pub fn reader(&self) -> Reader<'_> {
        Reader { texture: self, last: None, beyond: false }
    }
}

/// Reads a texture, and remembers the piece that it read last.
pub struct Reader<'a> {
    texture: &'a Texture,
    last: Option<([i64; 2], Arc<Piece>)>,
    /// Whether a texel beyond the border of a texture that does not repeat was needed.
    pub beyond: bool,
}

impl Texels for Reader<'_> {
    #[inline]
    fn entry(&mut self, column: i64, row: i64) -> Result<usize> {
        let pieces = match self.texture {
            Texture::Whole { size, wraps, index } => {
                let [row, column] = self.within([row, column], *size, *wraps);
                return Ok(index[row * size.width + column] as usize);
            }
            Texture::Pieces(pieces) => pieces,
        };
        let place = match pieces.bounds {
            Some((size, wraps)) => self.within([row, column], size, wraps).map(|place| place as i64),
            None => [row, column],
        };
        let number = place.map(|place| place.div_euclid(PIECE_SIDE as i64));
        let [row, column] = place.map(|place| place.rem_euclid(PIECE_SIDE as i64) as usize);
        if self.last.as_ref().is_none_or(|(last, _)| *last != number) {
            self.last = Some((number, pieces.piece(number)?));
        }
        let piece = self.last.as_ref().map(|(_, piece)| piece);
        let entry = piece.and_then(|piece| piece.entries.get(row * piece.width + column));
        entry.map(|&entry| entry as usize).ok_or_else(|| crate::Error::internal("a piece that is too small"))
    }
}

impl Reader<'_> {
    #[inline]
    fn within(&mut self, [row, column]: [i64; 2], size: Size, wraps: bool) -> [usize; 2] {
        let within = [place_within(row, size.height, wraps), place_within(column, size.width, wraps)];
        // Half a texel beyond is still the border's own; what is told is what is clearly beyond.
        let is_beyond = |place: i64, side: usize| !(-1..=side as i64).contains(&place);
        self.beyond |= !wraps && (is_beyond(row, size.height) || is_beyond(column, size.width));
        within
    }
}
