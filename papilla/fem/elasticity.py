"""Taylor-Hood (P2/P1) linear elasticity of a layered mesh, assembled once and combined for any moduli.

The stress is sigma = 2 mu eps(u) - p I with p = -lambda div u, so that nu -> 0.5 is harmless. The pressure is
continuous inside a layer and jumps across the interface, as the true one does: a pressure that is continuous there
smears the strain exactly where the gauges sit (docs/adr/0004).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from skfem import Basis, ElementTetP1, ElementTetP2, MeshTet

from papilla.finger import Layer
from papilla.mesh.layered import LayeredMesh

QUADRATURE_ORDER = 2
"""Exact for products of two P2 gradients or of two P1 functions on straight tetrahedra."""

SYMMETRIC = (1, 1)
"""The parity of fields that both mirrors leave alone."""


LARGEST_COMPRESSIBILITY = 1e10
"""Of mu/lambda: where nu = 0 there is no pressure at all, and this leaves 1e-10 of it."""


def lame(layer: Layer) -> tuple[float, float]:
    """Shear modulus mu (MPa) and compressibility 1/lambda (1/MPa, zero for nu = 0.5) of a layer."""
    mu = layer.modulus / (2 * (1 + layer.nu))
    ratio = (1 - 2 * layer.nu) / (2 * layer.nu) if layer.nu > 0 else LARGEST_COMPRESSIBILITY
    return mu, min(ratio, LARGEST_COMPRESSIBILITY) / mu


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
class TaylorHood:
    """P2 displacement and layer-wise P1 pressure on the cell of a mesh.

    Displacement unknowns are numbered 3 * node + component over the P2 nodes, pressures follow. Matrices hold the
    lower triangle only.
    """

    mesh: LayeredMesh

    @cached_property
    def skmesh(self) -> MeshTet:
        """The same tetrahedra as scikit-fem sees them (vertex numbers are kept)."""
        return MeshTet(self.mesh.points.T.copy(), self.mesh.tets.T.copy(), sort_t=False)

    @cached_property
    def displacement(self) -> Basis:
        """Scalar P2 basis; each component uses it."""
        return Basis(self.skmesh, ElementTetP2(), intorder=QUADRATURE_ORDER)

    @cached_property
    def pressure_dofs(self) -> np.ndarray:
        """(m, 4) pressure numbers of each cell: one for each pair of vertex and layer."""
        key = self.mesh.tets * 4 + self.mesh.layer[:, None]
        return np.unique(key, return_inverse=True)[1].reshape(key.shape)

    @property
    def nodes(self) -> int:
        """Number of P2 nodes."""
        return int(self.displacement.N)

    @cached_property
    def pressures(self) -> int:
        """Number of pressure unknowns."""
        return int(self.pressure_dofs.max()) + 1

    @property
    def unknowns(self) -> int:
        """All unknowns, boundary conditions not yet removed."""
        return 3 * self.nodes + self.pressures

    @cached_property
    def parts(self) -> dict[tuple[str, int], sp.csc_matrix]:
        """The matrix in parts: "shear" of layer k goes with mu, "mass" with -1/lambda, "divergence" as it is."""
        gradients, weights = self._gradients()
        stiffness = _shear_blocks(gradients, weights)
        values = np.stack([np.asarray(f[0]) for f in self._pressure_basis.basis])
        values = np.broadcast_to(values, (4, *weights.shape))
        divergence = -np.matmul((values * weights).transpose(1, 0, 2), gradients.transpose(0, 2, 1))
        mass = np.einsum("aeq,beq,eq->eab", values, values, weights, optimize=True)
        rows = (3 * self.displacement.element_dofs.T[:, :, None] + np.arange(3)).reshape(-1, 30)
        pressure = 3 * self.nodes + self.pressure_dofs
        parts = {("divergence", -1): self._assemble(divergence, pressure, rows)}
        for layer in np.unique(self.mesh.layer):
            cells = self.mesh.layer == layer
            parts["shear", int(layer)] = self._assemble(stiffness[cells], rows[cells], rows[cells])
            parts["mass", int(layer)] = self._assemble(mass[cells], pressure[cells], pressure[cells])
        return parts

    def matrix(self, layers: dict[int, Layer]) -> sp.csc_matrix:
        """Lower triangle of the saddle-point matrix for the given layers, in N/mm (displacement block)."""
        total = self.parts["divergence", -1].copy()
        for number in np.unique(self.mesh.layer):
            mu, compressibility = lame(layers[int(number)])
            total = total + mu * self.parts["shear", int(number)]
            total = total - compressibility * self.parts["mass", int(number)]
        return total.tocsc()

    def free(self, parity: tuple[int, int], mirrors: tuple[str, ...]) -> np.ndarray:
        """Mask (unknowns,) of what the clamped base and the mirror planes leave free for fields of one parity."""
        free = np.ones(self.unknowns, dtype=bool)
        base = self.p2_nodes(self.mesh.boundaries["base"])
        for component in range(3):
            free[3 * base + component] = False
        for axis in ("xyz".index(name) for name in mirrors):
            on_plane = np.flatnonzero(self.displacement.doflocs[axis] == 0)
            for component in range(3):
                if (component == axis) == (parity[axis] > 0):
                    free[3 * on_plane + component] = False
            if parity[axis] < 0:
                # A pressure that changes sign in the plane and is continuous there vanishes there
                on_plane = self.mesh.points[self.mesh.tets, axis] == 0
                free[3 * self.nodes + self.pressure_dofs[on_plane]] = False
        return free

    def p2_nodes(self, triangles: np.ndarray) -> np.ndarray:
        """Numbers of the P2 nodes on the given (k, 3) vertex triangles."""
        return self.displacement.get_dofs(self.facets(triangles)).flatten()

    def facets(self, triangles: np.ndarray) -> np.ndarray:
        """Facet numbers (k,) of vertex triangles (k, 3)."""
        n = len(self.mesh.points)
        weights = np.array([n * n, n, 1])
        known = weights @ np.sort(self.skmesh.facets, axis=0)
        order = np.argsort(known)
        return order[np.searchsorted(known[order], np.sort(triangles, axis=1) @ weights)]

    @cached_property
    def _pressure_basis(self) -> Basis:
        return Basis(self.skmesh, ElementTetP1(), intorder=QUADRATURE_ORDER)

    def _gradients(self) -> tuple[np.ndarray, np.ndarray]:
        """P2 gradients (m, 30, q), rows ordered node by component, and quadrature weights (m, q)."""
        basis = self.displacement
        gradients = np.stack([f[0].grad for f in basis.basis])
        return np.ascontiguousarray(gradients.transpose(2, 0, 1, 3)).reshape(len(self.mesh.tets), 30, -1), basis.dx

    def _assemble(self, blocks, rows, columns) -> sp.csc_matrix:
        """Lower triangle of the sum of dense element blocks."""
        i = np.broadcast_to(rows[:, :, None], blocks.shape)
        j = np.broadcast_to(columns[:, None, :], blocks.shape)
        keep = i >= j
        shape = (self.unknowns, self.unknowns)
        return sp.coo_matrix((blocks[keep], (i[keep], j[keep])), shape=shape).tocsc()


def _shear_blocks(gradients: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Element matrices (m, 30, 30) of the form 2 eps(u) : eps(v), by one batched product of the gradients."""
    cells = len(gradients)
    products = np.matmul(gradients * weights[:, None, :], gradients.transpose(0, 2, 1)).reshape(cells, 10, 3, 10, 3)
    blocks = products.transpose(0, 1, 4, 3, 2).copy()
    laplace = np.einsum("eaibi->eab", products)
    for component in range(3):
        blocks[:, :, component, :, component] += laplace
    return blocks.reshape(cells, 30, 30)
