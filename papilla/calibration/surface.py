"""Smooth functions on uniform cells: cubic splines over any number of axes, and surfaces over force and modulus.

On uniform cells the cubic B-spline is the same polynomial everywhere: weights (1-t)^3/6, (3t^3-6t^2+4)/6,
(-3t^3+3t^2+3t+1)/6, t^3/6 of four neighbouring coefficients (de Boor 1978, doi:10.1007/978-1-4612-6333-3). So one
division finds the cell of a point, and the polynomial of every cell (4 x 4 x ... powers) is computed once.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from papilla.core.errors import InputError
from papilla.core.short_repr import short_repr

SPLINE_DEGREE = 3
"""Degree of the splines: an axis of n cells has n + SPLINE_DEGREE coefficients."""
SPLINE_ORDER = SPLINE_DEGREE + 1
"""Number of coefficients that act in a cell, and of the powers 1 ... t^3 of its polynomial."""

SPLINE_POWERS = (
    np.array([[1.0, -3.0, 3.0, -1.0], [4.0, 0.0, -6.0, 3.0], [1.0, 3.0, 3.0, -3.0], [0.0, 0.0, 0.0, 1.0]]) / 6
)
"""POWERS[k, a]: coefficient of t^a in the weight of the k-th coefficient of a cell."""

DOMAIN_ROUNDING = 4e-15
"""Relative distance beyond the end of the domain that counts as rounding; such a value is inverted at the end."""

INVERSION_NEWTON_STEPS = 60
"""Largest number of steps: Newton's method on a rising cubic needs 3 to 6, and bisection steps between them count,
too."""


class Spline:
    """c functions that share their cells, over n axes.

    coefficients : (c, cells_1 + 3, ... cells_n + 3) of B-splines. starts, steps : first node and width of a cell of
    each axis. Beyond an axis the polynomial of its last cell is used.
    """

    def __init__(self, coefficients: np.ndarray, starts: Sequence[float], steps: Sequence[float]):
        axes = coefficients.ndim - 1
        windows = np.lib.stride_tricks.sliding_window_view(
            coefficients, (SPLINE_ORDER,) * axes, axis=tuple(range(1, axes + 1))
        )
        for axis in range(axes):
            windows = np.moveaxis(np.tensordot(windows, SPLINE_POWERS, (1 + axes + axis, 0)), -1, 1 + axes + axis)
        # Each axis: four neighbouring coefficients of a cell times SPLINE_POWERS are the powers of the polynomial in
        # it. (cells ..., powers ..., c): a cell's polynomials lie together.
        self.polynomials = np.ascontiguousarray(np.moveaxis(windows, 0, -1))
        self._last = [count - 1 for count in self.polynomials.shape[:axes]]
        self._starts, self._rates = tuple(starts), tuple(1 / step for step in steps)

    def __call__(self, *points: ArrayLike, along: int | None = None) -> np.ndarray:
        """(..., c) values at coordinates that broadcast, one array per axis; or slopes along one of the axes."""
        cells, powers = [], []
        for axis, (value, start, rate, last) in enumerate(
            zip(points, self._starts, self._rates, self._last, strict=True)
        ):
            place = (np.asarray(value) - start) * rate
            cells.append(np.minimum(np.maximum(place.astype(int), 0), last))
            powers.append(power_vector(place - cells[-1], axis == along) * (rate if axis == along else 1.0))
        coefficients = self.polynomials[tuple(cells)]
        lead, size = coefficients.shape[: -1 - len(cells)], math.prod(self.polynomials.shape[len(cells) :])
        for power in powers:
            size //= SPLINE_ORDER
            coefficients = np.einsum("...a,...ab->...b", power, coefficients.reshape(*lead, SPLINE_ORDER, size))
        return coefficients

    def at(self, *point: float) -> np.ndarray:
        """(2, ... 2, c): value [0, ... 0] and slope [.. 1 ..] along each axis, at one point, in plain floats, because
        NumPy takes a microsecond for every operation on a single number."""
        places: list[int] = []
        powers: list[float] = []
        for value, start, rate, last in zip(point, self._starts, self._rates, self._last, strict=True):
            t = (value - start) * rate
            cell = int(t)
            cell = 0 if cell < 0 else last if cell > last else cell
            t -= cell
            places.append(cell)
            powers += (1.0, t, t * t, t * t * t, 0.0, rate, 2 * rate * t, 3 * rate * t * t)
        coefficients, lead = self.polynomials[tuple(places)], 1
        for two in np.array(powers).reshape(-1, 2, SPLINE_ORDER):
            coefficients = np.matmul(two, coefficients.reshape(lead, SPLINE_ORDER, -1))
            lead *= 2
        return coefficients.reshape(*(2,) * len(places), -1)


class Axes:
    """Base of functions of ln force and ln modulus: `force_N` and `modulus_MPa`, (low, high) each, and `cells`."""

    force_N: tuple[float, float]
    modulus_MPa: tuple[float, float]
    cells: Any

    @cached_property
    def force_axis(self) -> "Axis":
        """The uniform cells over ln force."""
        return Axis.between(*self.force_N, self.cells[0])

    @cached_property
    def modulus_axis(self) -> "Axis":
        """The uniform cells over ln modulus."""
        return Axis.between(*self.modulus_MPa, self.cells[1])

    def domain(self, force_N: ArrayLike, modulus_MPa: ArrayLike) -> tuple[np.ndarray, ...]:
        """Whether points that broadcast lie in the domain, and their ln force and ln modulus (those of a corner for
        points outside)."""
        force, modulus = np.broadcast_arrays(np.asarray(force_N, float), np.asarray(modulus_MPa, float))
        (low, high), (soft, hard) = self.force_N, self.modulus_MPa
        inside = (force >= low) & (force <= high) & (modulus >= soft) & (modulus <= hard)
        return inside, np.log(np.where(inside, force, low)), np.log(np.where(inside, modulus, soft))


@dataclass(frozen=True, eq=False)
class BicubicSurface(Axes):
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
        if self.coefficients.ndim != 2 or min(self.coefficients.shape) < SPLINE_ORDER:
            shape = " x ".join(map(str, self.coefficients.shape))
            raise InputError(f"a bicubic surface needs at least 4 x 4 coefficients, got {shape}")
        if not np.isfinite(self.coefficients).all():
            raise InputError("the coefficients of a surface must be finite")

    @property
    def cells(self) -> tuple[int, int]:
        """Number of cells over force and over modulus."""
        return self.coefficients.shape[0] - SPLINE_DEGREE, self.coefficients.shape[1] - SPLINE_DEGREE

    @cached_property
    def spline(self) -> Spline:
        """The surface over (ln force, ln modulus)."""
        return spline_of([self])

    @property
    def polynomials(self) -> np.ndarray:
        """(m, n, 4, 4) power coefficients of each cell: value = sum_ab P[i, j, a, b] t^a u^b, t and u from 0 to 1."""
        return self.spline.polynomials[..., 0]

    def __call__(self, force_N: ArrayLike, modulus_MPa: ArrayLike) -> np.ndarray:
        """Value at forces (N) and moduli (MPa) that broadcast; NaN outside the domain."""
        return self._evaluate(force_N, modulus_MPa, None)

    def slopes(self, force_N: ArrayLike, modulus_MPa: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """(d/d ln force, d/d ln modulus) at points that broadcast; NaN outside the domain."""
        return self._evaluate(force_N, modulus_MPa, 0), self._evaluate(force_N, modulus_MPa, 1)

    def _evaluate(self, force_N: ArrayLike, modulus_MPa: ArrayLike, along: int | None) -> np.ndarray:
        inside, *point = self.domain(force_N, modulus_MPa)
        return np.where(inside, self.spline(*point, along=along)[..., 0], np.nan)[()]

    def curve(self, ln_force: float) -> "ModulusCurve":
        """The surface along one force of the domain, over ln modulus."""
        return _curve(self, ln_force)


def spline_of(surfaces: Sequence[BicubicSurface]) -> Spline:
    """Surfaces that share their cells as one spline over (ln force, ln modulus)."""
    axes = surfaces[0].force_axis, surfaces[0].modulus_axis
    table = np.array([surface.coefficients for surface in surfaces])
    return Spline(table, [axis.start for axis in axes], [axis.step for axis in axes])


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
        """Cell number, position in the cell (0 to 1), and whether the value lies inside the axis, elementwise."""
        inside = (value >= self.low) & (value <= self.high)
        place = (np.log(np.where(inside, value, self.low)) - self.start) / self.step
        cell = np.clip(place.astype(int), 0, self.cells - 1)
        return cell, np.clip(place - cell, 0.0, 1.0), inside

    def cell(self, ln_value: float) -> int:
        """Number of the cell of a logarithm; the nearest cell for a value beyond the axis."""
        return min(max(int((ln_value - self.start) / self.step), 0), self.cells - 1)

    def basis(self, value: np.ndarray) -> np.ndarray:
        """(len(value), cells + 3) weights of the coefficients at each value; raises `InputError` outside the axis."""
        cell, place, inside = self.locate(value)
        if not inside.all():
            raise InputError(f"{value[~inside][0]:g} lies outside the surface's {self.low:g} to {self.high:g}")
        rows = np.arange(len(value))[:, None]
        weights = np.zeros((len(value), self.cells + SPLINE_DEGREE))
        weights[rows, cell[:, None] + np.arange(SPLINE_ORDER)] = power_vector(place) @ SPLINE_POWERS.T
        return weights


def power_vector(t: np.ndarray, derivative: bool = False) -> np.ndarray:
    """(..., 4): 1, t, t^2, t^3, or their derivatives."""
    power = np.empty((*np.shape(t), SPLINE_ORDER))
    power[..., 0], power[..., 1] = (0.0, 1.0) if derivative else (1.0, t)
    power[..., 2], power[..., 3] = (2 * t, 3 * t * t) if derivative else (t * t, t * t * t)
    return power


# ---- One point at a time, in plain floats: NumPy takes a microsecond for every operation on a single number


@lru_cache
def _curve(surface: BicubicSurface, ln_force: float) -> "ModulusCurve":
    axis, moduli = surface.force_axis, surface.modulus_axis
    cell = axis.cell(ln_force)
    cubics = power_vector(np.asarray((ln_force - axis.start) / axis.step - cell)) @ surface.polynomials[cell]
    values = (*cubics[:, 0].tolist(), float(cubics[-1].sum()))
    return ModulusCurve(tuple(map(tuple, cubics.tolist())), values, moduli.start, 1 / moduli.step)


@dataclass(frozen=True, eq=False)
class ModulusCurve:
    """A rising piecewise cubic of ln modulus: `cubics` per cell, `values` at the nodes."""

    cubics: tuple[tuple[float, ...], ...]
    values: tuple[float, ...]
    start: float
    per_step: float

    def solve(self, value: float, low: int, high: int) -> tuple[float, float]:
        """ln modulus of a value between those of nodes `low` and `high`, and the slope there."""
        j = bisect_right(self.values, value, low, high + 1) - 1
        j = low if j < low else high - 1 if j >= high else j
        cubic = self.cubics[j]
        u = solve_cubic(cubic, value)
        _, q, r, s = cubic
        return self.start + (j + u) / self.per_step, (q + u * (2 * r + 3 * u * s)) * self.per_step


def solve_cubic(cubic: Sequence[float], value: float) -> float:
    """u in [0, 1] where p + q u + r u^2 + s u^3 = value, for a cubic that rises there: safeguarded Newton to rounding.

    A value beyond an end (by rounding, as at the edge of a domain) gives that end.
    """
    p, q, r, s = cubic
    below, above, rise = 0.0, 1.0, q + r + s
    u = min(max((value - p) / rise, 0.0), 1.0) if rise > 0 else 0.5
    for _ in range(INVERSION_NEWTON_STEPS):
        error, slope = p - value + u * (q + u * (r + u * s)), q + u * (2 * r + 3 * u * s)
        # Newton's step, unless it leaves the bracket that is known: then bisection, so that it cannot diverge.
        below, above = (u, above) if error < 0 else (below, u)
        following = u - error / slope if slope > 0 else -1.0
        if not below <= following <= above:
            following = 0.5 * (below + above)
        if error == 0.0 or abs(following - u) <= 1e-16 + 2e-16 * u:
            break
        u = following
    return u


def inside(value: float, low: float, high: float) -> bool:
    """Whether a value lies between two node values, up to the rounding that forward and inverse may leave."""
    slack = DOMAIN_ROUNDING * max(abs(low), abs(high), 1.0)
    return low - slack <= value <= high + slack
