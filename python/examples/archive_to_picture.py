# %% From an archive of photographs to a picture of any size
#
#     python archive_to_picture.py ARCHIVE FOLDER
#
# Writes FOLDER/picture.npy: linear RGB, [y, x, 3].
import sys
from pathlib import Path

import numpy as np

import btfkit

archive, folder = sys.argv[1], Path(sys.argv[2])


# %% Progress is a function; Ctrl-C stops the work, and the same call goes on
def tell(step, done, total):
    print(f"\r{step}: {done} of {total}", end="", flush=True)


btfkit.import_(archive, folder / "material.zarr", progress=tell)
report = btfkit.model(folder / "material.zarr", folder / "material.model.zarr", clusters=64, progress=tell)
print(f"\n{report['clusters']} clusters")

# %% The model holds a small tile; its plane never ends
model = btfkit.Model(folder / "material.model.zarr")
plane = model.plane(seed=1)
picture = plane.image((0, 0, 400, 300), light=(45, 120))
np.save(folder / "picture.npy", picture)
print(model, picture.shape, picture.mean(axis=(0, 1)))
