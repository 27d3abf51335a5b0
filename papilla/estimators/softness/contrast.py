"""What the channels of one sample say about each other, and what is left when some of them are left out."""

from typing import NamedTuple

import numpy as np


class Contrast(NamedTuple):
    """What channels say about each other: weighted (k,) = S^-1 times the innovation, precision (k, k) = S^-1, their
    numbers, and the squared misfit."""

    weighted: np.ndarray
    precision: np.ndarray
    rows: np.ndarray
    misfit: float

    def without(self, some: list[tuple[int, ...]]) -> list[float]:
        """Squared misfits of the others when each of some sets of channels is left out."""
        places = [np.searchsorted(self.rows, own) for own in some]
        return [self.misfit - share_of(self.weighted[None], self.precision[None], at).item() for at in places]

    def expected(self, *rows: int) -> tuple[np.ndarray, np.ndarray]:
        """By how much these channels differ from what the others expect, and the variances of that (whitened)."""
        at = np.searchsorted(self.rows, rows)
        covariance = np.linalg.inv(self.precision[np.ix_(at, at)])
        return covariance @ self.weighted[at], np.diag(covariance)


def share_of(weighted: np.ndarray, precision: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(n,) part of the squared misfits that goes when the channels `at` are left out: weighted (n, k), precision (n, k,
    k)."""
    own = weighted[:, at]
    return (own * np.linalg.solve(precision[:, at[:, None], at], own[..., None])[..., 0]).sum(axis=1)
