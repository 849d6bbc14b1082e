"""The tile: sources within the measurement, each from one side of a seam, borders that join."""

import numpy as np


def codes(store, source):
    """L* codes [view, texel, light] of measured texels [..., 2], in the order of the tile."""
    luminance = store.array("luminance")
    rows, columns = source.reshape(-1, 2).T.astype(int)
    return np.stack([luminance[view][rows, columns] for view in range(luminance.shape[0])])


def tile(report, store, measured, tile_codes):
    source = store.read("tile_source").astype(int)
    stage = store.attributes["stages"]["tile"]["report"]
    height, width = source.shape[:2]
    plane = measured.array("luminance").shape[1:3]
    report.equal("measurement size recorded", tuple(stage["measurement_size"]), plane)
    report.none("tile sources within the measurement", (source < 0).any(-1) | (source >= plane).any(-1))
    patch = stage["patch"]
    if patch is None:
        whole = np.stack(np.mgrid[:height, :width], axis=-1)
        report.check("tile is the whole measurement", np.array_equal(source, whole), (height, width))
    else:
        cut(report, source, patch)
    if stage["wraps"] and patch is not None:
        borders(report, source, patch, measured, tile_codes)


def cut(report, source, patch):
    """Every texel comes from its own place in the patch or, within the overlap, from one period on."""
    height, width = source.shape[:2]
    own = np.stack(np.mgrid[:height, :width], axis=-1)
    offset = source - own - (patch["y"], patch["x"])
    beyond = offset != 0
    allowed = (offset == (height, width)) & (own < patch["overlap"])
    report.none("texels from one side or the other of a seam", (beyond & ~allowed).any(-1),
                f", {beyond.any(-1).mean():.1%} from beyond a border")


def borders(report, source, patch, measured, tile_codes):
    """Steps across the wrap-around borders and across all seams, against those between measured neighbours."""
    height, width = source.shape[:2]
    at = tile_codes.reshape(tile_codes.shape[0], height, width, -1).transpose(1, 2, 0, 3).astype(float)
    at_seams, at_others = [], []
    for axis, name in ((0, "top-bottom"), (1, "left-right")):
        squares = np.mean((np.roll(at, -1, axis) - at) ** 2, axis=(2, 3))
        seam = (np.roll(source, -1, axis) - source != np.eye(2, dtype=int)[axis]).any(-1)
        border = np.take(squares, -1, axis).mean()
        ratio = np.sqrt(border / squares[~seam].mean())
        report.at_most(f"steps across the {name} border", ratio, 1.6, " of an ordinary one")
        at_seams.append(squares[seam])
        at_others.append(squares[~seam])
    ordinary = np.sqrt(np.concatenate(at_others).mean())
    seams = np.sqrt(np.concatenate(at_seams).mean())
    limit = max(1.6, uncut(measured, patch) / ordinary)
    report.at_most("steps across all seams", seams / ordinary, limit, " of an ordinary one")


def uncut(measured, patch):
    """RMS step across the borders of the patch if it were repeated without a cut."""
    rows = patch["y"] + np.arange(patch["height"])
    columns = patch["x"] + np.arange(patch["width"])
    steps = [
        (place(rows, columns[-1]), place(rows, columns[0])),
        (place(rows[-1], columns), place(rows[0], columns)),
    ]
    squares = [np.mean((codes(measured, a).astype(float) - codes(measured, b)) ** 2) for a, b in steps]
    return np.sqrt(np.mean(squares))


def place(rows, columns):
    return np.stack(np.broadcast_arrays(rows, columns), axis=-1)
