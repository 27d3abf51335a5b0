"""Time and path of a stream: gaps, repeats and drift of the clock, and the path from a position or a velocity.

Estimators that want evenly spaced samples get one for each period of the nominal rate: missing ones are inserted as
missing, so that no window bridges a gap unseen. The path does not trust the nominal rate: it comes from the positions,
or from the velocities over the time that really passed, so neither jitter nor a drifting clock bends a wavelength.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from papilla.status import Status

GAP_STEPS = 1.5
"""A sample later than so many periods after the one before leaves a gap, as in `papilla.logs`."""
LONGEST_GAP_S = 1.0
"""A gap longer than this is not filled: what is touched after it may be something else, so everything begins anew."""
RATE_TOLERANCE, RATE_MEMORY = 0.1, 256
"""A mean step this fraction off the nominal one, over about so many samples, is another sampling rate."""
SLOPE_S = 0.01
"""A velocity that is made from positions, for friction, is the slope over this time: it smooths their resolution."""
_NONE = math.nan


class ClockStatus(Status):
    """What the time of a sample says; `sentence` says it in words."""

    OK = 0, "ok"
    GAP = 1, "samples are missing before this one"
    REPEATED = 2, "left out: the sample is not later than the one before"
    BEGUN_ANEW = 3, f"begun anew: more than {LONGEST_GAP_S:g} s between this sample and the one before"
    OTHER_RATE = 4, "the times tell another sampling rate than the one that was stated"


OK, GAP, REPEATED, BEGUN_ANEW, OTHER_RATE = map(int, ClockStatus)


class Tick(NamedTuple):
    """status : a `ClockStatus`. missing : samples that are missing before this one.

    pace_mm_s : velocity of these and this sample over the nominal period, see `Clock`; first_mm_s : that of the first
    of them. velocity_mm_s : of this sample, as it was measured or from positions; slope_mm_s : the same, smoothed
    where it is from positions. place_mm : position along the path. NaN where unknown.
    """

    status: int
    missing: int
    first_mm_s: float
    pace_mm_s: float
    velocity_mm_s: float
    slope_mm_s: float
    place_mm: float


_LEFT_OUT = Tick(REPEATED, 0, _NONE, _NONE, _NONE, _NONE, _NONE)


@dataclass(frozen=True)
class ClockState:
    """time_s : of the last sample. known_s, place_mm, velocity_mm_s : of the last one whose place was known.

    offset_mm : what is added to a stated position, NaN before the first; pace : last distance in a nominal period, mm.

    mean_step : fading mean of the steps that are no gaps, in nominal periods; steps : their number, up to its memory.
    trail : (time, place) of the last `SLOPE_S`, oldest first, where velocities come from positions.
    """

    time_s: float = _NONE
    known_s: float = _NONE
    place_mm: float = _NONE
    velocity_mm_s: float = _NONE
    offset_mm: float = _NONE
    pace: float = _NONE
    mean_step: float = 1.0
    steps: int = 0
    trail: tuple[tuple[float, float], ...] = ()


class Clock:
    """Turns (t_s, velocity_mm_s, position_mm) of each sample into a `Tick`; NaN where a value is not known.

    The distance d of a sample is the difference of positions, or the trapezoid of the velocities over the time between.
    Estimators integrate a velocity by trapezoids over the nominal period: they get 1.5 d - 0.5 d_before over that
    period, whose trapezoids add up to the true path, off by no more than a quarter of the change of d.
    """

    def __init__(self, rate_Hz: float):
        self._rate = rate_Hz
        self.state = ClockState()

    @property
    def state(self) -> ClockState:
        """All that is remembered, to be kept or to be set again."""
        return ClockState(
            self._time, self._known, self._place, self._velocity, self._offset, self._pace, self._mean, self._steps,
            self._trail,
        )  # fmt: skip

    @state.setter
    def state(self, state: ClockState) -> None:
        self._time, self._known, self._place = state.time_s, state.known_s, state.place_mm
        self._velocity, self._offset, self._pace = state.velocity_mm_s, state.offset_mm, state.pace
        self._mean, self._steps, self._trail = state.mean_step, state.steps, state.trail

    @property
    def time_s(self) -> float:
        """Time of the last sample that was not left out."""
        return self._time

    def tick(self, time: float, velocity: float, position: float) -> Tick:
        """What this sample is; without a finite time it is taken to be one period after the last."""
        rate, last = self._rate, self._time
        if not math.isfinite(time):
            time = 0.0 if last != last else last + 1 / rate
        status, missing = OK, 0
        if last == last:
            late = time - last
            if late > LONGEST_GAP_S + 1 / rate or late < -LONGEST_GAP_S:
                self.state = ClockState()
                status = BEGUN_ANEW
            elif late <= 0.0:
                return _LEFT_OUT
            else:
                periods = late * rate
                # A mean that starts from the first steps, not from the nominal one, and fades later.
                if periods < GAP_STEPS or self._steps < RATE_MEMORY:
                    self._steps = min(self._steps + 1, RATE_MEMORY)
                    self._mean += (min(periods, 2.0) - self._mean) / self._steps
                if periods >= GAP_STEPS:
                    status, missing = GAP, round(periods) - 1
                if self._steps == RATE_MEMORY and abs(self._mean - 1.0) > RATE_TOLERANCE:
                    status = OTHER_RATE
        return self._move(status, missing, time, velocity if math.isfinite(velocity) else _NONE, position)

    def _move(self, status: int, missing: int, time: float, velocity: float, position: float) -> Tick:
        """The tick with the path of this sample."""
        before, known, self._time = self._place, self._known, time
        place = self._moved_to(time, velocity, position)
        if place != place:
            self._pace, self._trail = _NONE, ()
            return Tick(status, missing, _NONE, _NONE, velocity, velocity, _NONE)
        # Over how many nominal periods the distance is spread.
        samples = max(round((time - known) * self._rate), 1) if known == known else 1
        pace = (place - before) / samples if before == before else _NONE
        if pace != pace:
            steady = first = velocity
        else:
            steady = pace * self._rate
            first = steady if self._pace != self._pace else (1.5 * pace - 0.5 * self._pace) * self._rate
        slope = velocity
        if velocity != velocity:
            slope = self._slope(time, place)
            velocity = steady if missing else first
        self._known, self._place, self._velocity, self._pace = time, place, velocity, pace
        return Tick(status, missing, first, steady if missing else first, velocity, slope, place)

    def _slope(self, time: float, place: float) -> float:
        """Velocity over the last `SLOPE_S` of the places, which this one is added to."""
        before = self._trail
        self._trail = (*(pair for pair in before if pair[0] >= time - SLOPE_S), (time, place))[-64:]
        begun, where = before[-1] if len(self._trail) == 1 and before else self._trail[0]
        return (place - where) / (time - begun) if time > begun else _NONE

    def _moved_to(self, time: float, velocity: float, position: float) -> float:
        """Where this sample is; NaN where neither position nor velocity tells. Sees to what is added to positions."""
        before = self._place
        travelled = _NONE
        if velocity == velocity:
            start = self._velocity if self._velocity == self._velocity else velocity
            travelled = 0.0 if before != before else before + 0.5 * (start + velocity) * (time - self._known)
        if not math.isfinite(position):
            return travelled
        if self._offset != self._offset:
            # The first stated position continues the path that the velocity told until then.
            if before == before and travelled == travelled:
                self._offset = travelled - position
                return travelled
            self._offset = 0.0
        return position + self._offset


def path(clock: Clock, t_s, velocity_mm_s, position_mm) -> list[float]:
    """Position in mm along the path of each of the next n samples of `clock`; NaN where unknown or left out.

    Arguments are n numbers each, or None where there is no such column.
    """
    nothing = [_NONE] * len(t_s)
    columns = (nothing if column is None else column for column in (velocity_mm_s, position_mm))
    return [clock.tick(*sample).place_mm for sample in zip(t_s, *columns, strict=True)]
