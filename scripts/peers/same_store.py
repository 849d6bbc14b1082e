"""Two measurement stores by zarr-python: the same arrays, types and samples. Exit code 1 where they disagree.

    same_store.py STORE STORE

The first must open with stock zarr-python; for the second our codec module is imported (PYTHONPATH=python).
"""

import sys

import numpy as np
import zarr


def main():
    first, second = sys.argv[1:]
    names = ("reflectance", "luminance", "view_direction", "light_direction")
    stock = {name: zarr.open(first, mode="r")[name][:] for name in names}
    import btfkit_zarr  # noqa: F401  registers the codec

    wrong = 0
    for name in names:
        found = zarr.open(second, mode="r")[name][:]
        same = found.dtype == stock[name].dtype and np.array_equal(found, stock[name], equal_nan=True)
        wrong += not same
        print(f"{'ok  ' if same else 'FAIL'} {name} {found.dtype} {found.shape}")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
