"""JPEGs in every arrangement that is read, written by cjpeg and decoded by djpeg (libjpeg), beside what btf imports.

Usage: jpeg_arrangements.py BTF

Scan scripts, sampling factors, restart intervals and sizes, those that are no multiple of a coded unit too. All
arrangements of one size are the lights of one archive. Samplings beyond what is read must be refused.
"""

import itertools
import pathlib
import subprocess
import sys
import tempfile

import numpy
import zarr

SIZES = [(1, 1), (2, 3), (7, 9), (8, 8), (9, 17), (16, 16), (17, 16), (33, 31), (40, 24), (15, 1), (1, 23), (64, 5)]
SAMPLINGS = [
    "1x1", "2x1", "1x2", "2x2", "4x1", "4x2", "1x4", "2x4", "2x1,2x1,2x1", "1x2,1x2,1x2", "3x1,3x1,3x1",
    "2x2,1x2,1x2", "2x2,2x1,2x1", "2x2,2x1,1x2", "2x2,1x1,2x1",
]
REFUSED = ["1x1,2x1,2x1", "1x1,2x2,2x2", "1x1,1x1,2x2", "3x1", "2x1,1x2,1x1"]
SCANS = {
    "interleaved": None,
    "apart": "0;\n1;\n2;\n",
    "apart, chroma first": "2;\n1;\n0;\n",
    "chroma together": "0;\n1,2;\n",
    "chroma together, first": "1,2;\n0;\n",
    "last apart": "0,1;\n2;\n",
    "middle apart": "0,2;\n1;\n",
    "progressive": "",
    "progressive apart": "0:0-0,0,0;\n1:0-0,0,0;\n2:0-0,0,0;\n0:1-63,0,0;\n1:1-63,0,0;\n2:1-63,0,0;\n",
    "progressive mixed": "0:0-0,0,1;\n1,2:0-0,0,0;\n0:1-5,0,2;\n2:1-63,0,1;\n1:1-63,0,1;\n0:6-63,0,2;\n"
    "0:1-63,2,1;\n0:0-0,1,0;\n2:1-63,1,0;\n1:1-63,1,0;\n0:1-63,1,0;\n",
}
RESTARTS = [0, 1, 3]


def picture(width, height, channels):
    """Smooth, and different in every channel: what smoothing of chroma differs by stays small."""
    y, x, c = numpy.mgrid[0:height, 0:width, 0:channels]
    return (128 + 60 * numpy.sin(0.21 * x + c) + 50 * numpy.cos(0.17 * y + 2 * c)).astype(numpy.uint8)


def encoded(work, pixels, sampling, scans, restart, *more):
    """The file, or None where libjpeg itself refuses the arrangement."""
    height, width, channels = pixels.shape
    kind = 6 if channels == 3 else 5
    (work / "in.pnm").write_bytes(f"P{kind}\n{width} {height}\n255\n".encode() + pixels.tobytes())
    command = ["cjpeg", "-quality", "95", "-sample", sampling, *more]
    if scans == "":
        command.append("-progressive")
    elif scans:
        (work / "scans").write_text(scans)
        command += ["-scans", work / "scans"]
    if restart:
        command += ["-restart", f"{restart}B"]
    done = subprocess.run([*command, work / "in.pnm"], capture_output=True)
    return done.stdout if done.returncode == 0 else None


def decoded(work, data, shape):
    (work / "one.jpg").write_bytes(data)
    out = subprocess.run(["djpeg", "-pnm", work / "one.jpg"], capture_output=True, check=True).stdout
    return numpy.frombuffer(out[-numpy.prod(shape) :], numpy.uint8).reshape(shape)


def main(btf):
    total = worst = 0
    for (width, height), channels in itertools.product(SIZES, (3, 1)):
        pixels = picture(width, height, channels)
        with tempfile.TemporaryDirectory() as folder:
            work = pathlib.Path(folder)
            (work / "in").mkdir()
            expected, names = [], []
            samplings = SAMPLINGS if channels == 3 else ["1x1", "2x1", "1x2", "2x2", "3x1", "4x3"]
            scripts = SCANS if channels == 3 else {"interleaved": None, "progressive": ""}
            more = [()] if channels == 3 else [("-grayscale",)]
            more += [("-rgb",)] if channels == 3 else []
            for sampling, (name, scans), restart, extra in itertools.product(samplings, scripts.items(), RESTARTS, more):
                if extra == ("-rgb",) and sampling != "1x1" or sampling.startswith("3x1,") and "progressive" in name:
                    continue
                data = encoded(work, pixels, sampling, scans, restart, *extra)
                if data is not None:
                    (work / "in" / f"{len(names)}.jpg").write_bytes(data)
                    names.append((sampling, name, restart, extra))
                    expected.append(decoded(work, data, pixels.shape))
            lights = "".join(f"{n}.jpg {numpy.cos(0.01 * n)} {numpy.sin(0.01 * n)} 1\n" for n in range(len(names)))
            (work / "in" / "lights.lp").write_text(f"{len(names)}\n{lights}")
            subprocess.run([btf, "-q", "import", work / "in", work / "s.zarr"], check=True)
            found = zarr.open(str(work / "s.zarr"), mode="r")["reflectance"][0]
            for n, (what, right) in enumerate(zip(names, expected)):
                # Lights are sorted by their azimuth, 0.01 n.
                off = numpy.abs(found[:, :, n, :].astype(int) - right)
                # libjpeg does not smooth chroma of one or two columns.
                narrow = width <= 8 and "2" in what[0]
                worst = max(worst, 0 if narrow else off.max())
                assert off.max() <= (40 if narrow else 4), f"{width} x {height}, {what}: off by {off.max()}"
            total += len(names)
    for sampling in REFUSED:
        with tempfile.TemporaryDirectory() as folder:
            work = pathlib.Path(folder)
            (work / "in").mkdir()
            (work / "in" / "tl0 pl0 tv0 pv0.jpg").write_bytes(encoded(work, picture(33, 31, 3), sampling, None, 0))
            done = subprocess.run([btf, "-q", "import", work / "in", work / "s.zarr"], capture_output=True, text=True)
            assert done.returncode == 65 and "sampling factors" in done.stderr, (sampling, done.stderr)
    print(f"{total} JPEGs as libjpeg decodes them, within {worst} levels; {len(REFUSED)} samplings refused")


if __name__ == "__main__":
    main(sys.argv[1])
