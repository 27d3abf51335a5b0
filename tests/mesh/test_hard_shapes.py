"""Shapes at the end of what is asked of a mesh: a mesh, or one line that says why not. Nothing is drawn here."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError, MeshError
from papilla.mesh import build
from papilla.mesh.builder import relative_sizes
from papilla.mesh.sizing import asked
from papilla.model.finger import Dome, Finger, Slab

DEFAULT = Finger.default()
BONE = (10.0, 16.0, 6.0)
DRAWN = {
    "skin a twentieth of an element thick": Dome((24.0, 30.0, 20.0), (23.9, 29.9, 19.9), BONE),
    "inner layer half an element thick": Dome((24.0, 30.0, 20.0), (21.0, 27.0, 17.0), (20.0, 26.0, 16.0)),
    "axes of ratio 5, long": Dome((50.0, 10.0, 10.0), (48.0, 8.0, 8.0), (40.0, 4.0, 3.0)),
    "axes of ratio 5, narrow": Dome((10.0, 50.0, 20.0), (8.0, 45.0, 17.0), (4.0, 20.0, 6.0)),
    "interface at the skin at the base": Dome((24.0, 30.0, 20.0), (23.9, 29.9, 17.0), BONE),
}


pytestmark = pytest.mark.usefixtures("no_mesher")


def shaped(shape, **changes) -> Finger:
    return replace(DEFAULT, shape=shape, ridges=None, **changes)


@pytest.mark.parametrize("name", DRAWN)
def test_what_no_shipped_mesh_reaches_goes_to_the_mesher_with_a_line(name):
    said = []
    with pytest.raises(MeshError, match="the mesher was called"):
        build(shaped(DRAWN[name]), 2.0, progress=said.append)
    assert said[0].startswith("shipped mesh of ") and said[0].endswith("below 0.15: the mesher makes a new one")


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: Dome((24.0, 30.0, 20.0), (24.0, 30.0, 17.0), BONE), "interface semi-axis x 24 mm must be smaller"),
        (lambda: Slab((24.0, 20.0), (24.0, 17.0), (10.0, 6.0)), "interface semi-axis x 24 mm must be smaller"),
        (
            lambda: build(shaped(Dome((1.0, 1.25, 0.83), (0.875, 1.125, 0.708), (0.417, 0.667, 0.25)))),
            "0.83 mm tall must lie between 0.00415 and 0.2075",
        ),
        (
            lambda: build(shaped(Dome((500.0, 625.0, 416.0), (437.0, 562.0, 354.0), (208.0, 333.0, 125.0))), 50.0),
            r"longest side of the finger \(mm\) must lie between 1 and 1000, got 1250",
        ),
        (lambda: build(at_the_rim(90.0)), "gauge g1 lies outside the interface: angle_deg -90 is not between"),
    ],
)
def test_what_cannot_be_meshed_is_refused_in_a_line(make, message):
    with pytest.raises(InputError, match=message):
        make()


def at_the_rim(angle_deg: float) -> Finger:
    angles = (-angle_deg, -20.0, 0.0, 20.0, angle_deg)
    gauges = tuple(replace(gauge, angle_deg=angle) for gauge, angle in zip(DEFAULT.gauges, angles, strict=True))
    return replace(DEFAULT, gauges=gauges)


def test_gauges_at_the_rim_get_the_cells_that_they_need():
    finger, said = at_the_rim(85.0), []
    mesh = build(finger, 1.0, progress=said.append)
    cell, (_, sizing) = mesh.cell(), asked(finger, 1.0)
    assert said[0].startswith("shipped mesh of 1 mm, not moved")
    there = np.linalg.norm(cell.points[cell.tets].mean(axis=1) - np.abs(sizing.sites[0]), axis=1) < 2.0
    assert there.any()
    assert relative_sizes(cell.points, cell.tets, sizing)[there].max() < 1.5
