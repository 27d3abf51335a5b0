"""The unit contract: conversions are exact, invert each other, and take arrays."""

import numpy as np
import pytest

from papilla.core import units


def test_gram_force_is_standard_gravity_times_a_gram():
    assert units.GRAM_FORCE_N == 9.80665e-3
    assert units.gf_to_newton(60) == pytest.approx(0.588399, rel=1e-15)
    assert units.newton_to_gf(0.588399) == pytest.approx(60, rel=1e-15)


def test_microstrain():
    assert units.to_microstrain(0.0025) == pytest.approx(2500, rel=1e-15)
    assert units.STRAIN_PER_MICROSTRAIN == 1e-6


def test_arrays_are_converted_element_by_element():
    force = np.array([[0.1, 1.0], [-2.0, np.nan]])
    there_and_back = units.gf_to_newton(units.newton_to_gf(force))
    assert there_and_back == pytest.approx(force, rel=1e-15, nan_ok=True)
    assert units.to_microstrain(force).shape == (2, 2)


@pytest.mark.parametrize("former", ["MS", "UM", "KPA"])
def test_former_names_of_factors_warn(former):
    with pytest.warns(DeprecationWarning, match=f"papilla.core.units.{former} is now"):
        assert getattr(units, former) == 1000.0
    with pytest.raises(AttributeError, match="has no attribute 'FURLONG'"):
        units.FURLONG  # noqa: B018
