"""A smooth surface over (ln force, ln modulus): a bicubic spline on uniform cells, fast for one point or for many.

On uniform cells the cubic B-spline is the same polynomial everywhere: weights (1-t)^3/6, (3t^3-6t^2+4)/6,
(-3t^3+3t^2+3t+1)/6, t^3/6 of four neighbouring coefficients (de Boor 1978, doi:10.1007/978-1-4612-6333-3). So the
cell of a point is one division, and every cell is a plain polynomial of 4 x 4 powers, computed once.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from papilla.errors import InputError

POWERS = np.array([[1.0, -3.0, 3.0, -1.0], [4.0, 0.0, -6.0, 3.0], [1.0, 3.0, 3.0, -3.0], [0.0, 0.0, 0.0, 1.0]]) / 6
"""POWERS[k, a]: coefficient of t^a in the weight of the k-th coefficient of a cell."""

ROUNDING = 1e-9
"""How far, in cells, rounding of a logarithm may carry a point of the domain's edge outside it."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A bicubic surface over force and modulus; m force cells and n modulus cells, uniform in the logarithms.

    Parameters
    ----------
    force_N, modulus_MPa : (low, high) of the domain, 0 < low < high.
    coefficients : (m + 3, n + 3) B-spline coefficients.
    """

    force_N: tuple[float, float]
    modulus_MPa: tuple[float, float]
    coefficients: np.ndarray

    def __post_init__(self):
        for name, (low, high) in (("force_N", self.force_N), ("modulus_MPa", self.modulus_MPa)):
            if not 0 < low < high < math.inf:
                raise InputError(f"the surface's {name} must be a rising range above 0, got {low:g} to {high:g}")
        if self.coefficients.ndim != 2 or min(self.coefficients.shape) < 4:
            shape = " x ".join(map(str, self.coefficients.shape))
            raise InputError(f"a bicubic surface needs at least 4 x 4 coefficients, got {shape}")
        if not np.isfinite(self.coefficients).all():
            raise InputError("the coefficients of a surface must be finite")

    @property
    def cells(self) -> tuple[int, int]:
        """Number of cells over force and over modulus."""
        return self.coefficients.shape[0] - 3, self.coefficients.shape[1] - 3

    @cached_property
    def force_axis(self) -> "Axis":
        """The uniform cells over ln force."""
        return Axis.between(*self.force_N, self.cells[0])

    @cached_property
    def modulus_axis(self) -> "Axis":
        """The uniform cells over ln modulus."""
        return Axis.between(*self.modulus_MPa, self.cells[1])

    @cached_property
    def polynomials(self) -> np.ndarray:
        """(m, n, 4, 4) power coefficients of each cell: value = sum_ab P[i, j, a, b] t^a u^b, t and u from 0 to 1."""
        windows = np.lib.stride_tricks.sliding_window_view(self.coefficients, (4, 4))
        return np.einsum("ka,ijkl,lb->ijab", POWERS, windows, POWERS)

    @cached_property
    def node_lines(self) -> np.ndarray:
        """(m, n + 1, 4) powers of t of the value along each modulus node, per force cell."""
        last = self.polynomials[:, -1:].sum(axis=3)
        return np.concatenate([self.polynomials[..., 0], last], axis=1)

    def __call__(self, force_N, modulus_MPa):
        """Value at forces (N) and moduli (MPa) that broadcast; NaN outside the domain."""
        return self._evaluate(force_N, modulus_MPa, 0, 0)

    def slopes(self, force_N, modulus_MPa):
        """(d/d ln force, d/d ln modulus) at points that broadcast; NaN outside the domain."""
        return self._evaluate(force_N, modulus_MPa, 1, 0), self._evaluate(force_N, modulus_MPa, 0, 1)

    def _evaluate(self, force_N, modulus_MPa, along_force: int, along_modulus: int):
        i, t, inside_force = self.force_axis.locate(np.asarray(force_N, float))
        j, u, inside_modulus = self.modulus_axis.locate(np.asarray(modulus_MPa, float))
        left = _power_vector(t, along_force) / self.force_axis.step**along_force
        right = _power_vector(u, along_modulus) / self.modulus_axis.step**along_modulus
        value = np.einsum("...ab,...a,...b->...", self.polynomials[i, j], left, right)
        return np.where(inside_force & inside_modulus, value, np.nan)[()]


@dataclass(frozen=True)
class Axis:
    """Uniform cells over the logarithm of a positive quantity from `low` to `high`."""

    low: float
    high: float
    start: float
    step: float
    cells: int

    @classmethod
    def between(cls, low: float, high: float, cells: int) -> "Axis":
        """`cells` equal cells of the logarithm between two positive values."""
        return cls(low, high, math.log(low), (math.log(high) - math.log(low)) / cells, cells)

    @property
    def nodes(self) -> np.ndarray:
        """(cells + 1,) values of the quantity at the nodes."""
        return np.exp(self.start + self.step * np.arange(self.cells + 1))

    def locate(self, value: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Cell number, place in the cell (0 to 1) and whether the value lies in the axis, elementwise."""
        inside = (value >= self.low) & (value <= self.high)
        place = (np.log(np.where(inside, value, self.low)) - self.start) / self.step
        cell = np.clip(place.astype(int), 0, self.cells - 1)
        return cell, np.clip(place - cell, 0.0, 1.0), inside

    def basis(self, value: np.ndarray) -> np.ndarray:
        """(len(value), cells + 3) weights of the coefficients at each value; raises `InputError` outside the axis."""
        cell, place, inside = self.locate(value)
        if not inside.all():
            raise InputError(f"{value[~inside][0]:g} lies outside the surface's {self.low:g} to {self.high:g}")
        rows = np.arange(len(value))[:, None]
        weights = np.zeros((len(value), self.cells + 3))
        weights[rows, cell[:, None] + np.arange(4)] = _power_vector(place, 0) @ POWERS.T
        return weights


def _power_vector(t: np.ndarray, derivative: int) -> np.ndarray:
    """(..., 4): 1, t, t^2, t^3, or their derivatives."""
    one, zero = np.ones_like(t), np.zeros_like(t)
    if derivative == 0:
        return np.stack([one, t, t * t, t**3], axis=-1)
    return np.stack([zero, one, 2 * t, 3 * t * t], axis=-1)
