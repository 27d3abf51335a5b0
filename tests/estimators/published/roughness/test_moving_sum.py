"""Sums over a sliding window: blocks are single values bit for bit, and no rounding error stays."""

import math

import numpy as np
import pytest

from papilla.errors import InputError
from papilla.estimators.published.roughness.moving_sum import MovingSum


@pytest.mark.parametrize("length", [1, 2, 7, 40])
@pytest.mark.parametrize("start", [math.nan, 0.0])
def test_blocks_are_single_values_bit_for_bit(length, start):
    generator = np.random.default_rng(length)
    single, block = MovingSum(length, start), MovingSum(length, start)
    for count in (1, 3, length, 2, 5 * length + 1, length - 1 or 1, 2 * length):
        values = generator.normal(size=count) * 10.0 ** generator.integers(-8, 12, count)
        values[generator.random(count) < 0.2] = math.nan
        expected = []
        for value in values.tolist():
            single.push(value)
            expected.append((single.total, single.known))
        totals, known = block.extend(values)
        assert list(zip(totals.tolist(), known.tolist(), strict=True)) == expected
        assert repr(block.state) == repr(single.state)


def test_it_is_the_sum_of_the_window_and_a_spike_leaves_nothing_behind():
    values = np.random.default_rng(0).uniform(0, 1, 500)
    moving = MovingSum(30)
    totals, known = moving.extend(values)
    assert known[10] == 11 and known[-1] == 30
    assert totals[10] == pytest.approx(values[:11].sum())
    assert totals[-1] == pytest.approx(values[-30:].sum(), rel=1e-12)
    moving.push(1e18)
    moving.extend(np.zeros(60))
    assert moving.total == 0.0
    with pytest.raises(InputError, match="ring holds 30 samples, the window is 31"):
        MovingSum(31).state = moving.state
