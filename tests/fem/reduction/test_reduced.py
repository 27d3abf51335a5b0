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


SPOILT = {
    "one row more": lambda array: np.concatenate([array, array[:1]]),
    "no rows": lambda array: array[:0],
    "one axis more": lambda array: array[None],
    "text": lambda array: array.astype(str),
    "not a number": lambda array: np.where(np.arange(array.size).reshape(array.shape) == 1, np.nan, array),
    "infinite": lambda array: np.where(np.arange(array.size).reshape(array.shape) == 1, np.inf, array),
    "complex": lambda array: array * 1j,
}


@pytest.mark.parametrize("spoil", SPOILT.values(), ids=SPOILT)
def test_an_array_that_does_not_fit_is_refused_and_named(coarse, tmp_path, spoil):
    path, arrays = tmp_path / "finger.npz", coarse.to_arrays(tangential=True)
    for name in arrays.keys() - {"meta"}:
        np.savez(path, **{**arrays, name: spoil(arrays[name])})
        if spoil is SPOILT["one row more"] and name in ("patch_triangles", "patch_images", "layers"):
            continue  # As many as there are
        refused(path, FileFormatError, rf"finger.npz is not a reduced finger: .*({name}|shape)")


OUT_OF_RANGE = {
    "patch_triangles": lambda array: array + len(array) + 1000,
    "patch_images": lambda array: array * 2,
    "patch_mass": lambda array: 3 * array,
    "layers": lambda array: -array,
    "compliance": lambda array: -array,
    "half_space": lambda array: np.triu(array),
}


@pytest.mark.parametrize("name", OUT_OF_RANGE)
def test_numbers_out_of_range_are_refused(coarse, tmp_path, name):
    arrays = coarse.to_arrays()
    np.savez(tmp_path / "finger.npz", **{**arrays, name: OUT_OF_RANGE[name](arrays[name])})
    refused(tmp_path / "finger.npz", FileFormatError, f"is not a reduced finger: {name} must")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("mesh_size_mm", 0.0), ("mesh_size_mm", "0.7"), ("outer_modulus", math.nan), ("at", [0.0]), ("at", [0.0, "x"]),
        ("gauge_names", []), ("gauge_names", [1]), ("gauge_names", "g"), ("finger_name", None), ("facets", -1.0),
        ("bench", {"thickness": -1.0}), ("bench", {"friction": {}}), ("bench", 3), ("more", 1), ("element", 5),
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
