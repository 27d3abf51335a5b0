"""Impulses counted and timed by hand: what a window of them says, at each limit."""

import math

import pytest

from papilla_papers.methods.roughness.impulses import Corpuscle, ImpulseCount, LastInterval, Threshold, Trigger
from papilla_papers.methods.roughness.stream import ALIASED_CODE, GAP_CODE, OK, SILENT_CODE

NAN = math.nan


def findings(reader, impulses, speeds=50.0):
    speeds = [speeds] * len(impulses) if isinstance(speeds, float) else speeds
    return [reader.find(impulse, speed) for impulse, speed in zip(impulses, speeds, strict=True)]


def counted(impulses, speeds=50.0, paired=False, per_period=2, fastest=math.inf):
    return findings(ImpulseCount(20, 1000.0, per_period, paired, fastest), impulses, speeds)[-1]


def timed(impulses, same_edge, speeds=50.0, fastest=math.inf):
    return findings(LastInterval(30, 1000.0, same_edge, fastest), impulses, speeds)


def of(count, missing=0, length=20):
    """So many impulses, of either edge, then samples without one, and some that cannot have one."""
    return [*([1.0, -1.0] * count)[:count], *[0.0] * (length - count - missing), *[NAN] * missing]


def at(*places, length=40):
    """Impulses at some samples: a negative place is of the falling edge."""
    return [next((math.copysign(1.0, place) for place in places if abs(place) == k), 0.0) for k in range(length)]


@pytest.mark.parametrize(
    "impulses, status, known",
    [
        (of(0), SILENT_CODE, 0), (of(4), OK, 20), (of(9), OK, 20), (of(10), ALIASED_CODE, 0), (of(4, 1), GAP_CODE, 19),
        (of(6, 10), GAP_CODE, 10), (of(6, 11), GAP_CODE, 0),
    ],
)  # fmt: skip
def test_a_count_is_told_up_to_nine_tenths_of_what_half_a_known_window_can_hold(impulses, status, known):
    """Samples that cannot have an impulse are no time; known : samples of the window, 0 for no answer."""
    found, periods = counted(impulses), sum(abs(impulse) for impulse in impulses if impulse == impulse) / 2
    assert found.status == status
    expected = (periods / known * 1000, 50 * known / 1000 / periods) if known else (NAN, NAN)
    assert found[1:3] == pytest.approx(expected, nan_ok=True)


def test_the_distance_is_by_the_speed_now_or_by_that_of_the_window():
    speeds = [20.0] * 10 + [80.0] * 10
    assert counted(of(4), speeds).distance == pytest.approx(80 * 0.02 / 2)
    assert counted(of(4), speeds, paired=True).distance == pytest.approx(50 * 0.02 / 2)
    assert counted(of(4), [NAN] * 10 + speeds[10:], paired=True).distance == pytest.approx(80 * 0.02 / 2)
    assert counted(of(4), per_period=1).frequency == pytest.approx(4 / 0.02)
    for fastest, status in ((50.0, OK), (49.9, ALIASED_CODE)):
        assert counted(of(4), fastest=fastest).status == timed(at(2, 6), False, fastest=fastest)[8].status == status


def test_an_interval_is_between_the_last_two_impulses_of_any_edge_or_of_the_same():
    for same_edge, first, apart in ((False, 7, 5), (True, 12, 10)):
        found = timed(at(2, -7, 12, -17), same_edge)
        assert {found[k].status for k in range(2, first)} == {SILENT_CODE}
        assert all(one.status == OK and one.frequency == pytest.approx(1000 / apart) for one in found[first:])
        assert found[39].distance == pytest.approx(50 / 1000 * apart)


def test_an_interval_s_distance_is_that_travelled_or_by_the_speed_now():
    speeds, impulses = [20.0] * 8 + [80.0] * 32, at(2, -5, 12)
    assert timed(impulses, True, speeds)[12].distance == pytest.approx((5 * 20 + 5 * 80) / 1000)
    assert timed(impulses, False, speeds)[12].distance == pytest.approx(7 * 80 / 1000)


def test_an_interval_is_held_for_a_window_and_two_samples_are_none():
    found = timed(at(2, 6, length=60), False)
    assert found[6 + 30].status == OK and found[6 + 31].status == SILENT_CODE and math.isnan(found[59].frequency)
    for apart, status in ((2, ALIASED_CODE), (3, OK)):
        assert timed(at(2, 2 + apart), False)[10].status == status


def test_a_trigger_fires_once_until_it_was_released():
    """Over 1.5 of the mean size; again only after it was at 0.5 of it or below."""
    trigger = Trigger(4, Threshold(1.5, 0.5))
    # Mean sizes of the last four: 1, 1, 1, 1.5, 1.75, 2, 1.4, 1.15, ...
    assert [*map(trigger.fire, (1.0, 1.0, 1.0, 3.0, 2.0, 2.0, -0.6, 3.0, 3.0))] == [0, 0, 0, 1, 0, 0, 0, 1, 0]
    assert math.isnan(trigger.fire(NAN)) and trigger.fire(3.0) == 0.0, "a missing one releases nothing"


def test_a_corpuscle_tells_edges_by_the_sign_of_the_slope():
    corpuscle = Corpuscle(10, Threshold(1.5, 1.5))
    assert math.isnan(corpuscle.fire(0.0))
    assert [*map(corpuscle.fire, (0.1, 0.2, 1.2, 1.3, 1.4, 0.4))] == [0, 0, 1, 0, 0, -1]
