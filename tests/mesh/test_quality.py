"""The figures of a mesh: of two cells, away from the origin, whose edges, angles and volumes are known by hand."""

import numpy as np
import pytest

from papilla.mesh.cells import dihedral_angles, mean_ratio, quality, volumes
from papilla.mesh.layered import BOUNDARY_NAMES, INNER_LAYER, OUTER_LAYER, LayeredMesh

CORNERS = np.array([[0, 0, 0], [3, 0, 0], [0, 4, 0], [0, 0, 12], [0, 0, -6]], float) + [100.0, 50.0, -20.0]
TETS = np.array([[0, 1, 2, 3], [0, 2, 1, 4]])


def test_figures_of_two_cells():
    mesh = LayeredMesh(
        CORNERS, TETS, [OUTER_LAYER, INNER_LAYER], dict.fromkeys(BOUNDARY_NAMES, np.zeros((0, 3), int)), 1.0
    )
    found = quality(mesh)
    assert (found["cells"], found["points"]) == (2, 5)
    assert found["volume_mm3"] == pytest.approx({"outer": 24, "inner": 12})
    assert found["edge_min_mm"] == pytest.approx(3) and found["edge_max_mm"] == pytest.approx(np.hypot(4, 12))
    # Squared edges: 9 + 16 + 25 below, then those to the tip
    ratios = [12 * (3 * v) ** (2 / 3) / squares for v, squares in ((24, 50 + 144 + 153 + 160), (12, 50 + 36 + 45 + 52))]
    assert mean_ratio(CORNERS, TETS) == pytest.approx(ratios)
    assert found["mean_ratio_min"] == pytest.approx(min(ratios))
    assert found["mean_ratio_mean"] == pytest.approx(np.mean(ratios))
    # Three right angles each; the others by the sloping face's normal (1/3, 1/4, 1/h)
    sloping = [np.array([1 / 3, 1 / 4, 1 / h]) for h in (12, 6)]
    angles = np.concatenate([np.degrees(np.arccos(n / np.linalg.norm(n))) for n in sloping])
    assert found["dihedral_min_deg"] == pytest.approx(angles.min())
    assert found["dihedral_max_deg"] == pytest.approx(90)
    expected = np.sort(np.append(angles, [90] * 6).reshape(-1))
    assert np.sort(dihedral_angles(CORNERS, TETS).ravel()) == pytest.approx(expected)


def test_an_inverted_cell_has_a_negative_ratio():
    assert volumes(CORNERS, TETS[:, [1, 0, 2, 3]]) == pytest.approx([-24, -12])
    assert mean_ratio(CORNERS, TETS[:, [1, 0, 2, 3]]) == pytest.approx(-mean_ratio(CORNERS, TETS))
