"""HDF5 archives by h5py, independent of the program.

compare FILE STORE             every sample and every direction of an HDF5 file, of either layout, against a measurement
                               store; exit code 1 where they disagree
list IMAGES VIEWS LIGHTS FILE  writes a list of images (ground_color, ground_light, ground_camera_dir), shuffled, from
                               .npy files: [view, light, y, x, 3], and [n, 2] theta and phi in radians; --packed chunks and
                               deflates them as h5py likes

Needs h5py, numpy and zarr.
"""

import argparse
import json
import sys

import h5py
import numpy as np

DIRECTIONS = ("view_direction", "light_direction")


def vectors(angles):
    """Unit vectors of [n, 2] theta, phi."""
    theta, phi = np.asarray(angles, dtype=np.float64).T
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)


def text(value):
    return value.decode() if isinstance(value, bytes) else value


class Report:
    def __init__(self):
        self.failed = 0

    def equal(self, what, got, expected):
        same = np.array_equal(got, expected) if isinstance(got, np.ndarray) else got == expected
        self.failed += not same
        print(f"{'ok  ' if same else 'FAIL'} {what}" + ("" if same else f": got {got}, expected {expected}"))


def same_samples(report, what, got, expected):
    """Bit for bit, so that NaN equals itself and -0 differs from 0."""
    got, expected = np.ascontiguousarray(got), np.ascontiguousarray(expected)
    if (got.dtype, got.shape) != (expected.dtype, expected.shape):
        report.equal(f"type and shape of {what}", (got.dtype.str, got.shape), (expected.dtype.str, expected.shape))
        return
    differing = np.count_nonzero(got.view(np.uint8) != expected.view(np.uint8))
    report.equal(f"{what}: differing bytes of {got.nbytes}", differing, 0)


def compare_measurement(report, file, group):
    told = dict(group.attrs["btfkit"])
    # The layout of the file has a version of its own (docs/formats/hdf5.md).
    report.equal("attribute format", int(file.attrs["format"]), 1)
    for name in ("kind", "transfer", "white", "radiometry"):
        report.equal(f"attribute {name}", text(file.attrs.get(name)), told.get(name))
    report.equal("attribute recipe", json.loads(text(file.attrs["recipe"])), told["recipe"])
    channels = [text(name) for name in file["reflectance"].attrs["channels"]]
    report.equal("names of channels", channels, list(group["reflectance"].attrs["channels"]))
    for name in DIRECTIONS:
        report.equal(name, file[name][...], group[name][...])
    found, stored = file["reflectance"], group["reflectance"]
    report.equal("shape of reflectance", found.shape, stored.shape)
    report.equal("chunks of reflectance", found.chunks, tuple(min(c, n) for c, n in zip(stored.chunks, stored.shape)))
    report.equal("packing", (found.compression, found.shuffle, found.fletcher32), ("gzip", True, True))
    labels = [dimension.label for dimension in found.dims]
    report.equal("names of dimensions", labels, list(stored.metadata.dimension_names))
    for name in ("reflectance", "luminance"):
        for view in range(stored.shape[0] if name in file else 0):
            same_samples(report, f"{name} of view {view}", file[name][view], group[name][view])


def compare_list(report, file, group):
    stored = group["reflectance"]
    known = {name: vectors(group[name][...]) for name in DIRECTIONS}
    of_image = {}
    for name, dataset in zip(DIRECTIONS, ("ground_camera_dir", "ground_light")):
        xy = file[dataset][...].astype(np.float64)
        distance = np.abs(known[name][None, :, :2] - xy[:, None, :]).max(axis=-1)
        of_image[name] = distance.argmin(axis=1)
        report.equal(f"images whose {name} is not in the store", np.count_nonzero(distance.min(axis=1) > 1e-4), 0)
    pairs = list(zip(*(of_image[name] for name in DIRECTIONS)))
    report.equal("different pairs of directions", len(set(pairs)), stored.shape[0] * stored.shape[3])
    order = sorted(range(len(pairs)), key=lambda image: pairs[image])
    for view in range(stored.shape[0]):
        samples = stored[view]
        images = [image for image in order if pairs[image][0] == view]
        got = np.stack([samples[:, :, pairs[image][1], :] for image in images])
        same_samples(report, f"images of view {view}", got, np.stack([file["ground_color"][image] for image in images]))


def compare(options):
    import zarr

    report = Report()
    group = zarr.open_group(options.store, mode="r")
    with h5py.File(options.file, "r") as file:
        (compare_list if "ground_color" in file else compare_measurement)(report, file, group)
    return 1 if report.failed else 0


def write_list(options):
    images, views, lights = (np.load(path) for path in (options.images, options.views, options.lights))
    if images.shape[:2] != (len(views), len(lights)):
        sys.exit(f"got images {images.shape} of {len(views)} views and {len(lights)} lights")
    order = np.random.default_rng(1).permutation(images.shape[0] * images.shape[1])
    view, light = np.unravel_index(order, images.shape[:2])
    packing = {"compression": "gzip", "shuffle": True} if options.packed else {}
    with h5py.File(options.file, "w") as file:
        file.create_dataset("ground_color", data=images[view, light].astype(np.float32), **packing)
        file.create_dataset("ground_camera_dir", data=vectors(views)[view, :2].astype(np.float32))
        file.create_dataset("ground_light", data=vectors(lights)[light, :2].astype(np.float32))
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    command = commands.add_parser("compare")
    command.add_argument("file")
    command.add_argument("store")
    command.set_defaults(run=compare)
    command = commands.add_parser("list")
    for name in ("images", "views", "lights", "file"):
        command.add_argument(name)
    command.add_argument("--packed", action="store_true")
    command.set_defaults(run=write_list)
    options = parser.parse_args()
    sys.exit(options.run(options))


if __name__ == "__main__":
    main()
