"""Contact without friction or large strain of `bodies`: the skin condensed to pressures on rings.

The problem that the 3-D press solves, by another mesh and element: pressure linear between rings a twentieth of a
millimetre apart, so that the contact's edge and its largest pressure can be read from a smooth profile.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.optimize import minimize_scalar

from papilla.fem.discrete.solver import factorise
from papilla.fem.pressing.contact import solve_contact
from papilla.studies.verify.axisymmetric.bodies import APART, Bodies, quadratic

REACH = 9.0  # Radius (mm) up to which the skin may be touched
TERMS = 4  # Of the profile sqrt(1 - x^2) (c_0 + c_1 (1 - x^2) + ...)
FITTED = (0.2, 0.93)  # Share of the contact's radius in which it is fitted: near the edge a ring sees half of itself


@dataclass(frozen=True, eq=False)
class Found:
    """Indentation (mm), area (mm2), peak pressure (MPa), and elongation (3,) of gauges 3, 4 and 5."""

    indentation: float
    contact_area: float
    peak_pressure: float
    strain: np.ndarray


class Rings:
    """The two linear bodies, factorised once; contact of any force is then a small problem."""

    def __init__(self, bodies: Bodies):
        self.bodies = bodies
        whole = bodies.forces(np.zeros(bodies.unknowns))[1]
        scale = np.where(np.arange(bodies.unknowns) < 2 * bodies.nodes, 1.0, bodies.cards[0].material.modulus)
        matrix = (sp.diags(scale) @ whole @ sp.diags(scale)).tocsc()[:, bodies.free].tocsr()[bodies.free].tocsc()
        loads = self._loads()
        self.response = np.zeros((bodies.unknowns, len(self.mass)))
        free = scale[bodies.free, None]
        self.response[bodies.free] = free * factorise(matrix, bodies.pressures).solve(free * loads[bodies.free])
        compliance = loads.T @ self.response
        self.compliance = (compliance + compliance.T) / 2

    def press(self, force: float) -> Found:
        """The press by a force in N."""
        solved = solve_contact(self.compliance, self.mass, self.gap, force=force / (2 * np.pi))
        pressure, outermost = solved.pressure, self.radius[solved.pressure > 0].max()
        near = (self.radius > FITTED[0] * outermost) & (self.radius < FITTED[1] * outermost)

        def fit(edge):
            height = np.maximum(1 - (self.radius[near] / edge) ** 2, 0)
            columns = np.stack([height ** (k + 0.5) for k in range(TERMS)], axis=1)
            return np.linalg.lstsq(columns, pressure[near], rcond=None)[1].sum()

        edge = minimize_scalar(fit, bounds=(0.97 * outermost, 1.06 * outermost), method="bounded").x
        inside = self.radius < 0.4 * edge
        middle = np.polynomial.Polynomial.fit((self.radius[inside] / edge) ** 2, pressure[inside], 2)
        peak = float(middle(np.linspace(0, 0.16, 50)).max())
        strain = self.bodies.strain(self.response @ pressure)
        return Found(solved.indentation, float(np.pi * edge**2), peak, strain)

    def _loads(self) -> np.ndarray:
        """(unknowns, n) of unit ring pressures on both bodies; and `radius`, `mass` and `gap` (n,), all over 2 pi."""
        bodies = self.bodies
        places = bodies.mesh.doflocs.T
        edges, masters = bodies.edges(2.0), bodies.edges(APART)
        edges = edges[places[edges[:, 1], 0] < REACH]
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
