"""Shapes at the end of what is asked of a mesh: a mesh, or one line that says why not. Nothing is drawn here."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError, MeshError
from papilla.mesh import build
from papilla.mesh.builder import WORST, relative_sizes
from papilla.mesh.cells import mean_ratio, volumes
from papilla.mesh.layered import INNER, OUTER
from papilla.mesh.sizing import asked
from papilla.model.finger import Dome, Finger, Slab

DEFAULT = Finger.default()
BONE = (10.0, 16.0, 6.0)
MOVED = {
    "skin a third of an element thick": (Dome((24.0, 30.0, 20.0), (23.4, 29.4, 19.4), BONE), 2.0),
    "semi-axes of 1 mm": (Dome((1.0, 1.25, 0.83), (0.875, 1.125, 0.708), (0.417, 0.667, 0.25)), 0.1),
    "semi-axes of 500 mm": (Dome((400.0, 500.0, 333.0), (350.0, 450.0, 283.0), (167.0, 267.0, 100.0)), 40.0),
    "axes of ratio 5, flat": (Dome((50.0, 50.0, 10.0), (45.0, 45.0, 8.0), (20.0, 20.0, 3.0)), 2.0),
    "slab of depth 2 mm": (Slab((24.0, 20.0), (21.0, 17.0), (10.0, 6.0), depth=2.0), 2.0),
}
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


@pytest.mark.parametrize("name", MOVED)
def test_a_shipped_mesh_reaches(name):
    """Sound, in both layers, and of the element size that was asked for at the contact."""
    shape, size_mm = MOVED[name]
    finger = shaped(shape)
    if name == "semi-axes of 1 mm":
        grid = {"length_mm": 0.1, "width_mm": 0.1, "backing_mm": (0.2, 0.2)}
        finger = replace(finger, gauges=tuple(replace(gauge, **grid) for gauge in finger.gauges))
    mesh = build(finger, size_mm)
    cell = mesh.cell()
    assert volumes(cell.points, cell.tets).min() > 0 and mean_ratio(cell.points, cell.tets).min() >= WORST
    body, sizing = asked(finger, size_mm)
    middles = cell.points[cell.tets].mean(axis=1)
    near = np.linalg.norm(middles - body.apex, axis=1).argsort()[:50]
    assert np.median(relative_sizes(cell.points, cell.tets, sizing)[near]) < 1.4
    volume = volumes(cell.points, cell.tets)
    parts = [np.prod(axes) for axes in (shape.outer, shape.interface, shape.bone)]
    unit = np.pi / 6 if isinstance(shape, Dome) else np.pi / 4 * shape.depth / 2
    for layer, wanted in ((OUTER, parts[0] - parts[1]), (INNER, parts[1] - parts[2])):
        assert volume[cell.layer == layer].sum() == pytest.approx(unit * wanted, rel=0.05)


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
        (lambda: build(shaped(MOVED["semi-axes of 1 mm"][0])), "0.83 mm tall must lie between 0.00415 and 0.2075"),
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


def test_a_design_that_differs_in_gauges_alone_has_the_same_mesh_and_says_so():
    fewer, said = replace(DEFAULT, gauges=DEFAULT.gauges[1:4]), []
    mesh, default = build(fewer, 2.0, progress=said.append), build(DEFAULT, 2.0)
    assert np.array_equal(mesh.tets, default.tets) and np.abs(mesh.points - default.points).max() < 1e-12
    assert said[0].startswith("shipped mesh of 2 mm, not moved; worst mean ratio")
