"""Chunked stores of others on the samples of one measurement; run by scripts/bench-store.

    python store.py raw MEASUREMENT FILE SIDE   the samples of a corner [view, y, x, light, channel]; prints its extent
    python store.py peers FILE VIEWS SIDE LIGHTS CHANNELS DIRECTORY

Each peer holds [y, x, view * light, channel] in chunks as its users would cut them, at its zstd level 3, and in
chunks that favour images as ours do. Times are those of the processor, of all threads.
"""

import os
import shutil
import sys
import time

import numpy as np


def size(path):
    if os.path.isfile(path):
        return os.path.getsize(path)
    return sum(os.path.getsize(os.path.join(d, f)) for d, _, files in os.walk(path) for f in files)


def seconds(work):
    start = time.process_time()
    work()
    return time.process_time() - start


def row(name, samples, lights, path, write, opener):
    """Writes and reads one store and prints its row; what was read is compared."""
    megabytes = samples.nbytes / 1e6
    written = seconds(write)
    ratio = samples.nbytes / size(path)
    store = opener()
    side, directions = samples.shape[0], samples.shape[2]
    texels = [(n * 37 % side, n * 53 % side) for n in range(24)]

    def scan():
        for y in range(0, side, 32):
            assert (np.asarray(store[y : y + 32])[0, 0] == samples[y, 0]).all()

    def image():
        for n in range(4):
            d = n * directions // 4 + n * 7 % lights
            assert (np.asarray(store[:, :, d]) == samples[:, :, d]).all()

    def texel():
        for y, x in texels:
            assert (np.asarray(store[y, x]) == samples[y, x]).all()

    scanned, imaged, gathered = seconds(scan), seconds(image) / 4, seconds(texel) / len(texels)
    print(
        f"| {name} | {ratio:.2f} | {megabytes / written:.0f} | {megabytes / scanned:.0f} "
        f"| {imaged * 1e3:.2f} | {gathered * 1e3:.2f} | | | |",
        flush=True,
    )
    os.remove(path) if os.path.isfile(path) else shutil.rmtree(path)


def peers(file, views, side, lights, channels, directory):
    import blosc2
    import h5py
    import hdf5plugin
    import tensorstore
    import zarr
    from zarr.codecs import BloscCodec, ZstdCodec

    raw = np.memmap(file, np.uint8, "r", shape=(views, side, side, lights, channels))
    samples = np.ascontiguousarray(raw.transpose(1, 2, 0, 3, 4)).reshape(side, side, views * lights, channels)
    directions = views * lights
    shard = min(64, side)

    def run(name, file, write, opener):
        path = os.path.join(directory, file)
        row(name, samples, lights, path, lambda: write(path), lambda: opener(path))

    def zarr_store(chunks, shards, codec):
        def write(path):
            array = zarr.create_array(
                path, shape=samples.shape, chunks=chunks, shards=shards, dtype="uint8", compressors=codec
            )
            array[:] = samples

        return write, lambda path: zarr.open_array(path, mode="r")

    all_of = (directions, channels)
    run("zarr-python, 8x8 in shards, zstd 3", "z", *zarr_store((8, 8, *all_of), (shard, shard, *all_of), ZstdCodec(level=3)))
    bitshuffle = BloscCodec(cname="zstd", clevel=3, shuffle="bitshuffle")
    run("zarr-python, 16x16x729, blosc zstd 3", "z", *zarr_store((16, 16, min(729, directions), channels), None, bitshuffle))
    run("zarr-python, 16x16 x a view, zstd 3", "z", *zarr_store((16, 16, lights, channels), (side, side, lights, channels), ZstdCodec(level=3)))

    def spec(path):
        return {"driver": "zarr3", "kvstore": {"driver": "file", "path": path}}

    def tensorstore_write(path):
        sharding = {
            "name": "sharding_indexed",
            "configuration": {
                "chunk_shape": [8, 8, *all_of],
                "codecs": [{"name": "bytes"}, {"name": "zstd", "configuration": {"level": 3}}],
            },
        }
        grid = {"name": "regular", "configuration": {"chunk_shape": [shard, shard, *all_of]}}
        metadata = {"shape": list(samples.shape), "data_type": "uint8", "chunk_grid": grid, "codecs": [sharding]}
        store = tensorstore.open({**spec(path), "metadata": metadata}, create=True, delete_existing=True).result()
        store.write(samples).result()

    class Opened:
        def __init__(self, path):
            self.store = tensorstore.open(spec(path)).result()

        def __getitem__(self, key):
            return self.store[key].read().result()

    run("tensorstore, 8x8 in shards, zstd 3", "t", tensorstore_write, Opened)

    def h5_store(**filters):
        def write(path):
            with h5py.File(path, "w") as file:
                file.create_dataset("a", data=samples, chunks=(8, 8, *all_of), **filters)

        return write, lambda path: h5py.File(path, "r")["a"]

    run("h5py, 8x8, zstd 3", "a.h5", *h5_store(**hdf5plugin.Zstd(clevel=3)))
    shuffled = hdf5plugin.Blosc2(cname="zstd", clevel=3, filters=hdf5plugin.Blosc2.BITSHUFFLE)
    run("h5py, 8x8, blosc2 zstd 3", "a.h5", *h5_store(**shuffled))
    run("h5py, 8x8, no filter", "a.h5", *h5_store())

    def blosc2_write(path):
        cparams = {"codec": blosc2.Codec.ZSTD, "clevel": 3, "nthreads": 2}
        blosc2.asarray(
            samples, chunks=(32, 32, *all_of), blocks=(4, 4, *all_of), urlpath=path, mode="w", cparams=cparams
        )

    run("blosc2, 4x4 in 32x32, zstd 3", "b.b2nd", blosc2_write, lambda path: blosc2.open(path, mode="r"))
    run(".npy, memory map", "n.npy", lambda path: np.save(path, samples), lambda path: np.load(path, mmap_mode="r"))


def write_raw(measurement, file, side):
    import zarr

    import btfkit_zarr  # noqa: F401  (registers the codec)

    array = zarr.open_array(os.path.join(measurement, "reflectance"), mode="r")
    side = min(side, *array.shape[1:3]) // 32 * 32
    with open(file, "wb") as out:
        for view in range(array.shape[0]):
            out.write(np.ascontiguousarray(array[view, :side, :side]).tobytes())
    views, _, _, lights, channels = array.shape
    print(views, side, lights, channels)


if __name__ == "__main__":
    if sys.argv[1] == "raw":
        write_raw(sys.argv[2], sys.argv[3], int(sys.argv[4]))
    else:
        peers(sys.argv[2], *map(int, sys.argv[3:7]), sys.argv[7])
