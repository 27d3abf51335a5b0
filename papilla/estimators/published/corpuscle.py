"""Impulses of a model Meissner corpuscle: one each time the slope of the signal crosses its own mean (2006 paper)."""

import math
from dataclasses import dataclass

from papilla.estimators.published.stream import MISSING, OK, SATURATED, checked_ring

PRINTED_FACTOR, CORRECTED_FACTOR = 1.5, 1.2
CORRECTED_RELEASE = 0.8
"""Of the threshold: the corrected corpuscle fires again only after the slope has been below it."""
_NONE = math.nan


@dataclass(frozen=True)
class CorpuscleState:
    """last_reading; above : the slope is over the threshold; place : where the next slope goes in the ring `slopes`.

    total, fresh : sum of the slopes in the ring, and of those since it began again, which replaces the other then, so
    that no rounding error lives longer than two windows; valid : how many slopes of the ring are known.
    """

    last_reading: float = _NONE
    above: bool = False
    place: int = 0
    valid: int = 0
    total: float = 0.0
    fresh: float = 0.0
    slopes: tuple[float, ...] = ()


class Corpuscle:
    """Emits an impulse where x = |d reading / dt| (1) crosses a multiple of its mean over the last `samples` upward.

    corrected : threshold 1.2 x the mean instead of 1.5 x, and no second impulse before x has been below 0.8 of that.
    """

    def __init__(self, samples: int, saturation: float, corrected: bool):
        self._samples, self._saturation = samples, saturation
        self._factor = CORRECTED_FACTOR if corrected else PRINTED_FACTOR
        self._release = self._factor * (CORRECTED_RELEASE if corrected else 1.0)
        self.state = CorpuscleState(slopes=(_NONE,) * samples)

    @property
    def state(self) -> CorpuscleState:
        """All that the corpuscle remembers, to be kept or to be set again."""
        return CorpuscleState(
            self._last, self._above, self._place, self._valid, self._total, self._fresh, tuple(self._slopes)
        )

    @state.setter
    def state(self, state: CorpuscleState) -> None:
        self._slopes = checked_ring("slopes", state.slopes, self._samples)
        self._last, self._above, self._place = state.last_reading, state.above, state.place
        self._valid, self._total, self._fresh = state.valid, state.total, state.fresh

    def fire(self, readings) -> tuple[list[int], list[bool], list[int]]:
        """For each reading: the impulse (1 while the reading rises, -1 while it falls, 0 none), whether the slope is
        known, and what is wrong with the reading (OK, MISSING or SATURATED)."""
        samples, saturation, factor, release = self._samples, self._saturation, self._factor, self._release
        slopes, last, above, place = self._slopes, self._last, self._above, self._place
        valid, total, fresh = self._valid, self._total, self._fresh
        impulses: list[int] = []
        known: list[bool] = []
        faults: list[int] = []
        for reading in readings:
            fault = OK if -saturation < reading < saturation else fault_of(reading)
            step = _NONE if fault else reading - last
            last = _NONE if fault else reading
            slope = -step if step < 0.0 else step
            impulse = 0
            old = slopes[place]
            if old == old:
                total -= old
                valid -= 1
            if slope == slope:
                total += slope
                fresh += slope
                valid += 1
                # A running sum may be off zero by rounding; a reading that does not move is no impulse.
                high = slope * valid > (release if above else factor) * total and slope > 0.0
                if high and not above:
                    impulse = 1 if step > 0.0 else -1
                above = high
            slopes[place] = slope
            place += 1
            if place == samples:
                place, total, fresh = 0, fresh, 0.0
            impulses.append(impulse)
            known.append(slope == slope)
            faults.append(fault)
        self._last, self._above, self._place = last, above, place
        self._valid, self._total, self._fresh = valid, total, fresh
        return impulses, known, faults


def fault_of(reading: float) -> int:
    """The status of a reading that is not inside the saturation limits."""
    return SATURATED if abs(reading) < math.inf else MISSING
