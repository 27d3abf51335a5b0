"""Frictionless contact at one load, by exchanging nodes: for contacts that `contact_path` cannot follow.

Find nodal pressures p >= 0 and weak gaps w = A p + g - delta m >= 0 with p . w = 0, where A is the compliance, g the
weak gap, m the mass of the nodes and delta the indentation; under force control m . p = force. This linear
complementarity problem is solved by block principal pivoting: guess the nodes in contact, solve A p = delta m - g on
them, exchange every node whose pressure or gap is negative, and repeat. Blocks may cycle; after `PATIENCE` rounds
without progress single nodes are exchanged, which cannot cycle (Judice and Pires 1994,
doi:10.1016/0305-0548(94)90106-6). All decisions use signs only, so the units do not matter.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from papilla.errors import SolverError

PATIENCE = 4
"""Block exchanges without progress before single exchanges take over."""

MAX_PIVOTS = 2000


@dataclass(frozen=True, eq=False)
class ContactSolution:
    """Nodal pressure (n,) in MPa, indentation in mm, active nodes (n,) and the number of exchanges."""

    pressure: np.ndarray
    indentation: float
    active: np.ndarray
    iterations: int


def solve_contact(
    compliance: np.ndarray,
    mass: np.ndarray,
    gap: np.ndarray,
    *,
    force: float | None = None,
    indentation: float | None = None,
    start: np.ndarray | None = None,
) -> ContactSolution:
    """Solve for a given force on the patch (N) or indentation (mm); exactly one is given.

    Parameters
    ----------
    compliance : (n, n) symmetric positive definite, mm3 / MPa.
    mass : (n,) mm2; gap : (n,) mm3.
    start : (n,) bool, active nodes of a similar scene, with which the search starts.

    Raises `SolverError` where the exchanges do not settle.
    """
    active = np.asarray(gap / mass <= np.partition(gap / mass, min(8, len(gap) - 1))[min(8, len(gap) - 1)])
    if start is not None and start.any():
        active = start.copy()
    best, patience = len(mass) + 1, PATIENCE
    for iteration in range(1, MAX_PIVOTS + 1):
        pressure, depth = _solve_active(compliance, mass, gap, active, force, indentation)
        weak_gap = compliance[:, active] @ pressure[active] + gap - depth * mass
        wrong = np.where(active, pressure < 0, weak_gap < 0)
        count = int(wrong.sum())
        if count == 0:
            return ContactSolution(pressure, depth, active, iteration)
        if count < best:
            best, patience = count, PATIENCE
        else:
            patience -= 1
        if patience > 0:
            active = active ^ wrong
        else:
            active = active.copy()
            last = np.flatnonzero(wrong)[-1]
            active[last] = not active[last]
        if force is not None and not active.any():
            active[np.argmin(gap / mass)] = True
    raise SolverError(f"contact did not settle in {MAX_PIVOTS} exchanges ({best} nodes undecided at best)")


def _solve_active(compliance, mass, gap, active, force, indentation) -> tuple[np.ndarray, float]:
    """Pressure with zero weak gap on the active nodes, and the indentation."""
    pressure = np.zeros(len(mass))
    if not active.any():
        return pressure, float(indentation)
    index = np.flatnonzero(active)
    factor, failed = dpotrf(compliance[np.ix_(index, index)].T, lower=True, overwrite_a=True, clean=False)
    if failed:
        raise SolverError("the compliance is not positive: an unstable finger, or a mesh too coarse for the specimen")
    per_depth, offset = dpotrs(factor, np.stack([mass[index], gap[index]]).T, lower=True)[0].T
    depth = indentation if force is None else (force + mass[index] @ offset) / (mass[index] @ per_depth)
    pressure[index] = depth * per_depth - offset
    return pressure, float(depth)
