"""Measured Bidirectional Texture Functions (BTF) as numpy arrays.

A BTF says what a material looks like from every direction, lit from every direction. This package turns an archive of
photographs into a model and the model into textures of any size, and gives their values:

    import btfkit

    btfkit.import_("wood.zip", "wood.zarr")
    btfkit.model("wood.zarr", "wood.model.zarr")

    model = btfkit.Model("wood.model.zarr")
    picture = model.plane(seed=1).image((0, 0, 512, 512), light=(45, 120))     # linear RGB [y, x, 3]
    colors = model.value(points, views, lights)                                # linear RGB [n, 3]

Directions are (theta, phi) in degrees: theta is 0 above the surface and 90 at its horizon, phi turns from the right to
the top of the picture. Windows are (x, y, width, height) in texels. Arrays have rows first.

`value` takes

    points   [n, 2], column and row in texels; (0.5, 0.5) is the middle of the first one. Beyond its border a tile that
             joins repeats.
    views    [n, 2] directions in degrees, or [n, 3] vectors (right, up, out of the surface), or one for all points.
    lights   the same.

and returns the linear RGB that a white light gives; the cosine of the light is part of it. Ask for many points at once:
each call costs some tenths of a millisecond.

`import_`, `model` and `enlarge` take `progress`, a function that is called with the name of the step, how much of it is
done, and how much there is; `threads` (all processors); `memory` in bytes (1 GiB); and `force=True`, which replaces
results that exist. Ctrl-C, or an exception out of `progress`, stops them; the same call goes on where they were. They
return a dictionary, which says how it went. What the archive does not say, and was assumed, comes as a warning.

Errors are `BtfError`, each of its kind; `error.advice` says what to do, where that is known.
"""

from collections.abc import Callable
from os import PathLike, fspath

from . import _btfkit
from ._btfkit import Enlargement, Measurement, Model, Plane
from ._errors import (
    BtfError,
    InputError,
    InternalError,
    IoError,
    MissingError,
    RecipeError,
    StoppedError,
    UsageError,
)

__version__ = _btfkit.VERSION
__all__ = [
    "BtfError",
    "Enlargement",
    "InputError",
    "InternalError",
    "IoError",
    "Measurement",
    "MissingError",
    "Model",
    "Plane",
    "RecipeError",
    "StoppedError",
    "UsageError",
    "enlarge",
    "import_",
    "model",
]

Progress = Callable[[str, int, int], object]


def import_(archive: str | PathLike | list[str | PathLike], measurement: str | PathLike, **options) -> dict:
    """Import an archive (or the parts of one) into a measurement.

    Options: `pattern`, `table` and `order` say where the directions stand, as for `btf import`; `white` is the
    reflectance that counts as white (1.0); and `progress`, `threads`, `memory`, `force`.
    """
    parts = archive if isinstance(archive, list) else [archive]
    return _btfkit.import_([fspath(part) for part in parts], measurement, **options)


def model(measurement: str | PathLike, model: str | PathLike, **options) -> dict:
    """Make a model of a measurement: cut a tile, cluster its texels, and learn what enlarging has to know.

    Options: `clusters` (256), `tile` as (height, width), `seed` (1); and `progress`, `threads`, `memory`, `force`.
    """
    return _btfkit.model(measurement, model, **options)


def enlarge(model: str | PathLike, enlargement: str | PathLike, width: int, height: int, **options) -> dict:
    """Enlarge a model to a stored index of any size, by the coherent rule.

    Options: `seed` (1), `tileable` (False: whether the output joins at its own borders); and `progress`, `threads`,
    `memory`, `force`.
    """
    return _btfkit.enlarge(model, enlargement, width, height, **options)
