"""All frictionless presses of one specimen at once: the path that contact takes as the force grows.

Between two changes of the active set pressure and indentation are linear in each other, so the whole force curve is the
list of those changes (parametric pivoting, Cottle, Pang and Stone, The Linear Complementarity Problem, 4.5). Each
change borders or shrinks the inverse of the active compliance; where rounding has grown it is made anew.
"""

from dataclasses import dataclass

import numpy as np

from papilla.errors import ContactRangeError, SolverError

DRIFT = 1e-10
"""Residual of the active equations, over the largest gap, at which the inverse is made anew."""

CHECKED = 16
"""Changes of the active set between two looks at that residual."""

MOST_CHANGES = 20
"""Changes of the active set, in nodes of the patch, after which something is wrong."""


@dataclass(frozen=True, eq=False, repr=False)
class ContactPath:
    """Knots of a path, k of them on n patch nodes: linear between them, nothing beyond the last.

    indentation : (k,) mm. force : (k,) on the patch, N. pressure : (k, n) in MPa.
    """

    indentation: np.ndarray
    force: np.ndarray
    pressure: np.ndarray

    def __repr__(self) -> str:
        return f"ContactPath({len(self.force)} knots to {self.force[-1]:.4g} N)"

    def at(self, force: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """Indentation (...) and nodal pressure (..., n) at forces on the patch (N); `ContactRangeError` beyond it."""
        wanted = np.asarray(force, dtype=float)
        if wanted.size and (wanted.min() < 0 or wanted.max() > self.force[-1]):
            raise ContactRangeError(f"the path ends at {self.force[-1]:.4g} N on the patch, asked {wanted.max():.4g} N")
        right = np.clip(np.searchsorted(self.force, wanted), 1, len(self.force) - 1)
        span = self.force[right] - self.force[right - 1]
        share = (wanted - self.force[right - 1]) / np.where(span > 0, span, 1.0)
        between = [
            (1 - share[..., None]) * table[right - 1] + share[..., None] * table[right] for table in self._tables
        ]
        return between[0][..., 0], between[1]

    @property
    def _tables(self) -> tuple[np.ndarray, np.ndarray]:
        return self.indentation[:, None], self.pressure


def contact_path(compliance: np.ndarray, mass: np.ndarray, gap: np.ndarray, force: float) -> ContactPath:
    """The path from first touch to a `force` on the patch (N).

    compliance : (n, n) symmetric positive definite, mm3 / MPa. mass : (n,) mm2. gap : (n,) mm3. Raises `SolverError`
    where the changes do not end.
    """
    n = len(mass)
    first = int(np.argmin(gap / mass))
    depth, active = float(gap[first] / mass[first]), [first]
    inverse = np.array([[1 / compliance[first, first]]])
    knots, sides = [(depth, 0.0, np.zeros(n))], np.column_stack([mass, gap])
    for change in range(MOST_CHANGES * n):
        index = np.array(active)
        if change % CHECKED == 0:
            inverse = _refreshed(inverse, compliance[np.ix_(index, index)])
        parts = inverse @ sides[index]
        # Weak gaps of idle nodes and pressures of active ones, as value + slope * depth
        line = compliance[:, index] @ parts - sides
        line[index] = parts
        slope, value = line[:, 0], -line[:, 1]
        ends = np.full(n, np.inf)
        falling = slope < 0
        ends[falling] = np.maximum(-value[falling] / slope[falling], depth)
        which = int(np.argmin(ends))
        last = (force + mass[index] @ parts[:, 1]) / (mass[index] @ parts[:, 0])
        depth = min(float(ends[which]), float(last))
        pressure = np.zeros(n)
        pressure[index] = np.maximum(depth * parts[:, 0] - parts[:, 1], 0.0)
        reached = depth >= last
        knots.append((depth, force if reached else float(mass @ pressure), pressure))
        if reached:
            break
        if which in active:
            place = active.index(which)
            inverse = _shrunk(inverse, place)
            active.pop(place)
        else:
            inverse = _bordered(inverse, compliance[index, which], compliance[which, which])
            active.append(which)
        if not active:
            raise SolverError("the contact path lost its last node")
    else:
        raise SolverError(f"the contact path did not end after {MOST_CHANGES * n} changes of the active set")
    indentation, total, pressures = zip(*knots, strict=True)
    return ContactPath(np.array(indentation), np.maximum.accumulate(total), np.array(pressures))


def _bordered(inverse: np.ndarray, column: np.ndarray, corner: float) -> np.ndarray:
    """Inverse of a symmetric matrix with one more row and column."""
    through = inverse @ column
    pivot = corner - column @ through
    if pivot <= 0:
        raise SolverError("the compliance is not positive: an unstable finger, or a mesh too coarse for the specimen")
    n = len(column)
    grown = np.empty((n + 1, n + 1))
    grown[:n, :n] = inverse + np.outer(through, through / pivot)
    grown[:n, n] = grown[n, :n] = -through / pivot
    grown[n, n] = 1 / pivot
    return grown


def _shrunk(inverse: np.ndarray, place: int) -> np.ndarray:
    """Inverse of a symmetric matrix without row and column `place`."""
    kept = np.delete(np.arange(len(inverse)), place)
    column = inverse[kept, place]
    return inverse[np.ix_(kept, kept)] - np.outer(column, column / inverse[place, place])


def _refreshed(inverse: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """The inverse, made anew where it no longer is one."""
    drift = np.abs(matrix @ inverse.sum(axis=1) - 1).max()
    return np.linalg.inv(matrix) if drift > DRIFT else inverse
