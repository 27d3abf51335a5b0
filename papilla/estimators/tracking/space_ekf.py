"""The wavelength in the position domain: an extended Kalman filter guided by a bank of wavenumbers and a supervisor.

The wavelength is a constant of the surface, so with the position known the phase is 2 pi x / lambda and there is
nothing to lag behind. The filter's memory is declared: its variance is that of the Cramér-Rao bound of a window of
`memory_s`.
"""

import math
from typing import Any

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.tracking import bank_kernel, guide_kernel, phase_kernel, tracker_kernel
from papilla.estimators.tracking.answer import TrackerState, TrackingStatus, WavelengthEstimate
from papilla.estimators.tracking.compiled import kernels, numba_available, scalars

DEFAULT_RANGE_MM = (0.4, 6.0)
LOOP_TURNS = 3.24
"""Loop frequency times memory at which the noise variance of the steady filter is that of a rectangular window:
K2^2 r / (2 K1) of the gains (sqrt(2) w, w^2) equals 12 r / T^3."""
HARMONICS = 5
RESOLUTION = 1.2
"""Spacing of the bank's wavenumbers times its length, rad: half widths of the fading window's line."""
PASS_BAND = 0.4
"""Harmonics above this fraction of the sampling rate are expected to have been removed by anti-aliasing."""
NO_TEXTURE_NATS = 12.0
DISTURBED_SHARE = 0.25
"""Coloured power over the texture's from which the tracker may be drawn to another line: between a hum of half its
amplitude (an eighth of its power), which does no harm, and one of the same amplitude (a half), which does."""

_OK, _SEARCHING, _STANDSTILL, _MISSING, _NO_VELOCITY, _ALIASED, _NO_TEXTURE, _DISTURBED = map(int, TrackingStatus)
_STATUS = {
    tracker_kernel.TAKEN: _OK,
    tracker_kernel.NO_READING: _MISSING,
    tracker_kernel.NO_VELOCITY: _NO_VELOCITY,
    tracker_kernel.TOO_FAST: _ALIASED,
    tracker_kernel.STILL: _STANDSTILL,
}
_BY_OUTCOME = np.array([_STATUS[code] for code in range(5)])


class SpaceTracker:
    """Streaming wavelength; one sample is (reading, velocity_mm_s).

    Parameters
    ----------
    wavelength_range_mm : (shortest, longest) wavelength that is looked for.
    sample_rate_Hz : of the samples, which are taken to be evenly spaced.
    memory_s : declared memory of the wavelength.
    shear_mm : how far the skin may trail the finger; 0 for a rigid probe.
    relaxation_mm : distance over which it turns over after a reversal, > 0.
    saturation : |reading| from which a reading is not one.
    compiled : run the kernel compiled by numba (extra `fast`); by default where numba is installed. The first use of a
        process then takes a while to compile.

    Raises `InputError` for unusable values, `MissingExtraError` when compiling is asked for without numba.
    """

    def __init__(
        self,
        *,
        wavelength_range_mm: tuple[float, float] = DEFAULT_RANGE_MM,
        sample_rate_Hz: float = 1000.0,
        memory_s: float = 0.5,
        shear_mm: float = 0.3,
        relaxation_mm: float = 0.5,
        saturation: float = 1e12,
        compiled: bool | None = None,
    ):
        rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
        memory = checks.positive("memory_s", memory_s)
        if memory * rate < 50:
            raise InputError(f"memory_s must be at least 50 samples ({50 / rate:g} s at {rate:g} Hz), got {memory:g}")
        bank = bank_settings(wavelength_range_mm, rate)
        phase = _phase_settings(
            rate,
            memory,
            checks.within("shear_mm", shear_mm, 0, 0.5 * bank.length),
            checks.positive("relaxation_mm", relaxation_mm),
            1e-6 * bank.length,
        )
        guide = _guide_settings(rate, memory, checks.positive("saturation", saturation))
        self._settings = guide_kernel.Settings(bank, phase, guide)
        self._fewest = NO_TEXTURE_NATS / (memory * rate)
        self._compiled = numba_available() if compiled is None else compiled
        self._kernels = kernels(tracker_kernel.KERNELS, self._compiled, tracker_kernel.APART)
        self._answer = np.empty((1, tracker_kernel.ANSWER))
        self._row = np.empty((1, 2))
        self.reset()

    @property
    def memory_s(self) -> float:
        """The declared memory, s."""
        return LOOP_TURNS * self._settings.guide.dt / self._settings.phase.loop

    @property
    def state(self) -> TrackerState:
        """All that the tracker remembers, to be kept or to be set again."""
        return TrackerState.of(_remembered(self._memory))

    @state.setter
    def state(self, state: TrackerState) -> None:
        fresh = _memory(self._settings, self._compiled)
        state.into(_remembered(fresh))
        self._memory = fresh

    def reset(self) -> None:
        """Forget everything."""
        self.state = TrackerState()

    @property
    def noise_sd(self) -> float:
        """Standard deviation of a reading's noise as the tracker sees it, in the readings' unit; 0 before a lock."""
        return math.sqrt(self._memory.phase.track[phase_kernel.NOISE])

    @property
    def phase_rad(self) -> float:
        """Phase of the fundamental under the gauge, in [0, 2 pi); NaN without a lock."""
        locked = self._memory.guide[guide_kernel.LOCKED] == 1.0
        return float(self._memory.phase.state[1]) % (2 * math.pi) if locked else math.nan

    @property
    def phase_sigma_rad(self) -> float:
        """Standard deviation of `phase_rad`; NaN without a lock."""
        locked = self._memory.guide[guide_kernel.LOCKED] == 1.0
        return math.sqrt(self._memory.phase.track[phase_kernel.TRUE_P]) if locked else math.nan

    def process(self, block) -> WavelengthEstimate:
        """Estimates after each row of a block (n, 2); bit for bit what `update` gives row by row.

        Raises `InputError` for a block of another shape.
        """
        return self.process_with_phase(block)[0]

    def process_with_phase(self, block) -> tuple[WavelengthEstimate, np.ndarray, np.ndarray]:
        """What `process` gives, then `phase_rad` and `phase_sigma_rad` after each row, (n,) each, in rad.

        Raises `InputError` for a block of another shape.
        """
        rows = np.ascontiguousarray(block, dtype=float)
        if rows.ndim != 2 or rows.shape[1] != 2:
            shape = " x ".join(map(str, rows.shape))
            raise InputError(f"a block must be n x 2 (reading, velocity_mm_s), got {shape}")
        answers = np.empty((len(rows), tracker_kernel.ANSWER))
        self._kernels.track_block(self._settings, self._memory, rows, answers)
        wavenumber, spread, outcome, locked, strength, phase, phase_sigma, colour = answers.T
        known = locked == 1.0
        with np.errstate(divide="ignore", invalid="ignore"):
            wavelength = np.where(known, 2 * math.pi / wavenumber, math.nan)
            sigma = wavelength * spread / wavenumber
        status = _BY_OUTCOME[outcome.astype(int)]
        status = np.where((status == _OK) & ~known, _SEARCHING, status)
        status = np.where((status == _OK) & (strength < self._fewest), _NO_TEXTURE, status)
        status = np.where((status == _OK) & (colour > DISTURBED_SHARE), _DISTURBED, status)
        frequency = np.where(status == _NO_VELOCITY, math.nan, np.abs(rows[:, 1]) / wavelength)
        estimate = WavelengthEstimate(wavelength, sigma, frequency, status)
        return estimate, np.where(known, phase % (2 * math.pi), math.nan), np.where(known, phase_sigma, math.nan)

    def update(self, sample) -> WavelengthEstimate:
        """The estimate after one more sample (reading, velocity_mm_s).

        Raises `InputError` for a sample of another length.
        """
        try:
            reading, velocity = sample
        except ValueError as error:
            raise InputError("a sample must be (reading, velocity_mm_s)") from error
        row, answer = self._row, self._answer
        row[0, 0], row[0, 1] = reading, velocity
        self._kernels.track_block(self._settings, self._memory, row, answer)
        wavenumber, spread, outcome, locked, strength, _, _, colour = answer[0].tolist()
        status = _STATUS[int(outcome)]
        if not locked:
            return WavelengthEstimate(math.nan, math.nan, math.nan, _SEARCHING if status == _OK else status)
        wavelength = 2 * math.pi / wavenumber
        if status == _OK and strength < self._fewest:
            status = _NO_TEXTURE
        if status == _OK and colour > DISTURBED_SHARE:
            status = _DISTURBED
        frequency = math.nan if status == _NO_VELOCITY else abs(row[0, 1].item()) / wavelength
        return WavelengthEstimate(wavelength, wavelength * spread / wavenumber, frequency, status)


def bank_settings(wavelength_range_mm: tuple[float, float], rate: float) -> bank_kernel.BankSettings:
    """The bank for wavelengths from the shortest to the longest (mm); `rate` in Hz.

    Raises `InputError` unless the range spans a factor of 1.5 to 100.
    """
    shortest = checks.positive("shortest wavelength (mm)", wavelength_range_mm[0])
    longest = checks.positive("longest wavelength (mm)", wavelength_range_mm[1])
    if not 1.5 * shortest <= longest <= 100 * shortest:
        raise InputError(f"wavelength_range_mm must span a factor 1.5 to 100, got {shortest:g} to {longest:g} mm")
    step = RESOLUTION / longest
    high = int(2 * math.pi / shortest / step) + 2
    split, turns, mixing = bank_kernel.bank_arrays(high)
    return bank_kernel.BankSettings(
        step=step,
        low=max(int(2 * math.pi / longest / step), 1),
        high=high,
        length=longest,
        keep=math.exp(-1 / (0.25 * rate)),
        period=2 * math.pi / step,
        split=split,
        turns=turns,
        mixing=mixing,
    )


def _phase_settings(rate, memory, shear, relaxation, still) -> phase_kernel.PhaseSettings:
    orders = np.arange(1.0, HARMONICS + 1)
    return phase_kernel.PhaseSettings(
        band=2 * math.pi * PASS_BAND,
        loop=LOOP_TURNS / (memory * rate),
        amplitude=0.3 / math.sqrt(rate),
        offset=2 * math.pi * 2.0 / rate,
        forget=1 / (0.2 * rate),
        floor=1e-12,
        shear=shear,
        relax=relaxation,
        still=still,
        memory=memory * rate,
        orders=orders,
        shape=np.concatenate([np.zeros(4), orders**-2, [0.0], orders[1:] ** -2]),
    )


def _guide_settings(rate, memory, saturation) -> guide_kernel.GuideSettings:
    every = max(round(0.004 * rate), guide_kernel.STRIDE)
    return guide_kernel.GuideSettings(
        dt=1 / rate,
        every=every,
        rare=3 * every,
        doubt=1.5,
        evidence=4.0,
        alarm=4.0,
        calm=2.0,
        inject=0.02 * rate,
        alarms=2.0,
        refill=20 / rate,
        speed=1 / (memory * rate),
        periods=1.2,
        settle=0.04 * rate,
        looks=6.0,
        clear=4.0,
        better=1.6,
        apart=0.5,
        lost=0.06,
        # A factor 4.5, over ten looks or 40 ms: two or three windows, which no single step of the baseline spoils.
        wild=1.5,
        share=0.1,
        limit=saturation,
        gap=0.05 * rate,
        plain=2.5,
        even=0.1,
        mature=0.1 * rate,
        slow=0.02,
    )


def _memory(settings: guide_kernel.Settings, compiled: bool) -> guide_kernel.Memory:
    size = settings.phase.shape.size
    memory = guide_kernel.Memory(
        bank=bank_kernel.new_bank(settings.bank, compiled),
        phase=phase_kernel.Phase(
            state=np.zeros(size),
            cov=np.zeros((size, size)),
            track=scalars(phase_kernel.TRACK, compiled),
            row=np.concatenate([np.zeros(3), [1.0], np.zeros(size - 4)]),
            across=np.zeros(size),
        ),
        guide=scalars(guide_kernel.GUIDE, compiled),
        average=np.zeros(settings.bank.high + 1),
    )
    memory.guide[guide_kernel.VELOCITY] = math.nan
    memory.guide[guide_kernel.TOKENS] = settings.guide.alarms
    memory.phase.track[phase_kernel.SURPRISE] = memory.phase.track[phase_kernel.EXCESS] = 1.0
    return memory


def _remembered(memory: guide_kernel.Memory) -> list[tuple[str, Any]]:
    """What is not only room to work, by name."""
    parts = [(name, getattr(memory.bank, name)) for name in bank_kernel.REMEMBERED]
    parts += [(name, getattr(memory.phase, name)) for name in ("state", "cov", "track")]
    return [*parts, ("guide", memory.guide), ("average", memory.average)]
