"""When a gauge is stuck, saturated or missing, sample by sample."""

import math

import pytest

from papilla.core.errors import InputError
from papilla.estimators.health import FAULT_MISSING, FAULT_SATURATED, FAULT_STUCK, GaugeHealth, words


def found(health, *samples):
    """The faults at each sample of a stream."""
    state, faults = health.fresh, []
    for readings in samples:
        now, state = health.check(readings, state)
        faults.append(now)
    return faults


def test_a_gauge_is_stuck_once_it_repeats_itself_fifty_times_while_another_moves():
    moving = [(1.0, float(number)) for number in range(50)]
    faults = found(GaugeHealth(2, math.inf), *moving, (1.0, 50.0), (1.0, 50.0), (1.5, 51.0))
    assert faults == [()] * 50 + [(FAULT_STUCK, 0)] * 2 + [()], "at rest it stays so"


def test_gauges_at_rest_together_are_not_stuck():
    assert found(GaugeHealth(2, math.inf, stuck_samples=3), *[(1.0, 2.0)] * 20) == [()] * 20


def test_a_missing_reading_neither_moves_nor_repeats():
    faults = found(GaugeHealth(2, 10.0, stuck_samples=2), (1.0, math.nan), (10.0, -10.0), (9.0, -9.0))
    assert faults == [(0, FAULT_MISSING), (FAULT_SATURATED, FAULT_SATURATED), ()]
    assert words((FAULT_MISSING, FAULT_STUCK), ("a", "b")) == ["a missing", "b stuck"]


def test_another_number_of_gauges_is_refused():
    with pytest.raises(InputError, match="the state is of 3 gauges, this pipeline has 2"):
        GaugeHealth(2, 1.0).fits(GaugeHealth(3, 1.0).fresh)
