"""Bodies and triangulated surfaces against boxes, spheres and the analytic shapes, by counts and closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError, MeshError
from papilla.mesh.body import body_of, facet_deviation, narrowest_mm
from papilla.mesh.cells import paired_faces, volumes
from papilla.mesh.drawing import grid_over, triangulations
from papilla.mesh.surface_files import read_closed, write_half_ellipsoid
from papilla.mesh.surfaces import Ellipsoid, TriangleSurface
from papilla.model.finger import Dome, Slab

DOME = Dome((24.0, 30.0, 20.0), (21.0, 27.0, 17.0), (10.0, 16.0, 6.0))
SLAB = Slab((24.0, 20.0), (21.0, 17.0), (10.0, 6.0), depth=14.0)
HALF = np.array([3.0, 2.0, 1.0])


@pytest.fixture(scope="module")
def box():
    """A box of half lengths `HALF`, its base at z = -1."""
    import pyvista

    sides = pyvista.Box((-3, 3, -2, 2, -1, 1)).triangulate()
    return TriangleSurface(np.array(sides.points, float), sides.regular_faces, -1.0, 1e-6)


@pytest.fixture(scope="module")
def ball():
    """A sphere of radius 10 in facets whose edges are about 1.4."""
    import pyvista

    sphere = pyvista.Icosphere(radius=10.0, nsub=3)
    return TriangleSurface(np.array(sphere.points, float), sphere.regular_faces, -20.0, 1e-6)


def test_a_box_has_its_distance_feet_rim_heights_and_normals(box):
    points = np.random.default_rng(3).uniform(-2, 2, (200, 3)) * HALF
    beyond = np.abs(points) - HALF
    distance = np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)
    assert box.level(points) == pytest.approx(distance, abs=1e-9)
    outside = distance > 0
    assert box.project(points[outside]) == pytest.approx(np.clip(points[outside], -HALF, HALF), abs=1e-9)
    xy = points[:, :2]
    over = (np.abs(xy) <= HALF[:2]).all(axis=1)
    assert np.array_equal(np.isfinite(box.height(xy)), over) and box.height(xy[over]) == pytest.approx(1)
    assert box.height(np.array([[3.0, -2.0], [0.0, 0.0]])).tolist() == [1.0, 1.0], "edges and diagonals count"
    on_rim = box.project_in_base(points)
    share = np.abs(on_rim[:, :2]) / HALF[:2]
    assert (on_rim[:, 2] == -1).all() and share.max(axis=1) == pytest.approx(1, abs=1e-9)
    faces = np.vstack([np.eye(3), -np.eye(3)])
    assert box.normal(0.9 * HALF * faces + 0.1 * faces) == pytest.approx(faces, abs=1e-9)
    assert box.in_base.sum() == 2 and facet_deviation(box, np.zeros(3), 10.0) == pytest.approx(0, abs=1e-9)


def test_a_faceted_sphere_has_smooth_normals_and_is_off_by_a_sixth_of_its_edges_squared(ball):
    points = 9.9 * np.random.default_rng(1).normal(size=(100, 3))
    directions = points / np.linalg.norm(points, axis=1)[:, None]
    assert ball.normal(9.9 * directions) == pytest.approx(directions, abs=0.01)
    corners = ball.vertices[ball.triangles]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    expected = (edges**2).mean(axis=1).max() / 60
    assert facet_deviation(ball, np.array([0, 0, 10.0]), 30.0) == pytest.approx(expected, rel=0.02)
    assert 0.5 * expected < facet_deviation(ball, np.array([0, 0, 10.0]), 0.1) < expected
    assert facet_deviation(ball, np.zeros(3), 5.0) == facet_deviation(Ellipsoid((1, 1, 1)), np.zeros(3), 5.0) == 0
    with pytest.raises(MeshError, match="a layer above the base is thinner than its elements"):
        ball.project_in_base(points)


@pytest.mark.parametrize("shape, high, narrowest", [(DOME, [24, 30, 20], 20), (SLAB, [24, 7, 20], 20)])
def test_a_body_ends_at_its_planes(shape, high, narrowest, finger_of):
    body = body_of(finger_of(shape))
    assert body.low.tolist() == [0, 0, 0] and body.high.tolist() == high and body.apex.tolist() == [0, 0, 20]
    assert list(body.surfaces) == ["skin", "interface", "bone"]
    planes = {(plane.role, plane.axis): (plane.value, plane.outward) for plane in body.planes}
    ends = {("end", 1): (7.0, 1)} if shape is SLAB else {}
    assert planes == {("mirror", 0): (0, -1), ("mirror", 1): (0, -1), ("base", 2): (0, -1)} | ends
    assert narrowest_mm(finger_of(shape)) == narrowest
    with pytest.raises(InputError, match="longest side"):
        body_of(finger_of(replace(SLAB, depth=1001.0)))
    slim = replace(shape, outer=(18.0, *shape.outer[1:]), interface=(16.0, *shape.interface[1:]))
    assert narrowest_mm(finger_of(slim)) == 18


@pytest.mark.parametrize("shape", [DOME, SLAB])
@pytest.mark.parametrize("size", [0.7, 2.5])
def test_each_nested_body_is_closed_by_edges_that_fit(shape, size, finger_of):
    """Octants: each directed edge stands once in each direction, and the volume is that of the body but for chords."""
    body = body_of(finger_of(shape))
    edge = max(body.surfaces["skin"].semi_axes[np.isfinite(body.surfaces["skin"].semi_axes)].max() / 18, 1.1 * size)
    for surface, (vertices, triangles) in zip(body.surfaces.values(), triangulations(body, size), strict=True):
        directed = np.vstack([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
        assert len(np.unique(directed, axis=0)) == len(directed)
        assert {*map(tuple, directed)} == {*map(tuple, directed[:, ::-1])}
        axes = np.where(np.isfinite(surface.semi_axes), surface.semi_axes, 7.0)
        share = np.pi / (6 if shape is DOME else 4)
        corners = vertices[triangles]
        assert np.linalg.det(corners).sum() / 6 == pytest.approx(share * np.prod(axes), rel=0.03)
        arc = (vertices[:, 1] == 0) & (np.abs(surface.level(vertices)) < 1e-9)
        divisions = max(6, round(np.pi / 2 * max(surface.axes) / edge))
        assert arc.sum() == divisions + 1


def test_the_grid_covers_the_box_with_six_tetrahedra_a_cube():
    low, high, shift = np.array([-1.0, 2.0, 0.0]), np.array([4.2, 3.0, 2.5]), np.array([0.5, -0.5, 0.2])
    points, tets = grid_over(low, high, 1.3, shift)
    spans = np.array([6, 3, 4])
    assert len(points) == np.prod(spans + 1) and len(tets) == 6 * np.prod(spans)
    assert points.min(axis=0) == pytest.approx(low + 1.3 * (shift - 1))
    assert np.ptp(points, axis=0) == pytest.approx(1.3 * spans)
    assert volumes(points, tets) == pytest.approx(1.3**3 / 6)
    assert np.sum(paired_faces(tets)[1][:, 1] < 0) == 4 * (6 * 3 + 3 * 4 + 6 * 4), "neighbouring cubes match"


def test_a_surface_to_start_from_is_the_half_ellipsoid_with_small_facets_at_its_apex(tmp_path):
    axes = np.array([24.0, 30.0, 20.0])
    write_half_ellipsoid(tmp_path / "half.stl", (24.0, 30.0, 20.0))
    vertices, triangles = read_closed(str(tmp_path / "half.stl"))
    assert ((vertices / axes) ** 2).sum(axis=1) == pytest.approx(1, abs=1e-5) and vertices[:, 2].min() == 0
    rim = vertices[vertices[:, 2] == 0]
    turn = np.sort(np.arctan2(rim[:, 1] / 30, rim[:, 0] / 24))
    assert len(rim) == 72 and np.diff(turn) == pytest.approx(np.pi / 36, abs=1e-5)
    corners = vertices[triangles]
    assert np.linalg.det(corners).sum() / 6 == pytest.approx(2 / 3 * np.pi * np.prod(axes), rel=0.01)
