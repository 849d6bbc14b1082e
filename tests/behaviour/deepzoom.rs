//! Pyramids of tiles: sizes, pixels and averages checked against the picture itself; killed, resumed, refused.

use std::path::{Path, PathBuf};
use std::process::Command;

use btfkit::color::srgb_encode_u8;
use btfkit::stage::image::cluster_colors;
use btfkit::store::enlarged::Enlarged;
use btfkit::store::model::Model;
use btfkit_formats::{Direction, Limits, jpeg};

use crate::fixture::{assert_same, btf, fail, fixture, succeed, tree};
use crate::interruption::{count, interrupt};

const LIGHT: &str = "30,90";

fn export(source: &Path, output: &Path) -> Command {
    let mut command = btf();
    command.arg("export").args([source, output]).args(["--deepzoom", "--light", LIGHT]);
    if Enlarged::open(source).is_ok() {
        command.arg("--model").arg(fixture().model());
    }
    command
}

/// An 8-bit picture.
struct Pixels {
    width: usize,
    height: usize,
    values: Vec<u8>,
}

impl Pixels {
    fn png(path: &Path) -> Self {
        let file = std::fs::File::open(path).unwrap_or_else(|_| panic!("no {}", path.display()));
        let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
        let mut values = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut values).unwrap();
        Self { width: info.width as usize, height: info.height as usize, values }
    }

    fn at(&self, x: usize, y: usize) -> &[u8] {
        &self.values[3 * (y * self.width + x)..][..3]
    }
}

/// Linear values of a level.
struct Linear {
    width: usize,
    height: usize,
    values: Vec<[f64; 3]>,
}

impl Linear {
    /// The picture of an enlarged index under the light of these tests.
    fn of(source: &Path) -> Self {
        let model = Model::open(&fixture().model()).unwrap();
        let (view, light) = (Direction::from_degrees(0.0, 0.0), LIGHT.parse().unwrap());
        let colors = cluster_colors(&model, view, light).unwrap();
        let enlarged = Enlarged::open(source).unwrap();
        let size = enlarged.size();
        let index = enlarged.read(size.window()).unwrap();
        let values = index.iter().map(|&cluster| colors[usize::from(cluster)].map(f64::from)).collect();
        Self { width: size.width, height: size.height, values }
    }

    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut values = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let places = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(dy, dx)| (2 * y + dy, 2 * x + dx));
                let there: Vec<&[f64; 3]> = places
                    .iter()
                    .filter(|(y, x)| *y < self.height && *x < self.width)
                    .map(|(y, x)| &self.values[y * self.width + x])
                    .collect();
                let mean = |c: usize| there.iter().map(|pixel| pixel[c]).sum::<f64>() / there.len() as f64;
                values.push([mean(0), mean(1), mean(2)]);
            }
        }
        Self { width, height, values }
    }
}

/// Checks every pixel of every tile of a pyramid of PNGs; returns how many files there are.
fn check_all(source: &Path, output: &Path, side: usize, overlap: usize) -> usize {
    let files = PathBuf::from(output.to_str().unwrap().replace(".dzi", "_files"));
    let mut linear = Linear::of(source);
    let description = std::fs::read_to_string(output).unwrap();
    for part in [
        "xmlns=\"http://schemas.microsoft.com/deepzoom/2008\"".to_owned(),
        format!("Format=\"png\" Overlap=\"{overlap}\" TileSize=\"{side}\""),
        format!("Size Width=\"{}\" Height=\"{}\"", linear.width, linear.height),
    ] {
        assert!(description.contains(&part), "{description} lacks {part}");
    }
    let top = (linear.width.max(linear.height) as f64).log2().ceil() as usize;
    let mut tiles = 0;
    for level in (0..=top).rev() {
        let (mut off, mut values) = (0, 0);
        for row in 0..linear.height.div_ceil(side) {
            for column in 0..linear.width.div_ceil(side) {
                let tile = Pixels::png(&files.join(format!("{level}/{column}_{row}.png")));
                tiles += 1;
                let (left, upper) = (column * side, row * side);
                let (before_x, before_y) =
                    (if column > 0 { overlap } else { 0 }, if row > 0 { overlap } else { 0 });
                let end = |start: usize, extent: usize| (start + side + overlap).min(extent);
                assert_eq!(tile.width, end(left, linear.width) - left + before_x);
                assert_eq!(tile.height, end(upper, linear.height) - upper + before_y);
                for y in 0..tile.height {
                    for x in 0..tile.width {
                        let (py, px) = (upper + y - before_y, left + x - before_x);
                        for (c, &found) in tile.at(x, y).iter().enumerate() {
                            let expected = srgb_encode_u8(linear.values[py * linear.width + px][c]);
                            let difference = found.abs_diff(expected);
                            // Means are of f32: beside a threshold they may fall on its other side.
                            let most = u8::from(level < top);
                            assert!(difference <= most, "level {level} x {px} y {py}: {found}, {expected}");
                            off += usize::from(difference);
                            values += 1;
                        }
                    }
                }
            }
        }
        assert!(off * 1000 <= values, "level {level}: {off} of {values} values are off by one");
        linear = linear.halved();
    }
    assert_eq!((linear.width, linear.height), (1, 1));
    assert!(!files.join((top + 1).to_string()).exists());
    tree(&files).len() - tiles
}

#[test]
fn every_level_is_the_mean_in_linear_light_of_the_one_above() {
    let folder = tempfile::tempdir().unwrap();
    for (name, size, side, overlap) in
        [("stock", "254", 254, 1), ("shared", "64", 64, 5), ("apart", "100", 100, 0)]
    {
        let output = folder.path().join(format!("{name}.dzi"));
        let overlap_text = overlap.to_string();
        succeed(export(&fixture().enlarged(), &output).args([
            "--tile-size",
            size,
            "--overlap",
            &overlap_text,
        ]));
        // The recipe is the only file beside the tiles.
        assert_eq!(check_all(&fixture().enlarged(), &output, side, overlap), 1);
    }
    // Means of display values would be darker by more than these tests allow.
    let linear = Linear::of(&fixture().enlarged());
    let halved = linear.halved();
    let darker = (0..halved.height / 2 * halved.width).filter(|n| {
        let (y, x) = (n / halved.width, n % halved.width);
        if 2 * x + 1 >= linear.width {
            return false;
        }
        let display: f64 = [(0, 0), (0, 1), (1, 0), (1, 1)]
            .map(|(dy, dx)| linear.values[(2 * y + dy) * linear.width + 2 * x + dx][1])
            .map(|value| f64::from(srgb_encode_u8(value)) / 4.0)
            .iter()
            .sum();
        f64::from(srgb_encode_u8(halved.values[*n][1])) > display + 2.0
    });
    assert!(darker.count() > 1000);
}

#[test]
fn the_full_level_is_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    let (output, whole) = (folder.path().join("big.dzi"), folder.path().join("whole.png"));
    succeed(export(&fixture().enlarged(), &output).args(["--tile-size", "96", "--exposure", "1.5"]));
    succeed(
        btf()
            .arg("image")
            .arg(fixture().enlarged())
            .args(["--light", LIGHT, "--exposure", "1.5", "--out"])
            .arg(&whole),
    );
    let whole = Pixels::png(&whole);
    for (column, row) in [(0, 0), (3, 2), (5, 7), (2, 7)] {
        let tile = Pixels::png(&folder.path().join(format!("big_files/10/{column}_{row}.png")));
        let (left, upper) = ((96 * column).max(1) - 1, (96 * row).max(1) - 1);
        for y in 0..tile.height {
            for x in 0..tile.width {
                assert_eq!(tile.at(x, y), whole.at(left + x, upper + y));
            }
        }
    }
}

#[test]
fn odd_and_narrow_pictures_have_all_levels() {
    let folder = tempfile::tempdir().unwrap();
    for size in ["1x1", "1x67", "90x1", "33x32", "17x9", "31x65"] {
        let [source, output] = [".zarr", ".dzi"].map(|end| folder.path().join(format!("{size}{end}")));
        succeed(btf().arg("enlarge").args([&fixture().model(), &source]).args(["--size", size]));
        succeed(export(&source, &output).args(["--tile-size", "16", "--overlap", "2"]));
        check_all(&source, &output, 16, 2);
    }
}

#[test]
fn measurements_and_tiles_of_models_become_pyramids_too() {
    let folder = tempfile::tempdir().unwrap();
    for (name, source) in [("measured", fixture().measurement()), ("tile", fixture().model())] {
        let [output, whole] = ["dzi", "png"].map(|end| folder.path().join(format!("{name}.{end}")));
        succeed(btf().arg("export").args([&source, &output]).args(["--light", LIGHT]));
        succeed(btf().arg("image").arg(&source).args(["--light", LIGHT, "--out"]).arg(&whole));
        let whole = Pixels::png(&whole);
        let top = (whole.width.max(whole.height) as f64).log2().ceil();
        let tile = Pixels::png(&folder.path().join(format!("{name}_files/{top}/0_0.png")));
        assert_eq!((tile.width, &tile.values), (whole.width, &whole.values));
    }
}

#[test]
fn threads_and_memory_change_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    for (name, common) in
        [("one", ["--threads", "1", "--memory", "17500KiB"]), ("two", ["--threads", "2", "--memory", "1GiB"])]
    {
        let output = folder.path().join(name).join("big.dzi");
        std::fs::create_dir(folder.path().join(name)).unwrap();
        succeed(export(&fixture().enlarged(), &output).args(["--tile-size", "64"]).args(common));
    }
    let [one, two] = ["one", "two"].map(|name| folder.path().join(name));
    assert_same(&one, &two);
    let told =
        fail(export(&fixture().enlarged(), &folder.path().join("none.dzi")).args(["--memory", "16MiB"]), 2);
    assert!(told.contains("--memory"), "{told}");
    assert!(!folder.path().join("none_files").exists());
}

#[test]
fn killed_at_any_time_it_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let [killed, whole] = ["killed", "whole"].map(|name| folder.path().join(name));
    [&killed, &whole].iter().for_each(|path| std::fs::create_dir(path).unwrap());
    let run = |place: &Path| {
        let mut command = export(&fixture().enlarged(), &place.join("big.dzi"));
        command.args(["--tile-size", "16", "--threads", "2"]);
        command
    };
    for tiles in [1, 300, 900] {
        let code = interrupt(&mut run(&killed), "-KILL", || count(&killed, ".png") >= tiles);
        assert_eq!(code, None, "the export ended before it was killed");
        assert!(!killed.join("big.dzi").exists());
    }
    // A kill in the middle of a write leaves a temporary file; this one is as if of a dead process.
    let host = btfkit::disk::host();
    std::fs::write(killed.join(format!("big_files/10/.0_0.png.tmp-{host}-999999999-00000000")), b"x")
        .unwrap();
    let told = succeed(&mut run(&killed));
    let found: u64 = told.split(" written, ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(found >= 800, "{told}");
    succeed(&mut run(&whole));
    assert_same(&killed, &whole);
    // What is missing is made again, what is there is left alone.
    std::fs::remove_file(killed.join("big_files/9/3_2.png")).unwrap();
    let told = succeed(run(&killed).arg("--json"));
    assert!(told.contains("\"tiles_written\": 1"), "{told}");
    assert_same(&killed, &whole);
}

#[test]
fn another_recipe_and_other_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("big.dzi");
    succeed(&mut export(&fixture().enlarged(), &output));
    let before = tree(folder.path());
    for (options, named) in [
        (["--view", "40,0"], "view"),
        (["--format", "jpeg"], "tiles"),
        (["--overlap", "2"], "overlap"),
        (["--exposure", "2"], "exposure"),
    ] {
        let told = fail(export(&fixture().enlarged(), &output).args(options), 65);
        assert!(told.contains("another recipe") && told.contains(named), "{told}");
    }
    let told = fail(&mut export(&fixture().model(), &output), 65);
    assert!(told.contains("source"), "{told}");
    assert!(before == tree(folder.path()));

    std::fs::create_dir(folder.path().join("mine_files")).unwrap();
    std::fs::write(folder.path().join("mine_files/letter.txt"), "dear").unwrap();
    std::fs::write(folder.path().join("page.html"), "mine").unwrap();
    for name in ["mine.dzi", "page.dzi"] {
        let told = fail(&mut export(&fixture().enlarged(), &folder.path().join(name)), 65);
        assert!(told.contains("exists"), "{told}");
    }
    fail(export(&fixture().enlarged(), &folder.path().join("a.dzi")).args(["--tile-size", "0"]), 2);
    fail(&mut export(&fixture().enlarged(), &folder.path().join("a.png")), 2);
}

/// A page or a description of another's in a pyramid's place is never taken for its own, nor replaced unasked.
#[test]
fn files_of_others_beside_the_tiles_are_refused_and_losses_are_told_every_time() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("big.dzi");
    let run = || {
        let mut command = export(&fixture().model(), &output);
        command.args(["--exposure", "20"]);
        command
    };
    let told = succeed(&mut run());
    let losses =
        |told: &str| told.lines().filter(|line| line.contains("not held")).collect::<Vec<_>>().join(" ");
    assert!(losses(&told).contains("values above white"), "{told}");
    let whole = tree(folder.path());
    // Found done, all at once or after the end was lost.
    assert_eq!(losses(&succeed(&mut run())), losses(&told));
    std::fs::remove_file(&output).unwrap();
    assert_eq!(losses(&succeed(&mut run())), losses(&told));
    assert!(whole == tree(folder.path()));
    for name in ["big.html", "big.dzi"] {
        let path = folder.path().join(name);
        std::fs::write(&path, "mine").unwrap();
        let told = fail(&mut run(), 65);
        assert!(told.contains(&format!("{name} exists")) && told.contains("--force"), "{told}");
        assert_eq!(std::fs::read(&path).unwrap(), b"mine");
        succeed(run().arg("--force"));
        assert!(whole == tree(folder.path()));
        // What is no file is not replaced by force either.
        std::fs::remove_file(&path).unwrap();
        std::os::unix::fs::symlink(folder.path().join("elsewhere"), &path).unwrap();
        fail(run().arg("--force"), 65);
        assert!(path.is_symlink());
        std::fs::remove_file(&path).unwrap();
        succeed(&mut run());
        assert!(whole == tree(folder.path()));
    }
}

#[test]
fn jpeg_tiles_are_near_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    for (name, options) in
        [("png", &["--format", "png"][..]), ("jpeg", &["--format", "jpeg", "--quality", "95"])]
    {
        let output = folder.path().join(format!("{name}.dzi"));
        succeed(export(&fixture().enlarged(), &output).args(options));
    }
    let tile = Pixels::png(&folder.path().join("png_files/10/1_1.png"));
    let bytes = std::fs::read(folder.path().join("jpeg_files/10/1_1.jpg")).unwrap();
    let decoded = jpeg::decode(&bytes, &Limits::default()).unwrap();
    assert_eq!((decoded.width as usize, decoded.height as usize), (tile.width, tile.height));
    let sum: u64 = decoded.samples.iter().zip(&tile.values).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    let mean = sum as f64 / tile.values.len() as f64;
    assert!(mean < 10.0, "{mean}");
    assert!(std::fs::read_to_string(folder.path().join("jpeg.dzi")).unwrap().contains("Format=\"jpg\""));
}

#[test]
fn the_page_describes_the_picture_and_asks_for_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("a<b> & Ü.dzi");
    succeed(&mut export(&fixture().enlarged(), &output));
    let page = std::fs::read_to_string(output.with_extension("html")).unwrap();
    assert!(page.contains(r#""name":"a\u003cb> & Ü""#), "{page}");
    assert!(page.contains(r#""width":530"#) && page.contains(r#""height":700"#), "{page}");
    assert!(!page.contains("http"), "the page names an address");
}

#[test]
fn what_is_to_be_done_about_missing_tiles_is_said_once() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("p.dzi");
    succeed(&mut export(&fixture().enlarged(), &output));
    let tiles = std::fs::read_dir(folder.path().join("p_files/10")).unwrap();
    let removed = tiles.take(4).map(|tile| std::fs::remove_file(tile.unwrap().path()).unwrap()).count();
    let found = btf().arg("verify").arg(&output).output().unwrap();
    assert_eq!(found.status.code(), Some(66));
    let [told, error] =
        [found.stdout, found.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    assert_eq!(told.matches("no such tile").count(), removed, "{told}");
    assert_eq!([told, error].concat().matches("it goes on where it stopped").count(), 1);
}
