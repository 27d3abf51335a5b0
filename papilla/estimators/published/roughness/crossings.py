"""Impulses where a high-passed signal goes over zero (2007 paper)."""

import math
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from papilla.estimators.published.roughness.answer import NONE
from papilla.estimators.published.roughness.moving_sum import MovingSum, MovingSumState


@dataclass(frozen=True)
class CrossingState:
    """passed : the high-passed signal; last_reading; armed : it has been low enough since the last impulse.

    sizes : |passed| of the window.
    """

    passed: float
    last_reading: float
    armed: bool
    sizes: MovingSumState


class UpwardCrossings:
    """An impulse where the signal behind a first-order high-pass goes over zero, once `release` x its mean size below.

    Missing readings leave the filter as it is: the signal is taken to go on from where it stopped.
    """

    def __init__(self, samples: int, rate_Hz: float, cutoff_Hz: float, release: float):
        # The bilinear first-order high-pass of this corner frequency.
        tangent = math.tan(math.pi * cutoff_Hz / rate_Hz)
        self._gain, self._keep = 1 / (1 + tangent), (1 - tangent) / (1 + tangent)
        self._release, self._sizes = release / samples, MovingSum(samples, 0.0)
        self._passed, self._last, self._armed = 0.0, NONE, False

    @property
    def state(self) -> CrossingState:
        """All that is remembered, to be kept or to be set again."""
        return CrossingState(self._passed, self._last, self._armed, self._sizes.state)

    @state.setter
    def state(self, state: CrossingState) -> None:
        self._passed, self._last, self._armed = state.passed, state.last_reading, state.armed
        self._sizes.state = state.sizes

    def fire(self, reading: float) -> tuple[int, bool]:
        """The impulse of one reading (1 or 0), and whether there could be one."""
        if reading != reading:
            return 0, False
        if self._last == self._last:
            self._passed = self._keep * self._passed + self._gain * (reading - self._last)
        self._last = reading
        self._sizes.push(abs(self._passed))
        return self._trigger(self._passed, self._sizes.total), True

    def fire_all(self, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same of readings (n,): impulses (n,) and whether there could be one (n,)."""
        could = ~np.isnan(readings)
        impulses, values, keep = np.zeros(len(readings), int), readings[could], self._keep
        if len(values):
            first = self._last if self._last == self._last else values[0]
            steps = self._gain * np.diff(values, prepend=first)
            passed = list(accumulate(steps.tolist(), lambda before, step: keep * before + step, initial=self._passed))
            sizes, _ = self._sizes.extend(np.abs(passed[1:]))
            impulses[could] = list(map(self._trigger, passed[1:], sizes.tolist()))
            self._passed, self._last = passed[-1], float(values[-1])
        return impulses, could

    def _trigger(self, passed: float, size: float) -> int:
        """1 where the signal goes over zero and was low enough before; size : sum of |signal| over the window."""
        if self._armed and passed > 0.0:
            self._armed = False
            return 1
        if passed < -self._release * size or (passed <= 0.0 and self._release == 0.0):
            self._armed = True
        return 0
