"""The prediction of `docs/reference/codec.md`, on arrays of unsigned integers; all arithmetic is modulo 2^bits."""

import numpy as np

DISTANCES = (4, 2, 1)


def half(dtype):
    """Half of the range of a type."""
    return dtype.type(1 << 8 * dtype.itemsize - 1)


def mean(a, b):
    """The mean, rounded up, without overflow."""
    return (a | b) - ((a ^ b) >> a.dtype.type(1))


def base_of(channel, channels):
    """The channel from which this one is taken."""
    if channels == 3:
        return None if channel == 1 else 1
    return channel - 1 if channel else None


def split(values, is_float):
    """[y, x, light, channel] samples to [channel, y, x, light] differences of channels."""
    middle = half(values.dtype)
    if is_float:
        values = np.where(values >= middle, ~values, values | middle)
    planes = np.ascontiguousarray(values.transpose(3, 0, 1, 2))
    out = planes.copy()
    for channel in range(len(planes)):
        base = base_of(channel, len(planes))
        if base is not None:
            out[channel] = planes[channel] - planes[base] + middle
    return out


def join(planes, is_float):
    """Inverse of `split`."""
    middle = half(planes.dtype)
    out = planes.copy()
    order = (1, 0, 2) if len(planes) == 3 else range(len(planes))
    for channel in order:
        base = base_of(channel, len(planes))
        if base is not None:
            out[channel] = planes[channel] + out[base] - middle
    if is_float:
        out = np.where(out >= middle, out ^ middle, ~out)
    return np.ascontiguousarray(out.transpose(1, 2, 3, 0))


def foretold(spatial, left, above, corner, right):
    """What a sample's neighbours say it is."""
    if spatial == "mean":
        return mean(left, mean(above, right))
    low, high = np.minimum(left, above), np.maximum(left, above)
    median = low + high - np.clip(corner, low, high)
    return median if spatial == "median" else mean(median, mean(left, above))


def residuals(plane, spatial):
    """[y, x, light] samples less what is foretold."""
    out = plane.copy()
    middle = half(plane.dtype)
    out[0, 0, 1:] = plane[0, 0, 1:] - plane[0, 0, :-1]
    out[0, 0, :1] = plane[0, 0, :1] - middle
    out[0, 1:] = plane[0, 1:] - plane[0, :-1]
    out[1:, 0] = plane[1:, 0] - plane[:-1, 0]
    right = np.concatenate([plane[:, 1:], plane[:, -1:]], axis=1)
    out[1:, 1:] = plane[1:, 1:] - foretold(
        spatial, plane[1:, :-1], plane[:-1, 1:], plane[:-1, :-1], right[:-1, 1:]
    )
    return out


def predict(residual, spatial):
    """Inverse of `residuals`: diagonal by diagonal, each of texels whose neighbours are known."""
    rows, columns, _ = residual.shape
    plane = residual.copy()
    plane[0, 0, :1] += half(plane.dtype)
    plane[0, 0] = np.cumsum(plane[0, 0], dtype=plane.dtype)
    plane[0] = np.cumsum(plane[0], axis=0, dtype=plane.dtype)
    plane[:, 0] = np.cumsum(plane[:, 0], axis=0, dtype=plane.dtype)
    for diagonal in range(3, 2 * rows + columns - 2):
        y = np.arange(max(1, (diagonal - columns + 2) // 2), min(rows - 1, (diagonal - 1) // 2) + 1)
        x = diagonal - 2 * y
        right = plane[y - 1, np.minimum(x + 1, columns - 1)]
        plane[y, x] += foretold(spatial, plane[y, x - 1], plane[y - 1, x], plane[y - 1, x - 1], right)
    return plane


def levels(lights):
    """For each distance the lights that have others around them at it."""
    for distance in DISTANCES:
        numbers = np.arange(distance, lights, 2 * distance)
        yield distance, numbers[numbers + distance < lights]


def share(residual, lights, distance, weight):
    """What is taken from the residuals of `lights` for those around them."""
    middle = half(residual.dtype)
    value = mean(residual[..., lights - distance] + middle, residual[..., lights + distance] + middle)
    return (mean(value, middle) if weight == "half" else value) - middle


def lift(residual, weights):
    """Residuals less what those of the lights around foretell; the first texel stays as it is."""
    out = residual.copy()
    for (distance, lights), weight in zip(levels(residual.shape[2]), weights):
        if weight != "none":
            out[..., lights] -= share(residual, lights, distance, weight)
    out[0, 0] = residual[0, 0]
    return out


def unlift(residual, weights):
    """Inverse of `lift`."""
    out = residual.copy()
    for (distance, lights), weight in zip(levels(residual.shape[2]), weights):
        if weight != "none":
            out[..., lights] += share(out, lights, distance, weight)
    out[0, 0] = residual[0, 0]
    return out
