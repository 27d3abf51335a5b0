"""The published form: refit, exact inverse, stated errors, and what the fit confesses."""

import numpy as np
import pytest

from papilla.calibration.published import PUBLISHED_FORWARD, fit_quadratic
from papilla.core.errors import InputError
from papilla.core.units import gf_to_newton

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


def test_a_term_below_two_standard_errors_is_named():
    """The scatter of 3.0 makes c uncertain by about 8: at 1.9 of its errors it is named, at 2.1 it is not."""
    force, modulus, sd = table((-0.03, 14.5, 0.0, 104.5, -81.9))
    noise = np.random.default_rng(2).normal(scale=3, size=len(sd))
    first = fit_quadratic(force, modulus, sd + noise)
    for ratio, named in ((1.9, True), (2.1, False), (-1.9, True), (-2.1, False)):
        sd_moved = sd + noise + (ratio * first.stderr[2] - first.coefficients[2]) * modulus**2
        found = fit_quadratic(force, modulus, sd_moved)
        assert found.coefficients[2] / found.stderr[2] == pytest.approx(ratio)
        note = next((note for note in found.notes if note.startswith("not distinguishable from zero")), "")
        assert ("E2" in note) is named and "f2" not in note


def test_misfit_is_residuals_alike_between_neighbouring_forces():
    """Residuals of a period of 8 forces are misfit (squared steps 0.6 of theirs), of 5 or 2 not; any order."""
    force, modulus, sd = table(PUBLISHED_FORWARD)
    place = np.tile(np.arange(len(FORCE_GF)), len(MODULI))
    mixed = np.random.default_rng(0).permutation(len(sd))
    for residual, misfit in (
        ((-1.0) ** place, False),
        (np.cos(np.pi * place / 4), True),
        (np.cos(np.pi * place / 2.5), False),
    ):
        notes = fit_quadratic(force[mixed], modulus[mixed], (sd + residual)[mixed]).notes
        assert any("misfit" in note for note in notes) is misfit
