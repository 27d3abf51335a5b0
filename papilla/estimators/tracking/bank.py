"""The wavenumber bank alone: least-squares spectrum of a window that fades in distance, its best wavenumber."""

import math

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.tracking import bank_kernel
from papilla.estimators.tracking.answer import TrackerState, TrackingStatus, WavelengthEstimate
from papilla.estimators.tracking.space_ekf import bank_settings
from papilla.estimators.tracking.stream import WavelengthStream, frequency_of, pair

_OK, _SEARCHING, _STANDSTILL, _MISSING, _NO_VELOCITY, _ALIASED, _ = map(int, TrackingStatus)
FADING = 1.6
"""Sd of a wavenumber from a window that fades over L, times L sqrt(N A^2 / 2 / r) with N the sum of weights: the
rectangular window's sqrt(12), for weights that fall off exponentially (their variance is L^2, their squares' half)."""


class WavenumberBank(WavelengthStream):
    """Streaming wavelength of the best wavenumber; one sample is (reading, velocity_mm_s).

    Parameters
    ----------
    wavelength_range_mm : (shortest, longest) wavelength that is looked for; the window fades over the longest.
    sample_rate_Hz : of the samples, evenly spaced.
    every : samples between two answers; those between repeat the last.

    Raises `InputError` for unusable values.
    """

    def __init__(
        self,
        *,
        wavelength_range_mm: tuple[float, float] = (0.4, 6.0),
        sample_rate_Hz: float = 1000.0,
        every: int = 4,
    ):
        self._dt = 1 / checks.positive("sample_rate_Hz", sample_rate_Hz)
        if every < 1:
            raise InputError(f"every must be at least 1, got {every}")
        self._every = int(every)
        self._settings = bank_settings(wavelength_range_mm, 1 / self._dt)
        self.reset()

    def _fresh(self) -> TrackerState:
        return TrackerState()

    @property
    def state(self) -> TrackerState:
        """All that the bank remembers, to be kept or to be set again."""
        fields = tuple(self._fields.view(float).ravel().tolist())
        return TrackerState((("fields", fields), ("sums", tuple(self._sums.tolist())), ("last", self._last)))

    @state.setter
    def state(self, state: TrackerState) -> None:
        count = self._settings.side**2
        self._fields, self._sums = np.zeros((3, count), complex), np.zeros(bank_kernel.SUMS)
        # velocity, samples since the last answer, wavelength, sigma
        self._last: tuple[float, ...] = (math.nan, 0.0, math.nan, math.nan)
        if state.arrays:
            given = dict(state.arrays)
            if len(given.get("fields", ())) != 6 * count:
                raise InputError(f"the state is not of a bank of {count} wavenumbers")
            self._fields.view(float).reshape(-1)[:] = given["fields"]
            self._sums[:] = given["sums"]
            self._last = given["last"]

    def update(self, sample) -> WavelengthEstimate:
        """The estimate after one more sample (reading, velocity_mm_s); raises `InputError` for another length."""
        reading, velocity = pair(sample)
        settings, fields, sums = self._settings, self._fields, self._sums
        before, count, wavelength, sigma = self._last
        if not abs(velocity) < 1e6:
            self._last = (math.nan, count, wavelength, sigma)
            return WavelengthEstimate(wavelength, sigma, math.nan, _NO_VELOCITY)
        step = 0.5 * (velocity + (velocity if math.isnan(before) else before)) * self._dt
        bank_kernel.move_bank(settings, fields, sums, step)
        status = _OK if math.isfinite(wavelength) else _SEARCHING
        if not abs(reading) < 1e12:
            status = _MISSING
        elif abs(step) * settings.step * settings.low > 0.8 * math.pi:
            status = _ALIASED
        else:
            if sums[bank_kernel.WEIGHT] == 0.0:
                bank_kernel.clear_bank(fields, sums, reading)
            bank_kernel.feed_bank(settings, fields, sums, reading)
            count += 1.0
            if count >= self._every:
                count = 0.0
                wavelength, sigma = self._best() or (wavelength, sigma)
            if step == 0.0:
                status = _STANDSTILL
            elif math.isfinite(wavelength):
                status = _OK
        self._last = (velocity, count, wavelength, sigma)
        return WavelengthEstimate(wavelength, sigma, frequency_of(velocity, wavelength), status)

    def _best(self) -> tuple[float, float] | None:
        """Wavelength and sigma of the window, or None where it is too short or shows nothing."""
        settings, fields, sums = self._settings, self._fields, self._sums
        weight = float(sums[bank_kernel.WEIGHT])
        spread = float(sums[bank_kernel.SPREAD] / weight - (sums[bank_kernel.LEVER] / weight) ** 2)
        length = math.sqrt(12 * max(spread, 0.0))
        low = max(settings.low, math.ceil(1.1 * 2 * math.pi / ((length + 1e-9) * settings.step)))
        if weight < 12 or low >= settings.high - 1:
            return None
        power = bank_kernel.spectrum(fields, sums)
        score = np.empty(settings.high - low)
        bank_kernel.add_up(settings, power, low, settings.high, score)
        fit = 2 * settings.harmonics + 1
        found = np.zeros(bank_kernel.FOUND)
        best = low + int(np.argmax(score))
        bank_kernel.nominate(settings, fields, sums, power, best, found, np.zeros((fit, fit)), np.zeros(fit))
        freedom = weight - found[8]
        if freedom <= 0 or found[5] <= 2 * math.log(power.size) * found[4] / freedom:
            return None
        noise = found[4] / freedom
        by_noise = FADING * math.sqrt(2 * noise / (weight * found[2] ** 2)) / (length / math.sqrt(12))
        # Interpolating three wavenumbers leaves a few hundredths of their spacing.
        spread_k = math.hypot(by_noise, 0.03 * settings.step)
        return 2 * math.pi / found[0], 2 * math.pi * spread_k / found[0] ** 2
