"""Amplitude in frequency bands, and the search for the best of them (textile paper, equation (1)).

The paper cuts 0-500 Hz into ten bands whose edges grow by random steps, and finds 18-118 Hz. **That is a corner of its
search grid, not a finding**: 18 Hz is the smallest sixth edge that the steps allow (1 + 1 + 1 + 5 + 5 + 5), 118 Hz the
largest seventh edge from there (+ 100). A band of the greatest width at the lowest start collects the most amplitude of
any spectrum that falls slowly with frequency, whatever was touched; `Band.corner` says so of each answer.
"""

from dataclasses import dataclass

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.published.texture.agreement import Concordance, concordance

STEPS_HZ = (range(1, 11), *2 * (range(1, 21),), *3 * (range(5, 51, 5),), *3 * (range(10, 101, 10),))
"""Widths in Hz that bands 1 to 9 may have; table 2 of the paper searches these nine, the tenth band is the
remainder."""
HIGHEST_HZ = 500.0


@dataclass(frozen=True)
class Band:
    """low_Hz, high_Hz; number : of the band in its cut of the axis, from 1; amplitude : mean over the signals.

    corner : the start is the lowest and the width the greatest that the grid has for this number, so a wider or lower
    band might have been better: the grid decided, not the signal. `sentence` states this.
    """

    low_Hz: float
    high_Hz: float
    number: int
    amplitude: float

    @property
    def corner(self) -> bool:
        """Whether the band is the lowest and widest that the grid has for its number."""
        first = sum(steps[0] for steps in STEPS_HZ[: self.number - 1])
        return self.low_Hz == first and self.high_Hz - self.low_Hz == STEPS_HZ[self.number - 1][-1]

    @property
    def sentence(self) -> str:
        """The band in words, and whether it is a corner of the grid."""
        text = f"{self.low_Hz:g}-{self.high_Hz:g} Hz (band {self.number})"
        if self.corner:
            return f"{text}: a corner of the search grid, its lowest start and greatest width"
        return text


@dataclass(frozen=True)
class BandMatch(Band):
    """A band, and the agreement of its amplitude with the scores, both over their greatest. The interval of `agreement`
    does not account for the search: the best of many bands agrees with anything (see `matching_band`)."""

    agreement: Concordance


def integral(lines: np.ndarray, edges) -> np.ndarray:
    """Integral (b, ...) of lines (n, ...), each a rectangle of width 1 around its number, between edges (b + 1,)."""
    # The first line, at 0 Hz, has half of its width.
    borders = np.append(0.0, np.arange(len(lines)) + 0.5)
    widths = np.diff(borders).reshape(-1, *[1] * (lines.ndim - 1))
    sums = np.concatenate([np.zeros((1, *lines.shape[1:])), np.cumsum(lines * widths, axis=0)])
    at_edges = np.apply_along_axis(lambda column: np.interp(edges, borders, column), 0, sums)
    return np.diff(at_edges, axis=0)


def band_amplitudes(samples, sample_rate_Hz: float, edges_Hz) -> np.ndarray:
    """Integral of the amplitude spectrum over bands (b,) between rising edges (b + 1,) in Hz, equation (1).

    samples (n,) or (n, channels), which gives (b, channels); in units of the samples times Hz. The mean is removed; the
    spectrum is one-sided, a sinusoid of amplitude 1 has a line of height 1 and width 1 / duration.
    Raises `InputError` for samples that are not finite and for edges that do not rise from 0 or more to at most half
    the sampling rate.
    """
    rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
    values, edges = np.asarray(samples, float), np.asarray(edges_Hz, float)
    if values.ndim not in (1, 2) or len(values) < 8 or not np.isfinite(values).all():
        raise InputError(f"band amplitudes need 8 or more finite samples, got {values.shape}")
    if edges.ndim != 1 or edges.size < 2 or not (np.diff(edges) > 0).all() or edges[0] < 0 or edges[-1] > rate / 2:
        raise InputError(f"edges_Hz must rise from 0 or more to at most {rate / 2:g} Hz, half the sampling rate")
    amplitude = 2 / len(values) * np.abs(np.fft.rfft(values - values.mean(axis=0), axis=0))
    width = rate / len(values)
    return width * integral(amplitude, edges / width)


def log_band_features(window, sample_rate_Hz: float, bands: int) -> np.ndarray:
    """(bands x channels,) logarithm of the amplitude in bands evenly spaced in log frequency, channel by channel.

    The bands go from two periods a window to 0.95 of half the sampling rate. A straight line is removed first.
    Raises `InputError` for samples that are not finite or a channel that does not change.
    """
    from scipy.signal import detrend

    rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
    rows = np.atleast_2d(np.asarray(window, float).T).T
    if not np.isfinite(rows).all():
        raise InputError("features need finite samples")
    if not np.ptp(rows, axis=0).all():
        raise InputError("a channel does not change in this window: its amplitude has no logarithm")
    edges = np.geomspace(2 * rate / len(rows), 0.475 * rate, bands + 1)
    return np.log(band_amplitudes(detrend(rows, axis=0), rate, edges)).T.ravel()


def printed_bands() -> list[tuple[int, int, int]]:
    """Every (number, low_Hz, high_Hz) that the grid of the paper can have: the exhaustive search."""
    starts, bands = {0}, []
    for number, steps in enumerate(STEPS_HZ, start=1):
        found = {(start, start + step) for start in starts for step in steps}
        bands += [(number, *pair) for pair in sorted(found)]
        starts = {high for _, high in found}
    return bands


def random_bands(draws: int, seed: int) -> list[tuple[int, int, int]]:
    """The bands (number, low_Hz, high_Hz) of `draws` random cuts of the axis: the random search of the paper."""
    if draws < 1:
        raise InputError(f"draws must be at least 1, got {draws}")
    generator = np.random.default_rng(seed)
    highs = np.cumsum([generator.choice(steps, draws) for steps in STEPS_HZ], axis=0)
    lows = np.vstack([np.zeros((1, draws), int), highs[:-1]])
    numbers = np.broadcast_to(1 + np.arange(len(STEPS_HZ))[:, None], highs.shape)
    return sorted(set(zip(*(own.ravel().tolist() for own in (numbers, lows, highs)), strict=True)))


def best_band(samples, sample_rate_Hz: float, bands: list[tuple[int, int, int]]) -> Band:
    """The band with the greatest amplitude, averaged over the signals of samples (n,) or (n, signals).

    Raises `InputError` if there is no band, or for a sampling rate below 1000 Hz, which cannot show 0-500 Hz.
    """
    amplitude = _amplitudes(samples, sample_rate_Hz, bands).mean(axis=1)
    best = int(amplitude.argmax())
    number, low, high = bands[best]
    return Band(float(low), float(high), number, float(amplitude[best]))


def matching_band(samples, sample_rate_Hz: float, scores, bands: list[tuple[int, int, int]]) -> BandMatch:
    """The band whose amplitude over fabrics has the greatest concordance with scores (fabrics,) > 0.

    samples (n, fabrics), one record a fabric; bands as `printed_bands` (exhaustive) or `random_bands` gives them.
    Amplitudes and scores are divided by their greatest; the textile paper normalises, but does not say how.

    What a match proves: with the four fabrics of the paper, spectra that differ at random by 20 % a band of 20 Hz and
    scores drawn without any relation to them, the best of the 11,770 bands of the exhaustive search still reached a
    concordance of 0.78 (median of 200 draws) and more than 0.9 in 23 % of them.
    Raises `InputError` for scores that do not fit, or are not positive, and as `best_band` does.
    """
    records, wanted = np.asarray(samples, float), np.asarray(scores, float)
    fitting = records.ndim == 2 and wanted.shape == (records.shape[1],)
    if not (fitting and np.isfinite(wanted).all() and (wanted > 0).all()):
        raise InputError(f"scores must be positive, one for each record of samples {records.shape}, got {wanted.shape}")
    found = _amplitudes(records, sample_rate_Hz, bands)
    amplitude = found / found.max(axis=1, keepdims=True)
    wanted = wanted / wanted.max()
    # Lin's 2 s12 / (s1^2 + s2^2 + (m1 - m2)^2), of which the denominator is 2 s12 plus the mean square of x - y.
    twice = 2 * (amplitude - amplitude.mean(axis=1, keepdims=True)) @ (wanted - wanted.mean())
    best = int(np.argmax(twice / (twice + np.square(amplitude - wanted).sum(axis=1))))
    number, low, high = bands[best]
    agreement = concordance(amplitude[best], wanted)
    return BandMatch(float(low), float(high), number, float(found[best].mean()), agreement)


def _amplitudes(samples, sample_rate_Hz: float, bands: list[tuple[int, int, int]]) -> np.ndarray:
    """(b, signals) amplitude of each signal in each of the bands."""
    if sample_rate_Hz < 2 * HIGHEST_HZ:
        raise InputError(f"the bands go up to {HIGHEST_HZ:g} Hz, which a rate of {sample_rate_Hz:g} Hz cannot show")
    if not bands:
        raise InputError("there is no band to search")
    each = band_amplitudes(np.atleast_2d(np.asarray(samples, float).T).T, sample_rate_Hz, np.arange(HIGHEST_HZ + 1))
    total = np.concatenate([np.zeros((1, each.shape[1])), np.cumsum(each, axis=0)])
    edges = np.array(bands)
    return total[edges[:, 2]] - total[edges[:, 1]]
