"""Tests of the package btfkit, as installed: `python python/tests/test_btfkit.py`, or with pytest.

BTF names the program [default: target/release/btf], whose stores and pictures the package's must equal.
"""

import hashlib
import os
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from pathlib import Path

import numpy as np

import btfkit

ROOT = Path(__file__).resolve().parents[2]
BTF = Path(os.environ.get("BTF", ROOT / "target/release/btf")).resolve()
FOLDER = Path(tempfile.mkdtemp())


def btf(*arguments):
    subprocess.run([BTF, "-q", *map(str, arguments)], check=True)


def digest(store):
    """Of all files of a store but its locks."""
    files = sorted(path for path in store.rglob("*") if path.is_file() and not path.name.endswith(".lock"))
    assert files
    return [(path.relative_to(store), hashlib.sha256(path.read_bytes()).hexdigest()) for path in files]


def raises(kind, call, *words):
    try:
        call()
    except kind as error:
        assert all(word in str(error) for word in words), error
        return error
    raise AssertionError(f"expected {kind}")


def make_stores():
    warnings.simplefilter("ignore")
    btf("sample", FOLDER / "wood.zip", "--material", "wood", "--size", "64x48", "--views", "13", "--lights", "19")
    btf("import", FOLDER / "wood.zip", FOLDER / "wood.zarr")
    btf("model", FOLDER / "wood.zarr", FOLDER / "wood.model.zarr", "--clusters", "24")
    btf("enlarge", FOLDER / "wood.model.zarr", FOLDER / "big.zarr", "--size", "200x150", "--seed", "3")
    btf("sample", FOLDER / "large.zip", "--size", "256x256", "--views", "27", "--lights", "27")


def test_stages_make_the_bytes_of_the_program():
    steps = []
    report = btfkit.import_(FOLDER / "wood.zip", FOLDER / "a.zarr", progress=lambda *step: steps.append(step))
    assert report["views_written"] == 13
    assert steps and all(done <= total for _, done, total in steps)
    assert steps[-1][1] == steps[-1][2]
    report = btfkit.model(FOLDER / "a.zarr", FOLDER / "a.model.zarr", clusters=24)
    assert report["clusters"] == 24
    report = btfkit.enlarge(FOLDER / "a.model.zarr", FOLDER / "a.big.zarr", 200, 150, seed=3)
    assert report["written"] > 0
    assert digest(FOLDER / "a.zarr") == digest(FOLDER / "wood.zarr")
    window = (0, 0, 200, 150)
    made, theirs = btfkit.Enlargement(FOLDER / "a.big.zarr"), btfkit.Enlargement(FOLDER / "big.zarr")
    assert np.array_equal(made.window(*window), theirs.window(*window))
    assert np.array_equal(made.source(*window), theirs.source(*window))


def test_a_measurement():
    measurement = btfkit.Measurement(FOLDER / "wood.zarr")
    assert list(measurement.shape) == [13, 48, 64, 19, 3]
    assert measurement.views.shape == (13, 2) and measurement.lights.shape == (19, 2)
    samples = measurement.samples(2)
    assert samples.dtype == np.uint8 and samples.shape == (48, 64, 19, 3)
    assert np.array_equal(measurement.samples(2, (5, 7, 20, 10)), samples[7:17, 5:25])
    # A measured pair of directions is shown as it was measured.
    codes = samples[:, :, 4].astype(np.float64) / 255
    linear = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    shown = measurement.image(tuple(measurement.lights[4]), tuple(measurement.views[2]))
    assert shown.dtype == np.float32 and np.abs(shown - linear).max() < 1e-5
    raises(IndexError, lambda: measurement.samples(13), "0 to 12")
    raises(ValueError, lambda: measurement.samples(0, (60, 0, 5, 5)), "64x48")


def test_values_are_those_of_pictures():
    model = btfkit.Model(FOLDER / "wood.model.zarr")
    height, width = model.shape
    rows, columns = np.mgrid[:height, :width]
    middles = np.column_stack([columns.ravel() + 0.5, rows.ravel() + 0.5])
    for light, view in [((30, 40), (0, 0)), ((62.5, 200), (41, 77)), (tuple(model.lights[7]), tuple(model.views[5]))]:
        picture = model.image(light, view)
        values = model.value(middles, np.array(view, float), np.array(light, float)).reshape(picture.shape)
        assert np.abs(picture - values).max() < 1e-5, (light, view)
    # A vector is the same as its angles, of any length; so are as many as there are points.
    theta, phi = np.radians([62.5, 200])
    vector = 3 * np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    one = model.value(middles, np.array([41.0, 77.0]), np.array([62.5, 200.0]))
    many = model.value(middles, np.tile([41.0, 77.0], (len(middles), 1)), vector)
    assert np.abs(one - many).max() < 1e-6


def test_a_plane_and_an_enlargement_are_the_same_surface():
    model, big = btfkit.Model(FOLDER / "wood.model.zarr"), btfkit.Enlargement(FOLDER / "big.zarr")
    plane = model.plane(seed=3)
    assert big.shape == (150, 200)
    source = plane.window(0, 0, 200, 150)
    assert source.dtype == np.uint32 and np.array_equal(source, big.source(0, 0, 200, 150))
    assert np.array_equal(model.index().reshape(-1)[source], big.window(0, 0, 200, 150))
    assert np.array_equal(plane.window(-40, -30, 60, 50)[30:, 40:], source[:20, :20])
    light, view, window = (50, 10), (20, 200), (30, 20, 64, 32)
    assert np.array_equal(plane.image(window, light, view), big.image(light, view, window))
    points = np.array([[33.25, 21.5], [90.0, 50.0]])
    lights, views = np.array([50.0, 10.0]), np.array([20.0, 200.0])
    assert np.array_equal(plane.value(points, views, lights), big.value(points, views, lights))
    assert not np.array_equal(model.plane(seed=4).window(0, 0, 200, 150), source)


def test_errors_are_of_their_kinds():
    error = raises(btfkit.MissingError, lambda: btfkit.Model(FOLDER / "absent.zarr"), "absent.zarr")
    assert isinstance(error, btfkit.BtfError)
    error = raises(btfkit.InputError, lambda: btfkit.Model(FOLDER / "wood.zarr"), "measurement")
    assert isinstance(error, ValueError)
    error = raises(
        btfkit.RecipeError,
        lambda: btfkit.model(FOLDER / "wood.zarr", FOLDER / "wood.model.zarr", clusters=25),
    )
    assert "force" in error.advice or "name" in error.advice
    raises(btfkit.UsageError, lambda: btfkit.import_(FOLDER / "wood.zip", FOLDER / "m.zarr", memory=1 << 20), "MiB")
    model = btfkit.Model(FOLDER / "wood.model.zarr")
    point, above = np.array([[0.0, 0.0]]), np.array([0.0, 0.0])
    raises(ValueError, lambda: model.value(np.zeros(2), above, above), "[n, 2]")
    raises(ValueError, lambda: model.value(point, np.zeros((3, 2)), above), "views")
    raises(ValueError, lambda: model.value(point, np.array([0.0, 0.0, -1.0]), above), "below")
    raises(ValueError, lambda: model.value(point, above, np.array([95.0, 0.0])), "theta 95")
    raises(ValueError, lambda: model.value(np.array([[np.nan, 0.0]]), above, above), "row 0")
    raises(ValueError, lambda: model.plane().window(0, 0, 0, 5), "0x5")


def test_work_stops_and_goes_on():
    class Enough(Exception):
        pass

    def stop(*_):
        raise Enough

    raises(Enough, lambda: btfkit.import_(FOLDER / "large.zip", FOLDER / "l.zarr", threads=1, progress=stop))
    done = btfkit.Measurement(FOLDER / "l.zarr").views_done if (FOLDER / "l.zarr/zarr.json").exists() else 0
    assert done < 27
    report = btfkit.import_(FOLDER / "large.zip", FOLDER / "l.zarr")
    assert report["views_found"] == done and report["views_found"] + report["views_written"] == 27


def test_ctrl_c_stops_the_work():
    import _thread

    def interrupt():
        time.sleep(0.3)
        _thread.interrupt_main()

    threading.Thread(target=interrupt).start()
    raises(KeyboardInterrupt, lambda: btfkit.import_(FOLDER / "large.zip", FOLDER / "c.zarr", threads=1))
    assert btfkit.Measurement(FOLDER / "c.zarr").views_done < 27


def test_other_threads_of_python_go_on():
    counted, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    btfkit.import_(FOLDER / "large.zip", FOLDER / "t.zarr", threads=1)
    stop.set()
    thread.join()
    assert counted[0] > 20, counted


def test_the_examples_run():
    folder = FOLDER / "example"
    folder.mkdir()
    examples = ROOT / "python/examples"
    for name, arguments, word in [
        ("archive_to_picture.py", [FOLDER / "wood.zip", folder], "64 clusters"),
        ("light_goes_round.py", [FOLDER / "wood.model.zarr"], "345 degrees"),
        ("textures_for_a_renderer.py", [FOLDER / "wood.model.zarr"], "windows fit together: True"),
    ]:
        command = [sys.executable, "-W", "ignore", examples / name, *arguments]
        run = subprocess.run(command, capture_output=True, text=True)
        assert run.returncode == 0 and word in run.stdout, (name, run.stdout, run.stderr)
    assert np.load(folder / "picture.npy").shape == (300, 400, 3)


def test_zarr_finds_the_codec_by_itself():
    import zarr

    btf("import", FOLDER / "wood.zip", FOLDER / "p.zarr", "--codec", "predictive")
    stored = zarr.open(FOLDER / "p.zarr", mode="r")["reflectance"]
    assert np.array_equal(stored[3], btfkit.Measurement(FOLDER / "wood.zarr").samples(3))


make_stores()
if __name__ == "__main__":
    for name, test in list(globals().items()):
        if name.startswith("test_"):
            test()
            print(f"ok  {name}")
