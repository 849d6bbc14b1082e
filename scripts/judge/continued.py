"""An enlarged index of the coherent rule: every texel the one that the specification gives, by numpy."""

import numpy as np

from judge.coherent import Exemplar, Level, synthesise


def exemplar(modelled):
    """The exemplar of a model, where it begins in the tile, and the tile's width."""
    stage = modelled.attributes["stages"]["appearance"]["report"]
    row, column, height, width = stage["exemplar"]
    index = modelled.read("index").astype(int)
    levels = [
        Level(modelled.read(f"appearance/level_{k}/basis"), modelled.read(f"appearance/level_{k}/offset"),
              level["shift"], level["passes"], level["repetition"])
        for k, level in enumerate(stage["levels"])
    ]
    part = index[row : row + height, column : column + width]
    features = modelled.read("appearance/features")
    return Exemplar(part, features, levels, stage["wraps"], stage["lattice"]), (row, column), index.shape[1]


def continued(report, store, modelled):
    recipe = store.attributes["recipe"]
    height, width = recipe["size"]
    made, (row, column), tile_width = exemplar(modelled)
    joins = (height, width) if recipe["tileable"] else None
    rows, columns = synthesise(made, recipe["seed"], recipe["jitter"], (0, height, 0, width), joins)
    source = (row + rows) * tile_width + column + columns
    kind = f"exemplar {made.index.shape}{', joins' if made.wraps else ''}, lattice {made.lattice}"
    if recipe["source"]:
        report.none("source of every texel", store.read("source") != source, f", {kind}")
    report.none("index of every texel", store.read("index") != modelled.read("index").ravel()[source], f", {kind}")
    if recipe["keep_normals"]:
        normals = modelled.read("normals").reshape(-1, 3)
        report.none("normals are the source's", store.read("normals") != normals[source])
