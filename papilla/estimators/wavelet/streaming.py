"""The ridge f_MP of the cross-wavelet of two channels while they come in, and its statistics over 67 ms (2011 Oddo)."""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.wavelet.cross import AFTER, BEFORE
from papilla.estimators.wavelet.morlet import FOURIER, OMEGA0, octaves
from papilla.estimators.wavelet.significance import cross_quantile, red_noise

REACH = 3.0
"""Scales to either side of an instant that its coefficient is made of; the wavelet is at 1 % of its height there."""
HOP_S = 1 / 300
"""Sampling period of the 2011 paper: one instant of the ridge each, so that 20 of them are its window of 67 ms."""
KEPT = BEFORE + 1 + AFTER
CHANCE, APART = 0.05, 0.22
"""Chance that red noise passes for a ridge, and octaves for which its greatest over all frequencies counts as one.

One frequency alone must pass more seldom than the greatest of all. 0.22 was measured: white noise passes in 4-6 % of
the instants, noise of lag-one correlation 0.9 in 2-7 %.
"""
MOST_MISSING = 0.1
"""Fraction of the samples within reach: with more missing ones there is no coefficient."""
_NONE = math.nan


class RidgeStatus(IntEnum):
    """What became of an answer; `sentence` says it in words."""

    OK = 0
    WARMING_UP = 1
    NOT_SIGNIFICANT = 2
    GAP = 3
    SILENT = 4

    @property
    def sentence(self) -> str:
        """The status in words."""
        return _SENTENCES[self]


_SENTENCES = {
    RidgeStatus.OK: "ok",
    RidgeStatus.WARMING_UP: "the wavelets reach beyond the first sample",
    RidgeStatus.NOT_SIGNIFICANT: "red noise explains what the two channels share",
    RidgeStatus.GAP: "too many samples are missing within reach",
    RidgeStatus.SILENT: "a channel does not change",
}
OK, WARMING_UP, NOT_SIGNIFICANT, GAP, SILENT = map(int, RidgeStatus)


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
    def sentence(self):
        """The status in words: a string, or a list of them."""
        if isinstance(self.status, np.ndarray):
            return [RidgeStatus(code).sentence for code in self.status.tolist()]
        return RidgeStatus(self.status).sentence


_START = RidgeEstimate(_NONE, _NONE, _NONE, _NONE, _NONE, WARMING_UP)


@dataclass(frozen=True)
class RidgeState:
    """samples : of both channels within reach, oldest first, a missing one holds the last; missing : 1 or 0 of each.

    seen : samples so far, until all of the reach is; until : samples to the next instant; ridge : f_MP of the last
    instants, NaN where there was none; answer : the last one.
    """

    samples: tuple[tuple[float, ...], tuple[float, ...]]
    missing: tuple[int, ...]
    seen: int = 0
    until: int = 0
    ridge: tuple[float, ...] = (_NONE,) * KEPT
    answer: RidgeEstimate = _START


class CrossRidge:
    """Streaming ridge of the cross-wavelet; one sample is (reading, reading) of two channels, in any unit.

    `cross_wavelet` needs the whole record and answers each of its samples; here each instant is made of the samples
    within `REACH` scales of the longest wavelet to either side, so the answer is `lag_s` old: the price of any wavelet.
    It differs from that of the whole record by the tails left out, less than 1 % of the magnitude. Between two
    instants, `HOP_S` apart, the answer is held. The level of red noise is that of the samples within reach.

    Parameters
    ----------
    low_Hz, high_Hz, per_octave : frequencies, evenly spaced in their logarithm; high_Hz < sample_rate_Hz / 2.
    sample_rate_Hz : of the samples.

    Raises `InputError` for unusable values.
    """

    def __init__(
        self,
        *,
        low_Hz: float = 10.0,
        high_Hz: float = 100.0,
        per_octave: int = 12,
        sample_rate_Hz: float = 1000.0,
    ):
        rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
        self.frequency_Hz = octaves(low_Hz, high_Hz, per_octave)
        if not high_Hz < 0.5 * rate:
            raise InputError(f"high_Hz must be below half of sample_rate_Hz, got {high_Hz:g} at {rate:g} Hz")
        scale = FOURIER / self.frequency_Hz
        reach = math.ceil(REACH * float(scale[0]) * rate)
        self.lag_s = reach / rate
        self._rate, self._count, self._hop = rate, 2 * reach + 1, max(round(HOP_S * rate), 1)
        eta = np.arange(-reach, reach + 1) / rate / scale[:, None]
        wavelet = np.pi**-0.25 * np.exp(-1j * OMEGA0 * eta - 0.5 * eta**2) / np.sqrt(scale * rate)[:, None]
        # A constant has no coefficient: the mean is taken out of the wavelets instead of the samples.
        wavelet -= wavelet.mean(axis=1, keepdims=True)
        independent = max(math.log2(high_Hz / low_Hz) / APART, 1.0)
        self._quantile = cross_quantile(1 - (1 - CHANCE) ** (1 / independent))
        self._wavelets = np.ascontiguousarray(np.concatenate([wavelet.real, wavelet.imag]))
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        nothing = (0.0,) * self._count
        self.state = RidgeState((nothing, nothing), (0,) * self._count)

    @property
    def state(self) -> RidgeState:
        """All that the estimator remembers, to be kept or to be set again; one of another reach is refused."""
        first, second = (tuple(row) for row in self._window().tolist())
        missing = tuple(self._missing[self._place :] + self._missing[: self._place])
        return RidgeState((first, second), missing, self._seen, self._until, tuple(self._ridge), self._answer)

    @state.setter
    def state(self, state: RidgeState) -> None:
        if len(state.missing) != self._count:
            raise InputError(f"the state holds {len(state.missing)} samples, the wavelets reach over {self._count}")
        # Each sample is written twice, one reach apart: any window is then one contiguous piece a channel.
        self._samples = np.tile(np.array(state.samples, float), 2)
        self._missing, self._gaps, self._place = list(state.missing), sum(state.missing), 0
        self._seen, self._until, self._ridge, self._answer = state.seen, state.until, list(state.ridge), state.answer

    def _window(self) -> np.ndarray:
        return self._samples[:, self._place : self._place + self._count]

    def process(self, block) -> RidgeEstimate:
        """Estimates after each row of a block (n, 2); bit for bit what `update` gives row by row.

        Raises `InputError` for a block of another shape.
        """
        rows = np.asarray(block, float)
        if rows.ndim != 2 or rows.shape[1] != 2:
            raise InputError(f"a block must be n x 2 (two channels), got {' x '.join(map(str, rows.shape))}")
        answers = [self.update(row) for row in rows.tolist()]
        *numbers, status = zip(*answers, strict=True) if answers else ((),) * len(RidgeEstimate._fields)
        frequency, mean, sd, phase, magnitude = (np.array(column, float) for column in numbers)
        return RidgeEstimate(frequency, mean, sd, phase, magnitude, np.array(status, int))

    def update(self, sample) -> RidgeEstimate:
        """The estimate after one more sample of two channels; a reading that is not finite holds the last one.

        Raises `InputError` for a sample of another length.
        """
        if len(sample) != 2:
            raise InputError(f"a sample must be (reading, reading) of two channels, got {len(sample)} values")
        place, count, gap = self._place, self._count, 0
        for channel, reading in zip(self._samples, sample, strict=True):
            value = float(reading)
            if not -math.inf < value < math.inf:
                gap, value = 1, channel[place - 1]
            channel[place] = channel[place + count] = value
        self._gaps += gap - self._missing[place]
        self._missing[place] = gap
        self._place = place + 1 if place + 1 < count else 0
        self._seen = min(self._seen + 1, count)
        if self._seen == count:
            if self._until == 0:
                self._until = self._hop
                self._answer = self._instant()
            self._until -= 1
        return self._answer

    def _instant(self) -> RidgeEstimate:
        """The ridge in the middle of the window."""
        frequency, phase, magnitude, status = self._strongest()
        self._ridge = [*self._ridge[1:], frequency]
        mean = math.fsum(self._ridge) / KEPT
        sd = math.sqrt(math.fsum((value - mean) ** 2 for value in self._ridge) / (KEPT - 1))
        return RidgeEstimate(frequency, mean, sd, phase, magnitude, status)

    def _strongest(self) -> tuple[float, float, float, int]:
        """f_MP, phase, magnitude and status of the instant in the middle of the window."""
        if self._gaps > MOST_MISSING * self._count:
            return _NONE, _NONE, _NONE, GAP
        window = self._window()
        if (window == window[:, :1]).all(axis=1).any():
            return _NONE, _NONE, _NONE, SILENT
        centred = window - window.mean(axis=1, keepdims=True)
        energy = np.einsum("cn,cn->c", centred, centred).tolist()
        lagged = np.einsum("cn,cn->c", centred[:, 1:], centred[:, :-1]).tolist()
        one, two = (self._wavelets @ row for row in window)
        half = len(self.frequency_Hz)
        first, second = one[:half] + 1j * one[half:], two[:half] + 1j * two[half:]
        product = first * second.conj()
        size = np.abs(product)
        best = int(size.argmax())
        frequency = float(self.frequency_Hz[best])
        level = 0.5 * self._quantile
        for total, neighbours in zip(energy, lagged, strict=True):
            level *= math.sqrt(total / self._count * red_noise(frequency, self._rate, neighbours / total))
        magnitude = float(size[best])
        phase = math.atan2(product[best].imag, product[best].real)
        return frequency, phase, magnitude, OK if magnitude > level else NOT_SIGNIFICANT
