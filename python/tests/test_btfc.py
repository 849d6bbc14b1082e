"""Tests of btfc.py against the fixture of the program's own packer: `python python/tests/test_btfc.py`, or with pytest."""

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python"))
import btfc  # noqa: E402

FIXTURES = ROOT / "packed" / "tests" / "fixtures"


def test_the_fixture_is_decoded_to_the_same_numbers():
    model = btfc.read(FIXTURES / "small.btfc")
    assert model.complete and model.size == (10, 14) and model.channels == ["R", "G", "B"]
    assert model.texts == {"licence": "CC0-1.0", "samples": "uint8"}
    parts = [part for k in range(len(model.basis)) for part in (model.basis[k], model.coefficients[k])]
    found = np.concatenate([model.mean.ravel()] + [part.ravel() for part in parts])
    expected = np.fromfile(FIXTURES / "small.f64", "<f8")
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_a_file_with_a_palette_is_decoded_to_the_same_numbers():
    model = btfc.read(FIXTURES / "palette.btfc")
    assert model.complete and model.size == (26, 22) and model.index.max() == 22
    parts = [part for k in range(len(model.basis)) for part in (model.basis[k], model.coefficients[k])]
    found = np.concatenate([model.mean.ravel()] + [part.ravel() for part in parts])
    np.testing.assert_allclose(found, np.fromfile(FIXTURES / "palette.f64", "<f8"), rtol=0, atol=1e-9)


def test_a_part_of_the_file_is_a_coarser_model():
    content = (FIXTURES / "small.btfc").read_bytes()
    whole = btfc.unpack(content)
    end, components, _ = whole.planes[-2]
    part = btfc.unpack(content[: end + 5])
    assert not part.complete and part.planes == whole.planes[:-1] and len(part.basis) == components
    assert 0 < np.abs(part.mean - whole.mean).max() < 20


if __name__ == "__main__":
    for name, test in list(globals().items()):
        if name.startswith("test_"):
            test()
            print(f"{name}: ok")
