//! What people would use instead of the coherent rule: repeated, laid and stitched pieces of the tile, and quilting.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use btfkit::method::baseline::{Exemplar, Quilt, Roller, Tiles};
use btfkit::shape::Size;
use btfkit::store::enlarged::Enlarged;
use btfkit::store::model::Model;

use crate::fixture::{assert_same, btf, fail, fixture, succeed};

const METHODS: [&str; 4] = ["repeat", "tiles", "roller", "quilt"];

/// More than one block of shards in both directions, neither side a multiple of anything.
const SIZE: &str = "1100x1043";

fn enlarge(model: &Path, output: &Path, method: &str, size: &str) -> Command {
    let mut command = btf();
    command.arg("enlarge").args([model, output]).args(["--method", method, "--size", size]);
    command
}

/// What there is to know of the fixture's tile.
struct Tile {
    size: Size,
    index: Vec<u16>,
    distance: Vec<f32>,
}

impl Tile {
    fn of(model: &Path) -> Self {
        let model = Model::open(model).unwrap();
        Self {
            size: model.tile().unwrap().size,
            index: model.index().unwrap(),
            distance: model.distance().unwrap(),
        }
    }

    fn exemplar(&self) -> Exemplar {
        Exemplar::new(self.size, true, self.index.clone(), &self.distance).unwrap()
    }

    /// D of (26) between two texels.
    fn difference(&self, first: u32, second: u32) -> f64 {
        let clusters = self.distance.len().isqrt();
        let [first, second] = [first, second].map(|texel| usize::from(self.index[texel as usize]));
        f64::from(self.distance[first * clusters + second])
    }

    /// Sum over neighbours of a plane that are no neighbours in the tile, and their number.
    fn joints(&self, plane: &Plane) -> (f64, usize) {
        let Size { height, width } = self.size;
        let place = |texel: u32| (texel as usize / width, texel as usize % width);
        let mut joints = (0.0, 0);
        let mut add = |first: u32, second: u32, [down, right]: [usize; 2]| {
            let ((y, x), there) = (place(first), place(second));
            if ((y + down) % height, (x + right) % width) != there {
                joints = (joints.0 + self.difference(first, second), joints.1 + 1);
            }
        };
        for y in 0..plane.size.height - 1 {
            for x in 0..plane.size.width - 1 {
                add(plane.at(y, x), plane.at(y, x + 1), [0, 1]);
                add(plane.at(y, x), plane.at(y + 1, x), [1, 0]);
            }
        }
        joints
    }

    /// Mean difference of neighbours in the tile.
    fn step(&self) -> f64 {
        let Size { height, width } = self.size;
        let at = |y: usize, x: usize| (y % height * width + x % width) as u32;
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (y, x)));
        let both = |(y, x)| self.difference(at(y, x), at(y, x + 1)) + self.difference(at(y, x), at(y + 1, x));
        places.map(both).sum::<f64>() / (2 * self.size.texels()) as f64
    }
}

/// The tile's texels of an output.
struct Plane {
    size: Size,
    source: Vec<u32>,
}

impl Plane {
    fn read(path: &Path) -> Self {
        let store = Enlarged::open(path).unwrap();
        let source = store.read_source(store.size().window()).unwrap().unwrap();
        Self { size: store.size(), source }
    }

    fn at(&self, y: usize, x: usize) -> u32 {
        self.source[y * self.size.width + x]
    }

    /// The same patches without a cut: each cell is all of the patch that its place `probe` belongs to.
    fn uncut(&self, tile: Size, cell: Size, probe: [usize; 2]) -> Self {
        let size = Size::new(
            self.size.height / cell.height * cell.height,
            self.size.width / cell.width * cell.width,
        );
        let mut source = Vec::new();
        for y in 0..size.height {
            for x in 0..size.width {
                let [top, left] = [y / cell.height * cell.height, x / cell.width * cell.width];
                let texel = self.at(top + probe[0], left + probe[1]) as usize;
                let row = texel / tile.width + tile.height + y - top - probe[0];
                let column = texel % tile.width + tile.width + x - left - probe[1];
                source.push((row % tile.height * tile.width + column % tile.width) as u32);
            }
        }
        Self { size, source }
    }

    fn cropped(&self, size: Size) -> Self {
        let rows = self.source.chunks_exact(self.size.width).take(size.height);
        Self { size, source: rows.flat_map(|row| &row[..size.width]).copied().collect() }
    }
}

#[test]
fn threads_shards_and_losses_change_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    for method in METHODS {
        let [whole, parts, mended] =
            ["whole", "parts", "mended"].map(|name| folder.path().join(format!("{method}-{name}")));
        let run = |output: &Path, more: &[&str]| {
            succeed(enlarge(&fixture().model(), output, method, SIZE).arg("--keep-normals").args(more))
        };
        run(&whole, &["--threads", "1"]);
        if method != "quilt" {
            run(&parts, &["--shard", "2/3", "--threads", "3"]);
            run(&parts, &["--shard", "0/3"]);
            run(&parts, &["--shard", "1/3"]);
            assert_same(&parts, &whole);
        }
        run(&mended, &["--threads", "3"]);
        for lost in ["index/c/0/1", "source/c/1/0", "normals/c/2/2/0"] {
            std::fs::remove_file(mended.join(lost)).unwrap();
        }
        let told = run(&mended, &[]);
        assert!(!told.contains(" 0 found done") || method == "quilt", "{told}");
        assert_same(&mended, &whole);
        let told = run(&mended, &[]);
        assert!(told.contains(": 0 written"), "{told}");
    }
}

#[test]
fn a_run_that_is_killed_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for method in METHODS {
        let [whole, killed] = ["whole", "killed"].map(|name| folder.path().join(format!("{method}-{name}")));
        succeed(&mut enlarge(&fixture().model(), &whole, method, SIZE));
        let mut command = enlarge(&fixture().model(), &killed, method, SIZE);
        let shards = || crate::interruption::count(&killed, "index/c/") >= 1;
        // A fast method may have ended before; losses are tested above.
        crate::interruption::interrupt(&mut command, "-KILL", shards);
        succeed(&mut command);
        assert_same(&killed, &whole);
    }
}

#[test]
fn every_texel_is_a_texel_of_the_tile_and_has_its_cluster_and_normal() {
    let folder = tempfile::tempdir().unwrap();
    let tile = Tile::of(&fixture().model());
    let tile_normals = Model::open(&fixture().model()).unwrap().normals().unwrap();
    for method in METHODS {
        let output = folder.path().join(method);
        succeed(enlarge(&fixture().model(), &output, method, "300x260").arg("--keep-normals"));
        let store = Enlarged::open(&output).unwrap();
        let window = store.size().window();
        let (index, source) = (store.read(window).unwrap(), store.read_source(window).unwrap().unwrap());
        let normals = store.read_normals(window).unwrap().unwrap();
        for ((&cluster, &texel), normal) in index.iter().zip(&source).zip(normals) {
            assert_eq!(cluster, tile.index[texel as usize]);
            assert_eq!(normal, tile_normals[texel as usize]);
        }
    }
}

#[test]
fn seeds_make_other_planes_but_of_a_repeated_tile() {
    let folder = tempfile::tempdir().unwrap();
    for method in METHODS {
        let planes = ["1", "2"].map(|seed| {
            let output = folder.path().join(format!("{method}-{seed}"));
            // A repeated tile is the same for all seeds, so none is taken.
            let seed: &[&str] = if method == "repeat" { &[] } else { &["--seed", seed] };
            succeed(enlarge(&fixture().model(), &output, method, "200x150").args(seed));
            Plane::read(&output).source
        });
        assert_eq!(planes[0] == planes[1], method == "repeat", "{method}");
    }
}

#[test]
fn a_repeated_tile_is_periodic() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("repeat");
    succeed(&mut enlarge(&fixture().model(), &output, "repeat", SIZE));
    let (plane, Size { height, width }) = (Plane::read(&output), Tile::of(&fixture().model()).size);
    for y in 0..plane.size.height {
        for x in 0..plane.size.width {
            assert_eq!(plane.at(y, x) as usize, y % height * width + x % width);
        }
    }
}

#[test]
fn any_tile_joins_any_other_as_the_tile_joins_itself() {
    let folder = tempfile::tempdir().unwrap();
    let tile = Tile::of(&fixture().model());
    let Size { height, width } = tile.size;
    let output = folder.path().join("tiles");
    let size = Size::new(12 * height, 10 * width);
    succeed(&mut enlarge(&fixture().model(), &output, "tiles", &size.to_string()));
    let plane = Plane::read(&output);
    let mut kinds = BTreeSet::new();
    for row in 0..12 {
        for column in 0..10 {
            let at = |y: usize, x: usize| plane.at(row * height + y, column * width + x);
            let texels: Vec<u32> = (0..tile.size.texels()).map(|n| at(n / width, n % width)).collect();
            for (number, &texel) in texels.iter().enumerate() {
                let (y, x) = (number / width, number % width);
                let is_border = y == 0 || x == 0 || y + 1 == height || x + 1 == width;
                assert!(!is_border || texel as usize == number, "row {row} column {column}: {y}, {x}");
            }
            kinds.insert(texels);
        }
    }
    assert_eq!(kinds.len(), 4);
    // The cuts inside of tiles cost little more than steps of the tile do.
    let (cost, count) = tile.joints(&plane);
    let (mean, step) = (cost / count as f64, tile.step());
    assert!(mean < 2.0 * step, "joints {mean}, steps of the tile {step}");
}

#[test]
fn cut_joints_cost_less_than_straight_ones() {
    let folder = tempfile::tempdir().unwrap();
    let tile = Tile::of(&fixture().model());
    let cell = Roller::new(&tile.exemplar(), 1, None).unwrap().cell();
    let step = Quilt::step(tile.size);
    for (method, cell, probe) in [
        // The middle of what only one patch reaches: behind the overlap of a cell, or before that of a block.
        ("roller", cell, [cell.height - 1, cell.width - 1]),
        ("quilt", Size::new(step, step), [0, 0]),
    ] {
        let output = folder.path().join(method);
        succeed(&mut enlarge(&fixture().model(), &output, method, "720x660"));
        let plane = Plane::read(&output);
        let uncut = plane.uncut(tile.size, cell, probe);
        let cut = tile.joints(&plane.cropped(uncut.size));
        let straight = tile.joints(&uncut);
        // A path is longer than a straight joint; what counts is how much a joint shows along it.
        let mean = |(cost, count): (f64, usize)| cost / count as f64;
        println!("{method}: cut {cut:?} {}, straight {straight:?} {}", mean(cut), mean(straight));
        let excess = |joints| mean(joints) - tile.step();
        assert!(excess(cut) < 0.8 * excess(straight), "{method}: cut {cut:?}, straight {straight:?}");
    }
}

#[test]
fn quilted_blocks_fit_better_than_patches_of_random_places() {
    let folder = tempfile::tempdir().unwrap();
    let tile = Tile::of(&fixture().model());
    let step = Quilt::step(tile.size);
    let output = folder.path().join("quilt");
    succeed(&mut enlarge(&fixture().model(), &output, "quilt", "720x660"));
    let chosen = Plane::read(&output).uncut(tile.size, Size::new(step, step), [0, 0]);
    // The same blocks, each laid elsewhere: in the reverse order.
    let mut shuffled = Plane { size: chosen.size, source: chosen.source.clone() };
    for y in 0..chosen.size.height {
        for x in 0..chosen.size.width {
            let from = [
                (chosen.size.height / step - 1 - y / step) * step + y % step,
                (chosen.size.width / step - 1 - x / step) * step + x % step,
            ];
            shuffled.source[y * chosen.size.width + x] = chosen.at(from[0], from[1]);
        }
    }
    let [chosen, shuffled] = [chosen, shuffled].map(|plane| tile.joints(&plane).0);
    assert!(chosen < 0.7 * shuffled, "chosen {chosen}, shuffled {shuffled}");
}

#[test]
fn tileable_outputs_join_at_their_borders() {
    let folder = tempfile::tempdir().unwrap();
    let tile = Tile::of(&fixture().model());
    for method in METHODS {
        let refused = fail(
            enlarge(&fixture().model(), &folder.path().join("odd"), method, "331x331").arg("--tileable"),
            2,
        );
        // The hint names a size that does.
        let size = refused.rsplit("such as ").next().unwrap().split_whitespace().next().unwrap();
        let output = folder.path().join(method);
        succeed(enlarge(&fixture().model(), &output, method, size).arg("--tileable"));
        let plane = Plane::read(&output);
        let Size { height, width } = plane.size;
        assert!(width >= 331 && height >= 331, "{size}");
        let along = |x: usize| {
            let step = |y| tile.difference(plane.at(y, x), plane.at(y, (x + 1) % width));
            (0..height).map(step).sum::<f64>() / height as f64
        };
        let down = |y: usize| {
            let step = |x| tile.difference(plane.at(y, x), plane.at((y + 1) % height, x));
            (0..width).map(step).sum::<f64>() / width as f64
        };
        let columns: Vec<f64> = (0..width).map(along).collect();
        let rows: Vec<f64> = (0..height).map(down).collect();
        for steps in [columns, rows] {
            let (across, inside) = steps.split_last().unwrap();
            let most = inside.iter().copied().fold(0.0, f64::max);
            assert!(*across <= most, "{method}: {across} across, at most {most} inside");
        }
    }
}

#[test]
fn a_plane_that_wraps_goes_on_as_it_began() {
    let tile = Tile::of(&fixture().model());
    let exemplar = tile.exemplar();
    let Size { height, width } = tile.size;
    let (size, part) = (Size::new(4 * height, 6 * width), Size::new(height + 3, width + 5));
    let roller = {
        let Size { height, width } = Roller::new(&exemplar, 3, None).unwrap().cell();
        Size::new(8 * height, 12 * width)
    };
    type Window<'a> = Box<dyn Fn(i64, i64) -> Vec<u32> + 'a>;
    let windows: [(Size, Window<'_>); 2] = [
        (size, {
            let tiles = Tiles::new(&exemplar, 5, 3, Some(size)).unwrap();
            Box::new(move |y, x| tiles.window(y, x, part))
        }),
        (roller, {
            let roller = Roller::new(&exemplar, 3, Some(roller)).unwrap();
            Box::new(move |y, x| roller.window(y, x, part))
        }),
    ];
    for (size, window) in windows {
        let [down, right] = [size.height as i64, size.width as i64];
        for (y, x) in [(0, 0), (-7, 11), (20, -31)] {
            assert_eq!(window(y, x), window(y + down, x - right));
        }
        assert_ne!(window(0, 0), window(down / 2, 0));
    }
}

#[test]
fn patches_of_a_tile_that_does_not_join_stay_within_it() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("open.model.zarr");
    succeed(btf().arg("model").args([&fixture().measurement(), &model]).args([
        "--tile",
        "none",
        "--clusters",
        "24",
    ]));
    let tile = Tile::of(&model);
    let told = fail(&mut enlarge(&model, &folder.path().join("tiles"), "tiles", "99x99"), 2);
    assert!(told.contains("do not join") && told.contains("--tile cut"), "{told}");
    for method in ["roller", "quilt"] {
        let output = folder.path().join(method);
        succeed(&mut enlarge(&model, &output, method, "300x280"));
        let plane = Plane::read(&output);
        // Nowhere does a row of the tile go on from its end to its beginning, but by chance.
        let wraps = plane.source.chunks_exact(plane.size.width).map(|row| {
            let across = |pair: &&[u32]| {
                let width = tile.size.width as u32;
                pair[0] % width == width - 1 && pair[1] + width - 1 == pair[0]
            };
            row.windows(2).filter(across).count()
        });
        let wraps: usize = wraps.sum();
        assert!(wraps < 20, "{method}: {wraps}");
    }
}

#[test]
fn options_of_other_methods_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("never");
    for (method, options, named) in [
        ("repeat", &["--tiles", "3"][..], "--method tiles"),
        ("quilt", &["--tiles", "3"], "--method tiles"),
        ("coherent", &["--tiles", "3"], "--method tiles"),
        ("tiles", &["--jitter", "0.5"], "--method coherent"),
        ("roller", &["--candidates", "4"], "--method paper"),
        ("repeat", &["--band", "4"], "--method paper"),
        ("paper", &["--no-source"], "coherent or repeat"),
        ("tiles", &["--tiles", "0"], "1 to 256"),
        ("tiles", &["--tiles", "257"], "1 to 256"),
        ("quilt", &["--shard", "0/2"], "--shard"),
        ("repeat", &["--seed", "1..3"], "--seed"),
        ("repeat", &["--seed", "1"], "--method coherent or paper"),
    ] {
        let told = fail(enlarge(&fixture().model(), &output, method, "64x64").args(options), 2);
        assert!(told.contains(named), "{method} {options:?}: {told}");
        assert!(!output.exists(), "{method} {options:?}");
    }
}
