"""The motion of the operator's hand: simulated, and between two readings of its position.

Readings come every 4 ms, the display needs a position every 1 ms, and the phase of a texture of 1 mm turns once per mm:
a position that is held between readings would sound as a step of 250 Hz. So `Hand` extrapolates,

    x(t) = x_k + v_k (t - t_k) + e_k exp(-(t - t_k) / 2 ms),

with the velocity v_k of the last readings and the error e_k of the previous extrapolation at t_k, which makes x
continuous. Over a link the delay varies as well; `RemoteHand` therefore plays the readings out on the sender's clock, a
little faster or slower than real time, so that a changed delay changes the speed by at most a quarter and never makes
the position jump.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from papilla.core import checks
from papilla.core.units import SAMPLE_RATE_HZ

HAND_HZ, HAND_RATE_HZ = 250.0, SAMPLE_RATE_HZ
"""Positions and control periods per second: Okamoto et al. 2011, section 3."""
PARAMETERS_HZ = 50.0
"""Default number of the sensor's messages per second."""
WANDER_HZ = 0.31
"""Frequency with which the rate of the strokes varies."""
PRESS_SWING, PRESS_HZ = 0.4, 0.6
"""Size and frequency of the variation of the pressing force."""


@dataclass(frozen=True)
class HandMotion:
    """Motion of the hand: strokes to and fro with this peak speed and rate or, at 0 Hz, one stroke at a constant speed.

    The default is the touch of Okamoto et al. 2011, section 4.1.1: 197 sin(2 pi 1.07 t) mm/s, whose rate varies by 10 %
    with a period of 3.2 s, as for a hand. Exactly repeating strokes would look the same half a stroke later. The mean
    force is `press_N`; it varies by 40 % with a period of 1.7 s.
    """

    peak_mm_s: float = 197.0
    strokes_Hz: float = 1.07
    wander: float = 0.1
    press_N: float = 0.5

    def __post_init__(self):
        checks.within("peak_mm_s", self.peak_mm_s, 1, 1000)
        checks.within("strokes_Hz", self.strokes_Hz, 0, 10)
        checks.within("wander", self.wander, 0, 0.5)
        checks.within("press_N", self.press_N, 0, 100)

    def force_N(self, time_s: ArrayLike) -> Any:
        """Pressing force at a time or times."""
        return self.press_N * (1 + PRESS_SWING * np.sin(2 * math.pi * PRESS_HZ * np.asarray(time_s)))

    @property
    def length_mm(self) -> float:
        """Length of a stroke; infinite at a constant speed."""
        return self.peak_mm_s / (math.pi * self.strokes_Hz) if self.strokes_Hz else math.inf

    def place_mm(self, time_s: ArrayLike) -> Any:
        """Position at a time or times; the strokes begin at 0 and go forth first."""
        if self.strokes_Hz == 0:
            return self.peak_mm_s * np.asarray(time_s)
        time, slow = np.asarray(time_s), 2 * math.pi * WANDER_HZ
        turned = 2 * math.pi * self.strokes_Hz * (time + self.wander / slow * (1 - np.cos(slow * time)))
        return 0.5 * self.length_mm * (1 - np.cos(turned))


HORIZON_S = 0.012
"""Time for which a position is extrapolated at the last speed, three periods of 250 Hz; then the hand counts as
resting."""
BLEND_S = 0.002
"""Time constant with which the error of an extrapolation is removed after the next reading."""
FASTEST_HAND_MM_S = 2000.0
"""Largest speed of a hand that feels a texture: a larger step of the position is a new place, not a movement."""


@dataclass(eq=False)
class HandState:
    """Last reading (time_s, place_mm, velocity_mm_s), and the error of the extrapolation at that time (off_mm)."""

    time_s: float = math.nan
    place_mm: float = math.nan
    velocity_mm_s: float = 0.0
    off_mm: float = 0.0


class Hand:
    """Position of the hand at any time from readings that come at 250 Hz or more.

    After a reading the position is extrapolated for at most `HORIZON_S`, with the velocity from the last two readings,
    corrected by its last change. The error that the next reading shows is removed within `BLEND_S`, so the position
    does not jump. A step that no hand can make starts again at the new place.
    """

    def __init__(self):
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.state, self.ignored, self.jumps = HandState(), 0, 0
        self._before = math.nan

    def read(self, time_s: float, position_mm: float) -> None:
        """Take a reading. One that is not finite, absurdly far, or not later than the last is counted and ignored."""
        last = self.state
        if not (math.isfinite(time_s) and abs(position_mm) <= checks.LARGEST_READING):
            self.ignored += 1
            return
        if math.isnan(last.time_s):
            self.state = HandState(time_s, position_mm)
            return
        step_s = time_s - last.time_s
        if -1.0 < step_s <= 0:
            self.ignored += 1
            return
        mean = (position_mm - last.place_mm) / step_s
        if step_s > 1.0 or step_s < 0 or abs(mean) > FASTEST_HAND_MM_S:
            self.jumps += 1
            self.state, self._before = HandState(time_s, position_mm), math.nan
            return
        velocity = mean
        if math.isfinite(self._before):
            # A difference is the velocity half a step ago; its own change extrapolates it to now.
            velocity += 0.5 * (mean - self._before)
        self._before = mean
        self.state = HandState(time_s, position_mm, velocity, self.at(time_s)[0] - position_mm)

    def at(self, time_s: float) -> tuple[float, float]:
        """(position_mm, velocity_mm_s) at a time not before the last reading; NaN and 0 without a reading."""
        last = self.state
        since = max(0.0, time_s - last.time_s)
        if since > HORIZON_S:
            moving, velocity = HORIZON_S, 0.0
        else:
            moving, velocity = since, last.velocity_mm_s
        place = last.place_mm + last.velocity_mm_s * moving + last.off_mm * math.exp(-since / BLEND_S)
        return place, velocity if math.isfinite(place) else 0.0

    def age_s(self, time_s: float) -> float:
        """Time since the last reading."""
        return time_s - self.state.time_s


LARGEST_SPEED_CHANGE = 0.25
"""Largest relative change of speed when a remote hand's movement is played out."""
CATCH_UP_S = 0.05
"""Time constant with which a changed delay is made up for, as far as `LARGEST_SPEED_CHANGE` permits."""


class RemoteHand:
    """The hand at the other end of a link: readings are played out on the sender's clock, delayed by the link.

    If the delay falls, the movement runs up to 25 % faster until it has caught up; if it rises, the movement runs
    slower, or waits for new readings. It never jumps.
    """

    def __init__(self):
        self.hand = Hand()
        self._ahead_s = self._time_s = math.nan
        self.playing_s = math.nan
        """Time on the sender's clock that is played out now."""

    def read(self, time_s: float, sent_s: float, position_mm: float) -> None:
        """Take a reading that was sent at `sent_s` (sender's clock) and arrived at `time_s` (our clock)."""
        self.hand.read(sent_s, position_mm)
        if sent_s == self.hand.state.time_s:
            self._ahead_s = sent_s - time_s

    def at(self, time_s: float) -> tuple[float, float]:
        """(position_mm, velocity_mm_s) at a time that does not decrease; NaN and 0 without a reading."""
        # The time on the sender's clock that would be played out now if the delay of the last reading stayed.
        wanted = time_s + self._ahead_s
        since, self._time_s = time_s - self._time_s, time_s
        off = wanted - self.playing_s
        if not (abs(off) <= 1.0 and since >= 0):
            self.playing_s, pace = wanted, 1.0
        else:
            change = (off - since) / CATCH_UP_S if since else 0.0
            pace = 1 + max(-LARGEST_SPEED_CHANGE, min(LARGEST_SPEED_CHANGE, change))
            # Not beyond what can be extrapolated, and never back.
            newest = self.hand.state.time_s + HORIZON_S
            self.playing_s = max(self.playing_s, min(self.playing_s + pace * since, newest))
        place, velocity = self.hand.at(self.playing_s)
        return place, velocity * pace
