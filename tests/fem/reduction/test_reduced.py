"""`ReducedFinger` on disk: bit for bit, whole or not at all, and nothing else accepted."""

import json
import math
import warnings
from dataclasses import dataclass, fields, replace

import numpy as np
import pytest

from papilla.core.errors import ContactRangeError, FileAccessError, FileFormatError, InputError
from papilla.fem import ReducedFinger, press
from papilla.fem.reduction.finger_model import model_of
from papilla.fem.reduction.patch import Patch
from papilla.fem.reduction.reduced import kept
from papilla.model.finger import Bench
from papilla.model.specimen import Block, HalfSpace


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


def test_gains_and_levers_are_the_weights_of_strain_and_curvature(coarse):
    weights = np.array([[1.0, 2.0, 3.0, 4.0, 5.0], [0.1, 0.2, 0.3, 0.4, 0.5]])
    finger = replace(coarse, weights=weights, rows=coarse.rows * np.array([1.0, 7.0])[:, None, None])
    assert finger.gains.tolist() == weights[0].tolist() and finger.levers.tolist() == weights[1].tolist()
    assert (finger.strain_rows == coarse.rows[0]).all()


def test_a_press_says_what_it_is_and_how_its_indentation_is_shared(coarse):
    found = replace(press(coarse, Block(0.5, 10), force=0.3), indentation=0.6, finger_share=0.75)
    assert (found.finger_indentation, found.specimen_indentation) == pytest.approx((0.45, 0.15))
    assert "0.3 N, 0.6 mm" in repr(found) and f"readings {found.reading[0]:.5g}, " in repr(found)
    assert f"{len(coarse.patch.xy)} nodes, gauges g1, g2, g3, g4, g5" in repr(coarse)


def test_the_file_holds_no_pickle(saved):
    with np.load(saved, allow_pickle=False) as arrays:
        assert all(arrays[name].dtype != object for name in arrays.files)
        assert json.loads(str(arrays["meta"]))["schema"] == "papilla.reduced/3"


def test_a_save_leaves_one_file_and_replaces_the_old_one(coarse, tmp_path):
    path = tmp_path / "finger.npz"
    path.write_text("before")
    coarse.save(path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["finger.npz"]
    ReducedFinger.load(path)


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


def test_a_flipped_byte_is_refused(saved):
    content = bytearray(saved.read_bytes())
    content[len(content) // 2] ^= 0xFF
    saved.write_bytes(content)
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


def test_the_bench_of_a_half_space_is_kept(coarse, tmp_path):
    replace(coarse, bench=Bench(math.inf, "stick")).save(tmp_path / "finger.npz")
    assert ReducedFinger.load(tmp_path / "finger.npz").bench == Bench(math.inf, "stick")


def test_a_missing_file_or_folder_is_named(tmp_path, coarse):
    refused(tmp_path / "nowhere.npz", FileAccessError, "cannot read reduced finger .*nowhere.npz: No such file")
    refused(tmp_path, FileAccessError, "cannot read reduced finger .*: Is a directory")
    with pytest.raises(FileAccessError, match="cannot write .*missing.*: No such file"):
        coarse.save(tmp_path / "missing" / "finger.npz")
    (tmp_path / "file").write_text("")
    with pytest.raises(FileAccessError, match="cannot write .*: Not a directory"):
        coarse.save(tmp_path / "file" / "finger.npz")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["file"]


def test_the_latest_results_are_kept_with_their_owner_and_so_is_a_refusal():
    asked = []

    class Owner:
        pass

    @kept(2)
    def doubled(owner, number):
        asked.append(number)
        if number < 0:
            raise ContactRangeError("negative")
        return 2 * number

    one, other = Owner(), Owner()
    assert [doubled(one, number) for number in (1, 2, 1, 3, 1)] == [2, 4, 2, 6, 2] and asked == [1, 2, 3]
    assert doubled(one, 2) == 4 and asked == [1, 2, 3, 2], "the one that was not asked for longest has gone"
    assert doubled(other, 1) == 2 and asked[4:] == [1], "each owner keeps its own"
    for _ in range(2):
        with pytest.raises(ContactRangeError, match="negative"):
            doubled(other, -1)
    assert asked[5:] == [-1]


def test_a_model_that_is_still_in_use_is_not_made_again(coarse_model):
    coarse_model.reduce()
    assert model_of(coarse_model.finger, coarse_model.mesh) is coarse_model
    other = model_of(coarse_model.finger, coarse_model.mesh, "P1")
    assert other is not coarse_model and other.space.name == "P1"


@pytest.mark.parametrize("off, refused", [(0.9e-6, False), (1.1e-6, True)])
def test_compliances_for_pressure_with_and_without_friction_must_agree(disc, stand_in, off, refused):
    """Within a millionth of the largest entry."""

    @dataclass(frozen=True)
    class Other(HalfSpace):
        def traction_compliance(self, surface):
            found = np.array(super().traction_compliance(surface))
            found[0, 0] += off * self.compliance(surface).max()
            return found

    finger = stand_in(disc(3.0, 4), 0.1)
    if refused:
        with pytest.raises(InputError, match="traction_compliance, which friction needs, does not fit compliance"):
            finger.specimen_compliance(Other(0.3), tractions=True)
    else:
        n = len(finger.patch.xy)
        assert finger.specimen_compliance(Other(0.3), tractions=True).shape == (3 * n, 3 * n)
