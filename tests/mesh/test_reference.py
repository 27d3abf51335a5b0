"""The shipped meshes: returned without meshing, pinned to the bit, and independent of each other."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.finger import Dome, Finger
from papilla.mesh import DEFAULT_SIZE_MM, build, quality
from papilla.mesh import builder as builder_module
from papilla.mesh.builder import VARIANTS, reference, reference_path

PINNED = {
    0: "89a7bf93628514b713dae37166d5b84c528fd14a4f3f530b3064e571fd632c8c",
    1: "7b8cdde41d5465649979120023b3a411b56f5ffd16e61d99d799a27c94312e24",
    2: "ca46cfa36fbfe3dac6089df1accc9747151e185dca4288e72032a71e69362f73",
    3: "f0f53a599b1dba886b5ffe6da6dc9ad9c78af2e0dc3447647b50127aff257de0",
    4: "811a50ca7beda99fec938a00074f95f874360a4da6a7973e08444f0348d21860",
}


@pytest.fixture
def no_mesher(monkeypatch):
    def refuse(*args, **kwargs):
        raise AssertionError("the mesher was called")

    monkeypatch.setattr(builder_module, "tetrahedralise", refuse)


@pytest.mark.parametrize("variant", range(VARIANTS))
def test_default_finger_gets_a_pinned_mesh(variant, no_mesher, tmp_path):
    mesh = build(Finger.default(), variant=variant)
    assert mesh.sha256 == PINNED[variant]
    assert mesh.size_mm == DEFAULT_SIZE_MM and mesh.mirrors == ("x", "y")
    assert not (tmp_path / "cache").exists()
    figures = quality(mesh)
    assert figures["mean_ratio_min"] > 0.2
    total = 2 / 3 * np.pi * (24 * 30 * 20 - 10 * 16 * 6)
    assert sum(figures["volume_mm3"].values()) == pytest.approx(total, rel=0.003)


def test_pinned_meshes_differ():
    assert len(set(PINNED.values())) == VARIANTS


def test_moduli_do_not_change_the_mesh(no_mesher):
    stiffer = replace(Finger.default(), outer=replace(Finger.default().outer, modulus=1.0))
    assert build(stiffer).sha256 == PINNED[0]


def test_other_geometry_size_or_variant_has_no_reference():
    finger = Finger.default()
    other = replace(finger, shape=Dome((24.0, 30.0, 20.5), (21.0, 27.0, 17.0), (10.0, 16.0, 6.0)))
    assert reference(other, DEFAULT_SIZE_MM, 0) is None
    assert reference(finger, DEFAULT_SIZE_MM / 2, 0) is None
    assert reference(finger, DEFAULT_SIZE_MM, VARIANTS) is None


def test_shipped_files_are_small():
    assert sum(reference_path(variant).stat().st_size for variant in range(VARIANTS)) < 1.5e6
