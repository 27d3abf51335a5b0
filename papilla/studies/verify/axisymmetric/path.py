"""The press of `bodies`: contact by penalty at Gauss points of the skin, without friction or stuck.

Without friction a point is pushed along the normal of the specimen where it is nearest; stuck, it is tied to the point
of the specimen that it met first. The penalty takes less than a thousandth of the indentation.
"""

import warnings
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import CubicSpline

from papilla.errors import SolverError
from papilla.fem.discrete.solver import factorise
from papilla.studies.verify.axisymmetric.bodies import APART, Bodies, quadratic

PENALTY = 3e3
"""Of the contact, in moduli of the finger per mm."""
GAUSS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(3)
TOLERANCE, MAX_STEPS = 1e-7, 25


@dataclass(frozen=True, eq=False)
class Path:
    """Presses at rising indentation, k of them: indentation (k,) mm, force (k,) N, contact radius (k,) mm, and
    elongation (k, g) of the gauges."""

    indentation: np.ndarray
    force: np.ndarray
    radius: np.ndarray
    strain: np.ndarray

    def at(self, force: float) -> np.ndarray:
        """Indentation, radius and elongations (2 + g,) at a force (N) within the path, by a cubic through it."""
        columns = np.column_stack([self.indentation, self.radius, self.strain])
        zero = np.zeros((1, columns.shape[1]))
        return CubicSpline(np.append(0, self.force ** (1 / 3)), np.concatenate([zero, columns]))(force ** (1 / 3))


class Contact:
    """Gauss points of the skin against the specimen's surface; which are tied, and where, is its state."""

    def __init__(self, bodies: Bodies, stick: bool):
        self.bodies, self.stick = bodies, stick
        self.penalty = PENALTY * bodies.cards[0].material.modulus
        edges = bodies.edges(2.0)
        edges = edges[bodies.mesh.doflocs[0, edges[:, 1]] < 0.6 * bodies.shape.outer[0]]
        self.masters = bodies.edges(APART)
        places = bodies.mesh.doflocs.T
        self.hats, slopes = quadratic(np.tile(GAUSS, len(edges)))
        self.slave = np.repeat(edges, len(GAUSS), axis=0)
        self.reference = np.einsum("ka,kai->ki", self.hats, places[self.slave])
        tangent = np.einsum("ka,kai->ki", slopes, places[self.slave])
        weights = np.tile(GAUSS_WEIGHTS, len(edges)) * np.linalg.norm(tangent, axis=1)
        self.weights = weights * self.reference[:, 0]
        self.tied = np.zeros(len(self.slave), dtype=bool)
        self.mate = np.zeros(len(self.slave), dtype=int)
        self.at = np.zeros(len(self.slave))

    def forces(self, unknowns: np.ndarray, turning: float = 1.0) -> tuple[np.ndarray, sp.coo_matrix, np.ndarray]:
        """Forces (unknowns,) and tangent of the contact, and which points touch.

        `turning` weighs the part of the tangent by which pressure turns with the surface.
        """
        bodies = self.bodies
        places = bodies.mesh.doflocs.T + bodies.displacement(unknowns)
        if bodies.linear:
            mate, s, gap, slope, bend = self._undeformed(places)
        else:
            skin = np.einsum("ka,kai->ki", self.hats, places[self.slave])
            mate, s = nearest(skin, places, self.masters)
            gap, slope, bend = gap_derivatives(skin, places[self.masters[mate]], s)
        pull, stiffness = self.penalty * gap[:, None] * slope, slope[:, :, None] * slope[:, None, :]
        stiffness = self.penalty * (stiffness + (gap * turning)[:, None, None] * bend)
        mate, s = np.where(self.tied, self.mate, mate), np.where(self.tied, self.at, s)
        if self.tied.any():
            skin = np.einsum("ka,kai->ki", self.hats, places[self.slave])
            values = quadratic(s)[0]
            apart = skin - np.einsum("ka,kai->ki", values, places[self.masters[mate]])
            jump = np.concatenate([np.ones((len(s), 1)), -values], axis=1)
            pull = np.where(self.tied[:, None], self.penalty * _interleaved(jump, apart), pull)
            square = np.einsum("ka,kb,ij->kaibj", jump, jump, np.eye(2)).reshape(-1, 8, 8)
            stiffness = np.where(self.tied[:, None, None], self.penalty * square, stiffness)
        touches = gap < 0
        self._last = touches, mate, s
        weights = self.weights * touches
        spread, numbers = self._spread(mate)
        force = np.einsum("k,kn,knu->ku", weights, pull, spread)
        blocks = np.einsum("k,knu,knm,kmv->kuv", weights, spread, stiffness, spread, optimize=True)
        rows, columns = np.broadcast_arrays(numbers[:, :, None], numbers[:, None, :])
        matrix = sp.coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(bodies.unknowns,) * 2)
        return np.bincount(numbers.ravel(), force.ravel(), bodies.unknowns), matrix, touches

    def commit(self) -> None:
        """Tie the points that touch where they are, and release those that do not, at the end of a step."""
        if not self.stick:
            return
        touches, mate, s = self._last
        new = touches & ~self.tied
        self.mate[new], self.at[new] = mate[new], s[new]
        self.tied = touches

    def _undeformed(self, places):
        """As `nearest` and `gap_derivatives`, straight up on the undeformed shape: the gap is linear."""
        before = self.bodies.mesh.doflocs.T
        above = np.column_stack([self.reference[:, 0], np.full(len(self.slave), before[self.masters[0, 0], 1])])
        mate, s = nearest(above, before, self.masters)
        slope = np.concatenate([-np.ones((len(s), 1)), quadratic(s)[0]], axis=1)
        slope = _interleaved(slope, np.tile([0.0, 1.0], (len(s), 1)))
        skin = np.einsum("ka,kai->ki", self.hats, places[self.slave])
        local = np.concatenate([skin[:, None], places[self.masters[mate]]], axis=1).reshape(-1, 8)
        return mate, s, (slope * local).sum(axis=1), slope, np.zeros((len(s), 8, 8))

    def _spread(self, mate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(k, 8, 12) local variables by unknowns, and the numbers (k, 12) of these."""
        spread = np.zeros((len(mate), 8, 12))
        for component in range(2):
            spread[:, component, component:6:2] = self.hats
        spread[:, 2:, 6:] = np.eye(6)
        nodes = np.concatenate([self.slave, self.masters[mate]], axis=1)
        return spread, (2 * nodes[:, :, None] + np.arange(2)).reshape(-1, 12)


def press_path(bodies: Bodies, indentation: float, steps: int, stick: bool = False) -> Path:
    """Press to an indentation (mm) in `steps` that grow.

    Raises `SolverError` where steps of an eighth do not converge.
    """
    contact, state, rows = Contact(bodies, stick), np.zeros(bodies.unknowns), []
    depths = list(indentation * (np.arange(1, steps + 1) / steps) ** 1.5)
    before, reached = state, np.zeros(2)
    while depths:
        slope = (state - before) / (reached[1] - reached[0]) if reached[1] else np.zeros_like(state)
        try:
            found = _equilibrium(bodies, contact, state, slope * (depths[0] - reached[1]), depths[0])
        except SolverError:
            if depths[0] - reached[1] < indentation / steps / 8:
                raise
            depths.insert(0, (depths[0] + reached[1]) / 2)
            continue
        state, before, reached = found, state, np.array([reached[1], depths.pop(0)])
        force, _, touches = contact.forces(state)
        contact.commit()
        total = 2 * np.pi * abs(force[1 : 2 * bodies.nodes : 2][np.unique(contact.slave)].sum())
        radius = contact.reference[touches, 0].max(initial=0.0)
        rows.append((reached[1], total, radius, *bodies.strain(state)))
    table = np.array(rows)
    return Path(table[:, 0], table[:, 1], table[:, 2], table[:, 3:])


def _equilibrium(bodies: Bodies, contact: Contact, state, ahead, depth: float) -> np.ndarray:
    """Equilibrium at an indentation (mm) from a state before it, `ahead` being the change that is expected."""
    free, pressures = bodies.free, bodies.pressures
    # Rid of units: displacements in mm against pressures in moduli of the finger
    scale = np.where(np.arange(bodies.unknowns) < 2 * bodies.nodes, 1.0, bodies.cards[0].material.modulus)[free]
    state, change, turning = state + ahead, ahead[free], 0.0
    for _ in range(MAX_STEPS):
        try:
            inside, tangent = bodies.forces(state)
        except FloatingPointError:
            change = change / 2
            state[free] -= change
            continue
        # Far from equilibrium the pressure is out of all proportion, and what turns with it would make cells unstable
        push, stiffness, _ = contact.forces(state, turning)
        residual, size = (inside + push)[free], max(float(np.linalg.norm(push)), 1e-300)
        moved = -depth - state[bodies.table]
        if not moved.any() and np.linalg.norm(residual) <= TOLERANCE * size:
            return state
        turning = float(np.linalg.norm(residual) < 0.3 * size)
        whole = tangent + sp.tril(stiffness).tocsc()
        residual = residual + whole[bodies.table][:, free].T @ moved + whole[:, bodies.table][free] @ moved
        matrix = (sp.diags(scale) @ whole[:, free].tocsr()[free] @ sp.diags(scale)).tocsc()
        with warnings.catch_warnings():
            # On the way to equilibrium a tangent may be unstable: another engine factors it
            warnings.simplefilter("ignore")
            change = scale * factorise(matrix, pressures).solve(-(scale * residual)[:, None])[:, 0]
        state = state.copy()
        state[free] += change
        state[bodies.table] = -depth
    raise SolverError(f"the axisymmetric press did not converge in {MAX_STEPS} steps at {depth:.3g} mm")


def nearest(points: np.ndarray, places: np.ndarray, masters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edge (k,) and coordinate s (k,) on it that are nearest to points (k, 2)."""
    ends = places[masters[:, 1], 0]
    mate = np.clip(np.searchsorted(ends, points[:, 0]), 0, len(masters) - 1)
    for _ in range(4):
        s = _foot(points, places[masters[mate]], np.zeros(len(points)))
        step = np.where(s > 1, 1, np.where(s < -1, -1, 0))
        moved = np.clip(mate + step, 0, len(masters) - 1)
        if (moved == mate).all():
            break
        mate = moved
    return mate, s


def gap_derivatives(points: np.ndarray, corners: np.ndarray, s: np.ndarray):
    """Distance (k,) of points (k, 2) below edges (k, 3, 2), its gradient (k, 8) and second derivatives (k, 8, 8).

    The gradient is the edge's normal, weighted; the second derivatives are exact, by complex steps of the gradient.
    """
    local = np.concatenate([points[:, None], corners], axis=1).reshape(-1, 8)
    gap, slope = _gap(local.astype(complex), s)
    bend = np.empty((len(points), 8, 8))
    for k in range(8):
        step = local.astype(complex)
        step[:, k] += 1e-30j
        bend[:, :, k] = _gap(step, s)[1].imag / 1e-30
    return gap.real, slope.real, bend


def _gap(local: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    points, corners = local[:, :2], local[:, 2:].reshape(-1, 3, 2)
    s = _foot(points, corners, s, 3)
    values, slopes = quadratic(s)
    tangent = np.einsum("ka,kai->ki", slopes, corners)
    normal = np.column_stack([tangent[:, 1], -tangent[:, 0]]) / np.sqrt((tangent**2).sum(axis=1))[:, None]
    gap = ((points - np.einsum("ka,kai->ki", values, corners)) * normal).sum(axis=1)
    return gap, _interleaved(np.concatenate([np.ones((len(s), 1)), -values], axis=1), normal)


def _foot(points: np.ndarray, corners: np.ndarray, s: np.ndarray, steps: int = 12) -> np.ndarray:
    """s (k,) where the edge's tangent is at right angles to the way to the point, by Newton's method."""
    second = np.array([1.0, 1.0, -2.0])
    for _ in range(steps):
        values, slopes = quadratic(s)
        away = points - np.einsum("ka,kai->ki", values, corners)
        tangent, bend = np.einsum("ka,kai->ki", slopes, corners), np.einsum("a,kai->ki", second, corners)
        s = s + (away * tangent).sum(axis=1) / ((tangent**2).sum(axis=1) - (away * bend).sum(axis=1))
    return s


def _interleaved(weights: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """(k, 2 a): component-wise products of weights (k, a) and vectors (k, 2)."""
    return (weights[:, :, None] * vector[:, None, :]).reshape(len(vector), -1)
