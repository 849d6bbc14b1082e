//! The example of the specification, docs/method/coherent-example.json: what a frozen exemplar must give, whatever bases later
//! versions fit. scripts/judge/example.py checks the same file by numpy, and makes others at random that are checked here.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use btfkit::kernel::Kernel;
use btfkit::lattice::WaveCounts;
use btfkit::method::coherent::{Appearance, Basis, FEATURES, Plane, Variation, dims_of, hash, levels_of};
use btfkit::shape::Size;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// What the file holds.
#[derive(Serialize, Deserialize)]
struct Example {
    /// Hashes: seed, level, row, column, and the word in hexadecimal.
    hash: Vec<(u32, u32, i64, i64, String)>,
    /// Clusters, row by row.
    index: Vec<Vec<u16>>,
    features: Vec<[i8; FEATURES]>,
    levels: Vec<Level>,
    windows: Vec<Wanted>,
}

#[derive(Serialize, Deserialize)]
struct Level {
    shift: u32,
    passes: usize,
    repetition: i32,
    offset: Vec<i32>,
    /// [input][dim]
    basis: Vec<Vec<i16>>,
}

/// A window that must come out.
#[derive(Serialize, Deserialize)]
struct Wanted {
    wraps: bool,
    lattice: Vec<[i32; 2]>,
    seed: u32,
    /// In parts of 256.
    jitter: u32,
    /// Height and width of a surface that joins at its own borders.
    joins: Option<[usize; 2]>,
    y: i64,
    x: i64,
    /// row * width + column of the exemplar, row by row.
    positions: Vec<Vec<u32>>,
}

impl Example {
    fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    fn size(&self) -> Size {
        Size::new(self.index.len(), self.index[0].len())
    }

    fn appearance(&self, wanted: &Wanted) -> Appearance {
        let level = |(number, level): (usize, &Level)| Basis {
            dims: dims_of(number, self.levels.len()),
            weights: level.basis.concat(),
            offset: level.offset.clone(),
            shift: level.shift,
            passes: level.passes,
            repetition: level.repetition,
        };
        Appearance {
            exemplar: self.size().window(),
            wraps: wanted.wraps,
            features: self.features.clone(),
            levels: self.levels.iter().enumerate().map(level).collect(),
            lattice: WaveCounts(wanted.lattice.clone()),
        }
    }

    fn synthesise(&self, wanted: &Wanted, size: Size, kernel: Kernel) -> Vec<u32> {
        let appearance = self.appearance(wanted);
        let plane = Plane::new(self.size(), &self.index.concat(), &appearance, kernel).unwrap();
        let wrap = wanted.joins.map(|[height, width]| Size::new(height, width));
        let variation = Variation { seed: wanted.seed, jitter: wanted.jitter, wrap };
        plane.window(&variation, wanted.y, wanted.x, size).unwrap()
    }

    fn check(&self, name: &str) {
        for (seed, level, y, x, expected) in &self.hash {
            let [high, low] = hash::place(hash::key(*seed, *level), *y as i32, *x as i32);
            assert_eq!(
                format!("{:08x}", (high as u32) << 16 | low as u32),
                *expected,
                "{name}: {seed} {level} {y} {x}"
            );
        }
        for (number, wanted) in self.windows.iter().enumerate() {
            let size = Size::new(wanted.positions.len(), wanted.positions[0].len());
            let expected = wanted.positions.concat();
            for kernel in Kernel::available() {
                let made = self.synthesise(wanted, size, kernel);
                let wrong = made.iter().zip(&expected).filter(|(a, b)| a != b).count();
                assert_eq!(wrong, 0, "{name}: texels of window {number} by {kernel:?}");
            }
        }
    }
}

fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/method/coherent-example.json")
}

#[test]
fn the_example_of_the_specification_comes_out() {
    let example = Example::read(&file());
    assert!(example.hash.len() >= 4 && example.windows[0].positions.len() == 64);
    example.check("example.json");
}

/// Those that an independent program made: `scripts/judge-sample` names their folder.
#[test]
fn examples_of_others_come_out() {
    let Some(folder) = std::env::var_os("BTFKIT_EXAMPLES") else { return };
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(!files.is_empty());
    for file in files {
        Example::read(&file).check(&file.display().to_string());
    }
}

/// Makes the file anew. What it holds is frozen: to be run only where the rule itself changes.
#[test]
#[ignore = "writes docs/method/coherent-example.json"]
fn write_the_example() {
    let (height, width, clusters) = (24, 20, 12);
    let draw = |seed: u32, y: usize, x: usize| {
        f64::from(hash::place(hash::key(seed, 0), y as i32, x as i32)[0]) / 65536.0
    };
    // Slanted stripes, uneven and grainy.
    let index: Vec<Vec<u16>> = (0..height)
        .map(|y| {
            let cluster = |x: usize| {
                let turn = 2.0 * y as f64 / height as f64 + x as f64 / width as f64;
                let wave = (turn * std::f64::consts::TAU + draw(1, y / 5, x / 4)).sin();
                (6.0 + 4.4 * wave + 3.0 * (draw(2, y, x) - 0.5)).clamp(0.0, 11.0) as u16
            };
            (0..width).map(cluster).collect()
        })
        .collect();
    let features: Vec<[i8; FEATURES]> = (0..clusters)
        .map(|cluster| {
            std::array::from_fn(|n| match n {
                0 => (18.0 * cluster as f64 - 99.0) as i8,
                _ => ((draw(3, cluster, n) - 0.5) * 120.0 / n as f64) as i8,
            })
        })
        .collect();
    let size = Size::new(height, width);
    let texels = index.concat();
    let none = WaveCounts::default();
    let fitted = btfkit::method::coherent::fit::fit(size.window(), false, &texels, features.clone(), none);
    assert_eq!(fitted.levels.len(), levels_of(size));
    let levels = fitted.levels.iter().zip([(1, 0), (3, 20_000), (2, 36_864)]);
    let levels = levels.map(|(basis, (passes, repetition))| Level {
        shift: basis.shift,
        passes,
        repetition,
        offset: basis.offset.clone(),
        basis: basis.weights.chunks_exact(basis.dims).map(<[i16]>::to_vec).collect(),
    });
    let hashes = [(1, 5, 0, 0), (1, 0, -1, 7), (7, 3, -500, 12345), (u32::MAX, 9, -(1 << 31), (1 << 31) - 1)];
    let hash = hashes.map(|(seed, level, y, x)| {
        let [high, low] = hash::place(hash::key(seed, level), y as i32, x as i32);
        (seed, level, y, x, format!("{:08x}", (high as u32) << 16 | low as u32))
    });
    let mut example =
        Example { hash: hash.to_vec(), index, features, levels: levels.collect(), windows: Vec::new() };
    for (wraps, lattice, seed, jitter, joins, place, [height, width]) in [
        (false, vec![], 1, 128, None, (-21, 9), [64, 64]),
        (true, vec![[2, 1]], 4_000_000_000, 64, None, (1_000_003, -1_000_005), [24, 40]),
        (true, vec![[2, 0], [-1, 3]], 7, 0, None, (-5, -7), [24, 40]),
        (false, vec![], 3, 256, Some([32, 24]), (-8, 20), [40, 24]),
    ] {
        let (y, x) = place;
        let mut wanted = Wanted { wraps, lattice, seed, jitter, joins, y, x, positions: Vec::new() };
        let made = example.synthesise(&wanted, Size::new(height, width), Kernel::Plain);
        wanted.positions = made.chunks_exact(width).map(<[u32]>::to_vec).collect();
        example.windows.push(wanted);
    }
    let text = in_lines(&serde_json::to_value(&example).unwrap());
    assert_eq!(serde_json::from_str::<Value>(&text).unwrap(), json!(example));
    std::fs::create_dir_all(file().parent().unwrap()).unwrap();
    std::fs::write(file(), text).unwrap();
}

/// JSON with a line for each list of plain values.
fn in_lines(value: &Value) -> String {
    let mut text = String::new();
    write_lines(value, 0, &mut text);
    text.push('\n');
    text
}

fn write_lines(value: &Value, depth: usize, text: &mut String) {
    let members: Vec<(String, &Value)> = match value {
        Value::Object(members) => {
            members.iter().map(|(name, value)| (format!("{}: ", json!(name)), value)).collect()
        }
        Value::Array(list) if list.iter().any(|value| value.is_array() || value.is_object()) => {
            list.iter().map(|value| (String::new(), value)).collect()
        }
        plain => return text.push_str(&plain.to_string()),
    };
    let [open, close] = if value.is_object() { ['{', '}'] } else { ['[', ']'] };
    text.push(open);
    for (number, (name, value)) in members.iter().enumerate() {
        let comma = if number > 0 { "," } else { "" };
        write!(text, "{comma}\n{}{name}", " ".repeat(depth + 1)).unwrap();
        write_lines(value, depth + 1, text);
    }
    write!(text, "\n{}{close}", " ".repeat(depth)).unwrap();
}
