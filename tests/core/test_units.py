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


SYMBOLS = {"N": 1.0, "S": 1.0, "MS": 1e-3, "US": 1e-6, "NS": 1e-9, "MIN": 60.0, "H": 3600.0, "MM": 1e-3, "UM": 1e-6,
           "CM": 1e-2, "MPA": 1e6, "KPA": 1e3, "MN": 1e-3, "STRAIN": 1.0, "MICROSTRAIN": 1e-6, "T_MM3": 1e12,
           "G_CM3": 1e3}  # fmt: skip
"""Units in those of the SI; N and mN as parts of a newton."""


def test_a_factor_is_the_ratio_of_the_units_in_its_name():
    ratios = [name.split("_PER_") for name in vars(units) if "_PER_" in name]
    assert len(ratios) > 12
    for per_unit, unit in ratios:
        expected = SYMBOLS[unit] / SYMBOLS[per_unit]
        assert getattr(units, f"{per_unit}_PER_{unit}") == pytest.approx(expected, rel=1e-15)
    powers = {"MILLI": -3, "MICRO": -6, "NANO": -9, "KILO": 3, "MEGA": 6}
    assert {name: getattr(units, f"SI_{name}") for name in powers} == {name: 10.0**n for name, n in powers.items()}
    assert units.INCH_MM * 5 == 127 and units.PER_CENT * 0.25 == 25 and 1 / units.SAMPLE_RATE_HZ == units.S_PER_MS
