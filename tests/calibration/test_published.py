"""The published form: as printed, refitted with its errors and notes, inverted exactly, and compared with a finger."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm
from spring_calibration import calibration as of_springs

from papilla import fem
from papilla.calibration import fit
from papilla.calibration.fitting.checking import PUBLISHED_POINTS, published_depths
from papilla.calibration.published import (
    PUBLISHED_FORWARD,
    PUBLISHED_INVERSE,
    SPECIMENS_MPA,
    QuadraticInverse,
    compare,
    compare_with_published,
    fit_quadratic,
    invert_quadratic,
    published_sd,
    rounding_error,
)
from papilla.calibration.readouts import two_ended
from papilla.core.errors import InputError
from papilla.core.units import gf_to_newton
from papilla.model.finger import Bench, Finger
from papilla.model.specimen import HalfSpace

FORCE_GF, MODULI = np.linspace(5, 100, 12), np.linspace(0.089, 0.72, 6)


def test_equation_9_at_a_point_worked_by_hand_and_the_printed_depths():
    # -0.0314 * 60^2 + 14.5 * 60 + 87.2 * 0.51^2 + 104.5 * 0.51 - 81.9
    assert published_sd(60.0, 0.51) == pytest.approx(-113.04 + 870.0 + 22.68072 + 53.295 - 81.9)
    # 0.20 mm at 0.70 gf and 0.80 mm at 38.37 gf (2006), 1 mm at 0.6 N (2011)
    assert np.array(PUBLISHED_POINTS) == pytest.approx(np.array([[0.20, 0.00686466], [0.80, 0.3762812], [1.0, 0.6]]))


def test_two_printed_digits_cost_up_to_0046_MPa():
    error = rounding_error(PUBLISHED_INVERSE)
    assert error.largest_MPa == pytest.approx(0.046, abs=0.0005)
    assert error.rms_MPa == pytest.approx(0.019, abs=0.0005)
    on_specimens = rounding_error(PUBLISHED_INVERSE, SPECIMENS_MPA)
    assert (on_specimens.at_gf, on_specimens.at_MPa) == (100, 0.089)
    assert on_specimens.relative == pytest.approx(0.49, abs=0.005)


def test_the_scale_is_that_of_least_squares():
    ours, theirs, scale = compare_with_published(of_springs().predict, [10.0, 37.0, 60.0, 100.0])
    assert ours.shape == theirs.shape == (4, 3)
    best = np.linalg.lstsq(ours.reshape(-1, 1), theirs.ravel(), rcond=None)[0][0]
    assert scale == pytest.approx(best, rel=1e-12)
    with pytest.raises(InputError, match="does not cover"):
        compare_with_published(of_springs().predict, [200.0])


def test_comparison_finds_the_scale_of_a_finger_that_follows_the_regression_in_another_unit(truth):
    def follow(force, modulus):
        return 25 * published_sd(force / 9.80665e-3, modulus) / truth.sd(force, modulus)

    found = compare(fit(truth.sweep(np.geomspace(0.089, 0.72, 20), np.geomspace(0.09, 1, 40), change=follow)).predict)
    assert 1 / found.scale == pytest.approx(25, rel=1e-3) and found.relative_rms < 1e-3
    assert found.scaled.shape == found.published.shape == (10, 3)


@pytest.mark.parametrize("half, shift", [(0.1, 0.01), (0.1, -0.2), (0.02, 1.0)])
def test_the_reach_beyond_two_truths_misses_either_in_5_percent(half, shift):
    sigma = half / norm.ppf(0.975)
    reach = two_ended(half, shift) / sigma
    assert norm.sf(reach) + norm.sf(reach + abs(shift) / sigma) == pytest.approx(0.05, abs=1e-9)
    assert two_ended(half, 0.0) == half and two_ended(0.0, shift) == 0.0


def test_depths_are_those_of_a_rigid_flat_and_the_benchs_touch_down():
    finger = replace(Finger.default(), bench=Bench(touch_down=0.15))
    reduced = fem.prepare(finger, size_mm=2.8)
    found = published_depths(finger, reduced)
    assert [(one.published_mm, one.force_N) for one in found] == list(PUBLISHED_POINTS)
    for one in found:
        alone = fem.press(reduced, HalfSpace(1e4), force=one.force_N, fidelity="contact")
        # Large strain takes about 1 % off, where it is known
        assert one.depth_mm - 0.15 == pytest.approx(alone.indentation, rel=0.05)
        assert one.error == pytest.approx(one.depth_mm / one.published_mm - 1)


@pytest.mark.parametrize("sign", [1, -1])
def test_inverse_of_forward_is_the_identity_on_the_rising_branch(sign):
    """Of seeded quadratics that turn inside the range: only one side has an inverse, and nothing beyond is answered."""
    rng = np.random.default_rng(7)
    for _ in range(100):
        c, turn = sign * rng.uniform(20, 200), rng.uniform(0.1, 0.7)
        coefficients = (rng.uniform(-0.1, 0.1), rng.uniform(5, 20), c, -2 * c * turn, rng.uniform(-100, 100))
        inverse = invert_quadratic(coefficients, (0.089, 0.72))
        low, high = inverse.modulus_MPa
        assert inverse.branch == sign
        assert (low, high) == (pytest.approx(turn), 0.72) if sign > 0 else (0.089, pytest.approx(turn))
        margin = 0.02 * (high - low)
        force, modulus = rng.uniform(5, 100, 50), rng.uniform(low + margin, high - margin, 50)
        np.testing.assert_allclose(inverse(np.dot(coefficients, terms(force, modulus)), force), modulus, rtol=1e-9)
        assert np.isnan(inverse(np.dot(coefficients, terms(50.0, 0.9 if sign > 0 else 0.05)), 50.0))


def test_the_ends_of_the_rising_range_are_answered_and_a_quadratic_that_falls_has_no_inverse():
    inverse = QuadraticInverse(np.array([1.0, 0.0, 0.0, 0.0]), 0.0, 1, (0.2, 0.8))
    assert inverse(0.04, 10.0) == pytest.approx(0.2) and inverse(0.64, 10.0) == pytest.approx(0.8)
    assert np.isnan(inverse([0.0399, 0.6401, -1.0], 10.0)).all()
    falling = invert_quadratic((0, 10, -50, 1, 0), (0.089, 0.72))
    assert falling.modulus_MPa is None and np.isnan(falling(400.0, 50.0))
    with pytest.raises(InputError, match="E2 coefficient is 0"):
        invert_quadratic((0, 10, 0, 1, 0), (0.089, 0.72))


def terms(f, E):
    return np.array([f**2, f, E**2, E, np.ones_like(f)])


def table(coefficients=PUBLISHED_FORWARD, force=FORCE_GF, moduli=MODULI):
    f, E = (part.ravel() for part in np.meshgrid(force, moduli))
    return gf_to_newton(f), E, np.dot(coefficients, terms(f, E))


def notes(*columns):
    return " | ".join(fit_quadratic(*columns).notes)


def test_exact_data_give_the_coefficients_back():
    force, modulus, sd = table()
    found = fit_quadratic(force, modulus, sd)
    np.testing.assert_allclose(found.coefficients, PUBLISHED_FORWARD, rtol=1e-10)
    assert found.rms < 1e-9 and found.modulus_MPa == (0.089, pytest.approx(0.72))
    np.testing.assert_allclose(found(force / gf_to_newton(1), modulus), sd, rtol=1e-12)


def test_standard_errors_cover_as_often_as_they_say():
    """400 noisy refits: 68 % of the coefficients within one standard error, 95 % within 1.96."""
    rng, scores = np.random.default_rng(3), []
    force, modulus, sd = table()
    for _ in range(400):
        found = fit_quadratic(force, modulus, sd + rng.normal(scale=4, size=len(sd)))
        scores.append(np.abs(found.coefficients - PUBLISHED_FORWARD) / found.stderr)
    assert np.mean(np.less(scores, 1), axis=0) == pytest.approx([0.683] * 5, abs=0.07)
    assert np.mean(np.less(scores, 1.96), axis=0) == pytest.approx([0.95] * 5, abs=0.035)


def test_few_moduli_forces_or_presses_are_refused_or_noted():
    assert "exact interpolation" in notes(*table(moduli=[0.089, 0.51, 0.72]))
    few = [column[[0, 5, 11, 30, 71]] for column in table()]
    assert np.isnan(fit_quadratic(*few).stderr).all() and "no error bars" in notes(*few)
    for columns, message in (
        (table(moduli=[0.1, 0.5]), "do not determine the terms E2, E, 1"),
        (table(force=[50.0]), "f2, f, 1"),
        ([column[:4] for column in few], "at least five presses, got 4"),
    ):
        with pytest.raises(InputError, match=message):
            fit_quadratic(*columns)


def test_only_published_moduli_are_fitted_where_there_are_enough():
    force, modulus, sd = table(moduli=[0.01, 0.089, 0.3, 0.72, 4.0])
    sd = np.where((modulus < 0.089) | (modulus > 0.72), 1e6, sd)
    np.testing.assert_allclose(fit_quadratic(force, modulus, sd).coefficients, PUBLISHED_FORWARD, rtol=1e-9)
    outside = table(moduli=[1.0, 2.0, 3.0, 4.0])
    assert fit_quadratic(*outside).modulus_MPa == (1.0, 4.0) and "all are fitted" in notes(*outside)


@pytest.mark.parametrize("ratio, named", [(1.9, True), (2.1, False), (-1.9, True), (-2.1, False)])
def test_a_term_below_two_standard_errors_is_named(ratio, named):
    force, modulus, sd = table((-0.03, 14.5, 0.0, 104.5, -81.9))
    sd = sd + np.random.default_rng(2).normal(scale=3, size=len(sd))
    first = fit_quadratic(force, modulus, sd)
    found = fit_quadratic(force, modulus, sd + (ratio * first.stderr[2] - first.coefficients[2]) * modulus**2)
    assert found.coefficients[2] / found.stderr[2] == pytest.approx(ratio)
    note = next((note for note in found.notes if note.startswith("not distinguishable from zero")), "")
    assert ("E2" in note) is named and "f2" not in note


@pytest.mark.parametrize("period, misfit", [(2, False), (5, False), (8, True)])
def test_misfit_is_residuals_alike_between_neighbouring_forces(period, misfit):
    """Squared steps are 0.6 of residuals of a period of 8 forces; in any order of the presses."""
    place = np.tile(np.arange(len(FORCE_GF)), len(MODULI))
    mixed = np.random.default_rng(0).permutation(len(place))
    force, modulus, sd = table()
    sd = sd + np.cos(2 * np.pi * place / period)
    assert ("misfit" in notes(force[mixed], modulus[mixed], sd[mixed])) is misfit
