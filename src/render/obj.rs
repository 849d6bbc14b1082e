//! Triangles of a Wavefront OBJ file: its vertices and faces, as bytes, so that comments and names may be in any
//! encoding. Materials, groups, lines and free-form surfaces are passed over.

use super::corner::{Corner, expect_triangles};
use crate::error::{Error, Result};
use crate::run::budget::Room;
use crate::vector::Vector;
use crate::words::counted;

/// Numbers of the vertices: places, texture coordinates, normals.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Counts {
    places: usize,
    textures: usize,
    normals: usize,
}

/// All vertices of a file.
struct Vertices {
    places: Vec<Vector>,
    textures: Vec<[f64; 2]>,
    normals: Vec<Vector>,
}

/// All triangles of a file, groups and materials together; polygons are cut into triangles around their first corner.
///
/// # Errors
/// A statement that cannot be read, faces without texture coordinates, and more than there is room for.
pub(super) fn corners(bytes: &[u8], room: &mut Room) -> Result<Vec<[Corner; 3]>> {
    let (mut counts, mut triangles) = (Counts::default(), 0);
    for (_, statement) in Statements::of(bytes) {
        counts.add(statement);
        if kind(statement) == b"f" {
            triangles += words(statement).count().saturating_sub(3);
        }
    }
    let vertices = size_of::<Vector>() * (counts.places + counts.normals) + 16 * counts.textures;
    room.take("the vertices of a mesh", vertices as u64)?;
    expect_triangles(room, triangles)?;
    let vertices = Vertices::read(bytes, counts)?;
    let mut triangles = Vec::with_capacity(triangles);
    // Faces name vertices before them by negative numbers, so these are counted once more.
    let mut before = Counts::default();
    for (line, statement) in Statements::of(bytes) {
        before.add(statement);
        if kind(statement) != b"f" {
            continue;
        }
        let mut corners = words(statement)
            .skip(1)
            .map(|word| vertices.corner(word, before).map_err(|error| at(line, error)));
        // Two corners or fewer are no face, but a line or a point.
        let (Some(first), Some(second)) = (corners.next().transpose()?, corners.next().transpose()?) else {
            continue;
        };
        let mut last = second;
        for corner in corners {
            let corner = corner?;
            triangles.push([first, last, corner]);
            last = corner;
        }
    }
    Ok(triangles)
}

fn at(line: usize, error: Error) -> Error {
    error.context(format!("line {line}"))
}

/// What a statement is.
fn kind(statement: &[u8]) -> &[u8] {
    words(statement).next().unwrap_or_default()
}

/// The words of a statement; what follows a # is a comment.
fn words(statement: &[u8]) -> impl Iterator<Item = &[u8]> {
    statement
        .split(|&byte| byte.is_ascii_whitespace() || byte == b'\\')
        .filter(|word| !word.is_empty())
        .take_while(|word| !word.starts_with(b"#"))
}

/// The numbers of a statement, behind its kind.
fn numbers<const N: usize>(statement: &[u8], least: usize) -> Result<[f64; N]> {
    let mut numbers = [0.0; N];
    let mut found = 0;
    for (to, word) in numbers.iter_mut().zip(words(statement).skip(1)) {
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        *to = number.ok_or_else(|| {
            Error::input(format!("got {:?}, expected a number", String::from_utf8_lossy(word)))
        })?;
        found += 1;
    }
    if found < least {
        return Err(Error::input(format!("got {}, expected {least} or more", counted(found, "number"))));
    }
    Ok(numbers)
}

impl Counts {
    fn add(&mut self, statement: &[u8]) {
        match kind(statement) {
            b"v" => self.places += 1,
            b"vt" => self.textures += 1,
            b"vn" => self.normals += 1,
            _ => {}
        }
    }
}

impl Vertices {
    fn read(bytes: &[u8], counts: Counts) -> Result<Self> {
        let mut vertices = Self {
            places: Vec::with_capacity(counts.places),
            textures: Vec::with_capacity(counts.textures),
            normals: Vec::with_capacity(counts.normals),
        };
        for (line, statement) in Statements::of(bytes) {
            let told = |error| at(line, error);
            match kind(statement) {
                b"v" => vertices.places.push(numbers(statement, 3).map_err(told)?),
                b"vt" => vertices.textures.push(numbers(statement, 1).map_err(told)?),
                b"vn" => vertices.normals.push(numbers(statement, 3).map_err(told)?),
                _ => {}
            }
        }
        Ok(vertices)
    }

    /// A corner by its name: `place/texture` or `place/texture/normal`.
    fn corner(&self, word: &[u8], before: Counts) -> Result<Corner> {
        let mut names = word.split(|&byte| byte == b'/');
        let mut name = || names.next().filter(|name| !name.is_empty());
        let (place, texture, normal) = (name(), name(), name());
        let Some(texture) = texture else {
            return Err(Error::input("a face whose corners have no texture coordinates (vt)")
                .hint("unwrap it in a modelling program, and export it with texture coordinates"));
        };
        let place = one_of(&self.places, "v", place.unwrap_or_default(), before.places)?;
        let texture = one_of(&self.textures, "vt", texture, before.textures)?;
        let normal = normal.map(|name| one_of(&self.normals, "vn", name, before.normals)).transpose()?;
        Ok(Corner { place, texture, normal, tangent: None })
    }
}

/// A vertex by its number: from 1, or from -1 backwards from the last of those before.
fn one_of<T: Copy>(list: &[T], what: &str, name: &[u8], before: usize) -> Result<T> {
    let number = std::str::from_utf8(name).ok().and_then(|name| name.parse::<i64>().ok());
    let place = number.and_then(|number| match number {
        1.. => usize::try_from(number - 1).ok(),
        _ if number < 0 => before.checked_sub(usize::try_from(number.unsigned_abs()).ok()?),
        _ => None,
    });
    place.and_then(|place| list.get(place).copied()).ok_or_else(|| {
        let name = String::from_utf8_lossy(name);
        Error::input(format!("a face with the {what} {name:?}, which is not there, of {}", list.len()))
    })
}

/// The statements of a file, each with the number of the line that it begins on. A line ends with LF, CR or both; one
/// of a vertex or a face that ends with a backslash goes on in the next.
struct Statements<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

impl<'a> Statements<'a> {
    fn of(bytes: &'a [u8]) -> Self {
        const MARK: &[u8] = "\u{feff}".as_bytes();
        Self { bytes: bytes.strip_prefix(MARK).unwrap_or(bytes), at: 0, line: 0 }
    }

    /// Passes a line, and gives it.
    fn pass(&mut self) -> &'a [u8] {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let length = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(rest.len());
        let (line, end) = rest.split_at(length);
        self.at += length + if end.starts_with(b"\r\n") { 2 } else { 1 };
        self.line += 1;
        line
    }
}

impl<'a> Iterator for Statements<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.at >= self.bytes.len() {
            return None;
        }
        let (start, number) = (self.at, self.line + 1);
        let mut line = self.pass();
        let may_go_on = matches!(kind(line), b"v" | b"vt" | b"vn" | b"f");
        // In a comment, a path may end with a backslash.
        while may_go_on && line.trim_ascii_end().ends_with(b"\\") && !line.contains(&b'#') {
            line = self.pass();
        }
        Some((number, self.bytes.get(start..self.at.min(self.bytes.len())).unwrap_or_default()))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn read(text: &[u8]) -> Result<Vec<[Corner; 3]>> {
        corners(text, &mut Room::new(crate::run::budget::Allowance::new(64 << 20)))
    }

    #[test]
    fn lines_go_on_and_names_may_be_in_any_encoding() {
        let plain = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";
        let expected = read(plain).unwrap();
        assert_eq!(
            (expected.len(), expected[0][1].place, expected[0][2].texture),
            (1, [1.0, 0.0, 0.0], [0.0, 1.0])
        );
        for other in [
            &b"v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nvt 0 0\r\nvt 1 0\r\nvt 0 1\r\nf 1/1 \\\r\n 2/2 \\\r\n3/3"[..],
            b"v 0 0 0\rv 1 0 0\rv 0 1 0\rvt 0\rvt 1 0\rvt 0 1\rf 1/1 2/2 3/3\r",
            b"# C:\\models\\\nv 0 0 0 # a\\\nv 1 0 0\ng Ma\xdfe\\\nv 0 1 0 \\\n0.5\nvt 0 0\nvt 1 0\nvt 0 1\nf -3/-3 -2/2 3/3\n",
            b"\xef\xbb\xbfv 0 0 0\nv 1 0 0\nv 0 1 0\n\n\nf 1/1 2/2 3/3\nl 1 2\nf 1/1 2/2\nvt 0 0\nvt 1 0\nvt 0 1 0 7\n\xff",
        ] {
            assert_eq!(read(other).unwrap(), expected, "{}", String::from_utf8_lossy(other));
        }
        let quad = read(b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1 4/1\n").unwrap();
        assert_eq!(quad.map_corners(), [[0.0, 1.0, 1.0], [0.0, 1.0, 0.0]]);
    }

    /// The first coordinate of each corner.
    trait Firsts {
        fn map_corners(&self) -> Vec<[f64; 3]>;
    }

    impl Firsts for Vec<[Corner; 3]> {
        fn map_corners(&self) -> Vec<[f64; 3]> {
            self.iter().map(|triangle| triangle.map(|corner| corner.place[0])).collect()
        }
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, told) in [
            ("v 0 0 0\n\nv 1 2\n", "line 3: got 2 numbers, expected 3 or more"),
            ("v 0 0 0\nv 1 \\\n\\\n a 2\n", "line 2: got \"a\", expected a number"),
            ("v 0 0 0\nvt 0 0\nf 1/1 2/1 1/1", "line 3: a face with the v \"2\", which is not there, of 1"),
            ("v 0 0 0\nvt 0 0\nf 1/1 1/0 1/1", "line 3: a face with the vt \"0\", which is not there, of 1"),
            (
                "v 0 0 0\nvt 0 0\nf 1/1 1/1 -2/1\nv 0 0 0",
                "line 3: a face with the v \"-2\", which is not there, of 2",
            ),
            (
                "v 0 0 0\nvt 0 0\nf 1/1/1 1/1/1 1/1/1",
                "line 3: a face with the vn \"1\", which is not there, of 0",
            ),
            (
                "v 0 0 0\nvn 0 0 1\nf 1//1 1//1 1//1",
                "line 3: a face whose corners have no texture coordinates (vt)",
            ),
        ] {
            assert_eq!(read(text.as_bytes()).unwrap_err().to_string(), told);
        }
    }

    #[test]
    fn a_mesh_beyond_memory_is_refused_before_it_is_read() {
        let text = format!("v 0 0 0\nvt 0 0\nf {}", "1/1 ".repeat(1_000_000));
        let told = read(text.as_bytes()).unwrap_err().to_string();
        assert!(told.contains("a mesh of 999998 triangles") && told.contains("64 MiB are allowed"), "{told}");
    }
}
