#!/usr/bin/env python3
"""Reads some images of a Bonn .btf file or an UBO2003 zip with btf-extractor and compares them with ours.

    btf_extractor.py ARCHIVE EXPECTED.npy [--images N] [--clamp]
    btf_extractor.py ARCHIVE --dump OUT.npy [--images N]

EXPECTED.npy is f32 [view, light, y, x, channel], row 0 at the top, on the scale where 1.0 is reflectance 1 (or
display white); views and lights in the order of the file (.btf), or sorted by theta, then phi (zip). N images,
24 unless told, are spread over all pairs; a dump holds all. Prints the largest difference.

Exit code: 0 they agree, 1 they do not, 2 usage. btf-extractor does not report what it cannot open: it crashes.

btf-extractor reads .btf files upside down (it swaps the rows that are stored), which is undone here, and clamps
colour model 11 to 0..1, for which --clamp clamps what is expected, too.

Needs btf-extractor 1.7.0. With CPython 3.11, g++ and OpenMP:
    pip install "numpy<2" "cython<3" "setuptools<69" wheel poetry-core simplejpeg imageio "nptyping<2"
    pip install --no-build-isolation --no-deps btf-extractor==1.7.0
"""

import argparse
import sys

import numpy as np

# This script has the name of the package that it imports, and its folder comes first.
sys.path.pop(0)

# The peer keeps f32, we round to f16 where the file is f16 (2^-11); in model 11 it adds 1e-5 at another place.
BTF_TOLERANCE = {"rtol": 1e-3, "atol": 1e-4}
# Decoders of JPEG differ in rounding and in how they enlarge the chroma planes.
JPEG_TOLERANCE = {"rtol": 0.0, "atol": 6.0 / 255.0}


class Btf:
    """A .btf file: images by index."""

    tolerance = BTF_TOLERANCE

    def __init__(self, path):
        from btf_extractor import Ubo2014

        self.archive = Ubo2014(path)
        pairs = np.asarray(list(self.archive.angles_vs_index_dict.values()))
        self.lights, self.views = (int(n) for n in 1 + pairs.max(axis=0))

    def image(self, view, light):
        bgr = self.archive._angleindex_to_image_unsafe(light, view)
        return bgr[::-1, :, ::-1]


class Zip:
    """An UBO2003 zip: images by sorted angles."""

    tolerance = JPEG_TOLERANCE

    def __init__(self, path):
        from btf_extractor import Ubo2003

        self.archive = Ubo2003(path)
        self.light_angles = sorted({(tl, pl) for tl, pl, _, _ in self.archive.angles_set})
        self.view_angles = sorted({(tv, pv) for _, _, tv, pv in self.archive.angles_set})
        self.lights, self.views = len(self.light_angles), len(self.view_angles)

    def image(self, view, light):
        bgr = self.archive.angles_to_image(*self.light_angles[light], *self.view_angles[view])
        return bgr[:, :, ::-1].astype(np.float32) / 255.0


def spread(total, number):
    """At most `number` of the numbers below `total`, evenly spread, with both ends."""
    return np.unique(np.linspace(0, total - 1, min(total, number)).round().astype(int))


def compare(archive, expected, number, clamp):
    """The largest difference, and whether all images agree."""
    image = archive.image(0, 0)
    shape = (archive.views, archive.lights, *image.shape)
    if expected.shape != shape:
        print(f"btf-extractor reads {shape}, expected are {expected.shape}")
        return False
    worst, agrees = 0.0, True
    for pair in spread(archive.views * archive.lights, number):
        view, light = divmod(int(pair), archive.lights)
        wanted = np.asarray(expected[view, light], dtype=np.float32)
        wanted = np.clip(wanted, 0.0, 1.0) if clamp else wanted
        read = archive.image(view, light)
        worst = max(worst, float(np.abs(read - wanted).max()))
        if not np.allclose(read, wanted, **archive.tolerance):
            y, x, c = np.unravel_index(np.abs(read - wanted).argmax(), read.shape)
            print(f"view {view}, light {light}, row {y}, column {x}, channel {c}: "
                  f"btf-extractor reads {read[y, x, c]}, expected is {wanted[y, x, c]}")
            agrees = False
    print(f"largest difference {worst:.3g}")
    return agrees


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("archive")
    parser.add_argument("expected", nargs="?")
    parser.add_argument("--dump")
    parser.add_argument("--images", type=int, default=24)
    parser.add_argument("--clamp", action="store_true")
    args = parser.parse_args()
    if (args.expected is None) == (args.dump is None):
        parser.error("either EXPECTED.npy or --dump OUT.npy")
    archive = (Zip if args.archive.lower().endswith(".zip") else Btf)(args.archive)
    if args.dump:
        pairs = [[archive.image(v, l) for l in range(archive.lights)] for v in range(archive.views)]
        np.save(args.dump, np.asarray(pairs, dtype=np.float32))
        return 0
    expected = np.load(args.expected, mmap_mode="r")
    return 0 if compare(archive, expected, args.images, args.clamp) else 1


if __name__ == "__main__":
    sys.exit(main())
