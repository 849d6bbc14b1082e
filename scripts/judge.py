"""Judges btfkit's stores without btfkit: reads them with zarr-python and re-derives them with numpy.

    python scripts/judge.py --measurement M.zarr --model X.model.zarr --enlarged E.zarr [--archive SAMPLE.zip]
        [--image [SOURCE=]PICTURE.png --light THETA,PHI --view THETA,PHI]...

Prints one line per check and exits with 1 if any failed. SOURCE (measurement, model or enlarged) is needed only where
two of the stores have the size of the picture. Needs zarr 3, xarray, numpy and pillow.
"""

import argparse
import sys

from judge import Report, Store, clusters, directions, enlarged, field, layout, measurement, normals, opened, picture, tile


def pair(text):
    theta, phi = text.split(",")
    return float(theta), float(phi)


def arguments():
    parser = argparse.ArgumentParser(description="Judges stores of btfkit by the paper's equations.")
    for name in ("measurement", "model", "enlarged"):
        parser.add_argument(f"--{name}", required=True, metavar="STORE")
    parser.add_argument("--archive", metavar="ZIP", help="what the measurement was imported from")
    parser.add_argument("--image", action="append", default=[], metavar="[SOURCE=]PNG", help="a picture of a store")
    for name in ("light", "view"):
        parser.add_argument(f"--{name}", action="append", default=[], type=pair, metavar="THETA,PHI",
                            help="one a picture, degrees")
    given = parser.parse_args()
    if not len(given.image) == len(given.light) == len(given.view):
        parser.error("every --image needs a --light and a --view")
    return given


def judge(report, given):
    stores = {name: Store(name, getattr(given, name)) for name in ("measurement", "model", "enlarged")}
    measured, modelled, grown = stores.values()
    report.topic(layout.measurement, measured)
    report.topic(layout.model, modelled, measured)
    report.topic(layout.enlarged, grown, modelled)
    for store in stores.values():
        report.topic(opened.opened, store)
    report.topic(opened.selected, measured)
    if given.archive:
        report.topic(measurement.archive, measured, given.archive)
    report.topic(measurement.luminance, measured)
    codes = tile.codes(measured, modelled.read("tile_source"))
    report.topic(tile.tile, modelled, measured, codes)
    report.topic(clusters.clusters, modelled, measured, codes)
    report.topic(normals.normals, modelled, measured)
    report.topic(field.field, modelled)
    for name in ("view", "light"):
        report.topic(directions.triangles, modelled, name)
    report.topic(enlarged.enlarged, grown, modelled)
    for shown in zip(given.image, given.light, given.view):
        report.topic(picture.picture, stores, *shown)


def main():
    given = arguments()
    report = Report()
    try:
        judge(report, given)
    except Exception as error:
        report.check("stores", False, f"could not be read: {type(error).__name__}: {error}")
    print(f"{report.checks} checks, {report.failures} failed")
    return 1 if report.failures else 0


if __name__ == "__main__":
    sys.exit(main())
