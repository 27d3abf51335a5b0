"""Presses of `bodies` and what their gauges read: a path of rising indentation, and a linear contact of rings.

`Path` holds all forces of one scene, at small or finite strain, with or without friction. `Rings` is the linear press
without friction: the skin condensed to pressures that are linear between rings a twentieth of a millimetre apart, so
that the contact's edge and its largest pressure can be read from a smooth profile.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq, minimize_scalar
from scipy.sparse.linalg import splu

from papilla.core import settings
from papilla.core.errors import SolverError
from papilla.core.units import TINY_DIVISOR
from papilla.references.axisymmetric.bodies import SPECIMEN_SURFACE_PARAMETER, Bodies, quadratic
from papilla.references.axisymmetric.contact import Contact

PRESS_PARAMETERS = settings.parameters(__name__)


class GaugePlacement(Protocol):
    """Place and sizes of a gauge at y = 0 along x, as `papilla.model.Gauge` has them."""

    @property
    def angle_deg(self) -> float | None:
        """Site as the ellipse parameter, 0 at the apex."""

    @property
    def y_mm(self) -> float:
        """0."""

    @property
    def direction_deg(self) -> float:
        """0."""

    @property
    def length_mm(self) -> float:
        """Length of the grid."""

    @property
    def width_mm(self) -> float:
        """Width of the grid."""

    @property
    def backing_mm(self) -> tuple[float, float]:
        """Length and width of the foil."""


class InterfaceGauges:
    """Gauges, at ellipse parameters of the x-z section and along it, on the interface of `bodies`."""

    def __init__(self, bodies: Bodies, gauges: Sequence[GaugePlacement]):
        self.linear, self.count = bodies.linear, len(gauges)
        self.axes = np.array([bodies.shape.interface[0]] * 2 + [bodies.shape.interface[1]])
        offsets, shares = np.polynomial.legendre.leggauss(3)
        self.shares, ends, backings, self.outward, self.second = shares / 2, [], [], [], []
        for gauge in gauges:
            assert gauge.angle_deg is not None and not gauge.y_mm and not gauge.direction_deg
            angle = np.radians(gauge.angle_deg)
            site = self.axes * [np.sin(angle), 0, np.cos(angle)]
            outward = site / self.axes**2
            outward /= np.linalg.norm(outward)
            frame = np.array([[outward[2], 0, -outward[0]], [0, 1, 0]])
            half = np.array([-0.5, 0.5]) * gauge.length_mm
            s, t = (coordinate.ravel() for coordinate in np.meshgrid(half, offsets * gauge.width_mm / 2, indexing="ij"))
            ends.append(self._on(site + np.column_stack([s, t]) @ frame, outward))
            length, width = (
                np.linspace(-size / 2, size / 2, n)
                for size, n in zip(gauge.backing_mm, PRESS_PARAMETERS.grid, strict=True)
            )
            s, t = (coordinate.ravel() for coordinate in np.meshgrid(length, width, indexing="ij"))
            backings.append(self._on(site + np.column_stack([s, t]) @ frame, outward))
            monomials = np.column_stack([np.ones_like(s), s, t, s * s, s * t, t * t])
            self.second.append(2 * np.linalg.pinv(monomials)[3])
            self.outward.append(outward)
        self.ends = np.array(ends)
        self.points = np.concatenate([*ends, *backings])
        self.rows = self._interpolation(bodies)

    def __call__(self, displacement: np.ndarray) -> np.ndarray:
        """(2, g) strain and change of curvature (1/mm) at a displacement (nodes, 2) in mm."""
        r, z = (self.rows @ displacement).T
        positions = np.column_stack([r[:, None] * self._outwards, z])
        ends, backing = np.split(positions, [self.count * 6])
        line, change = (np.diff(points.reshape(-1, 2, 3, 3), axis=1)[:, 0] for points in (self.ends, ends))
        length = np.linalg.norm(line, axis=-1)
        moved = line + change
        longer = (line * change).sum(axis=-1) / length if self.linear else np.linalg.norm(moved, axis=-1) - length
        normal = np.einsum("gki,gi->gk", backing.reshape(self.count, -1, 3), self.outward)
        return np.array([(longer / length) @ self.shares, (normal * self.second).sum(axis=1)])

    def _on(self, points: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Points (k, 3) moved along a direction onto the interface, near where they are."""
        at, along = points / self.axes, direction / self.axes
        a, b, c = along @ along, at @ along, (at**2).sum(axis=1) - 1
        return points - (c / (b + np.sqrt(b * b - a * c)))[:, None] * direction

    def _interpolation(self, bodies: Bodies) -> sp.csr_matrix:
        """(points, nodes) values of a displacement at the points, turned into the half plane."""
        radius = np.hypot(*self.points[:, :2].T)
        self._outwards = self.points[:, :2] / np.maximum(radius, TINY_DIVISOR)[:, None]
        x = np.arctan2(radius / self.axes[0], self.points[:, 2] / self.axes[2]) * 2 / np.pi
        edges = bodies.edges(1.0)
        ends = bodies.parameters[0][edges[:, :2]]
        mate = np.clip(np.searchsorted(ends[:, 1], x), 0, len(edges) - 1)
        values = quadratic(2 * (x - ends[mate, 0]) / (ends[mate, 1] - ends[mate, 0]) - 1)[0]
        rows = np.repeat(np.arange(len(x)), 3)
        return sp.csr_matrix((values.ravel(), (rows, edges[mate].ravel())), shape=(len(x), bodies.nodes))


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
        splined = CubicSpline(scale, np.concatenate([np.zeros((1, columns.shape[1])), columns]))(np.cbrt(force))
        return splined[..., 0], splined[..., 1:].reshape(*splined.shape[:-1], *self.values.shape[1:])


def press_path(
    bodies: Bodies,
    gauges: Sequence[GaugePlacement],
    force: float,
    friction: float = 0.0,
    *,
    vertical: bool = False,
    first: float | None = None,
    growth: float = PRESS_PARAMETERS.growth,
) -> Path:
    """Press until a force (N) is passed, each indentation `growth` times the one before, from a `first` (mm) on.

    vertical : leave out that the specimen's deformation turns the pressure (`contact`).

    Raises `SolverError` where steps of an eighth do not converge.
    """
    contact, readout = Contact(bodies, friction, vertical), InterfaceGauges(bodies, gauges)
    rows: list[tuple] = []
    solution = before = np.zeros(bodies.unknowns)
    start = first or PRESS_PARAMETERS.first * bodies.shape.outer[0]
    past, now, aim = 0.0, 0.0, start
    smallest = (growth - 1) / 8
    while not rows or rows[-1][1] < force:
        slope = (solution - before) / (now - past) if now else np.zeros_like(solution)
        contact.expect(aim)
        try:
            next_solution = _equilibrium(bodies, contact, solution, slope * (aim - now), aim)
            # Sticking of the first contact depends on the points that touch next: slip grows as the radius squared
            while not now and contact.begin(next_solution):
                next_solution = _equilibrium(bodies, contact, next_solution, np.zeros_like(solution), aim)
        except SolverError:
            if not now and aim < PRESS_PARAMETERS.largest_first * start:
                # A first contact of a few points may have no equilibrium: a slightly larger one has more points
                contact, aim = Contact(bodies, friction, vertical), aim * growth
                continue
            if not now or aim - now < smallest * now:
                raise
            aim = (aim + now) / 2
            continue
        before, past, solution, now = solution, now, next_solution, aim
        contact.commit(solution, now)
        pushed = contact.forces(solution)[0][1 : 2 * bodies.nodes : 2]
        total = 2 * math.pi * abs(pushed[np.unique(contact.slave)].sum())
        radius = contact.reference[contact.touches, 0].max(initial=0.0)
        rows.append((now, total, radius, contact.shear_moment(solution), readout(bodies.displacement(solution))))
        aim = now * growth
    return Path(*(np.array(column) for column in zip(*rows, strict=True)))


def _equilibrium(bodies: Bodies, contact: Contact, solution, ahead, depth: float) -> np.ndarray:
    """The state in equilibrium at an indentation of `depth` mm, by Newton steps from `state + ahead`: the state of the
    step before and its expected change."""
    free, scale = bodies.free, bodies.scale[bodies.free]
    solution, change, turning = solution + ahead, ahead[free], False
    for number in range(PRESS_PARAMETERS.max_steps):
        try:
            inside, tangent = bodies.forces(solution)
        except FloatingPointError:
            change = change / 2
            solution[free] -= change
            continue
        # Far from equilibrium the pressure is much too large, and terms that turn with it would make cells unstable
        push, stiffness = contact.forces(solution, turning)
        residual, size = (inside + push)[free], max(float(np.linalg.norm(bodies.scale * push)), TINY_DIVISOR)
        unbalanced = float(np.linalg.norm(scale * residual))
        moved = -depth - solution[bodies.table]
        if contact.settled and not moved.any() and unbalanced <= PRESS_PARAMETERS.tolerance * size:
            return solution
        turning = unbalanced < 0.3 * size
        system = (tangent + stiffness).tocsc()
        residual = residual + system[:, bodies.table][free] @ moved
        matrix = (sp.diags(scale) @ system[:, free].tocsr()[free] @ sp.diags(scale)).tocsc()
        # Off-diagonal pivots only below a thousandth: otherwise some factors fill tenfold
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=1e-3, options={"SymmetricMode": True})
        step = np.zeros_like(solution)
        step[free] = scale * factors.solve(-scale * residual)
        if number >= PRESS_PARAMETERS.whole_steps:
            step *= _share(contact, solution, step, inside, tangent)
        solution, change = solution + step, step[free]
        solution[bodies.table] = -depth
    raise SolverError(
        f"the axisymmetric press did not converge in {PRESS_PARAMETERS.max_steps} steps at {depth:.3g} mm"
    )


def _share(
    contact: Contact, solution: np.ndarray, step: np.ndarray, inside: np.ndarray, tangent: sp.csc_matrix
) -> float:
    """Share of a step after which the unbalanced forces do no work along it, at most 1; the bodies' forces are linear.

    Whole steps may alternate between two sets of points that touch."""
    work, bend = step @ inside, step @ (tangent @ step)

    def power(share: float) -> float:
        return work + share * bend + step @ contact.push(solution + share * step)

    start, end = power(0.0), power(1.0)
    return brentq(power, 0.0, 1.0, xtol=PRESS_PARAMETERS.share) if start < 0 < end + 0.3 * start else 1.0


@dataclass(frozen=True, eq=False)
class Found:
    """Indentation (mm), area (mm2), peak pressure (MPa), and strain and curvature change (2, g) of the gauges."""

    indentation: float
    contact_area: float
    peak_pressure: float
    values: np.ndarray


class Rings:
    """The two linear bodies, factorised once; contact of any force is then a small problem."""

    def __init__(self, bodies: Bodies, gauges: Sequence[GaugePlacement]):
        self.bodies, self.readout = bodies, InterfaceGauges(bodies, gauges)
        tangent = bodies.forces(np.zeros(bodies.unknowns))[1]
        scale = sp.diags(bodies.scale)
        matrix = (scale @ tangent @ scale).tocsc()[:, bodies.free].tocsr()[bodies.free].tocsc()
        loads = self._loads()
        self.response = np.zeros((bodies.unknowns, len(self.mass)))
        free = bodies.scale[bodies.free, None]
        self.response[bodies.free] = free * splu(matrix).solve(free * loads[bodies.free])
        compliance = loads.T @ self.response
        self.compliance = (compliance + compliance.T) / 2

    def press(self, force: float) -> Found:
        """The press by a force in N."""
        pressure, indentation = self._contact(force / (2 * np.pi))
        outermost = self.radius[pressure > 0].max()
        inner, outer = (share * outermost for share in PRESS_PARAMETERS.fitted)
        near = (self.radius > inner) & (self.radius < outer)

        def fit(edge):
            height = np.maximum(1 - (self.radius[near] / edge) ** 2, 0)
            columns = np.stack([height ** (k + 0.5) for k in range(PRESS_PARAMETERS.terms)], axis=1)
            return np.linalg.lstsq(columns, pressure[near], rcond=None)[1].sum()

        edge = minimize_scalar(fit, bounds=[share * outermost for share in PRESS_PARAMETERS.edge], method="bounded").x
        inside = self.radius < PRESS_PARAMETERS.middle * edge
        middle = np.polynomial.Polynomial.fit((self.radius[inside] / edge) ** 2, pressure[inside], 2)
        peak = float(middle(np.linspace(0, PRESS_PARAMETERS.middle**2, PRESS_PARAMETERS.middle_points)).max())
        values = self.readout(self.bodies.displacement(self.response @ pressure))
        return Found(indentation, float(np.pi * edge**2), peak, values)

    def _contact(self, force: float) -> tuple[np.ndarray, float]:
        """Pressures (n,) under a force over 2 pi, and the indentation (mm), by exchange of whole active sets."""
        active = np.arange(len(self.mass)) < 8
        for _ in range(100):
            size = int(active.sum())
            system = np.zeros((size + 1, size + 1))
            system[:size, :size] = self.compliance[np.ix_(active, active)]
            system[:size, size] = -self.mass[active]
            system[size, :size] = self.mass[active]
            solution = np.linalg.solve(system, np.append(-self.gap[active], force))
            pressure = np.zeros(len(active))
            pressure[active] = solution[:size]
            apart = self.compliance @ pressure + self.gap - solution[size] * self.mass
            before, active = active, np.where(active, pressure > 0, apart < 0)
            if (active == before).all():
                return pressure, float(solution[size])
        raise SolverError(f"the rings' contact did not settle at {2 * np.pi * force:.3g} N")

    def _loads(self) -> np.ndarray:
        """(unknowns, n) of unit ring pressures on both bodies; and `radius`, `mass` and `gap` (n,), all over 2 pi."""
        bodies = self.bodies
        places = bodies.mesh.doflocs.T
        edges, masters = bodies.edges(2.0), bodies.edges(SPECIMEN_SURFACE_PARAMETER)
        reach = min(PRESS_PARAMETERS.reach * bodies.shape.outer[0], bodies.shape.width)
        edges = edges[places[edges[:, 1], 0] < reach]
        s, gauss = np.polynomial.legendre.leggauss(6)
        hats = np.stack([1 - s, 1 + s]) / 2
        shapes, slopes = quadratic(s)
        radius, weights = (places[edges, 0] @ basis.T for basis in (shapes, slopes))
        weights = weights * gauss * radius
        outer, height = bodies.shape.outer
        gap = height * (1 - np.sqrt(1 - (radius / outer) ** 2)) + bodies.shape.height(radius)
        start, end = places[masters[:, 0], 0], places[masters[:, 1], 0]
        mate = np.searchsorted(end, radius)
        specimen = quadratic(2 * (radius - start[mate]) / (end - start)[mate] - 1)[0]
        rings = np.append(edges[:, 0], edges[-1, 1])
        loads, (self.mass, self.gap) = np.zeros((bodies.unknowns, len(rings))), np.zeros((2, len(rings)))
        for k, hat in enumerate(hats):
            ring = np.arange(len(edges)) + k
            np.add.at(self.mass, ring, (weights * hat).sum(axis=1))
            np.add.at(self.gap, ring, (weights * hat * gap).sum(axis=1))
            for a in range(3):
                np.add.at(loads, (2 * edges[:, a] + 1, ring), -(weights * hat * shapes[:, a]).sum(axis=1))
                at = (2 * masters[mate, a] + 1, np.broadcast_to(ring[:, None], mate.shape))
                np.add.at(loads, at, weights * hat * specimen[..., a])
        self.radius = places[rings, 0]
        return loads
