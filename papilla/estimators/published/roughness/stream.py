"""The engine of the published roughness estimators: time, faults, warming up, state, and the last step to a wavelength.

A method only says what it finds in its window (`_find`: a frequency and the distance travelled in one period); what a
sample is, and what becomes of the finding, is said here once for all of them.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.published.roughness.answer import (
    DUPLICATE,
    GAP,
    MISSING,
    NO_VELOCITY,
    NONE,
    OK,
    SATURATED,
    STANDSTILL,
    WARMING_UP,
    Finding,
    RoughnessEstimate,
)

DEFAULT_RANGE_MM = (0.4, 6.0)
BLOCK = 100
"""Blocks of fewer samples are faster one sample at a time."""


@dataclass(frozen=True, kw_only=True)
class StreamState:
    """last_time_s : time of the last sample, NaN before the first or where samples carry no time.

    seen : samples so far, until the window is full; memory : what the method remembers of its window.
    """

    last_time_s: float
    seen: int
    memory: Any


class RoughnessStream(ABC):
    """Base of the published estimators; one sample is (reading, velocity_mm_s) or (reading, velocity_mm_s, t_s).

    reading is of one gauge, in any unit; velocity_mm_s is that of the finger over the surface, NaN where unknown. With
    t_s a sample not later than half a period after the last is a duplicate and is left out, and one later than one and
    a half periods makes the missing ones in between known; without it every sample is one period after the last.

    Parameters
    ----------
    variant : "as_printed" or "corrected".
    window_s : length of the window; None is that of the variant.
    sample_rate_Hz, saturation : of the readings; |reading| >= saturation is not used.
    wavelength_range_mm : its low end says from which speed on the sampling rate is too low for a corrected variant to
        answer; what is printed knows no such limit.

    Raises `InputError` for unusable values.
    """

    VARIANTS: ClassVar[Mapping[str, Any]]
    """What is different between "as_printed" and "corrected"; each has a window_s."""

    def __init__(
        self,
        *,
        variant: str = "as_printed",
        window_s: float | None = None,
        sample_rate_Hz: float = 1000.0,
        wavelength_range_mm: tuple[float, float] = DEFAULT_RANGE_MM,
        saturation: float = math.inf,
    ):
        if variant not in self.VARIANTS:
            raise InputError(f"variant must be one of {', '.join(self.VARIANTS)}, got {variant!r}")
        self.variant = variant
        self._method = self.VARIANTS[variant]
        window_s = self._method.window_s if window_s is None else window_s
        self.sample_rate_Hz = checks.positive("sample_rate_Hz", sample_rate_Hz)
        self.window_samples = round(checks.positive("window_s", window_s) * self.sample_rate_Hz)
        if self.window_samples < 8:
            raise InputError(f"window_s must hold at least 8 samples, got {window_s:g} s at {self.sample_rate_Hz:g} Hz")
        self._low, self._high = checked_range(wavelength_range_mm)
        if not saturation > 0:
            raise InputError(f"saturation (units of the reading) must be greater than 0, got {saturation}")
        self._saturation = float(saturation)
        self._prepare()
        self.reset()

    def _prepare(self) -> None:
        """Constants of the method; called once, before `_forget`."""
        # Faster than this, the shortest wavelength would be sampled less than twice a period; no paper prints a limit.
        printed = self.variant == "as_printed"
        self._fastest = math.inf if printed else 0.5 * self.sample_rate_Hz * self._low
        # So many samples are answered by "warming up".
        self._full = self.window_samples

    @abstractmethod
    def _forget(self) -> None:
        """Make the memory of a method that has seen nothing."""

    @abstractmethod
    def _find(self, reading: float, speed: float) -> Finding:
        """What is found with one more sample: the reading (NaN: none) and |velocity|. `_seen` already counts it."""

    @abstractmethod
    def _find_all(self, readings: np.ndarray, speeds: np.ndarray) -> Finding:
        """The same after each of n > 0 samples, arrays (n,), bit for bit. `_seen` does not count them yet."""

    @property
    @abstractmethod
    def _memory(self):
        """What the method remembers, a frozen dataclass."""

    @_memory.setter
    @abstractmethod
    def _memory(self, memory) -> None: ...

    def reset(self) -> None:
        """Forget everything."""
        self._time, self._seen = NONE, 0
        self._forget()

    @property
    def state(self) -> StreamState:
        """All that the estimator remembers, to be kept or to be set again; one of another window is refused."""
        return StreamState(last_time_s=self._time, seen=self._seen, memory=self._memory)

    @state.setter
    def state(self, state: StreamState) -> None:
        self._memory = state.memory
        self._time, self._seen = state.last_time_s, state.seen

    def update(self, sample) -> RoughnessEstimate:
        """The estimate after one more sample (reading, velocity_mm_s) or (reading, velocity_mm_s, t_s).

        Raises `InputError` for a sample of another length.
        """
        if len(sample) == 2:
            reading, velocity = sample
            return self._one(float(reading), float(velocity))
        if len(sample) == 3:
            reading, velocity, time = map(float, sample)
            missing = self._missing_before(time)
            if missing < 0:
                return _LEFT_OUT
            if missing:
                self._many(np.tile((NONE, velocity), (missing, 1)))
            return self._one(reading, velocity)
        raise InputError(f"a sample must be (reading, velocity_mm_s) or that and t_s, got {len(sample)} values")

    def process(self, block) -> RoughnessEstimate:
        """Estimates after each row of a block (n, 2) or (n, 3); bit for bit what `update` gives row by row.

        Raises `InputError` for a block of another shape.
        """
        rows = np.asarray(block, float)
        if rows.ndim != 2 or rows.shape[1] not in (2, 3):
            shape = " x ".join(map(str, rows.shape))
            raise InputError(f"a block must be n x 2 (reading, velocity_mm_s) or n x 3 (and t_s), got {shape}")
        return self._timed(rows) if rows.shape[1] == 3 else self._many(rows)

    def _one(self, reading: float, velocity: float) -> RoughnessEstimate:
        """The answer after one more sample."""
        fault = OK
        if not -self._saturation < reading < self._saturation:
            fault = SATURATED if abs(reading) < math.inf else MISSING
            reading = NONE
        if self._seen <= self._full:
            self._seen += 1
        frequency, distance, power, status = self._find(reading, abs(velocity))
        if fault:
            return RoughnessEstimate(NONE, NONE, NONE, fault)
        if self._seen <= self._full:
            return RoughnessEstimate(NONE, NONE, NONE, WARMING_UP)
        if status in (OK, GAP) and frequency > 0.0:
            if not distance < math.inf:
                distance, status = NONE, NO_VELOCITY
            elif distance <= 0.0:
                distance, status = NONE, STANDSTILL
        else:
            distance = NONE
        return RoughnessEstimate(frequency, distance, power, status)

    def _many(self, rows: np.ndarray) -> RoughnessEstimate:
        """Answers after each of the rows (n, 2)."""
        if len(rows) < BLOCK:
            return columns([self._one(*row) for row in rows.tolist()])
        readings, speeds = rows[:, 0], np.abs(rows[:, 1])
        usable = (readings > -self._saturation) & (readings < self._saturation)
        # Readings of 1e308 overflow as they do one by one, where Python does not warn.
        with np.errstate(all="ignore"):
            frequency, distance, power, status = self._find_all(np.where(usable, readings, NONE), speeds)
        seen = np.minimum(self._seen + 1 + np.arange(len(rows)), self._full + 1)
        self._seen = int(seen[-1])
        answered = ((status == OK) | (status == GAP)) & (frequency > 0.0)
        status = np.where(answered & (distance <= 0.0), STANDSTILL, status)
        status = np.where(answered & ~(distance < math.inf), NO_VELOCITY, status)
        distance = np.where(answered & (distance > 0.0) & (distance < math.inf), distance, NONE)
        fault = np.where(usable, OK, np.where(np.abs(readings) < math.inf, SATURATED, MISSING))
        status = np.where(usable, np.where(seen <= self._full, WARMING_UP, status), fault)
        silent = ~usable | (seen <= self._full)
        frequency, distance, power = (np.where(silent, NONE, column) for column in (frequency, distance, power))
        return RoughnessEstimate(frequency, distance, power, status)

    def _timed(self, rows: np.ndarray) -> RoughnessEstimate:
        """Answers of rows (n, 3) with their times."""
        missing = np.array([self._missing_before(time) for time in rows[:, 2].tolist()], int)
        taken = missing >= 0
        places = np.cumsum(missing + 1) - 1
        # Between the rows that are taken, missing ones with the velocity of the row behind them.
        even = np.repeat(rows[taken, :2], missing[taken] + 1, axis=0)
        lost = np.ones(len(even), bool)
        lost[places[taken]] = False
        even[lost, 0] = NONE
        answers = self._many(even)
        whole = [np.full(len(rows), value) for value in _LEFT_OUT]
        for column, values in zip(whole, answers, strict=True):
            column[taken] = np.asarray(values)[places[taken]]
        return RoughnessEstimate(*whole)

    def _missing_before(self, time: float) -> int:
        """How many samples are missing before the one at this time, -1 for a duplicate; the clock goes on."""
        if not -math.inf < time < math.inf:
            time = self._time + 1 / self.sample_rate_Hz
        steps = (time - self._time) * self.sample_rate_Hz
        if steps < 0.5:
            return -1
        self._time = time
        # A gap of more than two windows leaves nothing of what was before.
        return min(round(min(steps, 1e9)) - 1, 2 * self.window_samples) if steps >= 1.5 else 0


_LEFT_OUT = RoughnessEstimate(NONE, NONE, NONE, DUPLICATE)


def columns(answers: list[RoughnessEstimate]) -> RoughnessEstimate:
    """Answers of single samples as arrays (n,)."""
    frequency, wavelength, power, status = zip(*answers, strict=True) if answers else ((), (), (), ())
    return RoughnessEstimate(
        np.array(frequency, float), np.array(wavelength, float), np.array(power, float), np.array(status, int)
    )


def checked_range(wavelength_range_mm) -> tuple[float, float]:
    """The two wavelengths as floats; raises `InputError` unless 0 < low < high."""
    try:
        low, high = wavelength_range_mm
    except (TypeError, ValueError):
        message = f"wavelength_range_mm must be two numbers (low, high), got {wavelength_range_mm!r}"
        raise InputError(message) from None
    low = checks.positive("wavelength_range_mm (low end)", low)
    high = checks.positive("wavelength_range_mm (high end)", high)
    if low >= high:
        raise InputError(f"wavelength_range_mm must rise, got {low:g} and {high:g}")
    return low, high
