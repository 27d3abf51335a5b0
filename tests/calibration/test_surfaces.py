"""Surfaces against SciPy's B-splines and finite differences, at random points, at nodes and at the domain's edges."""

import math

import numpy as np
import pytest
from scipy.interpolate import BSpline

from papilla.calibration import PositionTerms, SdSurface, SoftnessStatus, Uncertainty
from papilla.calibration.surface import Axis, BicubicSurface, inside, solve_cubic
from papilla.core.errors import InputError

FORCE, MODULUS, CELLS = (0.05, 1.0), (0.02, 5.0), (4, 5)


def spline(low, high, cells, values, derivative=0):
    """SciPy's weights (values, cells + 3) of the coefficients of a cubic B-spline on uniform cells."""
    step = (high - low) / cells
    knots = low + step * np.arange(-3, cells + 4)
    return np.column_stack(
        [BSpline(knots, np.eye(cells + 3)[k], 3)(values, derivative) for k in range(cells + 3)]
    )  # fmt: skip


@pytest.fixture(scope="module")
def surface():
    """Rising in both directions, and otherwise any."""
    rng = np.random.default_rng(1)
    shape = CELLS[0] + 3, CELLS[1] + 3
    rise = 0.6 * np.arange(shape[0])[:, None] + 0.4 * np.arange(shape[1])
    return BicubicSurface(FORCE, MODULUS, rise + rng.uniform(-0.12, 0.12, shape))


@pytest.fixture(scope="module")
def points():
    """(2, n) ln force and ln modulus: random ones, and all nodes."""
    rng = np.random.default_rng(2)
    nodes = [np.linspace(*np.log(ends), cells + 1) for ends, cells in ((FORCE, CELLS[0]), (MODULUS, CELLS[1]))]
    x, y = (part.ravel() for part in np.meshgrid(*nodes))
    return np.append(rng.uniform(*np.log(FORCE), 80), x), np.append(rng.uniform(*np.log(MODULUS), 80), y)


def expected(surface, x, y, along_x=0, along_y=0):
    left = spline(*np.log(FORCE), CELLS[0], x, along_x)
    right = spline(*np.log(MODULUS), CELLS[1], y, along_y)
    return np.einsum("na,ab,nb->n", left, surface.coefficients, right)


def test_values_and_slopes_are_those_of_the_spline(surface, points):
    x, y = points
    clipped = [np.clip(np.exp(v), *ends) for v, ends in ((x, FORCE), (y, MODULUS))]
    np.testing.assert_allclose(surface(*clipped), expected(surface, x, y), rtol=1e-12)
    for found, order in zip(surface.slopes(*clipped), ((1, 0), (0, 1)), strict=True):
        np.testing.assert_allclose(found, expected(surface, x, y, *order), rtol=1e-10, atol=1e-11)


def test_point_by_point_it_is_the_same(surface, points):
    x, y = points
    found = np.array([surface.spline.at(*pair)[..., 0] for pair in zip(x.tolist(), y.tolist(), strict=True)])
    for order in ((0, 0), (1, 0), (0, 1)):
        np.testing.assert_allclose(found[:, *order], expected(surface, x, y, *order), rtol=1e-10, atol=1e-11)
    step = math.log(FORCE[1] / FORCE[0]) / CELLS[0]
    places = math.log(FORCE[0]) + step * np.array([-0.5, 0.5, 1.5, 2.5, 3.5, 4.5])
    assert [surface.force_axis.cell(place) for place in places.tolist()] == [0, 0, 1, 2, 3, 3]


def test_nodes_lines_and_curves(surface):
    for x in np.linspace(*np.log(FORCE), 7).tolist():
        curve, nodes = surface.curve(x), np.log(surface.modulus_axis.nodes)
        exact = expected(surface, np.full(len(nodes), x), nodes)
        np.testing.assert_allclose(curve.values, exact, rtol=1e-12)
        for y in np.linspace(*np.log(MODULUS), 13).tolist():
            value, slope = surface.spline.at(x, y)[0, :, 0].tolist()
            assert slope > 0
            assert curve.solve(value, 0, CELLS[1]) == pytest.approx((y, slope), rel=1e-10, abs=1e-11)


def test_outside_the_domain_there_is_nothing(surface):
    assert np.isnan(surface([0.0499, 1.001, 0.5, 0.5], [0.1, 0.1, 0.0199, 5.001])).all()
    assert np.isfinite(surface([0.05, 1.0], [0.02, 5.0])).all()
    with pytest.raises(InputError, match="6 lies outside the surface's 0.02 to 5"):
        surface.modulus_axis.basis(np.array([1.0, 6.0]))


def test_basis_is_scipys_and_nodes_are_equal_steps_of_the_logarithm():
    axis, values = Axis.between(0.02, 5.0, 5), np.geomspace(0.02, 5.0, 23)
    np.testing.assert_allclose(axis.basis(values), spline(*np.log(MODULUS), 5, np.log(values)), atol=1e-12)
    np.testing.assert_allclose(axis.nodes, np.geomspace(0.02, 5.0, 6), rtol=1e-13)
    cell, _, within = axis.locate(np.array([0.01, 0.02, 5.0, 6.0]))
    assert cell.tolist() == [0, 0, 4, 0] and within.tolist() == [False, True, True, False]


@pytest.mark.parametrize(
    "force, coefficients, message",
    [
        (FORCE, np.zeros((3, 5)), "at least 4 x 4 .*got 3 x 5"),
        (FORCE, np.zeros((4, 4, 4)), "got 4 x 4 x 4"),
        (FORCE, np.pad([[math.nan]], ((3, 0), (3, 0))), "must be finite"),
        *(((low, high), np.zeros((4, 4)), "force_N must be a rising range above 0")
          for low, high in ((0.0, 1.0), (0.5, 0.5), (0.5, math.inf))),
    ],
)  # fmt: skip
def test_unusable_surfaces_are_refused(force, coefficients, message):
    assert BicubicSurface(FORCE, MODULUS, np.zeros((4, 4))).cells == (1, 1)
    with pytest.raises(InputError, match=message):
        BicubicSurface(force, MODULUS, coefficients)


def test_inside_allows_for_rounding_alone():
    assert inside(1.0, 1.0, 2.0) and inside(2.0, 1.0, 2.0) and inside(2 + 4e-15, 1.0, 2.0)
    assert inside(-2 - 4e-15, -2.0, 1.0) and inside(-1e-16, 0.0, 0.5)
    assert not inside(2 + 1e-13, 1.0, 2.0) and not inside(1 - 1e-13, 1.0, 2.0) and not inside(math.nan, 1.0, 2.0)


def test_usable_part_and_its_sides(surface):
    known = Uncertainty(1e-4, 1.96, 1e-4, np.array([0.1, 0.5]), np.zeros(2), 2.0, 0)
    usable = np.array([[1, 4], [0, 5], [2, 2], [0, 5]])
    twofold = np.full((4, 2), np.nan)
    centres = math.log(FORCE[0]) + math.log(FORCE[1] / FORCE[0]) / 4 * (np.arange(4) + 0.5)
    twofold[3] = surface.curve(float(centres[3])).values[1], surface.curve(float(centres[3])).values[2]
    sd = SdSurface(surface, usable, twofold, known)
    assert [sd.usable_nodes(x) for x in centres.tolist()] == [(1, 4), (0, 5), (2, 2), (0, 5)]
    first, middle = float(centres[0]), surface.curve(float(centres[0])).values[2]
    assert sd.ln_modulus(first, middle) == (pytest.approx(math.log(surface.modulus_axis.nodes[2])), SoftnessStatus.OK)
    assert sd.ln_modulus(first, surface.curve(first).values[0])[1] is SoftnessStatus.SOFTER
    assert sd.ln_modulus(first, surface.curve(first).values[5])[1] is SoftnessStatus.HARDER
    assert sd.ln_modulus(float(centres[2]), middle)[1] is SoftnessStatus.NOT_IDENTIFIABLE
    for node, status in ((1, "NOT_IDENTIFIABLE"), (2, "NOT_IDENTIFIABLE"), (3, "OK")):
        value = surface.curve(float(centres[3])).values[node]
        assert sd.ln_modulus(float(centres[3]), value)[1] is SoftnessStatus[status]


def test_change_is_that_of_the_spline_in_three_directions():
    rng = np.random.default_rng(3)
    terms = PositionTerms(FORCE, MODULUS, 2.0, rng.normal(size=(3, 5, 6, 7)), np.ones((3, 5)))
    assert terms.cells == (2, 3, 4) and terms.step_mm == 1.0
    force, modulus = np.exp(rng.uniform(*np.log(FORCE), 40)), np.exp(rng.uniform(*np.log(MODULUS), 40))
    place = np.append(rng.uniform(-2, 2, 35), [-2, -1, 0, 1, 2])
    weights = (
        spline(*np.log(FORCE), 2, np.log(force)),
        spline(*np.log(MODULUS), 3, np.log(modulus)),
        spline(-2.0, 2.0, 4, place),
    )
    exact = np.einsum("gabc,na,nb,nc->ng", terms.coefficients, *weights)
    np.testing.assert_allclose(terms.change(force, modulus, place), exact, rtol=1e-11, atol=1e-11)
    assert np.isnan(terms.change([0.5, 0.5, 0.04, 0.5], [1, 1, 1, 6], [2.01, -2.01, 0, 0])).all()
    assert terms.change(0.5, 1.0, [0.0, 1.0]).shape == (2, 3)


@pytest.mark.parametrize(
    "values, message",
    [
        ({"reach_mm": 0.0}, "must be greater than 0, got 0"),
        ({"coefficients": np.zeros((3, 5, 3, 7))}, "at least 4 x 4 x 4"),
        ({"error": np.ones((2, 5))}, "3 x 5 errors"),
        ({"error": np.pad([[-1.0]], ((0, 2), (0, 4)))}, "errors of at least 0"),
        ({"error": np.pad([[math.inf]], ((0, 2), (0, 4)))}, "must be finite"),
        ({"coefficients": np.pad([[[[math.inf]]]], ((0, 2), (0, 4), (0, 5), (0, 6)))}, "must be finite"),
    ],
)
def test_unusable_positions_are_refused(values, message):
    good = {"reach_mm": 2.0, "coefficients": np.zeros((3, 5, 6, 7)), "error": np.zeros((3, 5))}
    assert PositionTerms(FORCE, MODULUS, **good).cells == (2, 3, 4)
    with pytest.raises(InputError, match=message):
        PositionTerms(FORCE, MODULUS, **(good | values))


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
