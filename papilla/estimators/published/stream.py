"""What the published roughness estimators share: the sample, the answer with its status, and the keeping of time."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.errors import InputError

VARIANTS = ("as_printed", "corrected")
DEFAULT_RANGE_MM = (0.4, 6.0)
_NONE = math.nan


class RoughnessStatus(IntEnum):
    """What became of an answer; `sentence` says it in words."""

    OK = 0
    WARMING_UP = 1
    SILENT = 2
    STANDSTILL = 3
    NO_VELOCITY = 4
    GAP = 5
    MISSING = 6
    SATURATED = 7
    ALIASED = 8
    DUPLICATE = 9

    @property
    def sentence(self) -> str:
        """The status in words."""
        return _SENTENCES[self]


_SENTENCES = {
    RoughnessStatus.OK: "ok",
    RoughnessStatus.WARMING_UP: "the window is not full yet",
    RoughnessStatus.SILENT: "nothing in the window: no texture, a dead gauge, or slower than the window can see",
    RoughnessStatus.STANDSTILL: "no movement, so the frequency tells nothing of a wavelength",
    RoughnessStatus.NO_VELOCITY: "no finite velocity: frequency only",
    RoughnessStatus.GAP: "samples are missing in the window; the answer, if any, is from the others",
    RoughnessStatus.MISSING: "the reading is missing or not finite",
    RoughnessStatus.SATURATED: "the reading is saturated",
    RoughnessStatus.ALIASED: "too fast for this sampling rate: what is counted may be an alias",
    RoughnessStatus.DUPLICATE: "the sample is not later than the one before, and was left out",
}
OK, WARMING_UP, SILENT, STANDSTILL, NO_VELOCITY, GAP, MISSING, SATURATED, ALIASED, DUPLICATE = map(int, RoughnessStatus)


class RoughnessEstimate(NamedTuple):
    """frequency_Hz, wavelength_mm (NaN where there is no answer), power and status: the value of a `RoughnessStatus`.

    power is that of the spectral line in squared units of the reading times s; NaN of the estimators that count. Of a
    block, arrays (n,).
    """

    frequency_Hz: float | np.ndarray
    wavelength_mm: float | np.ndarray
    power: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self):
        """The status in words: a string, or a list of them."""
        if isinstance(self.status, np.ndarray):
            return [RoughnessStatus(code).sentence for code in self.status.tolist()]
        return RoughnessStatus(self.status).sentence


class Answers(NamedTuple):
    """What `_advance` of an estimator returns: four lists, an entry a sample."""

    frequency: list[float]
    wavelength: list[float]
    power: list[float]
    status: list[int]


@dataclass(frozen=True, kw_only=True)
class StreamState:
    """last_time_s : time of the last sample, NaN before the first or where samples carry no time."""

    last_time_s: float = _NONE


class RoughnessStream(ABC):
    """Base of the published estimators; one sample is (reading, velocity_mm_s) or (reading, velocity_mm_s, t_s).

    reading is of one gauge, in any unit; velocity_mm_s is that of the finger over the surface, NaN where unknown. With
    t_s a sample not later than half a period after the last is a duplicate and is left out, and one later than one and
    a half periods makes the missing ones in between known; without it every sample is one period after the last.

    Subclasses loop over samples in `_advance`, which is all that `update` and `process` call: a chunk cannot matter.
    """

    def __init__(
        self,
        *,
        variant: str,
        window_s: float,
        sample_rate_Hz: float,
        wavelength_range_mm: tuple[float, float],
        saturation: float,
    ):
        if variant not in VARIANTS:
            raise InputError(f"variant must be one of {', '.join(VARIANTS)}, got {variant!r}")
        self.variant = variant
        self.sample_rate_Hz = checks.positive("sample_rate_Hz", sample_rate_Hz)
        self.window_samples = round(checks.positive("window_s", window_s) * self.sample_rate_Hz)
        if self.window_samples < 8:
            raise InputError(f"window_s must hold at least 8 samples, got {window_s:g} s at {self.sample_rate_Hz:g} Hz")
        self._low, self._high = checked_range(wavelength_range_mm)
        if not saturation > 0:
            raise InputError(f"saturation (units of the reading) must be greater than 0, got {saturation}")
        self._saturation = float(saturation)
        # Faster than this, the shortest wavelength would be sampled less than twice a period.
        self._fastest = 0.5 * self.sample_rate_Hz * self._low
        self._time = _NONE

    @abstractmethod
    def _advance(self, readings, velocities) -> Answers:
        """Answers to lists of readings and velocities that are usable."""

    def process(self, block) -> RoughnessEstimate:
        """Estimates after each row of a block (n, 2) or (n, 3); bit for bit what `update` gives row by row.

        Raises `InputError` for a block of another shape.
        """
        rows = np.asarray(block, float)
        if rows.ndim != 2 or rows.shape[1] not in (2, 3):
            shape = " x ".join(map(str, rows.shape))
            raise InputError(f"a block must be n x 2 (reading, velocity_mm_s) or n x 3 (and t_s), got {shape}")
        columns = rows.T.tolist()
        answers = self._timed(*columns) if len(columns) == 3 else self._advance(*columns)
        frequency, wavelength, power = (np.array(values, float) for values in answers[:3])
        return RoughnessEstimate(frequency, wavelength, power, np.array(answers.status, int))

    def update(self, sample) -> RoughnessEstimate:
        """The estimate after one more sample (reading, velocity_mm_s) or (reading, velocity_mm_s, t_s).

        Raises `InputError` for a sample of another length.
        """
        if len(sample) == 2:
            reading, velocity = sample
            f, wavelength, power, status = self._advance((float(reading),), (float(velocity),))
        elif len(sample) == 3:
            reading, velocity, time = sample
            f, wavelength, power, status = self._timed((float(reading),), (float(velocity),), (float(time),))
        else:
            raise InputError(f"a sample must be (reading, velocity_mm_s) or that and t_s, got {len(sample)} values")
        return RoughnessEstimate(f[0], wavelength[0], power[0], status[0])

    def _timed(self, readings, velocities, times) -> Answers:
        """Answers of samples that carry their times: fills gaps with missing samples, leaves duplicates out."""
        even_readings: list[float] = []
        even_velocities: list[float] = []
        places: list[int] = []
        rate = self.sample_rate_Hz
        for reading, velocity, time in zip(readings, velocities, times, strict=True):
            if not -math.inf < time < math.inf:
                time = self._time + 1 / rate
            steps = (time - self._time) * rate
            if steps < 0.5:
                places.append(-1)
                continue
            if steps >= 1.5:
                # A gap of more than two windows leaves nothing of what was before.
                missing = min(round(min(steps, 1e9)) - 1, 2 * self.window_samples)
                even_readings += [_NONE] * missing
                even_velocities += [velocity] * missing
            self._time = time
            places.append(len(even_readings))
            even_readings.append(reading)
            even_velocities.append(velocity)
        answers = self._advance(even_readings, even_velocities)
        frequency, wavelength, power = (
            [values[place] if place >= 0 else _NONE for place in places] for values in answers[:3]
        )
        status = [answers.status[place] if place >= 0 else DUPLICATE for place in places]
        return Answers(frequency, wavelength, power, status)


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


def checked_ring(name: str, values: tuple, length: int) -> list:
    """A buffer of a saved state as a list; raises `InputError` where it is of another window."""
    if len(values) != length:
        raise InputError(f"the state's {name} holds {len(values)} samples, the window is {length}")
    return list(values)
