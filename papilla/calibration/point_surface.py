"""A `Surface` for one point at a time, in plain floats: what a control loop calls (about a microsecond a call).

NumPy costs a microsecond for every operation on one number, so the cells are copied into tuples here.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property

from papilla.calibration.surface import ROUNDING, Surface

NEWTON_STEPS = 60
"""Newton's method on a monotone cubic needs 3 to 6; bisection steps in between are counted too."""


@dataclass(frozen=True, eq=False)
class PointSurface:
    """Evaluates and inverts a surface at single points, in logarithms of force (N) and modulus (MPa)."""

    surface: Surface

    @cached_property
    def _tables(self) -> tuple:
        surface = self.surface
        force, modulus = surface.force_axis, surface.modulus_axis
        cells = tuple(tuple(_flat(cell) for cell in row) for row in surface.polynomials.tolist())
        lines = tuple(tuple(map(tuple, row)) for row in surface.node_lines.tolist())
        return cells, lines, force.start, 1 / force.step, force.cells, modulus.start, 1 / modulus.step, modulus.cells

    def evaluate(self, ln_force: float, ln_modulus: float) -> tuple[float, float, float]:
        """Value, d/d ln force and d/d ln modulus at a point of the domain (a point outside is not checked)."""
        cells, _, x0, per_x, m, y0, per_y, n = self._tables
        t, u = (ln_force - x0) * per_x, (ln_modulus - y0) * per_y
        i, j = min(max(int(t), 0), m - 1), min(max(int(u), 0), n - 1)
        t, u = t - i, u - j
        a0, a1, a2, a3, b0, b1, b2, b3, c0, c1, c2, c3, d0, d1, d2, d3 = cells[i][j]
        p = a0 + t * (b0 + t * (c0 + t * d0))
        q = a1 + t * (b1 + t * (c1 + t * d1))
        r = a2 + t * (b2 + t * (c2 + t * d2))
        s = a3 + t * (b3 + t * (c3 + t * d3))
        along_t = (b0 + u * (b1 + u * (b2 + u * b3))) + t * (
            2 * (c0 + u * (c1 + u * (c2 + u * c3))) + 3 * t * (d0 + u * (d1 + u * (d2 + u * d3)))
        )
        return p + u * (q + u * (r + u * s)), along_t * per_x, (q + u * (2 * r + 3 * u * s)) * per_y

    def force_cell(self, ln_force: float) -> int:
        """Number of the force cell of a point of the domain."""
        _, _, x0, per_x, m, *_ = self._tables
        return min(max(int((ln_force - x0) * per_x), 0), m - 1)

    def node_value(self, ln_force: float, node: int) -> float:
        """Value at a modulus node."""
        _, lines, x0, per_x, m, *_ = self._tables
        t = (ln_force - x0) * per_x
        i = min(max(int(t), 0), m - 1)
        t -= i
        p, q, r, s = lines[i][node]
        return p + t * (q + t * (r + t * s))

    def solve(self, ln_force: float, value: float, low: int, high: int) -> float:
        """ln modulus where the surface has `value`, between modulus nodes `low` and `high`, where it must rise.

        The value must lie between those of the two nodes; the answer is then exact to rounding.
        """
        cells, lines, x0, per_x, m, y0, per_y, _ = self._tables
        t = (ln_force - x0) * per_x
        i = min(max(int(t), 0), m - 1)
        t -= i
        row = lines[i]
        while high - low > 1:
            middle = (low + high) >> 1
            p, q, r, s = row[middle]
            if p + t * (q + t * (r + t * s)) <= value:
                low = middle
            else:
                high = middle
        a0, a1, a2, a3, b0, b1, b2, b3, c0, c1, c2, c3, d0, d1, d2, d3 = cells[i][low]
        cubic = (
            a0 + t * (b0 + t * (c0 + t * d0)),
            a1 + t * (b1 + t * (c1 + t * d1)),
            a2 + t * (b2 + t * (c2 + t * d2)),
            a3 + t * (b3 + t * (c3 + t * d3)),
        )
        return y0 + (low + solve_cubic(cubic, value)) / per_y

    def curve(self, ln_force: float) -> "Curve":
        """The surface along one force."""
        cells, _, x0, per_x, m, y0, per_y, n = self._tables
        t = (ln_force - x0) * per_x
        i = min(max(int(t), 0), m - 1)
        t -= i
        cubics = tuple(
            tuple(cell[k] + t * (cell[4 + k] + t * (cell[8 + k] + t * cell[12 + k])) for k in range(4))
            for cell in cells[i]
        )
        values = tuple(self.node_value(ln_force, node) for node in range(n + 1))
        return Curve(cubics, values, y0, per_y)


@dataclass(frozen=True, eq=False)
class Curve:
    """A rising piecewise cubic of ln modulus: `cubics` per cell, `values` at the nodes."""

    cubics: tuple[tuple[float, ...], ...]
    values: tuple[float, ...]
    start: float
    per_step: float

    def evaluate(self, ln_modulus: float) -> tuple[float, float]:
        """Value and slope."""
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


def _flat(cell: list[list[float]]) -> tuple[float, ...]:
    return tuple(value for row in cell for value in row)
