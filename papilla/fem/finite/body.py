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

    @cached_property
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
    held.

    Arrays have components first and cells last, so that each operation runs over adjacent numbers. Edges may be bent:
    gradients are those in reference coordinates, one product of matrices for all cells of a layer, times the inverse
    map of each point.
    """

    def __init__(self, space: TaylorHood, cards: Mapping[int, Card], free: np.ndarray):
        self.space = space
        self.cards = dict(cards)
        self.free = free
        self.free_displacements = int(free[: SPACE_AXES * space.nodes].sum())
        basis, order = space.displacement, np.argsort(space.mesh.layer, kind="stable")
        # The cells of a layer stand together: its part of an array (..., cells) is a slice, and needs no copy
        ends = {number: np.searchsorted(space.mesh.layer[order], (number, number + 1)) for number in self.cards}
        self._parts = [(card, slice(*ends[number])) for number, card in self.cards.items()]
        # Hat functions (4, q), reference gradients (3 q, 10), inverse map (3, 3, q, cells), weights (q, cells)
        gradients = [basis.elem.lbasis(basis.X, node)[1].ravel() for node in range(len(basis.element_dofs))]
        self._hats, self._gradients = space.hats, np.stack(gradients, axis=1)
        self._inverse = basis.mapping.invDF(basis.X)[:, :, order].swapaxes(2, 3).copy()
        self._weights = np.asarray(basis.dx)[order].T.copy()
        self._weighted = self._inverse * self._weights
        self._nodes, self._pressures = basis.element_dofs[:, order], space.pressure_dofs[order].T.copy()
        displacements = SPACE_AXES * self._nodes + np.arange(SPACE_AXES)[:, None, None]
        # Unknowns (34, cells): ten displacements along each axis, then pressures
        self._unknowns = np.vstack([*displacements, SPACE_AXES * space.nodes + self._pressures])

    @property
    def free_pressures(self) -> int:
        """Number of pressure unknowns: the tangent of a stable state has this many negative eigenvalues."""
        return int(self.free.sum()) - self.free_displacements

    def forces(self, displacement: np.ndarray, pressure: np.ndarray) -> Forces:
        """Internal forces at a displacement (nodes, 3) in mm and pressures (k,) in MPa."""
        forces, strains, smallest = np.empty(self._unknowns.shape), np.empty(self._pressures.shape), np.inf
        for card, cells in self._parts:
            kinematics, weights = self._kinematics(displacement, cells), self._weights[:, cells]
            square = np.einsum("ikqc,ikqc->qc", kinematics.gradient, kinematics.gradient)
            strains[:, cells] = self._hats @ (np.sqrt(square) * weights)
            smallest = np.minimum(smallest, kinematics.jacobian.min())
            if smallest > 0:
                local = self._hats.T @ pressure[self._pressures[:, cells]]
                first = self._referred(stress(card.material, kinematics, local), cells)
                pulls = self._gradients.T @ first.reshape(SPACE_AXES, len(self._gradients), -1)
                # The equation of the pressure: J - 1 + p / lambda = 0, weighted by the hat functions
                volume = kinematics.volume_change + card.compressibility * local
                forces[:, cells] = np.vstack([*pulls, -self._hats @ (volume * weights)])
        size = float(np.linalg.norm(np.bincount(self._pressures.ravel(), strains.ravel())))
        total = np.bincount(self._unknowns.ravel(), forces.ravel())[self.free]
        return Forces(total if smallest > 0 else np.full(total.shape, np.nan), size, float(smallest))

    def tangent(self, displacement: np.ndarray, pressure: np.ndarray) -> sp.csc_matrix:
        """Derivative of the forces: lower triangle (free, free)."""
        blocks = np.empty((len(self._unknowns), *self._unknowns.shape))
        for card, cells in self._parts:
            kinematics = self._kinematics(displacement, cells)
            tangent = response(card.material, kinematics, self._hats.T @ pressure[self._pressures[:, cells]])[1]
            blocks[..., cells] = self._blocks(tangent, kinematics.cofactor, card.compressibility, cells)
        entries, place, indices, starts = self._pattern
        data, size = np.bincount(place, blocks.ravel()[entries], minlength=len(indices)), len(starts) - 1
        return sp.csc_matrix((data, indices, starts), shape=(size, size))

    def stability(self, displacement: np.ndarray) -> tuple[float, float]:
        """Smallest stability of the materials (`papilla.model.materials`, over mu) and largest principal stretch, at a
        displacement (nodes, 3) in mm."""
        least, largest = np.inf, 1.0
        for card, cells in self._parts:
            kinematics = self._kinematics(displacement, cells)
            stretches = principal(kinematics)[0] * kinematics.jacobian**-ONE_THIRD
            least = min(least, float(card.material.stability(np.moveaxis(stretches, 0, -1)).min()))
            largest = max(largest, float(stretches.max()))
        return least, largest

    @cached_property
    def scale(self) -> np.ndarray:
        """Factors (free,) of the unknowns that make the tangent's entries of order one in any units."""
        stiffness = float(np.exp(np.mean([np.log(card.material.shear_modulus) for card in self.cards.values()])))
        length = float(np.cbrt(self._weights.sum(axis=0).mean()))
        # Units: displacement in lengths, pressure in stiffnesses, energy in stiffness * length^3
        units = 1 / np.sqrt(stiffness * length), np.sqrt(stiffness / length**SPACE_AXES)
        return np.repeat(units, [self.free_displacements, self.free_pressures])

    def pressure_mass(self, number: int) -> sp.csc_matrix:
        """Mass matrix (free, free) of a layer's pressures, mm3."""
        return restricted(self.space.part("mass", number), self.free)

    def _kinematics(self, displacement: np.ndarray, cells: slice) -> Kinematics:
        """Kinematics (..., q, cells) at the quadrature points."""
        inverse = self._inverse[..., cells]
        local = self._gradients @ displacement.T.take(self._nodes[:, cells], axis=1)
        return Kinematics.of(np.einsum("ilqc,lkqc->ikqc", local.reshape(inverse.shape), inverse))

    def _referred(self, tensor: np.ndarray, cells: slice) -> np.ndarray:
        """A tensor (3, 3, ..., q, cells) times the weights, its second axis turned to reference coordinates."""
        return np.einsum("ik...qc,lkqc->il...qc", tensor, self._weighted[..., cells])

    def _blocks(self, tangent: np.ndarray, cofactor: np.ndarray, compressibility: float, cells: slice) -> np.ndarray:
        """Element tangents (34, 34, cells) from the material's tangent (9, 9, q, cells) and 1/lambda."""
        hats, weights, moves = self._hats, self._weights[:, cells], len(self._unknowns) - len(self._hats)
        gradients = self._gradients.reshape(SPACE_AXES, len(weights), -1)
        pairs = np.einsum("lqa,mqb->ablmq", gradients, gradients).reshape(-1, SPACE_AXES**2 * len(weights))
        half = self._referred(tangent.reshape(*4 * [SPACE_AXES], *weights.shape), cells)
        # Both reference axes to the front, then one product of matrices for all cells
        full = np.einsum("iljkqc,mkqc->lmqijc", half, self._inverse[..., cells]).reshape(pairs.shape[1], -1)
        stiffness = (pairs @ full).reshape(*gradients.shape[2:] * 2, SPACE_AXES, SPACE_AXES, -1)
        divergence = np.einsum("hq,lqa,ilqc->hiac", hats, gradients, self._referred(cofactor, cells))
        blocks = np.zeros((len(self._unknowns), len(self._unknowns), weights.shape[1]))
        blocks[:moves, :moves] = stiffness.transpose(2, 0, 3, 1, 4).reshape(moves, moves, -1)
        blocks[moves:, :moves] = -divergence.reshape(len(hats), moves, -1)
        blocks[moves:, moves:] = -compressibility * np.einsum("aq,bq,qc->abc", hats, hats, weights)
        return blocks

    @cached_property
    def _pattern(self):
        """The kept entries of the element tangents, their places in the data, and the CSC structure."""
        size = int(self.free.sum())
        # Numbers (cells, 34) among the free unknowns, -1 where held; cells first, because their numbers almost ascend
        numbers = np.where(self.free, np.cumsum(self.free) - 1, -1)[self._unknowns.T]
        cell, i, j = np.nonzero((numbers[:, :, None] >= numbers[:, None]) & (numbers[:, None] >= 0))
        keys, place = np.unique(numbers[cell, j] * size + numbers[cell, i], return_inverse=True)
        starts = np.searchsorted(keys, np.arange(size + 1) * size)
        entries = np.ravel_multi_index((i, j, cell), (*numbers.shape[1:] * 2, len(numbers)))
        return entries, place, keys % size, starts
