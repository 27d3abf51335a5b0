"""Softness: what a unit, a mirror, more samples or more noise make of it, as closed forms have it."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.calibration import BicubicSurface, GaugeSurface
from papilla.estimators import Doubts, GaugeSoftness
from papilla.estimators.softness.touch import contact_N

NOISE = {"gauge_sigma": 50.0, "force_sigma_N": 0.005}
PRESS = 0.2 + 0.6 * np.sin(np.linspace(0.1, 1.6, 64))


def rows_of(found, modulus=0.2, force=PRESS, noise=50.0, seed=0):
    """(n, 6) samples of a press; the force is exact."""
    readings = found.predict_readings(force, modulus)
    return np.column_stack([readings + noise * np.random.default_rng(seed).standard_normal(readings.shape), force])


def told(found, rows, doubts=Doubts.NONE, **noise):
    return GaugeSoftness(found, **(NOISE | noise), doubts=doubts).process(rows)


def rescaled(found, reading=1.0, modulus=1.0):
    """The calibration of a finger whose gauges tell so much more, of specimens so much harder."""
    gauges = []
    for gauge in found.gauges:
        old = gauge.surface
        limits = tuple(modulus * end for end in old.modulus_MPa)
        surface = BicubicSurface(old.force_N, limits, reading * np.asarray(old.coefficients))
        known = replace(gauge.uncertainty, scatter=reading * np.asarray(gauge.uncertainty.scatter))
        gauges.append(GaugeSurface(gauge.name, surface, known))
    return replace(found, gauges=tuple(gauges))


def test_the_unit_of_the_readings_does_not_matter(five):
    """A power of two, so that nothing is rounded otherwise."""
    found = five(0.01)
    doubts = Doubts(zero_microstrain=200.0)
    rows = rows_of(found)
    once = told(found, rows, doubts)
    rows[:, :5] *= 1024.0
    other = told(rescaled(found, 1024.0), rows, replace(doubts, zero_microstrain=200.0 * 1024), gauge_sigma=50.0 * 1024)
    np.testing.assert_allclose(other.modulus_MPa, once.modulus_MPa, rtol=1e-9)
    np.testing.assert_allclose(other.modulus_sigma_MPa, once.modulus_sigma_MPa, rtol=1e-9)
    np.testing.assert_array_equal(other.status, once.status)


@pytest.mark.parametrize("doubts", [Doubts.NONE, Doubts()], ids=["sure", "doubting"])
def test_a_finger_and_its_mirror_image_feel_the_same(five, doubts):
    found = five(0.01)
    rows = rows_of(found, seed=3)
    once, other = told(found, rows, doubts), told(found, rows[:, [4, 3, 2, 1, 0, 5]], doubts)
    np.testing.assert_allclose(other.modulus_MPa, once.modulus_MPa, rtol=1e-9)
    np.testing.assert_allclose(other.modulus_sigma_MPa, once.modulus_sigma_MPa, rtol=1e-9)


def test_sigma_grows_with_the_noise_and_falls_with_the_root_of_the_samples(five_gauges):
    force = np.full(256, 0.4)
    exact = rows_of(five_gauges, force=force, noise=0.0)
    sigma = told(five_gauges, exact).modulus_sigma_MPa
    assert sigma[[3, 15, 64]] * np.sqrt([4, 16, 64]) == pytest.approx(4 * sigma[15], rel=0.02)
    assert sigma[255] * 16 == pytest.approx(4 * sigma[15], rel=0.1)
    double = told(five_gauges, exact, gauge_sigma=100.0, force_sigma_N=0.01).modulus_sigma_MPa
    assert double[255] == pytest.approx(2 * sigma[255], rel=0.02)


@pytest.mark.parametrize("calibrated_mm", [1.0, 4.0])
def test_an_unknown_thickness_is_as_doubtful_as_the_block_it_may_be_is_thin(calibrated_mm):
    """f^0.72 (h^-1.5 - h0^-1.5): thin blocks press as one another with all lengths halved."""
    mean, sigma = Doubts().thickness_shift(calibrated_mm)
    assert mean == 0.0 and sigma == pytest.approx(Doubts().thickness_shift(calibrated_mm / 2)[1] / 2**1.5)
    assert Doubts().thickness_shift(10.0)[1] == pytest.approx(10.2 * (3**-1.5 - 10**-1.5) / 1.7)
    stated = Doubts(thickness_mm=5.0, thickness_error=0.1)
    step = 1e-4
    slope = (replace(stated, thickness_mm=5 + step).thickness_shift(10.0)[0] - stated.thickness_shift(10.0)[0]) / step
    mean, sigma = stated.thickness_shift(10.0)
    assert sigma == pytest.approx(np.hypot(0.5 * slope, 0.1 * mean), rel=1e-3) and mean > 0
    assert stated.thickness_shift(5.0)[0] == 0.0 and Doubts(thickness_mm=20.0).thickness_shift(10.0)[0] < 0


@pytest.mark.parametrize("factor", [0.01, 1.0, 3.0])
def test_the_least_force_of_a_contact_follows_the_finger(five, factor):
    """20 mN of the default finger; the calibration of another one states the factor of its forces."""
    found = five(0.01)
    other = replace(found, finger=found.finger | {"force_factor": factor})
    assert contact_N(found) == 0.02 and contact_N(other) == pytest.approx(factor * contact_N(found))
    rows = rows_of(found)
    given = GaugeSoftness(other, **NOISE, contact_force_N=factor * 0.02, doubts=Doubts.NONE).process(rows)
    np.testing.assert_array_equal(told(other, rows).status, given.status)
