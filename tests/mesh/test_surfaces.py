"""Exact geometry of the surfaces: level, projection, height, normal, and the sites of gauges on them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipeinc

from papilla.core.errors import InputError
from papilla.mesh.body import gauge_site, surfaces_of
from papilla.mesh.surfaces import Ellipsoid, EllipticCylinder
from papilla.model.finger import Dome, Finger, Gauge, Slab

DOME = Ellipsoid((24.0, 30.0, 20.0))
SLAB = EllipticCylinder((24.0, 20.0), 10.0)
DOME_SHAPE = Dome((24.0, 22.0, 20.0), (21.0, 19.0, 17.0), (10.0, 9.0, 6.0))
SLAB_SHAPE = Slab((24.0, 20.0), (21.0, 17.0), (10.0, 6.0), depth=30.0)


@pytest.mark.parametrize("surface", [DOME, SLAB])
def test_projection_level_and_normal_agree(surface):
    random = np.random.default_rng(5)
    directions = random.normal(size=(400, 3))
    directions[:, 2] = np.abs(directions[:, 2])
    on_sphere = directions / np.linalg.norm(directions, axis=1)[:, None]
    points = on_sphere * [24, 30, 20] * random.uniform(0.5, 1.5, (400, 1))
    points[:100, 0] = points[50:150, 1] = 0
    foot = surface.project(points)
    assert np.abs(surface.level(foot)).max() < 1e-12
    assert np.array_equal(foot == 0, points == 0)
    normal, step = surface.normal(foot), 1e-5
    up, down = ([surface.level(foot + sign * step * e) for e in np.eye(3)] for sign in (1, -1))
    assert normal == pytest.approx(np.transpose(np.subtract(up, down)) / (2 * step), abs=1e-7)
    # The level is the signed distance to first order
    for distance in (step, -step):
        assert surface.level(foot + distance * normal) == pytest.approx(distance, rel=1e-4)


@pytest.mark.parametrize("surface", [DOME, SLAB])
def test_height_is_on_the_surface_and_nan_outside(surface):
    xy = np.random.default_rng(2).uniform(-40, 40, (500, 2))
    z = surface.height(xy)
    if surface is DOME:
        inside = (xy[:, 0] / 24) ** 2 + (xy[:, 1] / 30) ** 2 <= 1
    else:
        inside = (np.abs(xy[:, 0]) <= 24) & (np.abs(xy[:, 1]) <= 5)
    assert np.array_equal(np.isfinite(z), inside) and 5 < inside.sum() < 495
    assert np.abs(surface.level(np.column_stack([xy, z])[inside])).max() < 1e-12


def site(shape, **options):
    gauge = Gauge("g1", **options)
    finger = replace(Finger.default(), shape=shape, gauges=(gauge,))
    return gauge_site(finger, gauge, surfaces_of(finger)["interface"])


@pytest.mark.parametrize("shape, width", [(DOME_SHAPE, 21.0 * np.sqrt(1 - (4 / 19) ** 2)), (SLAB_SHAPE, 21.0)])
def test_an_angle_is_the_parameter_of_the_section_at_the_gauges_y(shape, width):
    found = site(shape, angle_deg=25.0, y_mm=4.0)
    x = width * np.sin(np.radians(25.0))
    y_share = (4 / 19) ** 2 if shape is DOME_SHAPE else 0.0
    assert found == pytest.approx([x, 4.0, 17.0 * np.sqrt(1 - (x / 21.0) ** 2 - y_share)])


@pytest.mark.parametrize("axis, half, moved", [(0, 21.0, 7.0), (0, 21.0, -3.1), (1, 19.0, 6.0), (1, 19.0, 0.1)])
def test_a_moved_gauge_lies_an_arc_of_the_ellipse_further(axis, half, moved):
    found = site(DOME_SHAPE, x_mm=0.0, moved_mm=(moved, 0.0) if axis == 0 else (0.0, moved))
    parameter = np.arcsin(found[axis] / half)
    # The arc of an ellipse from its top, x = half sin p, z = 17 cos p
    assert half * ellipeinc(parameter, 1 - (17.0 / half) ** 2) == pytest.approx(moved, rel=2e-4)
    assert found[1 - axis] == 0.0 and found[2] == pytest.approx(17.0 * np.cos(parameter))


def test_a_gauge_that_was_moved_off_the_interface_is_refused():
    with pytest.raises(InputError, match=r"gauge g1 was moved off the interface: moved_mm \[60"):
        site(DOME_SHAPE, x_mm=0.0, moved_mm=(60.0, 0.0))
