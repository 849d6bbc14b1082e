"""Reads packed models, NAME.btfc, with numpy alone; written from docs/formats/btfc.md.

    model = read("wood.btfc")
    value = model.mean[v, l, c] + model.basis[:, v, l, c] @ model.coefficients[:, y, x]

on the sRGB curve times 255. `python btfc.py FILE` prints what a file holds. It is slow, and meant to be read: a decoder
that shares nothing with the program.
"""

import struct
import sys
import zlib
from dataclasses import dataclass, field

import numpy as np

AROUND, BEFORE, SIDE = 16, 12, 6
FIRST_SHIFTS = [1] + 3 * [2] + 5 * [3] + 11 * [4] + 8 * [5]


@dataclass
class Model:
    """A mean and components; a part of a file gives a coarser one."""

    size: tuple
    wraps: bool
    views: np.ndarray  # [view, 2] theta, phi in degrees
    lights: np.ndarray
    channels: list
    texts: dict
    mean: np.ndarray  # [view, light, channel]
    basis: np.ndarray  # [component, view, light, channel]
    coefficients: np.ndarray  # [component, y, x]
    planes: list = field(default_factory=list)  # (end, components, dB) of each section
    index: np.ndarray = None  # [y, x] centre of each texel, where the file has a palette
    complete: bool = True


class Probability:
    """Two estimates of the probability of a 0, of 2^16."""

    __slots__ = ("fast", "slow", "seen")

    def __init__(self):
        self.fast = self.slow = 1 << 15
        self.seen = 0

    def of_zero(self):
        return min(max((self.fast + self.slow) >> 2, 16), (1 << 15) - 16)

    def learn(self, bit):
        n = self.seen
        first = FIRST_SHIFTS[n] if n < 28 else 5 if n < 60 else 6 if n < 120 else 7
        self.seen = min(n + 1, 255)
        a, b = min(4, first), min(7, first)
        if bit:
            self.fast -= self.fast >> a
            self.slow -= self.slow >> b
        else:
            self.fast += (65535 - self.fast) >> a
            self.slow += (65535 - self.slow) >> b


class Decoder:
    """Bits out of bytes; zeros beyond their end."""

    def __init__(self, data):
        self.data, self.at, self.range = data, 4, 0xFFFFFFFF
        self.code = int.from_bytes(data[:4].ljust(4, b"\0"), "big")

    def split(self, bound):
        bit = self.code >= bound
        if bit:
            self.code -= bound
            self.range -= bound
        else:
            self.range = bound
        while self.range < 1 << 24:
            self.range <<= 8
            self.code = self.code << 8 | (self.data[self.at] if self.at < len(self.data) else 0)
            self.at += 1
        return bit

    def bit(self, *probabilities):
        zero = sum(p.of_zero() for p in probabilities) // len(probabilities)
        bit = self.split((self.range >> 15) * zero)
        for p in probabilities:
            p.learn(bit)
        return bit

    def even(self):
        return self.split(self.range >> 1)


class Contexts:
    def __init__(self):
        self.known = {}

    def __getitem__(self, key):
        return self.known.setdefault(key, Probability())


def cls(total, most):
    if total < 4:
        return min(total, most - 1)
    octave = total.bit_length() - 1
    return min(2 * octave + (total >> (octave - 1) & 1), most - 1)


class Grid:
    """Whole numbers of one spectrum [layer, row, column], with two zeros around each layer."""

    def __init__(self, layers, rows, columns):
        self.shape = layers, rows, columns
        self.stride = columns + 4
        self.layer = (rows + 4) * self.stride
        self.m = [0] * (layers * self.layer)
        self.negative = set()
        self.begun = [False] * (layers * rows)

    def values(self, step):
        layers, rows, columns = self.shape
        m = np.array(self.m, float).reshape(layers, rows + 4, columns + 4)
        sign = np.ones(m.size)
        sign[list(self.negative)] = -1
        m = np.where(m > 0, (m + 0.42) * step, 0) * sign.reshape(m.shape)
        return m[:, 2:-2, 2:-2]


def code_plane(decoder, contexts, kind, frequencies, grid, before, shift):
    layers, rows, columns = grid.shape
    if True not in grid.begun and not decoder.bit(contexts["image", before[0] is not None]):
        return
    m, s = grid.m, grid.stride

    def now(at):
        return min(m[at], 1 << 16)

    def then(at):
        return 2 * now(at) + (m[at] > 0)

    for layer in range(layers):
        for row in range(rows):
            flag = layer * rows + row
            if not grid.begun[flag]:
                key = (
                    4 * (row > 0 and grid.begun[flag - 1])
                    + 2 * (row + 1 < rows and grid.begun[flag + 1])
                    + (before[0] is not None and before[0].begun[flag])
                )
                grid.begun[flag] = decoder.bit(contexts["row", layer > 0, key])
                if not grid.begun[flag]:
                    continue
            start = layer * grid.layer + (row + 2) * s + 2
            for column in range(columns):
                at = start + column
                own = (
                    4 * (now(at - 1) + now(at - s))
                    + 2 * (now(at - s - 1) + now(at - s + 1))
                    + 3 * (then(at + 1) + then(at + s))
                    + now(at - 2)
                    + now(at - 2 * s)
                    + then(at + 2)
                    + then(at + 2 * s)
                    + then(at + s - 1)
                    + then(at + s + 1)
                )
                if m[at]:
                    key = "more", min(m[at], 3), cls(own // 8, 4)
                    m[at] = 2 * m[at] + decoder.bit(contexts[key])
                    continue
                others = 0
                for grid_before, (here, beside) in zip(before, ((4, 1), (2, 1), (2, 0))):
                    if grid_before is not None:
                        def of(at, n=grid_before.m):
                            return min(n[at] << 1 >> shift, 1 << 16)

                        others += here * of(at)
                        if beside:
                            others += of(at - 1) + of(at + 1) + of(at - s) + of(at + s)
                if layer > 0:
                    others += 4 * now(at - grid.layer)
                by_sums = contexts["sums", cls(own, AROUND), cls(others, BEFORE), layer > 0]
                frequency = frequencies[0][row], frequencies[1][column]
                by_frequency = contexts["frequency", cls(own + others, AROUND), frequency, layer > 0]
                if decoder.bit(by_sums, by_frequency):
                    if decoder.even():
                        grid.negative.add(at)
                    m[at] = 1


def palette(data, content, height, width):
    """The index [y, x] of a file of version 2."""
    start = data.at
    centres, size = data.get("HI")
    payload = data.take(size)
    if zlib.crc32(content[start : data.at]) != data.get("I"):
        raise ValueError("a damaged palette")
    decoder, equal, tree = Decoder(payload), Contexts(), Contexts()
    bits = (centres - 1).bit_length()
    index = np.zeros((height, width), int)
    for y in range(height):
        for x in range(width):
            near = []
            for v, u in ((y, x - 1), (y - 1, x), (y - 1, x + 1), (y - 1, x - 1)):
                if v >= 0 and 0 <= u < width and index[v, u] not in near:
                    near.append(index[v, u])
            for n, centre in enumerate(near):
                if decoder.bit(equal[n, len(near)]):
                    index[y, x] = centre
                    break
            else:
                node = 1
                for _ in range(bits):
                    node = 2 * node + decoder.bit(tree[node])
                index[y, x] = min(node - (1 << bits), centres - 1)
    return index


def polynomials(directions):
    """Orthonormal rows [polynomial, direction], and their degrees."""
    theta, phi = np.radians(directions).T
    r = np.sqrt(2) * np.sin(theta / 2)
    count = len(directions)
    rows, degrees = [], []

    def add(row, degree):
        before = np.linalg.norm(row)
        if len(rows) == count or before <= sys.float_info.min:
            return
        for _ in range(2):
            for known in rows:
                row = row - (known @ row) * known
        left = np.linalg.norm(row)
        if left > 1e-6 * before:
            rows.append(row / left)
            degrees.append(degree)

    radial = {}
    for degree in range(64):
        for order in range(degree % 2, degree + 1, 2):
            if degree == 0:
                radial[0, 0] = np.ones(count)
            else:
                zero = np.zeros(count)
                sides = radial.get((degree - 1, abs(order - 1)), zero) + radial.get((degree - 1, order + 1), zero)
                radial[degree, order] = r * sides - radial.get((degree - 2, order), zero)
            add(radial[degree, order] * np.cos(order * phi), degree)
            add(radial[degree, order] * np.sin(order * phi), degree)
        if len(rows) == count:
            return np.array(rows), degrees
    for one in np.eye(count):
        add(one, 64)
    return np.array(rows), degrees


def dct(length):
    """Rows [frequency, place] of the orthonormal DCT-II."""
    place, frequency = np.arange(length), np.arange(length)[:, None]
    matrix = np.cos(np.pi * (2 * place + 1) * frequency / (2 * length)) * np.sqrt(2 / length)
    matrix[0] /= np.sqrt(2)
    return matrix


class Bytes:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        if self.at + count > len(self.data):
            raise EOFError(f"byte {self.at}: expected {count} bytes more")
        self.at += count
        return self.data[self.at - count : self.at]

    def get(self, kind):
        values = struct.unpack("<" + kind, self.take(struct.calcsize("<" + kind)))
        return values[0] if len(values) == 1 else values

    def text(self, length_kind):
        return self.take(self.get(length_kind)).decode()


def directions(data, before):
    kind = data.get("B")
    if kind == 2:
        return before
    count = data.get("H")
    if kind == 1:
        return np.array([data.get("ff") for _ in range(count)])
    rings = [data.get("ffH") for _ in range(count)]
    return np.array([(theta, phi + 360 * k / n) for theta, phi, n in rings for k in range(n)])


def unpack(content):
    """The model of a file's bytes."""
    data = Bytes(content)
    if data.take(4) != b"BTFC":
        raise ValueError("no packed model")
    version = data.get("B")
    if version not in (1, 2):
        raise ValueError(f"version {version}, expected 1 or 2")
    wraps, planes, sections, height, width, n_channels = data.get("BBBHHH")
    step, length = data.get("fI")
    end = data.at + length
    if zlib.crc32(content[:end]) != struct.unpack_from("<I", content, end)[0]:
        raise ValueError("a damaged header")
    views = directions(data, None)
    lights = directions(data, views)
    channels = [data.text("B") for _ in range(n_channels)]
    texts = {}
    for _ in range(data.get("B")):
        name = data.text("B")
        texts[name] = data.text("H")
    data.at = end + 4

    index = palette(data, content, height, width) if version == 2 else None

    (of_views, view_degrees), (of_lights, light_degrees) = polynomials(views), polynomials(lights)
    brdf = n_channels, len(views), len(lights)
    by_degree = [[min(d // 2, SIDE - 1) for d in list_] for list_ in (view_degrees, light_degrees)]
    if index is None:
        image = 1, height, width
        of_image = [[min((k + 1).bit_length() - 1, SIDE - 1) for k in range(n)] for n in (height, width)]
    else:
        roots = np.sqrt(np.bincount(index.ravel()))
        image = 1, 1, len(roots)
        of_image = [[0], [0] * len(roots)]
    mean, bases, images, strengths, reached = Grid(*brdf), [], [], [], []
    brdf_contexts, image_contexts = Contexts(), Contexts()
    mean_reached, found = planes, []
    for low in reversed(range(sections)):
        start = data.at
        try:
            size, components, centibels = data.get("IHH")
            begun = [data.get("H") for _ in range(components - len(strengths))]
            payload = data.take(size)
            if zlib.crc32(content[start : data.at]) != data.get("I"):
                break
        except EOFError:
            break
        decoder = Decoder(payload)
        for plane in reversed(range(low, mean_reached)):
            code_plane(decoder, brdf_contexts, "brdf", by_degree, mean, [None] * 3, 0)
        mean_reached = low
        for number in range(components):
            if number == len(bases):
                bases.append(Grid(*brdf))
                images.append(Grid(*image))
                reached.append(planes)
            for contexts, frequencies, grids in (
                (brdf_contexts, by_degree, bases),
                (image_contexts, of_image, images),
            ):
                before = [grids[number - back] if number >= back else None for back in (1, 2, 3)]
                for plane in reversed(range(low, reached[number])):
                    code_plane(decoder, contexts, None, frequencies, grids[number], before, plane - low)
            reached[number] = low
        strengths += begun
        finest = step * (1 << low)
        found.append((data.at, components, centibels / 100))
    if not found:
        raise ValueError("not even the first section is whole")

    rotation, rows, columns = dct(n_channels), dct(height), dct(width)

    def to_brdf(spectrum):
        return np.einsum("kab,av,bl,kc->vlc", spectrum, of_views, of_lights, rotation, optimize=True)

    def to_image(spectrum):
        if index is None:
            return rows.T @ spectrum @ columns
        return (spectrum[0] / roots)[index]

    def strength(code):
        return 2.0 ** (code / 256 - 64)

    return Model(
        size=(height, width),
        wraps=bool(wraps),
        views=views,
        lights=lights,
        channels=channels,
        texts=texts,
        mean=to_brdf(mean.values(finest)) / np.sqrt(height * width),
        basis=np.array([to_brdf(g.values(finest)) / strength(c) for g, c in zip(bases, strengths)]).reshape(
            -1, len(views), len(lights), n_channels
        ),
        coefficients=np.array([to_image(g.values(finest)[0]) for g in images]).reshape(-1, height, width),
        planes=found,
        complete=len(found) == sections,
        index=index,
    )


def read(path):
    """The model of a file."""
    with open(path, "rb") as file:
        return unpack(file.read())


if __name__ == "__main__":
    model = read(sys.argv[1])
    print(f"{model.size[1]}x{model.size[0]}, {len(model.views)} views, {len(model.lights)} lights, {model.channels}")
    for end, components, decibels in model.planes:
        print(f"to byte {end}: {components} components, {decibels:.2f} dB")
