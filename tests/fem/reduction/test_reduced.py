"""`ReducedFinger` on disk: bit for bit, whole or not at all, and nothing else accepted."""

import json
import math
import warnings
from dataclasses import fields

import numpy as np
import pytest

from papilla.core.errors import FileAccessError, FileFormatError
from papilla.fem import ReducedFinger
from papilla.fem.reduction.patch import Patch


@pytest.fixture
def saved(coarse, tmp_path):
    """The coarse finger in a file."""
    coarse.save(tmp_path / "finger.npz")
    return tmp_path / "finger.npz"


def test_saved_and_loaded_is_the_same_to_the_bit(coarse, saved):
    loaded = ReducedFinger.load(saved)
    pairs = [(coarse, loaded, ReducedFinger), (coarse.patch, loaded.patch, Patch)]
    for before, after, name in ((a, b, item.name) for a, b, kind in pairs for item in fields(kind)):
        if name not in ("patch", "tangential_source"):
            one, other = getattr(before, name), getattr(after, name)
            assert type(one) is type(other) and np.array_equal(one, other), name


def refused(path, error, message):
    with warnings.catch_warnings(), pytest.raises(error, match=message) as caught:
        warnings.simplefilter("error")
        ReducedFinger.load(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("keep", [0, 10, 0.5, 0.99])
def test_a_truncated_file_is_refused(saved, keep):
    content = saved.read_bytes()
    saved.write_bytes(content[: keep if isinstance(keep, int) else int(keep * len(content))])
    refused(saved, FileFormatError, "reduced finger .*finger.npz is no file of arrays")


def test_an_npz_of_something_else_is_refused(tmp_path, coarse):
    path, arrays = tmp_path / "finger.npz", coarse.to_arrays()
    meta = json.loads(str(arrays["meta"])) | {"schema": "papilla.reduced/2"}
    for content, message in (
        ({"x": np.arange(3)}, "not a complete file"),
        ({name: array for name, array in arrays.items() if name != "compliance"}, "not a complete file.*compliance"),
        ({**arrays, "meta": np.array(json.dumps(meta))}, "the schema is not papilla.reduced/3"),
        ({**arrays, "meta": np.array(json.dumps({"schema": "papilla.reduced/3"}))}, "key finger_name is missing"),
        ({**arrays, "meta": np.array("[]")}, "the schema is not papilla.reduced/3"),
        ({**arrays, "meta": np.array("{")}, "meta was cut short"),
        ({**arrays, "weights": np.array([1.0, None], dtype=object)}, "finger.npz is no file of arrays"),
    ):
        np.savez(path, **content)
        refused(path, FileFormatError, message)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda array: array[:-1] if len(array) != 4 else array[:0],
        lambda array: array[None],
        lambda array: array.astype(str),
        lambda array: np.where(np.arange(array.size).reshape(array.shape) == 1, np.nan, array),
        lambda array: array * 1j,
    ],
    ids=["fewer rows", "one axis more", "text", "not a number", "complex"],
)
def test_an_array_that_does_not_fit_is_refused_and_named(coarse, tmp_path, spoil):
    path, arrays = tmp_path / "finger.npz", coarse.to_arrays(tangential=True)
    for name in arrays.keys() - {"meta", "patch_triangles", "layers"}:
        np.savez(path, **{**arrays, name: spoil(arrays[name])})
        refused(path, FileFormatError, rf"finger.npz is not a reduced finger: .*({name}|shape)")


def test_numbers_out_of_range_are_refused(coarse, tmp_path):
    path, arrays = tmp_path / "finger.npz", coarse.to_arrays()
    for name, factor in {
        "patch_triangles": 1000,
        "patch_images": 2,
        "patch_mass": 3,
        "layers": -1,
        "compliance": -1,
    }.items():
        np.savez(path, **{**arrays, name: factor * arrays[name]})
        refused(path, FileFormatError, f"is not a reduced finger: {name} must")
    np.savez(path, **{**arrays, "half_space": np.triu(arrays["half_space"])})
    refused(path, FileFormatError, "is not a reduced finger: half_space must")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("mesh_size_mm", 0.0), ("mesh_size_mm", "0.7"), ("outer_modulus", math.nan), ("at", [0.0]), ("gauge_names", []),
        ("finger_name", None), ("facets", -1.0), ("bench", {"thickness": -1.0}), ("more", 1), ("element", 5),
    ],
)  # fmt: skip
def test_facts_of_another_kind_are_refused(coarse, tmp_path, key, value):
    arrays = coarse.to_arrays()
    meta = json.loads(str(arrays["meta"])) | {key: value}
    np.savez(tmp_path / "finger.npz", **{**arrays, "meta": np.array(json.dumps(meta))})
    refused(tmp_path / "finger.npz", FileFormatError, f"is not a reduced finger: meta: .*{key}")


def test_a_missing_file_or_folder_is_named(tmp_path, coarse):
    refused(tmp_path / "nowhere.npz", FileAccessError, "cannot read reduced finger .*nowhere.npz: No such file")
    refused(tmp_path, FileAccessError, "cannot read reduced finger .*: Is a directory")
    with pytest.raises(FileAccessError, match="cannot write .*missing.*: No such file"):
        coarse.save(tmp_path / "missing" / "finger.npz")
    assert not list(tmp_path.iterdir())
