"""The pressure profile of a contact ellipse: its moments, its peak, and its energy on a half-space."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import jv

from papilla.fem.pressing.ellipses import (
    FLATTEST_Q,
    HALF_SPACE_ENERGY,
    SECOND_MOMENTS,
    SHARPEST_Q,
    SIXTH_MOMENTS,
    layer_factor,
    mean_square,
    peak_over_mean,
)


@pytest.mark.parametrize("q", [-1.2, -0.3, 0.0, 0.4, 0.9])
def test_moments(q):
    """Over the disc, d(area) / area is du; u = 1 - t^2."""
    for power, (first, second) in zip((0, 1, 3), [(1, 1), SECOND_MOMENTS, SIXTH_MOMENTS], strict=True):
        found = quad(lambda u, n=power: u**n * layer_factor(np.sqrt(1 - u), q), 0, 1)[0]
        assert found == pytest.approx((1 - q) * first + q * second, rel=1e-6)
    assert mean_square(q) == pytest.approx((1 - q) * SECOND_MOMENTS[0] + q * SECOND_MOMENTS[1])


@pytest.mark.parametrize("q", [FLATTEST_Q, -0.9, -0.3, 0.0, 0.5, SHARPEST_Q])
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
