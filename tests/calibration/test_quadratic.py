"""The published form and its exact inverse."""

import numpy as np
import pytest

from papilla.calibration.published import QuadraticInverse, invert_quadratic
from papilla.core.errors import InputError


def test_the_ends_of_the_rising_range_are_answered_and_nothing_beyond():
    inverse = QuadraticInverse(np.array([1.0, 0.0, 0.0, 0.0]), 0.0, 1, (0.2, 0.8))
    assert inverse(0.04, 10.0) == pytest.approx(0.2) and inverse(0.64, 10.0) == pytest.approx(0.8)
    assert np.isnan(inverse([0.0399, 0.6401, -1.0], 10.0)).all()


@pytest.mark.parametrize("sign", [1, -1])
def test_inverse_of_forward_is_the_identity_on_the_rising_branch(sign):
    """200 seeded quadratics; the answer outside the rising range is refused."""
    rng = np.random.default_rng(7)
    for _ in range(100):
        c = sign * rng.uniform(20, 200)
        # The turning point lies inside the range: only one side of it has an inverse.
        turn = rng.uniform(0.1, 0.7)
        coefficients = (rng.uniform(-0.1, 0.1), rng.uniform(5, 20), c, -2 * c * turn, rng.uniform(-100, 100))
        inverse = invert_quadratic(coefficients, (0.089, 0.72))
        assert inverse.branch == sign
        low, high = inverse.modulus_MPa
        assert (low, high) == (pytest.approx(turn), 0.72) if sign > 0 else (0.089, pytest.approx(turn))
        force, modulus = rng.uniform(5, 100, 50), rng.uniform(low + 0.02 * (high - low), high, 50)
        if sign < 0:
            modulus = rng.uniform(low, high - 0.02 * (high - low), 50)
        a, b, c, d, e = coefficients
        sd = a * force**2 + b * force + c * modulus**2 + d * modulus + e
        np.testing.assert_allclose(inverse(sd, force), modulus, rtol=1e-9)
        other = 2 * turn - modulus
        assert not np.isclose(inverse(sd, force), other).any()
        beyond = 0.9 if sign > 0 else 0.05
        assert np.isnan(inverse(a * 2500 + b * 50 + c * beyond**2 + d * beyond + e, 50.0))


def test_a_quadratic_that_falls_everywhere_has_no_inverse():
    inverse = invert_quadratic((0, 10, -50, 1, 0), (0.089, 0.72))
    assert inverse.modulus_MPa is None
    assert np.isnan(inverse(400.0, 50.0))
    with pytest.raises(InputError, match="E2 coefficient is 0"):
        invert_quadratic((0, 10, 0, 1, 0), (0.089, 0.72))
