"""The frequency of greatest cross power in the middle of a window, of one window or of many, with the same bits."""

import math

import numpy as np

from papilla.estimators.published.wavelet.answer import COMMON, NONE, NOT_SIGNIFICANT, OK, SILENT
from papilla.estimators.published.wavelet.significance import ROUNDING
from papilla.estimators.published.wavelet.transform import FOURIER, OMEGA0

AT_ONCE = 2**15
"""Samples of the windows that are transformed at once: they fit into the cache."""


class Strongest:
    """Wavelets at frequency_Hz (m,) over 2 reach + 1 samples, and how far above red noise their product must be.

    quantile : as `significance.cross_quantile` gives it, of one frequency; apart : as
    `normal_quantile_squared`, of what is common to both channels, see `significance.common_threshold`. A window among
    many is multiplied by itself, and all that is chosen comes from products and sums of its own: so it is treated as
    one alone.
    """

    def __init__(self, frequency_Hz: np.ndarray, rate_Hz: float, reach: int, quantile: float, apart: float):
        self._count = 2 * reach + 1
        scale = FOURIER / frequency_Hz
        eta = np.arange(-reach, reach + 1) / rate_Hz / scale[:, None]
        wavelet = np.pi**-0.25 * np.exp(-1j * OMEGA0 * eta - 0.5 * eta**2) / np.sqrt(scale * rate_Hz)[:, None]
        # A constant has no coefficient: the mean is taken out of the wavelets instead of the samples.
        wavelet -= wavelet.mean(axis=1, keepdims=True)
        self._rows = np.stack([wavelet.real, wavelet.imag], axis=1).reshape(-1, self._count)
        self._mean = np.full(self._count, 1 / self._count)
        self._frequency, self._cosine = frequency_Hz, np.cos(2 * np.pi * frequency_Hz / rate_Hz)
        self._apart = 0.5 * apart / self._count
        self._quarter = (0.5 * quantile / self._count) ** 2

    def of(self, window: np.ndarray) -> tuple[float, float, float, int]:
        """Frequency, phase, magnitude and status of a window (2, n) of two channels."""
        one, two = self._rows @ window[0], self._rows @ window[1]
        best = int((_powers(one) * _powers(two)).argmax())
        (a, b), (c, d) = one[2 * best : 2 * best + 2].tolist(), two[2 * best : 2 * best + 2].tolist()
        sums = self._sums(window)
        energy, lagged = (own.tolist() for own in sums)
        if not min(energy) > 0.0:
            return NONE, NONE, NONE, SILENT
        real, imaginary = a * c + b * d, b * c - a * d
        power = real * real + imaginary * imaginary
        status, cosine = NOT_SIGNIFICANT, self._cosine.item(best)
        if power > self._level(energy, lagged, cosine):
            travels = imaginary * imaginary > self._common(window, sums[0], cosine) * math.sqrt(power)
            status = OK if travels else COMMON
        return self._frequency.item(best), math.atan2(imaginary, real), math.sqrt(power), status

    def of_all(self, windows: np.ndarray) -> np.ndarray:
        """The same of m windows (2, m, n), as the columns of (4, m)."""
        found, step = np.empty((4, windows.shape[1])), max(AT_ONCE // self._count, 1)
        for begin in range(0, windows.shape[1], step):
            part = slice(begin, begin + step)
            found[:, part] = self._of_chunk(np.ascontiguousarray(windows[:, part]))
        return found

    def _of_chunk(self, windows: np.ndarray) -> np.ndarray:
        # A product with each window by itself, as `of` makes it: one with all of them would round otherwise.
        one, two = np.matmul(self._rows, windows[..., None])[..., 0]
        best = (_powers(one) * _powers(two)).argmax(axis=1)
        row = np.arange(len(best))
        a, b, c, d = (values[row, 2 * best + part] for values in (one, two) for part in (0, 1))
        energy, lagged = self._sums(windows)
        real, imaginary = a * c + b * d, b * c - a * d
        power = real * real + imaginary * imaginary
        silent = ~(energy.min(axis=0) > 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            clear = power > self._level(energy, lagged, self._cosine[best])
            common = self._common(windows, energy, self._cosine[best])
            travels = imaginary * imaginary > common * np.sqrt(power)
        phase = list(map(math.atan2, imaginary.tolist(), real.tolist()))
        found = np.array(
            [
                self._frequency[best],
                phase,
                np.sqrt(power),
                np.where(clear, np.where(travels, OK, COMMON), NOT_SIGNIFICANT),
            ]
        )
        found[:3, silent], found[3, silent] = NONE, SILENT
        return found

    def _sums(self, windows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sums of the squares and of the products of neighbours of windows (..., n), without their means."""
        centred = windows - np.vecdot(windows, self._mean)[..., None]
        return np.vecdot(centred, centred), np.vecdot(centred[..., 1:], centred[..., :-1])

    def _level(self, energy, lagged, cosine):
        """Square of `significance.cross_threshold` at one frequency, of the two channels' sums."""
        (first, second), (one, two) = energy, lagged
        return self._quarter * (first * _red(one / first, cosine)) * (second * _red(two / second, cosine))

    def _common(self, windows: np.ndarray, energy: np.ndarray, cosine):
        """`significance.common_threshold` at one frequency; energy (2, ...) : of windows (2, ..., n)."""
        one, two = windows / np.sqrt(energy)[..., None]
        one, two = (own - np.vecdot(own, self._mean)[..., None] for own in (one, two))
        apart = one - np.copysign(1.0, np.vecdot(one, two))[..., None] * two
        own, lagged = np.vecdot(apart, apart), np.vecdot(apart[..., 1:], apart[..., :-1])
        with np.errstate(divide="ignore", invalid="ignore"):
            background = np.where(own > ROUNDING, own * _red(lagged / own, cosine), ROUNDING)
        return self._apart * np.sqrt(energy[0] * energy[1]) * background


def _powers(parts: np.ndarray) -> np.ndarray:
    """Squared magnitudes (..., m) of real and imaginary parts in turn (..., 2 m)."""
    squares = parts * parts
    return squares[..., 0::2] + squares[..., 1::2]


def _red(alpha, cosine):
    """`significance.red_noise`, of the cosine of the angle, without its checks."""
    return (1 - alpha * alpha) / (1 + alpha * alpha - 2 * alpha * cosine)
