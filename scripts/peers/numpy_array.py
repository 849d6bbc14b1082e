"""A measurement store as one array of numpy, [view, light, y, x, channel].

    numpy_array.py ARRAY.npy STORE             compares an exported array and its directions; exit code 1 where they disagree
    numpy_array.py --linear OUT.npy STORE      writes the samples as linear f32, for judges of other exports
    numpy_array.py --display OUT.npy STORE     writes them as f32 with the transfer curve, 1.0 is display white

Needs numpy and zarr.
"""

import argparse
import sys

import numpy as np
import zarr


def images(store):
    return np.ascontiguousarray(store["reflectance"][:].transpose(0, 3, 1, 2, 4))


def display(samples):
    if np.issubdtype(samples.dtype, np.floating):
        return samples.astype(np.float32)
    return (samples / np.float64(np.iinfo(samples.dtype).max)).astype(np.float32)


def linear(values, transfer):
    if transfer == "linear":
        return values
    values = values.astype(np.float64)
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4).astype(np.float32)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("array")
    parser.add_argument("store")
    parser.add_argument("--linear", action="store_true")
    parser.add_argument("--display", action="store_true")
    arguments = parser.parse_args()
    store = zarr.open(arguments.store, mode="r")
    expected = images(store)
    if arguments.linear or arguments.display:
        values = display(expected)
        transfer = store.attrs["btfkit"]["transfer"]
        np.save(arguments.array, linear(values, transfer) if arguments.linear else values)
        return
    found = np.load(arguments.array)
    wrong = 0
    if found.dtype != expected.dtype or found.shape != expected.shape or not (found == expected).all():
        print(f"FAIL samples: {found.dtype} {found.shape} against {expected.dtype} {expected.shape}")
        wrong = 1
    for kind in ("view", "light"):
        beside = np.load(arguments.array.removesuffix(".npy") + f".{kind}s.npy")
        if not np.allclose(beside, store[f"{kind}_direction"][:], rtol=0, atol=1e-12):
            print(f"FAIL {kind} directions")
            wrong = 1
    print(f"{expected.size} samples compared" if not wrong else "array and store disagree")
    sys.exit(wrong)


if __name__ == "__main__":
    main()
