"""Newton's method for a finger in contact: each step solves a linear complementarity problem.

A step linearises the body at the current state, condenses it to the patch, A = M^T K^-1 M + C, and solves the contact
problem of rung `contact` for the new pressures and, under force control, the indentation (Josephy 1979: Newton's
method for generalised equations, locally quadratic, semismooth Newton once the active set is found). The specimen's
compliance C and the load directions M follow the skin's lateral positions and are renewed in every step, but not
differentiated: convergence becomes linear, at a measured rate below 1 % a step (60 gf: 4e-4, 2e-6, 9e-9). All tests are
relative.
"""

import warnings
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from papilla.errors import ContactRangeError, SolverError
from papilla.fem.discrete.solver import Factor, factorise
from papilla.fem.finite.body import Body, Evaluation
from papilla.fem.finite.touching import Touch, Touching
from papilla.fem.pressing.contact import solve_contact
from papilla.fem.reduction.finger_model import INCOMPRESSIBLE, STABILISATION

TOLERANCE = 1e-8
"""Of the relative residuals of equilibrium, volume and contact."""

MAX_STEPS = 20
"""Newton steps at one load before it counts as failed."""

SHRINK = 0.1
"""Smallest det F that a step may leave, as a share of the one before."""

HALVINGS = 6
"""Times that a step is halved for the sake of det F."""


@dataclass(frozen=True, eq=False)
class State:
    """Displacement (nodes, 3) in mm, pressure (k,) in MPa, contact pressure (n,) in MPa, active nodes (n,) bool, and
    indentation in mm."""

    displacement: np.ndarray
    pressure: np.ndarray
    contact: np.ndarray
    active: np.ndarray
    indentation: float


class StepError(SolverError):
    """Newton's method found no equilibrium at a load; a smaller step may."""


@dataclass(frozen=True, eq=False)
class Balance:
    """Relative residuals of a state."""

    equilibrium: float
    volume: float
    contact: float

    @property
    def worst(self) -> float:
        """The largest of the three."""
        return max(self.equilibrium, self.volume, self.contact)


def solve_level(
    body: Body, touching: Touching, state: State, *, force: float | None = None, indentation: float | None = None
) -> tuple[State, int, Balance]:
    """Equilibrium at a force on the patch (N) or an indentation (mm), from a nearby state; also steps and residuals.

    Raises `StepError` where it does not converge.
    """
    evaluation, touch = body.evaluate(state.displacement, state.pressure), touching.at(state.displacement)
    for step in range(1, MAX_STEPS + 1):
        state, evaluation = _step(body, touching.patch.mass, touch, state, evaluation, force, indentation)
        touch = touching.at(state.displacement)
        balance = _balance(body, touching.patch.mass, touch, state, evaluation)
        if not np.isfinite(balance.worst):
            break
        if balance.worst <= TOLERANCE:
            return state, step, balance
    raise StepError(
        f"no equilibrium in {step} Newton steps: relative residuals {balance.equilibrium:.1e} of forces, "
        f"{balance.volume:.1e} of volume, {balance.contact:.1e} of contact"
    )


def _step(body: Body, mass, touch: Touch, state: State, evaluation: Evaluation, force, indentation):
    """One Newton step; shortened where it would turn a cell inside out."""
    loads = _free_loads(body, touch)
    factor = _factor(body, evaluation)
    assert evaluation.force is not None
    scale = body.scale[:, None]
    solution = scale * factor.solve(scale * np.column_stack([evaluation.force, loads.toarray()]))
    drift, response = -solution[:, 0], solution[:, 1:]
    own = loads.T @ response
    compliance, gap = (own + own.T) / 2 + touch.compliance, touch.gap + loads.T @ drift
    found = solve_contact(compliance, mass, gap, force=force, indentation=indentation, start=state.active)
    if not found.active.any():
        raise ContactRangeError(
            f"an indentation of {indentation:g} mm makes no contact on this mesh: the mesh is too coarse"
        )
    change = drift + response @ found.pressure
    length = 1.0
    for _ in range(HALVINGS):
        moved = _moved(body, state, length * change)
        after = body.evaluate(*moved)
        if after.smallest_jacobian > SHRINK * evaluation.smallest_jacobian:
            break
        length /= 2
    else:
        raise StepError("a cell would turn inside out")
    contact = state.contact + length * (found.pressure - state.contact)
    depth = state.indentation + length * (found.indentation - state.indentation)
    return State(*moved, contact, found.active, depth), after


def _moved(body: Body, state: State, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    full = np.zeros(body.space.unknowns)
    full[body.free] = change
    size = 3 * body.space.nodes
    return state.displacement + full[:size].reshape(-1, 3), state.pressure + full[size:]


def _free_loads(body: Body, touch: Touch) -> sp.csr_matrix:
    """Loads (free, n), with empty rows for the pressures."""
    loads = touch.loads[body.free[: 3 * body.space.nodes]]
    return sp.vstack([loads, sp.csr_matrix((body.free_pressures, loads.shape[1]))]).tocsr()


def _factor(body: Body, evaluation: Evaluation) -> Factor:
    """The factorised tangent in scaled unknowns; one of the wrong inertia is unstable, and no place to step from."""
    assert evaluation.tangent is not None
    scale = sp.diags(body.scale)
    tangent = (scale @ evaluation.tangent @ scale).tocsc()
    stabilised, changed = tangent, False
    for number, card in body.cards.items():
        mu = card.material.shear_modulus
        if mu * card.compressibility < INCOMPRESSIBLE:
            stabilised, changed = stabilised - scale @ (STABILISATION / mu * body.pressure_mass(number)) @ scale, True
    with warnings.catch_warnings():
        # Another engine would factor an unstable tangent just as well: only a missing engine may be replaced
        warnings.filterwarnings("error", message=r"rslab did not factor the matrix \(inertia")
        try:
            return factorise(tangent, body.free_pressures, stabilised=stabilised.tocsc() if changed else None)
        except UserWarning as error:
            raise StepError(str(error.__context__)) from error


def _balance(body: Body, mass, touch: Touch, state: State, evaluation: Evaluation) -> Balance:
    """How far a state is from equilibrium, incompressibility and complementarity."""
    assert evaluation.force is not None
    split = body.free_displacements
    loads = (_free_loads(body, touch) @ state.contact)[:split]
    gap = (touch.gap + touch.compliance @ state.contact) / mass - state.indentation
    violation = np.where(state.active, np.abs(gap), np.maximum(0, -gap)).max() / abs(state.indentation)
    return Balance(
        float(np.linalg.norm(evaluation.force[:split] - loads) / np.linalg.norm(loads)),
        float(np.linalg.norm(evaluation.force[split:]) / evaluation.volume_scale),
        float(violation),
    )
