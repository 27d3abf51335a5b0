"""Derivatives of a press against finite differences, all of them from one registry."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from papilla.errors import InputError
from papilla.fem import FingerModel
from papilla.fem.pressing.derivatives import place_slope, press_slopes
from papilla.fem.pressing.fidelity import on_nodes
from papilla.fem.reduction.family import FingerFamily, family
from papilla.finger import Finger
from papilla.mesh import build
from papilla.specimen import Block, HalfSpace, Specimen, Sphere

SIZE_MM = 2.8
SPECIMENS = (Block(0.3, 10.0), HalfSpace(0.2), Sphere(1.5, 12.0))
LOADS = ({"force": 0.5}, {"indentation": 0.9})


@dataclass(frozen=True)
class Scene:
    """What a press depends on."""

    relatives: FingerFamily
    outer: float
    inner: float
    specimen: Specimen
    load: dict

    def moved(self, name: str, by: float) -> "Scene":
        """The scene with one parameter changed by a fraction of itself."""
        if name.startswith("specimen_"):
            key = name.removeprefix("specimen_")
            return replace(self, specimen=replace(self.specimen, **{key: (1 + by) * getattr(self.specimen, key)}))
        if name in self.load:
            return replace(self, load={name: (1 + by) * self.load[name]})
        layer = name.removesuffix("_modulus")
        return replace(self, **{layer: (1 + by) * getattr(self, layer)})

    def value(self, name: str) -> float:
        if name.startswith("specimen_"):
            return getattr(self.specimen, name.removeprefix("specimen_"))
        return self.load[name] if name in self.load else getattr(self, name.removesuffix("_modulus"))

    def press(self):
        reduced = self.relatives.at(self.outer, self.inner)
        return on_nodes(reduced, self.specimen, (self.load.get("force"), self.load.get("indentation")), 0.0)


@pytest.fixture(scope="module")
def relatives():
    return family(Finger.default(), size_mm=SIZE_MM)


@pytest.mark.slow
@pytest.mark.parametrize("load", LOADS, ids=lambda load: next(iter(load)))
@pytest.mark.parametrize("specimen", SPECIMENS, ids=lambda one: type(one).__name__)
def test_all_are_what_finite_differences_say(relatives, specimen, load):
    scene = Scene(relatives, 0.136, 0.034, specimen, load)
    found = press_slopes(relatives, scene.outer, scene.inner, specimen, **load)
    assert found.press.reading == pytest.approx(scene.press().reading, rel=1e-9)
    assert set(found.by) > {"outer_modulus", "inner_modulus", "specimen_modulus", next(iter(load))}
    step = 3e-6
    for name, slope in found.by.items():
        up, down = (scene.moved(name, sign * step).press() for sign in (1, -1))
        span = 2 * step * scene.value(name)
        largest = np.abs(slope.values).max(axis=1, keepdims=True)
        assert (up.values - down.values) / span == pytest.approx(slope.values, abs=1e-3 * largest.max(), rel=1e-3)
        assert (up.force - down.force) / span == pytest.approx(slope.force, rel=1e-3, abs=1e-6)
        assert (up.indentation - down.indentation) / span == pytest.approx(slope.indentation, rel=1e-3, abs=1e-6)


def test_scaling_all_moduli_and_the_force_changes_no_strain(relatives):
    found = press_slopes(relatives, 0.136, 0.034, Block(0.3, 10.0), force=0.5)
    scales = {"outer_modulus": 0.136, "inner_modulus": 0.034, "specimen_modulus": 0.3, "force": 0.5}
    total = sum(value * found.by[name].values for name, value in scales.items())
    assert np.abs(total).max() < 1e-5 * np.abs(found.press.values).max()
    assert sum(value * found.by[name].indentation for name, value in scales.items()) == pytest.approx(0, abs=1e-5)


def test_readings_weigh_both_quantities(relatives):
    slope = press_slopes(relatives, 0.136, 0.034, HalfSpace(0.3), force=0.4).by["force"]
    strain, curvature = slope.values
    assert slope.readings(np.array([[2.0] * 5, [-1.0] * 5])) == pytest.approx(1e6 * (2 * strain - curvature))


@pytest.mark.slow
def test_a_place_moves_the_readings_of_mirrored_gauges_against_each_other(relatives):
    finger = Finger.default()
    mesh = build(finger, size_mm=SIZE_MM)
    model = FingerModel(finger, mesh)
    reduced = relatives.at(finger.outer.modulus, finger.inner.modulus)
    found = on_nodes(reduced, Block(0.3, 10.0), (0.5, None), 0.0)
    slope = place_slope(model, reduced, found)
    assert slope == pytest.approx(-slope[::-1], abs=1e-6 * np.abs(slope).max())
    moved = on_nodes(model.reduce((0.4, 0.0)), Block(0.3, 10.0), (0.5, None), 0.0)
    # Solved anew beside the apex on a coarse mesh: the sign, and the size of the largest
    largest = np.abs(slope).argmax()
    assert (moved.reading - found.reading)[largest] / 0.4 == pytest.approx(slope[largest], rel=0.5)


def test_both_loads_are_refused(relatives):
    with pytest.raises(InputError, match="exactly one of force and indentation"):
        press_slopes(relatives, 0.136, 0.034, HalfSpace(0.3), force=0.4, indentation=0.3)
