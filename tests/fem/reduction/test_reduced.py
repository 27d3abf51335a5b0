"""`ReducedFinger` on disk: bit for bit, whole or not at all, and nothing else accepted."""

import json
import math
import warnings
from dataclasses import fields

import numpy as np
import pytest

from papilla.core.errors import FileAccessError, FileFormatError
from papilla.fem import ReducedFinger, press
from papilla.fem.reduction.patch import Patch
from papilla.model.specimen import Block


@pytest.fixture
def saved(coarse, tmp_path):
    """The coarse finger in a file."""
    coarse.save(tmp_path / "finger.npz")
    return tmp_path / "finger.npz"


def test_saved_and_loaded_is_the_same_to_the_bit(coarse, saved):
    loaded = ReducedFinger.load(saved)
    for item in fields(ReducedFinger):
        if item.name in ("patch", "tangential_source"):
            continue
        before, after = getattr(coarse, item.name), getattr(loaded, item.name)
        assert type(before) is type(after) and np.array_equal(before, after), item.name
    for item in fields(Patch):
        before, after = getattr(coarse.patch, item.name), getattr(loaded.patch, item.name)
        assert before.dtype == after.dtype and np.array_equal(before, after), item.name
    first, second = (press(which, Block(0.5, 10), force=0.3) for which in (coarse, loaded))
    assert (first.reading == second.reading).all() and first.indentation == second.indentation


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


@pytest.mark.parametrize("content", [b"", b"hello", b"\x80\x04]\x94.", b"PK\x03\x04 not a zip"])
def test_a_foreign_file_is_refused(tmp_path, content):
    path = tmp_path / "finger.npz"
    path.write_bytes(content)
    refused(path, FileFormatError, "reduced finger .*finger.npz is no file of arrays")


def test_an_npz_of_something_else_is_refused(tmp_path, coarse):
    path = tmp_path / "finger.npz"
    np.savez(path, x=np.arange(3))
    refused(path, FileFormatError, "not a complete file")
    arrays = coarse.to_arrays()
    np.savez(path, **{name: array for name, array in arrays.items() if name != "compliance"})
    refused(path, FileFormatError, "not a complete file.*compliance")
    meta = json.loads(str(arrays["meta"])) | {"schema": "papilla.reduced/2"}
    np.savez(path, **{**arrays, "meta": np.array(json.dumps(meta))})
    refused(path, FileFormatError, "the schema is not papilla.reduced/3")
    np.savez(path, **{**arrays, "weights": np.array([1.0, None, 1.0, 1.0, 1.0], dtype=object)})
    refused(path, FileFormatError, "finger.npz is no file of arrays.*allow_pickle=False")
    for meta in ({"schema": "papilla.reduced/3"}, {"name": 1}, [], 3, None):
        np.savez(path, **{**arrays, "meta": np.array(json.dumps(meta))})
        refused(path, FileFormatError, "the schema is not papilla.reduced/3|key finger_name is missing")
    np.savez(path, **{**arrays, "meta": np.array("{")})
    refused(path, FileFormatError, "meta was cut short")
    np.save(tmp_path / "plain.npy", np.arange(3))
    refused(tmp_path / "plain.npy", FileFormatError, "is no file of arrays")


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
    (tmp_path / "file").write_text("")
    with pytest.raises(FileAccessError, match="cannot write .*: Not a directory"):
        coarse.save(tmp_path / "file" / "finger.npz")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["file"]
