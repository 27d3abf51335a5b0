"""The ridge f_MP of the cross-wavelet of two channels while they come in, and its statistics over 67 ms (2011 Oddo)."""

import cmath
import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.status import Status
from papilla.estimators.stream import Stream
from papilla_papers.methods.wavelet import cross
from papilla_papers.methods.window import SampleWindow

REACH_SCALES = 3.0
"""Number of scales to either side of an instant that its coefficient uses; there the wavelet has 1 % of its height."""
HOP_S = 1 / 300
"""Sampling period of the 2011 paper: one instant of the ridge each, so that 20 instants are its window of 67 ms."""
RIDGE_SAMPLES = cross.SAMPLES_BEFORE + 1 + cross.SAMPLES_AFTER
RED_NOISE_CHANCE, RIDGE_OCTAVES = 0.05, 0.22
"""Probability that red noise passes as a ridge, and octaves over which the largest value counts as one. One frequency
alone must pass more rarely than the largest over all. 0.22 was measured: white noise passes in 4-6 % of the instants,
noise of lag-one correlation 0.9 in 2-7 %."""
NO_VALUE = math.nan


class RidgeStatus(Status):
    """Status of an answer; `sentence` says it in words."""

    OK = "ok"
    WARMING_UP = "the wavelets extend beyond the first sample"
    NOT_SIGNIFICANT = "red noise explains what the two channels share"
    GAP = "too many samples are missing within reach"
    SILENT = "a channel does not change"
    COMMON = "no phase between the two channels: it may be common to both (hum, a jolt of the finger)"


class RidgeEstimate(NamedTuple):
    """The ridge as it was `lag_s` ago: frequency_Hz is f_MP, mean_Hz and sd_Hz (ddof 1) of its last 20 instants.

    phase : of the first channel before the second, in -pi ... pi; magnitude : of the cross-wavelet there; NaN where
    there is no answer. status : a `RidgeStatus`. Of a block, arrays (n,).
    """

    frequency_Hz: float | np.ndarray
    mean_Hz: float | np.ndarray
    sd_Hz: float | np.ndarray
    phase: float | np.ndarray
    magnitude: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self) -> Any:
        """The status in words: a string, or a list of them."""
        return RidgeStatus.in_words(self.status)


@dataclass(eq=False)
class RidgeState:
    """window : both channels within reach; ridge : f_MP of the last instants, NaN if there was none; answer : the last
    one."""

    window: SampleWindow
    ridge: np.ndarray = field(default_factory=lambda: np.full(RIDGE_SAMPLES, NO_VALUE))
    answer: RidgeEstimate = RidgeEstimate(NO_VALUE, NO_VALUE, NO_VALUE, NO_VALUE, NO_VALUE, int(RidgeStatus.WARMING_UP))


class CrossRidge(Stream):
    """Online ridge of the cross-wavelet; one sample is (reading, reading) of two channels, in any unit.

    `cross_wavelet` needs the whole record and answers each of its samples; here each instant uses the samples within
    `REACH_SCALES` scales of the longest wavelet to either side, so the answer is `lag_s` old, as for any wavelet. It
    differs from that of the whole record by less than 1 % of the magnitude, because the tails are left out. Between
    two instants, `HOP_S` apart, the answer is held. The level of red noise comes from the samples within reach. A
    reading that is not finite, or too large for a sensor, is replaced by the last one.

    Parameters
    ----------
    low_Hz, high_Hz, per_octave : frequencies, evenly spaced in their logarithm; high_Hz < sample_rate_Hz / 2.
    sample_rate_Hz : of the samples.

    Raises `InputError` for unusable values.
    """

    columns = ("first", "second")
    answer = RidgeEstimate

    def __init__(
        self, *, low_Hz: float = 10.0, high_Hz: float = 100.0, per_octave: int = 12, sample_rate_Hz: float = 1000.0
    ):
        self._rate = rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
        self.frequency_Hz = cross.octaves(low_Hz, high_Hz, per_octave)
        if not high_Hz < 0.5 * rate:
            raise InputError(f"high_Hz must be below half of sample_rate_Hz, got {high_Hz:g} at {rate:g} Hz")
        scale = cross.FREQUENCY_TIMES_SCALE / self.frequency_Hz[:, None]
        reach = math.ceil(REACH_SCALES * float(scale[0, 0]) * rate)
        self.lag_s = reach / rate
        self._count, self._hop = 2 * reach + 1, max(round(HOP_S * rate), 1)
        self._chance = 1 - (1 - RED_NOISE_CHANCE) ** (1 / max(math.log2(high_Hz / low_Hz) / RIDGE_OCTAVES, 1.0))
        eta = np.arange(-reach, reach + 1) / rate / scale
        wavelets = np.pi**-0.25 * np.exp(-1j * cross.WAVELET_OMEGA * eta - 0.5 * eta**2) / np.sqrt(scale * rate)
        # Real and imaginary rows in turn, so that a product with them gives complex numbers.
        self._rows = np.stack([wavelets.real, wavelets.imag], axis=1).reshape(-1, self._count)
        self.reset()

    def _fresh(self) -> RidgeState:
        return RidgeState(SampleWindow(2, self._count, self._hop))

    def _remember(self, memory: RidgeState) -> None:
        window = memory.window
        if (window.count, window.hop) != (self._count, self._hop):
            raise InputError(
                f"the state holds {window.count} samples, the wavelets reach over {self._count}; or its hop of "
                f"{window.hop} samples is not {self._hop}"
            )
        self._memory = memory

    def _take(self, sample: tuple[float, ...]) -> RidgeEstimate:
        memory = self._memory
        if memory.window.push(sample):
            status, frequency, product = self._instant(memory.window)
            memory.ridge = np.append(memory.ridge[1:], frequency)
            mean = float(memory.ridge.sum()) / RIDGE_SAMPLES
            sd = float(np.linalg.norm(memory.ridge - mean)) / math.sqrt(RIDGE_SAMPLES - 1)
            memory.answer = RidgeEstimate(frequency, mean, sd, cmath.phase(product), abs(product), int(status))
        return memory.answer

    def _instant(self, window: SampleWindow) -> tuple[RidgeStatus, float, complex]:
        """Status, frequency and cross product in the middle of the window, at the frequency with the largest
        product."""
        if window.torn:
            return RidgeStatus.GAP, NO_VALUE, complex(NO_VALUE, NO_VALUE)
        # A constant signal has no coefficient.
        first, second = window.samples - window.samples.mean(axis=1)[:, None]
        if window.dead or not (first @ first > 0.0 and second @ second > 0.0):
            return RidgeStatus.SILENT, NO_VALUE, complex(NO_VALUE, NO_VALUE)
        products = (self._rows @ first).view(complex) * (self._rows @ second).view(complex).conj()
        best = int(np.abs(products).argmax())
        frequency, product = self.frequency_Hz.item(best), complex(products[best])
        status = RidgeStatus.OK
        if not abs(product) > cross.cross_threshold(first, second, self._rate, frequency, self._chance):
            status = RidgeStatus.NOT_SIGNIFICANT
        elif not product.imag**2 > cross.common_threshold(first, second, self._rate, frequency, RED_NOISE_CHANCE) * abs(
            product
        ):
            status = RidgeStatus.COMMON
        return status, frequency, product
