"""The coherent rule by numpy alone, written from docs/method/coherent.md: any window of the plane, any seed.

Positions are held as two arrays (rows, columns) over a window of places; a window is (first row, last row + 1, first
column, last column + 1) of a level.
"""

from dataclasses import dataclass, field

import numpy as np

SUB_PASSES = ((0, 0), (1, 1), (0, 1), (1, 0))
CANDIDATES = ((0, 0), (0, -1), (0, 1), (-1, 0), (-1, -1), (-1, 1), (1, 0), (1, -1), (1, 1))
DIAGONALS = ((-1, -1), (-1, 1), (1, -1), (1, 1))


@dataclass
class Level:
    basis: np.ndarray  # [72, D]
    offset: np.ndarray  # [D]
    shift: int
    passes: int
    repetition: int


@dataclass
class Exemplar:
    index: np.ndarray  # [H, W], clusters of the exemplar
    features: np.ndarray  # [cluster, 8]
    levels: list
    wraps: bool
    lattice: list = field(default_factory=list)

    def __post_init__(self):
        self.size = np.array(self.index.shape)
        self.appearance = appearance(self)


# 1. Appearance of the exemplar at each level


def around(v, dy, dx):
    """v[y + dy, x + dx], modulo its size."""
    return np.roll(v, (-dy, -dx), (0, 1))


def appearance(exemplar):
    v = 16 * exemplar.features.astype(np.int64)[exemplar.index]
    found = []
    for k, level in enumerate(exemplar.levels):
        h = 1 << k
        inputs = np.concatenate([around(v, i * h, j * h) for i in (-1, 0, 1) for j in (-1, 0, 1)], axis=2)
        total = inputs @ level.basis.astype(np.int64) - level.offset.astype(np.int64) + (1 << (level.shift - 1))
        found.append(np.clip(total >> level.shift, -120, 120).astype(np.int32))
        t = (around(v, -h, 0) + 2 * v + around(v, h, 0) + 2) >> 2
        v = (around(t, 0, -h) + 2 * t + around(t, 0, h) + 2) >> 2
    return found


# 2. Hash


def u32(value):
    return (np.asarray(value, np.int64) & 0xFFFFFFFF).astype(np.uint32)


def mix(v):
    v = u32(v)
    v ^= v >> np.uint32(16)
    v *= np.uint32(0x21F0AAAD)
    v ^= v >> np.uint32(15)
    v *= np.uint32(0xD35A2D97)
    return v ^ (v >> np.uint32(15))


def draw(seed, k, y, x):
    """r of places (y, x), two's complement."""
    with np.errstate(over="ignore"):
        key = mix(mix(u32([seed])) + u32([k]))
        return mix(mix(key ^ u32(x)) ^ (u32(y) * np.uint32(0x9E3779B1)))


# 3. First positions


def rounded(a, b):
    return (2 * a + b) // (2 * b)


def solve(c, side, other, other_side, d, u):
    m = (((u * abs(c)) >> 16) * other_side - np.sign(c) * other * d) % (abs(c) * other_side)
    return rounded(m * side, abs(c) * other_side) % side


def shifts(exemplar, uy, ux):
    (height, width), lattice = exemplar.index.shape, exemplar.lattice
    if not lattice:
        return (uy * height) >> 16, (ux * width) >> 16
    if len(lattice) == 1:
        a, b = lattice[0]
        if abs(b) * height >= abs(a) * width:
            dy = (uy * height) >> 16
            return dy, solve(b, width, a, height, dy, ux)
        dx = (ux * width) >> 16
        return solve(a, height, b, width, dx, uy), dx
    (a, b), (c, d) = lattice
    cells, sign = abs(a * d - b * c), np.sign(a * d - b * c)
    i, j = (uy * cells) >> 16, (ux * cells) >> 16
    dy = rounded(((sign * (d * i - b * j)) % cells) * height, cells) % height
    dx = rounded(((sign * (a * j - c * i)) % cells) * width, cells) % width
    return dy, dx


def places(window):
    top, bottom, left, right = window
    return np.meshgrid(np.arange(top, bottom), np.arange(left, right), indexing="ij")


def first_positions(exemplar, k, window, draws, coarser):
    """Positions of a window before correction; `coarser` is (window, positions) of the level above, none at the coarsest.

    `draws` is (seed, jitter, size of a surface that joins at its own borders or none).
    """
    seed, jitter, joins = draws
    h, (height, width) = 1 << k, exemplar.index.shape
    y, x = places(window)
    hash_y, hash_x = (y, x) if joins is None else (y % (joins[0] >> k), x % (joins[1] >> k))
    r = draw(seed, k, hash_y, hash_x).astype(np.int64)
    uy, ux = r >> 16, r & 0xFFFF
    if coarser is None:
        dy, dx = shifts(exemplar, uy, ux)
        return [(hash_y * h + dy) % height, (hash_x * h + dx) % width]
    above, parents = coarser
    parent = ((y >> 1) - above[0], (x >> 1) - above[2])
    positions = []
    for of_parents, odd, u, side in zip(parents, (y & 1, x & 1), (uy, ux), (height, width)):
        moved = ((u - 32768) * jitter + (1 << (22 - k))) >> (23 - k)
        q = (of_parents[parent] + h * odd + moved) % side
        if k == 0 and is_bordered(exemplar):
            q = np.where(q < 1, 2 - q, np.where(q > side - 2, 2 * (side - 2) - q, q))
        positions.append(q)
    return positions


def is_bordered(exemplar):
    return not exemplar.wraps and min(exemplar.index.shape) >= 8


# 4. Correction


class Padded:
    """Positions of a window with zeros around it, at strides of two."""

    def __init__(self, positions, reach):
        self.reach = reach
        self.planes = [np.pad(plane, [(reach[0],) * 2, (reach[1],) * 2]) for plane in positions]

    def at(self, sub, i, j):
        """P[y + i, x + j] for the places of a sub-pass."""
        return [plane[self.part(plane, sub, i, j)] for plane in self.planes]

    def put(self, sub, positions):
        for plane, values in zip(self.planes, positions):
            plane[self.part(plane, sub, 0, 0)] = values

    def part(self, plane, sub, i, j):
        def along(axis, start, offset):
            reach, extent = self.reach[axis], plane.shape[axis] - 2 * self.reach[axis]
            return slice(reach + start + offset, reach + extent + offset, 2)

        return along(0, sub[0], i), along(1, sub[1], j)

    def inner(self):
        (ry, rx) = self.reach
        return [plane[ry : plane.shape[0] - ry, rx : plane.shape[1] - rx] for plane in self.planes]


def correct(exemplar, k, window, positions):
    """The positions after all passes; near the window's borders they are of no use."""
    level, h, size = exemplar.levels[k], 1 << k, exemplar.size
    periods = [(int(side) + h // 2) >> k for side in size] if level.repetition else [1, 1]
    padded = Padded(positions, (max(2, periods[0] + 1), max(2, periods[1] + 1)))
    look = exemplar.appearance[k]
    rest_only = k == 0 and is_bordered(exemplar)

    def looks(rows, columns):
        return look[rows % size[0], columns % size[1]]

    def sub_pass(sub, began):
        surroundings = []
        for i, j in DIAGONALS:
            diagonal, down, along = padded.at(sub, i, j), padded.at(sub, 2 * i, j), padded.at(sub, i, 2 * j)
            surroundings.append(
                looks(*diagonal) + looks(down[0] - h * i, down[1]) + looks(along[0], along[1] - h * j)
            )
        sites = []
        if level.repetition:
            m, n = periods
            offsets = [at for t in (-1, 0, 1) for at in ((-m, t), (m, t), (t, -n), (t, n))]
            for i, j in offsets:
                rows, columns = began.at(sub, i, j)
                sites.append(((rows - h * i) % size[0], (columns - h * j) % size[1]))
        best = None
        for i, j in CANDIDATES:
            rows, columns = padded.at(sub, i, j)
            rows, columns = rows - h * i, columns - h * j
            allowed = np.ones(rows.shape, bool)
            if rest_only and (i, j) != (0, 0):
                allowed = (rows >= 1) & (rows <= size[0] - 2) & (columns >= 1) & (columns <= size[1] - 2)
            rows, columns = rows % size[0], columns % size[1]
            cost = np.zeros(rows.shape, np.int64)
            for (di, dj), around_place in zip(DIAGONALS, surroundings):
                difference = around_place - 3 * looks(rows + h * di, columns + h * dj)
                cost += (difference.astype(np.int64) ** 2).sum(axis=-1)
            for site in sites:
                for q, c, side in zip(site, (rows, columns), size):
                    apart = np.abs(q - c)
                    cost += np.where(2 * np.minimum(apart, side - apart) <= h, level.repetition, 0)
            if best is None:
                best = [cost, rows, columns]
                continue
            better = allowed & (cost < best[0])
            for kept, new in zip(best, (cost, rows, columns)):
                kept[better] = new[better]
        padded.put(sub, best[1:])

    for _ in range(level.passes):
        began = Padded(padded.inner(), padded.reach)
        for parity in SUB_PASSES:
            sub_pass(((parity[0] - window[0]) % 2, (parity[1] - window[2]) % 2), began)
    return padded.inner()


# 5. The surface


def grown(exemplar, k, window):
    level, h = exemplar.levels[k], 1 << k
    rows, columns = 4 * level.passes + 2, 6 * level.passes
    if level.repetition:
        m, n = [(int(side) + h // 2) >> k for side in exemplar.size]
        rows, columns = level.passes * (m + 6), level.passes * (n + 6)
    top, bottom, left, right = window
    return top - rows, bottom + rows, left - columns, right + columns


def synthesise(exemplar, seed, jitter, window, joins=None):
    """Rows and columns of the exemplar for the places of a window of the surface."""
    windows = []
    needed = window
    for k in range(len(exemplar.levels)):
        windows.append(grown(exemplar, k, needed))
        top, bottom, left, right = windows[-1]
        needed = top >> 1, ((bottom - 1) >> 1) + 1, left >> 1, ((right - 1) >> 1) + 1
    coarser = None
    for k in reversed(range(len(exemplar.levels))):
        positions = first_positions(exemplar, k, windows[k], (seed, jitter, joins), coarser)
        coarser = windows[k], correct(exemplar, k, windows[k], positions)
    whole = windows[0]
    inner = np.s_[window[0] - whole[0] : window[1] - whole[0], window[2] - whole[2] : window[3] - whole[2]]
    return [plane[inner] for plane in coarser[1]]
