"""Medians and noise of columns of any length, in bounded memory."""

from collections.abc import Sequence

import numpy as np

KEPT, KEPT_SHIFT = 2**20, 38
"""Numbers that a median is taken of as they are; beyond that those count as one that agree in their first 14 bits."""


class Magnitudes:
    """Numbers >= 0 in bounded memory: as they are up to `KEPT` of them, beyond that grouped to 1 part in 10,000."""

    def __init__(self) -> None:
        self._grouped, self._counts = np.empty(0), np.empty(0)
        self._new: list[np.ndarray] = []

    def add(self, values: np.ndarray) -> None:
        """Take in values (n,)."""
        self._new.append(values)
        if len(self._grouped) + sum(map(len, self._new)) > KEPT:
            values, counts = self._all()
            _, group = np.unique(values.view(np.uint64) >> np.uint64(KEPT_SHIFT), return_inverse=True)
            self._counts = np.bincount(group, counts).astype(float)
            self._grouped, self._new = np.bincount(group, counts * values) / self._counts, []

    def median(self) -> float:
        """The median; NaN where there are none."""
        values, counts = self._all()
        if not values.size:
            return float("nan")
        order = np.argsort(values)
        reached = np.cumsum(counts[order])
        middle = np.searchsorted(reached, [(reached[-1] - 1) // 2, reached[-1] // 2], side="right")
        return float(values[order[middle]].mean())

    def above(self, limit: float) -> int:
        """How many are above the limit."""
        values, counts = self._all()
        return int(counts[values > limit].sum())

    def mean_up_to(self, limit: float) -> float:
        """Mean of those that are not above the limit."""
        values, counts = self._all()
        return float(np.average(values[values <= limit], weights=counts[values <= limit]))

    def _all(self) -> tuple[np.ndarray, np.ndarray]:
        """Values, and how often each counts."""
        new = np.concatenate([*self._new, np.empty(0)])
        return np.concatenate([self._grouped, new]), np.concatenate([self._counts, np.ones(len(new))])


def white_noise(samples: np.ndarray | Sequence[float]) -> float:
    """Standard deviation of the white noise of evenly sampled samples (n,); NaN for fewer than three finite ones.

    From the median of the second differences, which a ramp does not move and a few steps hardly: 0.6745 is the median
    of |normal|, and the second difference of white noise has 6 times its variance.
    """
    noise = Noise()
    noise.add(np.asarray(samples, float)[:, None])
    return noise.sigma[0]


class Noise:
    """White noise of columns that come block by block."""

    def __init__(self) -> None:
        self._before: np.ndarray | None = None
        self._columns: list[Magnitudes] = []

    def add(self, rows: np.ndarray) -> None:
        """Take in the next rows (n, columns)."""
        joined = rows if self._before is None else np.concatenate([self._before, rows])
        self._columns = self._columns or [Magnitudes() for _ in rows.T]
        with np.errstate(invalid="ignore", over="ignore"):
            second = np.abs(np.diff(joined, n=2, axis=0))
        for column, values in zip(self._columns, second.T, strict=True):
            column.add(values[np.isfinite(values)])
        self._before = joined[-2:]

    @property
    def sigma(self) -> list[float]:
        """Standard deviation of each column's white noise; NaN where it cannot be told."""
        return [column.median() / (0.6744897501960817 * np.sqrt(6)) for column in self._columns]
