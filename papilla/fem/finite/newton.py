"""Modified Newton's method for a finger in contact: one factorised tangent is kept, with a linear contact problem per
step.

With K and U = K^-1 M the tangent and its responses to unit pressures of the state where they were made (at rest: those
of linear elasticity), unknowns are x = U p + z. The drift z is what large strain adds to the linear answer; each step
solves the contact problem of `contact_step` with the skin moved by z, and corrects z by K^-1 (M p - f(x)), f being the
internal forces. Anderson's mixing (1965, doi:10.1145/321296.321305) of a few steps makes that converge by an order of
magnitude per step; if it does not, the tangent is recomputed, and the step is Newton's. All tests are relative.
"""

import warnings
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from papilla.core.errors import ContactRangeError, SolverError
from papilla.fem.discrete.assembly import SPACE_AXES
from papilla.fem.discrete.solver import Factor, factorise
from papilla.fem.finite.body import Body, Forces
from papilla.fem.finite.touching import SkinContact, Touching
from papilla.fem.pressing.contact_path import ContactProblem
from papilla.fem.pressing.contact_step import StepState, contact_step
from papilla.fem.reduction.finger_model import INCOMPRESSIBLE_RATIO, PRESSURE_STABILISATION

RESIDUAL_TOLERANCE = 1e-8
"""Bound of the relative residuals of equilibrium, volume and contact."""

MAX_STEPS = 40
"""Largest number of steps at one load."""

FREE_STEPS = 2
"""Number of first steps at a load in which nodes that come into contact have no shear, so that they show how far they
move before they stick."""

MIXED_STEPS = 5
"""Number of steps whose differences Anderson's mixing combines."""

RESIDUAL_AFTER_THREE_STEPS = 0.3
"""Share of the residual that may remain after three steps; if more remains, the tangent is computed again, which costs
some 25 steps."""

SMALLEST_JACOBIAN_RATIO = 0.1
"""Smallest det F after a step, as a share of the one before."""

MOST_STEP_HALVINGS = 6
"""Largest number of times that a step is halved because of det F."""


@dataclass(frozen=True, eq=False)
class State:
    """Displacement (nodes, 3) in mm, pressure (k,) in MPa, contact pressure (n,) in MPa (with friction followed by the
    tangential tractions, (3n,)), active nodes (n,) bool, and indentation in mm."""

    displacement: np.ndarray
    pressure: np.ndarray
    contact: np.ndarray
    active: np.ndarray
    indentation: float


class StepError(SolverError):
    """Newton's method found no equilibrium at a load; a smaller step may."""


@dataclass(frozen=True, eq=False)
class Balance:
    """Relative residuals of a state: equilibrium, volume, contact."""

    equilibrium: float
    volume: float
    contact: float

    @property
    def worst(self) -> float:
        """The largest of the three residuals."""
        return max(self.equilibrium, self.volume, self.contact)


@dataclass(frozen=True, eq=False)
class Linearisation:
    """A factorised tangent; `loads` (free, n) by unit nodal pressures, `response` (free, n) to them, and the
    `compliance` (n, n) of the skin."""

    factor: Factor
    scale: np.ndarray
    loads: sp.csr_matrix
    response: np.ndarray
    compliance: np.ndarray

    @classmethod
    def at(cls, body: Body, touching: Touching, iterate: State) -> "Linearisation":
        """The linearisation at a state; raises `StepError` if the state is unstable."""
        factor, loads = _factor(body, iterate), _free_loads(body, touching.at(iterate.displacement, iterate.contact))
        scale = body.scale[:, None]
        response = scale * factor.solve(scale * loads.toarray())
        compliance = loads.T @ response
        return cls(factor, body.scale, loads, response, (compliance + compliance.T) / 2)

    def of_pressure(self, n: int) -> "Linearisation":
        """The same without friction: of the pressures at n nodes alone."""
        return replace(self, loads=self.loads[:, :n], response=self.response[:, :n], compliance=self.compliance[:n, :n])

    def solve(self, force: np.ndarray) -> np.ndarray:
        """Change of the unknowns (free,) under a force (free,)."""
        return self.scale * self.factor.solve_once(self.scale * force)


@dataclass(eq=False)
class _Mixing:
    """Anderson's mixing of a fixed-point iteration; distances use the first `measured` unknowns."""

    measured: int
    last: tuple[np.ndarray, np.ndarray] | None = None
    steps: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)

    def next(self, point: np.ndarray, change: np.ndarray, same: bool = True) -> np.ndarray:
        """The point after `point`, whose successor without mixing is `point + change`; `same` : whether the map is that
        of the last step."""
        if self.last is not None and same:
            self.steps = [*self.steps[1 - MIXED_STEPS :], (point - self.last[0], change - self.last[1])]
        self.last = point, change
        if not self.steps:
            return point + change
        points, changes = (np.stack(vectors, axis=1) for vectors in zip(*self.steps, strict=True))
        # The combination of earlier steps that would leave the least change: for a linear map this is equivalent to
        # GMRES.
        weights = np.linalg.lstsq(changes[: self.measured], change[: self.measured])[0]
        return point + change - (points + changes) @ weights


def solve_level(
    body: Body,
    touching: Touching,
    iterate: State,
    linearisation: Linearisation,
    *,
    force: float | None = None,
    indentation: float | None = None,
    tolerance: float | None = None,
) -> tuple[State, int, Balance, Linearisation]:
    """Equilibrium at a force on the patch (N) or an indentation (mm), from a nearby state; with the number of steps,
    the residuals, and the linearisation for the next load. With friction, slip counts from the place where a node was
    at that state or, if it was not in contact there, where it comes into contact on the way.

    Raises `StepError` if it does not converge.
    """
    tolerance = RESIDUAL_TOLERANCE if tolerance is None else tolerance
    touch = touching.at(iterate.displacement, iterate.contact)
    entry = _Entry.at(touching, touch, iterate)
    inside = body.forces(iterate.displacement, iterate.pressure)
    split = body.free_displacements
    mixing, past = _Mixing(split), [np.inf]
    # Split the unknowns: what the linear finger does under these tractions, and the drift, which large strain adds.
    drift = _free(body, iterate) - linearisation.response @ iterate.contact
    for step in range(1, MAX_STEPS + 1):
        if step == FREE_STEPS + 1:
            entry = entry.ended(touching, touch, iterate.active)
        wanted = _in_contact(body, touching, touch, entry, iterate, linearisation, drift, force, indentation)
        iterate, inside, full_step = _right_side_out(body, iterate, wanted, inside)
        touch = touching.at(iterate.displacement, iterate.contact)
        outside = np.zeros_like(inside.force)
        outside[:split] = touch.forces(iterate.contact).ravel()[body.free[: SPACE_AXES * body.space.nodes]]
        balance = _balance(body, touching, touch, iterate, inside, outside)
        past.append(balance.worst)
        if not np.isfinite(balance.worst):
            break
        if balance.worst <= tolerance and not entry.open:
            return iterate, step, balance, linearisation
        # Three steps have not helped enough: a new tangent pays for itself.
        if len(past) > 4 and past[-1] > RESIDUAL_AFTER_THREE_STEPS * past[-4]:
            linearisation, past, full_step = Linearisation.at(body, touching, iterate), past[-1:], False
        # After a shortened step, or with a new tangent, earlier differences belong to another map.
        if not full_step:
            mixing = _Mixing(split)
            drift = _free(body, iterate) - linearisation.response @ iterate.contact
        drift = mixing.next(drift, linearisation.solve(outside - inside.force))
    raise StepError(
        f"no equilibrium in {step} Newton steps: relative residuals {balance.equilibrium:.1e} of forces, "
        f"{balance.volume:.1e} of volume, {balance.contact:.1e} of contact"
    )


@dataclass(frozen=True, eq=False)
class _Entry:
    """Where the n nodes of a patch come into contact during a load step, and so from where their slip counts.

    The larger the step, the more nodes come into contact within it, each at its own moment. First they have no shear
    (`open`), and move as they would if they were free. They come into contact in the order of their distances, and the
    contact's area grows as they move: a node whose distance is exceeded by a share of the entering area has made that
    share of its movement when it sticks. A step of 1.7 times the load is then as good as one of 1.3 that counts slip
    from its begin.

    origin : (2 n,) places along the plane, weighted by the mass, mm3. fixed : (2, n) tractions that are kept zero.
    stuck : (n,) nodes in contact at the begin. distance : (n,) from the specimen at the begin, mm.
    """

    origin: np.ndarray
    fixed: np.ndarray | None
    stuck: np.ndarray
    distance: np.ndarray
    open: bool

    @classmethod
    def at(cls, touching: Touching, touch: SkinContact, iterate: State) -> "_Entry":
        """The entry of a step that begins at a state."""
        mass, fixed, stuck = touching.patch.mass, touching.fixed, iterate.active
        distance = (touch.gap + (touching.compliance @ iterate.contact)[: len(mass)]) / mass
        fixed = None if fixed is None else fixed | ~stuck
        return cls(touch.place, fixed, stuck, distance, fixed is not None)

    def ended(self, touching: Touching, touch: SkinContact, active: np.ndarray) -> "_Entry":
        """The entry after which all nodes may stick, from a state in which the new ones have no shear."""
        if not self.open:
            return self
        mass, order = touching.patch.mass, np.argsort(self.distance)
        entering = np.where(self.stuck, 0.0, mass)
        nearer = np.empty_like(mass)
        nearer[order] = np.cumsum(entering[order]) - entering[order] / 2
        share = np.minimum(nearer / max(entering @ active, mass.min()), 1.0)
        moved = touch.place - self.origin
        origin = self.origin + np.tile(share, SPACE_AXES - 1) * moved * ~np.tile(self.stuck, SPACE_AXES - 1)
        return replace(self, origin=origin, fixed=touching.fixed, open=False)


def _in_contact(
    body: Body,
    touching: Touching,
    touch: SkinContact,
    entry: "_Entry",
    iterate: State,
    linearisation: Linearisation,
    drift: np.ndarray,
    force: float | None,
    indentation: float | None,
) -> State:
    """The state whose unknowns are the response to tractions plus the drift, with gap and slip linearised."""
    mass, n = touching.patch.mass, len(touching.patch.mass)
    # Gap and slip of the present state, moved to that of the drift alone; the contact problem adds the response to its
    # tractions.
    gap = touch.gap + linearisation.loads[:, :n].T @ (drift - _free(body, iterate))
    slid = entry.origin - linearisation.loads[:, n:].T @ drift - touch.shift[n:]
    moved = np.concatenate([np.zeros(n), slid]).reshape(-1, n)
    start = StepState(0.0, 0.0, iterate.contact.reshape(-1, n), iterate.active, 0.0, moved, np.zeros(n, dtype=bool))
    problem = ContactProblem(linearisation.compliance + touching.compliance, mass, gap, entry.fixed)
    solved = contact_step(problem, start, touching.friction, force=force, indentation=indentation)
    if not solved.active.any() and iterate.contact.any():
        raise StepError("the skin leaves the specimen")
    if not solved.active.any():
        raise ContactRangeError(
            f"an indentation of {indentation:g} mm makes no contact on this mesh: the mesh is too coarse"
        )
    contact = solved.traction.ravel()
    full = np.zeros(body.space.unknowns)
    full[body.free] = linearisation.response @ contact + drift
    size = SPACE_AXES * body.space.nodes
    return State(full[:size].reshape(-1, SPACE_AXES), full[size:], contact, solved.active, solved.indentation)


def _right_side_out(body: Body, iterate: State, wanted: State, before: Forces) -> tuple[State, Forces, bool]:
    """The wanted state, or the largest part of the step that leaves every cell a positive volume; its forces; and
    whether the step is complete."""
    # Every cell must keep a positive volume: halve the step until it does.
    length = 1.0
    present = {name: getattr(iterate, name) for name in ("displacement", "pressure", "contact", "indentation")}
    for _ in range(MOST_STEP_HALVINGS):
        mixed = {name: old + length * (getattr(wanted, name) - old) for name, old in present.items()}
        after = body.forces(mixed["displacement"], mixed["pressure"])
        if after.smallest_jacobian > SMALLEST_JACOBIAN_RATIO * before.smallest_jacobian:
            return State(**mixed, active=wanted.active), after, length == 1
        length /= 2
    raise StepError("a cell would turn inside out")


def _free(body: Body, iterate: State) -> np.ndarray:
    """The unknowns (free,) of a state: free displacements, then free pressures."""
    return np.concatenate([iterate.displacement.ravel(), iterate.pressure])[body.free]


def _free_loads(body: Body, touch: SkinContact) -> sp.csr_matrix:
    """Loads (free, n), with empty rows for the pressures."""
    loads = touch.loads[body.free[: SPACE_AXES * body.space.nodes]]
    return sp.vstack([loads, sp.csr_matrix((body.free_pressures, loads.shape[1]))]).tocsr()


def _factor(body: Body, iterate: State) -> Factor:
    """The factorised tangent in scaled unknowns. A wrong inertia means that the state is unstable, and raises
    `StepError`."""
    scale = sp.diags(body.scale)
    tangent = (scale @ body.tangent(iterate.displacement, iterate.pressure) @ scale).tocsc()
    stabilised = tangent
    for number, card in body.cards.items():
        mu = card.material.shear_modulus
        if mu * card.compressibility < INCOMPRESSIBLE_RATIO:
            stabilised = stabilised - scale @ (PRESSURE_STABILISATION / mu * body.pressure_mass(number)) @ scale
    with warnings.catch_warnings():
        # Another engine would also factor an unstable tangent, so SuperLU may only replace a missing engine
        warnings.filterwarnings("error", message=r"rslab did not factor the matrix \(inertia")
        try:
            return factorise(
                tangent, body.free_pressures, stabilised=None if stabilised is tangent else stabilised.tocsc()
            )
        except UserWarning as error:
            raise StepError(str(error.__context__)) from error


def _balance(
    body: Body, touching: Touching, touch: SkinContact, iterate: State, inside: Forces, outside: np.ndarray
) -> Balance:
    """Distance of a state from equilibrium, incompressibility and complementarity."""
    split, mass = body.free_displacements, touching.patch.mass
    gap = (touch.gap + (touching.compliance @ iterate.contact)[: len(mass)]) / mass - iterate.indentation
    violation = np.where(iterate.active, np.abs(gap), np.maximum(0, -gap)).max() / abs(iterate.indentation)
    return Balance(
        float(np.linalg.norm(inside.force[:split] - outside[:split]) / np.linalg.norm(outside)),
        float(np.linalg.norm(inside.force[split:]) / inside.volume_scale),
        float(violation),
    )
