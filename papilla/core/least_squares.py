"""Least squares: one solver for the fits of the package. Its answer states how far it may be trusted."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import optimize

SMALLEST_JACOBIAN_COLUMN = 1e-10
"""Size of a column of the Jacobian, relative to the largest, below which the data do not determine its unknown."""


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """The best of the fits from all starts: f unknowns, m residuals.

    vector : (f,) unknowns. residuals : (m,) and jacobian : (m, f) at them. at_bound : (f,) bool, unknowns that ended at
    a bound. converged : False if the search was given up; message : why it ended.
    """

    vector: np.ndarray
    residuals: np.ndarray
    jacobian: np.ndarray
    at_bound: np.ndarray
    converged: bool
    message: str

    @property
    def cost(self) -> float:
        """Sum of the squared residuals."""
        return float(self.residuals @ self.residuals)

    @cached_property
    def determined(self) -> np.ndarray:
        """(f,) bool: unknowns that change the residuals at all."""
        length = np.linalg.norm(self.jacobian, axis=0)
        return length > SMALLEST_JACOBIAN_COLUMN * length.max()

    @cached_property
    def condition(self) -> float:
        """Condition number of the Jacobian of the determined unknowns, columns scaled to unit length; infinite if only
        combinations of them are determined."""
        columns = self.jacobian[:, self.determined]
        singular = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), compute_uv=False)
        return float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf

    @cached_property
    def covariance(self) -> np.ndarray:
        """(f, f) covariance, with the scatter of the residuals as noise: s^2 = sum r^2 / (m - f) (Bates and Watts 1988,
        section 2.1); NaN for unknowns that are not determined."""
        count, width = self.jacobian.shape
        covariance = np.full((width, width), np.nan)
        if np.isfinite(self.condition):
            columns = self.jacobian[:, self.determined]
            length = np.linalg.norm(columns, axis=0)
            inverse = np.linalg.pinv((columns / length).T @ (columns / length)) / np.outer(length, length)
            covariance[np.ix_(self.determined, self.determined)] = self.cost / (count - width) * inverse
        return covariance


def least_squares(
    residuals: Callable[[np.ndarray], Any], *starts: Sequence[float] | np.ndarray, both: bool = False, **options: Any
) -> LeastSquares:
    """The unknowns (f,) with the least sum of squared residuals (m,), the best of the descents from all starts.

    both : `residuals` returns the residuals and their Jacobian (m, f) together. options : as of
    `scipy.optimize.least_squares`. Raises `ValueError` for residuals that are not finite at a start.
    """
    last: dict[bytes, Any] = {}

    def at(vector: np.ndarray) -> Any:
        # Residuals and Jacobian are asked for in two calls; both come from one evaluation.
        if vector.tobytes() not in last:
            last.clear()
            last[vector.tobytes()] = residuals(vector)
        return last[vector.tobytes()]

    if both:
        options["jac"] = lambda vector: at(vector)[1]
    function = (lambda vector: at(vector)[0]) if both else residuals
    best = min((optimize.least_squares(function, start, **options) for start in starts), key=lambda fit: fit.cost)
    return LeastSquares(best.x, best.fun, best.jac, best.active_mask != 0, best.status > 0, best.message)
