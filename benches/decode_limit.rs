//! The limit of an import: the CPU seconds that zune-jpeg takes merely to decode the images of an archive.
//!
//!     cargo bench --bench decode_limit -- ARCHIVE.zip [K/N]
//!
//! Part K of N of the views, as `btf import --shard K/N` takes them. One thread; strictness and colour
//! conversion as in an import, without its check of the structure.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use btfkit::run::shard::Shard;
use btfkit_formats::Limits;
use btfkit_formats::ubo2003::Catalogue;
use btfkit_formats::zip::ZipIndex;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let Some(archive) = arguments.first() else {
        println!("decode_limit: skipped, give an archive");
        return;
    };
    let shard: Shard = arguments.get(1).map_or(Shard::WHOLE, |text| text.parse().unwrap());
    let bytes = btfkit::disk::mapped::MappedFile::open(archive.as_ref()).unwrap();
    let index = ZipIndex::open(bytes.as_ref(), &Limits::default()).unwrap();
    let catalogue =
        Catalogue::from_names(index.entries().iter().map(btfkit_formats::zip::ZipEntry::name)).unwrap();
    let (mut images, mut pixels, mut encoded) = (0, 0u64, 0u64);
    let start = cpu_seconds();
    for view in (0..catalogue.views().len()).filter(|&view| shard.has(view)) {
        for light in 0..catalogue.lights().len() {
            let entry = &index.entries()[catalogue.image(view, light).unwrap()];
            let data = &bytes.as_ref()[entry.compressed_range()];
            let samples = JpegDecoder::new(ZCursor::new(data)).decode().unwrap();
            pixels += samples.len() as u64 / 3;
            encoded += data.len() as u64;
            images += 1;
            bytes.release(entry.compressed_range());
        }
    }
    let seconds = cpu_seconds() - start;
    let rate = pixels as f64 / 1e6 / seconds;
    println!("{images} images, {pixels} pixels, {encoded} bytes: {seconds:.2} CPU s, {rate:.0} MPix/s");
}

/// User and system time of this process.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<i64> =
        stat.rsplit(')').next().unwrap().split_whitespace().filter_map(|f| f.parse().ok()).collect();
    // Fields after the state: utime and stime are numbers 14 and 15 of the line, in ticks of 10 ms.
    (fields[10] + fields[11]) as f64 / 100.0
}
