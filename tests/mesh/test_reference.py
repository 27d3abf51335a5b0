"""The shipped meshes: returned without meshing, pinned to the bit, and independent of each other."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.finger import Dome, Finger
from papilla.mesh import DEFAULT_SIZE_MM, build, quality
from papilla.mesh import builder as builder_module
from papilla.mesh.builder import VARIANTS, reference, reference_path

PINNED = {
    0: "ceb274e87c76d8b46b5104d75d1b1d7c187d23494896a0291017770d70f7d6a3",
    1: "c3c29423ac729bf3d5b4b242cdc03e20c19243fb1f573798f33ca33df2457ba0",
    2: "d6ee09c00b6772d87eaa077abdde3d2fcab9145d53b8fa399d2b12f3b756a6c4",
    3: "58deb2edd1e69e78ec19838c6a8894b58440f4442a237b2fcaa734cf4971c8c1",
    4: "21cc7fae1012081422d5eacde921b07f4d887d4f495f485f19d9769d0ce5ca7e",
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
