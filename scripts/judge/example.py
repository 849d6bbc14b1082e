"""Examples of the coherent rule: a frozen exemplar and windows that must come out.

    python -m judge.example FILE            checks docs/method/coherent-example.json, or another, by numpy
    python -m judge.example --make FOLDER   writes examples at random, of awkward sizes too, for the program's tests

Run within scripts/.
"""

import json
import sys
from pathlib import Path

import numpy as np

from judge.coherent import Exemplar, Level, draw, synthesise

RANDOM = 14


def exemplar(example, window):
    levels = [Level(np.array(of["basis"]), np.array(of["offset"]), of["shift"], of["passes"], of["repetition"])
              for of in example["levels"]]
    return Exemplar(np.array(example["index"]), np.array(example["features"]), levels, window["wraps"],
                    window["lattice"])


def positions(example, window, height, width):
    made = exemplar(example, window)
    place = window["y"], window["y"] + height, window["x"], window["x"] + width
    rows, columns = synthesise(made, window["seed"], window["jitter"], place, window["joins"])
    return rows * made.index.shape[1] + columns


def check(file):
    example, wrong = json.loads(Path(file).read_text()), 0
    for seed, k, y, x, expected in example["hash"]:
        wrong += f"{int(draw(seed, k, [y], [x])[0]):08x}" != expected
    print(f"{'ok  ' if not wrong else 'FAIL'} {len(example['hash'])} hashes of {file}: {wrong} wrong")
    for number, window in enumerate(example["windows"]):
        expected = np.array(window["positions"])
        off = np.count_nonzero(positions(example, window, *expected.shape) != expected)
        print(f"{'ok  ' if not off else 'FAIL'} window {number} of {file}: {off} of {expected.size} positions wrong")
        wrong += off
    return wrong


def at_random(number):
    random = np.random.default_rng(number)
    tiny = [(1, 1), (1, 9), (5, 3), (7, 7), (8, 8), (9, 7), (16, 8)]
    height, width = tiny[number] if number < len(tiny) else random.integers(6, 80, 2).tolist()
    clusters = int(random.integers(1, 30))
    count = max(1, min(height, width) // 4).bit_length()
    levels = []
    for k in range(count):
        dims = 8 if k >= count - 2 else 4
        levels.append({
            "shift": 12, "passes": int(random.integers(1, 4)),
            "repetition": int(random.integers(0, 60000)) if k >= count - 2 and random.random() < 0.8 else 0,
            "offset": random.integers(-100000, 100000, dims).tolist(),
            "basis": random.integers(-300, 300, (72, dims)).tolist(),
        })
    row = random.integers(-4, 5, 2).tolist()
    other = random.integers(-4, 5, 2).tolist()
    lattices = [[], [row] if any(row) else [], [row, other] if row[0] * other[1] != row[1] * other[0] else []]
    period = 1 << count
    windows = []
    for joins in (None, (random.integers(1, 5, 2) * period).tolist()):
        for lattice in lattices:
            windows.append({
                "wraps": bool(random.random() < 0.5), "lattice": lattice, "seed": int(random.integers(1 << 32)),
                "jitter": int(random.integers(257)), "joins": joins,
                "y": int(random.integers(-(10**9), 10**9)), "x": int(random.integers(-300, 300)),
            })
    example = {"hash": [], "index": random.integers(clusters, size=(height, width)).tolist(),
               "features": random.integers(-128, 128, (clusters, 8)).tolist(), "levels": levels, "windows": windows}
    for window in windows:
        size = random.integers(1, 60, 2)
        window["positions"] = positions(example, window, *map(int, size)).tolist()
    return example


def main():
    if len(sys.argv) == 2:
        return 1 if check(sys.argv[1]) else 0
    if len(sys.argv) != 3 or sys.argv[1] != "--make":
        sys.exit(__doc__)
    for number in range(RANDOM):
        (Path(sys.argv[2]) / f"{number:02}.json").write_text(json.dumps(at_random(number)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
