"""Time and path of a stream: gaps, repeats and drift of the clock, and the path from a position or a velocity.

The path does not use the nominal rate: it comes from the positions, or from the velocities over the measured time, so
neither jitter nor a drifting clock changes a wavelength.
"""

import math
from typing import NamedTuple

from papilla.core.status import Status

CLOCK_GAP_STEPS = 1.5
"""A sample that comes this many periods after the one before leaves a gap, as in `papilla.logs`."""
LONGEST_GAP_S = 1.0
"""A longer gap is not bridged: the finger may touch something else after it, so everything begins again."""
RATE_TOLERANCE, RATE_MEMORY = 0.1, 256
"""Relative difference of the mean step from the nominal one, over about so many samples, that means another sampling
rate."""
BUNCH_SAMPLES, PACKET_GAIN = 3, 0.1
"""Number of samples with one time stamp from which stamps are those of packets; and the gain with which the spread time
follows each stamp."""
SLOPE_S = 0.01
"""Time over which a velocity (for friction) is computed from positions as a slope: it smooths their resolution."""
_NONE = math.nan


class ClockStatus(Status):
    """Remark on the time of a sample; `sentence` gives it in words."""

    OK = "ok"
    GAP = "samples are missing before this one"
    REPEATED = "left out: the sample is not later than the one before"
    BEGUN_ANEW = f"begun anew: more than {LONGEST_GAP_S:g} s between this sample and the one before"
    OTHER_RATE = "the times tell another sampling rate than the one that was stated"


CLOCK_OK, CLOCK_GAP, CLOCK_REPEATED, BEGUN_ANEW, OTHER_RATE = map(int, ClockStatus)


class Tick(NamedTuple):
    """status : a `ClockStatus`. missing : samples that are missing before this one. time_s : its time.

    velocity_mm_s : of this sample, measured or computed from positions; slope_mm_s : the same, smoothed if it is
    computed from positions. place_mm : position along the path. NaN if unknown.
    """

    status: int
    missing: int = 0
    time_s: float = _NONE
    velocity_mm_s: float = _NONE
    slope_mm_s: float = _NONE
    place_mm: float = _NONE


_LEFT_OUT = Tick(CLOCK_REPEATED)


class ClockState(NamedTuple):
    """time_s : of the last sample. known_s, place_mm, velocity_mm_s : of the last one whose place was known.

    offset_mm : added to each stated position, NaN before the first. mean_step : fading mean of the steps without gaps,
    in nominal periods; steps : their number, up to the length of its memory. trail : (time, place) of the last
    `SLOPE_S`, oldest first, if velocities come from positions. stamps : the last stated time, the number of samples
    with it, and the time between such stamps if samples come in packets, else 0.
    """

    time_s: float = _NONE
    known_s: float = _NONE
    place_mm: float = _NONE
    velocity_mm_s: float = _NONE
    offset_mm: float = _NONE
    mean_step: float = 1.0
    steps: int = 0
    trail: tuple[tuple[float, float], ...] = ()
    stamps: tuple[float, int, float] = (_NONE, 0, 0.0)


class Clock:
    """Computes a `Tick` from (t_s, velocity_mm_s, position_mm) of each sample; NaN if a value is not known.

    rate_Hz : nominal rate. state : all that it remembers; it may be saved and set again.
    """

    def __init__(self, rate_Hz: float):
        self._rate = rate_Hz
        self.state = ClockState()

    def tick(self, time: float, velocity: float, position: float) -> Tick:
        """The tick of this sample; without a finite time the sample counts as one period after the last."""
        rate, before = self._rate, self.state
        last, stamps, mean, steps = before.time_s, before.stamps, before.mean_step, before.steps
        status, missing = CLOCK_OK, 0
        if math.isfinite(time):
            time, stamps = self._spread(time)
        else:
            time = 0.0 if last != last else last + 1 / rate
        if last == last:
            late = time - last
            periods = late * rate
            if late > LONGEST_GAP_S + 1 / rate or late < -LONGEST_GAP_S:
                self.state = ClockState()
                stamps, status, mean, steps = (stamps[0], 1, 0.0), BEGUN_ANEW, 1.0, 0
            elif late <= 0.0:
                self.state = before._replace(stamps=stamps)
                return _LEFT_OUT
            else:
                # The mean starts with the first steps, not with the nominal one, and begins to fade later.
                if periods < CLOCK_GAP_STEPS or steps < RATE_MEMORY:
                    steps = min(steps + 1, RATE_MEMORY)
                    mean += (min(periods, 2.0) - mean) / steps
                if periods >= CLOCK_GAP_STEPS:
                    status, missing = CLOCK_GAP, round(periods) - 1
                if steps == RATE_MEMORY and abs(mean - 1.0) > RATE_TOLERANCE:
                    status = OTHER_RATE
        velocity = velocity if math.isfinite(velocity) else _NONE
        return self._move(status, missing, time, velocity, position, (mean, steps, stamps))

    def _spread(self, stamp: float) -> tuple[float, tuple[float, int, float]]:
        """Time of a sample with this stamp, and the stamps to remember: the stamp itself, or, if packets share a stamp,
        one period after the sample before.

        Samples form packets if as many share a stamp as fit at the nominal rate between it and the next one.
        """
        even, (before, count, usual) = self.state.time_s + 1 / self._rate, self.state.stamps
        if stamp == before:
            return (even if usual else stamp), (stamp, count + 1, usual)
        packet = stamp - before
        fits = count >= BUNCH_SAMPLES and abs(packet * self._rate - count) <= max(1.0, RATE_TOLERANCE * count)
        packet = packet if fits else usual if count >= BUNCH_SAMPLES else 0.0
        spread = even + PACKET_GAIN * (stamp - even) if 0 < 2 * abs(stamp - even) < usual else stamp
        return spread, (stamp, 1, packet)

    def _move(self, status: int, missing: int, time: float, velocity: float, position: float, timing) -> Tick:
        """Tick with the place of this sample; updates the state. kept : mean_step, steps and stamps."""
        (_, known_s, before, fast, offset, _, _, trail, _), (mean, steps, stamps) = self.state, timing
        place = _NONE
        if velocity == velocity:
            start = fast if fast == fast else velocity
            place = 0.0 if before != before else before + 0.5 * (start + velocity) * (time - known_s)
        if math.isfinite(position):
            if offset != offset:
                # The first stated position continues the path that was computed from velocities until then.
                offset = place - position if before == before and place == place else 0.0
            place = position + offset
        if place != place:
            self.state = ClockState(time, known_s, before, fast, offset, mean, steps, trail, stamps)
            return Tick(status, missing, time, velocity, velocity)
        passed, slope = velocity, velocity
        if velocity != velocity:
            passed = (place - before) / (time - known_s) if time > known_s else _NONE
            last = trail[-1:]
            trail = (*(pair for pair in trail if pair[0] >= time - SLOPE_S), (time, place))[-64:]
            (begun, where), *_ = trail if len(trail) > 1 or not last else last
            slope = (place - where) / (time - begun) if time > begun else _NONE
        self.state = ClockState(time, time, place, passed, offset, mean, steps, trail, stamps)
        return Tick(status, missing, time, passed, slope, place)


def path(clock: Clock, t_s, velocity_mm_s, position_mm) -> list[float]:
    """Position in mm along the path of each of the next n samples of `clock`; NaN where unknown or left out.

    Arguments are n numbers each, or None where there is no such column.
    """
    nothing = [_NONE] * len(t_s)
    columns = (nothing if column is None else column for column in (velocity_mm_s, position_mm))
    return [clock.tick(*sample).place_mm for sample in zip(t_s, *columns, strict=True)]
