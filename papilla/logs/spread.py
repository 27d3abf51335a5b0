"""Median and noise of columns of any length, in bounded memory."""

from collections.abc import Sequence

import numpy as np

KEPT, KEPT_SHIFT = 2**19, 38
"""Up to `KEPT` numbers (4 MB a column) are stored exactly. Beyond that, numbers whose floats differ only in the last
`KEPT_SHIFT` bits form a group."""


class Magnitudes:
    """Numbers >= 0 in bounded memory: the first `KEPT` exactly, more of them in groups 1 part in 10,000 wide."""

    def __init__(self) -> None:
        self._grouped, self._counts = np.empty(0), np.empty(0)
        self._new: list[np.ndarray] = []

    def add(self, values: np.ndarray) -> None:
        """Add values (n,)."""
        self._new.append(values)
        if len(self._grouped) + sum(map(len, self._new)) > KEPT:
            values, counts = self._all()
            _, group = np.unique(values.view(np.uint64) >> np.uint64(KEPT_SHIFT), return_inverse=True)
            self._counts = np.bincount(group, counts).astype(float)
            self._grouped, self._new = np.bincount(group, counts * values) / self._counts, []

    def median(self) -> float:
        """The median; NaN if there are no values."""
        values, counts = self._all()
        if not values.size:
            return float("nan")
        order = np.argsort(values)
        reached = np.cumsum(counts[order])
        middle = np.searchsorted(reached, [(reached[-1] - 1) // 2, reached[-1] // 2], side="right")
        return float(values[order[middle]].mean())

    def above(self, limit: float) -> int:
        """Number of values above the limit."""
        values, counts = self._all()
        return int(counts[values > limit].sum())

    def mean_up_to(self, limit: float) -> float:
        """Mean of the values up to the limit."""
        values, counts = self._all()
        return float(np.average(values[values <= limit], weights=counts[values <= limit]))

    def _all(self) -> tuple[np.ndarray, np.ndarray]:
        """Values and the number of times that each counts."""
        new = np.concatenate([*self._new, np.empty(0)])
        return np.concatenate([self._grouped, new]), np.concatenate([self._counts, np.ones(len(new))])


def white_noise(samples: np.ndarray | Sequence[float]) -> float:
    """Standard deviation of the white noise in evenly spaced samples (n,); NaN for fewer than three finite ones.

    sigma = median |second difference| / (0.6745 sqrt(6)): 0.6745 is the median of |N(0, 1)|, and the second difference
    of white noise has 6 times its variance. A ramp does not change the median, and a few steps change it little.
    """
    noise = Noise()
    noise.add(np.asarray(samples, float)[:, None])
    return noise.sigma[0]


class Noise:
    """Standard deviation of the white noise of columns that arrive block by block."""

    def __init__(self) -> None:
        self._before: np.ndarray | None = None
        self._columns: list[Magnitudes] = []

    def add(self, rows: np.ndarray) -> None:
        """Add the next rows (n, columns)."""
        joined = rows if self._before is None else np.concatenate([self._before, rows])
        self._columns = self._columns or [Magnitudes() for _ in rows.T]
        with np.errstate(invalid="ignore", over="ignore"):
            second = np.abs(np.diff(joined, n=2, axis=0))
        for column, values in zip(self._columns, second.T, strict=True):
            column.add(values[np.isfinite(values)])
        self._before = joined[-2:]

    @property
    def sigma(self) -> list[float]:
        """Standard deviation of the white noise of each column; NaN if it cannot be estimated."""
        return [column.median() / (0.6744897501960817 * np.sqrt(6)) for column in self._columns]
