"""The pressure profile of a contact ellipse: its moments, its peak, and its energy on a half-space."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import jv

from papilla.fem.pressing.ellipses import (
    FLATTEST,
    HALF_SPACE_ENERGY,
    SECOND,
    SHARPEST,
    SIXTH,
    layer_factor,
    mean_square,
    peak_over_mean,
)
from papilla.fem.pressing.hertz import _least_energy


@pytest.mark.parametrize("q", [-1.2, -0.3, 0.0, 0.4, 0.9])
def test_moments(q):
    """Over the disc, d(area) / area is du; u = 1 - t^2."""
    for power, (first, second) in zip((0, 1, 3), [(1, 1), SECOND, SIXTH], strict=True):
        found = quad(lambda u, n=power: u**n * layer_factor(np.sqrt(1 - u), q), 0, 1)[0]
        assert found == pytest.approx((1 - q) * first + q * second, rel=1e-6)
    assert mean_square(q) == pytest.approx((1 - q) * SECOND[0] + q * SECOND[1])


@pytest.mark.parametrize("q", [FLATTEST, -0.9, -0.3, 0.0, 0.5, SHARPEST])
def test_peak_and_sign(q):
    values = layer_factor(np.linspace(0, 1, 100_001), q)
    assert values.min() >= -1e-12
    assert peak_over_mean(q) == pytest.approx(values.max(), rel=1e-8)


def test_energy_on_a_half_space():
    """Integrals of the terms' Hankel transforms, (J_m(x) / x^m) with unit value at x = 0."""

    def transform(m, x):
        return [3.0, 15.0][m] * np.sqrt(np.pi / 2) * jv(m + 1.5, x) / x ** (m + 1.5)

    energy = [
        quad(lambda x, m=m, n=n: transform(m, x) * transform(n, x), 0, 200, limit=500)[0]
        for m, n in [(0, 0), (0, 1), (1, 1)]
    ]
    assert np.divide(energy, energy[0]) == pytest.approx(HALF_SPACE_ENERGY, rel=1e-5)


def test_the_least_energy_is_stationary_in_the_layer_term():
    """F^2 c(q) / 2 + F bend a^2 (1 - 2 q / 7), c the quadratic form of the pairs of terms: slope 0 in q."""
    moduli = [np.polynomial.Polynomial([0.0, slope, -0.02]) for slope in (0.30, 0.27, 0.24)]
    radius, bend = np.linspace(2.0, 4.0, 5), 0.01
    change, slope = (np.array([m(radius) for m in part]) for part in (moduli, [m.deriv() for m in moduli]))
    q, force, compliance = _least_energy(radius, 0.3, change, slope, 0.0, bend)
    c = [factor * 0.3 / (radius * np.exp(m(radius))) for factor, m in zip(HALF_SPACE_ENERGY, moduli, strict=True)]
    form = lambda q: (1 - q) ** 2 * c[0] + 2 * q * (1 - q) * c[1] + q**2 * c[2]  # noqa: E731
    np.testing.assert_allclose(compliance, form(q), rtol=1e-12)
    assert (np.abs(q) > 0.01).all() and (force > 0).all()
    energy = lambda q: force**2 * form(q) / 2 + force * bend * radius**2 * (1 - 2 * q / 7)  # noqa: E731
    slope = (energy(q + 1e-4) - energy(q - 1e-4)) / 2e-4
    np.testing.assert_allclose(slope / energy(q), 0, atol=0.005)
