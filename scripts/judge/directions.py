"""Triangles of directions: spherical Delaunay, and the barycentric mix of a direction."""

import numpy as np

from judge import vectors

NADIR = np.array([0.0, 0.0, -1.0])


def border_edges(triangles):
    """Edges that one triangle has alone, and how many triangles the most shared edge has."""
    edges = np.sort(np.concatenate([triangles[:, pair] for pair in ((0, 1), (1, 2), (2, 0))]), axis=1)
    edges, shared = np.unique(edges, axis=0, return_counts=True)
    return edges[shared == 1], int(shared.max())


def triangles(report, store, name):
    points = vectors(store.read(f"{name}_direction"))
    corners = store.read(f"{name}_triangles").astype(int)
    if not len(corners):
        # Directions on one great circle (one or two always are) enclose nothing.
        report.check(f"{name}s need no triangles", np.linalg.matrix_rank(points, tol=1e-6) < 3, f"{len(points)} of them")
        return
    a, b, c = (points[corners[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    area = np.linalg.norm(normals, axis=1, keepdims=True)
    # The cap of a triangle is the side of its plane away from the nadir (beyond a border it may lean over).
    towards_nadir = np.sum(normals * (NADIR - a), axis=1, keepdims=True) > 0
    normals *= np.where(towards_nadir, -1, 1) / np.maximum(area, 1e-300)
    inside = points @ normals.T - np.sum(normals * a, axis=1)
    report.at_most(f"{name} triangles are Delaunay", inside.max(), 1e-9, ", height of a direction above one")
    report.check(f"{name} triangles have an area", area.min() > 1e-6, f"least {area.min():.3g}")
    report.none(f"{name}s in no triangle", ~np.isin(np.arange(len(points)), corners))
    border, shared = border_edges(corners)
    # One closed border through h directions: t = 2 n - 2 - h.
    report.equal(f"{name} triangles by Euler", (len(corners), shared), (2 * len(points) - 2 - len(border), 2))
    closed = (np.unique(border, return_counts=True)[1] == 2).all()
    report.check(f"{name} border is closed", closed, f"{len(border)} edges")
    # A cap that holds the nadir as well is no triangle of the hemisphere; any other is, so none lies beyond a border.
    a, b = points[border].transpose(1, 0, 2)
    side = np.cross(a - NADIR, b - NADIR) @ (points - NADIR).T
    report.none(f"{name}s beyond a border edge", (side > 1e-9).any(axis=1) & (side < -1e-9).any(axis=1))


def mix(directions, corners, target):
    """Weights [n] of the directions that stand for (theta, phi), and the factor beyond the outer ring (of lights)."""
    points = vectors(directions)
    goal = vectors([target])[0]
    solved = goal @ np.linalg.inv(points[corners])
    within = np.argmax(solved.min(axis=1))
    weights = np.zeros(len(points))
    if solved[within].min() > -1e-9:
        weights[corners[within]] = solved[within].clip(0) / solved[within].clip(0).sum()
        return weights, 1.0
    border, _ = border_edges(corners)
    meridian = np.array([np.cos(target[1]), np.sin(target[1]), 0])
    for edge in border:
        normal = np.cross(*points[edge])
        theta = np.arctan2(-normal[2], normal @ meridian) % np.pi
        ring = vectors([(theta, target[1])])[0]
        share = np.linalg.lstsq(points[edge].T, ring, rcond=None)[0]
        if share.min() > -1e-9 and theta < np.pi / 2:
            weights[edge] = share / share.sum()
            return weights, np.cos(target[0]) / np.cos(theta)
    raise ValueError(f"no triangle and no border edge at {np.degrees(target)}")
