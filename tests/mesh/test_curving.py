"""Edges bent onto exact surfaces: where they lie, what they gain, and which stay straight."""

import numpy as np
import pytest

from papilla.fem.discrete.elements import TaylorHood
from papilla.mesh import build
from papilla.mesh.body import surfaces_of
from papilla.mesh.finishing import bent_edges
from papilla.mesh.surfaces import Ellipsoid
from papilla.model.finger import Finger

BALL = Ellipsoid((1.0, 1.0, 1.0))
OCTANT = np.vstack([np.zeros(3), np.eye(3)])
CELL, FACE = np.array([[0, 1, 2, 3]]), np.array([[1, 2, 3]])


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
    edges, middles, straight = bent_edges(OCTANT, CELL, [(BALL, FACE)])
    assert (len(edges), straight) == (3, 0) and np.linalg.norm(middles, axis=1) == pytest.approx(np.ones(3))
    # Under the cap of the ball, and flatter than it is high: the bowed face would pass the corner outside of it
    flat = OCTANT.copy()
    flat[0] = [0.4, 0.4, 0.4]
    edges, middles, straight = bent_edges(flat, np.array([[0, 1, 3, 2]]), [(BALL, FACE)])
    assert (len(edges), len(middles), straight) == (0, 0, 3)
