"""Compliance of a specimen under pressure and tangential traction: exact potentials, images, symmetry, closed forms."""

import numpy as np
import pytest

from papilla.fem.reduction.compliance import PatchSurface, linear_moments
from papilla.model.specimen import Block, HalfSpace, Sphere
from papilla.references import uniform_disc_mean_displacement


def traction_compliance(patch, specimen):
    return specimen.traction_compliance(PatchSurface(patch))


CORNERS = np.array([[0.3, -0.2], [-0.9, 0.4], [0.5, 1.6]])
PLACES = {"inside": [0.7, 0.2, 0.1], "edge": [0.4, 0.6, 0.0], "vertex": [0.0, 1.0, 0.0], "line": [1.7, -0.7, 0.0]}


def moments_by_polar(point, corners, angles=40000):
    """The same integrals by rays from the point: along each, (phi_0 + g r) e^m is elementary."""
    hats = np.linalg.inv(np.column_stack([corners, np.ones(3)]).T)
    angle = (np.arange(angles) + 0.5) * 2 * np.pi / angles
    e = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    total = np.zeros((3, 6))
    # A ray enters and leaves through the edges; signed crossings add up to what lies inside
    for k in range(3):
        start, end = corners[k] - point, corners[(k + 1) % 3] - point
        side = start[0] * end[1] - start[1] * end[0]
        if abs(side) < 1e-12:
            continue
        along = end - start
        u = (start[1] * e[:, 0] - start[0] * e[:, 1]) / (e[:, 1] * along[0] - e[:, 0] * along[1])
        r = np.einsum("kj,kj->k", start + u[:, None] * along, e)
        hit = (u >= 0) & (u < 1) & (r > 0)
        value, slope = hats @ np.append(point, 1), e[hit] @ hats[:, :2].T
        radial = r[hit, None] * value + r[hit, None] ** 2 / 2 * slope
        x, y = -e[hit].T
        factors = np.stack([np.ones_like(x), x * x, x * y, y * y, x, y])
        total += np.sign(side) * (factors @ radial).T * 2 * np.pi / angles
    area = np.linalg.det(corners[1:] - corners[0])
    return np.sign(area) * total


@pytest.mark.parametrize("place", PLACES)
def test_moments_of_a_triangle(place):
    point = np.array(PLACES[place]) @ CORNERS
    found = linear_moments(point[None], CORNERS[None])[0]
    assert found == pytest.approx(moments_by_polar(point, CORNERS), abs=2e-4)
    assert (linear_moments(point[None], CORNERS[None], (0,))[0, :, 0] == found[:, 0]).all()
    assert found[:, 1] + found[:, 3] == pytest.approx(found[:, 0], rel=1e-12)


def test_moments_turn_with_the_triangle_and_do_not_depend_on_its_orientation():
    point = np.array([0.1, 0.2])
    found = linear_moments(point[None], CORNERS[None])[0]
    assert linear_moments(point[None], CORNERS[None, ::-1])[0][::-1] == pytest.approx(found, abs=1e-12)
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
    turned = linear_moments(point[None] @ quarter.T, CORNERS[None] @ quarter.T)[0]
    expected = found[:, [0, 3, 2, 1, 5, 4]] * [1, 1, -1, 1, -1, 1]
    assert turned == pytest.approx(expected, abs=1e-12)


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


@pytest.mark.slow
def test_normal_block_is_the_frictionless_compliance(reference):
    n = len(reference.patch.xy)
    for specimen in (HalfSpace(0.3, 0.2), Block(0.3, 4.0)):
        found = traction_compliance(reference.patch, specimen)[:n, :n]
        assert found == pytest.approx(reference.specimen_compliance(specimen), rel=1e-9, abs=1e-10)


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


def test_pressure_draws_a_half_space_in_and_pushes_an_incompressible_layer_out(disc):
    """The finger's slip along the specimen is minus the specimen's own displacement."""
    patch = disc(3.0, 6)
    n = len(patch.xy)
    pressure = np.zeros(3 * n)
    pressure[:n] = np.hypot(*patch.xy.T) < 1.0
    far = np.flatnonzero((patch.xy[:, 1] == 0) & (patch.xy[:, 0] > 1.5))
    assert (traction_compliance(patch, HalfSpace(1.0, 0.2)) @ pressure)[n + far].min() > 0
    assert (traction_compliance(patch, Block(1.0, 2.0, 0.5)) @ pressure)[n + far].max() < 0


def test_a_thick_block_is_a_half_space(disc):
    patch = disc(2.0, 5)
    half, thick = (traction_compliance(patch, specimen) for specimen in (HalfSpace(0.7, 0.4), Block(0.7, 4e4, 0.4)))
    assert thick == pytest.approx(half, abs=1e-4 * half.max())
