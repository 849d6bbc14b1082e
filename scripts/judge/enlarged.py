"""The enlarged index: of the paper's method, every choice the minimiser of (25) among the clusters of the nearest normals."""

import numpy as np

from judge.continued import continued
from judge.normals import unit_length

PIXELS = 200


def pixels(height, width):
    """The first texel, some of the first row and column and of the last, and others anywhere."""
    draw = np.random.default_rng(20070901)
    rows, columns = draw.integers(height, size=PIXELS), draw.integers(width, size=PIXELS)
    rows[:20], columns[20:40] = 0, 0
    rows[40:45], columns[45:50] = height - 1, width - 1
    return [(0, 0), *zip(rows.tolist(), columns.tolist())]


def choice(candidates, index, distance, row, column, wraps):
    """The cluster that (25) gives, ties to the earlier candidate; the nearest one where there is no neighbour."""
    height, width = index.shape
    cost = np.zeros(len(candidates))
    if column > 0:
        cost += distance[candidates, index[row, column - 1]]
    if row > 0:
        cost += distance[candidates, index[row - 1, column]]
    if wraps and column == width - 1 > 0:
        cost += distance[candidates, index[row, 0]]
    if wraps and row == height - 1 > 0:
        cost += distance[candidates, index[0, column]]
    return candidates[np.argmin(cost)]


def spread(report, normals, tile_normals, marginals):
    """n_x and n_y are distributed as in the tile, where the model was told to."""
    for axis, name in enumerate(("n_x", "n_y")):
        of_tile, of_output = np.sort(tile_normals[:, axis]), np.sort(normals[:, :, axis].ravel())
        places = (np.arange(1000) + 0.5) / 1000
        far = np.abs(np.quantile(of_tile, places) - np.quantile(of_output, places)).mean() / of_tile.std()
        if marginals:
            report.at_most(f"distribution of {name}", far, 0.25, " spreads from the tile's")
        else:
            report.note(f"distribution of {name} {far:.3f} spreads from the tile's, not matched")


def enlarged(report, store, modelled):
    index = store.read("index")
    clusters = modelled.array("distance").shape[0]
    report.none("enlarged index below the number of clusters", index >= clusters)
    if store.attributes["recipe"].get("rule") == "coherent":
        continued(report, store, modelled)
        return
    if "normals" not in store.group:
        report.note("(25) is not judged: the enlarged normals were not kept")
        return
    normals = store.read("normals")
    unit_length(report, "enlarged normals", normals)
    tile_normals = modelled.read("normals").reshape(-1, 3).astype(float)
    tile_index = modelled.read("index").ravel().astype(int)
    distance = modelled.read("distance").astype(float)
    wraps = store.attributes["recipe"]["tileable"]
    spread(report, normals, tile_normals, modelled.attributes["stages"]["fit"]["report"]["marginals"])
    count = min(store.attributes["recipe"]["candidates"], len(tile_normals))
    wrong = []
    for row, column in pixels(*index.shape):
        squared = np.sum((tile_normals - normals[row, column].astype(float)) ** 2, axis=1)
        nearest = np.argsort(squared, kind="stable")[:count]
        wrong.append(choice(tile_index[nearest], index, distance, row, column, wraps) != index[row, column])
    report.none("enlarged index minimises (25)", wrong, f" with n_k = {count}")
