"""The wavenumber bank alone: least-squares spectrum of a window that fades in distance, its best harmonic series."""

import math

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.tracking import bank_kernel, vectors
from papilla.estimators.tracking.answer import TrackerState, TrackingStatus, WavelengthEstimate
from papilla.estimators.tracking.space_ekf import bank_settings
from papilla.estimators.tracking.stream import WavelengthStream, frequency_of, pair

_OK, _SEARCHING, _STANDSTILL, _MISSING, _NO_VELOCITY, _ALIASED, *_ = map(int, TrackingStatus)
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
"""Periods that the window must span: nothing but the window itself can contradict a wrong answer."""


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
        parts = ((name, getattr(self._bank, name)) for name in bank_kernel.REMEMBERED)
        return TrackerState((*((name, tuple(array.ravel().tolist())) for name, array in parts), ("last", self._last)))

    @state.setter
    def state(self, state: TrackerState) -> None:
        fresh = bank_kernel.new_bank(self._settings)
        given = dict(state.arrays)
        # velocity, part of the look, whether it has a nominee, wavelength, sigma
        last = given.pop("last", (math.nan, 0.0, 0.0, math.nan, math.nan))
        for name in bank_kernel.REMEMBERED if state.arrays else ():
            array = getattr(fresh, name)
            if len(given.get(name, ())) != array.size:
                raise InputError(f"the state is not of a bank of {fresh.power.size} wavenumbers")
            array.reshape(-1)[:] = given[name]
        self._bank, self._last = fresh, last

    def update(self, sample) -> WavelengthEstimate:
        """The estimate after one more sample (reading, velocity_mm_s); raises `InputError` for another length."""
        reading, velocity = pair(sample)
        settings, bank, sums = self._settings, self._bank, self._bank.sums
        before, part, nominated, wavelength, sigma = self._last
        if not abs(velocity) < 1e6:
            self._last = (math.nan, part, nominated, wavelength, sigma)
            return WavelengthEstimate(wavelength, sigma, math.nan, _NO_VELOCITY)
        step = 0.5 * (velocity + (velocity if math.isnan(before) else before)) * self._dt
        bank_kernel.move_bank(settings, bank, step)
        if not abs(reading) < 1e12:
            status = _MISSING
        elif abs(step) * settings.step * settings.low > 0.8 * math.pi:
            status = _ALIASED
        else:
            if sums[bank_kernel.WEIGHT] == 0.0:
                bank_kernel.clear_bank(bank, reading)
            bank_kernel.feed_bank(settings, bank, reading)
            nominated = self._look(int(part), nominated)
            part = (part + 1.0) % 4.0
            if part == 0.0 and nominated:
                wavelength, sigma = self._answer() or (wavelength, sigma)
            status = _STANDSTILL if step == 0.0 else _OK if math.isfinite(wavelength) else _SEARCHING
        self._last = (velocity, part, nominated, wavelength, sigma)
        return WavelengthEstimate(wavelength, sigma, frequency_of(velocity, wavelength), status)

    def _look(self, part: int, nominated: float) -> float:
        """One of the four parts of a look; whether there is a nominee."""
        settings, bank = self._settings, self._bank
        if part == 0:
            bank_kernel.look(bank)
            return 0.0
        if part == 1:
            if bank.sums[bank_kernel.WEIGHT] < 12:
                return 0.0
            low = bank_kernel.lowest(settings, bank.sums, PERIODS)
            if low >= settings.high - 1:
                return 0.0
            vectors.add_up(bank.power, settings.low, bank.score)
            best = vectors.largest(bank.score, low - settings.low) + settings.low
            bank_kernel.nominate(settings, bank, best)
            return 1.0
        if nominated:
            bank_kernel.prefer_multiple(settings, bank, part, EVIDENCE)
        return nominated

    def _answer(self) -> tuple[float, float] | None:
        """Wavelength and sigma of the nominee, or None where it does not beat noise."""
        nominee = self._bank.nominee
        weight, rest, count = (
            nominee[index] for index in (bank_kernel.SAMPLES, bank_kernel.REST, bank_kernel.PARAMETERS)
        )
        floor = bank_kernel.rounding(self._bank)
        gain = 0.5 * weight * math.log((nominee[bank_kernel.EXPLAINED] + rest + floor) / (rest + floor))
        if weight <= 2 * count or gain < EVIDENCE + math.log(self._bank.power.size):
            return None
        wavenumber = float(nominee[bank_kernel.WAVENUMBER])
        return 2 * math.pi / wavenumber, 2 * math.pi * self._spread(nominee, floor) / wavenumber**2

    def _spread(self, nominee, floor: float) -> float:
        """Sd in rad/mm of the nominee's wavenumber: by noise, its harmonics' tails and the window's shape."""
        names = (bank_kernel.WAVENUMBER, bank_kernel.AMPLITUDE, bank_kernel.LENGTH, bank_kernel.SAMPLES)
        wavenumber, amplitude, length, weight = (float(nominee[name]) for name in names)
        step, sums, fade = self._settings.step, self._bank.sums, length / math.sqrt(12)
        parts = nominee[bank_kernel.SERIES :].tolist()
        second, third = math.hypot(*parts[:2]) / amplitude, math.hypot(*parts[2:4]) / amplitude
        # The squares left are of the series on the grid: at the peak itself, these much less.
        shift = (wavenumber - step * float(nominee[bank_kernel.INDEX])) * fade
        missed = 0.5 * weight * (shift * amplitude) ** 2 * (1 + (2 * second) ** 2 + (3 * third) ** 2)
        rest = float(nominee[bank_kernel.REST])
        noise = (max(rest - missed, LEAST * rest) + floor) / (weight - float(nominee[bank_kernel.PARAMETERS]))
        coarse = 1 + (step * fade) ** 2
        by_noise = FADING * coarse * math.sqrt(2 * noise / weight) / (amplitude * fade)
        # Tails of the line at (h - 1) and (h + 1) wavenumbers, of random phase.
        tails = math.sqrt(0.5 * (second**2 * (1 + 1 / 9) + third**2 * (1 / 4 + 1 / 16)))
        by_leak = LEAK * coarse * tails / (fade**2 * wavenumber)
        lever = abs(float(sums[bank_kernel.LEVER])) / float(sums[bank_kernel.WEIGHT])
        by_shape = GRID * step * min(abs(1 - lever / fade) / SHAPE, 1.0)
        return math.hypot(by_noise, by_leak, by_shape)
