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
from itertools import pairwise

import numpy as np
from scipy.linalg.blas import dtrsm
from scipy.linalg.lapack import dpotrf, dtrtrs

from papilla.core.errors import SolverError

MOST_ORDERS = 24
"""Largest number of orders that are tried. Two are usual, and more than ten were never needed."""

EVEN_DEPTH_SHARE, PATH_ROUNDING_SHARE = 1e-12, 1e-10
"""Shares that count as rounding: of a depth when nodes are sorted, and of the largest gap or pressure of a path."""

WIDEST_GROUP_SHARE = 0.25
"""Largest group of unknowns that change places among themselves, as a share of all, up to which a factor is turned into
the one of another order: a group of w takes about 2 w^2 k operations, a new factor k^3 / 3."""

FIRST_NODES = 24
"""Number of nodes with which a path begins if it has no guess."""


LEAVING_MESSAGE = "a node leaves the contact again, or no order of nodes was found"


class LeavingError(SolverError):
    """A node leaves the contact again, so the contact does not only grow."""


@dataclass(frozen=True, eq=False)
class ContactProblem:
    """Two bodies condensed to n contact nodes, with c = 1 component (pressure) or 3 (pressure and shears along both
    axes).

    finger : (c n, c n) compliance, mm3 / MPa: closure, then slip along either axis, under [p, q_1, q_2].
    mass : (n,) mm2. gap : (n,) weak gap at rest, mm3.
    fixed : (2, n) tangential tractions that symmetry keeps zero; None without friction.
    specimen : (c n, c n) compliance of one of 1 MPa; `modulus` : of the one that is pressed, MPa. Without it `finger`
    is the compliance of both.
    """

    finger: np.ndarray
    mass: np.ndarray
    gap: np.ndarray
    fixed: np.ndarray | None = None
    specimen: np.ndarray | None = None
    modulus: float = 1.0

    @cached_property
    def compliance(self) -> np.ndarray:
        """(c n, c n) of both bodies, mm3 / MPa. A growing contact needs only a part of it (`part`)."""
        return self.finger if self.specimen is None else self.finger + self.specimen / self.modulus

    def part(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """The compliance (r, k) of both bodies in these rows (r,) and columns (k,)."""
        places = rows[:, None] * len(self.finger) + columns
        if self.specimen is None:
            return self.finger.take(places)
        part = self.specimen.take(places)
        part /= self.modulus
        part += self.finger.take(places)
        return part

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
        moved = self.finger @ traction.ravel()
        if self.specimen is not None:
            moved += self.specimen @ traction.ravel() / self.modulus
        return moved.reshape(traction.shape)

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
            self._solve(np.append(solved.nodes, missed), name, aim, sort=True)
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
            self._solve(self._longer(name, aim), name, aim, sort)
        raise LeavingError(LEAVING_MESSAGE)

    def _longer(self, name: str, aim: float) -> np.ndarray:
        """The nodes of the path and some more, in order, with which it may reach a force or depth."""
        guess, further = self.guess, self.margin * aim
        if self._solved is None and guess is not None:
            with suppress(LeavingError):
                guess._extended(name, further, sort=guess.guess is None)
            # The guess itself may still have the order of its own guess; the depths that it computed give a better one.
            nodes = guess.nodes[: int(np.searchsorted(getattr(guess, name), further)) + 2]
            if guess._solved is not None and len(nodes):
                return nodes[np.argsort(guess._solved.depth[: len(nodes)], kind="stable")]
        if self._solved is None:
            return self._by_gap[:FIRST_NODES]
        # Half as many more: the next ones in the guess, or those with the smallest gap.
        order = self._by_gap if guess is None else np.append(guess.nodes, self._by_gap)
        order = order[np.sort(np.unique(order, return_index=True)[1])]
        more = max(FIRST_NODES, len(self.nodes) // 2)
        return np.append(self.nodes, order[~np.isin(order, self.nodes)][:more])

    def _solve(self, nodes: np.ndarray, name: str, aim: float, sort: bool) -> None:
        """Solve for nodes (m,) in this order, or, if `sort` is set, in the order in which they come into contact; with
        stick it is the path at least up to a force or depth, given by its `name`, or to where nodes leave it."""
        solved = None
        for _ in range(MOST_ORDERS):
            solved = _Solved(self.problem, nodes, solved)
            order = np.argsort(solved.depth, kind="stable")
            depth = solved.depth[order]
            finite = np.isfinite(depth)
            # The computed depths give a better order; nodes whose gap never closes drop out of it.
            if sort and not (finite.all() and (np.abs(solved.depth - depth) <= EVEN_DEPTH_SHARE * np.abs(depth)).all()):
                nodes = nodes[order][finite]
                continue
            reached = {"depth": np.maximum.accumulate(solved.depth), "force": np.maximum.accumulate(solved.force)}
            # With stick the state depends on the past: every knot of the path must be sound, not only the last.
            sound, missed = solved.checked() if self._stuck else (len(nodes), nodes[:0])
            if not len(missed) or (sound and reached[name][sound - 1] >= aim):
                self._solved, self._ended, self.nodes = solved, sound < len(nodes) and not len(missed), nodes[:sound]
                self.depth, self.force = reached["depth"][:sound], reached["force"][:sound]
                return
            nodes = np.append(nodes, missed)
        raise LeavingError(LEAVING_MESSAGE)


class _Solved:
    """A problem solved for m nodes that come into contact in a given order; k unknowns, those of one node together.

    index : (k,) numbers of the unknowns. place : (k,) position of their nodes in the order. ends : (m,) number of
    unknowns up to and including each node. factor : L. y, z : (k,). depth : (m,) mm at which the nodes' gaps close,
    infinite where they open; force : (m,) N on the patch at which they do.
    """

    def __init__(self, problem: ContactProblem, nodes: np.ndarray, earlier: "_Solved | None" = None):
        parts, n = problem.free.shape
        every = (nodes[:, None] + n * np.arange(parts)).ravel()
        free = problem.free.ravel()[every]
        self.problem, self.nodes, self.index = problem, nodes, every[free]
        self.place = np.repeat(np.arange(len(nodes)), parts)[free]
        normal = np.flatnonzero(self.index < n)
        self.ends = np.append(normal[1:], len(self.index))
        # A new order of the same nodes needs no new factor if few unknowns change places. A small one is made as fast.
        factor = None
        if earlier is not None and parts > 1 and len(earlier.nodes) == len(nodes):
            number = np.empty(problem.free.size, dtype=int)
            number[earlier.index] = np.arange(len(self.index))
            factor = _reordered(earlier.factor, number[self.index])
        self.factor: np.ndarray = _factorised(problem.part(self.index, self.index)) if factor is None else factor
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
            pressed = np.zeros((1, n))
            pressed[0, self.index] = traction
            gap = problem.moved(pressed)[0] + problem.gap
            wrong |= gap - depth * problem.mass < -PATH_ROUNDING_SHARE * np.abs(gap).max()
        return wrong

    def checked(self) -> tuple[int, np.ndarray]:
        """Number of knots of the path at which no pressure and no gap is negative; and the nodes outside of the order
        whose gap is negative at the first other knot."""
        problem, size, n = self.problem, len(self.nodes), len(self.problem.mass)
        normal, outside = self.index < n, np.delete(np.arange(n), self.nodes)
        within, beside = self.factor[normal], problem.part(outside, self.index)
        pressure, closure = np.zeros((size, size)), np.empty((n, size))
        # Early states need only the beginning of the factor, so the path is checked in two parts.
        for first, end in pairwise(sorted({0, size // 2, size})):
            knots, last = np.arange(first, end), self.ends[end - 1]
            y, z, place = (vector[:last, None] for vector in (self.y, self.z, self.place))
            # Column k: right-hand side of the state at which node k touches. One triangular solve gives these states.
            rising = np.where(place < knots, y * self.depth[first:end] - z, 0.0)
            traction = dtrsm(1.0, self.factor[:last, :last], rising, lower=1, trans_a=1)
            pressure[:end, first:end] = traction[normal[:last]]
            # On the nodes of the order the closure A t is L (L^T t): no product with A
            closure[:size, first:end] = within[:, :last] @ rising
            closure[size:, first:end] = beside[:, :last] @ traction
        nodes = np.append(self.nodes, outside)
        gap = closure + problem.gap[nodes, None]
        rounding = PATH_ROUNDING_SHARE * np.abs(gap).max()
        gap -= np.outer(problem.mass[nodes], self.depth)
        wrong = (pressure < -PATH_ROUNDING_SHARE * pressure.max()).any(axis=0) | (gap < -rounding).any(axis=0)
        if not wrong.any():
            return size, outside[:0]
        first = int(wrong.argmax())
        return first, outside[gap[size:, first] < 0]


def _factorised(matrix: np.ndarray) -> np.ndarray:
    """The Cholesky factor of a symmetric matrix (k, k), which is overwritten. Raises `SolverError`."""
    # Its transpose is the same matrix in LAPACK's column order, without a copy.
    factor, failed = dpotrf(matrix.T, lower=True, overwrite_a=True)
    if failed:
        raise SolverError(
            "the compliance is not positive definite: an unstable finger, or a mesh too coarse for the specimen"
        )
    return factor


def _reordered(factor: np.ndarray, order: np.ndarray) -> np.ndarray | None:
    """The factor L of the same unknowns in another `order` (k,) of their present numbers; None if a new one is cheaper.

    L with its rows in the new order still gives the matrix, as L L^T, but is no triangle where unknowns change places
    among themselves. A rotation Q of the columns of such a group makes it one: L Q (L Q)^T = L L^T.
    """
    # A group ends where the unknowns so far are the first ones in both orders.
    ends = 1 + np.flatnonzero(np.maximum.accumulate(order) == np.arange(len(order)))
    groups = [(end - size, end) for end, size in zip(ends, np.diff(ends, prepend=0), strict=True) if size > 1]
    if max((end - first for first, end in groups), default=0) > WIDEST_GROUP_SHARE * len(order):
        return None
    factor = factor.T.take(order, axis=1).T  # As LAPACK has it, column by column
    for first, end in groups:
        columns = slice(first, end)
        rotation, triangle = np.linalg.qr(factor[columns, columns].T)
        factor[first:, columns] = factor[first:, columns] @ (rotation * np.sign(triangle.diagonal()))
        factor[columns, columns] = np.tril(factor[columns, columns])
    return factor
