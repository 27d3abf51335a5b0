"""The finger's body at finite strain: internal forces and tangent of its Taylor-Hood cell, by batched products.

Unknowns are those of `discrete.elements.TaylorHood`: displacement 3 * node + component, then layer-wise pressures. Its
quadrature serves here, too, so that the tangent at zero strain is the linear matrix (order 4 changes S_d at 60 gf by
5e-6). The reference configuration is the mesh; no Python loop runs over cells.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from papilla.fem.discrete.assembly import SPACE_AXES, lame, restricted
from papilla.fem.discrete.elements import TaylorHood
from papilla.fem.finite.constitutive import ONE_THIRD, Kinematics, principal, response, stress
from papilla.model.finger import Layer
from papilla.model.materials import Material


@dataclass(frozen=True)
class Card:
    """A layer's material: hyperelastic `material` and Poisson's ratio `nu` of its small-strain limit."""

    material: Material
    nu: float

    @property
    def compressibility(self) -> float:
        """1/lambda in 1/MPa, 0 for nu = 0.5."""
        mu = self.material.shear_modulus
        return lame(Layer(2 * mu * (1 + self.nu), self.nu))[1]


@dataclass(frozen=True, eq=False)
class Forces:
    """Internal forces of a state on the free unknowns, with measures for their error.

    force : (free,) in N (displacement), mm3 (pressure); NaN unless every cell has a positive volume. volume_scale :
    size (mm3) of the volume change that the strains could cause, to which its error is compared.
    smallest_jacobian : smallest det F.
    """

    force: np.ndarray
    volume_scale: float
    smallest_jacobian: float


class Body:
    """A cell of the mesh with one material card per layer number; `free` (unknowns,) is True for unknowns that are not
    held."""

    def __init__(self, space: TaylorHood, cards: Mapping[int, Card], free: np.ndarray):
        self.space = space
        self.cards = dict(cards)
        self.free = free
        # Gradients (cells, q, 10, 3), hat functions (q, 4), weights (cells, q)
        self._gradients = np.stack([f[0].grad for f in space.displacement.basis]).transpose(2, 3, 0, 1).copy()
        self._hats, self._weights = space.hats.T, np.asarray(space.displacement.dx)
        self._nodes, self._pressures = space.displacement.element_dofs.T, space.pressure_dofs
        self.free_displacements = int(self.free[: SPACE_AXES * space.nodes].sum())

    @property
    def free_pressures(self) -> int:
        """Number of pressure unknowns: the tangent of a stable state has this many negative eigenvalues."""
        return len(self._free_number) - self.free_displacements

    def forces(self, displacement: np.ndarray, pressure: np.ndarray) -> Forces:
        """Internal forces at a displacement (nodes, 3) in mm and pressures (k,) in MPa."""
        kinematics, local = self._kinematics(displacement), pressure[self._pressures] @ self._hats.T
        strains = np.sqrt((kinematics.gradient**2).sum(axis=(-2, -1))) * self._weights @ self._hats
        size = float(np.linalg.norm(np.bincount(self._pressures.ravel(), strains.ravel())))
        smallest = float(kinematics.jacobian.min())
        if not smallest > 0:
            return Forces(np.full(len(self._free_number), np.nan), size, smallest)
        first = np.empty_like(kinematics.gradient)
        for card, cells in self._parts():
            first[cells] = stress(card.material, kinematics[cells], local[cells])
        first *= self._weights[..., None, None]
        # The equation of the pressure: J - 1 + p / lambda = 0, weighted by the hat functions.
        volume = self._weights * (kinematics.volume_change + self._compressibility()[:, None] * local)
        pulls = (self._gradients @ first.swapaxes(-1, -2)).sum(axis=1)
        forces = np.concatenate([pulls.reshape(len(pulls), -1), -volume @ self._hats], axis=1)
        free = self._unknowns >= 0
        return Forces(np.bincount(self._unknowns[free], forces[free], len(self._free_number)), size, smallest)

    def tangent(self, displacement: np.ndarray, pressure: np.ndarray) -> sp.csc_matrix:
        """Derivative of the forces: lower triangle (free, free)."""
        kinematics, local = self._kinematics(displacement), pressure[self._pressures] @ self._hats.T
        tangent = np.empty((*local.shape, SPACE_AXES**2, SPACE_AXES**2))
        for card, cells in self._parts():
            tangent[cells] = response(card.material, kinematics[cells], local[cells])[1]
        tangent *= self._weights[..., None, None]
        entries, place, indices, starts = self._pattern
        blocks = self._blocks(tangent, kinematics.cofactor)
        data, size = np.bincount(place, blocks.ravel()[entries], minlength=len(indices)), len(self._free_number)
        return sp.csc_matrix((data, indices, starts), shape=(size, size))

    def stability(self, displacement: np.ndarray) -> tuple[float, float]:
        """Smallest stability of the materials (`papilla.model.materials`, over mu) and largest principal stretch, at a
        displacement (nodes, 3) in mm."""
        kinematics, least, largest = self._kinematics(displacement), np.inf, 1.0
        for card, cells in self._parts():
            stretches = principal(kinematics[cells])[0] * kinematics.jacobian[cells][..., None] ** -ONE_THIRD
            least = min(least, float(card.material.stability(stretches).min()))
            largest = max(largest, float(stretches.max()))
        return least, largest

    @cached_property
    def scale(self) -> np.ndarray:
        """Factors (free,) of the unknowns that make the tangent's entries of order one in any units."""
        stiffness = float(np.exp(np.mean([np.log(card.material.shear_modulus) for card in self.cards.values()])))
        length = float(np.cbrt(self._weights.sum(axis=1).mean()))
        # Units: displacement in lengths, pressure in stiffnesses, energy in stiffness * length^3
        units = 1 / np.sqrt(stiffness * length), np.sqrt(stiffness / length**SPACE_AXES)
        return np.repeat(units, [self.free_displacements, self.free_pressures])

    def pressure_mass(self, number: int) -> sp.csc_matrix:
        """Mass matrix (free, free) of a layer's pressures, mm3."""
        return restricted(self.space.part("mass", number), self.free)

    def _parts(self):
        """Each card, with the mask (cells,) of its cells."""
        return [(card, self.space.mesh.layer == number) for number, card in self.cards.items()]

    def _compressibility(self) -> np.ndarray:
        """1/lambda (cells,) in 1/MPa."""
        return sum(card.compressibility * cells for card, cells in self._parts())

    def _kinematics(self, displacement: np.ndarray) -> Kinematics:
        return Kinematics.of(displacement[self._nodes].swapaxes(-1, -2)[:, None] @ self._gradients)

    def _blocks(self, tangent: np.ndarray, cofactor: np.ndarray) -> np.ndarray:
        """Element tangents (cells, 34, 34); tangent (cells, q, 9, 9) is already weighted."""
        gradients, hats, weights = self._gradients, self._hats, self._weights
        cells, points, nodes, _ = gradients.shape
        moves, size = nodes * SPACE_AXES, nodes * SPACE_AXES + hats.shape[1]
        # (q, 10, K) @ (q, K, i j L) -> (10 i j, q L), then times the other gradients
        by_row = tangent.reshape(cells, points, *4 * [SPACE_AXES]).swapaxes(2, 3).reshape(cells, points, SPACE_AXES, -1)
        half = (gradients @ by_row).reshape(cells, points, -1, SPACE_AXES).swapaxes(1, 2)
        half = half.reshape(cells, moves * SPACE_AXES, -1)
        full = half @ gradients.swapaxes(2, 3).reshape(cells, -1, nodes)
        blocks = np.zeros((cells, size, size))
        stiffness = full.reshape(cells, moves, SPACE_AXES, nodes).swapaxes(2, 3)
        blocks[:, :moves, :moves] = stiffness.reshape(cells, moves, moves)
        divergence = (gradients @ cofactor.swapaxes(-1, -2)).reshape(cells, points, moves)
        blocks[:, moves:, :moves] = -(hats.T[None] * weights[:, None, :]) @ divergence
        mass = np.einsum("qa,qb,cq->cab", hats, hats, weights)
        blocks[:, moves:, moves:] = -self._compressibility()[:, None, None] * mass
        return blocks

    @cached_property
    def _free_number(self) -> np.ndarray:
        return np.flatnonzero(self.free)

    @cached_property
    def _unknowns(self) -> np.ndarray:
        """(cells, 34) free-unknown numbers of each cell, -1 where clamped."""
        number = np.full(self.space.unknowns, -1)
        number[self._free_number] = np.arange(len(self._free_number))
        displacements = SPACE_AXES * self._nodes[:, :, None] + np.arange(SPACE_AXES)
        pressures = SPACE_AXES * self.space.nodes + self._pressures
        return number[np.concatenate([displacements.reshape(len(pressures), -1), pressures], axis=1)]

    @cached_property
    def _pattern(self):
        """The kept entries of the element tangents, their places in the data, and the CSC structure."""
        rows, columns = self._unknowns[:, :, None], self._unknowns[:, None, :]
        entries = np.flatnonzero(((rows >= columns) & (columns >= 0)).ravel())
        size = len(self._free_number)
        cell, i, j = np.unravel_index(entries, np.broadcast_shapes(rows.shape, columns.shape))
        keys, place = np.unique(self._unknowns[cell, j] * size + self._unknowns[cell, i], return_inverse=True)
        starts = np.searchsorted(keys, np.arange(size + 1) * size)
        return entries, place, keys % size, starts
