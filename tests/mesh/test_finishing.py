"""Finishing: squeezed cells are relaxed, constrained vertices stay put, and edges are bent onto exact surfaces."""

import numpy as np
import pytest

from papilla.core.errors import MeshError
from papilla.fem.discrete.elements import TaylorHood
from papilla.mesh import build
from papilla.mesh.body import MeshGeometry, Plane, surfaces_of
from papilla.mesh.cells import TaggedCells, mean_ratio
from papilla.mesh.finishing import POOR_MEAN_RATIO, Constraints, bent_edges, relax
from papilla.mesh.surfaces import Ellipsoid
from papilla.model.finger import Finger

SURFACES = {
    "skin": Ellipsoid((24.0, 30.0, 20.0)),
    "interface": Ellipsoid((21.0, 27.0, 17.0)),
    "bone": Ellipsoid((10.0, 16.0, 6.0)),
}
EMPTY = np.empty((0, 3), dtype=int)


def octahedron():
    """Eight cells about one inner vertex (number 6), which sits almost on a face; vertex 4 is in the base plane."""
    points = np.array([[1, 0, 1], [-1, 0, 1], [0, 1, 1], [0, -1, 1], [0, 0, 0], [0, 0, 2], [0.33, 0.33, 1.33]])
    ring = (0, 2, 1, 3)
    tets = [(a, b, pole, 6) for a, b in zip(ring, ring[1:] + ring[:1], strict=True) for pole in (4, 5)]
    tets = np.array(tets)
    middle = points.copy()
    middle[6] = 0, 0, 1
    flipped = np.linalg.det(middle[tets[:, 1:]] - middle[tets[:, :1]]) < 0
    tets[flipped] = tets[flipped][:, [0, 2, 1, 3]]
    return points, tets


def constraints_of(points, tets, base, skin=EMPTY, interface=EMPTY):
    body = MeshGeometry(SURFACES, (Plane(2, 0.0, -1, "base"),), (), np.zeros(3), np.ones(3))
    on_surface = {"skin": skin, "interface": interface, "bone": EMPTY}
    return Constraints(body, TaggedCells(points, tets, np.zeros(len(tets)), on_surface, (base,)))


def test_relaxing_repairs_a_squeezed_vertex():
    points, tets = octahedron()
    before = mean_ratio(points, tets).min()
    after = relax(points, tets, constraints_of(points, tets, np.array([[4, 4, 4]])))
    assert before < POOR_MEAN_RATIO < mean_ratio(after, tets).min()
    assert after[4, 2] == 0
    assert np.array_equal(points, octahedron()[0])


def test_relaxing_never_makes_the_worst_cell_worse():
    """Octahedra whose corners and inner vertex are displaced at random, with their inner vertex in poor cells."""
    random, poor = np.random.default_rng(11), 0
    for _ in range(60):
        points, tets = octahedron()
        points = points + random.normal(scale=0.35, size=points.shape) * [1, 1, 1]
        points[6] = points[[0, 2, 5]].mean(axis=0) + random.normal(scale=0.05, size=3)
        before = mean_ratio(points, tets).min()
        poor += before < POOR_MEAN_RATIO
        after = relax(points, tets, constraints_of(points, tets, EMPTY))
        assert mean_ratio(after, tets).min() >= before
    assert poor > 20


def test_constraints_move_onto_plane_and_surface_and_no_two_surfaces_share_a_vertex():
    points, tets = octahedron()
    high = points + [0, 0, 18.0]
    moved = constraints_of(high, tets, np.array([[4, 4, 4]]), np.array([[5, 5, 5]])).apply(high, np.arange(7))
    assert moved[4].tolist() == [0, 0, 0] and moved[5].tolist() == [0, 0, 20]
    assert np.array_equal(moved[[0, 1, 2, 3, 6]], high[[0, 1, 2, 3, 6]])
    with pytest.raises(MeshError, match="two surfaces share a vertex"):
        constraints_of(points, tets, EMPTY, np.array([[5, 0, 2]]), np.array([[5, 1, 3]]))


def test_middles_lie_on_the_surfaces_and_bent_cells_have_the_volume_of_the_body():
    shipped = build(Finger.default()).cell()
    surfaces = surfaces_of(Finger.default()).values()
    assert np.min([np.abs(surface.level(shipped.middles)) for surface in surfaces], axis=0).max() < 1e-12
    straight = shipped.points[shipped.edges].mean(axis=1)
    assert np.array_equal(straight[:, :2] == 0, shipped.middles[:, :2] == 0), "in the mirror planes"
    assert 0.01 < np.linalg.norm(straight - shipped.middles, axis=1).max() < 0.5 and len(straight) > 1000
    exact = np.pi / 6 * (24 * 30 * 20 - 10 * 16 * 6)
    bent, straight = (TaylorHood(mesh).displacement.dx.sum() for mesh in (shipped, shipped.straight()))
    assert bent == pytest.approx(exact, rel=2e-5)
    assert abs(straight / exact - 1) > 50 * abs(bent / exact - 1)


def test_a_cell_that_would_turn_over_keeps_its_straight_edges():
    ball, octant = Ellipsoid((1.0, 1.0, 1.0)), np.vstack([np.zeros(3), np.eye(3)])
    face = np.array([[1, 2, 3]])
    edges, middles, straight = bent_edges(octant, np.array([[0, 1, 2, 3]]), [(ball, face)])
    assert (len(edges), straight) == (3, 0) and np.linalg.norm(middles, axis=1) == pytest.approx(np.ones(3))
    # Under the cap of the ball, and flatter than it is high: the bowed face would pass the corner outside of it
    octant[0] = 0.4
    edges, middles, straight = bent_edges(octant, np.array([[0, 1, 3, 2]]), [(ball, face)])
    assert (len(edges), len(middles), straight) == (0, 0, 3)
