"""Compliance of a specimen under pressure and tangential traction: exact potentials, images, symmetry, closed forms."""

import numpy as np
import pytest

from papilla.fem.reduction.compliance import PatchSurface
from papilla.model.specimen import Block, HalfSpace, Sphere
from papilla.references import uniform_disc_mean_displacement


def traction_compliance(patch, specimen):
    return specimen.traction_compliance(PatchSurface(patch))


def parts(matrix, n):
    return matrix.reshape(3, n, 3, n)


@pytest.mark.parametrize("specimen", [HalfSpace(0.3, 0.2), Block(0.3, 2.0, 0.5), Sphere(0.3, 20.0, 0.495)])
def test_matrix_is_symmetric_and_positive(disc, specimen):
    for patch in (disc(3.0, 6), disc(3.0, 5, quarter=False)):
        matrix = traction_compliance(patch, specimen)
        assert (matrix == matrix.T).all()
        free = np.ones(3 * len(patch.xy), dtype=bool)
        if len(patch.images) == 4:
            free[len(patch.xy) :] = (patch.xy != 0).T.ravel()
        assert np.linalg.eigvalsh(matrix[np.ix_(free, free)]).min() > 0


def test_a_quarter_with_images_is_the_whole(disc):
    quarter, whole = disc(3.0, 5), disc(3.0, 5, quarter=False)
    n, m = len(quarter.xy), len(whole.xy)
    node = {tuple(np.round(xy, 9)): k for k, xy in enumerate(quarter.xy)}
    spread = np.zeros((3, m, 3, n))
    for k, xy in enumerate(whole.xy):
        for c, sign in enumerate((1.0, *np.sign(xy))):
            spread[c, k, c, node[tuple(np.round(np.abs(xy), 9) + 0.0)]] = sign
    spread = spread.reshape(3 * m, 3 * n)
    for specimen in (HalfSpace(0.3, 0.2), Block(0.3, 2.0, 0.45)):
        expected = spread.T @ traction_compliance(whole, specimen) @ spread / 4
        free = np.append(np.ones(n, dtype=bool), (quarter.xy != 0).T.ravel())
        found = traction_compliance(quarter, specimen)
        assert found[np.ix_(free, free)] == pytest.approx(expected[np.ix_(free, free)], rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_a_disc_under_uniform_shear_moves_as_cerruti_says(disc, nu):
    """Mean of u_x over a disc under uniform shear: (1-nu) and nu/2 of the mean of 1/r, which Boussinesq's disc has."""
    patch = disc(3.0, 8, quarter=False)
    n, area = len(patch.xy), patch.mass.sum()
    blocks = parts(traction_compliance(patch, HalfSpace(1.0, nu)), n)
    mean = blocks.sum(axis=(1, 3)) / area
    plain = uniform_disc_mean_displacement(np.sqrt(area / np.pi), 1.0, 1.0)
    assert mean[1, 1] == pytest.approx(plain * (1 + nu) * (1 - nu / 2), rel=1e-3)
    assert mean[2, 2] == pytest.approx(mean[1, 1], rel=1e-9)
    assert mean[0, 0] == pytest.approx(plain * (1 - nu**2), rel=1e-3)
    assert np.abs(mean - np.diag(np.diag(mean))).max() < 1e-9 * mean[0, 0]
