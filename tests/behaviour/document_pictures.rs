//! The pictures in the documents are those that the program makes now.
//!
//! `scripts/pictures` makes them anew; the test compares what is committed with what comes out.

use std::path::{Path, PathBuf};

use btfkit::picture::Picture;
use btfkit::shape::Size;
use btfkit_formats::jpeg::{Chroma, EncodeOptions, encode};

use crate::fixture::{btf, succeed};

const JPEG: EncodeOptions = EncodeOptions { quality: 88, progressive: false, chroma: Chroma::Half };

/// Texels of a panel along each side, and between panels.
const PANEL: usize = 300;
const GAP: usize = 6;

/// A light near the normal, and a low one from the left.
const LIGHTS: [&str; 2] = ["15,0", "60,180"];

/// A made material, its model, and its enlargements by name of method.
struct Material {
    folder: tempfile::TempDir,
}

impl Material {
    fn make(name: &str, methods: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| folder.path().join(name);
        let [archive, store, model] = ["s.zip", "s.zarr", "s.model.zarr"].map(place);
        let sample = ["--material", name, "--size", "448x448", "--views", "5", "--lights", "19"];
        succeed(btf().arg("sample").arg(&archive).args(sample));
        succeed(btf().arg("import").args([&archive, &store]));
        succeed(btf().arg("model").args([&store, &model]).args(["--tile", "224x224"]));
        for method in methods {
            let size = ["--size", "512x512", "--method", method];
            succeed(btf().arg("enlarge").args([&model, &place(method)]).args(size));
        }
        Self { folder }
    }

    /// A panel of the measurement (`s.zarr`) or of an enlargement.
    fn panel(&self, of: &str, light: &str) -> Picture {
        let out = self.folder.path().join("panel.png");
        let window = format!("0,0,{PANEL},{PANEL}");
        let options = ["--view", "0,0", "--light", light, "--window", &window, "--out"];
        succeed(btf().arg("image").arg(self.folder.path().join(of)).args(options).arg(&out).arg("--force"));
        read(&out)
    }

    /// A car interior covered with the endless plane of the model.
    fn interior(&self) -> Picture {
        let out = self.folder.path().join("interior.png");
        let options = ["--plane", "--shape", "interior", "--size", "440x330", "--light", "40,110", "--out"];
        succeed(btf().arg("render").arg(self.folder.path().join("s.model.zarr")).args(options).arg(&out));
        read(&out)
    }
}

/// A PNG of 8 bits.
fn read(path: &Path) -> Picture {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let size = reader.next_frame(&mut bytes).unwrap();
    let pixels = bytes.chunks_exact(3).map(|p| [p[0], p[1], p[2]].map(|v| f32::from(v) / 255.0));
    Picture::display(Size::new(size.height as usize, size.width as usize), pixels.collect())
}

/// Rows of equally wide pictures as one.
fn stacked(rows: &[Picture]) -> Picture {
    let width = rows[0].size.width;
    let mut pixels: Vec<[f32; 3]> = Vec::new();
    for (number, row) in rows.iter().enumerate() {
        assert_eq!(row.size.width, width);
        if number > 0 {
            pixels.extend(std::iter::repeat_n([1.0; 3], GAP * width));
        }
        pixels.extend(&row.pixels);
    }
    Picture::display(Size::new(pixels.len() / width, width), pixels)
}

fn jpeg(picture: &Picture) -> Vec<u8> {
    let Size { height, width } = picture.size;
    encode(&picture.bytes(), width as u32, height as u32, 3, &JPEG).unwrap()
}

/// All pictures of the documents by name.
fn pictures() -> Vec<(&'static str, Vec<u8>)> {
    let methods = ["repeat", "paper", "coherent"];
    let [leather, wood] = ["leather", "wood"].map(|name| Material::make(name, &methods));
    let row = |panels: &[Picture]| Picture::side_by_side(panels, GAP);
    let first = [
        leather.panel("s.zarr", LIGHTS[0]),
        leather.panel("coherent", LIGHTS[0]),
        leather.panel("coherent", LIGHTS[1]),
    ];
    let rows = [&leather, &wood].map(|material| {
        row(&["s.zarr", "repeat", "paper", "coherent"].map(|of| material.panel(of, LIGHTS[0])))
    });
    let interior = jpeg(&row(&[leather.interior(), wood.interior()]));
    vec![
        ("leather.jpg", jpeg(&row(&first))),
        ("methods.jpg", jpeg(&stacked(&rows))),
        ("interior.jpg", interior),
    ]
}

fn samples(jpeg: &[u8]) -> Vec<u8> {
    zune_jpeg::JpegDecoder::new(zune_jpeg::zune_core::bytestream::ZCursor::new(jpeg)).decode().unwrap()
}

#[test]
fn the_documents_show_what_the_program_makes() {
    let folder: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/images");
    let write = std::env::var_os("BTFKIT_WRITE_PICTURES").is_some();
    for (name, made) in pictures() {
        let path = folder.join(name);
        if write {
            std::fs::write(&path, &made).unwrap();
            continue;
        }
        let committed = std::fs::read(&path).unwrap();
        // Processors may round the encoder's transform otherwise; another picture is another by far more than that.
        let [made, committed] = [samples(&made), samples(&committed)];
        let same = made.len() == committed.len()
            && made.iter().zip(&committed).map(|(&a, &b)| u64::from(a.abs_diff(b))).sum::<u64>()
                <= made.len() as u64 / 4;
        assert!(same, "{} is not what the program makes now: run scripts/pictures", path.display());
    }
}
