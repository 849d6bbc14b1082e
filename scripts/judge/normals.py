"""The normal map by photometric stereo, (2) and (3) with rho = 1."""

import numpy as np

from judge import color, vectors


def unit_length(report, name, normals):
    report.at_most(f"{name} have unit length", np.abs(np.linalg.norm(normals.astype(float), axis=-1) - 1).max(), 1e-6)


def normals(report, store, measured):
    got = store.read("normals")
    unit_length(report, "normals", got)
    stage = store.attributes["stages"]["normals"]
    view = int(np.argmin(measured.read("view_direction")[:, 0]))
    report.equal("normals are seen from the most frontal view", stage["report"]["view"], view)
    if stage["recipe"]["robust"]:
        report.note("(3) is not judged: the fit was robust")
        return
    rows, columns = store.read("tile_source").reshape(-1, 2).T.astype(int)
    samples = measured.array("reflectance")[view][rows, columns]
    intensities = color.luminance(samples, measured.attributes["transfer"])
    lights = vectors(measured.read("light_direction"))
    solved = np.linalg.lstsq(lights, intensities.T, rcond=None)[0].T
    length = np.linalg.norm(solved, axis=1, keepdims=True)
    expected = np.where(length > 0, solved / np.where(length > 0, length, 1), (0, 0, 1))
    report.at_most("normals by (3)", np.abs(got.reshape(-1, 3) - expected).max(), 1e-5)
