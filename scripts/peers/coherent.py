"""The coherent rule by numba, written from docs/method/coherent.md: one JSON object, CPU nanoseconds for a texel.

    coherent.py MODEL ENLARGED [SIDE]

Makes the window of SIDE x SIDE (default 512) texels from place (0, 0) of the plane that ENLARGED is of, one thread; the
median of seven runs after one to compile. What comes out must be the source that ENLARGED stores. The levels'
appearance is worked out beforehand, as in `cargo bench --bench coherent`.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
from numba import njit

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from judge import Store  # noqa: E402
from judge.coherent import CANDIDATES, first_positions, grown, is_bordered, mix, u32  # noqa: E402
from judge.continued import exemplar  # noqa: E402

RUNS = 7
MASK = 0xFFFFFFFF
NEIGHBOURS = np.array(CANDIDATES)
DIAGONALS = np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)])
PARITIES = ((0, 0), (1, 1), (0, 1), (1, 0))


@njit
def mixed(v):
    v ^= v >> 16
    v = (v * 0x21F0AAAD) & MASK
    v ^= v >> 15
    v = (v * 0xD35A2D97) & MASK
    return v ^ (v >> 15)


@njit
def continue_parents(rows, columns, corner, parent_rows, parent_columns, parent_corner, k, key, jitter, sides, bordered):
    h = 1 << k
    for n in range(rows.shape[0]):
        y = corner[0] + n
        for m in range(rows.shape[1]):
            x = corner[1] + m
            r = mixed(mixed(key ^ (x & MASK)) ^ (((y & MASK) * 0x9E3779B1) & MASK))
            up, left = (y >> 1) - parent_corner[0], (x >> 1) - parent_corner[1]
            half = 1 << (22 - k)
            row = (parent_rows[up, left] + h * (y & 1) + ((((r >> 16) - 32768) * jitter + half) >> (23 - k))) % sides[0]
            column = (parent_columns[up, left] + h * (x & 1) + ((((r & 0xFFFF) - 32768) * jitter + half) >> (23 - k))) % sides[1]
            if bordered:
                row = 2 - row if row < 1 else 2 * (sides[0] - 2) - row if row > sides[0] - 2 else row
                column = 2 - column if column < 1 else 2 * (sides[1] - 2) - column if column > sides[1] - 2 else column
            rows[n, m], columns[n, m] = row, column


@njit
def sub_pass(rows, columns, start, reach, look, h, sides, bordered, cost_of_repetition, periods, began_rows, began_columns):
    """`look` has a margin of h on every side."""
    height, width = sides
    dims = look.shape[2]
    around = np.empty((4, dims), np.int32)
    found = np.empty((9, 2), np.int64)
    sites = np.empty((12, 2), np.int64)
    for y in range(start[0], rows.shape[0] - reach[0], 2):
        for x in range(start[1], rows.shape[1] - reach[1], 2):
            count = 0
            for n in range(9):
                i, j = NEIGHBOURS[n]
                row, column = rows[y + i, x + j] - h * i, columns[y + i, x + j] - h * j
                if n > 0 and bordered and not (1 <= row <= height - 2 and 1 <= column <= width - 2):
                    continue
                row += height if row < 0 else -height if row >= height else 0
                column += width if column < 0 else -width if column >= width else 0
                known = False
                for c in range(count):
                    known |= found[c, 0] == row and found[c, 1] == column
                if not known:
                    found[count, 0], found[count, 1] = row, column
                    count += 1
            if count == 1:
                continue
            for e in range(4):
                i, j = DIAGONALS[e]
                own = look[rows[y + i, x + j] + h, columns[y + i, x + j] + h]
                down = look[rows[y + 2 * i, x + j] - h * i + h, columns[y + 2 * i, x + j] + h]
                along = look[rows[y + i, x + 2 * j] + h, columns[y + i, x + 2 * j] - h * j + h]
                for d in range(dims):
                    around[e, d] = np.int32(own[d]) + np.int32(down[d]) + np.int32(along[d])
            if cost_of_repetition:
                s = 0
                for t in range(-1, 2):
                    for i, j in ((-periods[0], t), (periods[0], t), (t, -periods[1]), (t, periods[1])):
                        sites[s, 0] = (began_rows[y + i, x + j] - h * i) % height
                        sites[s, 1] = (began_columns[y + i, x + j] - h * j) % width
                        s += 1
            least, best = np.int64(1) << 60, 0
            for c in range(count):
                cost = np.int64(0)
                for e in range(4):
                    i, j = DIAGONALS[e]
                    there = look[found[c, 0] + h * i + h, found[c, 1] + h * j + h]
                    for d in range(dims):
                        off = around[e, d] - 3 * np.int32(there[d])
                        cost += off * off
                if cost_of_repetition:
                    for s in range(12):
                        for axis in range(2):
                            apart = abs(sites[s, axis] - found[c, axis])
                            if 2 * min(apart, sides[axis] - apart) <= h:
                                cost += cost_of_repetition
                if cost < least:
                    least, best = cost, c
            rows[y, x], columns[y, x] = found[best, 0], found[best, 1]


def synthesise(made, looks, seed, jitter, side):
    windows, needed = [], (0, side, 0, side)
    for k in range(len(made.levels)):
        windows.append(grown(made, k, needed))
        top, bottom, left, right = windows[-1]
        needed = top >> 1, ((bottom - 1) >> 1) + 1, left >> 1, ((right - 1) >> 1) + 1
    sides = made.index.shape
    above = None
    for k in reversed(range(len(made.levels))):
        level, (top, bottom, left, right) = made.levels[k], windows[k]
        edge = k == 0 and is_bordered(made)
        if above is None:
            rows, columns = (np.ascontiguousarray(part) for part in first_positions(made, k, windows[k], (seed, jitter, None), None))
        else:
            key = int(mix(u32(int(mix(u32([seed]))[0]) + k).reshape(1))[0])
            rows, columns = np.empty((2, bottom - top, right - left), np.int64)
            continue_parents(rows, columns, (top, left), *above, k, key, jitter, sides, edge)
        periods = tuple((extent + (1 << k) // 2) >> k for extent in sides)
        reach = tuple(max(2, period + 1) if level.repetition else 2 for period in periods)
        for _ in range(level.passes):
            began = (rows.copy(), columns.copy()) if level.repetition else (rows, columns)
            for parity in PARITIES:
                start = tuple(r + (p - first - r) % 2 for r, p, first in zip(reach, parity, (top, left)))
                sub_pass(rows, columns, start, reach, looks[k], 1 << k, sides, edge, level.repetition, periods, *began)
        above = rows, columns, (top, left)
    inner = np.s_[-windows[0][0] : side - windows[0][0], -windows[0][2] : side - windows[0][2]]
    return rows[inner], columns[inner]


def main():
    modelled, store = Store("model", sys.argv[1]), Store("enlarged", sys.argv[2])
    side = int(sys.argv[3]) if len(sys.argv) > 3 else 512
    made, place, tile_width = exemplar(modelled)
    looks = [np.pad(look, [(1 << k,) * 2, (1 << k,) * 2, (0, 0)], mode="wrap").astype(np.int8)
             for k, look in enumerate(made.appearance)]
    recipe = store.attributes["recipe"]
    seconds = []
    for _ in range(RUNS + 1):
        start = time.process_time()
        rows, columns = synthesise(made, looks, recipe["seed"], recipe["jitter"], side)
        seconds.append(time.process_time() - start)
    source = (place[0] + rows) * tile_width + place[1] + columns
    if not np.array_equal(source, store.array("source")[:side, :side]):
        sys.exit("coherent.py: the texels are not those that the program stored")
    cpu_ns = sorted(seconds[1:])[RUNS // 2] / side**2 * 1e9
    print(json.dumps({"peer": "numba-coherent", "side": side, "cpu_ns": round(cpu_ns, 1)}))


main()
