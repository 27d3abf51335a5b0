"""Where the top of a line is, and which lines are harmonics of which: by hand."""

import numpy as np
import pytest

from papilla.estimators.peaks import order_of, vertex
from papilla.estimators.spectrum import Line


@pytest.mark.parametrize("at", [-0.45, 0.0, 0.3])
def test_the_top_of_a_gaussian_is_found_exactly(at):
    powers = 7.0 * np.exp(-((np.array([-1, 0, 1]) - at) ** 2) / 1.3)
    assert vertex(powers) == pytest.approx(at, abs=1e-12)
    assert vertex(1e-3 * powers) == pytest.approx(at, abs=1e-12)


def test_without_a_top_it_is_the_middle():
    assert vertex([0.0, 1.0, 0.5]) == 0.0, "a power of nothing has no logarithm"
    assert vertex([1.0, 1.0, 1.0]) == 0.0 and vertex([2.0, 1.0, 3.0]) == 0.0


def test_a_harmonic_is_a_multiple_within_the_slack():
    """Three sigmas of the difference and a quarter of the resolution, but never a quarter of the fundamental."""
    fundamental = Line(1.0, 50.0, 1.0, 1e-9, 0.001)

    def order(wavenumber, sigma=0.001, resolution=0.04):
        return order_of(Line(wavenumber, 20.0, 0.5, 1e-6, sigma), fundamental, resolution)

    slack = 3 * np.hypot(0.001, 3 * 0.001) + 0.25 * 0.04
    assert order(3 + 0.99 * slack) == order(3 - 0.99 * slack) == 3
    assert order(3 + 1.01 * slack) == order(3 - 1.01 * slack) == 1
    assert order(1.0) == 1 and order(2.0) == 2 and order(12.0) == 12 and order(13.0) == 1
    assert order(2.24, sigma=1.0) == 2 and order(2.26, sigma=1.0) == 1
