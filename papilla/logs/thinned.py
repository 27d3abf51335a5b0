"""Rows of a long log as the lowest and highest value of each of some thousand bins, in bounded memory."""

import numpy as np

BINS = 1000
"""Number of bins of a thinned log (up to twice as many): more than a picture has pixels."""


class Thinned:
    """Lowest and highest value (bins, columns) of rows that arrive block by block; NaN only if a bin has no number.

    Bins are of equally many rows, the last few excepted. Whenever there are twice `BINS`, neighbours are joined.
    """

    def __init__(self) -> None:
        self._every = 1
        self._low: list[np.ndarray] = []
        self._high: list[np.ndarray] = []
        self._bins = 0

    def add(self, rows: np.ndarray) -> None:
        """Add the next rows (n, columns)."""
        if not len(rows):
            return
        starts = np.arange(0, len(rows), self._every)
        self._low.append(np.fmin.reduceat(rows, starts, axis=0))
        self._high.append(np.fmax.reduceat(rows, starts, axis=0))
        self._bins += len(starts)
        while self._bins >= 2 * BINS:
            pairs = np.arange(0, self._bins, 2)
            self._low = [np.fmin.reduceat(np.concatenate(self._low), pairs, axis=0)]
            self._high = [np.fmax.reduceat(np.concatenate(self._high), pairs, axis=0)]
            self._bins, self._every = len(pairs), 2 * self._every

    @property
    def low(self) -> np.ndarray:
        """(bins, columns) lowest values."""
        return np.concatenate(self._low)

    @property
    def high(self) -> np.ndarray:
        """(bins, columns) highest values."""
        return np.concatenate(self._high)
