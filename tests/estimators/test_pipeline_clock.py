"""The clock of a pipeline: gaps, repeats, drift, and the path whatever the clock does."""

import math

import numpy as np
import pytest

from papilla.estimators.pipeline import path
from papilla.estimators.pipeline.clock import Clock, ClockStatus

NAN = math.nan


def ticks(rate, times, velocities=None, positions=None):
    clock = Clock(rate)
    nothing = [NAN] * len(times)
    return [clock.tick(*sample) for sample in zip(times, velocities or nothing, positions or nothing, strict=True)]


def test_the_path_is_the_integral_over_the_time_that_passed():
    rng = np.random.default_rng(1)
    time = 36_000 + np.cumsum(rng.uniform(0.2e-3, 1.8e-3, 4000))
    velocity = 100 * np.sin(7 * time)
    found = np.array(path(Clock(1000.0), time.tolist(), velocity.tolist(), None))
    expected = np.concatenate([[0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time))])
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_velocities_from_positions_lead_from_place_to_place():
    """However uneven the clock is, and through a gap."""
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.uniform(0.5e-3, 1.4e-3, 500))
    time[300:] += 0.02
    position = 20 * np.sin(5 * time)
    found = ticks(1000.0, time.tolist(), None, position.tolist())
    assert math.isnan(found[0].velocity_mm_s)
    velocity = [tick.velocity_mm_s for tick in found[1:]]
    np.testing.assert_allclose(velocity, np.diff(position) / np.diff(time), rtol=1e-9)


def test_gaps_repeats_and_long_gaps():
    found = ticks(100.0, [5.0, 5.01, 5.01, 5.004, 5.06, 5.07, 7.0, 7.01, 3.0], [10.0] * 9)
    kinds = [ClockStatus(tick.status).name for tick in found]
    assert kinds == ["OK", "OK", "REPEATED", "REPEATED", "GAP", "OK", "BEGUN_ANEW", "OK", "BEGUN_ANEW"]
    assert [tick.missing for tick in found] == [0, 0, 0, 0, 4, 0, 0, 0, 0]
    assert found[4].place_mm == pytest.approx(0.6), "the path goes on through the gap"
    assert found[4].velocity_mm_s == 10.0
    assert found[6].place_mm == 0.0 and found[8].place_mm == 0.0
    assert all(status.sentence for status in ClockStatus)


def test_a_time_that_is_missing_counts_as_one_period():
    found = ticks(100.0, [1.0, NAN, math.inf, 1.03, NAN], [10.0] * 5)
    assert [tick.status for tick in found] == [ClockStatus.OK] * 5
    assert [tick.place_mm for tick in found] == pytest.approx([0, 0.1, 0.2, 0.3, 0.4])


@pytest.mark.parametrize("true_rate", [700.0, 1300.0, 35.6])
def test_another_rate_than_stated_is_told(true_rate):
    time = np.arange(400) / true_rate
    late = ticks(1000.0, time.tolist(), [1.0] * 400)[-100:]
    assert {tick.status for tick in late} == {ClockStatus.OTHER_RATE}
    near = ticks(1000.0, (np.arange(400) / 1020.0).tolist(), [1.0] * 400)
    assert {tick.status for tick in near} == {ClockStatus.OK}


@pytest.mark.parametrize("late_s, status", [(1.0005, ClockStatus.GAP), (1.0015, ClockStatus.BEGUN_ANEW)])
def test_a_second_without_samples_is_the_longest_gap(late_s, status):
    assert ticks(1000.0, [0.0, late_s], [10.0] * 2)[-1].status == status
    assert ticks(1000.0, [2.0, 2.0 - 0.999, 2.0 - 1.001], [10.0] * 3)[-1].status == ClockStatus.BEGUN_ANEW


@pytest.mark.parametrize("begin", [-1e4, 0.0, 1e4])
@pytest.mark.parametrize("rate", [1000.0, 50_000.0])
def test_the_slope_is_over_the_last_ten_milliseconds_or_64_samples(rate, begin):
    """Wherever the path begins; of x = t^2 a slope over a time T is 2 t - T."""
    time = 100.0 + np.arange(1000) / rate
    place = begin + 1e3 * (time - 100.0) ** 2
    clock = Clock(rate)
    found = [clock.tick(t, NAN, x) for t, x in zip(time.tolist(), place.tolist(), strict=True)][-1]
    over = min(0.01, 63 / rate)
    assert found.slope_mm_s == pytest.approx(1e3 * (2 * (time[-1] - 100.0) - over), rel=0.01)
    assert len(clock.state.trail) - round(over * rate) in (0, 1)
    # After a gap the slope is that over the gap.
    later = clock.tick(time[-1] + 0.5, NAN, place[-1] + 3.0)
    assert (later.slope_mm_s, later.velocity_mm_s) == pytest.approx((6.0, 6.0))


@pytest.mark.parametrize("every", [0.01, 0.016, 0.0156])
def test_packets_that_share_a_stamp_are_spread_evenly(every):
    """Half of the first packet and the second tell nothing yet; doubled rows are no packets."""
    true = 3.0 + 0.005 + np.arange(2000) / 1000
    clock = Clock(1000.0)
    found = [clock.tick(stamp, 50.0, NAN) for stamp in (np.floor(true / every + 1e-9) * every).tolist()]
    late = found[60:]
    assert {tick.status for tick in late} == {ClockStatus.OK} and clock.state.stamps[2] == pytest.approx(every)
    off = np.array([tick.time_s for tick in late]) - true[60:]
    assert np.ptp(off) < 1e-3
    places = np.array([tick.place_mm for tick in late])
    np.testing.assert_allclose(places - places[0], 50 * (true[60:] - true[60]), atol=0.05)
    doubled = ticks(1000.0, np.repeat(true, 2).tolist())
    assert [tick.status for tick in doubled[1::2]] == [ClockStatus.REPEATED] * 2000


@pytest.mark.parametrize("span_s, packets", [(0.0438, True), (0.0446, False), (0.0362, True), (0.0354, False)])
def test_samples_are_packets_if_as_many_as_fit_the_rate_within_a_tenth_share_a_stamp(span_s, packets):
    clock = Clock(1000.0)
    for stamp in np.repeat(np.arange(20) * span_s, 40).tolist():
        clock.tick(stamp, NAN, NAN)
    assert (clock.state.stamps[2] > 0) == packets
