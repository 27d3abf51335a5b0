"""The hand's motion, the fader, the actuator and components, each against its closed form."""

import math

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.telepresence import Hand, RemoteHand
from papilla.telepresence.actuator import BAND_FADE_SHARE, PIEZO_STACK, Actuator, Fader, Safety, icpf
from papilla.telepresence.local_model import LocalModel
from papilla.telepresence.messages import Component, strongest
from papilla.telepresence.motion import WANDER_HZ, HandMotion

TIME = np.arange(0, 4, 1e-4)


def test_strokes_without_wander_are_a_cosine_of_the_stated_peak_and_rate():
    motion = HandMotion(peak_mm_s=120.0, strokes_Hz=2.0, wander=0.0)
    length = 120.0 / (2 * math.pi)
    np.testing.assert_allclose(motion.place_mm(TIME), 0.5 * length * (1 - np.cos(4 * math.pi * TIME)), atol=1e-9)
    assert motion.length_mm == pytest.approx(length)
    assert np.abs(np.gradient(motion.place_mm(TIME), TIME)).max() == pytest.approx(120.0, rel=1e-5)


def test_the_rate_of_strokes_wanders_by_its_share():
    motion = HandMotion(strokes_Hz=1.5, wander=0.2)
    rate = 1.5 * (1 + 0.2 * np.sin(2 * math.pi * WANDER_HZ * TIME))
    turns = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * 1e-4)])
    expected = 0.5 * motion.length_mm * (1 - np.cos(2 * math.pi * turns))
    np.testing.assert_allclose(motion.place_mm(TIME), expected, atol=1e-5)


def test_at_no_rate_it_is_one_stroke_at_a_constant_speed():
    motion = HandMotion(peak_mm_s=30.0, strokes_Hz=0.0)
    assert motion.place_mm(2.0) == 60.0 and motion.length_mm == math.inf


@pytest.mark.parametrize(
    "name, low, high", [("peak_mm_s", 1, 1000), ("strokes_Hz", 0, 10), ("wander", 0, 0.5), ("press_N", 0, 100)]
)
def test_a_motion_outside_its_limits_is_refused(name, low, high):
    for limit in (low, high):
        HandMotion(**{name: limit})
    for beyond in (low - 0.01, high + 0.01):
        with pytest.raises(InputError, match=name):
            HandMotion(**{name: beyond})


def test_the_gain_rises_and_falls_linearly_in_the_stated_times():
    fader = Fader(Safety(attack_s=0.1, decay_s=0.4))
    rise = [fader.step(0.01, True) for _ in range(12)]
    assert rise == pytest.approx([0.1 * k for k in range(1, 11)] + [1, 1])
    fall = [fader.step(0.01, False) for _ in range(42)]
    assert fall == pytest.approx([1 - 0.025 * k for k in range(1, 40)] + [0] * 3, abs=1e-9)


def test_a_press_is_over_the_limit_until_it_is_below_the_release():
    fader = Fader(Safety(force_limit_N=2.0, force_release_N=1.9))
    found = []
    for force in (1.95, 2.05, math.nan, 1.95, 1.85, 1.95):
        fader.press(force)
        found.append(fader.pressed)
    assert found == [False, True, True, True, False, False]


def test_the_piezo_is_3_dB_down_at_its_corner_and_fades_at_the_end_of_its_band():
    assert PIEZO_STACK.response(0.0) == 1.0 and PIEZO_STACK.response(310.0) == pytest.approx(math.sqrt(0.5))
    # 1 dB down at 300 Hz: 1 / sqrt(1 + (300 / 310)^40)
    assert PIEZO_STACK.response(300.0) == pytest.approx(0.8876, abs=1e-4)
    assert PIEZO_STACK.amplitude_um == 27.5
    assert [PIEZO_STACK.volts(drive) for drive in (-27.5, 0.0, 27.5)] == pytest.approx([0, 75, 150])
    top = 200.0
    start, middle = (1 - BAND_FADE_SHARE) * top, (1 - BAND_FADE_SHARE / 2) * top
    assert [PIEZO_STACK.passed(f, top) for f in (0, start, middle, top, 2 * top)] == pytest.approx([1, 1, 0.5, 0, 0])
    assert [PIEZO_STACK.passed(f, top) for f in (1.01 * top, (1 + BAND_FADE_SHARE) * top)] == [0, 0], (
        "nothing beyond the band"
    )
    assert Actuator("flat", 10.0, 100.0).response(99.0) == 1.0
    assert LocalModel(icpf(100.0)).top_Hz == 200.0 and icpf(100.0).amplitude_um == 50.0


def test_a_component_without_a_wavelength_is_not_displayed_and_a_silent_one_is():
    components = [
        Component(w, a) for w, a in ((1.0, 0.0), (0.0, 9.0), (math.nan, 9.0), (math.inf, 9.0), (2.0, -1.0), (3.0, 5.0))
    ]
    assert [one.usable for one in components] == [True, False, False, False, False, True]
    assert [one.wavelength_mm for one in strongest(tuple(components), 5)] == [3.0, 1.0]
    assert len(strongest(tuple(components), 1)) == 1


def natural(t):
    return 197 / (2 * math.pi * 1.07) * (1 - math.cos(2 * math.pi * 1.07 * t))


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
