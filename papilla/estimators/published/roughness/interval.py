"""Frequency from the interval between two impulses (2006 paper, equation (5)), and its correction."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import NamedTuple

import numpy as np

from papilla.estimators.published.roughness import corpuscle
from papilla.estimators.published.roughness.answer import (
    ALIASED,
    NONE,
    OK,
    SILENT,
    Finding,
    first_reason,
    found_nothing,
)
from papilla.estimators.published.roughness.corpuscle import Corpuscle, Threshold
from papilla.estimators.published.roughness.impulse_stream import ImpulseStream


class Method(NamedTuple):
    """window_s : of the mean slope. threshold : of the corpuscle.

    same_edge : the interval is between two impulses of one edge, and the wavelength the distance between them.
    """

    window_s: float
    threshold: Threshold
    same_edge: bool


class ImpulseInterval(ImpulseStream):
    """Streaming frequency from single intervals; a sample is (reading, velocity_mm_s[, t_s]).

    As printed: f_t = 1 / t_v (5), t_v the time between the last two impulses of the corpuscle (threshold 1.5 x the
    mean slope over 200 ms). Entering a groove and reaching a ridge both emit one, so (5) read literally is about
    twice v / wavelength, and flickers where the two edges are not half a wavelength apart.

    Corrected: threshold and hysteresis of `ImpulseDensity`'s correction; t_v between two impulses of the same edge
    (the reading rising at both, or falling); and the wavelength is the distance travelled in t_v.

    Measured (RMS error of the wavelength over 0.6-3.0 mm, synthetic gratings, as printed / corrected): 60 / 2.3 % at
    40 dB and 97-103 mm/s, 59 / 26 % at 20 dB, and 66 / 60 % in active touch of 100 sin 2 pi t mm/s at 20 dB.

    Parameters are those of `RoughnessStream`; window_s (None: 0.2 s) is the period of the mean slope, and an answer is
    held so long without a new impulse.
    """

    VARIANTS = {
        "as_printed": Method(window_s=0.2, threshold=corpuscle.PRINTED, same_edge=False),
        "corrected": Method(window_s=0.2, threshold=corpuscle.CORRECTED, same_edge=True),
    }

    def _steps(self):
        method, samples = self._method, self.window_samples
        interval = LastInterval(samples, self.sample_rate_Hz, method.same_edge, self._fastest)
        return Corpuscle(samples, method.threshold), interval


@dataclass(frozen=True)
class IntervalState:
    """since : samples since the last impulse of the falling and of the rising edge, -1 where there was none.

    path : distance in mm since then (NaN once a velocity was missing); interval, distance : of the last two impulses,
    in samples (0: none yet) and mm.
    """

    since: tuple[int, int] = (-1, -1)
    path: tuple[float, float] = (0.0, 0.0)
    interval: int = 0
    distance: float = 0.0


class LastInterval:
    """The interval between the last two impulses of any edge, or of the `same_edge`, not older than `samples`."""

    def __init__(self, samples: int, rate_Hz: float, same_edge: bool, fastest_mm_s: float):
        self._samples, self._rate, self._same_edge, self._fastest = samples, rate_Hz, same_edge, fastest_mm_s
        self._step = 1 / rate_Hz
        self.state = IntervalState()

    @property
    def state(self) -> IntervalState:
        """All that is remembered, to be kept or to be set again."""
        (falling, rising), (falling_mm, rising_mm) = self._since, self._path
        return IntervalState((falling, rising), (falling_mm, rising_mm), self._interval, self._distance)

    @state.setter
    def state(self, state: IntervalState) -> None:
        self._since, self._path = list(state.since), list(state.path)
        self._interval, self._distance = state.interval, state.distance

    def find(self, impulse: int, could: bool, speed: float) -> Finding:
        """What the last interval says after a sample: its impulse (1 rising, -1 falling, 0 none), and |velocity|."""
        self._wait((speed * self._step,))
        if impulse:
            self._take(1 if impulse > 0 else 0)
        elif max(self._since) < 0:
            self._interval = 0
        interval = self._interval
        if not interval:
            return found_nothing(SILENT)
        if speed > self._fastest or interval <= 2:
            return found_nothing(ALIASED)
        frequency = self._rate / interval
        return Finding(frequency, self._distance if self._same_edge else speed / frequency, NONE, OK)

    def find_all(self, impulses: np.ndarray, could: np.ndarray, speeds: np.ndarray) -> Finding:
        """The same after each of n > 0 samples, arrays (n,)."""
        count = len(impulses)
        moved, intervals, distances = (speeds * self._step).tolist(), np.empty(count), np.empty(count)
        begin = 0
        for place in [*np.flatnonzero(impulses).tolist(), count]:
            # Nothing new from `begin` up to the impulse, but the last one may become too old on the way.
            ages = [since for since in self._since if since >= 0]
            old = min(begin + self._samples - min(ages), place) if ages else begin
            intervals[begin:place], distances[begin:place] = self._interval, self._distance
            if old < place:
                intervals[old:place] = self._interval = 0
            self._wait(moved[begin : place + 1])
            if place < count:
                self._take(1 if impulses[place] > 0 else 0)
                intervals[place], distances[place] = self._interval, self._distance
            begin = place + 1
        with np.errstate(divide="ignore", invalid="ignore"):
            frequency = self._rate / intervals
            distance = distances if self._same_edge else speeds / frequency
        fast = (speeds > self._fastest) | (intervals <= 2)
        none = (intervals == 0) | fast
        status = first_reason([(intervals == 0, SILENT), (fast, ALIASED)], OK)
        return Finding(np.where(none, NONE, frequency), np.where(none, NONE, distance), np.full(count, NONE), status)

    def _wait(self, moved: Sequence[float]) -> None:
        """Let as many samples pass, in which the finger moves so far."""
        for edge, since in enumerate(self._since):
            if since >= 0:
                since += len(moved)
                # What is longer ago than a window is forgotten, so nothing grows with the stream.
                forgotten = since > self._samples
                self._since[edge] = -1 if forgotten else since
                self._path[edge] = 0.0 if forgotten else reduce(add, moved, self._path[edge])

    def _take(self, edge: int) -> None:
        """Take one impulse: its interval to the last one, or to the last one of its edge."""
        since = [elapsed for elapsed in self._since if elapsed > 0]
        if self._same_edge:
            if self._since[edge] > 0:
                self._interval, self._distance = self._since[edge], self._path[edge]
        elif since:
            self._interval = min(since)
        self._since[edge], self._path[edge] = 0, 0.0
