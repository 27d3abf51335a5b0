"""Readout of gauges on the interface of a finger of revolution: elongation and change of curvature.

Strain is the mean elongation of three lines along the grid, each between two interface points a grid length apart;
curvature change is the second derivative of the paraboloid that fits the outward displacement over the foil's backing.
The points lie on the whole interface, the displacement being turned about the axis, so that the hoop direction counts.
"""

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from papilla.finger import Gauge
from papilla.studies.verify.axisymmetric.bodies import Bodies, quadratic
from papilla.units import TINY

GRID = (9, 5)
"""Points of the backing along and across the grid."""


class Readout:
    """Gauges, at ellipse parameters of the x-z section and along it, on the interface of `bodies`."""

    def __init__(self, bodies: Bodies, gauges: Sequence[Gauge]):
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
            s, t = (part.ravel() for part in np.meshgrid(half, offsets * gauge.width_mm / 2, indexing="ij"))
            ends.append(self._on(site + np.column_stack([s, t]) @ frame, outward))
            length, width = (
                np.linspace(-size / 2, size / 2, n) for size, n in zip(gauge.backing_mm, GRID, strict=True)
            )
            s, t = (part.ravel() for part in np.meshgrid(length, width, indexing="ij"))
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
        there = np.column_stack([r[:, None] * self._outwards, z])
        ends, backing = np.split(there, [self.count * 6])
        line, change = (np.diff(part.reshape(-1, 2, 3, 3), axis=1)[:, 0] for part in (self.ends, ends))
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
        self._outwards = self.points[:, :2] / np.maximum(radius, TINY)[:, None]
        x = np.arctan2(radius / self.axes[0], self.points[:, 2] / self.axes[2]) * 2 / np.pi
        edges = bodies.edges(1.0)
        ends = bodies.parameters[0][edges[:, :2]]
        mate = np.clip(np.searchsorted(ends[:, 1], x), 0, len(edges) - 1)
        values = quadratic(2 * (x - ends[mate, 0]) / (ends[mate, 1] - ends[mate, 0]) - 1)[0]
        rows = np.repeat(np.arange(len(x)), 3)
        return sp.csr_matrix((values.ravel(), (rows, edges[mate].ravel())), shape=(len(x), bodies.nodes))
