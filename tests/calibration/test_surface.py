"""A surface: values, slopes and inverses, for arrays and for one point at a time."""

import numpy as np
import pytest

from papilla.calibration.surface import Axis, Surface, solve_cubic
from papilla.core.errors import InputError


@pytest.fixture(scope="module")
def surface():
    return Surface((0.1, 2.0), (0.05, 3.0), np.random.default_rng(11).normal(size=(8, 10)))


def points(surface, count=200):
    rng = np.random.default_rng(5)
    return (np.exp(rng.uniform(*np.log(limits), count)) for limits in (surface.force_N, surface.modulus_MPa))


def test_slopes_match_finite_differences(surface):
    force, modulus = points(surface)
    along_force, along_modulus = surface.slopes(force, modulus)
    step = 1e-6
    inside = (force * 1.01 < 2) & (force > 0.101) & (modulus < 2.97) & (modulus > 0.0505)
    up, down = np.exp(step), np.exp(-step)
    by_force = (surface(force * up, modulus) - surface(force * down, modulus)) / (2 * step)
    by_modulus = (surface(force, modulus * up) - surface(force, modulus * down)) / (2 * step)
    np.testing.assert_allclose(along_force[inside], by_force[inside], atol=1e-7)
    np.testing.assert_allclose(along_modulus[inside], by_modulus[inside], atol=1e-7)


def test_single_points_and_arrays_agree(surface):
    force, modulus = points(surface)
    pairs = zip(np.log(force).tolist(), np.log(modulus).tolist(), strict=True)
    rows = [surface.spline.at(*pair)[..., 0].ravel()[[0, 2, 1]] for pair in pairs]
    expected = np.column_stack([surface(force, modulus), *surface.slopes(force, modulus)])
    np.testing.assert_allclose(rows, expected, atol=1e-11)
    curve, nodes = surface.curve(float(np.log(force[0]))), surface.modulus_axis.nodes.clip(*surface.modulus_MPa)
    np.testing.assert_allclose(curve.values, surface(force[0], nodes), atol=1e-12)


def test_outside_the_domain_there_is_no_value(surface):
    assert np.isnan(surface([0.0999, 2.001, 0.5, 0.5, np.nan], [1, 1, 0.0499, 3.01, 1])).all()
    assert np.isfinite(surface([0.1, 2.0], [0.05, 3.0])).all()
    with pytest.raises(InputError, match="0.01 lies outside the surface's 0.1 to 2"):
        surface.force_axis.basis(np.array([0.5, 0.01]))


def test_unusable_surfaces_are_refused():
    with pytest.raises(InputError, match="at least 4 x 4 coefficients, got 3 x 5"):
        Surface((0.1, 1), (0.1, 1), np.zeros((3, 5)))
    with pytest.raises(InputError, match="modulus_MPa must be a rising range"):
        Surface((0.1, 1), (1, 1), np.zeros((4, 4)))
    with pytest.raises(InputError, match="must be finite"):
        Surface((0.1, 1), (0.1, 1), np.full((4, 4), np.nan))


def test_rising_cubics_are_inverted_to_rounding():
    """Among them cubics that are flat at an end or in the middle, where plain Newton would leave the cell."""
    rng = np.random.default_rng(2)
    for _ in range(300):
        root = rng.uniform(-0.5, 1.5)
        # Slope 3 k (u - root)^2 + small: rising everywhere, nearly flat at its inflection.
        k, small = rng.uniform(0.1, 2), 10 ** rng.uniform(-9, 0)
        cubic = (rng.normal(), 3 * k * root**2 + small, -3 * k * root, k)
        u = rng.uniform()
        value = cubic[0] + u * (cubic[1] + u * (cubic[2] + u * cubic[3]))
        found = solve_cubic(cubic, value)
        again = cubic[0] + found * (cubic[1] + found * (cubic[2] + found * cubic[3]))
        assert again == pytest.approx(value, abs=1e-14)
    assert solve_cubic((0.0, 1.0, 0.0, 0.0), -1e-18) == pytest.approx(0, abs=1e-15)


def test_axis_nodes_run_from_end_to_end():
    axis = Axis.between(0.1, 1.0, 7)
    assert axis.nodes[[0, -1]] == pytest.approx([0.1, 1.0], rel=1e-14)
    assert axis.basis(axis.nodes[1:-1]).sum(axis=1) == pytest.approx(np.ones(6), rel=1e-14)


def test_a_point_is_solved_for_what_the_surface_says():
    """ln S that rises with the modulus: the surface, and its curve along one force, give the modulus back."""
    x, y = np.linspace(0, 3, 9)[:, None], np.linspace(0, 4, 12)[None, :]
    surface = Surface((0.1, 2.0), (0.05, 3.0), 9 + 0.6 * x + 0.5 * y - 0.05 * y**2 + 0.02 * x * y)
    last = surface.cells[1]
    for force, modulus in zip(*points(surface, 50), strict=True):
        value, curve = surface(force, modulus), surface.curve(float(np.log(force)))
        found, slope = curve.solve(value, 0, last)
        assert found == pytest.approx(np.log(modulus), abs=1e-11)
        assert slope == pytest.approx(surface.slopes(force, modulus)[1], rel=1e-9)
        for node in (0, 5, last):
            expected = surface(force, surface.modulus_axis.nodes[node].clip(0.05, 3.0))
            assert curve.values[node] == pytest.approx(expected, abs=1e-11)
    for value, node in ((curve.values[0] - 1e-15, 0), (curve.values[last] + 1e-15, last)):
        assert curve.solve(value, 0, last)[0] == pytest.approx(np.log(surface.modulus_axis.nodes[node]), abs=1e-12)
