"""Relaxation of squeezed cells: better than before, constrained vertices stay put."""

import numpy as np
import pytest

from papilla.core.errors import MeshError
from papilla.mesh.body import MeshGeometry, Plane
from papilla.mesh.cells import TaggedCells, mean_ratio
from papilla.mesh.finishing import POOR_MEAN_RATIO, Constraints, relax
from papilla.mesh.surfaces import Ellipsoid
from papilla.model.finger import Dome

SHAPE = Dome((24.0, 30.0, 20.0), (21.0, 27.0, 17.0), (10.0, 16.0, 6.0))
SURFACES = dict(
    zip(("skin", "interface", "bone"), map(Ellipsoid, (SHAPE.outer, SHAPE.interface, SHAPE.bone)), strict=True)
)
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


def constraints_of(points, tets, base, skin=EMPTY):
    body = MeshGeometry(SURFACES, (Plane(2, 0.0, -1, "base"),), (), np.zeros(3), np.ones(3))
    cells = TaggedCells(points, tets, np.zeros(len(tets)), {"skin": skin, "interface": EMPTY, "bone": EMPTY}, (base,))
    return Constraints(body, cells)


def test_relaxing_repairs_a_squeezed_vertex():
    points, tets = octahedron()
    before = mean_ratio(points, tets).min()
    constraints = constraints_of(points, tets, np.array([[4, 4, 4]]))
    after = relax(points, tets, constraints)
    assert before < POOR_MEAN_RATIO < mean_ratio(after, tets).min()
    assert after[4, 2] == 0
    assert np.array_equal(points, octahedron()[0])


def stars(count=300):
    """Octahedra whose corners and inner vertex are displaced at random, with their inner vertex in poor cells."""
    random = np.random.default_rng(11)
    for _ in range(count):
        points, tets = octahedron()
        points = points + random.normal(scale=0.35, size=points.shape) * [1, 1, 1]
        points[6] = points[[0, 2, 5]].mean(axis=0) + random.normal(scale=0.05, size=3)
        if mean_ratio(points, tets).min() < POOR_MEAN_RATIO:
            yield points, tets


def test_relaxing_never_makes_the_worst_cell_worse():
    for points, tets in stars(60):
        after = relax(points, tets, constraints_of(points, tets, EMPTY))
        assert mean_ratio(after, tets).min() >= mean_ratio(points, tets).min()


def test_constraints_move_onto_plane_and_surface():
    points, tets = octahedron()
    constraints = constraints_of(points + [0, 0, 18.0], tets, np.array([[4, 4, 4]]), skin=np.array([[5, 5, 5]]))
    moved = constraints.apply(points + [0, 0, 18.0], np.arange(7))
    assert moved[4].tolist() == [0, 0, 0]
    assert moved[5].tolist() == [0, 0, 20]
    assert np.array_equal(moved[[0, 1, 2, 3, 6]], (points + [0, 0, 18.0])[[0, 1, 2, 3, 6]])


def test_surfaces_that_share_a_vertex_are_refused():
    points, tets = octahedron()
    on_surface = {"skin": np.array([[5, 0, 2]]), "interface": np.array([[5, 1, 3]]), "bone": EMPTY}
    body = MeshGeometry(SURFACES, (Plane(2, 0.0, -1, "base"),), (), np.zeros(3), np.ones(3))
    with pytest.raises(MeshError, match="two surfaces share a vertex"):
        Constraints(body, TaggedCells(points, tets, np.zeros(8), on_surface, (EMPTY,)))
