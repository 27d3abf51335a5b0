"""One uniform cubic spline over any number of axes, with its slopes, fast at one point."""

from collections.abc import Sequence

import numpy as np

from papilla.calibration.surface import POWERS


class TensorSpline:
    """c functions that share their cells, over n axes.

    coefficients : (c, cells_1 + 3, ... cells_n + 3) of B-splines. starts, steps : first node and width of a cell of
    each axis.
    """

    def __init__(self, coefficients: np.ndarray, starts: Sequence[float], steps: Sequence[float]):
        axes = coefficients.ndim - 1
        windows = np.lib.stride_tricks.sliding_window_view(coefficients, (4,) * axes, axis=tuple(range(1, axes + 1)))
        for axis in range(axes):
            windows = np.moveaxis(np.tensordot(windows, POWERS, (1 + axes + axis, 0)), -1, 1 + axes + axis)
        # (cells ..., powers ..., c): a cell's polynomials lie together.
        self._cells = np.ascontiguousarray(np.moveaxis(windows, 0, -1))
        self._last = [count - 1 for count in self._cells.shape[:axes]]
        self._starts, self._rates = tuple(starts), tuple(1 / step for step in steps)

    def __call__(self, *point: float) -> np.ndarray:
        """(2, ... 2, c): value [0, ... 0] and slope [.. 1 ..] along each axis, at a point of the domain."""
        places: list[int] = []
        powers: list[float] = []
        for value, start, rate, last in zip(point, self._starts, self._rates, self._last, strict=True):
            t = (value - start) * rate
            cell = int(t)
            cell = 0 if cell < 0 else last if cell > last else cell
            t -= cell
            places.append(cell)
            powers += (1.0, t, t * t, t * t * t, 0.0, rate, 2 * rate * t, 3 * rate * t * t)
        found, lead = self._cells[tuple(places)], 1
        for two in np.array(powers).reshape(-1, 2, 4):
            found = np.matmul(two, found.reshape(lead, 4, -1))
            lead *= 2
        return found.reshape(*(2,) * len(places), -1)
