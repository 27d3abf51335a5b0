"""One step of unilateral contact with exact Coulomb friction on a condensed body: a semismooth Newton method.

Unknown are the pressing forces a >= 0 and the tangential ones b of n nodes. With compliance C the nodes move along x
by u = Cxx b + Cxa a + u0 and inward by w = Cax b + Caa a + w0. At each node, with the gap g = w + rise - depth and the
slip s = u - u_old + drift of the node over the counter-body,

    g >= 0, a >= 0, g a = 0        and        |b| <= mu a, b = -mu a sign(s) where s is not 0.

Active sets (open, stick, slip to either side) are the Newton iteration of the complementarity functions that this is
(Alart and Curnier 1991, doi:10.1016/0045-7825(91)90022-X). Where the sets begin to circle, only the node that violates
its law most changes at a time; where that does not end either, nodes are relaxed one by one (Gauss-Seidel), each to its
own exact law: for sets to begin anew with or, at last, to the end. No convexified law: that one lifts the
body while it slips.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dgesv

OPEN, STICK, RIGHT, LEFT = 0, 2, 1, -1
"""State of a node: `RIGHT` and `LEFT` are the sign of its slip."""

MOST_SETS, RESTARTS, FEW_SWEEPS, MOST_SWEEPS = 200, 4, 10, 400
"""Active sets that are tried, restarts of them after a few sweeps of relaxation, and sweeps of the last resort."""

TOLERANCE = 1e-9
"""Of gaps and slips, in terms of the largest displacement of the step; of forces, of their sum."""


@dataclass(frozen=True, eq=False)
class Rubbed:
    """A solved step: forces along x and inward (2n,) in N/mm on the body, its displacements (2n,), the depth (mm),
    states (n,), iterations, how it was solved ("newton", "relaxation"), and by how much the laws are violated: relative
    to the largest displacement and force."""

    force: np.ndarray
    moved: np.ndarray
    depth: float
    state: np.ndarray
    iterations: int
    method: str
    violation: float


@dataclass(frozen=True, eq=False)
class Laws:
    """What a step is asked to fulfil: arrays as in the module's text, free (2n,) = (u0, w0); one of `depth` and `load`
    (the sum of a) is given."""

    compliance: np.ndarray
    rise: np.ndarray
    old: np.ndarray
    drift: float
    friction: float
    free: np.ndarray
    depth: float | None = None
    load: float | None = None


def rub(laws: Laws, start: np.ndarray) -> Rubbed:
    """Solve a step from states (n,) to begin with."""
    found, state = None, start
    for _ in range(1 + RESTARTS):
        found, last = _newton(laws, state)
        if found is not None:
            return found
        # Some sweeps at the depth of the last try find other sets to begin with
        guess = _relax_at(laws, last.depth, last.force, FEW_SWEEPS)
        state = guess.state
    return relax(laws)


def _newton(laws: Laws, start: np.ndarray) -> tuple[Rubbed | None, Rubbed]:
    """The step by active sets, None where they do not end; and the last set's solution."""
    state, seen, circles = start.copy(), set(), 0
    none = np.zeros(2 * len(start))
    last = Rubbed(none, laws.free, laws.depth or 0.0, state, 0, "newton", math.inf)
    for count in range(1, MOST_SETS + 1):
        solved = _solve(laws, state)
        if solved is None:
            break
        force, moved, depth = solved
        following, urgency, violation = _judge(laws, state, force, moved, depth)
        last = Rubbed(force, moved, depth, state, count, "newton", violation)
        if (following == state).all():
            return last, last
        if circles:
            worst = int(np.argmax(np.where(following != state, urgency, -1.0)))
            state = state.copy()
            state[worst] = following[worst]
        else:
            state = following
        if (key := state.tobytes()) in seen:
            circles += 1
            if circles > 2:
                break
        seen.add(key)
    return None, last


def _solve(laws: Laws, state: np.ndarray) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Forces, displacements and depth that fulfil the equations of the states; None where they are singular."""
    C, n, free = laws.compliance, len(state), laws.free
    touching = state.nonzero()[0]
    if laws.load is not None and not len(touching):
        touching = np.array([int(np.argmin(free[n:] + laws.rise))])
    states = state[touching]
    rubbing = laws.friction > 0
    held = touching[states == STICK] if rubbing else touching[:0]
    slips = (np.abs(states) == 1).nonzero()[0] if rubbing else held
    sliding, drag = touching[slips], -laws.friction * states[slips]
    count, size = len(touching), len(touching) + len(held)
    force = np.zeros(2 * n)
    depth = 0.0 if laws.depth is None else laws.depth
    if not count:
        return force, free.copy(), depth
    rows = np.concatenate([touching + n, held])
    # The compliance is symmetric: its rows, which lie together in memory, are its columns; LAPACK takes a transpose
    wide, beside = C[rows], C[sliding]
    matrix = np.zeros((size + 1, size + 1)) if laws.load is not None else np.empty((size, size))
    matrix[:size, :size] = wide[:, rows]
    matrix[slips, :size] += beside[:, rows] * drag[:, None]
    rhs = -free[rows]
    rhs[:count] -= laws.rise[touching]
    rhs[count:] += laws.old[held] - laws.drift
    if laws.load is not None:
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
    return force, x[:size] @ wide + pulled @ beside + free, depth


def _judge(laws: Laws, state, force, moved, depth) -> tuple[np.ndarray, np.ndarray, float]:
    """The states that follow from a solution, how much nodes violate their laws (n,), and the solve's own error."""
    n = len(state)
    a, b = force[n:], force[:n]
    gap = moved[n:] + laws.rise - depth
    length = max(float(np.abs(moved[n:]).max()), abs(laws.drift), 1e-300)
    strength = max(float(np.abs(a).sum()), 1e-300)
    following, is_open = state.copy(), state == OPEN
    urgency = np.where(is_open, -gap / length, -a / strength)
    toward = STICK if laws.drift == 0 else (RIGHT if laws.drift > 0 else LEFT)
    wrong = urgency > TOLERANCE
    following[is_open & wrong] = toward if laws.friction > 0 else RIGHT
    following[~is_open & wrong] = OPEN
    error = float(np.abs(gap[~is_open]).max(initial=0)) / length
    if laws.friction > 0:
        slip = moved[:n] - laws.old + laws.drift
        held, kept = state == STICK, ~wrong
        rubbing = np.where(held, (np.abs(b) - laws.friction * a) / strength, -state * slip / length)
        wrong = kept & ~is_open & (rubbing > TOLERANCE)
        urgency = np.where(wrong, rubbing, urgency)
        following[wrong] = np.where(held, np.where(b > 0, LEFT, RIGHT), STICK)[wrong]
        error = max(error, float(np.abs(slip[held]).max(initial=0)) / length)
    return following, urgency, error


def relax(laws: Laws) -> Rubbed:
    """The step by relaxation; of a given load, by the depth at which it is carried (secant within a bracket)."""
    if laws.load is None:
        assert laws.depth is not None
        return _relax_at(laws, laws.depth, np.zeros(2 * len(laws.rise)))
    n = len(laws.rise)
    low = float((laws.free[n:] + laws.rise).min())
    high, begun = low + laws.load * float(np.diag(laws.compliance)[n:].max()), np.zeros(2 * n)
    found = _relax_at(laws, high, begun)
    f_low, f_high = -laws.load, float(found.force[n:].sum()) - laws.load
    for _ in range(60):
        if abs(f_high) <= 1e-8 * laws.load or high - low <= 1e-12 * abs(high):
            break
        depth = high - f_high * (high - low) / (f_high - f_low)
        if not low < depth < high:
            depth = (low + high) / 2
        found = _relax_at(laws, depth, found.force)
        error = float(found.force[n:].sum()) - laws.load
        if abs(error) <= 1e-8 * laws.load:
            break
        if error > 0:
            high, f_high, f_low = depth, error, f_low / 2
        else:
            low, f_low, f_high = depth, error, f_high / 2
    return found


def _relax_at(laws: Laws, depth: float, start: np.ndarray, most: int = MOST_SWEEPS) -> Rubbed:
    """Nodes one by one to their own exact law until forces rest."""
    C, n = laws.compliance, len(laws.rise)
    force = start.copy()
    moved = C @ force + laws.free
    near = np.flatnonzero((laws.free[n:] + laws.rise < depth) | (force[n:] > 0))
    change, sweep = math.inf, 0
    while sweep < most and change > 1e-10 * max(float(force[n:].sum()), 1e-300):
        change, sweep = 0.0, sweep + 1
        for i in near:
            own = np.array([[C[i, i], C[i, n + i]], [C[n + i, i], C[n + i, n + i]]])
            before = np.array([force[i], force[n + i]])
            there = np.array([moved[i] - laws.old[i] + laws.drift, moved[n + i] + laws.rise[i] - depth]) - own @ before
            after = _own_law(own, there, laws.friction)
            step = after - before
            if step.any():
                moved += C[:, i] * step[0] + C[:, n + i] * step[1]
                force[i], force[n + i] = after
                change = max(change, float(np.abs(step).max()))
    state = np.where(force[n:] <= 0, OPEN, np.where(force[:n] < 0, RIGHT, LEFT))
    if laws.friction > 0:
        state[(force[n:] > 0) & (np.abs(force[:n]) < laws.friction * force[n:] * (1 - 1e-9))] = STICK
    total = max(float(force[n:].sum()), 1e-300)
    return Rubbed(force, moved, depth, state, sweep, "relaxation", change / total)


def _own_law(own: np.ndarray, there: np.ndarray, friction: float) -> np.ndarray:
    """Forces (b, a) of a single node of compliance `own` (2, 2) whose slip and gap without them are `there` (2,)."""
    if there[1] >= 0:
        return np.zeros(2)
    if friction == 0:
        return np.array([0.0, -there[1] / own[1, 1]])
    b, a = np.linalg.solve(own, -there)
    if a >= 0 and abs(b) <= friction * a:
        return np.array([b, a])
    for sign in (1.0, -1.0) if b < 0 else (-1.0, 1.0):
        stiff = own[1, 1] - friction * sign * own[1, 0]
        if stiff > 0:
            a = -there[1] / stiff
            if sign * (there[0] + (own[0, 1] - friction * sign * own[0, 0]) * a) >= 0:
                return np.array([-friction * sign * a, a])
    return np.array([0.0, -there[1] / own[1, 1]])
