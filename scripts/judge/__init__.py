"""An independent reading of btfkit's stores: stock zarr-python and numpy, straight from the paper's equations."""

from pathlib import Path

import numpy as np
import zarr


class Report:
    """Prints one line per check and remembers whether any failed."""

    def __init__(self):
        self.checks = 0
        self.failures = 0

    def check(self, name, holds, figure):
        self.checks += 1
        self.failures += not holds
        print(f"{'ok  ' if holds else 'FAIL'} {name}: {figure}", flush=True)

    def equal(self, name, got, expected):
        self.check(name, got == expected, f"{got}" if got == expected else f"{got}, expected {expected}")

    def at_most(self, name, value, limit, remark=""):
        """A NaN fails."""
        self.check(name, bool(value <= limit), f"{value:.6g} (at most {limit:g}){remark}")

    def none(self, name, wrong, remark=""):
        """Fails if any of the elements is true, or if there is none to look at."""
        wrong = np.asarray(wrong)
        self.check(name, wrong.size > 0 and not wrong.any(), f"{np.count_nonzero(wrong)} of {wrong.size} wrong{remark}")

    def note(self, text):
        """Says what cannot be judged."""
        print(f"note {text}", flush=True)

    def topic(self, check, *arguments):
        """Runs the checks of one topic; a store too broken to be read is a failure, not the end."""
        try:
            return check(self, *arguments)
        except Exception as error:
            name = f"{check.__module__.split('.')[-1]}.{check.__name__}"
            self.check(name, False, f"could not be checked: {type(error).__name__}: {error}")


class Store:
    """A store opened read-only as a Zarr v3 group, and its attributes under `btfkit`."""

    def __init__(self, kind, path):
        self.kind = kind
        self.path = Path(path)
        self.group = zarr.open_group(path, mode="r", zarr_format=3)
        self.attributes = self.group.attrs["btfkit"]

    def array(self, name):
        return self.group[name]

    def read(self, name):
        return self.group[name][...]


def relative(got, expected):
    """Largest difference of two arrays relative to the largest magnitude expected; infinite if shapes differ."""
    got, expected = np.asarray(got), np.asarray(expected)
    if got.shape != expected.shape:
        return np.inf
    return np.abs(got - expected).max() / max(np.abs(expected).max(), np.finfo(float).tiny)


def vectors(directions):
    """Unit vectors [n, 3] of directions [n, 2] (theta, phi in radians) in the sample frame."""
    theta, phi = np.asarray(directions, dtype=float).T
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)
