"""Chunks of samples to bytes and back, with numpy."""

import struct
import zlib

import numpy as np
from numcodecs.zstd import Zstd

from .predict import DISTANCES, join, lift, predict, residuals, split, unlift

VERSION = 1
SPATIAL = ("median", "smooth", "mean")
WEIGHTS = ("none", "half", "whole")
UNSIGNED = {1: np.uint8, 2: np.uint16, 4: np.uint32}


def extent(shape, channel_axis):
    """Rows, columns, lights and channels of a chunk of this shape."""
    axes = list(shape)
    channels = axes.pop() if channel_axis and axes else 1
    lights = axes.pop() if axes else 1
    columns = axes.pop() if axes else 1
    return int(np.prod(axes, dtype=np.int64)), columns, lights, channels


def kind(dtype):
    """The unsigned integers that stand for samples, and whether the samples are floating point."""
    dtype = np.dtype(dtype)
    if dtype.name not in ("uint8", "uint16", "float16", "float32"):
        raise TypeError(f"btfkit.predictive: samples of type {dtype}, expected uint8, uint16, float16 or float32")
    return UNSIGNED[dtype.itemsize], dtype.kind == "f"


def mode_byte(mode):
    """The byte of a spatial predictor and the weights of the three distances."""
    spatial, weights = mode
    return SPATIAL.index(spatial) | sum(WEIGHTS.index(w) << 2 + 2 * n for n, w in enumerate(weights))


def mode_of(byte):
    """Inverse of `mode_byte`."""
    numbers = [byte >> shift & 3 for shift in (0, 2, 4, 6)]
    if 3 in numbers:
        raise ValueError(f"btfkit.predictive: {byte:#04x} is not a mode of prediction")
    return SPATIAL[numbers[0]], tuple(WEIGHTS[n] for n in numbers[1:])


def decode(data, shape, dtype, channel_axis):
    """The samples [shape] of an encoded chunk."""
    unsigned, is_float = kind(dtype)
    rows, columns, lights, channels = extent(shape, channel_axis)
    size = np.dtype(unsigned).itemsize
    header = 1 + channels + 4 * channels * size
    if len(data) < header + 4:
        raise ValueError(f"btfkit.predictive: got {len(data)} bytes, expected {header + 4} or more")
    if zlib.crc32(data[:-4]) != struct.unpack("<I", data[-4:])[0]:
        raise ValueError("btfkit.predictive: the checksum does not match the bytes")
    if data[0] != VERSION:
        raise ValueError(f"btfkit.predictive: got layout version {data[0]}, expected {VERSION}")
    modes = [mode_of(byte) for byte in data[1 : 1 + channels]]
    lengths = struct.unpack(f"<{channels * size}I", data[1 + channels : header])
    if header + sum(lengths) != len(data) - 4:
        raise ValueError("btfkit.predictive: the streams do not fill the chunk")
    count = rows * columns * lights
    planes, at = [], header
    for length in lengths:
        stream = data[at : at + length]
        at += length
        # Into a buffer of the right length, so that no header makes it larger.
        plane = np.frombuffer(stream, np.uint8) if length == count else np.zeros(count, np.uint8)
        if length != count:
            Zstd().decode(stream, out=plane)
        planes.append(plane)
    channel_planes = np.empty((channels, rows, columns, lights), unsigned)
    for channel, mode in enumerate(modes):
        zigzag = np.zeros(count, unsigned)
        for plane in planes[channel * size : (channel + 1) * size]:
            zigzag = (zigzag << unsigned(8) if size > 1 else zigzag) | plane
        residual = (zigzag >> unsigned(1)) ^ (unsigned(0) - (zigzag & unsigned(1)))
        residual = unlift(residual.reshape(rows, columns, lights), mode[1])
        channel_planes[channel] = predict(residual, mode[0])
    return join(channel_planes, is_float).view(dtype).reshape(shape)


def encode(samples, channel_axis):
    """The bytes of a chunk of samples."""
    unsigned, is_float = kind(samples.dtype)
    rows, columns, lights, channels = extent(samples.shape, channel_axis)
    values = np.ascontiguousarray(samples).view(unsigned).reshape(rows, columns, lights, channels)
    modes, streams = [], []
    for plane in split(values, is_float):
        mode, residual = best_residual(plane)
        modes.append(mode_byte(mode))
        sign = unsigned(0) - (residual >> unsigned(8 * residual.itemsize - 1))
        zigzag = ((residual << unsigned(1)) ^ sign).reshape(-1)
        for place in reversed(range(zigzag.itemsize)):
            byte = (zigzag >> unsigned(8 * place)).astype(np.uint8).tobytes()
            packed = bytes(Zstd(level=1).encode(byte))
            streams.append(packed if len(packed) < len(byte) else byte)
    head = bytes([VERSION, *modes]) + struct.pack(f"<{len(streams)}I", *map(len, streams))
    body = head + b"".join(streams)
    return body + struct.pack("<I", zlib.crc32(body))


def best_residual(plane):
    """The mode that leaves the smallest residuals, and these."""
    bits = 8 * plane.itemsize
    half = plane.dtype.type(1 << bits - 1)

    def cost(residual):
        size = np.where(residual < half, residual, (plane.dtype.type(0) - residual).astype(plane.dtype))
        return np.log2(1.0 + size)

    best = None
    for spatial in SPATIAL:
        spatial_residual = residuals(plane, spatial)
        costs = {w: cost(lift(spatial_residual, (w, w, w))).sum((0, 1)) for w in WEIGHTS}
        weights = []
        for distance in DISTANCES:
            lights = np.arange(distance, plane.shape[2], 2 * distance)
            weights.append(min(WEIGHTS, key=lambda w: costs[w][lights].sum()))
        residual = lift(spatial_residual, tuple(weights))
        total = cost(residual).sum()
        if best is None or total < best[0]:
            best = total, (spatial, tuple(weights)), residual
    return best[1:]
