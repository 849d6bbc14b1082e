"""Tests of btfkit_zarr: `python python/tests/test_codec.py`, or with pytest.

`fixtures/rust.zarr` is written by the program's own tests (BTFKIT_WRITE_FIXTURES), `fixtures/python.zarr` by
this file (`--write`); each side reads both.
"""

import shutil
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
import zarr

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import btfkit_zarr  # noqa: E402
from btfkit_zarr import predict  # noqa: E402

FIXTURES = Path(__file__).parent / "fixtures"
KINDS = [("uint8", 3), ("uint16", 3), ("float16", 3), ("float32", 3), ("uint8", None), ("uint16", 1)]


def samples(dtype, channels, shape=(7, 11, 9)):
    """The samples of the fixtures, [1, y, x, light, channel]; the Rust tests know the same formula."""
    axes = [np.arange(n, dtype=np.uint32) for n in (*shape, channels or 1)]
    y, x, l, c = np.meshgrid(*axes, indexing="ij")
    u = np.uint32
    mixed = y * u(73856093) ^ x * u(19349663) ^ l * u(83492791) ^ c * u(2654435761)
    noise = (mixed * u(2654435761) >> u(24)) % u(8)
    value = u(60) + 3 * y + 5 * x + 7 * (l * l % u(11)) + 20 * c + noise
    if dtype == "uint8":
        out = value.astype(np.uint8)
    elif dtype == "uint16":
        out = (value * u(131)).astype(np.uint16)
    else:
        out = (value.astype(np.float32) / np.float32(255) - np.float32(0.5)).astype(dtype)
    return (out if channels else out[..., 0])[None]


def name(chain, dtype, channels):
    return f"{chain}-{dtype}-{'none' if channels is None else channels}"


def write(folder):
    """Arrays that zarr-python packs with the codec."""
    for dtype, channels in KINDS:
        data = samples(dtype, channels)
        tail = (9,) if channels is None else (9, channels)
        array = zarr.create_array(
            folder / name("predictive", dtype, channels),
            shape=data.shape,
            chunks=(1, 4, 4, *tail),
            shards=(1, 4, 8, *tail),
            dtype=dtype,
            serializer=btfkit_zarr.PredictiveCodec(channels is not None),
            compressors=None,
            filters=None,
        )
        array[:] = data


def same(array, expected):
    found = array[:]
    assert found.dtype == expected.dtype and (found == expected).all(), array
    part = array[:, 2:6, 3:10, 2:5]
    assert (part == expected[:, 2:6, 3:10, 2:5]).all(), array


def test_reads_what_rust_wrote():
    for chain in ("stock", "predictive"):
        for dtype, channels in KINDS:
            same(zarr.open_array(FIXTURES / "rust.zarr" / name(chain, dtype, channels), mode="r"), samples(dtype, channels))


def test_reads_what_python_wrote():
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder))
        for root in (Path(folder), FIXTURES / "python.zarr"):
            for dtype, channels in KINDS:
                array = zarr.open_array(root / name("predictive", dtype, channels), mode="r")
                same(array, samples(dtype, channels))


def test_every_mode_can_be_undone():
    noise = np.random.default_rng(1)
    for shape in ((4, 5, 19), (1, 1, 1), (1, 6, 2), (5, 1, 9), (3, 2, 8)):
        for dtype in (np.uint8, np.uint16, np.uint32):
            plane = noise.integers(0, np.iinfo(dtype).max, shape, dtype, endpoint=True)
            for spatial in ("median", "smooth", "mean"):
                for weights in (("none",) * 3, ("half", "whole", "none"), ("whole", "half", "whole")):
                    lifted = predict.lift(predict.residuals(plane, spatial), weights)
                    assert (predict.predict(predict.unlift(lifted, weights), spatial) == plane).all()


def test_damaged_bytes_are_refused():
    data = samples("uint16", 3, (3, 4, 5))[0]
    packed = btfkit_zarr.encode(data, True)
    assert (btfkit_zarr.decode(packed, data.shape, data.dtype, True) == data).all()
    damaged = [packed[:n] for n in range(len(packed))]
    for bit in range(8 * len(packed)):
        changed = bytearray(packed)
        changed[bit // 8] ^= 1 << bit % 8
        damaged.append(bytes(changed))
    for wrong in damaged:
        try:
            btfkit_zarr.decode(wrong, data.shape, data.dtype, True)
        except ValueError:
            continue
        raise AssertionError("damaged bytes were decoded")


if __name__ == "__main__":
    # zarr-python warns that numcodecs' codecs are not in the specification.
    warnings.filterwarnings("ignore", message="Numcodecs codecs are not in the Zarr version 3 specification")
    if sys.argv[1:] == ["--write"]:
        shutil.rmtree(FIXTURES / "python.zarr", ignore_errors=True)
        write(FIXTURES / "python.zarr")
    tests = [test for key, test in list(globals().items()) if key.startswith("test_")]
    for test in tests:
        test()
        print(f"{test.__name__}: ok")
