"""The published regression and its printed inverse."""

from dataclasses import replace

import numpy as np
import pytest

from papilla import fem
from papilla.calibration import fit
from papilla.calibration.fitting.checking import PUBLISHED_POINTS, published_depths
from papilla.calibration.published import PUBLISHED_INVERSE, SPECIMENS_MPA, compare, published_sd, rounding_error
from papilla.model.finger import Bench, Finger
from papilla.model.specimen import HalfSpace


def test_two_printed_digits_cost_up_to_0046_MPa():
    error = rounding_error(PUBLISHED_INVERSE)
    assert error.largest_MPa == pytest.approx(0.046, abs=0.0005)
    assert error.rms_MPa == pytest.approx(0.019, abs=0.0005)
    on_specimens = rounding_error(PUBLISHED_INVERSE, SPECIMENS_MPA)
    assert (on_specimens.at_gf, on_specimens.at_MPa) == (100, 0.089)
    assert on_specimens.relative == pytest.approx(0.49, abs=0.005)


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
    assert [one.depth_mm for one in found] == sorted(one.depth_mm for one in found)


def test_comparison_finds_the_scale(truth):
    """A finger that follows the published regression in another unit agrees but for the scale."""

    def follow(force, modulus):
        return 25 * published_sd(force / 9.80665e-3, modulus) / truth.sd(force, modulus)

    sweep = truth.sweep(np.geomspace(0.089, 0.72, 20), np.geomspace(0.09, 1, 40), change=follow)
    found = compare(fit(sweep).predict)
    assert 1 / found.scale == pytest.approx(25, rel=1e-3)
    assert found.relative_rms < 1e-3
    assert found.scaled.shape == found.published.shape == (10, 3)


def test_published_depths_have_the_printed_numbers():
    """0.20 mm at 0.70 gf and 0.80 mm at 38.37 gf (2006), 1 mm at 0.6 N (2011)."""
    assert np.array(PUBLISHED_POINTS) == pytest.approx(np.array([[0.20, 0.00686466], [0.80, 0.3762812], [1.0, 0.6]]))
