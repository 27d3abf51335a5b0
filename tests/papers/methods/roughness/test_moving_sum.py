"""Sums over a sliding window: exact but for rounding that does not stay."""

import math

import numpy as np
import pytest

from papilla_papers.methods.roughness.impulses import MovingSum


@pytest.mark.parametrize("length", [1, 2, 7, 40])
def test_it_is_the_sum_of_the_known_values_of_the_window(length):
    generator, moving = np.random.default_rng(length), MovingSum(length)
    values = generator.normal(size=200)
    values[generator.random(200) < 0.2] = math.nan
    for last, value in enumerate(values.tolist(), start=1):
        moving.push(value)
        window = values[max(last - length, 0) : last]
        assert moving.known == np.isfinite(window).sum()
        assert moving.total == pytest.approx(np.nansum(window), abs=1e-12)


def test_a_spike_leaves_nothing_behind():
    moving = MovingSum(30)
    for value in [0.1, 1e18, *[0.0] * 60]:
        moving.push(value)
    assert moving.total == 0.0
