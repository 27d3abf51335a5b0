"""Taylor-Hood: P2 displacement and layer-wise P1 pressure, the element of all default results.

The stress is sigma = 2 mu eps(u) - p I with p = -lambda div u, so that nu -> 0.5 is harmless. The pressure is
continuous inside a layer and jumps across the interface, as the true one does: a pressure that is continuous there
smears the strain exactly where the gauges sit (docs/adr/0004).
"""

from collections.abc import Mapping
from functools import cached_property, reduce
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
from skfem import Basis, Element, ElementTetP1, ElementTetP2

from papilla.fem.discrete.assembly import Couplings, Layout
from papilla.fem.discrete.elasticity import lame
from papilla.fem.discrete.space import QUADRATURE_ORDER, Space
from papilla.finger import Layer


class TaylorHood(Space):
    """P2 displacement and layer-wise P1 pressure on the cell of a mesh."""

    name: ClassVar[str] = "Taylor-Hood"
    scalar_element: ClassVar[Element] = ElementTetP2()

    @cached_property
    def pressure_dofs(self) -> np.ndarray:
        """(m, 4) pressure numbers of each cell: one for each pair of vertex and layer."""
        key = self.mesh.tets * 4 + self.mesh.layer[:, None]
        return np.unique(key, return_inverse=True)[1].reshape(key.shape)

    @cached_property
    def pressures(self) -> int:
        """Number of pressure unknowns."""
        return int(self.pressure_dofs.max()) + 1

    def matrix(self, layers: Mapping[int, Layer]) -> sp.csc_matrix:
        """Lower triangle of the saddle-point matrix for the given layers, in N/mm (displacement block)."""
        constants = {number: lame(layers[number]) for number in self.layer_numbers}
        shear = reduce(np.add, (mu * self.shear[number] for number, (mu, _) in constants.items()))
        mass = reduce(np.add, (-ratio * self.mass[number] for number, (_, ratio) in constants.items()))
        return self._filled(shear=shear, divergence=self.divergence, mass=mass)

    def part(self, name: str, layer: int | None = None) -> sp.csc_matrix:
        """One part of the matrix, in its place: "shear" or "mass" of a layer, or "divergence" of all."""
        part = self._filled(**{name: getattr(self, name) if layer is None else getattr(self, name)[layer]})
        part.eliminate_zeros()
        return part

    def free(self, parity: tuple[int, int], mirrors: tuple[str, ...]) -> np.ndarray:
        """Mask (unknowns,) of what the clamped base and the mirror planes leave free for fields of one parity."""
        free = super().free(parity, mirrors)
        for axis in ("xyz".index(name) for name in mirrors):
            if parity[axis] < 0:
                # A pressure that changes sign in the plane and is continuous there vanishes there
                on_plane = self.mesh.points[self.mesh.tets, axis] == 0
                free[3 * self.nodes + self.pressure_dofs[on_plane]] = False
        return free

    @cached_property
    def divergence(self) -> np.ndarray:
        """Blocks (pairs of pressure and node, 3) of the form -q div u."""
        cells = np.ones(len(self.mesh.tets), dtype=bool)
        gradients = self._gradients(cells)
        weighted = self._hats * self.displacement.dx[:, None, :]
        blocks = -np.matmul(weighted, gradients.reshape(len(cells), -1, gradients.shape[-1]).transpose(0, 2, 1))
        return self._mixed.total(blocks.reshape(len(cells), -1, 3), cells)

    @cached_property
    def mass(self) -> dict[int, np.ndarray]:
        """Layer -> blocks (pairs of pressures, 1) of the form p q over its cells; goes with -1/lambda."""
        coupled, found = self._coupled_pressures, {}
        for number in self.layer_numbers:
            cells = self.mesh.layer == number
            hats = self._hats[cells]
            blocks = np.matmul(hats * self.displacement.dx[cells][:, None, :], hats.transpose(0, 2, 1))
            found[number] = coupled.total(blocks[:, coupled.local[0], coupled.local[1], None], cells)
        return found

    @cached_property
    def _pressure_order(self) -> np.ndarray:
        """(m, 4) order in which each cell's pressure numbers ascend."""
        return np.argsort(self.pressure_dofs, axis=1)

    @cached_property
    def _cell_pressures(self) -> np.ndarray:
        """(m, 4) pressure numbers of each cell, ascending."""
        return np.take_along_axis(self.pressure_dofs, self._pressure_order, axis=1)

    @cached_property
    def _hats(self) -> np.ndarray:
        """Values (m, 4, q) of the pressure's basis functions, in the order of `_cell_pressures`."""
        basis = Basis(self.skmesh, ElementTetP1(), intorder=QUADRATURE_ORDER)
        # They are those of the reference cell, the same for all
        return np.stack([np.asarray(f[0])[0] for f in basis.basis])[self._pressure_order]

    @cached_property
    def _mixed(self) -> Couplings:
        return Couplings.between(self._cell_pressures, self._cell_nodes)

    @cached_property
    def _coupled_pressures(self) -> Couplings:
        return Couplings.lower(self._cell_pressures)

    @cached_property
    def _layout(self) -> Layout:
        size = 3 * self.nodes
        (mixed_rows, mixed_columns), (rows, columns) = self._mixed.entries(1, 3), self._coupled_pressures.entries(1, 1)
        return self._layout_with((size + mixed_rows, mixed_columns), (size + rows, size + columns))

    def _filled(self, **blocks: np.ndarray) -> sp.csc_matrix:
        """The matrix of some of the blocks "shear", "divergence" and "mass", zero elsewhere."""
        couplings = {
            "shear": (self._coupled_nodes, 9),
            "divergence": (self._mixed, 3),
            "mass": (self._coupled_pressures, 1),
        }
        sizes = {name: len(coupled.rows) * entries for name, (coupled, entries) in couplings.items()}
        values = [np.ravel(blocks[name]) if name in blocks else np.zeros(size) for name, size in sizes.items()]
        return self._layout.matrix(np.concatenate(values))
