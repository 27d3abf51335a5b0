"""One step of unilateral contact with exact Coulomb friction on a condensed body: a semismooth Newton method.

Unknowns are the pressing forces a >= 0 and the tangential forces b of n nodes. With compliance C the nodes move along x
by u = Cxx b + Cxa a + u0 and inward by w = Cax b + Caa a + w0. At each node, with the gap g = w + rise - depth and the
slip s = u - u_old + drift of the node over the counter-body,

    g >= 0, a >= 0, g a = 0        and        |b| <= mu a, b = -mu a sign(s) where s is not 0.

Active sets (open, stick, slip to either side) are the Newton iteration of the complementarity functions that this is
(Alart and Curnier 1991, doi:10.1016/0045-7825(91)90022-X). If the sets begin to cycle, only the node with the largest
violation changes at a time. If that does not converge either, nodes are relaxed one by one (Gauss-Seidel), each to its
own exact law, which gives new sets to start from or, at last, the solution; up to a coefficient of 1 hardly a step
needs it. A convexified friction law is not used, because it lifts the body while it slips. With high friction the load
jumps as a function of the depth: a load inside such a jump has no solution, and is reported as a violation.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg.lapack import dgesv

from papilla.core.units import TINY_DIVISOR

OPEN_NODE, STICKING_NODE, SLIPS_RIGHT, SLIPS_LEFT = 0, 2, 1, -1
"""States of a node; `SLIPS_RIGHT` and `SLIPS_LEFT` are the sign of its slip."""

MOST_SETS, MOST_RESTARTS, FEW_SWEEPS, MOST_SWEEPS = 200, 4, 10, 400
"""Largest numbers of: active sets that are tried, restarts after a few sweeps of relaxation, and sweeps of the last
relaxation."""

STEEPEST_LOAD_CHANGE = 1e4
"""Relative change of the load over that of the depth above which the load jumps; it is 10 to 50 elsewhere."""

CONTACT_LAW_TOLERANCE = 1e-9
"""Tolerances: of gaps and slips, relative to the largest displacement of the step; of forces, relative to their sum."""


@dataclass(frozen=True, eq=False)
class Rubbed:
    """A solved step: forces along x and inward (2n,) in N/mm on the body, its displacements (2n,), the depth (mm),
    states (n,), iterations, how it was solved ("newton", "relaxation"), and the violation of the laws, relative to
    the largest displacement and force."""

    force: np.ndarray
    moved: np.ndarray
    depth: float
    state: np.ndarray
    iterations: int
    method: str
    violation: float


@dataclass(frozen=True, eq=False)
class Laws:
    """Input of a step: arrays as at the top of the module, free (2n,) = (u0, w0); either `depth` or `load` (the sum of
    a) is given."""

    compliance: np.ndarray
    rise: np.ndarray
    old: np.ndarray
    drift: float
    friction: float
    free: np.ndarray
    depth: float | None = None
    load: float | None = None


def rub(laws: Laws, start: np.ndarray) -> Rubbed:
    """Solve a step, starting from states (n,)."""
    rubbed, last = _newton(laws, start)
    for _ in range(MOST_RESTARTS if rubbed is None else 0):
        # Some sweeps of relaxation at the last depth find other sets to start from
        guess = _relax_at(laws, last.depth, last.force, FEW_SWEEPS)
        rubbed, last = _newton(laws, guess.state)
        if rubbed is not None:
            break
    return rubbed or relax(laws)


def _newton(laws: Laws, start: np.ndarray) -> tuple[Rubbed | None, Rubbed]:
    """The step by active sets, None if they do not converge; and the solution of the last set."""
    node_states, seen, circles = start.copy(), set(), 0
    none = np.zeros(2 * len(start))
    last = Rubbed(none, laws.free, laws.depth or 0.0, node_states, 0, "newton", math.inf)
    for count in range(1, MOST_SETS + 1):
        solved = _solve(laws, node_states)
        if solved is None:
            break
        force, moved, depth = solved
        following, urgency, violation = _judge(laws, node_states, force, moved, depth)
        last = Rubbed(force, moved, depth, node_states, count, "newton", violation)
        if following is node_states:
            return last, last
        # The sets have begun to cycle: change only the node that violates its law most.
        if circles:
            worst = int(np.argmax(np.where(following != node_states, urgency, -1.0)))
            node_states = node_states.copy()
            node_states[worst] = following[worst]
        else:
            node_states = following
        if (key := node_states.tobytes()) in seen:
            circles += 1
            if circles > 2:
                break
        seen.add(key)
    return None, last


def _solve(laws: Laws, node_states: np.ndarray) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Forces, displacements and depth that solve the equations for given states; None if they are singular."""
    C, n, free = laws.compliance, len(node_states), laws.free
    touching = node_states.nonzero()[0]
    if laws.load is not None and not len(touching):
        # A load needs at least one node that carries it.
        touching = np.array([int(np.argmin(free[n:] + laws.rise))])
    states = node_states[touching]
    rubbing = laws.friction > 0
    # Unknowns: a of all touching nodes, b of sticking ones. A slipping node's b is -mu a sign(s), so its column is
    # added to that of its a.
    sticking = touching[states == STICKING_NODE] if rubbing else touching[:0]
    slips = (np.abs(states) == 1).nonzero()[0] if rubbing else sticking
    sliding, drag = touching[slips], -laws.friction * states[slips]
    count, size = len(touching), len(touching) + len(sticking)
    force = np.zeros(2 * n)
    depth = 0.0 if laws.depth is None else laws.depth
    if not count:
        return force, free.copy(), depth
    rows = np.concatenate([touching + n, sticking])
    # The compliance is symmetric, so its rows, which are contiguous in memory, serve as columns; LAPACK takes a
    # transpose
    wide, sliding_rows = C[rows], C[sliding]
    matrix = np.zeros((size + 1, size + 1)) if laws.load is not None else np.empty((size, size))
    matrix[:size, :size] = wide[:, rows]
    matrix[slips, :size] += sliding_rows[:, rows] * drag[:, None]
    rhs = -free[rows]
    # Rows: the gap of touching nodes is zero, the slip of sticking ones is zero.
    rhs[:count] -= laws.rise[touching]
    rhs[count:] += laws.old[sticking] - laws.drift
    if laws.load is not None:
        # Given load: the depth is one more unknown, the sum of a one more equation.
        matrix[size, :count], matrix[:count, size] = -1.0, 1.0
        rhs = np.append(rhs, laws.load)
    else:
        rhs[:count] += depth
    _, _, x, fault = dgesv(matrix.T, rhs, overwrite_a=True, overwrite_b=True)
    if fault or not np.isfinite(x).all():
        return None
    pulled = drag * x[slips]
    force[rows], force[sliding] = x[:size], pulled
    if laws.load is not None:
        depth = float(x[size])
    return force, x[:size] @ wide + pulled @ sliding_rows + free, depth


def _judge(laws: Laws, node_states, force, moved, depth) -> tuple[np.ndarray, np.ndarray, float]:
    """The states that follow from a solution (the same object if they hold), the violation of each node's laws (n,),
    and the error of the linear solve."""
    n, mu = len(node_states), laws.friction
    a, inward = force[n:], moved[n:]
    length = max(float(inward.max()), -float(inward.min()), abs(laws.drift), TINY_DIVISOR)
    strength = max(float(np.abs(a).sum()), TINY_DIVISOR)
    touching = node_states.nonzero()[0]
    gap, pressing, states = inward + laws.rise - depth, a[touching], node_states[touching]
    # Violations are shares of the largest displacement or of the whole force, so that overlaps, pulls and slips can be
    # compared.
    urgency = gap / -length
    urgency[touching] = pressing / -strength
    error = float(np.abs(gap[touching]).max(initial=0)) / length
    wrong, turns, turned = urgency > CONTACT_LAW_TOLERANCE, touching[:0], states[:0]
    if mu > 0:
        slip, rubbing = moved[touching] - laws.old[touching] + laws.drift, force[touching]
        sticking = states == STICKING_NODE
        # A sticking node must not pull more than mu a; a slipping one must not slip against its own friction.
        beyond = np.where(sticking, (np.abs(rubbing) - mu * pressing) / strength, -states * slip / length)
        against = ((beyond > CONTACT_LAW_TOLERANCE) & ~wrong[touching]).nonzero()[0]
        turns, turned = touching[against], np.where(rubbing > 0, SLIPS_LEFT, SLIPS_RIGHT)[against]
        turned[~sticking[against]] = STICKING_NODE
        urgency[turns] = beyond[against]
        error = max(error, float(np.abs(slip[sticking]).max(initial=0)) / length)
    following = node_states
    if wrong.any() or len(turns):
        # A node that comes into contact slips with the drift at first (it sticks if there is none); the next iterations
        # decide.
        toward = (
            (STICKING_NODE if laws.drift == 0 else (SLIPS_RIGHT if laws.drift > 0 else SLIPS_LEFT))
            if mu > 0
            else SLIPS_RIGHT
        )
        following = np.where(wrong, np.where(node_states == OPEN_NODE, toward, OPEN_NODE), node_states)
        following[turns] = turned
    return following, urgency, error


def relax(laws: Laws) -> Rubbed:
    """The step by relaxation; for a given load, the depth is found by the secant method within a bracket."""
    if laws.load is None:
        assert laws.depth is not None
        return _relax_at(laws, laws.depth, np.zeros(2 * len(laws.rise)))
    n, load = len(laws.rise), laws.load
    low = float((laws.free[n:] + laws.rise).min())
    high, begun = low + load * float(np.diag(laws.compliance)[n:].max()), np.zeros(2 * n)
    rubbed = _relax_at(laws, high, begun)
    f_low, f_high = -load, float(rubbed.force[n:].sum()) - load
    error = f_high
    # Secant steps in a bracket; halving the error of the end that stays (Illinois rule) keeps them from stalling. They
    # end when the load is met, or when it jumps within the bracket.
    while abs(error) > 1e-8 * load and STEEPEST_LOAD_CHANGE * load * (high - low) > abs(error * high):
        depth = high - f_high * (high - low) / (f_high - f_low)
        if not low < depth < high:
            depth = (low + high) / 2
        rubbed = _relax_at(laws, depth, rubbed.force)
        error = float(rubbed.force[n:].sum()) - load
        if error > 0:
            high, f_high, f_low = depth, error, f_low / 2
        else:
            low, f_low, f_high = depth, error, f_high / 2
    return replace(rubbed, violation=max(rubbed.violation, abs(error) / load))


def _relax_at(laws: Laws, depth: float, start: np.ndarray, most: int = MOST_SWEEPS) -> Rubbed:
    """Relax nodes one by one to their own exact laws until the forces are constant."""
    C, n, friction = laws.compliance, len(laws.rise), laws.friction
    near = ((laws.free[n:] + laws.rise < depth) | (start[n:] > 0)).nonzero()[0]
    m = len(near)
    both = np.concatenate([near, near + n])
    compliance, force = C[np.ix_(both, both)], start[both]
    gaps = compliance @ force + laws.free[both]
    gaps[:m] += laws.drift - laws.old[near]
    gaps[m:] += laws.rise[near] - depth
    along, across, inward = np.diag(compliance)[:m], np.diag(compliance[:m, m:]), np.diag(compliance)[m:]
    blocks = list(zip(along.tolist(), across.tolist(), inward.tolist(), strict=True))
    change, sweep, limit = math.inf, 0, 0.0
    while sweep < most and change > limit:
        change, sweep = 0.0, sweep + 1
        for i, (xx, xa, aa) in enumerate(blocks):
            b, a = force[i], force[m + i]
            slip, gap = gaps[i] - xx * b - xa * a, gaps[m + i] - xa * b - aa * a
            to_b, to_a = _own_law(xx, xa, aa, slip, gap, friction) if gap < 0 else (0.0, 0.0)
            if to_b != b or to_a != a:
                # One node's new forces move all the others: update slips and gaps instead of solving again.
                gaps += compliance[i] * (to_b - b) + compliance[m + i] * (to_a - a)
                force[i], force[m + i] = to_b, to_a
                change = max(change, abs(to_b - b), abs(to_a - a))
        limit = 1e-10 * max(float(force[m:].sum()), TINY_DIVISOR)
    b, a = force[:m], force[m:]
    node_states = np.zeros(n, dtype=np.int64)
    node_states[near] = np.where(a <= 0, OPEN_NODE, np.where(b < 0, SLIPS_RIGHT, SLIPS_LEFT))
    if friction > 0:
        node_states[near[(a > 0) & (np.abs(b) < friction * a * (1 - 1e-9))]] = STICKING_NODE
    all_forces = np.zeros(2 * n)
    all_forces[both] = force
    total = max(float(a.sum()), TINY_DIVISOR)
    return Rubbed(all_forces, C @ all_forces + laws.free, depth, node_states, sweep, "relaxation", change / total)


def _own_law(xx: float, xa: float, aa: float, slip: float, gap: float, friction: float) -> tuple[float, float]:
    """Forces (b, a) of a node with compliance [[xx, xa], [xa, aa]], whose slip and gap < 0 are given without these
    forces."""
    if friction == 0:
        return 0.0, -gap / aa
    # Stick first: both forces that close the gap and stop the slip.
    determinant = xx * aa - xa * xa
    b, a = (xa * gap - aa * slip) / determinant, (xa * slip - xx * gap) / determinant
    if a >= 0 and abs(b) <= friction * a:
        return b, a
    # Outside of the friction cone the node slips. The forces that close the gap form a line, on which the slip grows
    # with b. From b = 0, inside the cone, to stick, outside of it, the line crosses the edge of the cone on that side,
    # and there the node slips against its force.
    side = math.copysign(friction, b)
    a = -gap / (aa + side * xa)
    return side * a, a
