"""Skin against specimen: penalty at Gauss points of the skin, with Coulomb's friction along the specimen's surface.

A point x of the skin is projected onto the specimen's deformed edge y(s) (normal n, tangent t): gap g = (x - y).n, and
w, the distance along the specimen's undeformed surface from its anchor, where it first touched. The skin's traction is
-k g n - k w t with |w| <= mu |g|; where it slips, the anchor follows at the end of a load step. Stick is infinite mu. A
point's place of first touch is extrapolated from the two states before a step. If it were the place at the end of the
step, the point would have slid without friction for half of the step on average, an error of first order. ADR 0026
states the remaining error with stick. With 72,000 moduli over the finger's half breadth the penalty takes less than a
thousandth of the indentation.

A vertical contact leaves out that the specimen's deformation turns the pressure: a point meets what is straight above
it at rest, y(s) with s fixed; n = (0, -1), t = (1, 0), and w = (x - y).t plus the place on the undeformed surface.
Without friction both contacts are derivatives of the energy int k g^2 / 2 over the skin where g < 0.
"""

import numpy as np
import scipy.sparse as sp

from papilla.references.axisymmetric.bodies import SPECIMEN_SURFACE_PARAMETER, Bodies, quadratic

PENALTY_MODULI_PER_BREADTH = 7.2e4
"""Penalty in moduli of the skin over the finger's half breadth."""
SKIN_REACH, TOP_REACH = 0.75, 0.98
"""Radii over the finger's half breadth, and over the specimen's, up to which the skin may touch."""
FIRST_SLIP_TOLERANCE = 0.02
"""Relative change of the slip of a first contact below which it has converged."""
IMAGINARY_STEP = 1e-30
"""Step of a derivative by a complex variable: its square is lost in rounding when added to 1."""
LOCAL_COORDINATES, EDGE_DISPLACEMENTS = 8, 12
"""Coordinates of a point of the skin and its edge's three nodes; displacement unknowns of both edges."""
GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(3)


class Contact:
    """k Gauss points of the skin against the specimen's surface; where they are anchored is its state.

    vertical : the pressure is vertical, as it always is between `linear` bodies, which have no friction.
    """

    def __init__(self, bodies: Bodies, friction: float = 0.0, vertical: bool = False):
        assert not (bodies.linear and friction), "friction is for bodies at finite strain"
        assert not vertical or np.isinf(bodies.shape.ball), "the pressure of a ball is not vertical"
        self.bodies, self.friction, self.vertical = bodies, friction, vertical or bodies.linear
        self.penalty = PENALTY_MODULI_PER_BREADTH * bodies.rubbers[0].modulus / bodies.shape.outer[0]
        places, edges = bodies.mesh.doflocs.T, bodies.edges(2.0)
        reach = min(SKIN_REACH * bodies.shape.outer[0], TOP_REACH * bodies.shape.width)
        edges = edges[places[edges[:, 1], 0] < reach]
        self.masters = bodies.edges(SPECIMEN_SURFACE_PARAMETER)
        self.ends = bodies.shape.along(places[self.masters[:, :2], 0])
        self.hats, slopes = quadratic(np.tile(GAUSS_POINTS, len(edges)))
        self.slave = np.repeat(edges, len(GAUSS_POINTS), axis=0)
        self.reference = np.einsum("ka,kai->ki", self.hats, places[self.slave])
        tangent = np.einsum("ka,kai->ki", slopes, places[self.slave])
        weights = np.tile(GAUSS_WEIGHTS, len(edges)) * np.linalg.norm(tangent, axis=1)
        self.weights = weights * self.reference[:, 0]
        self.touches = np.zeros(len(self.slave), dtype=bool)
        self.slides, self.settled = np.zeros(len(self.slave)), True
        self._begun: list[tuple[float, float]] = []
        at_rest = np.zeros(bodies.unknowns)
        _, _, gap, self.anchor = self._met(at_rest)
        self.now: tuple[float, np.ndarray, np.ndarray] = (0.0, gap, self.anchor)
        self.before = self.now

    def forces(self, unknowns: np.ndarray, turning: bool = True) -> tuple[np.ndarray, sp.coo_matrix]:
        """Forces (unknowns,) and tangent of the contact; without `turning` its directions are fixed in the tangent."""
        mate, s, gap, place = self._met(unknowns)
        away = place - self.anchor
        slides = np.where((gap < 0) & (np.abs(away) > -self.friction * gap), np.sign(away), 0.0)
        self.settled = not self.friction or bool((slides == self.slides).all())
        # A point that reverses its slip sticks first: its traction may lie anywhere between the two limits
        self.slides = np.where(slides == -self.slides, 0.0, slides)
        local = self._local(unknowns, mate)
        stiffness = np.empty((len(s), LOCAL_COORDINATES, LOCAL_COORDINATES))
        for k in range(LOCAL_COORDINATES):
            step = local.astype(complex)
            step[:, k] += IMAGINARY_STEP * 1j
            stiffness[:, :, k] = self._pull(step, mate, s, turning)[0].imag / IMAGINARY_STEP
        weights = self.penalty * self.weights * (gap < 0)
        spread, numbers = self._spread(mate)
        blocks = spread.swapaxes(-1, -2) @ (weights[:, None, None] * stiffness) @ spread
        rows, columns = np.broadcast_arrays(numbers[:, :, None], numbers[:, None, :])
        matrix = sp.coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(self.bodies.unknowns,) * 2)
        return self.push(unknowns), matrix

    def push(self, unknowns: np.ndarray) -> np.ndarray:
        """Forces (unknowns,) of the contact, where the points that slip are those of the last `forces`."""
        mate, s, gap, _ = self._met(unknowns)
        pull = self._pull(self._local(unknowns, mate), mate, s)[0]
        spread, numbers = self._spread(mate)
        force = np.einsum("k,kn,knu->ku", self.penalty * self.weights * (gap < 0), pull, spread)
        return np.bincount(numbers.ravel(), force.ravel(), self.bodies.unknowns)

    def commit(self, unknowns: np.ndarray, depth: float) -> None:
        """End a load step at an indentation (mm): anchors of slipping points move along."""
        mate, s, gap, place = self._met(unknowns)
        slip = self._pull(self._local(unknowns, mate), mate, s)[2]
        self.touches = gap < 0
        self.before, self.now = self.now, (depth, gap, place)
        self.anchor = place - slip

    def expect(self, depth: float) -> None:
        """Place the anchors of points that do not touch yet at their expected places of first touch, for an indentation
        (mm)."""
        (d0, gap0, place0), (d1, gap1, place1) = self.before, self.now
        if d1 == d0:
            return
        closing = np.minimum(gap1 - gap0, -1e-12 * (d1 - d0))
        share = np.clip(-gap1 / closing, 0, (depth - d1) / (d1 - d0))
        self.anchor = np.where(self.touches, self.anchor, place1 + share * (place1 - place0))

    def begin(self, unknowns: np.ndarray) -> bool:
        """Place the anchors of a first contact as if it had grown from a point; returns whether they moved.

        The growing contact is self-similar: a point at r has slipped by c r^2 when it touches. c is that of the first
        point outside the contact.
        """
        _, _, gap, place = self._met(unknowns)
        beyond = int(np.argmax(gap >= 0))
        rest = self.now[2]
        share = (rest / rest[beyond]) ** 2
        slipped, had = (place - rest)[beyond], (self.anchor - rest)[beyond]
        self._begun.append((had, slipped - had))
        if not self.friction or abs(slipped - had) <= FIRST_SLIP_TOLERANCE * abs(slipped):
            return False
        # Its slip follows the assumed one almost one to one, because its neighbours stick: hence the secant method
        aim = slipped
        if len(self._begun) > 1:
            (x0, y0), (x1, y1) = self._begun[-2:]
            aim = x1 - y1 * (x1 - x0) / (y1 - y0)
        self.anchor = rest + aim * share
        return True

    def shear_moment(self, unknowns: np.ndarray) -> float:
        """int q r dA (N mm) of the tangential traction q, outwards on the skin."""
        mate, s, gap, _ = self._met(unknowns)
        slip = self._pull(self._local(unknowns, mate), mate, s)[2]
        return float(-2 * np.pi * self.penalty * (self.weights * slip * self.reference[:, 0])[gap < 0].sum())

    def _met(self, unknowns: np.ndarray) -> tuple[np.ndarray, ...]:
        """Edge (k,), coordinate on it, gap and place along the specimen (mm), where the points are nearest to it."""
        places = self.bodies.mesh.doflocs.T
        if self.vertical:
            start, end = places[self.masters[:, :2], 0].T
            mate = np.searchsorted(end, self.reference[:, 0])
            s = 2 * (self.reference[:, 0] - start[mate]) / (end - start)[mate] - 1
        else:
            places = places + self.bodies.displacement(unknowns)
            mate, s = nearest(np.einsum("ka,kai->ki", self.hats, places[self.slave]), places, self.masters)
        return mate, s, *self._pull(self._local(unknowns, mate), mate, s)[1::2]

    def _local(self, unknowns: np.ndarray, mate: np.ndarray) -> np.ndarray:
        """(k, 8) places of the points and of the three nodes of their edges."""
        places = self.bodies.mesh.doflocs.T + self.bodies.displacement(unknowns)
        skin = np.einsum("ka,kai->ki", self.hats, places[self.slave])
        return np.concatenate([skin[:, None], places[self.masters[mate]]], axis=1).reshape(-1, LOCAL_COORDINATES)

    def _pull(self, local: np.ndarray, mate: np.ndarray, s: np.ndarray, turning: bool = True):
        """Forces (k, 8) over the penalty, gap, slip within the friction, and place along the specimen (k,), in mm.

        `s` is the real foot; complex `local` gives derivatives.
        """
        points, corners = local[:, :2], local[:, 2:].reshape(-1, 3, 2)
        normal, tangent = np.array([0.0, -1.0]), np.array([1.0, 0.0])
        if not self.vertical:
            s = _foot(points, corners, s, 3)
            along = np.einsum(
                "ka,kai->ki", quadratic(s if turning else s.real)[1], corners if turning else corners.real
            )
            tangent = along / np.sqrt((along**2).sum(axis=1))[:, None]
            normal = np.column_stack([tangent[:, 1], -tangent[:, 0]])
        hats = quadratic(s)[0]
        start, end = self.ends[mate].T
        away = points - np.einsum("ka,kai->ki", hats, corners)
        gap = (away * normal).sum(axis=1)
        place = (start + end) / 2 + s * (end - start) / 2 + (away[:, 0] if self.vertical else 0.0)
        slip = np.zeros_like(gap)
        if self.friction and hasattr(self, "anchor"):
            slip = place - self.anchor
            if np.isfinite(self.friction):
                slip = np.where(self.slides, -self.slides * self.friction * gap, slip)
        vector = gap[:, None] * normal + slip[:, None] * tangent
        jump = np.concatenate([np.ones((len(s), 1)), -(hats if turning else hats.real)], axis=1)
        return (jump[:, :, None] * vector[:, None, :]).reshape(-1, LOCAL_COORDINATES), gap, slip, place

    def _spread(self, mate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(k, 8, 12) local variables by unknowns, and the numbers (k, 12) of these."""
        spread = np.zeros((len(mate), LOCAL_COORDINATES, EDGE_DISPLACEMENTS))
        for component in range(2):
            spread[:, component, component : EDGE_DISPLACEMENTS // 2 : 2] = self.hats
        spread[:, 2:, EDGE_DISPLACEMENTS // 2 :] = np.eye(LOCAL_COORDINATES - 2)
        nodes = np.concatenate([self.slave, self.masters[mate]], axis=1)
        return spread, (2 * nodes[:, :, None] + np.arange(2)).reshape(-1, EDGE_DISPLACEMENTS)


def nearest(points: np.ndarray, places: np.ndarray, masters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edge (k,) and coordinate s (k,) on it that are nearest to points (k, 2)."""
    mate = np.linalg.norm(points[:, None] - places[masters[:, 2]], axis=-1).argmin(axis=1)
    for _ in range(4):
        s = _foot(points, places[masters[mate]], np.zeros(len(points)))
        moved = np.clip(mate + np.where(s > 1, 1, np.where(s < -1, -1, 0)), 0, len(masters) - 1)
        if (moved == mate).all():
            break
        mate = moved
    return mate, s


def _foot(points: np.ndarray, corners: np.ndarray, s: np.ndarray, steps: int = 12) -> np.ndarray:
    """s (k,) where the edge's tangent is at right angles to the way to the point, by Newton's method."""
    second = np.array([1.0, 1.0, -2.0])
    for _ in range(steps):
        values, slopes = quadratic(s)
        away = points - np.einsum("ka,kai->ki", values, corners)
        tangent, bend = np.einsum("ka,kai->ki", slopes, corners), np.einsum("a,kai->ki", second, corners)
        s = s + (away * tangent).sum(axis=1) / ((tangent**2).sum(axis=1) - (away * bend).sum(axis=1))
    return s
