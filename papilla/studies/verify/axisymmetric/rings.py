"""Contact without friction or large strain of `bodies`: the skin condensed to pressures on rings.

The problem that the 3-D press solves, by another mesh and element: pressure linear between rings a twentieth of a
millimetre apart, so that the contact's edge and its largest pressure can be read from a smooth profile.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.optimize import minimize_scalar
from scipy.sparse.linalg import splu

from papilla.errors import SolverError
from papilla.finger import Gauge
from papilla.studies.verify.axisymmetric.bodies import APART, Bodies, quadratic
from papilla.studies.verify.axisymmetric.readout import Readout

REACH = 0.35  # Share of the skin's radius up to which it may be touched
TERMS = 4  # Of the profile sqrt(1 - x^2) (c_0 + c_1 (1 - x^2) + ...)
FITTED = (0.2, 0.93)  # Share of the contact's radius in which it is fitted: near the edge a ring sees half of itself


@dataclass(frozen=True, eq=False)
class Found:
    """Indentation (mm), area (mm2), peak pressure (MPa), and strain and curvature change (2, g) of the gauges."""

    indentation: float
    contact_area: float
    peak_pressure: float
    values: np.ndarray


class Rings:
    """The two linear bodies, factorised once; contact of any force is then a small problem."""

    def __init__(self, bodies: Bodies, gauges: Sequence[Gauge]):
        self.bodies, self.readout = bodies, Readout(bodies, gauges)
        whole = bodies.forces(np.zeros(bodies.unknowns))[1]
        scale = np.where(np.arange(bodies.unknowns) < 2 * bodies.nodes, 1.0, bodies.rubbers[0].modulus)
        matrix = (sp.diags(scale) @ whole @ sp.diags(scale)).tocsc()[:, bodies.free].tocsr()[bodies.free].tocsc()
        loads = self._loads()
        self.response = np.zeros((bodies.unknowns, len(self.mass)))
        free = scale[bodies.free, None]
        self.response[bodies.free] = free * splu(matrix).solve(free * loads[bodies.free])
        compliance = loads.T @ self.response
        self.compliance = (compliance + compliance.T) / 2

    def press(self, force: float) -> Found:
        """The press by a force in N."""
        pressure, indentation = self._contact(force / (2 * np.pi))
        outermost = self.radius[pressure > 0].max()
        near = (self.radius > FITTED[0] * outermost) & (self.radius < FITTED[1] * outermost)

        def fit(edge):
            height = np.maximum(1 - (self.radius[near] / edge) ** 2, 0)
            columns = np.stack([height ** (k + 0.5) for k in range(TERMS)], axis=1)
            return np.linalg.lstsq(columns, pressure[near], rcond=None)[1].sum()

        edge = minimize_scalar(fit, bounds=(0.97 * outermost, 1.06 * outermost), method="bounded").x
        inside = self.radius < 0.4 * edge
        middle = np.polynomial.Polynomial.fit((self.radius[inside] / edge) ** 2, pressure[inside], 2)
        peak = float(middle(np.linspace(0, 0.16, 50)).max())
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
            found = np.linalg.solve(system, np.append(-self.gap[active], force))
            pressure = np.zeros(len(active))
            pressure[active] = found[:size]
            apart = self.compliance @ pressure + self.gap - found[size] * self.mass
            before, active = active, np.where(active, pressure > 0, apart < 0)
            if (active == before).all():
                return pressure, float(found[size])
        raise SolverError(f"the rings' contact did not settle at {2 * np.pi * force:.3g} N")

    def _loads(self) -> np.ndarray:
        """(unknowns, n) of unit ring pressures on both bodies; and `radius`, `mass` and `gap` (n,), all over 2 pi."""
        bodies = self.bodies
        places = bodies.mesh.doflocs.T
        edges, masters = bodies.edges(2.0), bodies.edges(APART)
        edges = edges[places[edges[:, 1], 0] < REACH * bodies.shape.outer[0]]
        s, gauss = np.polynomial.legendre.leggauss(6)
        hats = np.stack([1 - s, 1 + s]) / 2
        shapes, slopes = quadratic(s)
        radius, weights = (places[edges, 0] @ part.T for part in (shapes, slopes))
        weights = weights * gauss * radius
        outer, height = bodies.shape.outer
        gap = height * (1 - np.sqrt(1 - (radius / outer) ** 2))
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
