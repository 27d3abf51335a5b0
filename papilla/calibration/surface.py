"""A smooth surface over (ln force, ln modulus): a bicubic spline on uniform cells, fast for one point or for many.

On uniform cells the cubic B-spline is the same polynomial everywhere: weights (1-t)^3/6, (3t^3-6t^2+4)/6,
(-3t^3+3t^2+3t+1)/6, t^3/6 of four neighbouring coefficients (de Boor 1978, doi:10.1007/978-1-4612-6333-3). So the
cell of a point is one division, and every cell is a plain polynomial of 4 x 4 powers, computed once.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from papilla.errors import InputError
from papilla.short_repr import short_repr

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
    __repr__ = short_repr

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

    def __call__(self, force_N: ArrayLike, modulus_MPa: ArrayLike) -> np.ndarray:
        """Value at forces (N) and moduli (MPa) that broadcast; NaN outside the domain."""
        return self._evaluate(force_N, modulus_MPa, 0, 0)

    def slopes(self, force_N: ArrayLike, modulus_MPa: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """(d/d ln force, d/d ln modulus) at points that broadcast; NaN outside the domain."""
        return self._evaluate(force_N, modulus_MPa, 1, 0), self._evaluate(force_N, modulus_MPa, 0, 1)

    def _evaluate(self, force_N: ArrayLike, modulus_MPa: ArrayLike, along_force: int, along_modulus: int) -> np.ndarray:
        i, t, inside_force = self.force_axis.locate(np.asarray(force_N, float))
        j, u, inside_modulus = self.modulus_axis.locate(np.asarray(modulus_MPa, float))
        left = power_vector(t, along_force) / self.force_axis.step**along_force
        right = power_vector(u, along_modulus) / self.modulus_axis.step**along_modulus
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
        weights[rows, cell[:, None] + np.arange(4)] = power_vector(place) @ POWERS.T
        return weights


def power_vector(t: np.ndarray, derivative: int = 0) -> np.ndarray:
    """(..., 4): 1, t, t^2, t^3, or their derivatives."""
    one, zero = np.ones_like(t), np.zeros_like(t)
    if derivative == 0:
        return np.stack([one, t, t * t, t**3], axis=-1)
    return np.stack([zero, one, 2 * t, 3 * t * t], axis=-1)


# ---- One point at a time, in plain floats: NumPy costs a microsecond for every operation on one number

NEWTON_STEPS = 60
"""Newton's method on a monotone cubic needs 3 to 6; bisection steps in between are counted too."""


@dataclass(frozen=True, eq=False)
class PointSurface:
    """Evaluates a surface at single points, in logarithms of force (N) and modulus (MPa)."""

    surface: Surface

    @cached_property
    def _tables(self) -> tuple:
        surface = self.surface
        force, modulus = surface.force_axis, surface.modulus_axis
        cells = tuple(tuple(map(tuple, row)) for row in surface.polynomials.reshape(*surface.cells, 16).tolist())
        return cells, force.start, 1 / force.step, force.cells, modulus.start, 1 / modulus.step, modulus.cells

    def evaluate(self, ln_force: float, ln_modulus: float) -> tuple[float, float, float]:
        """Value, d/d ln force and d/d ln modulus at a point of the domain (a point outside is not checked)."""
        cells, _, per_x, _, y0, per_y, n = self._tables
        i, t = self._place(ln_force)
        u = (ln_modulus - y0) * per_y
        j = min(max(int(u), 0), n - 1)
        u -= j
        _, _, _, _, b0, b1, b2, b3, c0, c1, c2, c3, d0, d1, d2, d3 = cells[i][j]
        p, q, r, s = _cubic(cells[i][j], t)
        along_t = (b0 + u * (b1 + u * (b2 + u * b3))) + t * (
            2 * (c0 + u * (c1 + u * (c2 + u * c3))) + 3 * t * (d0 + u * (d1 + u * (d2 + u * d3)))
        )
        return p + u * (q + u * (r + u * s)), along_t * per_x, (q + u * (2 * r + 3 * u * s)) * per_y

    def force_cell(self, ln_force: float) -> int:
        """Number of the force cell of a point of the domain."""
        return self._place(ln_force)[0]

    def curve(self, ln_force: float) -> "Curve":
        """The surface along one force, over ln modulus."""
        return _curve(self, ln_force)

    def _place(self, ln_force: float) -> tuple[int, float]:
        """Number of the force cell, and the place in it (0 to 1)."""
        _, x0, per_x, m, *_ = self._tables
        t = (ln_force - x0) * per_x
        i = min(max(int(t), 0), m - 1)
        return i, t - i


@lru_cache(maxsize=16)
def _curve(point: PointSurface, ln_force: float) -> "Curve":
    cells, *_, y0, per_y, _ = point._tables
    i, t = point._place(ln_force)
    cubics = tuple(_cubic(cell, t) for cell in cells[i])
    return Curve(cubics, (*(cubic[0] for cubic in cubics), sum(cubics[-1])), y0, per_y)


def _cubic(cell: tuple[float, ...], t: float) -> tuple[float, float, float, float]:
    """The cubic over the modulus of a cell of 4 x 4 powers, at a place t over the force."""
    a0, a1, a2, a3, b0, b1, b2, b3, c0, c1, c2, c3, d0, d1, d2, d3 = cell
    return (
        a0 + t * (b0 + t * (c0 + t * d0)),
        a1 + t * (b1 + t * (c1 + t * d1)),
        a2 + t * (b2 + t * (c2 + t * d2)),
        a3 + t * (b3 + t * (c3 + t * d3)),
    )


@dataclass(frozen=True, eq=False)
class Curve:
    """A rising piecewise cubic of ln modulus: `cubics` per cell, `values` at the nodes."""

    cubics: tuple[tuple[float, ...], ...]
    values: tuple[float, ...]
    start: float
    per_step: float

    def evaluate(self, ln_modulus: float) -> tuple[float, float]:
        """Value and slope at ln modulus."""
        u = (ln_modulus - self.start) * self.per_step
        j = min(max(int(u), 0), len(self.cubics) - 1)
        u -= j
        p, q, r, s = self.cubics[j]
        return p + u * (q + u * (r + u * s)), (q + u * (2 * r + 3 * u * s)) * self.per_step

    def solve(self, value: float, low: int, high: int) -> tuple[float, float]:
        """ln modulus of a value between those of nodes `low` and `high`, and the slope there."""
        j = bisect_right(self.values, value, low, high + 1) - 1
        j = low if j < low else high - 1 if j >= high else j
        cubic = self.cubics[j]
        u = solve_cubic(cubic, value)
        _, q, r, s = cubic
        return self.start + (j + u) / self.per_step, (q + u * (2 * r + 3 * u * s)) * self.per_step


def solve_cubic(cubic: tuple[float, ...], value: float) -> float:
    """u in [0, 1] where p + q u + r u^2 + s u^3 = value, for a cubic that rises there: safeguarded Newton to rounding.

    A value beyond an end (by rounding, as at the edge of a domain) gives that end.
    """
    p, q, r, s = cubic
    p -= value
    below, above = 0.0, 1.0
    rise = q + r + s
    u = -p / rise if rise > 0 else 0.5
    u = 0.0 if u < 0.0 else 1.0 if u > 1.0 else u
    for _ in range(NEWTON_STEPS):
        error = p + u * (q + u * (r + u * s))
        if error == 0.0:
            break
        if error < 0:
            below = u
        else:
            above = u
        slope = q + u * (2 * r + 3 * u * s)
        following = u - error / slope if slope > 0 else -1.0
        if not below <= following <= above:
            following = 0.5 * (below + above)
        if abs(following - u) <= 1e-16 + 2e-16 * u:
            break
        u = following
    return u


def inside(value: float, low: float, high: float) -> bool:
    """Whether a value lies between two node values, up to the rounding that forward and inverse may leave."""
    slack = ROUNDING * ROUNDING + 4e-15 * max(abs(low), abs(high), 1.0)
    return low - slack <= value <= high + slack and not math.isnan(value)
