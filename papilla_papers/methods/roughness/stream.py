"""Common part of the published roughness estimators: time, faults, warming up, state, and the last step to a
wavelength.

A method only evaluates its window (`_find`: a frequency and the distance travelled in one period); this module handles
the samples and turns the finding into an answer, for all methods.
"""

import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.status import Status
from papilla.estimators.stream import Stream

DEFAULT_RANGE_MM = (0.4, 6.0)
NOTHING_FOUND = math.nan


class RoughnessStatus(Status):
    """Status of an answer; `sentence` says it in words."""

    OK = "ok"
    WARMING_UP = "the window is not full yet"
    SILENT = "nothing in the window: no texture, a dead gauge, or slower than the window can see"
    STANDSTILL = "no movement, so the frequency gives no wavelength"
    NO_VELOCITY = "no finite velocity: frequency only"
    GAP = "samples are missing in the window; the answer, if any, is from the others"
    MISSING = "the reading is missing or not finite"
    SATURATED = "the reading is saturated"
    ALIASED = "too fast for this sampling rate: what is counted may be an alias"
    DUPLICATE = "the sample is not later than the one before, and was left out"


(OK, WARMING_UP_CODE, SILENT_CODE, STANDSTILL_CODE, NO_VELOCITY_CODE, GAP_CODE, MISSING_CODE, SATURATED_CODE,
 ALIASED_CODE, DUPLICATE_CODE) = map(int, RoughnessStatus)  # fmt: skip


class RoughnessEstimate(NamedTuple):
    """frequency_Hz, wavelength_mm (NaN where there is no answer), power and status: the value of a `RoughnessStatus`.

    power is that of the spectral line in squared units of the reading times s; NaN for the estimators that count. Of a
    block, arrays (n,).
    """

    frequency_Hz: float | np.ndarray
    wavelength_mm: float | np.ndarray
    power: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self) -> Any:
        """The status in words: a string, or a list of them."""
        return RoughnessStatus.in_words(self.status)


class Finding(NamedTuple):
    """Result of a method in its window: status and, if that is OK or GAP, the period.

    frequency in Hz, distance in mm travelled in one period (both NaN if there is none), and power.
    """

    status: int
    frequency: float = NOTHING_FOUND
    distance: float = NOTHING_FOUND
    power: float = NOTHING_FOUND


@dataclass(eq=False)
class RoughnessMemory:
    """settings : of the estimator, in words; method : state of its method.

    seen : samples so far, until the window is full; time_s : of the last sample, NaN before the first or if samples
    have no time.
    """

    settings: str
    method: Any
    seen: int = 0
    time_s: float = NOTHING_FOUND


class RoughnessStream(Stream):
    """Base of the published estimators; one sample is (reading, velocity_mm_s) or (reading, velocity_mm_s, t_s).

    reading is of one gauge, in any unit; velocity_mm_s is that of the finger over the surface, NaN if unknown. With
    t_s, a sample less than half a period after the last is a duplicate and is left out, and one more than one and a
    half periods after it shows that samples are missing in between. Without t_s every sample counts as one period after
    the last.

    Parameters
    ----------
    variant : "as_printed" or "corrected".
    window_s : length of the window; None is that of the variant.
    sample_rate_Hz, saturation : of the readings; |reading| >= saturation is not used.
    wavelength_range_mm : its low end gives the speed above which the sampling rate is too low for a corrected variant
        to answer; the printed variants have no such limit.

    Raises `InputError` for unusable values.
    """

    VARIANTS: ClassVar[Mapping[str, Any]]
    """Parameters that differ between "as_printed" and "corrected"; each variant has a window_s."""
    columns = ("reading", "velocity_mm_s", "t_s")
    optional = 1
    answer = RoughnessEstimate

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
        self._low, self._high = checks.rising("wavelength_range_mm", wavelength_range_mm)
        if not saturation > 0:
            raise InputError(f"saturation (units of the reading) must be greater than 0, got {saturation}")
        self._saturation = float(saturation)
        # Faster than this, the shortest wavelength would be sampled less than twice a period; no paper prints a limit.
        self._fastest = math.inf if variant == "as_printed" else 0.5 * self.sample_rate_Hz * self._low
        # Number of samples that get the status "warming up".
        self._full = self.window_samples
        self._settings = (
            f"{type(self).__name__}, {variant}, {self._low:g} to {self._high:g} mm, "
            f"a window of {self.window_samples} samples at {self.sample_rate_Hz:g} Hz"
        )
        self._prepare()
        self.reset()

    def _prepare(self) -> None:
        """Compute the constants of the method; parameters that it adds are added to `_settings`."""

    @abstractmethod
    def _begin(self) -> Any:
        """State of a method before the first sample."""

    @abstractmethod
    def _find(self, method: Any, reading: float, speed: float) -> Finding:
        """The finding with one more sample: the reading (NaN: none) and |velocity|; method : state of the method."""

    def _fresh(self) -> RoughnessMemory:
        return RoughnessMemory(self._settings, self._begin())

    def _remember(self, memory: RoughnessMemory) -> None:
        if memory.settings != self._settings:
            raise InputError(f"the state is of {memory.settings}; this is {self._settings}")
        self._memory = memory

    def _take(self, sample: tuple[float, ...]) -> RoughnessEstimate:
        reading, velocity, *time = sample
        if time:
            missing = self._missing_before(time[0])
            if missing < 0:
                return RoughnessEstimate(NOTHING_FOUND, NOTHING_FOUND, NOTHING_FOUND, DUPLICATE_CODE)
            for _ in range(missing):
                self._one(NOTHING_FOUND, velocity)
        return self._one(reading, velocity)

    def _one(self, reading: float, velocity: float) -> RoughnessEstimate:
        """The answer after one more sample, a period after the last."""
        fault, memory = OK, self._memory
        if not -self._saturation < reading < self._saturation:
            fault, reading = SATURATED_CODE if reading == reading else MISSING_CODE, NOTHING_FOUND
        memory.seen = min(memory.seen + 1, self._full + 1)
        status, frequency, distance, power = self._find(memory.method, reading, abs(velocity))
        if fault or memory.seen <= self._full:
            return RoughnessEstimate(NOTHING_FOUND, NOTHING_FOUND, NOTHING_FOUND, fault or WARMING_UP_CODE)
        if status in (OK, GAP_CODE) and frequency > 0.0:
            if not distance < math.inf:
                distance, status = NOTHING_FOUND, NO_VELOCITY_CODE
            elif distance <= 0.0:
                distance, status = NOTHING_FOUND, STANDSTILL_CODE
        else:
            distance = NOTHING_FOUND
        return RoughnessEstimate(frequency, distance, power, status)

    def _missing_before(self, time: float) -> int:
        """Number of missing samples before the one at this time, -1 for a duplicate; the clock advances."""
        if time != time:
            time = self._memory.time_s + 1 / self.sample_rate_Hz
        steps = (time - self._memory.time_s) * self.sample_rate_Hz
        if steps < 0.5:
            return -1
        self._memory.time_s = time
        # A gap of more than two windows leaves nothing of the earlier samples.
        return min(round(min(steps, 1e9)) - 1, 2 * self.window_samples) if steps >= 1.5 else 0
