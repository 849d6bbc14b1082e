"""The measurement against the archive it was read from, and its luminance codes against its reflectance."""

import io
import re
import zipfile

import numpy as np
from PIL import Image

from judge import color

NAME = re.compile(r"(\d+)[ _]tl(\d+)[ _]pl(\d+)[ _]tv(\d+)[ _]pv(\d+)\.jpe?g$", re.IGNORECASE)


def archive_names(archive):
    """Entries of a zip by whole degrees: {(theta_l, phi_l, theta_v, phi_v): entry}."""
    found = {}
    for entry in archive.namelist():
        match = NAME.search(entry.rsplit("/", 1)[-1])
        if match:
            found[tuple(int(angle) for angle in match.groups()[1:])] = entry
    return found


def degrees(directions):
    """Directions as the names of the archive tell them."""
    return [tuple(int(angle) for angle in np.rint(row)) for row in np.degrees(directions)]


def directions(report, store, names):
    views, lights = (degrees(store.read(f"{name}_direction")) for name in ("view", "light"))
    for name, got, named in (("view", views, {n[2:] for n in names}), ("light", lights, {n[:2] for n in names})):
        exact = np.abs(np.degrees(store.read(f"{name}_direction")) - np.array(got)).max()
        report.check(f"{name} directions are those of the names", sorted(got) == sorted(named) and exact < 1e-9,
                     f"{len(got)}, off by at most {exact:.1e} degrees")
    report.equal("images of the archive", len(names), len(views) * len(lights))
    return views, lights


def archive(report, store, path):
    """Decodes a spread of images and finds them at their place in the store."""
    reflectance = store.array("reflectance")
    with zipfile.ZipFile(path) as archive:
        names = archive_names(archive)
        views, lights = directions(report, store, names)
        spread = np.unique(np.linspace(0, len(names) - 1, 40).astype(int))
        mean, worst = [], []
        for (light, view) in ((n[:2], n[2:]) for n in (sorted(names)[k] for k in spread)):
            pixels = np.asarray(Image.open(io.BytesIO(archive.read(names[light + view]))))
            pixels = pixels.reshape(*pixels.shape[:2], -1).astype(int)
            stored = reflectance[views.index(view), :, :, lights.index(light), :]
            difference = np.abs(stored - pixels)
            mean.append(difference.mean())
            worst.append(difference.max())
    report.at_most(f"mean difference of {len(mean)} images", max(mean), 0.6)
    report.at_most(f"largest difference of {len(mean)} images", max(worst), 12)


def luminance(report, store):
    """Every code of several views; either neighbour may stand where the value lies half-way between them."""
    codes, reflectance = store.array("luminance"), store.array("reflectance")
    transfer, white = store.attributes["transfer"], store.attributes["recipe"]["white"]
    for view in np.unique(np.linspace(0, codes.shape[0] - 1, 5).astype(int)):
        value = color.scaled_lightness(color.luminance(reflectance[view], transfer), white)
        report.none(f"luminance codes of view {view}", np.abs(codes[view] - value) > 0.5 + 1e-9)
