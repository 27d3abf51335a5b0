"""Relaxation of squeezed cells: better than before, constrained vertices stay put."""

import numpy as np
import pytest

from papilla.core.errors import MeshError
from papilla.mesh.body import Body, Plane
from papilla.mesh.cells import TaggedCells, dihedral_angles, mean_ratio
from papilla.mesh.finishing import POOR, Constraints, relax
from papilla.mesh.surfaces import Ellipsoid
from papilla.model.finger import Dome

SHAPE = Dome((24.0, 30.0, 20.0), (21.0, 27.0, 17.0), (10.0, 16.0, 6.0))
SURFACES = dict(
    zip(("skin", "interface", "bone"), map(Ellipsoid, (SHAPE.outer, SHAPE.interface, SHAPE.bone)), strict=True)
)
EMPTY = np.empty((0, 3), dtype=int)
REGULAR = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])


def test_mean_ratio_and_dihedral_angles_of_known_cells():
    tet = np.array([[0, 1, 2, 3]])
    oriented = tet if np.linalg.det(REGULAR[1:] - REGULAR[0]) > 0 else tet[:, [0, 2, 1, 3]]
    assert np.isclose(mean_ratio(REGULAR, oriented), 1)
    assert np.isclose(mean_ratio(7 * REGULAR, oriented[:, [1, 0, 2, 3]]), -1)
    assert np.allclose(dihedral_angles(REGULAR, oriented), np.degrees(np.arccos(1 / 3)))
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    assert np.isclose(mean_ratio(corner, tet), 12 * 0.5 ** (2 / 3) / 9)
    assert np.allclose(np.sort(dihedral_angles(corner, tet))[0, 3:], 90)


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
    body = Body(SURFACES, (Plane(2, 0.0, -1, "base"),), (), np.zeros(3), np.ones(3))
    cells = TaggedCells(points, tets, np.zeros(len(tets)), {"skin": skin, "interface": EMPTY, "bone": EMPTY}, (base,))
    return Constraints(body, cells)


def test_relaxing_repairs_a_squeezed_vertex():
    points, tets = octahedron()
    before = mean_ratio(points, tets).min()
    constraints = constraints_of(points, tets, np.array([[4, 4, 4]]))
    after = relax(points, tets, constraints)
    assert before < POOR < mean_ratio(after, tets).min()
    assert after[4, 2] == 0
    assert np.array_equal(points, octahedron()[0])


def stars(count=300):
    """Octahedra whose corners and inner vertex are displaced at random, with their inner vertex in poor cells."""
    random = np.random.default_rng(11)
    for _ in range(count):
        points, tets = octahedron()
        points = points + random.normal(scale=0.35, size=points.shape) * [1, 1, 1]
        points[6] = points[[0, 2, 5]].mean(axis=0) + random.normal(scale=0.05, size=3)
        if mean_ratio(points, tets).min() < POOR:
            yield points, tets


def test_relaxing_never_makes_the_worst_cell_worse():
    for points, tets in stars(60):
        after = relax(points, tets, constraints_of(points, tets, EMPTY))
        assert mean_ratio(after, tets).min() >= mean_ratio(points, tets).min()


def test_good_cells_are_left_alone():
    points, tets = octahedron()
    points[6] = 0, 0, 1
    assert np.array_equal(relax(points, tets, constraints_of(points, tets, EMPTY)), points)


def test_constraints_move_onto_plane_and_surface():
    points, tets = octahedron()
    constraints = constraints_of(points + [0, 0, 18.0], tets, np.array([[4, 4, 4]]), skin=np.array([[5, 5, 5]]))
    moved = constraints.apply(points + [0, 0, 18.0], np.arange(7))
    assert moved[4].tolist() == [0, 0, 0]
    assert moved[5].tolist() == [0, 0, 20]
    assert np.array_equal(moved[[0, 1, 2, 3, 6]], (points + [0, 0, 18.0])[[0, 1, 2, 3, 6]])


def test_cells_are_poor_below_a_mean_ratio_of_a_tenth():
    """The inner vertex sinks towards a face until its worst cell crosses 0.1; only then is it moved."""
    points, tets = octahedron()
    worst = {}
    for height in np.linspace(0.0, 1 / 3, 60):
        moved = points.copy()
        moved[6] = height, height, 1 + height
        quality = mean_ratio(moved, tets).min()
        worst[float(quality)] = not np.array_equal(relax(moved, tets, constraints_of(moved, tets, EMPTY)), moved)
    assert max(quality for quality, relaxed in worst.items() if relaxed and quality > 0) == pytest.approx(0.1, abs=0.03)
    assert not any(relaxed for quality, relaxed in worst.items() if quality > 0.1)
    assert all(relaxed for quality, relaxed in worst.items() if 0 < quality < 0.09)


def test_surfaces_that_share_a_vertex_are_refused():
    points, tets = octahedron()
    on_surface = {"skin": np.array([[5, 0, 2]]), "interface": np.array([[5, 1, 3]]), "bone": EMPTY}
    body = Body(SURFACES, (Plane(2, 0.0, -1, "base"),), (), np.zeros(3), np.ones(3))
    with pytest.raises(MeshError, match="two surfaces share a vertex"):
        Constraints(body, TaggedCells(points, tets, np.zeros(8), on_surface, (EMPTY,)))


def test_the_rim_of_a_surface_stays_in_the_base_plane():
    points, tets = octahedron()
    points = points + [10, 0, 0]
    found = constraints_of(points, tets, np.array([[4, 4, 4]]), skin=np.array([[4, 4, 4]])).apply(points, np.arange(7))
    assert found[4].tolist() == pytest.approx([24, 0, 0], abs=1e-12)
