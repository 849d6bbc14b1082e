# %% What a renderer of your own needs: which texel of the tile each texel of a plane is, and colours by directions
#
#     python textures_for_a_renderer.py MODEL
import sys

import numpy as np

import btfkit

model = btfkit.Model(sys.argv[1])
height, width = model.shape

# %% Windows of the plane fit together, wherever they are and in whatever order they are made
plane = model.plane(seed=7)
left, right = plane.window(-128, 0, 128, 128), plane.window(0, 0, 128, 128)
both = plane.window(-128, 0, 256, 128)
print("windows fit together:", np.array_equal(np.hstack([left, right]), both))

# %% Any map of the tile follows: here the clusters, and their colours under one light
index = model.index().reshape(-1)[both]
tile = model.image(light=(30, 45)).reshape(-1, 3)[both]
print("clusters in the window:", len(np.unique(index)), "mean colour:", tile.mean(axis=(0, 1)))

# %% Shading points of a curved object: each has a view and a light of its own
generator = np.random.default_rng(1)
normals = generator.normal(size=(10_000, 3))
normals[:, 2] = np.abs(normals[:, 2]) + 0.1
points = generator.uniform(-1000, 1000, size=(10_000, 2))
colors = plane.value(points, normals, np.array([0.3, 0.2, 0.9]))
print("shaded", len(colors), "points, brightest", colors.max(axis=0))
