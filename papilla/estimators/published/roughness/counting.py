"""Frequency and wavelength from the number of impulses in a sliding window."""

import math
from dataclasses import dataclass

import numpy as np

from papilla.estimators.published.roughness.answer import (
    ALIASED,
    GAP,
    NONE,
    OK,
    SILENT,
    Finding,
    first_reason,
    found_nothing,
)
from papilla.estimators.published.roughness.moving_sum import MovingSum, MovingSumState

CEILING = 0.9
"""Of the most impulses that a window can hold, one every second sample: from there on a count may be an alias."""


@dataclass(frozen=True)
class CountState:
    """impulses, could : of the window, 1 or 0 each: whether a sample had an impulse, and whether it could have one.

    speeds : |velocity| of the window, NaN where unknown.
    """

    impulses: MovingSumState
    could: MovingSumState
    speeds: MovingSumState


class ImpulseCount:
    """Counts impulses over the last `samples` and says f = count / (per_period x duration).

    The distance of a period is |velocity now| / f, or, `paired`, the distance travelled while counting over the number
    of periods. fastest_mm_s : speed from which on no answer is given.
    """

    def __init__(self, samples: int, rate_Hz: float, per_period: int, paired: bool, fastest_mm_s: float):
        self._samples, self._rate, self._per_period = samples, rate_Hz, per_period
        self._paired, self._fastest = paired, fastest_mm_s
        self._half, self._most = samples // 2, CEILING * 0.5 * samples
        self._impulses, self._could, self._speeds = MovingSum(samples), MovingSum(samples), MovingSum(samples)

    @property
    def state(self) -> CountState:
        """All that the counter remembers, to be kept or to be set again."""
        return CountState(self._impulses.state, self._could.state, self._speeds.state)

    @state.setter
    def state(self, state: CountState) -> None:
        self._impulses.state, self._could.state, self._speeds.state = state.impulses, state.could, state.speeds

    def find(self, impulse: int, could: bool, speed: float) -> Finding:
        """What the window says after a sample: its impulse (0: none), whether it could have one, and |velocity|."""
        speed = speed if speed < math.inf else NONE
        self._impulses.push(1.0 if impulse else 0.0)
        self._could.push(1.0 if could else 0.0)
        self._speeds.push(speed)
        count, valid, moving = self._impulses.total, self._could.total, self._speeds.known
        if valid < self._half:
            return found_nothing(GAP)
        if count == 0:
            return found_nothing(SILENT)
        if speed > self._fastest or count > self._most:
            return found_nothing(ALIASED)
        average = self._speeds.total / moving if self._paired and moving else speed
        periods, seconds = count / self._per_period, valid / self._rate
        return Finding(periods / seconds, average * seconds / periods, NONE, OK if valid == self._samples else GAP)

    def find_all(self, impulses: np.ndarray, could: np.ndarray, speeds: np.ndarray) -> Finding:
        """The same after each of n > 0 samples, arrays (n,)."""
        speeds = np.where(speeds < math.inf, speeds, NONE)
        count, _ = self._impulses.extend(np.where(impulses, 1.0, 0.0))
        valid, _ = self._could.extend(np.where(could, 1.0, 0.0))
        total, moving = self._speeds.extend(speeds)
        average = np.where(moving > 0, total / moving, speeds) if self._paired else speeds
        periods, seconds = count / self._per_period, valid / self._rate
        fast = (speeds > self._fastest) | (count > self._most)
        none = (valid < self._half) | (count == 0) | fast
        reasons = [(valid < self._half, GAP), (count == 0, SILENT), (fast, ALIASED), (valid < self._samples, GAP)]
        status = first_reason(reasons, OK)
        frequency, distance = (
            np.where(none, NONE, values) for values in (periods / seconds, average * seconds / periods)
        )
        return Finding(frequency, distance, np.full(len(count), NONE), status)
