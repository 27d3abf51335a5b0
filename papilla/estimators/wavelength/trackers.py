"""Trackers of the wavelength: the follower behind samples with a velocity or a position, of one gauge or several."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from operator import eq
from typing import Any, ClassVar, NamedTuple

import numpy as np

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.units import SAMPLE_RATE_HZ
from papilla.estimators.health import numbered
from papilla.estimators.stream import Stream
from papilla.estimators.wavelength.follower import Follower, Memory
from papilla.estimators.wavelength.memory import TrackingStatus, checked

DEFAULT_WAVELENGTHS_MM = (0.4, 6.0)
HAND_SCALE_SIGMA = 0.015
"""Relative error of the velocity or path of a hand-held finger: one standard deviation, half of 3 %."""
SPIKE_CHANGE_RATIO, SPIKE_FADING_SAMPLES = 8.0, 100
"""A change this many times the mean change between samples of a gauge (over so many samples) is a spike if it is a
single one."""
SHARP_PHASE_CYCLES = 0.1
"""Standard deviation of a gauge's phase, in cycles, above which it is not compared with the others."""
SPEED_SD, SPEED_REACH = 0.03, 0.1
"""Relative error of a velocity: its standard deviation, and the largest error that is searched."""
CLEAR_TURN_MISFIT = 25.0
"""Smallest difference of squared misfit to any other number of turns."""
UNKNOWN_WAVELENGTH = math.nan, math.nan
FULL_TURN_RAD = 2 * math.pi


class WavelengthEstimate(NamedTuple):
    """wavelength_mm, wavelength_sigma_mm, frequency_Hz (NaN where there is no answer), status (a `TrackingStatus`
    value).

    frequency_Hz is |velocity| over the wavelength. Of a block, arrays (n,).
    """

    wavelength_mm: float | np.ndarray
    wavelength_sigma_mm: float | np.ndarray
    frequency_Hz: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self) -> Any:
        """The status in words: a string, or a list of them."""
        return TrackingStatus.in_words(self.status)


class FusedEstimate(NamedTuple):
    """The fields of `WavelengthEstimate` for all gauges together; and wavelength_by_phase_mm with its sigma, from the
    phases between gauges (NaN if their places are unknown or the number of whole turns is not clear); gauges : number
    of gauges with readings now. Of a block, arrays (n,)."""

    wavelength_mm: float | np.ndarray
    wavelength_sigma_mm: float | np.ndarray
    frequency_Hz: float | np.ndarray
    status: int | np.ndarray
    wavelength_by_phase_mm: float | np.ndarray
    wavelength_by_phase_sigma_mm: float | np.ndarray
    gauges: int | np.ndarray

    @property
    def sentence(self) -> Any:
        """The status in words: a string, or a list of them."""
        return TrackingStatus.in_words(self.status)


@dataclass(eq=False)
class PathMemory:
    """follower : its memory; samples : taken; place_mm : integral of velocity_mm_s, whose last value is kept; changes :
    for each gauge: last reading, mean change between samples, their number, and whether a spike was left out."""

    follower: Memory
    samples: int = 0
    place_mm: float = 0.0
    velocity_mm_s: float = math.nan
    changes: dict[int, tuple[float, float, int, bool]] = field(default_factory=dict)


class FusedTracker(Stream):
    """Online estimate of the wavelength from g gauges together; one sample is (g1, ..., gg, velocity_mm_s), evenly in
    time.

    A line is detected in a spectrum over the path, against the background beside it, and refined by the phases of its
    harmonics along the path (`papilla.estimators.wavelength.line_search`); gauges add their power, not their readings.

    Parameters
    ----------
    gauge_positions_mm : places (g,) of the gauges along the movement; with them, the phases between the gauges give the
        wavelength, too. Or the number g, if the places are not known.
    wavelength_range_mm : (shortest, longest) wavelength that is searched for.
    sample_rate_Hz : of the samples.
    scale_sigma : relative standard deviation of the velocity's scale; the relative error of the wavelength contains all
        of it.
    latency_s : delay of the velocity relative to the readings; None means that it is estimated while the speed changes.
    resonances_Hz : resonance frequencies of the finger or its mount: at a constant speed a line there is not ok.
    ridge_pitch_mm : of the finger's own ridges, which may amplify a harmonic above the fundamental; 0 for none, None if
        unknown.
    saturation : |reading| at and above which a reading is saturated.

    Raises `InputError` for unusable values.
    """

    answer: ClassVar[Any] = FusedEstimate

    def __init__(
        self,
        gauge_positions_mm: int | Sequence[float],
        *,
        wavelength_range_mm: tuple[float, float] = DEFAULT_WAVELENGTHS_MM,
        sample_rate_Hz: float = SAMPLE_RATE_HZ,
        scale_sigma: float = HAND_SCALE_SIGMA,
        latency_s: float | None = None,
        resonances_Hz: tuple[float, ...] = (),
        ridge_pitch_mm: float | None = None,
        saturation: float = checks.LARGEST_READING,
    ):
        gauges, self._places = gauge_positions_mm, None
        if not isinstance(gauges, int):
            self._places = tuple(checks.finite("gauge position (mm)", place) for place in gauges)
            gauges = len(self._places)
        number = int(gauges)
        if number < 1 or (self._places is not None and len(set(self._places)) < number):
            raise InputError(f"gauge_positions_mm must be a number, or different places, got {gauge_positions_mm}")
        self._limit = checks.positive("saturation", saturation)
        options = checked(wavelength_range_mm, sample_rate_Hz, scale_sigma, latency_s, resonances_Hz, ridge_pitch_mm)
        self._follower, self._dt = Follower(number, options), 1 / options.rate_Hz
        self.columns = (*numbered(number), "velocity_mm_s")
        self.reset()

    @property
    def latency_s(self) -> float:
        """Delay of the velocity, stated or estimated."""
        return self._follower.memory.late_s

    @property
    def latency_sigma_s(self) -> float:
        """Standard deviation of the estimated delay; 10 ms if the speed never changed."""
        return math.sqrt(self._follower.memory.late_variance)

    @property
    def other_mm(self) -> float:
        """The other possible wavelength after the last search; infinite if there is none."""
        wavenumber = self._follower.memory.finding.other
        return 1 / wavenumber if wavenumber else math.inf

    @property
    def lines(self) -> tuple[tuple[float, float, float], ...]:
        """(wavelength_mm, power over the background, chance) of the lines of the last search, strongest first."""
        return self._follower.memory.finding.lines

    def _fresh(self) -> PathMemory:
        return PathMemory(self._follower.fresh())

    def _remember(self, memory: PathMemory) -> None:
        self._memory = memory
        self._follower.remember(memory.follower)

    def _take(self, sample):
        memory, velocity = self._memory, sample[-1]
        finite = math.isfinite(velocity)
        if finite and memory.velocity_mm_s == memory.velocity_mm_s:
            memory.place_mm += 0.5 * (memory.velocity_mm_s + velocity) * self._dt
        memory.velocity_mm_s = velocity if finite else math.nan
        memory.samples += 1
        place = memory.place_mm if finite else math.nan
        return self.follow(memory.samples * self._dt, place, velocity, sample[:-1])

    def follow(self, time_s: float, place_mm: float, velocity_mm_s: float, readings: tuple[float, ...]) -> Any:
        """The estimate after one more sample at this time and place, for callers that compute both."""
        readings = self._plain(readings)
        status, by_phase = self._follower.advance(time_s, place_mm, readings), UNKNOWN_WAVELENGTH
        self._memory.follower = self._follower.memory
        wavelength, sigma = self._follower.estimate()
        frequency = math.nan if status is TrackingStatus.NO_VELOCITY else abs(velocity_mm_s) / wavelength
        if self.answer is WavelengthEstimate:
            return WavelengthEstimate(wavelength, sigma, frequency, int(status))
        if self._places is not None and status.good:
            finding = self._follower.memory.finding
            by_phase = _by_phase(self._places, finding.phase, finding.phase_sigma, wavelength)
        seen = sum(map(eq, readings, readings))
        return FusedEstimate(wavelength, sigma, frequency, int(status), *by_phase, seen)

    def _plain(self, readings: tuple[float, ...]) -> tuple[float, ...]:
        """The readings, with NaN for a saturated one and for a spike: one far from the reading before. A second one in
        a row is a step."""
        changes, limit, plain = self._memory.changes, self._limit, []
        for gauge, raw in enumerate(readings):
            reading = raw if -limit < raw < limit else math.nan
            last, usual, count, out = changes.get(gauge) or (reading, 0.0, 0, False)
            change = abs(reading - last)
            if change > SPIKE_CHANGE_RATIO * usual and count == SPIKE_FADING_SAMPLES and not out:
                changes[gauge], reading = (last, usual, count, True), math.nan
            elif change == change:
                count += count < SPIKE_FADING_SAMPLES
                changes[gauge] = reading, usual + (change - usual) / count, count, False
            elif last != last:
                changes[gauge] = reading, usual, count, False
            plain.append(reading)
        return tuple(plain)


@lru_cache
def _by_phase(places, phases, sigmas, wavelength: float) -> tuple[float, float]:
    """Wavelength and sigma from the phases (cycles) between the gauges, which change only after a search."""
    rows = [
        (place, FULL_TURN_RAD * phase, FULL_TURN_RAD * sigma)
        for place, phase, sigma in zip(places, phases, sigmas, strict=True)
    ]
    sharp = [gauge for gauge in rows if gauge[2] < FULL_TURN_RAD * SHARP_PHASE_CYCLES]
    if len(sharp) < 2:
        return UNKNOWN_WAVELENGTH
    where, turned, spread = zip(*sharp, strict=True)
    return wavelength_between(where, turned, spread, wavelength)


class SpaceTracker(FusedTracker):
    """Online estimate of the wavelength from one gauge; one sample is (reading, velocity_mm_s). Parameters as
    `FusedTracker`."""

    answer: ClassVar[Any] = WavelengthEstimate

    def __init__(self, **options: Any):
        super().__init__(1, **options)
        self.columns = ("reading", "velocity_mm_s")


class LineTracker(FusedTracker):
    """Online estimate of the wavelength from g channels over a known path; one sample is (g1, ..., gg, position_mm), at
    any rate.

    Without times a line over time cannot be recognised: `FusedTracker` and `Pipeline` have them. Parameters as
    `FusedTracker`.
    """

    answer: ClassVar[Any] = WavelengthEstimate

    def __init__(self, channels: int, **options: Any):
        super().__init__(channels, **({"sample_rate_Hz": 1.0, "latency_s": 0.0} | options))
        self.columns = (*self.columns[:-1], "position_mm")

    def _take(self, sample):
        *readings, place = sample
        self._memory.samples += 1
        return self.follow(self._memory.samples * self._dt, place, math.nan, tuple(readings))


def wavelength_between(places, phases, sigmas, wavelength: float) -> tuple[float, float]:
    """(wavelength, sigma) in mm from the phases of two gauges or more; NaN if the number of whole turns is not clear.

    At a distance d the phases differ by 2 pi d / lambda, at any speed, but they are known up to whole turns. A velocity
    error of a few per cent may become whole turns over many wavelengths, so the tracker's wavelength alone does not
    determine their number: it only limits the search. Gauges at uneven distances fit one number of turns far better
    than its neighbours, like the scales of a vernier. If no number fits clearly better, there is no answer.

    Parameters
    ----------
    places : (g,) along the sliding direction, mm. phases, sigmas : (g,) of the fundamental under each gauge, rad.
    wavelength : in mm, from the velocity.
    """
    base, *others = sigmas = np.asarray(sigmas, float)
    distance, phase = (np.subtract(values[1:], values[0]) for values in (places, phases))
    # (n, g - 1) all numbers of whole turns that the velocity allows; a step is half a turn at the largest distance.
    span = float(np.abs(distance).max()) / wavelength
    steps = int(2 * SPEED_REACH * span)
    cycles = (1 + np.arange(-steps, steps + 1) / (2 * span)) / wavelength
    turns = np.unique(np.round(np.outer(cycles, distance) - phase / FULL_TURN_RAD), axis=0)
    # Weighted regression of the phase differences on the distances, for all numbers of turns at once.
    pull = distance / (np.square(others) + base**2)
    stiffness = float(pull @ distance)
    turned = phase + FULL_TURN_RAD * turns
    wavenumber = turned @ pull / stiffness
    # The first gauge's phase is 0, and all of them are free to shift together.
    residual = np.pad(turned - np.outer(wavenumber, distance), ((0, 0), (1, 0)))
    misfit = residual**2 @ sigmas**-2 - (residual @ sigmas**-2) ** 2 / (sigmas**-2).sum()
    speed = ((wavenumber * wavelength / FULL_TURN_RAD - 1) / SPEED_SD) ** 2
    best = int((misfit + speed).argmin())
    # Birge's ratio (1932, doi:10.1103/PhysRev.40.207): if phases scatter more than their sigmas, they distinguish turns
    # less.
    ratio = max(1.0, float(misfit[best]) / (len(distance) - 1)) if len(distance) > 1 else 1.0
    price = misfit / ratio + speed
    if wavenumber[best] <= 0 or (np.delete(price, best) < price[best] + CLEAR_TURN_MISFIT).any():
        return UNKNOWN_WAVELENGTH
    # The first gauge's phase error enters every lag: it shifts the slope by the sum of the weights, and does not
    # average out.
    error = math.hypot(*(pull * others), base * float(pull.sum())) * math.sqrt(ratio) / stiffness
    result = FULL_TURN_RAD / float(wavenumber[best])
    return result, result**2 / FULL_TURN_RAD * error
