"""What lies on disk: arrays with shape, type, dimension names, chunks and shards; attributes."""

import numpy as np

SHARD_BYTES = 256 << 20
WITH_UNITS = {"reflectance", "luminance", "view_direction", "light_direction", "distance",
              "view_theta", "view_phi", "light_theta", "light_phi"}


def arrays(report, store, expected):
    """Checks {name: (shape, type, dimension names)}, and that every shard is there and nothing beside them."""
    unfinished = []
    for name, (shape, dtype, dimensions) in expected.items():
        found = store.array(name)
        got = (found.shape, found.dtype.name, found.metadata.dimension_names, found.metadata.zarr_format)
        report.equal(f"layout of {store.kind} {name}", got, (tuple(shape), dtype, tuple(dimensions.split()), 3))
        if name in WITH_UNITS:
            report.check(f"units of {store.kind} {name}", bool(found.attrs.get("units")), found.attrs.get("units"))
        shards = np.prod(-(-np.array(found.shape) // (found.shards or found.chunks)))
        if sum(file.is_file() for file in (store.path / name / "c").rglob("*")) != shards:
            unfinished.append(name)
    report.equal(f"arrays of the {store.kind} with shards missing or files left over", unfinished, [])


def attributes(report, store):
    got = [store.attributes.get(name) for name in ("kind", "format")]
    report.equal(f"attributes of the {store.kind}", got, [store.kind, 2])
    report.check(f"version of the {store.kind}", bool(store.attributes.get("version")), store.attributes.get("version"))


def sharded(report, found):
    """Chunks of 16 x 16 texels, whole along the later axes, in shards of one view as large as their limit allows."""
    rest = found.shape[3:]
    report.equal(f"chunks of {found.basename}", found.chunks, (1, 16, 16, *rest))
    shard = found.shards
    raw = found.dtype.itemsize * int(np.prod(shard))
    covers = all(s >= n or (s % 16 == 0 and 4 * raw > SHARD_BYTES) for s, n in zip(shard[1:3], found.shape[1:3]))
    fits = shard[0] == 1 and shard[3:] == rest and covers and raw <= SHARD_BYTES
    report.check(f"shards of {found.basename}", fits, f"{shard}, {raw / 2**20:.1f} MiB raw")


def direction_arrays(views, lights):
    arrays = {}
    for name, count in (("view", views), ("light", lights)):
        arrays[f"{name}_direction"] = ((count, 2), "float64", f"{name} angle")
        arrays[f"{name}_theta"] = arrays[f"{name}_phi"] = ((count,), "float64", name)
    return arrays


def measurement(report, store):
    attributes(report, store)
    report.equal("recipe of the measurement", store.attributes["recipe"]["stage"], "import")
    radiometry, transfer = store.attributes["radiometry"], store.attributes["transfer"]
    report.check("radiometry", "cosine" in radiometry and transfer in ("srgb", "linear"), f"{radiometry}; {transfer}")
    shape = store.array("reflectance").shape
    arrays(report, store, {
        "reflectance": (shape, "uint8", "view y x light channel"),
        "luminance": (shape[:4], "uint8", "view y x light"),
        **direction_arrays(shape[0], shape[3]),
    })
    sharded(report, store.array("reflectance"))
    sharded(report, store.array("luminance"))


def model(report, store, measured):
    attributes(report, store)
    stages = store.attributes["stages"]
    digests = [
        (stages["tile"]["recipe"]["measurement"], measured.attributes["digest"]),
        (stages["cluster"]["recipe"]["tile"], stages["tile"]["digest"]),
        (stages["normals"]["recipe"]["tile"], stages["tile"]["digest"]),
        (stages["fit"]["recipe"]["normals"], stages["normals"]["digest"]),
    ]
    report.none("digests of inputs", [named != actual for named, actual in digests])
    seeds = [stages[stage]["recipe"].get("seed") for stage in ("tile", "cluster")]
    report.check("seeds recorded", None not in seeds, seeds)
    views, _, _, lights, channels = measured.array("reflectance").shape
    clusters = stages["cluster"]["report"]["clusters"]
    height, width = stages["tile"]["report"]["size"]
    arrays(report, store, {
        "tile_source": ((height, width, 2), "uint32", "y x row_column"),
        "index": ((height, width), "uint8" if clusters <= 256 else "uint16", "y x"),
        "normals": ((height, width, 3), "float32", "y x xyz"),
        "centres": ((clusters, views, lights), "uint8", "cluster view light"),
        "representatives": ((clusters, views, lights, channels), "uint8", "cluster view light channel"),
        "representative_texel": ((clusters, 2), "uint32", "cluster row_column"),
        "distance": ((clusters, clusters), "float32", "cluster cluster_other"),
        **{f"{name}_triangles": (store.array(f"{name}_triangles").shape[:1] + (3,), "uint16", f"{name}_triangle corner")
           for name in ("view", "light")},
        **direction_arrays(views, lights),
        **field_arrays(stages["fit"]["report"]),
    })
    appearance(report, store)
    names = {name for name, _ in store.group["mrf"].groups()}
    report.equal("levels on disk", sorted(names), [f"level_{k}" for k in range(len(stages["fit"]["report"]["levels"]))])
    for name in ("view", "light"):
        known = store.read(f"{name}_direction")
        report.check(f"{name}s are the measurement's", np.array_equal(known, measured.read(f"{name}_direction")),
                     len(known))


def appearance(report, store):
    """The arrays under `appearance/`, and what the report says of levels."""
    stage = store.attributes["stages"]["appearance"]["report"]
    clusters, levels = store.array("distance").shape[0], stage["levels"]
    _, _, height, width = stage["exemplar"]
    report.equal("levels of the appearance", len(levels), max(1, min(height, width) // 4).bit_length())
    expected = {"appearance/features": ((clusters, 8), "int8", "cluster feature")}
    for k, level in enumerate(levels):
        dims = 8 if k + 2 >= len(levels) else 4
        report.equal(f"spacing and dimensions of level {k}", (level["spacing"], level["dims"]), (1 << k, dims))
        expected[f"appearance/level_{k}/basis"] = ((72, dims), "int16", "input dim")
        expected[f"appearance/level_{k}/offset"] = ((dims,), "int32", "dim")
    arrays(report, store, expected)


def field_arrays(fit):
    """The arrays under `mrf/`."""
    flat, c = fit["mrf"] == "2d", 2 if fit["field"] == "slopes" else 3
    square = ((c, c), "float64", "field_channel field_channel_other")
    expected = {
        "mrf/mean": ((c,), "float64", "field_channel"),
        "mrf/covariance": square,
        "mrf/gain": ((len(fit["levels"]),), "float64", "level"),
    }
    if flat:
        expected["mrf/transform"] = ((c, c), "float64", "component field_channel")
    if fit["marginals"]:
        expected["mrf/marginals"] = ((129, 129, 2), "float32", "z1 z2 xy")
    for k, level in enumerate(fit["levels"]):
        eta = level["eta"]
        expected |= {
            f"mrf/level_{k}/neighbourhood": ((eta, 2), "int32", "site dy_dx"),
            f"mrf/level_{k}/gamma": ((c, eta if flat else c * eta), "float64", "field_channel coefficient"),
            f"mrf/level_{k}/sigma": ((c,), "float64", "field_channel") if flat else square,
        }
    return expected


def enlarged(report, store, modelled):
    attributes(report, store)
    recipe = store.attributes["recipe"]
    coherent = recipe.get("rule") == "coherent"
    settings = ("jitter", "source") if coherent else ("candidates",)
    absent = [name for name in ("model", "size", "seed", "tileable", *settings) if recipe.get(name) is None]
    report.equal("absent from the recipe of the enlarged", absent, [])
    kept = "normals" in store.group
    report.equal("normals kept as asked", kept, recipe["keep_normals"])
    arrays(report, store, {"index": (recipe["size"], modelled.array("index").dtype.name, "y x")})
    if kept:
        arrays(report, store, {"normals": ((*recipe["size"], 3), "float32", "y x xyz")})
    if coherent and recipe["source"]:
        arrays(report, store, {"source": (recipe["size"], "uint32", "y x")})
        tile = list(modelled.array("index").shape)
        report.equal("tile that the source counts in", store.array("source").attrs["tile"], tile)
