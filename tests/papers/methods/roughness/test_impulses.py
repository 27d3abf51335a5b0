"""Impulses counted and timed by hand: what a window of them says, at each limit."""

import math

import pytest

from papilla_papers.methods.roughness.impulses import Corpuscle, ImpulseCount, LastInterval, Threshold, Trigger
from papilla_papers.methods.roughness.stream import ALIASED_CODE, GAP_CODE, OK, SILENT_CODE

NAN = math.nan


def counted(impulses, speeds=50.0, paired=False, samples=20, per_period=2, fastest=math.inf):
    own = ImpulseCount(samples, 1000.0, per_period, paired, fastest)
    speeds = [speeds] * len(impulses) if isinstance(speeds, float) else speeds
    for impulse, speed in zip(impulses, speeds, strict=True):
        found = own.find(impulse, speed)
    return found


def of(count, missing=0, length=20):
    """So many impulses, of either edge, then samples without one, and some that cannot have one."""
    return [*([1.0, -1.0] * count)[:count], *[0.0] * (length - count - missing), *[NAN] * missing]


@pytest.mark.parametrize(
    "impulses, status",
    [
        (of(0), SILENT_CODE),
        (of(4), OK),
        (of(9), OK),
        (of(10), ALIASED_CODE),
        (of(4, 1), GAP_CODE),
        (of(4, 10), GAP_CODE),
    ],
)
def test_a_count_is_told_up_to_nine_tenths_of_what_a_window_can_hold(impulses, status):
    found = counted(impulses)
    assert found.status == status
    if status == OK:
        periods = sum(map(abs, impulses)) / 2
        assert found.frequency == pytest.approx(periods / 0.02) and found.distance == pytest.approx(50 * 0.02 / periods)


def test_samples_that_cannot_have_an_impulse_are_no_time():
    found = counted(of(6, 10))
    assert found.frequency == pytest.approx(3 / 0.010) and found.distance == pytest.approx(50 * 0.010 / 3)
    assert math.isnan(counted(of(6, 11)).frequency), "half of the window must be known"


def test_the_distance_is_by_the_speed_now_or_by_that_of_the_window():
    speeds = [20.0] * 10 + [80.0] * 10
    assert counted(of(4), speeds).distance == pytest.approx(80 * 0.02 / 2)
    assert counted(of(4), speeds, paired=True).distance == pytest.approx(50 * 0.02 / 2)
    speeds[:10] = [NAN] * 10
    assert counted(of(4), speeds, paired=True).distance == pytest.approx(80 * 0.02 / 2)
    assert counted(of(4), per_period=1).frequency == pytest.approx(4 / 0.02)
    for fastest, status in ((50.0, OK), (49.9, ALIASED_CODE)):
        assert counted(of(4), fastest=fastest).status == status


def timed(impulses, same_edge, speeds=50.0, samples=30, fastest=math.inf):
    own = LastInterval(samples, 1000.0, same_edge, fastest)
    speeds = [speeds] * len(impulses) if isinstance(speeds, float) else speeds
    return [own.find(impulse, speed) for impulse, speed in zip(impulses, speeds, strict=True)]


def at(*places, length=40):
    """Impulses at some samples: a negative place is of the falling edge."""
    found = [0.0] * length
    for place in places:
        found[abs(place)] = math.copysign(1.0, place)
    return found


def test_an_interval_is_between_the_last_two_impulses_of_any_edge_or_of_the_same():
    impulses = at(2, -7, 12, -17)
    any_edge, same = timed(impulses, False), timed(impulses, True)
    assert [any_edge[k].status for k in (2, 6, 7, 39)] == [SILENT_CODE, SILENT_CODE, OK, OK]
    assert [same[k].status for k in (7, 11, 12, 39)] == [SILENT_CODE, SILENT_CODE, OK, OK]
    assert any_edge[7].frequency == pytest.approx(1000 / 5) and same[12].frequency == pytest.approx(1000 / 10)
    assert any_edge[39].frequency == pytest.approx(200) and same[39].frequency == pytest.approx(100)
    assert any_edge[39].distance == pytest.approx(50 / 1000 * 5) and same[39].distance == pytest.approx(50 / 1000 * 10)


def test_an_interval_s_distance_is_that_travelled_or_by_the_speed_now():
    speeds = [20.0] * 8 + [80.0] * 32
    impulses = at(2, -5, 12)
    assert timed(impulses, True, speeds)[12].distance == pytest.approx((5 * 20 + 5 * 80) / 1000)
    assert timed(impulses, False, speeds)[12].distance == pytest.approx(7 * 80 / 1000)


def test_an_interval_is_held_for_a_window_and_two_samples_are_none():
    found = timed(at(2, 6, length=60), False)
    assert found[6 + 30].status == OK and found[6 + 31].status == SILENT_CODE and math.isnan(found[59].frequency)
    for apart, status in ((2, ALIASED_CODE), (3, OK)):
        assert timed(at(2, 2 + apart), False)[10].status == status
    for fastest, status in ((50.0, OK), (49.9, ALIASED_CODE)):
        assert timed(at(2, 6), False, fastest=fastest)[8].status == status


def test_a_trigger_fires_once_until_it_was_released():
    """Over 1.5 of the mean size; again only after it was at 0.5 of it or below."""
    own = Trigger(4, Threshold(1.5, 0.5))
    # Mean sizes of the last four: 1, 1, 1, 1.5, 1.75, 2, 1.4, 1.15, ...
    values = [1.0, 1.0, 1.0, 3.0, 2.0, 2.0, -0.6, 3.0, 3.0]
    fired = [own.fire(value) for value in values]
    assert fired == [0, 0, 0, 1, 0, 0, 0, 1, 0]
    assert math.isnan(own.fire(NAN)) and own.fire(3.0) == 0.0, "a missing one releases nothing"


def test_a_corpuscle_tells_edges_by_the_sign_of_the_slope():
    own = Corpuscle(10, Threshold(1.5, 1.5))
    fired = [own.fire(reading) for reading in (0.0, 0.1, 0.2, 1.2, 1.3, 1.4, 0.4)]
    assert math.isnan(fired[0]) and fired[3] == 1.0 and fired[6] == -1.0
    assert [abs(one) for one in fired[1:]] == [0, 0, 1, 0, 0, 1]
