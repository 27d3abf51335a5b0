"""The published form: refit, exact inverse, stated errors, and what the fit confesses."""

import numpy as np
import pytest

from papilla.calibrate.published_form import PUBLISHED_FORWARD, fit_quadratic
from papilla.errors import InputError
from papilla.units import gf_to_newton

FORCE_GF, MODULI = np.linspace(5, 100, 12), np.linspace(0.089, 0.72, 6)


def table(coefficients, force=FORCE_GF, moduli=MODULI):
    a, b, c, d, e = coefficients
    f, E = (part.ravel() for part in np.meshgrid(force, moduli))
    return gf_to_newton(f), E, a * f**2 + b * f + c * E**2 + d * E + e


def test_exact_data_give_the_coefficients_back():
    force, modulus, sd = table(PUBLISHED_FORWARD)
    found = fit_quadratic(force, modulus, sd)
    np.testing.assert_allclose(found.coefficients, PUBLISHED_FORWARD, rtol=1e-10)
    assert found.rms < 1e-9 and found.modulus_MPa == (0.089, pytest.approx(0.72))
    np.testing.assert_allclose(found(force / gf_to_newton(1), modulus), sd, rtol=1e-12)


def test_units_do_not_matter():
    force, modulus, sd = table(PUBLISHED_FORWARD)
    noisy = sd + np.random.default_rng(1).normal(size=len(sd))
    found, scaled = fit_quadratic(force, modulus, noisy), fit_quadratic(force, modulus, 1e9 * noisy)
    np.testing.assert_allclose(scaled.coefficients, 1e9 * found.coefficients, rtol=1e-12)
    assert scaled.condition == found.condition


def test_standard_errors_cover_as_often_as_they_say():
    """400 noisy refits: 68 % of the coefficients within one standard error, 95 % within 1.96."""
    rng = np.random.default_rng(3)
    force, modulus, sd = table(PUBLISHED_FORWARD)
    scores = []
    for _ in range(400):
        found = fit_quadratic(force, modulus, sd + rng.normal(scale=4, size=len(sd)))
        scores.append((found.coefficients - PUBLISHED_FORWARD) / found.stderr)
    scores = np.abs(scores)
    assert np.mean(scores < 1, axis=0) == pytest.approx([0.683] * 5, abs=0.07)
    assert np.mean(scores < 1.96, axis=0) == pytest.approx([0.95] * 5, abs=0.035)


def test_three_moduli_leave_no_freedom_and_it_says_so():
    found = fit_quadratic(*table(PUBLISHED_FORWARD, moduli=[0.089, 0.51, 0.72]))
    assert any("three moduli" in note and "exact interpolation" in note for note in found.notes)


def test_two_moduli_do_not_determine_the_terms():
    with pytest.raises(InputError, match="do not determine the terms E2, E, 1"):
        fit_quadratic(*table(PUBLISHED_FORWARD, moduli=[0.1, 0.5]))
    with pytest.raises(InputError, match="f2, f, 1"):
        fit_quadratic(*table(PUBLISHED_FORWARD, force=[50.0]))


def test_five_presses_have_no_error_bars():
    force, modulus, sd = (column[[0, 5, 11, 30, 71]] for column in table(PUBLISHED_FORWARD))
    found = fit_quadratic(force, modulus, sd)
    assert np.isnan(found.stderr).all()
    assert any("no error bars" in note for note in found.notes)
    with pytest.raises(InputError, match="at least five presses, got 4"):
        fit_quadratic(force[:4], modulus[:4], sd[:4])


def test_only_published_moduli_are_fitted_where_there_are_enough():
    force, modulus, sd = table(PUBLISHED_FORWARD, moduli=[0.01, 0.089, 0.3, 0.72, 4.0])
    sd = np.where((modulus < 0.089) | (modulus > 0.72), 1e6, sd)
    np.testing.assert_allclose(fit_quadratic(force, modulus, sd).coefficients, PUBLISHED_FORWARD, rtol=1e-9)
    outside = fit_quadratic(*table(PUBLISHED_FORWARD, moduli=[1.0, 2.0, 3.0, 4.0]))
    assert outside.modulus_MPa == (1.0, 4.0) and any("all are fitted" in note for note in outside.notes)


def test_misfit_is_confessed(calibration):
    assert any("misfit, not noise" in note for note in calibration.forward.notes)
