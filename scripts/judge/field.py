"""The random field: mean, Karhunen-Loeve transform (14), pyramid (4), (5), the estimates (10)-(12), (20)-(22), and what a
synthesis is told beyond them: gains, covariance, marginals."""

from math import erf

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
    parts = [band[:, :, c:c + 1] for c in range(band.shape[2])] if flat else [band]
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
    report.at_most("T is orthonormal", np.abs(matrix @ matrix.T - np.eye(len(matrix))).max(), 1e-9)
    flat = centred.reshape(-1, len(matrix))
    moments = matrix @ (flat.T @ flat / len(flat)) @ matrix.T
    variances = moments.diagonal()
    report.at_most("T diagonalises (14)", np.abs(moments - np.diag(variances)).max() / variances.sum(), 1e-9)
    report.check("T begins with the largest eigenvalue", (np.diff(variances) <= 0).all(), variances)


def covariance(store, levels, flat, side=1024):
    """Covariance of the sum of all levels at their gains, from their spectra over `side` frequencies along each axis.

    Level k, expanded to the finest lattice, has its spectrum times the product of 4 H(2^j w)^2 over j < k, H the kernel
    [1 4 6 4 1] / 16 in each direction: the power of expansion averaged over the places of a coarse texel.
    """
    gains, w = store.read("mrf/gain"), 2 * np.pi * np.arange(side) / side
    total = 0
    for k in range(levels):
        sites = store.read(f"mrf/level_{k}/neighbourhood")
        gamma, sigma = store.read(f"mrf/level_{k}/gamma"), store.read(f"mrf/level_{k}/sigma") * gains[k] ** 2
        c = len(gamma)
        if flat:
            gamma = (gamma[:, :, None] * np.eye(c)[:, None, :]).reshape(c, -1)
            sigma = np.diag(sigma)
        # Frequencies of the finest lattice that fold onto each of this level's.
        fine = 2 * np.pi * np.arange(side << k) / (side << k)
        power = np.prod([2 * np.cos(fine * 2**j / 2) ** 8 for j in range(k)], axis=0) * np.ones(side << k)
        weight = power.reshape(-1, side).sum(axis=0) / (side << k)
        for row, down in enumerate(w):
            a = np.tile(np.eye(c, dtype=complex), (side, 1, 1))
            for s, (dy, dx) in enumerate(sites):
                a -= np.exp(-1j * (down * dy + w * dx))[:, None, None] * gamma[:, c * s:c * (s + 1)]
            inverse = np.linalg.inv(a)
            spectrum = inverse @ sigma @ inverse.conj().transpose(0, 2, 1)
            total = total + weight[row] * np.einsum("n,nij->ij", weight, spectrum).real
    return total


def quantile(values, place):
    """Linear between the middles of sorted values."""
    position = np.clip(place * len(values) - 0.5, 0, len(values) - 1)
    return np.interp(position, np.arange(len(values)), values)


def marginals(report, store, normals, covariance, kind):
    """The table of (n_x, n_y) over standardised values from -4 to 4."""
    table = store.read("mrf/marginals")
    xy = normals.reshape(-1, 3)[:, :2]
    xy = xy[np.lexsort((xy[:, 1], xy[:, 0]))]
    z = np.arange(129) / 16 - 4
    phi = np.array([0.5 * (1 + erf(value / 2**0.5)) for value in z])
    rho = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    half, count = max(len(xy) // 48, 32), len(xy)
    worst = np.abs(table[:, :, 0] - quantile(xy[:, 0], phi)[:, None]).max()
    for row in range(0, 129, 8):
        if kind == "joint":
            middle = int(phi[row] * count)
            near = np.sort(xy[min(max(middle - half, 0), count - 1):min(middle + half, count), 1])
            expected = quantile(near, phi)
        else:
            mixed = rho * z[row] + np.sqrt(1 - rho**2) * z
            expected = quantile(np.sort(xy[:, 1]), np.array([0.5 * (1 + erf(v / 2**0.5)) for v in mixed]))
        worst = max(worst, np.abs(table[row, :, 1] - expected).max())
    report.at_most(f"table of {kind} marginals", worst, 1e-5)


def field(report, store):
    normals = store.read("normals").astype(float)
    fit = store.attributes["stages"]["fit"]["report"]
    wraps = store.attributes["stages"]["tile"]["report"]["wraps"]
    data, flat = normals, fit["mrf"] == "2d"
    if fit["field"] == "slopes":
        data = normals[:, :, :2] / np.maximum(normals[:, :, 2:], 0.05)
    mean = store.read("mrf/mean")
    report.at_most("mean of the field", np.abs(mean - data.mean(axis=(0, 1))).max(), 1e-9)
    data = data - mean
    matrix = np.eye(len(mean))
    if flat:
        matrix = store.read("mrf/transform")
        transform(report, matrix, data)
        data = data @ matrix.T
    for k, band in enumerate(laplacian(data, len(fit["levels"]), wraps)):
        check_level(report, store, k, fit["levels"][k], band, flat, wraps)
    told = store.read("mrf/covariance")
    expected = matrix.T @ covariance(store, len(fit["levels"]), flat) @ matrix
    report.at_most("covariance of a synthesis", relative(told, expected), 1e-3)
    if fit["marginals"]:
        marginals(report, store, normals, told, fit["marginals"])
