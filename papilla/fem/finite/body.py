"""The finger's body at finite strain: internal forces and tangent of its Taylor-Hood cell, by batched products.

Unknowns are those of `discrete.elements.TaylorHood`: displacement 3 * node + component, then layer-wise pressures. The
reference configuration is the mesh; no Python loop runs over cells.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from skfem import Basis, ElementTetP1, ElementTetP2

from papilla.fem.discrete.assembly import lame
from papilla.fem.discrete.elements import TaylorHood
from papilla.fem.finite.constitutive import Kinematics, energy, principal, response, stress
from papilla.finger import Layer
from papilla.materials import Material

QUADRATURE_ORDER = 2
"""Quadrature order of the linear elements, so that the tangent at zero strain is their matrix. Order 4 changes S_d at
60 gf by 5e-6."""


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
        self.free_displacements = int(self.free[: 3 * space.nodes].sum())
        basis = Basis(space.skmesh, ElementTetP2(), intorder=QUADRATURE_ORDER)
        pressure = Basis(space.skmesh, ElementTetP1(), intorder=QUADRATURE_ORDER)
        # Gradients (cells, q, 10, 3), hat functions (q, 4), weights (cells, q)
        self._gradients = np.stack([f[0].grad for f in basis.basis]).transpose(2, 3, 0, 1).copy()
        self._hats = np.stack([np.asarray(f[0])[0] for f in pressure.basis], axis=1)
        self._weights = np.asarray(basis.dx)
        self._nodes = basis.element_dofs.T
        self._pressures = space.pressure_dofs

    @property
    def free_pressures(self) -> int:
        """Number of pressure unknowns: the tangent of a stable state has this many negative eigenvalues."""
        return len(self._free_number) - self.free_displacements

    def forces(self, displacement: np.ndarray, pressure: np.ndarray) -> Forces:
        """Internal forces at a displacement (nodes, 3) in mm and pressures (k,) in MPa."""
        kinematics, local = self._kinematics(displacement), pressure[self._pressures] @ self._hats.T
        size, smallest = self._volume_scale(kinematics.gradient), float(kinematics.jacobian.min())
        if not smallest > 0:
            return Forces(np.full(len(self._free_number), np.nan), size, smallest)
        first = np.empty_like(kinematics.gradient)
        for card, cells in self._parts():
            first[cells] = stress(card.material, kinematics[cells], local[cells])
        first *= self._weights[..., None, None]
        # The equation of the pressure: J - 1 + p / lambda = 0, weighted by the hat functions.
        volume = self._weights * (kinematics.volume_change + self._compressibility()[:, None] * local)
        forces = np.concatenate(
            [(self._gradients @ first.swapaxes(-1, -2)).sum(axis=1).reshape(-1, 30), -volume @ self._hats], axis=1
        )
        return Forces(self._gather(forces), size, smallest)

    def tangent(self, displacement: np.ndarray, pressure: np.ndarray) -> sp.csc_matrix:
        """Derivative of the forces: lower triangle (free, free)."""
        kinematics, local = self._kinematics(displacement), pressure[self._pressures] @ self._hats.T
        tangent = np.empty((*local.shape, 9, 9))
        for card, cells in self._parts():
            tangent[cells] = response(card.material, kinematics[cells], local[cells])[1]
        tangent *= self._weights[..., None, None]
        return self._assemble(self._blocks(tangent, kinematics.cofactor, self._compressibility()))

    def energy(self, displacement: np.ndarray, pressure: np.ndarray) -> float:
        """Energy (N mm) of the cell at a displacement (nodes, 3) in mm and pressures (k,) in MPa."""
        kinematics = self._kinematics(displacement)
        local = pressure[self._pressures] @ self._hats.T
        return sum(
            float(
                (
                    self._weights[cells] * energy(card.material, kinematics[cells], local[cells], card.compressibility)
                ).sum()
            )
            for card, cells in self._parts()
        )

    def stability(self, displacement: np.ndarray) -> tuple[float, float]:
        """Smallest stability of the materials (`papilla.materials`, over mu) and largest principal stretch, at a
        displacement (nodes, 3) in mm."""
        kinematics, least, largest = self._kinematics(displacement), np.inf, 1.0
        for card, cells in self._parts():
            stretches = principal(kinematics[cells])[0] * kinematics.jacobian[cells][..., None] ** (-1 / 3)
            least = min(least, float(card.material.stability(stretches).min()))
            largest = max(largest, float(stretches.max()))
        return least, largest

    @cached_property
    def scale(self) -> np.ndarray:
        """Factors (free,) of the unknowns that make the tangent's entries of order one in any units."""
        stiffness = float(np.exp(np.mean([np.log(card.material.shear_modulus) for card in self.cards.values()])))
        length = float(np.cbrt(self._weights.sum(axis=1).mean()))
        # Units: displacement in lengths, pressure in stiffnesses, energy in stiffness * length^3
        displacement, pressure = 1 / np.sqrt(stiffness * length), np.sqrt(stiffness / length**3)
        known = [np.full(self.free_displacements, displacement), np.full(self.free_pressures, pressure)]
        return np.concatenate(known)

    def pressure_mass(self, number: int) -> sp.csc_matrix:
        """Mass matrix (free, free) of a layer's pressures, mm3."""
        return self.space.part("mass", number)[:, self.free].tocsr()[self.free].tocsc()

    def _parts(self):
        """Each card, with the mask (cells,) of its cells."""
        return [(card, self.space.mesh.layer == number) for number, card in self.cards.items()]

    def _compressibility(self) -> np.ndarray:
        """1/lambda (cells,) in 1/MPa."""
        return sum(card.compressibility * cells for card, cells in self._parts())

    def _kinematics(self, displacement: np.ndarray) -> Kinematics:
        return Kinematics.of(displacement[self._nodes].swapaxes(-1, -2)[:, None] @ self._gradients)

    def _volume_scale(self, gradient: np.ndarray) -> float:
        size = np.sqrt((gradient**2).sum(axis=(-2, -1))) * self._weights
        return float(np.linalg.norm(np.bincount(self._pressures.ravel(), (size @ self._hats).ravel())))

    def _blocks(self, tangent, cofactor, compressibility) -> np.ndarray:
        """Element tangents (cells, 34, 34); tangent (cells, q, 9, 9) is already weighted."""
        cells, points = self._weights.shape
        gradients = self._gradients
        # (q, 10, K) @ (q, K, i j L) -> (10 i j, q L), then times the other gradients
        by_row = tangent.reshape(cells, points, 3, 3, 3, 3).transpose(0, 1, 3, 2, 4, 5).reshape(cells, points, 3, 27)
        half = (gradients @ by_row).reshape(cells, points, 90, 3).transpose(0, 2, 1, 3).reshape(cells, 90, -1)
        full = half @ gradients.transpose(0, 1, 3, 2).reshape(cells, -1, 10)
        blocks = np.zeros((cells, 34, 34))
        blocks[:, :30, :30] = full.reshape(cells, 10, 3, 3, 10).transpose(0, 1, 2, 4, 3).reshape(cells, 30, 30)
        divergence = (gradients @ cofactor.swapaxes(-1, -2)).reshape(cells, points, 30)
        blocks[:, 30:, :30] = -(self._hats.T[None] * self._weights[:, None, :]) @ divergence
        mass = np.einsum("qa,qb,cq->cab", self._hats, self._hats, self._weights)
        blocks[:, 30:, 30:] = -compressibility[:, None, None] * mass
        return blocks

    @cached_property
    def _free_number(self) -> np.ndarray:
        return np.flatnonzero(self.free)

    @cached_property
    def _unknowns(self) -> np.ndarray:
        """(cells, 34) free-unknown numbers of each cell, -1 where clamped."""
        number = np.full(self.space.unknowns, -1)
        number[self._free_number] = np.arange(len(self._free_number))
        displacements = (3 * self._nodes[:, :, None] + np.arange(3)).reshape(-1, 30)
        return number[np.concatenate([displacements, 3 * self.space.nodes + self._pressures], axis=1)]

    @cached_property
    def _pattern(self):
        """The kept entries of the element tangents, their places in the data, and the CSC structure."""
        rows, columns = self._unknowns[:, :, None], self._unknowns[:, None, :]
        kept = np.flatnonzero(((rows >= columns) & (columns >= 0)).ravel())
        size = len(self._free_number)
        shape = (len(self._unknowns), 34, 34)
        cell, i, j = np.unravel_index(kept, shape)
        keys, place = np.unique(self._unknowns[cell, j] * size + self._unknowns[cell, i], return_inverse=True)
        starts = np.searchsorted(keys, np.arange(size + 1) * size)
        return kept, place, keys % size, starts

    def _assemble(self, blocks: np.ndarray) -> sp.csc_matrix:
        kept, place, indices, starts = self._pattern
        data = np.bincount(place, blocks.ravel()[kept], minlength=len(indices))
        size = len(self._free_number)
        return sp.csc_matrix((data, indices, starts), shape=(size, size))

    def _gather(self, forces: np.ndarray) -> np.ndarray:
        known = self._unknowns >= 0
        return np.bincount(self._unknowns[known], forces[known], minlength=len(self._free_number))
