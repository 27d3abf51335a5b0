"""The hand between its readings, and followed at the other end of a link."""

import math

import numpy as np
import pytest

from papilla.telepresence import Hand, RemoteHand
from papilla.telepresence.motion import HORIZON_S


def natural(t):
    return 197 / (2 * math.pi * 1.07) * (1 - math.cos(2 * math.pi * 1.07 * t))


def test_natural_touch_is_followed_within_hundredths_of_a_millimetre_at_250_Hz():
    hand, off, steps, last = Hand(), [], [], None
    for row in range(2000):
        now = row / 1000
        if row % 4 == 0:
            hand.read(now, natural(now))
        place, velocity = hand.at(now)
        off.append(place - natural(now))
        steps.append(0.0 if last is None else place - last)
        last = place
    assert np.abs(off[50:]).max() < 0.03
    assert np.abs(steps).max() < 0.25


def test_extrapolation_is_bounded_and_continuous():
    hand = Hand()
    for row in range(50):
        hand.read(row / 250, 100 * row / 250)
    end = hand.state.place_mm
    places = [hand.at(49 / 250 + after)[0] for after in np.linspace(0, 1, 5001)]
    assert max(places) <= end + 100 * HORIZON_S + 1e-6
    assert np.abs(np.diff(places)).max() < 0.03
    assert hand.at(1.0)[1] == 0
    before = hand.at(0.6)[0]
    hand.read(0.6, end + 3.0)
    assert hand.at(0.6)[0] == pytest.approx(before)


def test_bad_readings_are_counted_and_jumps_begin_anew():
    hand = Hand()
    for time, place in [
        (0, 0),
        (0.004, math.nan),
        (math.inf, 1),
        (0.004, 0.4),
        (0.004, 0.5),
        (0.002, 9),
        (0.008, 1e300),
    ]:
        hand.read(time, place)
    assert hand.ignored == 5 and hand.state.place_mm == 0.4
    hand.read(0.012, 500.0)
    assert hand.jumps == 1 and hand.at(0.012) == (500.0, 0.0)
    hand.read(-50.0, 1.0)
    assert hand.jumps == 2 and hand.at(-50.0)[0] == 1.0


def test_a_remote_hand_is_late_by_the_delay_and_never_jumps_when_that_changes():
    remote, waiting, places = RemoteHand(), [], []
    for row in range(4000):
        now = row / 1000
        if row % 4 == 0:
            delay = 0.05 if now < 2 else 0.15
            waiting.append((now + delay, now, natural(now)))
        while waiting and waiting[0][0] <= now:
            remote.read(*waiting.pop(0))
        places.append(remote.at(now)[0])
    places = np.array(places)
    for at, delay in ((1.9, 0.05), (3.9, 0.15)):
        assert places[round(1000 * at)] == pytest.approx(natural(at - delay), abs=0.05)
    assert np.abs(np.diff(places[100:])).max() < 0.35
