"""What an enlarged index is made of, by numba and numpy: one JSON object a line, CPU nanoseconds for each item.

    synthesis.py [SIDE]

numpy-normals     standard normals in f32, an item each
numba-car         a causal autoregressive field of three channels from noise in memory, for 20 and 40 neighbours, an
                  item a texel; the plain loop, texel by texel, compiled with fast mathematics
numba-scan        the choice of (25) among 16 candidates by the distances to the clusters at left and above, an item a
                  texel

Squares of SIDE (default 1024) texels, one thread; medians of seven runs after one to compile. `cargo bench --bench
enlarge` does the first two with neighbours and coefficients of the same sizes.
"""

import json
import sys
import time

import numpy as np
from numba import njit

RUNS = 7
CANDIDATES = 16
CLUSTERS = 256
PAD = 8


def report(peer, items, work, **more):
    work()
    seconds = []
    for _ in range(RUNS):
        start = time.process_time()
        work()
        seconds.append(time.process_time() - start)
    print(json.dumps({"peer": peer, **more, "cpu_ns": round(sorted(seconds)[RUNS // 2] / items * 1e9, 2)}), flush=True)


def neighbours(count):
    """(dy, dx), the nearest first."""
    sites = [(dy, dx) for dy in range(6) for dx in range(-6, 7) if dy > 0 or dx > 0]
    return np.array(sorted(sites, key=lambda site: (site[0] ** 2 + site[1] ** 2, site))[:count])


@njit(fastmath=True)
def car(field, noise, sites, gamma):
    height, width = field.shape[:2]
    for y in range(PAD, height - PAD):
        for x in range(PAD, width - PAD):
            first, second, third = noise[y, x]
            for n in range(len(sites)):
                value = field[y - sites[n, 0], x - sites[n, 1]]
                a = gamma[n]
                first += a[0, 0] * value[0] + a[0, 1] * value[1] + a[0, 2] * value[2]
                second += a[1, 0] * value[0] + a[1, 1] * value[1] + a[1, 2] * value[2]
                third += a[2, 0] * value[0] + a[2, 1] * value[1] + a[2, 2] * value[2]
            field[y, x, 0] = first
            field[y, x, 1] = second
            field[y, x, 2] = third


@njit
def scan(distance, candidates, index):
    height, width, count = candidates.shape
    for y in range(1, height):
        for x in range(1, width):
            left, above = distance[index[y, x - 1]], distance[index[y - 1, x]]
            least, best = np.float32(np.inf), 0
            for n in range(count):
                cluster = candidates[y, x, n]
                cost = left[cluster] + above[cluster]
                if cost < least:
                    least, best = cost, cluster
            index[y, x] = best


def main():
    side = int(sys.argv[1]) if len(sys.argv) > 1 else 1024
    random = np.random.default_rng(0)
    texels = side * side
    report("numpy-normals", 3 * texels, lambda: random.standard_normal(3 * texels, dtype=np.float32))
    padded = (side + 2 * PAD, side + 2 * PAD, 3)
    noise = random.standard_normal(padded, dtype=np.float32)
    for count in (20, 40):
        sites = neighbours(count)
        weights = 1 / (1 + (sites**2).sum(axis=1))
        gamma = (np.eye(3) * (0.95 * weights / weights.sum())[:, None, None]).astype(np.float32)
        field = np.zeros(padded, np.float32)
        report("numba-car", texels, lambda: car(field, noise, sites, gamma), neighbours=count)
    distance = random.random((CLUSTERS, CLUSTERS), dtype=np.float32)
    candidates = random.integers(0, CLUSTERS, (side, side, CANDIDATES)).astype(np.uint8)
    index = np.zeros((side, side), np.uint8)
    report("numba-scan", texels, lambda: scan(distance, candidates, index))


main()
