"""The press of `bodies` by rising indentation: all forces of one scene in one path."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import CubicSpline
from scipy.sparse.linalg import splu

from papilla.errors import SolverError
from papilla.finger import Gauge
from papilla.studies.verify.axisymmetric.bodies import Bodies
from papilla.studies.verify.axisymmetric.contact import Contact
from papilla.studies.verify.axisymmetric.readout import Readout
from papilla.units import TINY

FIRST, GROWTH = 1.7e-3, 1.2
"""First indentation, over the skin's half axis, and the ratio of the next to it."""
LARGEST_FIRST = 2.0
"""Factor by which the first indentation may grow if it does not converge."""
TOLERANCE, MAX_STEPS = 1e-7, 25


@dataclass(frozen=True, eq=False)
class Path:
    """Presses at rising indentation, k of them: indentation (k,) mm, force (k,) N, contact radius (k,) mm, the shear's
    int q r dA (k,) in N mm, outwards on the skin, and strain and curvature change (1/mm) of g gauges (k, 2, g)."""

    indentation: np.ndarray
    force: np.ndarray
    radius: np.ndarray
    shear_moment: np.ndarray
    values: np.ndarray

    def at(self, force: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """Indentation (...) and strain and curvature change (..., 2, g) at forces (N) within the path.

        A cubic through the states over the root of the force.
        """
        columns = np.column_stack([self.indentation, self.values.reshape(len(self.force), -1)])
        scale = np.append(0, np.cbrt(self.force))
        found = CubicSpline(scale, np.concatenate([np.zeros((1, columns.shape[1])), columns]))(np.cbrt(force))
        return found[..., 0], found[..., 1:].reshape(*found.shape[:-1], *self.values.shape[1:])


def press_path(
    bodies: Bodies,
    gauges: Sequence[Gauge],
    force: float,
    friction: float = 0.0,
    *,
    first: float | None = None,
    growth: float = GROWTH,
) -> Path:
    """Press until a force (N) is passed, each indentation `growth` times the one before, from a `first` (mm) on.

    Raises `SolverError` where steps of an eighth do not converge.
    """
    contact, readout = Contact(bodies, friction), Readout(bodies, gauges)
    rows: list[tuple] = []
    state = before = np.zeros(bodies.unknowns)
    start = first or FIRST * bodies.shape.outer[0]
    past, now, aim = 0.0, 0.0, start
    smallest = (growth - 1) / 8
    while not rows or rows[-1][1] < force:
        slope = (state - before) / (now - past) if now else np.zeros_like(state)
        contact.expect(aim)
        try:
            found = _equilibrium(bodies, contact, state, slope * (aim - now), aim)
            # Sticking of the first contact depends on the points that touch next: slip grows as the radius squared
            while not now and contact.begin(found):
                found = _equilibrium(bodies, contact, found, np.zeros_like(state), aim)
        except SolverError:
            if not now and aim < LARGEST_FIRST * start:
                # A first contact of a few points may have no equilibrium: a slightly larger one has more points
                contact, aim = Contact(bodies, friction), aim * growth
                continue
            if not now or aim - now < smallest * now:
                raise
            aim = (aim + now) / 2
            continue
        before, past, state, now = state, now, found, aim
        contact.commit(state, now)
        pushed = contact.forces(state)[0][1 : 2 * bodies.nodes : 2]
        total = 2 * math.pi * abs(pushed[np.unique(contact.slave)].sum())
        radius = contact.reference[contact.touches, 0].max(initial=0.0)
        rows.append((now, total, radius, contact.shear_moment(state), readout(bodies.displacement(state))))
        aim = now * growth
    return Path(*(np.array(column) for column in zip(*rows, strict=True)))


def _equilibrium(bodies: Bodies, contact: Contact, state, ahead, depth: float) -> np.ndarray:
    """Equilibrium at an indentation (mm) from a state before it, `ahead` being the change that is expected."""
    free = bodies.free
    # Dimensionless norm: displacements in mm, pressures in moduli of the finger
    scale = np.where(np.arange(bodies.unknowns) < 2 * bodies.nodes, 1.0, bodies.rubbers[0].modulus)[free]
    state, change, turning = state + ahead, ahead[free], False
    for _ in range(MAX_STEPS):
        try:
            inside, tangent = bodies.forces(state)
        except FloatingPointError:
            change = change / 2
            state[free] -= change
            continue
        # Far from equilibrium the pressure is much too large, and terms that turn with it would make cells unstable
        push, stiffness = contact.forces(state, turning)
        residual, size = (inside + push)[free], max(float(np.linalg.norm(push)), TINY)
        moved = -depth - state[bodies.table]
        if contact.settled and not moved.any() and np.linalg.norm(residual) <= TOLERANCE * size:
            return state
        turning = bool(np.linalg.norm(residual) < 0.3 * size)
        whole = (tangent + stiffness).tocsc()
        residual = residual + whole[:, bodies.table][free] @ moved
        matrix = (sp.diags(scale) @ whole[:, free].tocsr()[free] @ sp.diags(scale)).tocsc()
        # Off-diagonal pivots only below a thousandth: otherwise some factors fill tenfold
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=1e-3, options={"SymmetricMode": True})
        change = scale * factors.solve(-scale * residual)
        state = state.copy()
        state[free] += change
        state[bodies.table] = -depth
    raise SolverError(f"the axisymmetric press did not converge in {MAX_STEPS} steps at {depth:.3g} mm")
