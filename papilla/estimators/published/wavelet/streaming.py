"""The ridge f_MP of the cross-wavelet of two channels while they come in, and its statistics over 67 ms (2011 Oddo)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.published.wavelet.answer import GAP, NONE, SILENT, WARMING_UP, RidgeEstimate
from papilla.estimators.published.wavelet.cross import AFTER, BEFORE
from papilla.estimators.published.wavelet.significance import cross_quantile, normal_quantile_squared
from papilla.estimators.published.wavelet.strongest import Strongest
from papilla.estimators.published.wavelet.transform import FOURIER, octaves

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
BLOCK = 16
"""Blocks of fewer instants are faster one sample at a time."""
_EACH = np.ones(KEPT)
_START = RidgeEstimate(NONE, NONE, NONE, NONE, NONE, WARMING_UP)


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
    ridge: tuple[float, ...] = (NONE,) * KEPT
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
        reach = math.ceil(REACH * FOURIER / float(self.frequency_Hz[0]) * rate)
        self.lag_s = reach / rate
        self._count, self._hop = 2 * reach + 1, max(round(HOP_S * rate), 1)
        independent = max(math.log2(high_Hz / low_Hz) / APART, 1.0)
        quantile = cross_quantile(1 - (1 - CHANCE) ** (1 / independent))
        self._strongest = Strongest(self.frequency_Hz, rate, reach, quantile, normal_quantile_squared(CHANCE))
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
        self._remember(np.array(state.samples, float), list(state.missing))
        self._seen, self._until, self._ridge, self._answer = state.seen, state.until, list(state.ridge), state.answer

    def _remember(self, samples: np.ndarray, missing: list[int]) -> None:
        """Keep the samples (2, n) within reach, oldest first, and which of them are missing."""
        # Each sample is written twice, one reach apart: any window is then one contiguous piece a channel.
        self._samples, self._missing = np.tile(samples, 2), missing
        self._place, self._gaps, self._last = 0, sum(missing), samples[:, -1].tolist()
        self._still = _still(samples)[:, -1].tolist()

    def _window(self) -> np.ndarray:
        return self._samples[:, self._place : self._place + self._count]

    def update(self, sample) -> RidgeEstimate:
        """The estimate after one more sample of two channels; a reading that is not finite holds the last one.

        Raises `InputError` for a sample of another length.
        """
        if len(sample) != 2:
            raise InputError(f"a sample must be (reading, reading) of two channels, got {len(sample)} values")
        place, count, gap = self._place, self._count, 0
        for channel, reading in enumerate(sample):
            value = float(reading)
            if not -math.inf < value < math.inf:
                gap, value = 1, self._last[channel]
            self._still[channel] = self._still[channel] + 1 if value == self._last[channel] else 0
            self._samples[channel, place] = self._samples[channel, place + count] = self._last[channel] = value
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

    def process(self, block) -> RidgeEstimate:
        """Estimates after each row of a block (n, 2); bit for bit what `update` gives row by row.

        Raises `InputError` for a block of another shape.
        """
        rows = np.asarray(block, float)
        if rows.ndim != 2 or rows.shape[1] != 2:
            raise InputError(f"a block must be n x 2 (two channels), got {' x '.join(map(str, rows.shape))}")
        answers = self._many(rows) if len(rows) >= BLOCK * self._hop else np.array([*map(self.update, rows.tolist())]).T
        frequency, mean, sd, phase, magnitude, status = answers if len(rows) else np.empty((6, 0))
        return RidgeEstimate(frequency, mean, sd, phase, magnitude, status.astype(int))

    def _instant(self) -> RidgeEstimate:
        """The ridge in the middle of the window."""
        if self._gaps > MOST_MISSING * self._count:
            frequency, phase, magnitude, status = NONE, NONE, NONE, GAP
        elif max(self._still) >= self._count - 1:
            frequency, phase, magnitude, status = NONE, NONE, NONE, SILENT
        else:
            frequency, phase, magnitude, status = self._strongest.of(self._window())
        self._ridge = [*self._ridge[1:], frequency]
        mean, sd = _statistics(np.array(self._ridge))
        return RidgeEstimate(frequency, float(mean), float(sd), phase, magnitude, status)

    def _many(self, rows: np.ndarray) -> np.ndarray:
        """Answers after each of the rows (n, 2), as the columns of (6, n)."""
        count, number = self._count, np.arange(len(rows))
        lost = ~np.isfinite(rows.T)
        known = np.maximum.accumulate(np.where(lost, -1, number), axis=1)
        held = np.where(known < 0, np.array(self._last)[:, None], np.take_along_axis(rows.T, known, axis=1))
        samples = np.concatenate([self._window(), held], axis=1)
        missing = [*self._missing[self._place :], *self._missing[: self._place], *lost.any(axis=0).astype(int).tolist()]
        gaps = np.cumsum(missing)
        first = max(count - 1 - self._seen, 0) + self._until
        hops = slice(first, None, self._hop)
        gaps, still = (gaps[count:] - gaps[:-count])[hops], _still(samples)[:, count:][:, hops].max(axis=0)
        found = self._instants(sliding_window_view(samples[:, 1:], count, axis=1)[:, hops], gaps, still)
        instants = np.column_stack([np.array(self._answer), found])
        self._remember(samples[:, -count:], missing[-count:])
        self._seen = min(self._seen + len(rows), count)
        self._until = (first - len(rows)) % self._hop if found.shape[1] else min(first - len(rows), self._until)
        last = RidgeEstimate._make(instants[:, -1].tolist())
        self._answer = last._replace(status=int(last.status))
        return instants[:, np.where(number < first, 0, (number - first) // self._hop + 1)]

    def _instants(self, windows: np.ndarray, gaps: np.ndarray, still: np.ndarray) -> np.ndarray:
        """The ridge in the middle of each of the windows (2, m, n), gaps and still (m,), as the columns of (6, m)."""
        lost, dead = gaps > MOST_MISSING * self._count, still >= self._count - 1
        found = np.full((4, len(gaps)), NONE)
        found[3] = np.where(lost, GAP, SILENT)
        looked = ~(lost | dead)
        found[:, looked] = self._strongest.of_all(windows if looked.all() else windows[:, looked])
        ridge = np.concatenate([self._ridge, found[0]])
        self._ridge = ridge[-KEPT:].tolist()
        mean, sd = _statistics(sliding_window_view(ridge, KEPT)[1:])
        return np.stack([found[0], mean, sd, found[1], found[2], found[3]])


def _statistics(ridge: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation (ddof 1) of ridges (..., `KEPT`)."""
    # From the last one on, so that equal frequencies are their own mean.
    last = ridge[..., -1]
    off = ridge - last[..., None]
    mean = np.vecdot(off, _EACH) / KEPT
    off -= mean[..., None]
    return last + mean, np.sqrt(np.vecdot(off, off) / (KEPT - 1))


def _still(samples: np.ndarray) -> np.ndarray:
    """(2, n) how many samples ago each of the samples (2, n) was different from it, or the first one was."""
    number = np.arange(samples.shape[1])
    changed = np.diff(samples, axis=1, prepend=np.nan) != 0
    return number - np.maximum.accumulate(np.where(changed, number, 0), axis=1)
