"""Every image of an UBO2003 archive, decoded by Pillow, against a measurement store; exit code 1 where they disagree.

    pillow.py ARCHIVE STORE

ARCHIVE is a zip or a folder of images named by their angles. PNG and TIFF must agree exactly. Of JPEG no sample may differ
by more than 5 levels, nor an image by 1 on average: two decoders may round luma by 1 level, chroma by 1 in the transform
and 1 in the upsampling, which the colour matrix makes 1 + 1.772 * 2, and the result by 1/2. Prints the largest and the
mean difference. Needs numpy, pillow and zarr.
"""

import io
import pathlib
import re
import sys
import zipfile

import numpy as np
import zarr
from PIL import Image

ENDINGS = (".jpg", ".jpeg", ".png", ".tif", ".tiff")
ANGLE = re.compile(r"(?<![a-z])(tl|pl|tv|pv)(\d+(?:\.\d+)?)", re.IGNORECASE)
MOST_LEVELS, MOST_MEAN = 5, 1.0
NAMED = 20


def images(path):
    """Names of all images, each with what reads its bytes."""
    if zipfile.is_zipfile(path):
        archive = zipfile.ZipFile(path)
        found = {name: lambda name=name: archive.read(name) for name in archive.namelist()}
    else:
        found = {str(file): file.read_bytes for file in pathlib.Path(path).rglob("*") if file.is_file()}
    return {name: read for name, read in found.items() if name.lower().endswith(ENDINGS)}


def unit(theta, phi):
    theta, phi = np.radians(theta), np.radians(phi)
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def nearest(directions, theta, phi):
    """Number of the direction of a name, or None where the store has none like it."""
    cosines = directions @ unit(theta, phi)
    return int(cosines.argmax()) if cosines.max() > 1 - 1e-9 else None


def decode(data):
    """Samples [y, x, channel], of 16 bits where the file has them."""
    pixels = np.asarray(Image.open(io.BytesIO(data)))
    if pixels.dtype == np.int32:  # Pillow's mode I for 16-bit grey
        pixels = pixels.astype(np.uint16)
    return pixels.reshape(*pixels.shape[:2], -1)


def placed(names, views, lights, problems):
    """Names by (view, light), in that order."""
    found = {}
    for name in sorted(names):
        angles = {kind.lower(): float(value) for kind, value in ANGLE.findall(pathlib.PurePath(name).name)}
        if set(angles) != {"tl", "pl", "tv", "pv"}:
            continue
        pair = nearest(views, angles["tv"], angles["pv"]), nearest(lights, angles["tl"], angles["pl"])
        if None in pair:
            problems.append(f"{name}: its directions are not in the store")
        elif pair in found:
            problems.append(f"{name}: the same directions as {found[pair]}")
        else:
            found[pair] = name
    missing = len(views) * len(lights) - len(found)
    if missing:
        problems.append(f"{missing} of {len(views) * len(lights)} pairs of directions have no image in the archive")
    return sorted(found.items())


def compare(name, pixels, got):
    """The largest and the mean difference of an image, and what is wrong with it."""
    if (pixels.shape, pixels.dtype) != (got.shape, got.dtype):
        return 0, 0.0, f"{name}: {pixels.shape} {pixels.dtype}, in the store {got.shape} {got.dtype}"
    difference = np.abs(pixels.astype(np.int64) - got.astype(np.int64))
    worst, mean = int(difference.max()), float(difference.mean())
    most = MOST_LEVELS if name.lower().endswith((".jpg", ".jpeg")) else 0
    wrong = worst > most or mean >= MOST_MEAN
    return worst, mean, f"{name}: differs by up to {worst}, {mean:.3f} on average" if wrong else None


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    found = images(sys.argv[1])
    group = zarr.open_group(sys.argv[2], mode="r")
    stored = group["reflectance"]
    views, lights = (
        np.stack([unit(*np.degrees(row)) for row in group[f"{name}_direction"][...]]) for name in ("view", "light")
    )
    problems, differences = [], []
    held, samples = None, None
    for (view, light), name in placed(found, views, lights, problems):
        if view != held:
            held, samples = view, stored[view]
        worst, mean, problem = compare(name, decode(found[name]()), samples[:, :, light, :])
        differences.append((worst, mean))
        if problem:
            problems.append(problem)
    if not differences:
        sys.exit(f"{sys.argv[1]}: no images")
    worst, mean = np.array(differences).T
    print(f"{len(differences)} images, largest difference {worst.max():.0f}, mean {mean.mean():.4f}")
    for problem in problems[:NAMED]:
        print(f"FAIL {problem}")
    if len(problems) > NAMED:
        print(f"and {len(problems) - NAMED} more")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
