"""When a gauge is stuck, saturated or missing, sample by sample."""

import math

import pytest

from papilla.errors import InputError
from papilla.estimators.health import MISSING, SATURATED, STUCK, GaugeHealth, words


def test_a_gauge_is_stuck_once_it_repeats_itself_fifty_times_while_another_moves():
    health = GaugeHealth(2, math.inf)
    assert [health.check((1.0, float(number))) for number in range(50)] == [()] * 50
    assert health.check((1.0, 50.0)) == (STUCK, 0)
    assert health.check((1.0, 50.0)) == (STUCK, 0), "at rest it stays so"
    assert health.check((1.5, 51.0)) == ()


def test_gauges_at_rest_together_are_not_stuck():
    health = GaugeHealth(2, math.inf, stuck_samples=3)
    assert [health.check((1.0, 2.0)) for _ in range(20)] == [()] * 20


def test_a_missing_reading_neither_moves_nor_repeats():
    health = GaugeHealth(2, 10.0, stuck_samples=2)
    assert health.check((1.0, math.nan)) == (0, MISSING)
    assert health.check((10.0, -10.0)) == (SATURATED, SATURATED)
    assert health.check((9.0, -9.0)) == ()
    assert words((MISSING, STUCK), ("a", "b")) == ["a missing", "b stuck"]


def test_another_number_of_gauges_is_refused():
    with pytest.raises(InputError, match="the state is of 3 gauges, this pipeline has 2"):
        GaugeHealth(2, 1.0).state = GaugeHealth(3, 1.0).state
