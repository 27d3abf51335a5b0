"""Exact geometry of the surfaces: level, projection, height, normal, and the soup made of them."""

import numpy as np
import pytest

from papilla.mesh.drawing import quarter_cylinder, quarter_ellipsoid
from papilla.mesh.surfaces import Ellipsoid, EllipticCylinder

DOME = Ellipsoid((24.0, 30.0, 20.0))
SLAB = EllipticCylinder((24.0, 20.0), 10.0)


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


@pytest.mark.parametrize(
    ("make", "surface", "volume"),
    [(quarter_ellipsoid, DOME, np.pi / 6 * 24 * 30 * 20), (quarter_cylinder, SLAB, np.pi / 4 * 24 * 20 * 5)],
)
def test_quarters_are_closed_and_fill_their_volume(make, surface, volume):
    errors = []
    for divisions in (8, 16):
        vertices, triangles = make(surface, divisions)
        edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        assert np.all(np.unique(edges, axis=0, return_counts=True)[1] == 2)
        assert vertices.min() == 0
        # The body is convex, so cones from its middle add up whatever way their triangles turn
        cones = np.linalg.det(vertices[triangles] - vertices.mean(axis=0))
        errors.append(1 - np.abs(cones).sum() / 6 / volume)
    assert 0 < errors[1] < 0.01
    assert 3 < errors[0] / errors[1] < 5
