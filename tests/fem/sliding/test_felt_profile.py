"""The weak gap of a texture: averages over hats, against closed forms and quadrature."""

import numpy as np
import pytest

from papilla import Grating
from papilla.core.errors import InputError
from papilla.fem.sliding.felt_profile import FeltProfile


class Sine:
    """A texture of one wavelength that rises and falls by 0.1 mm."""

    span = (-np.inf, np.inf)

    def __init__(self, wavelength):
        self.wavelength = wavelength

    def recess(self, x):
        return 0.1 * (1 + np.cos(2 * np.pi * np.asarray(x) / self.wavelength))


class Slope:
    """A ramp from 0 to 10 mm without a period."""

    wavelength, span = None, (0.0, 10.0)

    def recess(self, x):
        return 0.3 * np.asarray(x)


EVEN = np.full((2, 2), 0.4)


@pytest.mark.parametrize("reach", [(-20.0, 20.0), (-0.5, 0.5)])
def test_a_hat_takes_its_share_of_a_sine_whether_it_is_tabulated_over_a_period_or_a_reach(reach):
    felt = FeltProfile.of(Sine(1.8), EVEN, reach)
    assert felt.period == (1.8 if reach[1] > 1 else 0.0)
    x = np.linspace(-0.45, 0.45, 50)
    u = np.pi * 0.4 / 1.8
    expected = 0.1 + 0.1 * (np.sin(u) / u) ** 2 * np.cos(2 * np.pi * x / 1.8)
    for shift in (0.0, 1.8, -3.6) if felt.period else (0.0,):
        # Straight lines between knots are off by the square of their distance times the curvature over 8: 3.3e-5 mm
        both = np.array([felt.recess(np.array([one, one]) + shift) for one in x])
        assert both == pytest.approx(np.column_stack([expected, expected]), abs=4e-5)


def test_the_mean_of_an_uneven_hat_lies_off_its_node():
    hats = np.array([[0.2, 0.5], [0.5, 0.2], [0.3, 0.3], [0.0, 0.4], [0.4, 0.0], [0.2, 0.5]])
    felt = FeltProfile.of(Slope(), hats, (-5.0, 15.0))
    assert len(felt.values) == 5, "one table for each kind of hat"
    # The centroid of a hat lies (right - left) / 3 beside its node
    at = np.full(len(hats), 4.0)
    assert felt.recess(at) == pytest.approx(0.3 * (4.0 + (hats[:, 1] - hats[:, 0]) / 3), abs=1e-4)
    assert felt.step <= 0.2 / 25, "25 knots in the narrowest side"


def test_a_period_must_be_two_elements_long_and_a_table_must_not_be_endless():
    assert FeltProfile.of(Sine(0.801), EVEN, (-5.0, 5.0)).period == 0.801
    with pytest.raises(InputError, match=r"wavelength 0.8 mm is not resolved by the skin's elements of 0.4 mm"):
        FeltProfile.of(Sine(0.8), EVEN, (-5.0, 5.0))
    with pytest.raises(InputError, match="too long for elements of 0.4 mm: slide less far"):
        FeltProfile.of(Sine(1e6), EVEN, (0.0, 17_000.0))
    assert FeltProfile.of(Grating(0.9, 0.9, 0.3), EVEN, (-5.0, 5.0)).period == pytest.approx(1.8)
