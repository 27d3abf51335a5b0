"""Morlet wavelets of whole records: one channel, pairs (2011 Oddo, equations (2) to (4)), and what noise explains.

The transform and the power of red noise are those of Torrence and Compo 1998, Bull. Am. Meteorol. Soc. 79:61, doi
10.1175/1520-0477(1998)079<0061:APGTWA>2.0.CO;2 (equations (16) and (31)), with a wavelet of unit energy.
"""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from papilla.core import checks
from papilla.core.errors import InputError

WAVELET_OMEGA = 6.0
"""Angular frequency of the wavelet in its own time; at 6 its mean over a Gaussian is below 1e-7."""
FREQUENCY_TIMES_SCALE = (WAVELET_OMEGA + np.sqrt(2 + WAVELET_OMEGA**2)) / (4 * np.pi)
"""Frequency times scale: a sinusoid of frequency f has its greatest power at the scale FOURIER / f."""
POWER_ROUNDING = 1e-24
"""Share of the power by which two equal channels may differ."""
SAMPLES_BEFORE, SAMPLES_AFTER = 6, 13
"""The window of the 2011 paper: from six samples before t_MP to 13 after it, 20 in all (67 ms at 300 Hz)."""


@dataclass(frozen=True, eq=False)
class Wavelet:
    """frequency_Hz (m,); coefficients (m, n) complex, |.|^2 = 1 on average for white noise of variance 1.

    sample_rate_Hz; edge_s (m,) : distance from the ends of the record within which they affect the coefficients
    (e-folding time, sqrt(2) scale).
    """

    frequency_Hz: np.ndarray
    coefficients: np.ndarray
    sample_rate_Hz: float
    edge_s: np.ndarray

    @property
    def power(self) -> np.ndarray:
        """(m, n) squared magnitude, in squared units of the samples."""
        return np.abs(self.coefficients) ** 2

    @property
    def inside(self) -> np.ndarray:
        """(m, n) whether a coefficient is far enough from both ends of the record: the cone of influence."""
        count = self.coefficients.shape[1]
        from_end = np.minimum(np.arange(count), count - 1 - np.arange(count)) / self.sample_rate_Hz
        return from_end >= self.edge_s[:, None]


def octaves(low_Hz: float, high_Hz: float, per_octave: int = 100) -> np.ndarray:
    """Frequencies (m,) from low to high, evenly spaced in their logarithm; 100 per octave as in the 2011 paper.

    Raises `InputError` for frequencies that do not rise or are not positive.
    """
    low, high = checks.positive("low_Hz", low_Hz), checks.positive("high_Hz", high_Hz)
    if low >= high:
        raise InputError(f"low_Hz must be below high_Hz, got {low:g} and {high:g}")
    if per_octave < 1:
        raise InputError(f"per_octave must be at least 1, got {per_octave}")
    count = int(np.floor(np.log2(high / low) * per_octave + 1e-9)) + 1
    return low * 2 ** (np.arange(count) / per_octave)


def morlet(samples, sample_rate_Hz: float, frequency_Hz) -> Wavelet:
    """Transform of samples (n,) at frequencies (m,) in Hz; the mean is removed and the record is padded with zeros.

    Raises `InputError` for samples that are not finite or fewer than 8, and for frequencies at or above half the
    sampling rate (aliases) or below one period per record.
    """
    rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
    values = np.asarray(samples, float)
    frequency = np.atleast_1d(np.asarray(frequency_Hz, float))
    if values.ndim != 1 or values.size < 8 or not np.isfinite(values).all():
        raise InputError(f"a wavelet transform needs one column of 8 or more finite samples, got {values.shape}")
    lowest = rate / values.size
    if not ((frequency >= lowest) & (frequency < 0.5 * rate)).all():
        raise InputError(
            f"frequency_Hz must lie between {lowest:.4g} (one period in the record) and below {0.5 * rate:.4g} (half "
            f"the sampling rate), got {frequency.min():.4g} to {frequency.max():.4g}"
        )
    scale = FREQUENCY_TIMES_SCALE / frequency
    # Zeros as long as the longest wavelet keep the end of the record from affecting its beginning.
    reach = int(np.ceil(6 * scale.max() * rate))
    length = 1 << int(np.ceil(np.log2(values.size + reach)))
    omega = 2 * np.pi * rate * np.arange(length // 2 + 1) / length
    spectrum = np.fft.rfft(values - values.mean(), length)
    daughters = np.sqrt(2 * np.pi * scale * rate)[:, None] * np.pi**-0.25
    daughters = daughters * np.exp(-0.5 * (scale[:, None] * omega - WAVELET_OMEGA) ** 2)
    # The wavelet is analytic: it has only positive frequencies, so the negative half of the transform stays zero.
    analytic = np.zeros((frequency.size, length), complex)
    analytic[:, : omega.size] = spectrum * daughters
    analytic[:, 0] = 0.0
    coefficients = np.fft.ifft(analytic, axis=1)[:, : values.size]
    return Wavelet(frequency, coefficients, rate, np.sqrt(2) * scale)


class RedNoise(NamedTuple):
    """First-order autoregressive noise: variance, and alpha, its correlation from sample to sample."""

    variance: float
    alpha: float

    @classmethod
    def of(cls, samples) -> "RedNoise":
        """The noise with the variance and correlation of samples (n,); raises `InputError` if they never change."""
        values = np.asarray(samples, float)
        values = values - values.mean()
        energy = float(values @ values)
        if not energy > 0:
            raise InputError("the samples never change: there is no autocorrelation")
        return cls(energy / values.size, float(values[1:] @ values[:-1]) / energy)

    def power(self, frequency_Hz, sample_rate_Hz: float) -> np.ndarray:
        """Mean wavelet power (m,) at frequencies: variance (1 - a^2) / (1 + a^2 - 2 a cos(2 pi f / rate)), (16)."""
        cosine = np.cos(2 * np.pi * np.asarray(frequency_Hz, float) / sample_rate_Hz)
        return self.variance * (1 - self.alpha**2) / (1 + self.alpha**2 - 2 * self.alpha * cosine)


@lru_cache
def cross_quantile(level: float = 0.05) -> float:
    """Z that the product of two chi variables with 2 degrees of freedom exceeds with this probability: 3.999 at 0.05.

    The chance is Z K1(Z), K1 a modified Bessel function. Raises `InputError` for a level outside 1e-12 ... 0.5.
    """
    from scipy.optimize import brentq
    from scipy.special import k1

    level = checks.within("level", level, 1e-12, 0.5)
    return float(brentq(lambda value: value * k1(value) - level, 1e-6, 100.0))


def cross_threshold(first, second, sample_rate_Hz: float, frequency_Hz, level: float = 0.05) -> np.ndarray:
    """|cross-wavelet| (m,) that two independent red noises exceed with this chance: sqrt(P1 P2) Z / 2 (equation (31)).

    P1, P2 are their powers, Z is of `cross_quantile`.
    """
    power_1, power_2 = (RedNoise.of(channel).power(frequency_Hz, sample_rate_Hz) for channel in (first, second))
    return np.sqrt(power_1 * power_2) * cross_quantile(level) / 2


@lru_cache
def _normal_quantile_squared(level: float) -> float:
    """Value that the square of a standard normal variable exceeds with this probability: 3.841 at 0.05."""
    from scipy.special import ndtri

    return float(ndtri(0.5 * checks.within("level", level, 1e-12, 0.5)) ** 2)


def common_threshold(first, second, sample_rate_Hz: float, frequency_Hz, level: float = 0.05) -> np.ndarray:
    """Im(C)^2 / |C| (m,) of a cross-wavelet C that a cause common to both channels exceeds with this probability.

    Hum, or a jolt of the whole finger, is the same in both channels except for a real gain, so it adds to Re C alone
    (Nolte et al. 2004, doi:10.1016/j.clinph.2004.04.029), and Im C comes from the difference of the channels. With A =
    W1 / sd1 and B = +-W2 / sd2, Im(A B*) = Im((A - B) B*) is normal with variance |B|^2 V / 2, where V is the red noise
    of the channels' difference. Raises `InputError` for a channel that does not change.
    """
    ones, twos = (channel - channel.mean() for channel in (np.asarray(first, float), np.asarray(second, float)))
    energies = float(ones @ ones), float(twos @ twos)
    if not min(energies) > 0:
        raise InputError("the samples of a channel never change: nothing is common to both")
    ones, twos = ones / energies[0] ** 0.5, twos / energies[1] ** 0.5
    apart = ones - math.copysign(1.0, ones @ twos) * twos
    background = np.full(np.shape(frequency_Hz), POWER_ROUNDING / apart.size)
    if apart @ apart > POWER_ROUNDING:
        background = RedNoise.of(apart).power(frequency_Hz, sample_rate_Hz)
    return math.sqrt(energies[0] * energies[1]) * background * _normal_quantile_squared(level) / 2


@dataclass(frozen=True)
class RidgeWindow:
    """Statistics of f_MP over one window: mean, standard deviation (ddof 1), greatest and least, in Hz.

    first, last : samples of the window, both included.
    """

    mean_Hz: float
    sd_Hz: float
    greatest_Hz: float
    least_Hz: float
    first: int
    last: int


@dataclass(frozen=True, eq=False)
class Ridge:
    """f_MP (n,) in Hz: frequency of greatest cross power at each sample; magnitude (n,) there.

    phase (n,) : of the first channel before the second there, in -pi ... pi. significant (n,) : the magnitude exceeds
    the level of red noise; travels (n,) : and a cause common to both channels does not explain it; inside (n,) : far
    enough from the ends of the record. strongest : sample of t_MP.
    """

    frequency_Hz: np.ndarray
    magnitude: np.ndarray
    phase: np.ndarray
    significant: np.ndarray
    travels: np.ndarray
    inside: np.ndarray
    strongest: int

    def window(self, first: int, last: int) -> RidgeWindow:
        """Statistics of f_MP over samples first ... last; raises `InputError` where the record does not hold them."""
        if not 0 <= first < last < len(self.frequency_Hz):
            count = len(self.frequency_Hz)
            raise InputError(f"the window from sample {first} to {last} is not inside the record of {count} samples")
        values = self.frequency_Hz[first : last + 1]
        mean, sd = float(values.mean()), float(values.std(ddof=1))
        return RidgeWindow(mean, sd, float(values.max()), float(values.min()), first, last)

    def around_strongest(self) -> RidgeWindow:
        """Statistics of f_MP over the 20 samples around t_MP; raises `InputError` if they leave the record."""
        return self.window(self.strongest - SAMPLES_BEFORE, self.strongest + SAMPLES_AFTER)


@dataclass(frozen=True, eq=False)
class CrossWavelet:
    """Product (m, n) of the first channel's transform and the conjugate of the second's, at frequency_Hz (m,).

    level (m,) : magnitude that independent red noises of the two channels exceed with a probability of 5 %;
    common_level (m,) : squared imaginary part over magnitude that a cause common to both channels exceeds with 5 %;
    inside (m, n) : see `Ridge`.
    """

    frequency_Hz: np.ndarray
    product: np.ndarray
    level: np.ndarray
    common_level: np.ndarray
    inside: np.ndarray

    @property
    def significant(self) -> np.ndarray:
        """(m, n) whether the magnitude exceeds the level; the edge of this region is the contour in the paper's
        figures."""
        return np.abs(self.product) > self.level[:, None]

    @property
    def travels(self) -> np.ndarray:
        """(m, n) significant, with a phase that no common cause (hum, a jolt) has.

        A texture whose phase is near 0 or pi (a whole number of half periods between the channels) cannot be
        distinguished from a common cause.
        """
        return self.significant & (self.product.imag**2 > self.common_level[:, None] * np.abs(self.product))

    @cached_property
    def ridge(self) -> Ridge:
        """f_MP (2) and t_MP (3), as printed: the maximum over all frequencies given, ends of the record included."""
        magnitude = np.abs(self.product)
        best = magnitude.argmax(axis=0)
        at = best, np.arange(magnitude.shape[1])
        frequency, top, phase = self.frequency_Hz[best], magnitude[at], np.angle(self.product[at])
        travels, inside = self.travels[at], self.inside[at]
        return Ridge(frequency, top, phase, top > self.level[best], travels, inside, int(top.argmax()))


def cross_wavelet(first, second, sample_rate_Hz: float, frequency_Hz) -> CrossWavelet:
    """Cross-wavelet of two channels (n,) of one record at frequencies (m,) in Hz.

    Its angle is the phase by which the first channel is ahead. Raises `InputError` for channels of unequal length and
    as `morlet` does.
    """
    ones, twos = np.asarray(first, float), np.asarray(second, float)
    if ones.shape != twos.shape:
        raise InputError(f"two channels of one record must be equally long, got {ones.shape} and {twos.shape}")
    a, b = morlet(ones, sample_rate_Hz, frequency_Hz), morlet(twos, sample_rate_Hz, frequency_Hz)
    level = cross_threshold(ones, twos, sample_rate_Hz, a.frequency_Hz)
    common = common_threshold(ones, twos, sample_rate_Hz, a.frequency_Hz)
    return CrossWavelet(a.frequency_Hz, a.coefficients * np.conj(b.coefficients), level, common, a.inside)


def periods_of_phase(phase, distance_mm: float, period_range_mm: tuple[float, float]) -> np.ndarray:
    """All spatial periods in mm, longest first, that agree with a phase (rad) between elements at a distance.

    Phase = 2 pi distance / period (4), known only up to whole turns: period = distance / (phase / 2 pi + n). It is one
    answer only for periods over twice the distance (or over the distance, when the direction of sliding is known and
    the phase is given between 0 and 2 pi); below that every period of the range that fits is listed. Raises
    `InputError` for a range that does not rise or a distance that is not positive.
    """
    distance = checks.positive("distance_mm", distance_mm)
    low, high = checks.rising("period_range_mm", period_range_mm)
    turns = checks.finite("phase", phase) / (2 * np.pi)
    first, last = np.ceil(distance / high - turns - 1e-12), np.floor(distance / low - turns + 1e-12)
    all_turns = turns + np.arange(first, last + 1)
    return distance / all_turns[all_turns > 0]


def lag_of_phase(phase, period_mm: float) -> float:
    """Distance in mm along the movement that corresponds to a phase in radians on a surface of this period (4)."""
    return checks.finite("phase", phase) / (2 * np.pi) * checks.positive("period_mm", period_mm)
