"""The highest line of a spectrum, of one window of samples or of many at once, with the same bits."""

import math

import numpy as np

AT_ONCE = 2**16
"""Samples of the windows that are transformed at once, with the zeros behind them: their spectra fit into the cache."""
BY_DOTS = 128
"""A single window of so many samples or fewer is transformed by dot products, a longer one by FFT."""


def peaks(taper: np.ndarray, levelled: bool, length: int) -> "Peaks":
    """The finder that is quicker for windows of this length."""
    return (DotPeaks if len(taper) <= BY_DOTS else Peaks)(taper, levelled, length)


class Peaks:
    """Powers of lines k / length of the sampling rate, k = 0 ... length / 2, of windows of `len(taper)` samples.

    levelled : mean and trend are removed from a window before the taper; length : of the transform, zeros behind.
    """

    def __init__(self, taper: np.ndarray, levelled: bool, length: int):
        count = len(taper)
        self.lines = length // 2 + 1
        self._taper, self._levelled, self._length = taper, levelled, length
        ramp = np.arange(count) - 0.5 * (count - 1)
        self._mean, self._ramp = np.full(count, 1 / count), ramp / math.sqrt(float(ramp @ ramp))

    def highest(self, window: np.ndarray, low: int, high: int) -> tuple[int, list[float]]:
        """The highest of lines low ... high - 1 (low >= 1) of a window (n,), and the powers of its neighbours and it.

        They are those of the line below, the highest and the one above; behind the last line it comes once more.
        """
        power = self._powers(window, low - 1, high + 1)
        best = int(power[1 : high - low + 1].argmax())
        around = power[best : best + 3].tolist()
        return low + best, around if len(around) == 3 else [*around, around[-1]]

    def highest_of_all(self, windows, rows, low, high) -> tuple[np.ndarray, np.ndarray]:
        """The same of m rows of windows (any, n), between lines (m,) each: lines (m,) and powers (m, 3).

        Around the first and the last of the lines that are looked at the powers are not known.
        """
        best, powers = np.empty(len(rows), int), np.empty((len(rows), 3))
        step = max(AT_ONCE // self._length, 1)
        for begin in range(0, len(rows), step):
            part = slice(begin, begin + step)
            best[part], powers[part] = self._highest_of_chunk(windows[rows[part]], low[part], high[part])
        return best, powers

    def _highest_of_chunk(self, windows, low, high) -> tuple[np.ndarray, np.ndarray]:
        first, power, inner = self._between(windows, low, high)
        best = inner.argmax(axis=1)
        around = np.minimum(best[:, None] + np.arange(3), power.shape[1] - 1)
        return first + best, np.take_along_axis(power, around, axis=1)

    def _between(self, windows, low, high) -> tuple[int, np.ndarray, np.ndarray]:
        """The first line of all rows, powers (m, ...) from the line before it on, and those of them that are looked at.

        These begin with the first line and are -1 where they are not a row's own.
        """
        first, last = int(low.min()), int(high.max())
        power = self._powers(windows, first - 1, last + 1)
        below, above, inner = int(low.max()) - first, int(high.min()) - first, power[:, 1 : last - first + 1]
        inner[:, :below][np.arange(below) < (low - first)[:, None]] = -1.0
        inner[:, above:][np.arange(above, last - first) >= (high - first)[:, None]] = -1.0
        return first, power, inner

    def _powers(self, windows: np.ndarray, low: int, high: int) -> np.ndarray:
        """Squared magnitudes of lines low ... high - 1, where there are any, of windows (..., n), each for itself."""
        spectrum = np.fft.rfft(self._tapered(windows), self._length)[..., low:high]
        return spectrum.real**2 + spectrum.imag**2

    def _tapered(self, windows: np.ndarray) -> np.ndarray:
        """Windows (..., n) under the taper, without mean and trend where they are levelled out."""
        if self._levelled:
            windows = windows - np.vecdot(windows, self._mean)[..., None]
            windows -= np.vecdot(windows, self._ramp)[..., None] * self._ramp
        return windows * self._taper


class DotPeaks(Peaks):
    """Powers are dot products with rows that level, taper and transform, alike for one window and for many.

    Which line is the highest in many windows is seen sooner from an FFT. It rounds otherwise: where that could decide,
    the window is looked at by itself.
    """

    def __init__(self, taper: np.ndarray, levelled: bool, length: int):
        super().__init__(taper, levelled, length)
        count = len(taper)
        # Taper, trend and transform are linear. The last line comes twice: any line has a next one.
        matrix = np.fft.rfft(self._tapered(np.eye(count)), length).T
        matrix = np.concatenate([matrix, matrix[-1:]])
        self._rows = np.ascontiguousarray(np.stack([matrix.real, matrix.imag], axis=1).reshape(-1, count))
        # Times the norm of a window: no amplitude is off by more than a fraction of it.
        self._rounding = 4 * count * np.finfo(float).eps * math.sqrt(float(taper @ taper))

    def highest(self, window, low, high):
        """The highest line and the powers around it, see `Peaks`."""
        squares = np.vecdot(self._rows[2 * low - 2 : 2 * high + 2], window) ** 2
        power = squares[0::2] + squares[1::2]
        best = int(power[1:-1].argmax())
        return low + best, power[best : best + 3].tolist()

    def _highest_of_chunk(self, windows, low, high):
        count, every = windows.shape[1], np.arange(len(windows))
        first, _, power = self._between(windows, low, high)
        found = power.argmax(axis=1)
        top = power[every, found]
        power[every, found] = -1.0
        best = first + found
        around = self._rows.reshape(-1, 2 * count)[best[:, None] + np.arange(-1, 2)].reshape(-1, 6, count)
        squares = np.vecdot(around, windows[:, None]) ** 2
        powers = squares[:, 0::2] + squares[:, 1::2]
        certain = top - power.max(axis=1) > 4 * self._rounding * np.sqrt(top * np.vecdot(windows, windows))
        for row in np.flatnonzero(~certain).tolist():
            best[row], powers[row] = self.highest(windows[row], int(low[row]), int(high[row]))
        return best, powers
