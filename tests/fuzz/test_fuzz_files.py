"""Damaged designs, calibrations, reduced fingers, surfaces and cache entries: an answer, or one line."""

import io
import json
import random
import warnings
import zipfile

import numpy as np
import pytest
from mutations import mutations
from spring_calibration import calibration

from papilla import fem
from papilla.calibration import Calibration
from papilla.core import cache
from papilla.core.errors import PapillaError
from papilla.core.sealed import CHECKSUM_KEY, checksum
from papilla.fem import ReducedFinger
from papilla.mesh.surface_files import read_closed, write_half_ellipsoid
from papilla.model.finger import SHIPPED_FINGERS, Finger
from papilla.model.specimen import Block

pytestmark = pytest.mark.slow


def answered(use, content, path) -> bool:
    """Whether a file is used; if it is not, the error is one of papilla's in one line."""
    path.write_bytes(content)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*checksum.*", UserWarning)
        try:
            use(path)
        except PapillaError as error:
            line = str(error)
            assert "\n" not in line and 0 < len(line) < 2000, line[:3000]
            return False
    return True


def used_design(path):
    finger = Finger.load(path)
    assert repr(finger) and finger.sha256 and finger.geometry_sha256 and finger._repr_html_()
    again = path.with_name("again.toml")
    finger.save(again)
    assert Finger.load(again) == finger


@pytest.mark.parametrize("name", SHIPPED_FINGERS)
@pytest.mark.parametrize("seed", range(3))
def test_designs(tmp_path, name, seed):
    damaged = mutations(random.Random(seed), SHIPPED_FINGERS[name].read_bytes(), 300)
    results = {answered(used_design, content, tmp_path / "finger.toml") for content in damaged}
    assert len(results) == 2, "some are used, some are not"


def used_calibration(path):
    found = Calibration.load(path)
    force, modulus = (np.geomspace(*limits, 4)[:, None] for limits in found.domain.values())
    sd = found.predict(force, modulus.T)
    found.predict_readings(force, modulus.T)
    assert not np.isinf(sd).any()
    answer = found.invert(sd, force)
    assert answer.sentence.shape == sd.shape and repr(found) and found._repr_html_() and found.sigmas
    found.save(path.with_name("again.json"))
    assert Calibration.load(path.with_name("again.json")).forward.rms == found.forward.rms


def resealed(content: bytes) -> bytes:
    """A damaged calibration whose checksum matches again."""
    try:
        document = json.loads(content)
        document.pop(CHECKSUM_KEY, None)
        return json.dumps(document | {CHECKSUM_KEY: checksum(document)}).encode()
    except (ValueError, RecursionError, AttributeError, TypeError):
        return content


@pytest.mark.parametrize("reseal", [bytes, resealed])
@pytest.mark.parametrize("seed", range(3))
def test_calibrations(tmp_path, seed, reseal):
    calibration().save(tmp_path / "whole.json")
    damaged = mutations(random.Random(seed), (tmp_path / "whole.json").read_bytes(), 200)
    results = {answered(used_calibration, reseal(content), tmp_path / "calibration.json") for content in damaged}
    assert len(results) == 2


def values_of(document, path=()):
    """The places of all values of a document."""
    yield path
    inside = document if isinstance(document, dict) else dict(enumerate(document if isinstance(document, list) else ()))
    for key, value in inside.items():
        yield from values_of(value, (*path, key))


ODD_VALUES = (
    None, True, 0, -1, 1, 0.5, -0.0, 1e-300, 1e300, -1e300, 10**399, 2**63, "", "x", "x" * 3000, "a\nb", "\ud800", [],
    [[]], [1], [[1, 2], [3]], {}, {"name": 1}, {"lacks": [1]}, [None] * 5, [0.0, 0.0], [1.0, 2.0], [2.0, 1.0], [-1, 1],
    [0.05, 1.0], [10**6, 10**6],
)  # fmt: skip


@pytest.mark.parametrize("seed", range(6))
def test_calibrations_with_another_value_somewhere(tmp_path, seed):
    """A value of another type, size or range at a place drawn with equal chances for each depth, and sealed again."""
    rng = random.Random(seed)
    calibration().save(tmp_path / "whole.json")
    text = (tmp_path / "whole.json").read_text()
    by_depth: dict[int, list] = {}
    for place in values_of(json.loads(text)):
        by_depth.setdefault(len(place), []).append(place)
    for _ in range(150):
        document = json.loads(text)
        place = rng.choice(by_depth[rng.choice([depth for depth in by_depth if depth])])
        inner = document
        for key in place[:-1]:
            inner = inner[key]
        inner[place[-1]] = rng.choice(ODD_VALUES)
        answered(used_calibration, resealed(json.dumps(document).encode()), tmp_path / "calibration.json")


@pytest.fixture(scope="module")
def coarse(tmp_path_factory) -> dict[str, np.ndarray]:
    """The arrays of a reduced finger on a coarse mesh."""
    return fem.prepare(Finger.default(), size_mm=4.0).to_arrays(tangential=True)


def used_finger(path):
    reduced = ReducedFinger.load(path)
    fem.press(reduced, Block(0.5, 10), force=0.1, fidelity="contact", friction=0.0)


def packed(arrays) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


@pytest.mark.parametrize("seed", range(3))
def test_reduced_fingers(tmp_path, coarse, seed):
    content = packed(coarse)
    for damaged in mutations(random.Random(seed), content, 200):
        answered(used_finger, damaged, tmp_path / "finger.npz")


def rezipped(rng: random.Random, content: bytes, count: int):
    """Archives with one damaged member, whose checksums are right."""
    with zipfile.ZipFile(io.BytesIO(content)) as whole:
        members = {name: whole.read(name) for name in whole.namelist()}
    for _ in range(count):
        name = rng.choice(list(members))
        (damaged,) = mutations(rng, members[name], 1)
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w") as target:
            for other, data in members.items():
                target.writestr(other, damaged if other == name else data)
        yield stream.getvalue()


@pytest.mark.parametrize("seed", range(4))
def test_reduced_fingers_in_a_right_archive(tmp_path, coarse, seed):
    rng = random.Random(seed)
    for damaged in rezipped(rng, packed(coarse), 150):
        answered(used_finger, damaged, tmp_path / "finger.npz")


@pytest.mark.parametrize("seed", range(4))
def test_reduced_fingers_with_other_numbers(tmp_path, coarse, seed):
    """Whole arrays of the right shape and kind, with numbers that no finger has."""
    rng = random.Random(seed)
    for _ in range(60):
        name = rng.choice([key for key in coarse if key != "meta"])
        array = np.array(coarse[name])
        real = array.dtype.kind == "f"
        if array.size:
            odd = (0, 1, -1, 1e-300, 1e300, 1e12, 2**31 - 1) if real else (0, 1, 2)
            array.flat[rng.randrange(array.size)] = rng.choice(odd)
        changed = array * rng.choice((1, 1, 0, -1, 1e6, 1e-6)) if real else array
        answered(used_finger, packed({**coarse, name: changed}), tmp_path / "finger.npz")


def used_surface(path):
    vertices, triangles = read_closed(str(path))
    assert np.isfinite(vertices).all() and triangles.min() >= 0 and triangles.max() < len(vertices)


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".vtp"])
def test_surfaces(tmp_path, suffix):
    import pyvista

    write_half_ellipsoid(tmp_path / "whole.stl", (24.0, 30.0, 20.0))
    pyvista.read(tmp_path / "whole.stl").decimate(0.9).save(tmp_path / f"whole{suffix}")
    content = (tmp_path / f"whole{suffix}").read_bytes()
    for damaged in mutations(random.Random(5), content, 12):
        answered(used_surface, damaged, tmp_path / f"damaged{suffix}")


@pytest.mark.parametrize("seed", range(3))
def test_cache_entries_never_answer(tmp_path, monkeypatch, seed):
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "cache"))
    cache.keep("thing", "a", {"field": np.arange(6.0), "name": np.array("skin")})
    path = cache.entry("thing", "a")
    content = path.read_bytes()
    for damaged in mutations(random.Random(seed), content, 300):
        path.write_bytes(damaged)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", ".*is damaged: it is not used", RuntimeWarning)
            assert damaged == content or cache.find("thing", "a", report=True) is None
