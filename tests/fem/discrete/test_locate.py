"""The point locator and the P2 values it gives."""

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.fem.discrete.elements import TaylorHood, interpolation, locate


def quadratic(x):
    return 1 + x @ [2.0, -1, 0.5] + x[:, 0] ** 2 - 3 * x[:, 0] * x[:, 2] + 2 * x[:, 1] ** 2


def test_quadratics_are_exact_everywhere(box_space):
    """Inside, on faces, on edges and on vertices."""
    mesh = box_space.mesh
    inside = np.random.default_rng(0).uniform(0.01, 0.99, (200, 3))
    corners = mesh.points[mesh.tets]
    points = np.concatenate([inside, corners[:, :3].mean(axis=1), corners[:, :2].mean(axis=1), mesh.points])
    values = interpolation(box_space, points) @ quadratic(box_space.displacement.doflocs.T)
    assert np.abs(values - quadratic(points)).max() < 1e-12


def test_the_cell_found_holds_the_point(box_space):
    points = np.random.default_rng(1).uniform(0.01, 0.99, (300, 3))
    cells, local = locate(box_space, points)
    assert local.min() > -1e-12 and local.sum(axis=1).max() < 1 + 1e-12
    corners = box_space.mesh.points[box_space.mesh.tets[cells]]
    back = corners[:, 0] + np.einsum("ki,kij->kj", local, corners[:, 1:] - corners[:, :1])
    assert np.abs(back - points).max() < 1e-13


@pytest.mark.parametrize("beyond, refused", [(0.249, False), (0.251, True)])
def test_a_point_is_extrapolated_up_to_a_quarter_of_a_cell(box, beyond, refused):
    """In shares of the barycentric coordinate that is negative there: of a cell's height over its lowest face."""
    space = TaylorHood(box((1, 1, 1), split=False))
    below = np.array([[0.3, 0.3, -beyond]])
    if refused:
        with pytest.raises(InputError, match="lies outside the mesh"):
            locate(space, below)
    else:
        assert locate(space, below)[1].min() == pytest.approx(-beyond)
