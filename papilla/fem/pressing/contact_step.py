"""One step of contact between condensed bodies, without friction or with Coulomb's: contact, stick and slip together.

Unknowns are the tractions [p, q_1, q_2] of the nodes (MPa; without friction p alone) and, under force control, the
indentation delta. With the compliance A (normal and tangential, coupled), the mass m of the nodes and the weak gap g,

    w = A_n lambda + g - delta m >= 0,  p >= 0,  p w = 0                     contact,
    s = A_t (lambda - lambda_0)                                              slip of the finger since the last state,
    |q| <= mu p,  s = 0 where |q| < mu p, else q = -mu p s/|s|               Coulomb,

The law is q = P(q - rho s), P the projection on the disc of radius mu p, and is solved by Newton's method on the sets
of nodes out of contact, sticking and slipping (Alart and Curnier 1991, doi:10.1016/0045-7825(91)90022-X): its end is
exact contact, stick and slip, no regularisation. Without friction this is block principal pivoting: guess the nodes in
contact, solve the equations on them, exchange every node whose pressure or gap is negative, and repeat. Blocks may
cycle; after `PATIENCE_ITERATIONS` rounds without progress single nodes are exchanged, which cannot cycle (Judice and
Pires 1994, doi:10.1016/0305-0548(94)90106-6). All decisions use signs only, so the units do not matter.

The effect of Coulomb's law depends on the path, so `SteppedPath` follows it: each step ends at the indentation where
the next node should come into contact, and is solved exactly.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from papilla.core.errors import SolverError
from papilla.fem.pressing.contact_path import ContactProblem, ContactState

PATIENCE_ITERATIONS = 4
"""Iterations without a smaller number of wrong nodes, after which one node at a time changes sets."""

CONTACT_NEWTON_STEPS = 300
"""Largest number of iterations; a step that needs more is not solved."""

TURN_TOLERANCE = 1e-10
"""Change of the traction's direction at a slipping node, as a share of the largest pressure, below which the iteration
has converged."""

CLOSED_GAP_SHARE = 1e-12
"""Overlap, as a share of the closure, that may be rounding of a closed gap."""

FRICTION_LIMIT_HYSTERESIS = 1e-9
"""Share of the friction limit within which a node keeps its state, stick or slip."""

LONGEST_STEP_SHARE = 0.1
"""Longest step of Coulomb friction, as a share of the indentation since first touch."""

FIRST_STEP_WIDTHS = 1e-3
"""First step, in widths of the patch, if all nodes touch at once so that no distance between contacts gives a
length."""

TOGETHER_DEPTH_SHARE = 1e-9
"""Share of the indentation since first touch within which nodes count as coming into contact together."""

SHORTEST_STEP_SHARE = 2.0**-12
"""Smallest share of its length to which a step is cut if it does not converge."""


@dataclass(frozen=True, eq=False)
class StepState(ContactState):
    """State at a point of a loading path, with c = 1 or 3 components of traction.

    active : (n,) the nodes in contact from here on. dissipated : energy that friction has dissipated on the patch,
    N mm. moved : (c, n) weak closure and slip under the tractions, mm3. slipping : (n,) nodes that slipped in the last
    step. iterations : of the last step.
    """

    dissipated: float
    moved: np.ndarray
    slipping: np.ndarray
    iterations: int = 0


def first_touch(problem: ContactProblem) -> StepState:
    """The state at which the nearest node touches, without load."""
    depth = problem.gap / problem.mass
    first, nothing = int(np.argmin(depth)), np.zeros(problem.free.shape)
    active = np.arange(len(depth)) == first
    return StepState(float(depth[first]), 0.0, nothing, active, 0.0, nothing, np.zeros_like(active))


def contact_step(
    problem: ContactProblem,
    start: StepState,
    friction: float = 0.0,
    *,
    force: float | None = None,
    indentation: float | None = None,
    guess: np.ndarray | None = None,
) -> StepState:
    """The state after a step to a force on the patch (N) or an indentation (mm); exactly one is given.

    Without friction only the active nodes of `start` count: the search starts with them. `guess` (c, n) : tractions to
    start from. Raises `SolverError` if Newton's method does not converge.
    """
    rho, before = problem.stiffness, start.moved[1:]
    active, slipping = start.active.copy(), start.slipping & start.active
    aim = (start.traction if guess is None else guess)[1:].T
    pressure = (start.traction if guess is None else guess)[0]
    depth, best, patience = indentation or 0.0, len(active) + 1, PATIENCE_ITERATIONS
    for iteration in range(1, CONTACT_NEWTON_STEPS + 1):
        # A force needs at least one node that carries it: the nearest.
        if force is not None and not active.any():
            active = np.arange(len(active)) == np.argmin(problem.gap / problem.mass)
        still, per_depth = _linearised(problem, active, slipping, friction, aim, pressure, before)
        if force is not None:
            # For given sets the tractions are linear in the indentation, so the force determines it.
            depth = (force - problem.force(still)) / problem.force(per_depth)
        traction = still + depth * per_depth
        moved = problem.moved(traction)
        gap = moved[0] + problem.gap - depth * problem.mass
        # Signs decide: a pressure below zero opens a node, an overlap closes it.
        touching = np.where(active, traction[0] > 0, gap < -CLOSED_GAP_SHARE * (moved[0] + np.abs(problem.gap)))
        slip = moved[1:] - before
        # q - rho s, whose projection on the friction disc is the law: outside of the disc the node slips.
        aimed = (traction[1:] - rho[1:] * slip).T
        aimed[~problem.free[1:].T] = 0
        pressure = np.where(active, traction[0], -rho[0] * gap)
        # A little hysteresis, so that rounding at the limit does not make a node change for ever.
        hysteresis = np.where(slipping, 1 - FRICTION_LIMIT_HYSTERESIS, 1 + FRICTION_LIMIT_HYSTERESIS)
        limit = friction * np.maximum(pressure, 0) * hysteresis
        slides = touching & (np.hypot.reduce(aimed, axis=1) > limit)
        wrong = (touching != active) | (slides != slipping)
        turned = 0.0 if wrong.any() else _turned(aim[slides], aimed[slides], pressure[slides])
        if not wrong.any() and turned <= TURN_TOLERANCE * max(pressure.max(), 0):
            dissipated = start.dissipated - float((traction[1:] * slip).sum())
            pushed = problem.force(traction)
            return StepState(depth, pushed, traction, active, dissipated, moved, slipping, iteration)
        patience = PATIENCE_ITERATIONS if wrong.sum() < best else patience - 1
        best = min(best, int(wrong.sum()))
        # Whole blocks cycle: exchange the last wrong node alone, a rule that, for contact alone, cannot return to an
        # earlier set.
        if patience < 0 and wrong.any():
            wrong = np.arange(len(wrong)) == np.flatnonzero(wrong)[-1]
        active, slipping = np.where(wrong, touching, active), np.where(wrong, slides, slipping)
        aim = aimed
    raise SolverError(f"contact, stick and slip did not settle in {CONTACT_NEWTON_STEPS} iterations")


def _turned(aim: np.ndarray, aimed: np.ndarray, pressure: np.ndarray) -> float:
    """Largest angle between vectors (k, 2), in radians if small, times the pressure (k,)."""
    if not len(pressure):
        return 0.0
    cross = np.abs(aim[:, 0] * aimed[:, 1] - aim[:, 1] * aimed[:, 0])
    return float((pressure * cross / (np.hypot(*aim.T) * np.hypot(*aimed.T))).max())


def _linearised(problem, active, slipping, friction, aim, pressure, before) -> tuple[np.ndarray, np.ndarray]:
    """Tractions (c, n) of the linearised law for given sets, at zero indentation, and their change per mm of
    indentation."""
    n = len(active)
    index = np.flatnonzero(problem.free & active)
    component, node = np.divmod(index, n)
    matrix, right = problem.compliance[np.ix_(index, index)], np.zeros((len(index), 2))
    normal = component == 0
    # Rows of pressures: the gap is zero, as a constant and per mm of indentation. Rows of shears: the slip of sticking
    # nodes is zero.
    right[normal] = np.column_stack([-problem.gap[node[normal]], problem.mass[node[normal]]])
    right[~normal, 0] = before[component[~normal] - 1, node[~normal]]
    if slipping.any():
        _slip_rows(matrix, right, index, problem, slipping, friction, aim, pressure, before)
    tractions = np.zeros((2, problem.free.size))
    tractions[:, index] = np.linalg.solve(matrix, right).T
    still, per_depth = tractions.reshape(2, -1, n)
    return still, per_depth


def _slip_rows(matrix, right, index, problem, slipping, friction, aim, pressure, before) -> None:
    """Change the rows of k slipping nodes from "no slip" to q - mu p z/|z| = 0, linearised at z = q - rho s."""
    n, nodes = len(slipping), np.flatnonzero(slipping)
    place = np.full(3 * n, -1)
    place[index] = np.arange(len(index))
    place = place.reshape(3, n)[:, nodes]
    size = np.hypot(*aim[nodes].T)
    # d(z/|z|) = (I - d d') dz / |z| with the direction d = z/|z|: turning counts, lengthening does not.
    direction = aim[nodes] / size[:, None]
    share = (friction * pressure[nodes] / size)[:, None, None]
    across = share * (np.eye(2) - direction[:, :, None] * direction[:, None, :])
    stiffness = problem.stiffness[1, nodes][:, None, None] * across
    slip = problem.compliance.reshape(3, n, 3 * n)[1:, nodes][:, :, index]
    rows = np.stack([stiffness[:, a, 0, None] * slip[0] + stiffness[:, a, 1, None] * slip[1] for a in (0, 1)])
    right_side = np.einsum("kab,bk->ak", stiffness, before[:, nodes])
    numbers = np.arange(len(nodes))
    for a in (0, 1):
        rows[a, numbers, place[0]] -= friction * direction[:, a]
        for b in (0, 1):
            unknown = place[1 + b] >= 0
            rows[a, numbers[unknown], place[1 + b, unknown]] += (a == b) - across[unknown, a, b]
    for a in (0, 1):
        unknown = place[1 + a] >= 0
        matrix[place[1 + a, unknown]], right[place[1 + a, unknown], 0] = rows[a, unknown], right_side[a, unknown]


class SteppedPath:
    """States of growing indentation with Coulomb's coefficient, computed step by step as far as needed, and kept.

    knots : the states at the ends of the steps, beginning with first touch.
    """

    def __init__(self, problem: ContactProblem, friction: float):
        self.problem, self.friction = problem, friction
        self.knots = [first_touch(problem)]
        self._idle = 0

    def at(self, *, force: float | None = None, indentation: float | None = None) -> StepState | None:
        """The state at a force on the patch (N) or an indentation (mm); it does not depend on what was computed before.
        None before first touch. Raises `SolverError` if a step does not converge."""
        name, aim = ("force", force) if force is not None else ("indentation", indentation)
        assert aim is not None
        if aim <= getattr(self.knots[0], name):
            return None
        if not self.friction:
            return contact_step(self.problem, self.knots[0], force=force, indentation=indentation)
        while getattr(self.knots[-1], name) < aim:
            self._extend()
        # From the knot before the asked state, so that the answer does not depend on earlier questions.
        k = next(k for k, knot in enumerate(self.knots) if getattr(knot, name) >= aim)
        before, after = self.knots[k - 1], self.knots[k]
        share = (aim - getattr(before, name)) / (getattr(after, name) - getattr(before, name))
        traction = before.traction + share * (after.traction - before.traction)
        return contact_step(self.problem, before, self.friction, force=force, indentation=indentation, guess=traction)

    def _extend(self) -> None:
        """Add one step, up to the indentation where the next node comes into contact."""
        knot = self.knots[-1]
        # Change of the tractions (c, n) per mm of further indentation, with unchanged sets of nodes
        sets, laws = (knot.active, knot.slipping & knot.active), (self.friction, knot.traction[1:].T)
        rate = _linearised(self.problem, *sets, *laws, knot.traction[0], knot.moved[1:])[1]
        length, node = _next_event(self.problem, knot, rate)
        sunk = knot.indentation - self.knots[0].indentation
        length = 0.0 if length <= TOGETHER_DEPTH_SHARE * sunk else length
        # Nodes that come into contact together need steps of no length; too many of them in a row mean a cycle.
        self._idle = 0 if length > 0 else self._idle + 1
        if self._idle > 3 * len(self.problem.mass):
            raise SolverError("nodes keep entering and leaving the contact: no state of stick follows this one")
        if not math.isfinite(length) or 0 < LONGEST_STEP_SHARE * sunk < length:
            length, node = LONGEST_STEP_SHARE * sunk or FIRST_STEP_WIDTHS * math.sqrt(self.problem.mass.sum()), None
        if length > 0:
            self.knots.append(self._cut(knot, length, rate))
        if node is not None:
            self.knots[-1] = replace(self.knots[-1], active=self.knots[-1].active | (np.arange(len(rate[0])) == node))

    def _cut(self, knot: StepState, length: float, rate: np.ndarray) -> StepState:
        """The state `length` (mm) further, in as many shorter steps as needed."""
        covered, cut = 0.0, 1.0
        while covered < 1:
            depth, guess = knot.indentation + cut * length, knot.traction + cut * length * rate
            try:
                knot = contact_step(self.problem, knot, self.friction, indentation=depth, guess=guess)
                covered += cut
            except SolverError:
                cut /= 2
                if cut < SHORTEST_STEP_SHARE:
                    raise
        return knot


def _next_event(problem: ContactProblem, knot: StepState, rate: np.ndarray) -> tuple[float, int | None]:
    """Distance (mm), at given rates, until the next node comes into contact, and that node; infinity and None if there
    is none."""
    # Gaps and their rates of closing are linear in the step, as long as no node changes its set.
    gap = knot.moved[0] + problem.gap - knot.indentation * problem.mass
    closing = problem.moved(rate)[0] - problem.mass
    entering = ~knot.active & (closing < 0)
    lengths = np.full(len(gap), np.inf)
    lengths[entering] = np.maximum(gap[entering], 0) / -closing[entering]
    node = int(np.argmin(lengths))
    return (float(lengths[node]), node) if np.isfinite(lengths[node]) else (math.inf, None)
