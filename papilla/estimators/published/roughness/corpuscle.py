"""Impulses of a model Meissner corpuscle: one each time the slope of the signal crosses its own mean (2006 paper)."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from papilla.estimators.published.roughness.answer import NONE
from papilla.estimators.published.roughness.moving_sum import MovingSum, MovingSumState


class Threshold(NamedTuple):
    """Of the mean slope: an impulse where the slope goes over `factor`, the next only after it was below `release`."""

    factor: float
    release: float


PRINTED = Threshold(factor=1.5, release=1.5)
CORRECTED = Threshold(factor=1.2, release=1.2 * 0.8)


@dataclass(frozen=True)
class CorpuscleState:
    """last_reading; above : the slope is over the threshold; slopes : of the window."""

    last_reading: float
    above: bool
    slopes: MovingSumState


class Corpuscle:
    """Emits an impulse where x = |d reading / dt| (1) goes over a multiple of its mean over the last `samples`."""

    def __init__(self, samples: int, threshold: Threshold):
        self._threshold, self._slopes = threshold, MovingSum(samples)
        self._last, self._above = NONE, False

    @property
    def state(self) -> CorpuscleState:
        """All that the corpuscle remembers, to be kept or to be set again."""
        return CorpuscleState(self._last, self._above, self._slopes.state)

    @state.setter
    def state(self, state: CorpuscleState) -> None:
        self._last, self._above, self._slopes.state = state.last_reading, state.above, state.slopes

    def fire(self, reading: float) -> tuple[int, bool]:
        """The impulse of one reading (1 while it rises, -1 while it falls, 0 none), and whether there could be one."""
        step = reading - self._last
        self._last = reading
        slope, slopes, threshold = abs(step), self._slopes, self._threshold
        slopes.push(slope)
        if slope != slope:
            return 0, False
        factor = threshold.release if self._above else threshold.factor
        # A running sum may be off zero by rounding; a reading that does not move is no impulse.
        above = slope * slopes.known > factor * slopes.total and slope > 0.0
        impulse = (1 if step > 0.0 else -1) if above and not self._above else 0
        self._above = above
        return impulse, True

    def fire_all(self, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same of readings (n,), n > 0: impulses (n,) and whether there could be one (n,)."""
        steps = np.diff(readings, prepend=self._last)
        slopes = np.abs(steps)
        totals, known = self._slopes.extend(slopes)
        over, stays = ((slopes * known > level * totals) & (slopes > 0.0) for level in self._threshold)
        could = ~np.isnan(slopes)
        # Between the two levels, and where it is not known, the slope stays on the side where it was.
        places = np.where(could & (over | ~stays), np.arange(len(slopes)), -1)
        latest = np.maximum.accumulate(places)
        above = np.where(latest < 0, self._above, over[latest])
        begins = above & ~np.append(self._above, above[:-1])
        self._last, self._above = float(readings[-1]), bool(above[-1])
        return np.where(begins, np.where(steps > 0.0, 1, -1), 0), could
