"""Time and path of a stream: gaps, repeats and drift of the clock, and the path from a position or a velocity.

Estimators that want evenly spaced samples get one for each period of the nominal rate: missing ones are inserted as
missing, so that no window bridges a gap unseen. The path does not trust the nominal rate: it comes from the positions,
or from the velocities over the time that really passed, so neither jitter nor a drifting clock bends a wavelength.
"""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

GAP_STEPS = 1.5
"""A sample later than so many periods after the one before leaves a gap, as in `papilla.logs`."""
LONGEST_GAP_S = 1.0
"""A gap longer than this is not filled: what is touched after it may be something else, so everything begins anew."""
RATE_TOLERANCE, RATE_MEMORY = 0.1, 256
"""A mean step this fraction off the nominal one, over about so many samples, is another sampling rate."""
SLOPE_S = 0.01
"""A velocity that is made from positions, for friction, is the slope over this time: it smooths their resolution."""
_NONE = math.nan


class ClockStatus(IntEnum):
    """What the time of a sample says; `sentence` says it in words."""

    OK = 0
    GAP = 1
    REPEATED = 2
    BEGUN_ANEW = 3
    OTHER_RATE = 4

    @property
    def sentence(self) -> str:
        """The status in words."""
        return _SENTENCES[self]


_SENTENCES = {
    ClockStatus.OK: "ok",
    ClockStatus.GAP: "samples are missing before this one",
    ClockStatus.REPEATED: "left out: the sample is not later than the one before",
    ClockStatus.BEGUN_ANEW: f"begun anew: more than {LONGEST_GAP_S:g} s between this sample and the one before",
    ClockStatus.OTHER_RATE: "the times tell another sampling rate than the one that was stated",
}
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

    def tick(self, time: float, velocity: float, position: float) -> Tick:
        """What this sample is; without a finite time it is taken to be one period after the last."""
        state, rate = self.state, self._rate
        if not math.isfinite(time):
            time = 0.0 if state.time_s != state.time_s else state.time_s + 1 / rate
        status, missing, mean, steps = OK, 0, state.mean_step, state.steps
        if state.time_s == state.time_s:
            late = time - state.time_s
            if late > LONGEST_GAP_S + 1 / rate or late < -LONGEST_GAP_S:
                self.state = state = ClockState()
                status, mean, steps = BEGUN_ANEW, 1.0, 0
            elif late <= 0.0:
                return _LEFT_OUT
            else:
                periods = late * rate
                # A mean that starts from the first steps, not from the nominal one, and fades later.
                if periods < GAP_STEPS or steps < RATE_MEMORY:
                    steps = min(steps + 1, RATE_MEMORY)
                    mean += (min(periods, 2.0) - mean) / steps
                if periods >= GAP_STEPS:
                    status, missing = GAP, round(periods) - 1
                if steps == RATE_MEMORY and abs(mean - 1.0) > RATE_TOLERANCE:
                    status = OTHER_RATE
        return self._move(state, Tick(status, missing, *[_NONE] * 5), (time, velocity, position), (mean, steps))

    def _move(self, state: ClockState, tick: Tick, sample: tuple, rate_seen: tuple[float, int]) -> Tick:
        """The tick with the path of this sample; commits the state."""
        time, velocity, position = sample
        finite = math.isfinite
        velocity = velocity if finite(velocity) else _NONE
        place, offset = self._place(state, time, velocity, position)
        if place != place:
            self.state = ClockState(
                time, state.known_s, state.place_mm, state.velocity_mm_s, state.offset_mm, _NONE, *rate_seen
            )
            return tick._replace(velocity_mm_s=velocity, slope_mm_s=velocity)
        # Over how many nominal periods the distance is spread.
        samples = max(round((time - state.known_s) * self._rate), 1) if state.known_s == state.known_s else 1
        pace = (place - state.place_mm) / samples if state.place_mm == state.place_mm else _NONE
        if pace != pace:
            steady = first = velocity
        else:
            steady = pace * self._rate
            first = steady if state.pace != state.pace else (1.5 * pace - 0.5 * state.pace) * self._rate
        slope, trail = velocity, state.trail
        if velocity != velocity:
            trail = (*(pair for pair in trail if pair[0] >= time - SLOPE_S), (time, place))[-64:]
            begun, where = state.trail[-1] if len(trail) == 1 and state.trail else trail[0]
            slope = (place - where) / (time - begun) if time > begun else _NONE
            velocity = steady if tick.missing else first
        self.state = ClockState(time, time, place, velocity, offset, pace, *rate_seen, trail)
        return tick._replace(
            first_mm_s=first,
            pace_mm_s=steady if tick.missing else first,
            velocity_mm_s=velocity,
            slope_mm_s=slope,
            place_mm=place,
        )

    @staticmethod
    def _place(state: ClockState, time: float, velocity: float, position: float) -> tuple[float, float]:
        """Where this sample is, and what was added to its position; NaN where neither position nor velocity tells."""
        before = state.place_mm
        travelled = _NONE
        if velocity == velocity:
            start = state.velocity_mm_s if state.velocity_mm_s == state.velocity_mm_s else velocity
            travelled = 0.0 if before != before else before + 0.5 * (start + velocity) * (time - state.known_s)
        if not math.isfinite(position):
            return travelled, state.offset_mm
        if state.offset_mm == state.offset_mm:
            return position + state.offset_mm, state.offset_mm
        # The first stated position continues the path that the velocity told until then.
        if before != before:
            return position, 0.0
        return (travelled, travelled - position) if travelled == travelled else (position, 0.0)


def path(rate_Hz: float, t_s, velocity_mm_s, position_mm) -> list[float]:
    """Position in mm along the path of each of n samples, NaN where it is not known or the sample is left out.

    Arguments are n numbers each, or None where there is no such column.
    """
    nothing = [_NONE] * len(t_s)
    clock = Clock(rate_Hz)
    columns = (nothing if column is None else column for column in (velocity_mm_s, position_mm))
    return [clock.tick(*sample).place_mm for sample in zip(t_s, *columns, strict=True)]
