"""Wavelet power that red noise does not explain (Torrence and Compo 1998, equations (16) and (31))."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.errors import InputError

ROUNDING = 1e-24
"""Share of the power by which two equal channels may differ."""


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
    one, two = (RedNoise.of(own).power(frequency_Hz, sample_rate_Hz) for own in (first, second))
    return np.sqrt(one * two) * cross_quantile(level) / 2


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
    ones, twos = (own - own.mean() for own in (np.asarray(first, float), np.asarray(second, float)))
    energies = float(ones @ ones), float(twos @ twos)
    if not min(energies) > 0:
        raise InputError("the samples of a channel never change: nothing is common to both")
    ones, twos = ones / energies[0] ** 0.5, twos / energies[1] ** 0.5
    apart = ones - math.copysign(1.0, ones @ twos) * twos
    background = np.full(np.shape(frequency_Hz), ROUNDING / apart.size)
    if apart @ apart > ROUNDING:
        background = RedNoise.of(apart).power(frequency_Hz, sample_rate_Hz)
    return math.sqrt(energies[0] * energies[1]) * background * _normal_quantile_squared(level) / 2
