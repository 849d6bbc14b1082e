"""The random field: mean, Karhunen-Loeve transform (14), pyramid (4), (5), and the estimates (10)-(12), (20)-(22)."""

import numpy as np

from judge import relative

BINOMIAL = np.array([1, 4, 6, 4, 1]) / 16


def inside(places, length, wraps):
    """Places along an axis brought inside it, by wrapping or by mirroring at its first and last sample."""
    if wraps:
        return places % length
    places = np.abs(places) % max(2 * (length - 1), 1)
    return np.minimum(places, 2 * (length - 1) - places)


def reduced(data, axis, wraps):
    """Filtered by the binomial, every second sample kept."""
    length = data.shape[axis]
    even = np.arange(0, length, 2)
    return sum(w * np.take(data, inside(even + i, length, wraps), axis) for i, w in zip(range(-2, 3), BINOMIAL))


def expanded(data, axis, length, wraps):
    """Spread on even places and filtered by the binomial doubled.

    Beyond its border the coarse level continues as any level does, so that every fine sample gets weights of sum 1.
    """
    coarse = data.shape[axis]
    beyond = np.take(data, inside(np.arange(-1, coarse + 1), coarse, wraps), axis)
    spread = np.insert(beyond, np.arange(1, coarse + 3), 0.0, axis)
    places = 2 + np.arange(length)
    return sum(2 * w * np.take(spread, places + i, axis) for i, w in zip(range(-2, 3), BINOMIAL))


def laplacian(data, levels, wraps):
    """Band-pass levels of [y, x, channel], the finest first, the last one low-pass."""
    bands = []
    for _ in range(levels - 1):
        coarse = reduced(reduced(data, 0, wraps), 1, wraps)
        bands.append(data - expanded(expanded(coarse, 0, data.shape[0], wraps), 1, data.shape[1], wraps))
        data = coarse
    return bands + [data]


def stacked(band, sites, wraps):
    """Y_r and X_r of all positions that count: all that wrap, else those whose neighbours all lie inside."""
    height, width, channels = band.shape
    top, side = (0, 0) if wraps else np.abs(sites).max(axis=0)
    rows, columns = np.mgrid[top:height, side:width - side]
    neighbours = [band[(rows - dy) % height, (columns - dx) % width] for dy, dx in sites]
    return band[rows, columns].reshape(-1, channels), np.concatenate(neighbours, axis=-1).reshape(rows.size, -1)


def estimate(y, x, prior):
    """Gamma of (10) and Sigma of (11); the latter by (12) in the form that holds for any Gamma."""
    xx = x.T @ x + prior["prior_v_xx"] * np.eye(x.shape[1])
    yy = y.T @ y + prior["prior_v_yy"] * np.eye(y.shape[1])
    xy = x.T @ y
    gamma = np.linalg.solve(xx, xy).T

    def sigma(g):
        return (yy - g @ xy - xy.T @ g.T + g @ xx @ g.T) / (prior["prior_beta"] + len(y))

    return gamma, sigma


def was_damped(level):
    """Whether even the smallest neighbourhood, the one taken, was not stable as estimated."""
    return f"{level['eta']} neighbours have radius" in (level["note"] or "")


def check_level(report, store, k, level, band, flat, wraps):
    report.equal(f"level {k} size", tuple(level["size"]), band.shape[:2])
    report.check(f"level {k} is stable", 0 <= level["radius"] < 1, f"radius {level['radius']:.4f}")
    sites = store.read(f"mrf/level_{k}/neighbourhood")
    causal = (sites[:, 0] > 0) | ((sites[:, 0] == 0) & (sites[:, 1] > 0))
    report.check(f"level {k} neighbourhood is causal", causal.all() and len(np.unique(sites, axis=0)) == len(sites),
                 f"{len(sites)} sites")
    band = band - band.mean(axis=(0, 1))
    gamma, sigma = store.read(f"mrf/level_{k}/gamma"), store.read(f"mrf/level_{k}/sigma")
    parts = [band[:, :, c:c + 1] for c in range(3)] if flat else [band]
    off_gamma, off_sigma, shrunk = [], [], []
    for c, part in enumerate(parts):
        expected, covariance = estimate(*stacked(part, sites, wraps), level)
        got = gamma[c:c + 1] if flat else gamma
        scale = np.sum(got * expected) / np.sum(expected**2) if was_damped(level) else 1.0
        shrunk.append(scale)
        off_gamma.append(relative(got, scale * expected))
        off_sigma.append(relative(sigma[c:c + 1, None] if flat else sigma, covariance(scale * expected)))
    remark = f" relative, {'damped' if was_damped(level) else level['note'] or 'as estimated'}"
    report.at_most(f"level {k} gamma by {'(20)' if flat else '(10)'}", max(off_gamma), 1e-6, remark)
    report.at_most(f"level {k} sigma by {'(21)' if flat else '(11)'}", max(off_sigma), 1e-6, remark)
    if was_damped(level):
        report.check(f"level {k} damping", all(0 < s < 1 for s in shrunk), np.round(shrunk, 6))


def transform(report, matrix, centred):
    """T of (15): orthonormal rows that diagonalise (14), largest eigenvalue first."""
    report.at_most("T is orthonormal", np.abs(matrix @ matrix.T - np.eye(3)).max(), 1e-9)
    flat = centred.reshape(-1, 3)
    moments = matrix @ (flat.T @ flat / len(flat)) @ matrix.T
    variances = moments.diagonal()
    report.at_most("T diagonalises (14)", np.abs(moments - np.diag(variances)).max() / variances.sum(), 1e-9)
    report.check("T begins with the largest eigenvalue", (np.diff(variances) <= 0).all(), variances)


def field(report, store):
    normals = store.read("normals").astype(float)
    mean = store.read("mrf/mean")
    report.at_most("mean of the field", np.abs(mean - normals.mean(axis=(0, 1))).max(), 1e-9)
    fit = store.attributes["stages"]["fit"]["report"]
    wraps = store.attributes["stages"]["tile"]["report"]["wraps"]
    data, flat = normals - mean, fit["mrf"] == "2d"
    if flat:
        matrix = store.read("mrf/transform")
        transform(report, matrix, data)
        data = data @ matrix.T
    for k, band in enumerate(laplacian(data, len(fit["levels"]), wraps)):
        check_level(report, store, k, fit["levels"][k], band, flat, wraps)
