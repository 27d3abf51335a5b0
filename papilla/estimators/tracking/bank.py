"""The wavenumber bank alone: least-squares spectrum of a window that fades in distance, its best harmonic series."""

import math
from typing import Any, NamedTuple

import numpy as np

from papilla import checks
from papilla.estimators.tracking import bank_kernel, bank_vectors
from papilla.estimators.tracking.answer import TrackerState, TrackingStatus, WavelengthEstimate
from papilla.estimators.tracking.space_ekf import bank_settings
from papilla.estimators.tracking.stream import VAGUE, WavelengthStream, frequency_of, pair

_OK, _SEARCHING, _STANDSTILL, _MISSING, _NO_VELOCITY, _ALIASED, _, _DISTURBED = map(int, TrackingStatus)
FADING = 0.5
"""Sd of a wavenumber from a window that fades over L, times L sqrt(N A^2 / 2 / r): the root of the integral of
w^2 (u - 1)^2 du, with w = exp(-u) and N their sum. Three wavenumbers apart by s multiply it by 1 + (s L)^2."""
LEAK = 2.0
"""What harmonics move the peak by, over the RMS of their Lorentzian tails there: measured, the spectrum being that of
one sinusoid with its image."""
GRID = 0.05
"""What interpolating three wavenumbers leaves, as a fraction of their spacing, where a reversal or a change of speed
made the window other than exponential, so that its line is no Lorentzian: measured."""
SHAPE = 0.1
"""Difference of a window's mean distance from its spread, as a fraction, from which it counts as such."""
LEAST = 0.1
"""Fraction of the squares left that stays noise when the shift between the grid and the peak is accounted for."""
EVIDENCE = 4.0
"""Nats by which a harmonic series must beat noise, beyond the logarithm of how many were tried."""
PERIODS = 1.5
"""Periods that the window must span."""
WINDOWS = 4.0
"""Windows after each other whose answers are compared."""
PRIOR = 1.0
"""Windows that the sigma of one window is worth against what they differ by."""


class Held(NamedTuple):
    """What the bank holds from sample to sample: velocity; part of the look and whether it has a nominee; the last
    answer, the distance since in mm, and its relative variance by its window alone; then of the logarithms of the
    answers, fading over `WINDOWS`, the weight in windows, mean, and sum of squares about it."""

    velocity: float = math.nan
    part: float = 0.0
    nominated: float = 0.0
    wavelength: float = math.nan
    since: float = 0.0
    alone: float = math.nan
    weight: float = 0.0
    mean: float = 0.0
    squares: float = 0.0

    @property
    def spread(self) -> float:
        """Relative sd of the answer: of its window alone, and of the windows among each other, which know of any
        disturbance."""
        return math.sqrt((PRIOR * self.alone + self.squares) / (PRIOR + self.weight))

    def answered(self, wavelength: float, spread: float, length: float) -> "Held":
        """With one more answer and its own relative sd; the window fades over `length` mm."""
        weight = self.since / length
        keep = math.exp(-weight / WINDOWS)
        off, total = math.log(wavelength) - self.mean, self.weight * keep + weight
        share = weight / total if self.weight else 1.0
        mean = self.mean + share * off
        squares = self.squares * keep + weight * (1 - share) * off * off
        return Held(*self[:3], wavelength, 0.0, spread * spread, total, mean, squares)


class WavenumberBank(WavelengthStream):
    """Streaming wavelength of the best wavenumber; one sample is (reading, velocity_mm_s).

    Parameters
    ----------
    wavelength_range_mm : (shortest, longest) wavelength that is looked for; the window fades over the longest.
    sample_rate_Hz : of the samples, evenly spaced; every fourth brings a new answer, those between repeat the last.

    Raises `InputError` for unusable values.
    """

    def __init__(self, *, wavelength_range_mm: tuple[float, float] = (0.4, 6.0), sample_rate_Hz: float = 1000.0):
        self._dt = 1 / checks.positive("sample_rate_Hz", sample_rate_Hz)
        self._settings = bank_settings(wavelength_range_mm, 1 / self._dt)
        self.reset()

    def _fresh(self) -> TrackerState:
        return TrackerState()

    @property
    def state(self) -> TrackerState:
        """All that the bank remembers, to be kept or to be set again."""
        return TrackerState.of([*self._parts(self._bank), ("held", self._held)])

    @state.setter
    def state(self, state: TrackerState) -> None:
        fresh = bank_kernel.new_bank(self._settings, compiled=False)
        held = list(Held())
        state.into([*self._parts(fresh), ("held", held)])
        self._bank, self._held = fresh, Held(*held)

    @staticmethod
    def _parts(bank: bank_kernel.Bank) -> list[tuple[str, Any]]:
        return [(name, getattr(bank, name)) for name in bank_kernel.REMEMBERED]

    def update(self, sample) -> WavelengthEstimate:
        """The estimate after one more sample (reading, velocity_mm_s); raises `InputError` for another length."""
        reading, velocity = pair(sample)
        settings, bank, held = self._settings, self._bank, self._held
        if not abs(velocity) < 1e6:
            self._held = held._replace(velocity=math.nan)
            return self._estimate(_NO_VELOCITY, math.nan)
        step = 0.5 * (velocity + (velocity if math.isnan(held.velocity) else held.velocity)) * self._dt
        self._held = held._replace(velocity=velocity, since=held.since + abs(step))
        bank_kernel.move_bank(settings, bank, step)
        if step == 0.0:
            return self._estimate(_STANDSTILL, velocity)
        if not abs(reading) < 1e12:
            return self._estimate(_MISSING, velocity)
        if abs(step) * settings.step * settings.low > 0.8 * math.pi:
            return self._estimate(_ALIASED, velocity)
        if bank.sums[bank_kernel.WEIGHT] == 0.0:
            bank_kernel.clear_bank(bank, reading)
        bank_kernel.feed_bank(settings, bank, reading)
        self._take_look()
        if math.isnan(self._held.wavelength):
            return self._estimate(_SEARCHING, velocity)
        vague = self._held.since > settings.length or self._held.spread > VAGUE
        return self._estimate(_DISTURBED if vague else _OK, velocity)

    def _estimate(self, status: int, velocity: float) -> WavelengthEstimate:
        wavelength = self._held.wavelength
        sigma = wavelength * self._held.spread if wavelength == wavelength else math.nan
        return WavelengthEstimate(wavelength, sigma, frequency_of(velocity, wavelength), status)

    def _take_look(self) -> None:
        """One of the four parts of a look; after the last, its answer."""
        held = self._held
        nominated = self._look(int(held.part), held.nominated)
        self._held = held = held._replace(part=(held.part + 1.0) % 4.0, nominated=nominated)
        found = self._answer() if held.part == 0.0 and nominated else None
        if found:
            self._held = held.answered(*found, self._settings.length)

    def _look(self, part: int, nominated: float) -> float:
        """One of the four parts of a look; whether there is a nominee."""
        settings, bank = self._settings, self._bank
        if part == 0:
            bank_kernel.look(settings, bank)
            return 0.0
        if part == 1:
            if bank.sums[bank_kernel.WEIGHT] < 12:
                return 0.0
            low = bank_kernel.lowest(settings, bank.sums, PERIODS)
            if low >= settings.high - 1:
                return 0.0
            bank_vectors.add_up(bank.power, settings.low, bank.score)
            # A drift explains most with the longest wavelength of all: only a peak of the spectrum is a line.
            power = bank.power[settings.low - 1 : settings.high + 1]
            peaks = (power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:])
            best = bank_vectors.largest(np.where(peaks, bank.score, 0.0), low - settings.low) + settings.low
            if not peaks[best - settings.low]:
                return 0.0
            bank_kernel.nominate(settings, bank, best)
            return 1.0
        if nominated:
            bank_kernel.prefer_multiple(settings, bank, part, EVIDENCE)
        return nominated

    def _answer(self) -> tuple[float, float] | None:
        """Wavelength of the nominee and its relative sd, or None where it does not beat noise."""
        nominee = self._bank.nominee
        weight, rest, count = (
            nominee[index] for index in (bank_kernel.SAMPLES, bank_kernel.REST, bank_kernel.PARAMETERS)
        )
        floor = bank_kernel.rounding(self._bank)
        gain = 0.5 * weight * math.log((nominee[bank_kernel.EXPLAINED] + rest + floor) / (rest + floor))
        if weight <= 2 * count or gain < EVIDENCE + math.log(self._bank.power.size):
            return None
        wavenumber = nominee[bank_kernel.WAVENUMBER]
        return 2 * math.pi / wavenumber, self._spread(nominee, floor) / wavenumber

    def _spread(self, nominee, floor: float) -> float:
        """Sd in rad/mm of the nominee's wavenumber: by noise, its harmonics' tails and the window's shape."""
        names = (bank_kernel.WAVENUMBER, bank_kernel.AMPLITUDE, bank_kernel.LENGTH, bank_kernel.SAMPLES)
        wavenumber, amplitude, length, weight = (nominee[name] for name in names)
        step, sums, fade = self._settings.step, self._bank.sums, length / math.sqrt(12)
        parts = nominee[bank_kernel.SERIES :]
        second, third = math.hypot(*parts[:2]) / amplitude, math.hypot(*parts[2:4]) / amplitude
        # The squares left are of the series on the grid: at the peak itself, these much less.
        shift = (wavenumber - step * nominee[bank_kernel.INDEX]) * fade
        missed = 0.5 * weight * (shift * amplitude) ** 2 * (1 + (2 * second) ** 2 + (3 * third) ** 2)
        rest = nominee[bank_kernel.REST]
        noise = (max(rest - missed, LEAST * rest) + floor) / (weight - nominee[bank_kernel.PARAMETERS])
        coarse = 1 + (step * fade) ** 2
        by_noise = FADING * coarse * math.sqrt(2 * noise / weight) / (amplitude * fade)
        # Tails of the line at (h - 1) and (h + 1) wavenumbers, of random phase.
        tails = math.sqrt(0.5 * (second**2 * (1 + 1 / 9) + third**2 * (1 / 4 + 1 / 16)))
        by_leak = LEAK * coarse * tails / (fade**2 * wavenumber)
        lever = abs(sums[bank_kernel.LEVER]) / sums[bank_kernel.WEIGHT]
        by_shape = GRID * step * min(abs(1 - lever / fade) / SHAPE, 1.0)
        return math.hypot(by_noise, by_leak, by_shape)
