"""Readings of the gauges of a finitely deformed finger: true elongation of the chord, curvature as at small strain."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from papilla.fem.discrete.elements import SYMMETRIC, TaylorHood, fold, interpolation, parity_signs
from papilla.fem.reduction.gauges import QUANTITIES, PointFunctional, gauge_functionals
from papilla.finger import Finger
from papilla.mesh.surfaces import Surface


@dataclass(frozen=True, eq=False)
class Readout:
    """Points at which the g gauges of a finger evaluate the displacement of its cell, including mirror images.

    feel : q * g functions that evaluate a functional from the displacement at its points; functionals : q * g of them.
    rows : (p, nodes) weights that evaluate the displacement in the cell at the p points of all functionals; signs (p,
    3) map it to the points themselves.
    """

    feel: list[Callable]
    functionals: list[PointFunctional]
    rows: sp.csr_matrix
    signs: np.ndarray

    @classmethod
    def of(cls, finger: Finger, interface: Surface, space: TaylorHood, mirrors: tuple[str, ...]) -> "Readout":
        """The readout of a finger; raises `InputError` for a gauge outside the mesh."""
        functionals = gauge_functionals(finger, interface)
        points = np.concatenate([functional.points for functional in functionals])
        folded, images = fold(points, mirrors)
        feel = [quantity.finite for quantity in QUANTITIES.values() for _ in finger.gauges]
        return cls(feel, functionals, interpolation(space, folded), parity_signs(SYMMETRIC, images))

    def __call__(self, displacement: np.ndarray) -> np.ndarray:
        """Strain and curvature change of the gauges (q, g) at a displacement (nodes of the cell, 3), in the order of
        `gauges.QUANTITIES`."""
        there = self.signs * (self.rows @ displacement)
        parts = np.split(there, np.cumsum([len(functional.points) for functional in self.functionals])[:-1])
        values = [feel(*pair) for feel, *pair in zip(self.feel, self.functionals, parts, strict=True)]
        return np.reshape(values, (len(QUANTITIES), -1))
