"""Cross-wavelet of two channels, its ridge f_MP, its strongest instant t_MP (2011 Oddo, equations (2) and (3))."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from papilla.errors import InputError
from papilla.estimators.published.wavelet.significance import common_threshold, cross_threshold
from papilla.estimators.published.wavelet.transform import morlet

BEFORE, AFTER = 6, 13
"""The window of the 2011 paper: from six samples before t_MP to 13 after it, 20 in all (67 ms at 300 Hz)."""


@dataclass(frozen=True)
class Window:
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

    def window(self, first: int, last: int) -> Window:
        """Statistics of f_MP over samples first ... last; raises `InputError` where the record does not hold them."""
        if not 0 <= first < last < len(self.frequency_Hz):
            count = len(self.frequency_Hz)
            raise InputError(f"the window from sample {first} to {last} is not inside the record of {count} samples")
        values = self.frequency_Hz[first : last + 1]
        return Window(
            float(values.mean()), float(values.std(ddof=1)), float(values.max()), float(values.min()), first, last
        )

    def around_strongest(self) -> Window:
        """Statistics of f_MP over the 20 samples around t_MP; raises `InputError` if they leave the record."""
        return self.window(self.strongest - BEFORE, self.strongest + AFTER)


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
        samples = np.arange(magnitude.shape[1])
        top = magnitude[best, samples]
        return Ridge(
            self.frequency_Hz[best],
            top,
            np.angle(self.product[best, samples]),
            top > self.level[best],
            self.travels[best, samples],
            self.inside[best, samples],
            int(top.argmax()),
        )


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
