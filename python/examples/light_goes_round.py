# %% How one place of a material changes while the light goes round it
#
#     python light_goes_round.py MODEL
import sys

import numpy as np

import btfkit

model = btfkit.Model(sys.argv[1])

# %% The middle of the tile, seen from above, under 24 lights at 60 degrees from the normal
height, width = model.shape
phi = np.arange(0.0, 360.0, 15.0)
lights = np.column_stack([np.full_like(phi, 60.0), phi])
points = np.tile([width / 2, height / 2], (len(phi), 1))
colors = model.value(points, np.array([0.0, 0.0]), lights)

# %% A bar for each light: what is oriented gets two maxima
green = colors[:, 1]
for angle, value in zip(phi, green, strict=True):
    print(f"{angle:5.0f} degrees {value:.4f} " + "#" * round(60 * value / green.max()))
