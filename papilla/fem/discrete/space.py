"""What all element spaces share: displacement nodes on the cell of a mesh, mirror planes, and assembly from parts.

Displacement unknowns are numbered 3 * node + component, pressures (where a space has any) follow.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
from skfem import Basis, Element, MeshTet

from papilla.fem.discrete.assembly import Couplings, Layout
from papilla.fem.discrete.elasticity import shear_blocks
from papilla.finger import Layer
from papilla.mesh.layered import LayeredMesh

QUADRATURE_ORDER = 2
"""Exact for products of two P2 gradients or of two P1 functions on straight tetrahedra."""

SYMMETRIC = (1, 1)
"""The parity of fields that both mirrors leave alone."""


def parity_signs(parity: tuple[int, int], image: tuple[int, int]) -> np.ndarray:
    """Factors (3,) that turn the displacement at a point of the cell into that at its mirror image.

    `parity` holds +1 (symmetric) or -1 (antisymmetric) for the mirrors in x = 0 and y = 0; `image` says, by -1,
    which of them lead from the cell to the image.
    """
    signs = np.ones(3)
    for axis in (0, 1):
        if image[axis] < 0:
            signs *= parity[axis]
            signs[axis] *= -1
    return signs


@dataclass(frozen=True, eq=False)
class Space(ABC):
    """Displacements in a scalar element for each component, on the cell of a mesh. Matrices are lower triangles."""

    mesh: LayeredMesh

    name: ClassVar[str]
    """What the element is called."""

    scalar_element: ClassVar[Element]

    @property
    @abstractmethod
    def pressures(self) -> int:
        """Number of pressure unknowns."""

    @abstractmethod
    def matrix(self, layers: Mapping[int, Layer]) -> sp.csc_matrix:
        """Lower triangle of the matrix for the given layers, in N/mm (displacement block).

        A combination of parts that are assembled once: what other moduli cost is one pass over the entries.
        """

    @abstractmethod
    def part(self, name: str, layer: int | None = None) -> sp.csc_matrix:
        """One part of the matrix, in its place: "shear" of a layer, and what else the space is made of."""

    @cached_property
    def skmesh(self) -> MeshTet:
        """The same tetrahedra as scikit-fem sees them (vertex numbers are kept)."""
        return MeshTet(self.mesh.points.T.copy(), self.mesh.tets.T.copy(), sort_t=False)

    @cached_property
    def displacement(self) -> Basis:
        """Scalar basis; each component uses it."""
        return Basis(self.skmesh, self.scalar_element, intorder=QUADRATURE_ORDER)

    @property
    def nodes(self) -> int:
        """Number of displacement nodes."""
        return int(self.displacement.N)

    @property
    def unknowns(self) -> int:
        """All unknowns, boundary conditions not yet removed."""
        return 3 * self.nodes + self.pressures

    @cached_property
    def layer_numbers(self) -> list[int]:
        """The layers that occur in the mesh."""
        return [int(number) for number in np.unique(self.mesh.layer)]

    def free(self, parity: tuple[int, int], mirrors: tuple[str, ...]) -> np.ndarray:
        """Mask (unknowns,) of what the clamped base and the mirror planes leave free for fields of one parity."""
        free = np.ones(self.unknowns, dtype=bool)
        base = self.nodes_on(self.mesh.boundaries["base"])
        for component in range(3):
            free[3 * base + component] = False
        for axis in ("xyz".index(name) for name in mirrors):
            on_plane = np.flatnonzero(self.displacement.doflocs[axis] == 0)
            for component in range(3):
                if (component == axis) == (parity[axis] > 0):
                    free[3 * on_plane + component] = False
        return free

    def nodes_on(self, triangles: np.ndarray) -> np.ndarray:
        """Numbers of the displacement nodes on the given (k, 3) vertex triangles."""
        return self.displacement.get_dofs(self.facets(triangles)).flatten()

    def facets(self, triangles: np.ndarray) -> np.ndarray:
        """Facet numbers (k,) of vertex triangles (k, 3)."""
        n = len(self.mesh.points)
        weights = np.array([n * n, n, 1])
        known = weights @ np.sort(self.skmesh.facets, axis=0)
        order = np.argsort(known)
        return order[np.searchsorted(known[order], np.sort(triangles, axis=1) @ weights)]

    @cached_property
    def shear(self) -> dict[int, np.ndarray]:
        """Layer -> blocks (pairs of nodes, 9) of the form 2 eps(u) : eps(v) over its cells; goes with mu."""
        return self._by_layer(shear_blocks)

    @cached_property
    def _ascending(self) -> np.ndarray:
        """(m, a) order in which each cell's node numbers ascend: the lower triangle is then that of every cell."""
        return np.argsort(self.displacement.element_dofs.T, axis=1)

    @cached_property
    def _cell_nodes(self) -> np.ndarray:
        """(m, a) node numbers of each cell, ascending."""
        return np.take_along_axis(self.displacement.element_dofs.T.astype(np.int64), self._ascending, axis=1)

    @cached_property
    def _coupled_nodes(self) -> Couplings:
        return Couplings.lower(self._cell_nodes)

    def _gradients(self, cells: np.ndarray) -> np.ndarray:
        """Gradients (cells, a, 3, q) of the basis functions, in the order of `_cell_nodes`."""
        gradients = np.stack([f[0].grad[:, cells] for f in self.displacement.basis]).transpose(2, 0, 1, 3)
        return np.take_along_axis(gradients, self._ascending[cells][:, :, None, None], axis=1)

    def _by_layer(self, blocks) -> dict[int, np.ndarray]:
        """Layer -> sums (pairs of nodes, 9) of element blocks over its cells."""
        coupled, found = self._coupled_nodes, {}
        for number in self.layer_numbers:
            cells = self.mesh.layer == number
            values = blocks(self._gradients(cells), self.displacement.dx[cells], coupled.local)
            found[number] = coupled.total(values, cells)
        return found

    def _layout_with(self, *others: tuple[np.ndarray, np.ndarray]) -> Layout:
        """Structure of the displacement block and of other entries, each given by their rows and columns."""
        entries = [self._coupled_nodes.entries(3, 3), *others]
        rows, columns = (np.concatenate([part[axis].ravel() for part in entries]) for axis in (0, 1))
        return Layout.of(rows, columns, self.unknowns)
