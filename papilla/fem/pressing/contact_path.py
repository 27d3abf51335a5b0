"""A growing contact, without friction or with full stick: one Cholesky factor gives all its states.

Quantity: the nodal tractions t (pressures, and shears if the contact sticks) at an indentation delta. Node j comes into
contact at the depth d_j at which its gap closes, and moves with the specimen from then on. A is the compliance, m the
mass and g the weak gap of the nodes, in the order in which they come into contact; b = m for pressures and 0 for
shears. While k nodes are in contact,

  A dt/d delta = b on these nodes,    A = L L^T,  L y = b.

The first k nodes have the leading block of A. Its factor is the leading block of L, and its y is the beginning of y. So
L^T dt/d delta is y, cut off after these nodes. The sum over the path gives

  L^T t = delta y - z,    z = d y,    (L z)_j = g_j for pressures,    z = d_j y for the shears of node j,

and the force is y . (delta y - z). So one factor and two triangular solves give all presses on one specimen, exactly.

The order of the nodes must be guessed. The computed d_j sort it, and it settles after one or two rounds. The state is
checked: no pressure and no gap may be negative. If a node leaves the contact again, `LeavingError` is raised, and
slower methods solve the press.

Example: two nodes with A = [[2, 1], [1, 2]], m = (1, 1), g = (0, 1). Then L = [[1.414, 0], [0.707, 1.225]], y = (0.707,
0.408), z = (0, 0.816), and d = z / y = (0, 2). Node 1 presses alone up to the indentation 2: t = (delta / 2, 0). At
delta = 3 both press: t = (4/3, 1/3).
"""

from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg.blas import dtrsm
from scipy.linalg.lapack import dpotrf, dtrtrs

from papilla.core.errors import SolverError

MOST_ORDERS = 24
"""Largest number of orders that are tried. Two are usual, and more than ten were never needed."""

EVEN_DEPTH_SHARE, PATH_ROUNDING_SHARE = 1e-12, 1e-10
"""Shares that count as rounding: of a depth when nodes are sorted, and of the largest gap or pressure of a path."""

FIRST_NODES = 24
"""Number of nodes with which a path begins if it has no guess."""


LEAVING_MESSAGE = "a node leaves the contact again, or no order of nodes was found"


class LeavingError(SolverError):
    """A node leaves the contact again, so the contact does not only grow."""


@dataclass(frozen=True, eq=False)
class ContactProblem:
    """Two bodies condensed to n contact nodes, with c = 1 component (pressure) or 3 (pressure and shears along both
    axes).

    compliance : (c n, c n) of both, mm3 / MPa: closure, then slip along either axis, under [p, q_1, q_2].
    mass : (n,) mm2. gap : (n,) weak gap at rest, mm3.
    fixed : (2, n) tangential tractions that symmetry keeps zero; None without friction.
    """

    compliance: np.ndarray
    mass: np.ndarray
    gap: np.ndarray
    fixed: np.ndarray | None = None

    @cached_property
    def free(self) -> np.ndarray:
        """(c, n) True for the tractions that symmetry does not keep zero."""
        normal = np.ones((1, len(self.mass)), dtype=bool)
        return normal if self.fixed is None else np.vstack([normal, ~self.fixed])

    @cached_property
    def stiffness(self) -> np.ndarray:
        """(c, n) stiffness rho of each node by itself, the same along both axes: the scale of gap and slip in Newton's
        method."""
        normal, *tangential = self.compliance.diagonal().reshape(self.free.shape)
        return np.stack([1 / normal, *(2 / sum(tangential) for _ in tangential)])

    def moved(self, traction: np.ndarray) -> np.ndarray:
        """Weak closure and slip (c, n), in mm3, under tractions (c, n)."""
        index = np.flatnonzero(traction)
        return (self.compliance[:, index] @ traction.ravel()[index]).reshape(len(traction), -1)

    def force(self, traction: np.ndarray) -> float:
        """Normal force on the patch (N)."""
        return float(self.mass @ traction[0])


@dataclass(frozen=True, eq=False)
class ContactState:
    """Indentation (mm), normal force on the patch (N), tractions (c, n) on the finger (MPa), nodes in contact (n,)."""

    indentation: float
    force: float
    traction: np.ndarray
    active: np.ndarray


class ContactPath:
    """States of growing indentation, computed as far as needed, and kept.

    `nodes` (m,) in the order in which they come into contact; the `depth` (m,) in mm and the `force` (m,) in N on the
    patch at which they do. guess : the path of a similar problem on the same nodes, whose order is tried first;
    margin : factor by which the path is computed further than needed. Raises `SolverError` if the compliance is not
    positive definite.
    """

    def __init__(self, problem: ContactProblem, guess: "ContactPath | None" = None, margin: float = 1.0):
        self.problem, self.guess, self.margin = problem, guess, margin
        self.nodes, self.depth, self.force = np.zeros(0, dtype=int), np.zeros(0), np.zeros(0)
        self._stuck, self._ended = len(problem.free) > 1, False
        self._solved: _Solved | None = None
        self._by_gap = np.argsort(problem.gap / problem.mass, kind="stable")

    def at(self, *, force: float | None = None, indentation: float | None = None) -> ContactState | None:
        """The state at a force on the patch (N) or an indentation (mm); None before first touch.

        Raises `LeavingError` if a node leaves the contact before that state.
        """
        name, aim = ("force", force) if force is not None else ("depth", indentation)
        assert aim is not None
        for _ in range(MOST_ORDERS):
            solved = self._extended(name, aim, sort=self._stuck or self.guess is None)
            count = int(np.searchsorted(getattr(self, name), aim))
            if not count:
                return None
            depth, solution = solved.state(count, force, indentation)
            wrong = solved.wrong(depth, solution)
            if not wrong.any():
                traction = np.zeros(self.problem.free.shape)
                traction.ravel()[solved.index] = solution
                active = np.zeros(len(self.problem.mass), dtype=bool)
                active[self.nodes[:count]] = True
                return ContactState(depth, self.problem.force(traction), traction, active)
            missed = np.setdiff1d(np.flatnonzero(wrong), solved.nodes)
            # Nothing is missing and the order is right, but a node pulls: it leaves the contact. With stick the past
            # matters, so the order cannot be repaired afterwards.
            if self._stuck or not len(missed) and (np.diff(solved.depth) >= 0).all():
                break
            self._solve(np.append(solved.nodes, missed), sort=True)
        raise LeavingError(LEAVING_MESSAGE)

    def _extended(self, name: str, aim: float, sort: bool) -> "_Solved":
        """The problem solved up to a force or depth, given by its `name`; `sort` : whether to correct the order of the
        nodes. Raises `LeavingError`, and knows the path up to there."""
        for _ in range(MOST_ORDERS):
            reached = getattr(self, name)
            if self._solved and (len(reached) == len(self.problem.mass) or (len(reached) and reached[-1] >= aim)):
                return self._solved
            if self._ended:
                break
            self._solve(self._longer(name, aim), sort)
        raise LeavingError(LEAVING_MESSAGE)

    def _longer(self, name: str, aim: float) -> np.ndarray:
        """The nodes of the path and some more, in order, with which it may reach a force or depth."""
        guess, further = self.guess, self.margin * aim
        if self._solved is None and guess is None:
            return self._by_gap[:FIRST_NODES]
        if self._solved is None and guess is not None:
            with suppress(LeavingError):
                guess._extended(name, further, sort=True)
            return guess.nodes[: int(np.searchsorted(getattr(guess, name), further)) + 2]
        # Half as many more: the next ones in the guess, or those with the smallest gap.
        order = self._by_gap if guess is None else np.append(guess.nodes, self._by_gap)
        order = order[np.sort(np.unique(order, return_index=True)[1])]
        more = max(FIRST_NODES, len(self.nodes) // 2)
        return np.append(self.nodes, order[~np.isin(order, self.nodes)][:more])

    def _solve(self, nodes: np.ndarray, sort: bool) -> None:
        """Solve for nodes (m,) in this order, or, if `sort` is set, in the order in which they come into contact."""
        for _ in range(MOST_ORDERS):
            solved = _Solved(self.problem, nodes)
            order = np.argsort(solved.depth, kind="stable")
            depth = solved.depth[order]
            finite = np.isfinite(depth)
            # The computed depths give a better order; nodes whose gap never closes drop out of it.
            if sort and not (finite.all() and (np.abs(solved.depth - depth) <= EVEN_DEPTH_SHARE * np.abs(depth)).all()):
                nodes = nodes[order][finite]
                continue
            # With stick the state depends on the past: every knot of the path must be sound, not only the last.
            sound, missed = solved.checked() if self._stuck else (len(nodes), nodes[:0])
            if not len(missed):
                self._solved, self._ended, self.nodes = solved, sound < len(nodes), nodes[:sound]
                self.depth = np.maximum.accumulate(solved.depth[:sound])
                self.force = np.maximum.accumulate(solved.force[:sound])
                return
            nodes = np.append(nodes, missed)
        raise LeavingError(LEAVING_MESSAGE)


class _Solved:
    """A problem solved for m nodes that come into contact in a given order; k unknowns, those of one node together.

    index : (k,) numbers of the unknowns. place : (k,) position of their nodes in the order. ends : (m,) number of
    unknowns up to and including each node. factor : L. y, z : (k,). depth : (m,) mm at which the nodes' gaps close,
    infinite where they open; force : (m,) N on the patch at which they do.
    """

    def __init__(self, problem: ContactProblem, nodes: np.ndarray):
        parts, n = problem.free.shape
        every = (nodes[:, None] + n * np.arange(parts)).ravel()
        free = problem.free.ravel()[every]
        self.problem, self.nodes, self.index = problem, nodes, every[free]
        self.place = np.repeat(np.arange(len(nodes)), parts)[free]
        normal = np.flatnonzero(self.index < n)
        self.ends = np.append(normal[1:], len(self.index))
        matrix = problem.compliance.take(self.index, 0).take(self.index, 1)
        # The matrix is symmetric, so its transpose is the same matrix in LAPACK's column order, without a copy.
        self.factor, failed = dpotrf(matrix.T, lower=True, overwrite_a=True)
        if failed:
            raise SolverError(
                "the compliance is not positive definite: an unstable finger, or a mesh too coarse for the specimen"
            )
        sunk, gap = np.zeros((2, len(self.index)))
        sunk[normal], gap[normal] = problem.mass[nodes], problem.gap[nodes]
        self.y = dtrtrs(self.factor, sunk, lower=True)[0]
        shear = np.flatnonzero(self.index >= n)
        closing = self.factor
        if len(shear):
            # A node that sticks has z = d y, and its pressure gives d = z / y: so the row of a shear says z - z_p y /
            # y_p = 0, p being the pressure of the same node. The matrix stays triangular: p stands before its shears.
            first = normal[self.place[shear]]
            closing = self.factor.copy(order="F")
            closing[shear] = 0
            closing[shear, shear], closing[shear, first] = 1, -self.y[shear] / self.y[first]
        self.z = dtrtrs(closing, gap, lower=True)[0]
        # When a node comes into contact, only the unknowns before it carry load: sums up to there.
        before = np.append(0, self.ends[:-1])
        squares, products = (np.append(0.0, np.cumsum(self.y * vector))[before] for vector in (self.y, self.z))
        with np.errstate(divide="ignore", invalid="ignore"):
            self.depth = np.where(self.y[normal] > 0, self.z[normal] / self.y[normal], np.inf)
            self.force = self.depth * squares - products

    def state(self, count: int, force: float | None, indentation: float | None) -> tuple[float, np.ndarray]:
        """Indentation (mm) and tractions (k,) with `count` nodes in contact, at a force or an indentation."""
        last = self.ends[count - 1]
        y, z = self.y[:last], self.z[:last]
        # The force y . (depth y - z), solved for the depth.
        depth = float((force + y @ z) / (y @ y)) if force is not None else indentation or 0.0
        right = np.zeros(len(self.y))
        right[:last] = depth * y - z
        return depth, dtrtrs(self.factor, right, lower=True, trans=1)[0]

    def wrong(self, depth: float, traction: np.ndarray) -> np.ndarray:
        """Nodes (n,) whose pressure is negative under tractions (k,), and, without friction, nodes whose gap is
        negative.

        Without friction this check is complete, because the state does not depend on how it was reached. With stick it
        is used at each knot of the path.
        """
        problem, n = self.problem, len(self.problem.mass)
        wrong = np.zeros(n, dtype=bool)
        normal = self.index < n
        pressure = traction[normal]
        wrong[self.nodes] = pressure < -PATH_ROUNDING_SHARE * pressure.max()
        if normal.all():
            gap = traction @ problem.compliance.take(self.index, 0) + problem.gap
            wrong |= gap - depth * problem.mass < -PATH_ROUNDING_SHARE * np.abs(gap).max()
        return wrong

    def checked(self) -> tuple[int, np.ndarray]:
        """Number of knots of the path at which no pressure and no gap is negative; and the nodes outside of the order
        whose gap is negative at the first other knot."""
        problem, knots, n = self.problem, np.arange(len(self.depth)), len(self.problem.mass)
        # Column k: right-hand side of the state at which node k touches. One triangular solve gives all states.
        rising = np.where(self.place[:, None] < knots, np.outer(self.y, self.depth) - self.z[:, None], 0.0)
        traction = dtrsm(1.0, self.factor, rising, lower=1, trans_a=1)
        gap = problem.compliance[:n].take(self.index, 1) @ traction + problem.gap[:, None]
        scale = np.abs(gap).max()
        gap -= np.outer(problem.mass, self.depth)
        pressure = traction[self.index < n]
        pulled = (pressure < -PATH_ROUNDING_SHARE * pressure.max()).any(axis=0)
        wrong = pulled | (gap < -PATH_ROUNDING_SHARE * scale).any(axis=0)
        if not wrong.any():
            return len(knots), knots[:0]
        first = int(wrong.argmax())
        return first, np.setdiff1d(np.flatnonzero(gap[:, first] < 0), self.index)
