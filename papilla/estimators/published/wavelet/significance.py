"""Which wavelet power red noise does not explain (Torrence and Compo 1998, equations (16)-(18) and (31))."""

from functools import lru_cache

import numpy as np

from papilla import checks
from papilla.errors import InputError

ROUNDING = 1e-24
"""Share of the power in which two channels that are the same differ."""


def lag_one(samples) -> float:
    """Autocorrelation at lag one of samples (n,), the estimate for a first-order autoregressive background.

    Raises `InputError` for samples that are not finite or do not change.
    """
    values = np.asarray(samples, float)
    if values.ndim != 1 or values.size < 3 or not np.isfinite(values).all():
        raise InputError("an autocorrelation needs one column of 3 or more finite samples")
    values = values - values.mean()
    energy = float(values @ values)
    if energy <= 0:
        raise InputError("the samples never change: there is no autocorrelation")
    return float(values[1:] @ values[:-1]) / energy


def red_noise(frequency_Hz, sample_rate_Hz: float, alpha: float) -> np.ndarray:
    """Power of unit-variance first-order autoregressive noise at frequencies, relative to white noise (equation (16)).

    (1 - a^2) / (1 + a^2 - 2 a cos(2 pi f / rate)). Raises `InputError` unless -1 < alpha < 1.
    """
    alpha = checks.finite("alpha", alpha)
    if not -1 < alpha < 1:
        raise InputError(f"alpha must lie between -1 and 1, both excluded, got {alpha:g}")
    angle = 2 * np.pi * np.asarray(frequency_Hz, float) / checks.positive("sample_rate_Hz", sample_rate_Hz)
    return (1 - alpha**2) / (1 + alpha**2 - 2 * alpha * np.cos(angle))


def threshold(samples, sample_rate_Hz: float, frequency_Hz, level: float = 0.05) -> np.ndarray:
    """Wavelet power (m,) that red noise of the samples' variance and lag-one correlation exceeds with this chance.

    variance x red noise x chi-square with 2 degrees of freedom / 2 (equation (18)): -ln(level) times the mean.
    """
    level = checks.within("level", level, 1e-12, 0.5)
    values = np.asarray(samples, float)
    return values.var() * red_noise(frequency_Hz, sample_rate_Hz, lag_one(values)) * -np.log(level)


@lru_cache
def cross_quantile(level: float = 0.05) -> float:
    """Z that the product of two chi variables of 2 degrees of freedom exceeds with this chance: 3.999 at 0.05.

    The chance is Z K1(Z), K1 a modified Bessel function. Raises `InputError` for a level outside 1e-12 ... 0.5.
    """
    from scipy.optimize import brentq
    from scipy.special import k1

    level = checks.within("level", level, 1e-12, 0.5)
    return float(brentq(lambda value: value * k1(value) - level, 1e-6, 100.0))


def cross_threshold(first, second, sample_rate_Hz: float, frequency_Hz, level: float = 0.05) -> np.ndarray:
    """|cross-wavelet| (m,) that two independent red noises exceed with this chance (equation (31)).

    sd1 sd2 sqrt(P1 P2) Z / 2, Z from `cross_quantile`.
    """
    z = cross_quantile(level)
    ones, twos = np.asarray(first, float), np.asarray(second, float)
    expected = red_noise(frequency_Hz, sample_rate_Hz, lag_one(ones)) * red_noise(
        frequency_Hz, sample_rate_Hz, lag_one(twos)
    )
    return ones.std() * twos.std() * np.sqrt(expected) * z / 2


@lru_cache
def normal_quantile_squared(level: float = 0.05) -> float:
    """What the square of a standard normal variable exceeds with this chance: 3.841 at 0.05."""
    from scipy.special import ndtri

    return float(ndtri(0.5 * checks.within("level", level, 1e-12, 0.5)) ** 2)


def common_threshold(first, second, sample_rate_Hz: float, frequency_Hz, level: float = 0.05) -> np.ndarray:
    """Im(C)^2 / |C| (m,) of a cross-wavelet C that what reaches both channels at once exceeds with this chance.

    Hum, or a jolt of the whole finger, is the same in both but for a real gain: it adds to Re C alone (Nolte et al.
    2004, doi:10.1016/j.clinph.2004.04.029), and Im C is made of what differs. Of A = W1 / sd1 and B = +-W2 / sd2,
    Im(A B*) = Im((A - B) B*) is normal with variance |B|^2 V / 2, V the red noise of the channels' difference.

    Raises `InputError` for a channel that does not change.
    """
    ones, twos = np.asarray(first, float), np.asarray(second, float)
    if min(scales := (ones.std(), twos.std())) == 0:
        raise InputError("the samples of a channel never change: nothing is common to both")
    ones, twos = (ones - ones.mean()) / scales[0], (twos - twos.mean()) / scales[1]
    apart = ones - np.copysign(1.0, ones @ twos) * twos
    background = np.full(np.shape(frequency_Hz), ROUNDING)
    if apart.var() > ROUNDING:
        background = apart.var() * red_noise(frequency_Hz, sample_rate_Hz, lag_one(apart))
    return scales[0] * scales[1] * background * normal_quantile_squared(level) / 2
