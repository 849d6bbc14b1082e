"""Pictures of a measurement, a model's tile or an enlarged index against (27)."""

import numpy as np
from PIL import Image

from judge import color, directions


def measured_number(known, target):
    """Number of the measured direction that the target is, if any."""
    off = np.abs(known - target).max(axis=1)
    return int(np.argmin(off)) if off.min() < 1e-9 else None


def samples(stores, source, view, light):
    """Stored samples [y, x, channel] under one measured pair."""
    if source == "measurement":
        return stores["measurement"].array("reflectance")[view, :, :, light, :]
    return stores["model"].array("representatives")[:, view, light, :][stores[source].read("index").astype(int)]


def source_of(stores, shape):
    """The store whose plane has the size of a picture, if there is only one."""
    planes = {"measurement": stores["measurement"].array("luminance").shape[1:3],
              "model": stores["model"].array("index").shape, "enlarged": stores["enlarged"].array("index").shape}
    fitting = [name for name, plane in planes.items() if plane == shape]
    if len(fitting) != 1:
        raise ValueError(f"a picture of {shape} could be of {fitting}; name its source before the file: model=FILE")
    return fitting[0]


def picture(report, stores, name, light, view):
    """An 8-bit picture: the stored samples at a measured pair, else the barycentric mix in linear light."""
    source, _, file = name.rpartition("=")
    got = np.asarray(Image.open(file).convert("RGB")).astype(int)
    source = source or source_of(stores, got.shape[:2])
    model = stores["model"]
    light, view = np.radians(light), np.radians(view)
    known = {kind: model.read(f"{kind}_direction") for kind in ("view", "light")}
    v, i = measured_number(known["view"], view), measured_number(known["light"], light)
    transfer = stores["measurement"].attributes["transfer"]
    title = f"picture of the {source}, light {np.degrees(light).round(3)}, view {np.degrees(view).round(3)}"
    if v is not None and i is not None:
        stored = samples(stores, source, v, i)
        expected = stored if transfer == "srgb" else color.display(color.linear(stored, transfer))
        report.none(f"{title}: stored samples", (got != expected).any(axis=-1))
        return
    lit, ratio = directions.mix(known["light"], model.read("light_triangles").astype(int), light)
    seen, _ = directions.mix(known["view"], model.read("view_triangles").astype(int), view)
    total = sum(seen[v] * lit[i] * ratio * color.linear(samples(stores, source, v, i), transfer)
                for v in np.flatnonzero(seen) for i in np.flatnonzero(lit))
    report.at_most(f"{title}: mix", np.abs(got - color.display(total).astype(int)).max(), 1, " levels of 255")
