"""Clusters by distance (1), their representatives, and the distances (26) between those."""

import numpy as np

from judge import tile

TIE = 1e-4


def distances(texels, centres, weights):
    """(1) in L* units, [texel, cluster], of codes [view, texel, light] and [cluster, view, light]."""
    total = np.zeros((texels.shape[1], centres.shape[0]))
    for view, weight in enumerate(weights):
        codes = texels[view].astype(np.int32)
        for cluster, centre in enumerate(centres[:, view].astype(np.int32)):
            total[:, cluster] += weight * np.abs(codes - centre).sum(axis=1)
    return total / 2.55


def from_own(texels, index, centres, weights):
    """Sum of (1) over all texels from the centre that the index gives them."""
    return sum(distances(texels[:, index == k], centres[k:k + 1], weights).sum() for k in range(len(centres)))


def updated(rule, texels, index, centres):
    """Centres from their members by the rule: the lower median, or the mean."""
    fresh = centres.copy()
    for cluster in range(len(centres)):
        members = texels[:, index == cluster]
        count = members.shape[1]
        if count and rule == "median":
            fresh[cluster] = np.sort(members, axis=1)[:, (count - 1) // 2]
        elif count:
            fresh[cluster] = np.rint(members.mean(axis=1))
    return fresh


def clusters(report, store, measured, texels):
    stage = store.attributes["stages"]["cluster"]
    centres, index = store.read("centres"), store.read("index").ravel()
    weights = np.cos(store.read("view_direction")[:, 0])
    total = weights.sum() * texels.shape[2]
    to_centre = distances(texels, centres, weights)
    own = np.take_along_axis(to_centre, index[:, None].astype(int), axis=1)[:, 0]
    report.none("index is the nearest centre by (1)", own > to_centre.min(axis=1) * (1 + TIE))

    objective = own.mean() / total
    recorded = stage["report"]["passes"][-1]["mean_lightness_error"]
    report.at_most("objective recorded", abs(recorded - objective), 1e-3, f", {objective:.4f} mean weighted |dL*|")
    rule = stage["recipe"]["centre"]
    fresh = updated(rule, texels, index, centres)
    gain = 1 - from_own(texels, index, fresh, weights) / own.sum()
    same = np.mean([np.array_equal(a, b) for a, b in zip(fresh, centres)])
    report.at_most(f"gain of another {rule} update", gain, 0.005, f", {same:.0%} of the centres would stay")
    representatives(report, store, measured, texels, to_centre, weights)


def representatives(report, store, measured, texels, to_centre, weights):
    source = store.read("tile_source").astype(int)
    place = store.read("representative_texel").astype(int)
    width = measured.array("luminance").shape[2]
    numbers = {number: texel for texel, number in reversed(list(enumerate(source.reshape(-1, 2) @ (width, 1))))}
    texel = np.array([numbers.get(number, -1) for number in place @ (width, 1)])
    report.none("representatives lie in the tile", texel < 0)
    chosen = to_centre[texel, np.arange(len(place))]
    report.none("representative is the texel nearest to its centre", chosen > to_centre.min(axis=0) * (1 + TIE))

    stored, reflectance = store.read("representatives"), measured.array("reflectance")
    wrong = np.zeros(len(place), dtype=bool)
    for view in range(reflectance.shape[0]):
        samples = reflectance[view][place[:, 0], place[:, 1]]
        wrong |= (samples != stored[:, view]).reshape(len(place), -1).any(axis=1)
    report.none("representatives are measured BRDFs, sample by sample", wrong)

    by_view = tile.codes(measured, place)
    codes = by_view.transpose(1, 0, 2)
    expected = distances(by_view, codes, weights)
    got = store.read("distance").astype(float)
    report.at_most("D of (26)", np.max(np.abs(got - expected) / np.maximum(expected, 1e-9)), 1e-4, " relative")
    symmetric = np.array_equal(got, got.T) and not got.diagonal().any()
    report.check("D is symmetric, its diagonal zero", symmetric, got.shape)
    index = store.read("index").ravel()
    total = weights.sum() * texels.shape[2]
    error = from_own(texels, index, codes, weights)
    recorded = store.attributes["stages"]["cluster"]["report"]["representative_lightness_error"]
    report.at_most("error from representatives recorded", abs(recorded - error / total / index.size), 1e-3,
                   f", {recorded:.4f} mean weighted |dL*|")
