"""Compliance of the specimen: exact potentials of triangles, the loaded disc, images, smooth kernels."""

import numpy as np
import pytest
from scipy.integrate import quad

from papilla.fem.reduction.compliance import PatchSurface, kernel_compliance, linear_moments
from papilla.model.specimen import Block, HalfSpace
from papilla.references import uniform_disc_mean_displacement

TRIANGLES = np.array(
    [[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[0.3, -0.2], [-0.9, 0.4], [0.5, 1.6]], [[0.0, 0.0], [3.0, 0.1], [1.4, 0.3]]]
)
PLACES = {
    "centroid": [1 / 3, 1 / 3, 1 / 3],
    "inside": [0.7, 0.2, 0.1],
    "vertex": [0.0, 1.0, 0.0],
    "edge": [0.4, 0.6, 0.0],
    "edge's line": [1.7, -0.7, 0.0],
    "outside": [1.2, 0.3, -0.5],
    "far": [20.0, -12.0, -7.0],
}


def polar_potentials(point, corners):
    """int hat / r over a triangle as sums over its edges: in each fan from the point, r cancels; `quad` does the rest.

    With x = p + u (s(v) - p) over an edge's points s(v): int hat / r = int |cross| / |s - p| (hat(p) + hat(s)) / 2 dv.
    """
    to_hats = np.linalg.inv(np.column_stack([corners, np.ones(3)]).T)
    total = np.zeros(3)
    for k in range(3):
        start, end = corners[k] - point, corners[(k + 1) % 3] - point
        cross = start[0] * end[1] - start[1] * end[0]
        length = np.linalg.norm(end - start)
        if abs(cross) < 1e-14 * length**2:
            continue
        foot = np.clip(-start @ (end - start) / length**2, 0, 1)
        for i in range(3):

            def integrand(v, i=i, start=start, end=end, cross=cross):
                s = start + v * (end - start)
                hats = to_hats @ np.append(point, 1) + to_hats @ np.append(point + s, 1)
                return cross * hats[i] / 2 / np.hypot(*s)

            breaks = [foot] if 0 < foot < 1 else None
            total[i] += quad(integrand, 0, 1, points=breaks, epsabs=1e-13, epsrel=1e-12, limit=200)[0]
    orientation = np.sign(np.linalg.det(corners[1:] - corners[0]))
    return orientation * total


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("triangle", range(len(TRIANGLES)))
def test_potentials_of_a_triangle(triangle, place):
    corners = TRIANGLES[triangle]
    point = np.array(PLACES[place]) @ corners
    found = linear_moments(point[None], corners[None])[0, :, 0]
    assert found == pytest.approx(polar_potentials(point, corners), rel=1e-9, abs=1e-11)


@pytest.mark.parametrize("quarter", [True, False])
def test_a_polynomial_kernel_is_integrated_exactly(disc, quarter):
    """int int |x - y|^2 = 2 A int |x|^2 over a disc about its centre."""
    patch = disc(3.0, 4, lambda x, y: x**2 + y**2, quarter=quarter)
    count = len(patch.images)
    matrix = kernel_compliance(patch, lambda r: r**2)
    assert count * matrix.sum() == pytest.approx(2 * count**2 * patch.mass.sum() * patch.gap.sum(), rel=1e-12)
    assert (matrix == matrix.T).all()


def traction_compliance(patch, specimen):
    return specimen.traction_compliance(PatchSurface(patch))


def parts(matrix, n):
    return matrix.reshape(3, n, 3, n)


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
