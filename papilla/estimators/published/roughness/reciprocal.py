"""Reciprocal counting in space: the wavelength is the distance between upward crossings, over their number.

The velocity-aware form of the zero-crossing counter: positions of the crossings are interpolated, so whole numbers of
samples do not matter. A reversal begins a new count.
"""

import math
from dataclasses import dataclass, field
from typing import ClassVar

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.stream import Stream
from papilla.estimators.tracking.answer import TrackingStatus, WavelengthEstimate

HYSTERESIS = 0.5
"""A crossing counts after the signal was this fraction of its rms below the mean."""
IRREGULAR = 0.12
"""Scatter of the crossings, in wavelengths, from which some are missing or too many."""


@dataclass(eq=False)
class Crossings:
    """mean, power : of the reading, fading over the path; travel, since : mm of this stroke, and in all; places : of
    its crossings; armed, last, velocity, sign : of the sample before; known : wavelength, sigma."""

    mean: float = math.nan
    power: float = 0.0
    since: float = 0.0
    travel: float = 0.0
    places: list[float] = field(default_factory=list)
    armed: bool = False
    last: float = 0.0
    velocity: float = math.nan
    sign: float = 0.0
    known: tuple[float, float] = (math.nan, math.nan)
    regular: bool = False


class ReciprocalCounter(Stream):
    """Streaming wavelength from zero crossings in space; one sample is (reading, velocity_mm_s).

    Parameters
    ----------
    wavelength_range_mm : (shortest, longest); the mean fades over twice the longest, shorter intervals are not counted.
    sample_rate_Hz : of the samples, evenly spaced.
    crossings : how many are kept; the memory in wavelengths is one less.

    Raises `InputError` for unusable values.
    """

    answer: ClassVar = WavelengthEstimate
    columns = ("reading", "velocity_mm_s")

    def __init__(self, *, wavelength_range_mm=(0.4, 6.0), sample_rate_Hz: float = 1000.0, crossings: int = 17):
        self._shortest, self._longest = (checks.positive("wavelength_range_mm", value) for value in wavelength_range_mm)
        if self._longest <= self._shortest:
            raise InputError(f"wavelength_range_mm must rise, got {self._shortest:g} to {self._longest:g} mm")
        if crossings < 3:
            raise InputError(f"crossings must be at least 3, got {crossings}")
        self._dt, self._kept = 1 / checks.positive("sample_rate_Hz", sample_rate_Hz), int(crossings)
        self.reset()

    def _fresh(self) -> Crossings:
        return Crossings()

    def _take(self, sample):
        (reading, velocity), memory = sample, self._memory
        status = self._count(reading, velocity, memory)
        wavelength, sigma = memory.known
        frequency = abs(velocity) / wavelength if math.isfinite(velocity) else math.nan
        return WavelengthEstimate(wavelength, sigma, frequency, int(status))

    def _count(self, reading: float, velocity: float, memory: Crossings) -> TrackingStatus:
        before, memory.velocity = memory.velocity, velocity
        if not math.isfinite(velocity):
            memory.places, memory.armed = [], False
            return TrackingStatus.NO_VELOCITY
        step = 0.5 * ((velocity if before != before else before) + velocity) * self._dt
        if step == 0.0:
            return TrackingStatus.STANDSTILL
        sign = math.copysign(1.0, step)
        if abs(step) > 0.5 * self._longest or sign != memory.sign or not math.isfinite(reading):
            memory.places, memory.armed, memory.sign = [], False, sign
            memory.travel += abs(step)
            if not math.isfinite(reading):
                return TrackingStatus.MISSING
            if abs(step) > 0.5 * self._longest:
                return TrackingStatus.ALIASED
        self._cross(reading, abs(step), memory)
        if memory.known[0] != memory.known[0]:
            return TrackingStatus.SEARCHING
        return TrackingStatus.OK if memory.regular else TrackingStatus.INCOHERENT

    def _cross(self, reading: float, step: float, memory: Crossings) -> None:
        memory.since, memory.travel = memory.since + step, memory.travel + step
        # At first the mean of all readings, then a fading one.
        share = max(-math.expm1(-step / (2 * self._longest)), step / memory.since)
        memory.mean = reading if memory.mean != memory.mean else memory.mean + share * (reading - memory.mean)
        level = reading - memory.mean
        memory.power += share * (level * level - memory.power)
        if level < -HYSTERESIS * math.sqrt(memory.power):
            memory.armed = True
        elif memory.armed and level >= 0.0 > memory.last:
            memory.armed = False
            place = memory.travel - step * level / (level - memory.last)
            if memory.since > self._longest and not (memory.places and place - memory.places[-1] < self._shortest / 2):
                memory.places = [*memory.places[-self._kept + 1 :], place]
                self._measure(memory)
        memory.last = level

    def _measure(self, memory: Crossings) -> None:
        count = len(memory.places) - 1
        if count < 2:
            return
        wavelength = (memory.places[-1] - memory.places[0]) / count
        rest = [place - memory.places[0] - number * wavelength for number, place in enumerate(memory.places)]
        scatter = math.sqrt(math.fsum(value * value for value in rest) / (count - 1)) / wavelength
        memory.regular = scatter < IRREGULAR and self._shortest <= wavelength <= self._longest
        if memory.regular:
            memory.known = wavelength, math.sqrt(2) * max(scatter, 1e-6) * wavelength / count
