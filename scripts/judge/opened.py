"""What xarray makes of a store: it opens by one read and without a warning, and is selected from by angles."""

import warnings

import numpy as np
import xarray

# zarr-python says this of a codec that it brings itself; the stock chain of a measurement has it.
OWN_CODECS = "Numcodecs codecs are not in the Zarr version 3 specification"


def opened(report, store):
    """Opens the store and all its groups as a user would, warnings being errors, and loads what is small."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        if store.kind == "measurement":
            warnings.filterwarnings("ignore", message=OWN_CODECS)
        data = xarray.open_zarr(store.path)
        tree = xarray.open_datatree(store.path, engine="zarr")
        for node in tree.subtree:
            for name, array in node.to_dataset().data_vars.items():
                if array.nbytes < 1 << 26:
                    array.load()
    report.check(f"xarray opens the {store.kind}", len(data.data_vars) > 0, f"{dict(data.sizes)}")
    consolidated = store.group.metadata.consolidated_metadata
    report.check(f"metadata of the {store.kind} in one place", consolidated is not None and len(consolidated.metadata) > 0,
                 f"{len(consolidated.metadata) if consolidated else 0} arrays and groups")
    if store.kind == "enlarged":
        return
    angles = {f"{name}_{angle}" for name in ("view", "light") for angle in ("theta", "phi")}
    report.equal(f"angle coordinates of the {store.kind}", angles - set(data.coords), set())
    for name in ("view", "light"):
        known = np.degrees(store.read(f"{name}_direction"))
        kept = np.stack([data[f"{name}_theta"], data[f"{name}_phi"]], axis=1)
        report.at_most(f"{name} coordinates are the directions, degrees", np.abs(known - kept).max(), 1e-9)


def selected(report, store):
    """Selects an image by its angles, and views by a condition."""
    data = xarray.open_zarr(store.path)
    view, light = data.sizes["view"] // 2, data.sizes["light"] // 3
    angles = {f"{name}_{angle}": float(data[f"{name}_{angle}"][at])
              for name, at in (("view", view), ("light", light)) for angle in ("theta", "phi")}
    indexed = data.set_xindex(["view_theta", "view_phi"]).set_xindex(["light_theta", "light_phi"])
    got = indexed.reflectance.sel(angles).values.squeeze()
    expected = data.reflectance.isel(view=view, light=light).values.squeeze()
    report.check("an image selected by its angles", np.array_equal(got, expected), angles)
    steep = data.reflectance.sel(view=data.view_theta > 30)
    report.equal("views selected by a condition", steep.sizes["view"], int((data.view_theta > 30).sum()))
