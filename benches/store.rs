//! Our side of `scripts/bench-store`: writes and reads one measurement in stores of several chunk shapes.
//!
//!     cargo bench --bench store -- SAMPLES VIEWS SIDE LIGHTS CHANNELS DIRECTORY
//!
//! SAMPLES holds [view, y, x, light, channel] bytes. Prints rows of the table of `scripts/bench-store`; times are
//! those of the processor. Shards are put together here as an import does it: encoded chunks one after the other,
//! then the index with its checksum.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use btfkit::kernel::predict::Shape;
use btfkit::zarr::codec::{Chain, Chunk, ChunkCodec, chunk_codecs, fused};
use btfkit::zarr::storage::MappedStorage;
use btfkit_formats::SampleType;
use zarrs::array::{
    Array, ArrayBuilder, ArrayMetadataOptions, ArraySubset, CodecOptions, FillValue, data_type,
};

/// Seconds of the processor that this thread has used.
fn cpu() -> f64 {
    let text = fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    text.split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-9
}

fn seconds(mut work: impl FnMut()) -> f64 {
    let start = cpu();
    work();
    cpu() - start
}

/// The samples and their extent; side is a multiple of 32.
struct Samples {
    bytes: Vec<u8>,
    views: usize,
    side: usize,
    lights: usize,
    channels: usize,
}

impl Samples {
    fn texel(&self) -> usize {
        self.lights * self.channels
    }

    /// Bytes of some lights of a texel.
    fn at(&self, view: usize, y: usize, x: usize, light: usize, lights: usize) -> &[u8] {
        let start = ((view * self.side + y) * self.side + x) * self.texel() + light * self.channels;
        &self.bytes[start..start + lights * self.channels]
    }

    /// One channel alone, as the array of lightness is.
    fn one_channel(&self) -> Self {
        let bytes = self.bytes.iter().skip(self.channels / 2).step_by(self.channels).copied().collect();
        Self { bytes, channels: 1, ..*self }
    }
}

struct Store<'a> {
    samples: &'a Samples,
    path: PathBuf,
    side: usize,
    lights: usize,
    codec: ChunkCodec,
    array: Array<MappedStorage>,
    chunk: Vec<u8>,
}

impl<'a> Store<'a> {
    fn new(samples: &'a Samples, chain: Chain, side: usize, lights: usize, path: &Path) -> Self {
        let shape = Shape { rows: side, columns: side, lights };
        let channels = (samples.channels > 1).then_some(samples.channels);
        let chunk = Chunk { samples: SampleType::U8, shape, channels };
        let extent = |views: usize, side: usize, lights: usize| -> Vec<u64> {
            [views, side, side, lights].into_iter().chain(channels).map(|n| n as u64).collect()
        };
        let codecs = chunk_codecs(chain, &chunk).unwrap();
        let whole = extent(samples.views, samples.side, samples.lights);
        let shard = extent(1, samples.side, samples.lights);
        let array = ArrayBuilder::new(whole, shard, data_type::uint8(), FillValue::new(vec![0]))
            .subchunk_shape(extent(1, side, lights))
            .array_to_array_codecs(codecs.array_to_array)
            .array_to_bytes_codec(codecs.array_to_bytes)
            .bytes_to_bytes_codecs(codecs.bytes_to_bytes)
            .build(Arc::new(MappedStorage::new(path)), "/a")
            .unwrap();
        let options = ArrayMetadataOptions::default().with_include_zarrs_metadata(false);
        array.store_metadata_opt(&options).unwrap();
        // As the program reads it.
        let mut metadata = serde_json::to_value(array.metadata_opt(&options)).unwrap();
        metadata["codecs"] = fused(metadata["codecs"].take(), &chunk);
        let metadata = serde_json::from_value(metadata).unwrap();
        let array = Array::new_with_metadata(array.storage(), "/a", metadata).unwrap();
        let codec = ChunkCodec::new(chain, chunk).unwrap();
        Self { samples, path: path.to_owned(), side, lights, codec, array, chunk: vec![0; chunk.bytes()] }
    }

    fn shard_path(&self, view: usize) -> PathBuf {
        let mut indices = vec![0; self.array.dimensionality()];
        indices[0] = view as u64;
        self.path.join(self.array.chunk_key(&indices).as_str())
    }

    /// Corners of the chunks of a shard, in its order: row, column, light.
    fn corners(&self) -> Vec<[usize; 3]> {
        let (side, whole) = (self.side, self.samples.side);
        let lights = || (0..self.samples.lights).step_by(self.lights);
        let columns = move |y| (0..whole).step_by(side).map(move |x| (y, x));
        (0..whole)
            .step_by(side)
            .flat_map(columns)
            .flat_map(|(y, x)| lights().map(move |l| [y, x, l]))
            .collect()
    }

    fn write(&mut self) -> u64 {
        let mut size = 0;
        let (mut shard, mut index) = (Vec::new(), Vec::new());
        for view in 0..self.samples.views {
            shard.clear();
            index.clear();
            for [y0, x0, l0] in self.corners() {
                let texels = (y0..y0 + self.side).flat_map(|y| (x0..x0 + self.side).map(move |x| (y, x)));
                for ((y, x), out) in
                    texels.zip(self.chunk.chunks_exact_mut(self.lights * self.samples.channels))
                {
                    out.copy_from_slice(self.samples.at(view, y, x, l0, self.lights));
                }
                let start = shard.len();
                self.codec.encode(&self.chunk, &mut shard).unwrap();
                for number in [start, shard.len() - start] {
                    index.extend((number as u64).to_le_bytes());
                }
            }
            let checksum = crc32c::crc32c(&index);
            shard.extend(&index);
            shard.extend(checksum.to_le_bytes());
            let path = self.shard_path(view);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, &shard).unwrap();
            size += shard.len() as u64;
        }
        size
    }

    /// Decodes the wanted chunks of a view's shard and hands each to `f` with its corner.
    fn read(
        &mut self,
        view: usize,
        wanted: impl Fn([usize; 3]) -> bool,
        mut f: impl FnMut([usize; 3], &[u8]),
    ) {
        let map = btfkit::disk::mapped::MappedFile::open(&self.shard_path(view)).unwrap();
        let shard: &[u8] = map.as_ref();
        let corners = self.corners();
        let (index, _) = shard[shard.len() - 4 - 16 * corners.len()..].as_chunks::<8>();
        let number = |n: usize| u64::from_le_bytes(index[n]) as usize;
        for (n, corner) in corners.into_iter().enumerate().filter(|(_, corner)| wanted(*corner)) {
            let (start, length) = (number(2 * n), number(2 * n + 1));
            self.codec.decode(&shard[start..start + length], &mut self.chunk).unwrap();
            f(corner, &self.chunk);
        }
    }

    fn scan(&mut self) {
        let (side, lights) = (self.side, self.lights);
        for view in 0..self.samples.views {
            let samples = self.samples;
            self.read(
                view,
                |_| true,
                |[y, x, l], chunk| {
                    let last = &chunk[chunk.len() - lights * samples.channels..];
                    assert!(last == samples.at(view, y + side - 1, x + side - 1, l, lights));
                },
            );
        }
    }

    fn image(&mut self, view: usize, light: usize) {
        let (samples, side, lights) = (self.samples, self.side, self.lights);
        let mut image = vec![0; samples.side * samples.side * samples.channels];
        let holds = |l: usize| (l..l + lights).contains(&light);
        self.read(
            view,
            |[_, _, l]| holds(l),
            |[y0, x0, l0], chunk| {
                for (texel, bytes) in chunk.chunks_exact(lights * samples.channels).enumerate() {
                    let (y, x) = (y0 + texel / side, x0 + texel % side);
                    let to = (y * samples.side + x) * samples.channels;
                    let from = (light - l0) * samples.channels;
                    image[to..to + samples.channels].copy_from_slice(&bytes[from..from + samples.channels]);
                }
            },
        );
        assert!(image[..samples.channels] == *samples.at(view, 0, 0, light, 1));
    }

    /// A square of texels under all directions.
    fn block(&mut self, y: usize, x: usize, extent: usize) {
        let (samples, side, lights) = (self.samples, self.side, self.lights);
        let mut block = vec![0; samples.views * extent * extent * samples.texel()];
        let near = |corner: usize, start: usize| corner < start + extent && start < corner + side;
        for (view, block) in block.chunks_exact_mut(extent * extent * samples.texel()).enumerate() {
            self.read(
                view,
                |[cy, cx, _]| near(cy, y) && near(cx, x),
                |[cy, cx, l], chunk| {
                    for (texel, bytes) in chunk.chunks_exact(lights * samples.channels).enumerate() {
                        let (ty, tx) = (cy + texel / side, cx + texel % side);
                        if (y..y + extent).contains(&ty) && (x..x + extent).contains(&tx) {
                            let to = ((ty - y) * extent + tx - x) * samples.texel() + l * samples.channels;
                            block[to..to + bytes.len()].copy_from_slice(bytes);
                        }
                    }
                },
            );
        }
        assert!(block[..samples.texel()] == *samples.at(0, y, x, 0, samples.lights));
    }

    /// Scan and image through zarrs.
    fn through_zarrs(&self) -> (f64, f64) {
        let options = CodecOptions::default().with_concurrent_target(1);
        let read = |view: u64, light: std::ops::Range<u64>| {
            let side = self.samples.side as u64;
            let mut ranges = vec![view..view + 1, 0..side, 0..side, light];
            ranges.extend((self.samples.channels > 1).then_some(0..self.samples.channels as u64));
            let subset = ArraySubset::new_with_ranges(&ranges);
            let found: Vec<u8> = self.array.retrieve_array_subset_opt(&subset, &options).unwrap();
            assert!(!found.is_empty());
        };
        let (views, lights) = (self.samples.views as u64, self.samples.lights as u64);
        let scan = seconds(|| (0..views.min(16)).for_each(|view| read(view, 0..lights))) * views as f64;
        let image = seconds(|| (0..4).for_each(|n| read(n * views / 4, n * 7 % lights..n * 7 % lights + 1)));
        (scan / views.min(16) as f64, image / 4.0)
    }
}

fn row(samples: &Samples, lightness: &Samples, chain: Chain, side: usize, lights: usize, directory: &Path) {
    let _ = fs::remove_dir_all(directory);
    let mut store = Store::new(samples, chain, side, lights, directory);
    let mut size = 0;
    let write = seconds(|| size = store.write());
    let scan = seconds(|| store.scan());
    let views = samples.views;
    let image = seconds(|| (0..8).for_each(|n| store.image(n * views / 8, n * 7 % samples.lights))) / 8.0;
    let place = |n: usize| (n * 37 % samples.side, n * 53 % samples.side);
    let texel = seconds(|| (0..24).for_each(|n| store.block(place(n).0, place(n).1, 1))) / 24.0;
    let (zarrs_scan, zarrs_image) = store.through_zarrs();
    let _ = fs::remove_dir_all(directory);
    let mut store = Store::new(lightness, chain, side, lights, directory);
    store.write();
    let block = seconds(|| (0..4).for_each(|n| store.block(8 * n, 16 * n, 32))) / 4.0;
    let megabytes = samples.bytes.len() as f64 * 1e-6;
    println!(
        "| btfkit {}, {side}x{side} x {lights} lights | {:.2} | {:.0} | {:.0} | {:.2} | {:.2} | {:.1} | {:.0} | {:.2} |",
        chain.name(),
        samples.bytes.len() as f64 / size as f64,
        megabytes / write,
        megabytes / scan,
        image * 1e3,
        texel * 1e3,
        block * 1e3,
        megabytes / zarrs_scan,
        zarrs_image * 1e3,
    );
    let _ = fs::remove_dir_all(directory);
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let [file, views, side, lights, channels, directory] = arguments.as_slice() else {
        println!("store: run by scripts/bench-store");
        return;
    };
    let number = |text: &String| text.parse::<usize>().unwrap();
    let (views, side, lights, channels) = (number(views), number(side), number(lights), number(channels));
    let samples = Samples { bytes: fs::read(file).unwrap(), views, side, lights, channels };
    assert_eq!(samples.bytes.len(), views * side * side * samples.texel());
    let lightness = samples.one_channel();
    let directory = Path::new(directory).join("ours");
    for chain in [Chain::Predictive, Chain::Stock] {
        for (side, parts) in [(8, 1), (16, 1), (32, 1), (16, 3)] {
            row(&samples, &lightness, chain, side, lights / parts, &directory);
        }
    }
}
