"""Elasticity of one material by Taylor-Hood, P2 and P1, in the vector-valued unknowns of scikit-fem.

Taylor-Hood is papilla's own; P2 and P1, in displacements alone, are scikit-fem's forms and serve as its peers.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementTetP1, ElementTetP2, ElementVector, FacetBasis, LinearForm
from skfem.helpers import ddot, div, dot, sym_grad

from papilla.fem.discrete.elasticity import lame
from papilla.fem.discrete.solver import factorise
from papilla.fem.discrete.taylor_hood import TaylorHood
from papilla.fem.reduction.finger_model import INCOMPRESSIBLE, STABILISATION
from papilla.finger import Layer
from papilla.mesh.layered import INNER, OUTER, LayeredMesh

ELEMENTS = ("Taylor-Hood", "P2", "P1")

QUADRATURE_ORDER = 5
"""For loads and errors, which are no polynomials."""

VectorField = Callable[[np.ndarray], np.ndarray]
"""Points (3, ...) in mm -> values (3, ...)."""


@dataclass(frozen=True, eq=False)
class Discretisation:
    """One element on one mesh; unknowns are numbered as scikit-fem numbers those of its vector element."""

    mesh: LayeredMesh
    element: str

    @cached_property
    def space(self) -> TaylorHood:
        """Papilla's space on the mesh, whose pressure is unused by the other elements."""
        return TaylorHood(self.mesh)

    @cached_property
    def basis(self) -> Basis:
        """Vector-valued displacement basis."""
        scalar = ElementTetP1() if self.element == "P1" else ElementTetP2()
        return Basis(self.space.skmesh, ElementVector(scalar), intorder=QUADRATURE_ORDER)

    @cached_property
    def components(self) -> np.ndarray:
        """Component (unknowns,) of each displacement unknown."""
        component = np.zeros(self.basis.N, dtype=int)
        for c in range(3):
            component[self.basis.nodal_dofs[c]] = c
            if self.element != "P1":
                component[self.basis.edge_dofs[c]] = c
        return component

    def at_nodes(self, field: VectorField) -> np.ndarray:
        """Unknowns (n,) of the field's interpolant."""
        values = field(self.basis.doflocs)
        return values[self.components, np.arange(self.basis.N)]

    def solve(self, layers: dict[int, Layer], load: np.ndarray, held: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Displacement (n,) under a load (n,), the unknowns `held` (mask) having the given values (n,)."""
        matrix, stabilised = self._matrices(layers)
        pressures = matrix.shape[0] - self.basis.N
        free = np.append(~held, np.ones(pressures, dtype=bool))
        known = np.append(np.where(held, values, 0.0), np.zeros(pressures))
        full = matrix + sp.tril(matrix, -1).T
        rhs = (np.append(load, np.zeros(pressures)) - full @ known)[free]
        lower, nearby = (None if m is None else m.tocsr()[free][:, free].tocsc() for m in (matrix, stabilised))
        known[free] = factorise(lower, pressures, stabilised=nearby).solve(rhs[:, None])[:, 0]
        return known[: self.basis.N]

    def body_load(self, force: VectorField) -> np.ndarray:
        """Load vector (n,) of a body force (N/mm3)."""
        return LinearForm(lambda v, w: dot(force(np.asarray(w.x)), v)).assemble(self.basis)

    def surface_load(self, traction: VectorField, facets: np.ndarray) -> np.ndarray:
        """Load vector (n,) of a traction (MPa) on some facets."""
        basis = FacetBasis(self.space.skmesh, self.basis.elem, facets=facets, intorder=QUADRATURE_ORDER)
        return LinearForm(lambda v, w: dot(traction(np.asarray(w.x)), v)).assemble(basis)

    def errors(self, solution: np.ndarray, field: VectorField, gradient: VectorField) -> tuple[float, float]:
        """Relative errors in L2 and in the H1 seminorm; the gradient (3, 3, ...) has the derivative's axis last."""
        found = self.basis.interpolate(solution)
        x = np.asarray(self.basis.global_coordinates())
        exact, slope = field(x), gradient(x)
        norms = [(np.asarray(found) - exact, exact), (found.grad - slope, slope)]
        low, high = (np.sqrt((e**2 * self.basis.dx).sum() / (n**2 * self.basis.dx).sum()) for e, n in norms)
        return float(low), float(high)

    def _matrices(self, layers) -> tuple[sp.csc_matrix, sp.csc_matrix | None]:
        """Lower triangles of the matrix, and of a stabilised one where the material is incompressible."""
        if self.element != "Taylor-Hood":
            return self._displacement_matrix(layers), None
        order = self._taylor_hood_order
        matrix, stabilised = self.space.matrix(layers), None
        present = {int(k): lame(layers[int(k)]) for k in np.unique(self.mesh.layer)}
        empty = {k: mu for k, (mu, compressibility) in present.items() if mu * compressibility < INCOMPRESSIBLE}
        if empty:
            masses = (self.space.part("mass", k) * (STABILISATION / mu) for k, mu in empty.items())
            stabilised = _reordered(matrix - sum(masses), order)
        return _reordered(matrix, order), stabilised

    def _displacement_matrix(self, layers) -> sp.csc_matrix:
        mu, lam = np.zeros(len(self.mesh.tets)), np.zeros(len(self.mesh.tets))
        for number, layer in layers.items():
            shear, compressibility = lame(layer)
            mu[self.mesh.layer == number], lam[self.mesh.layer == number] = shear, 1 / compressibility
        form = BilinearForm(
            lambda u, v, w: 2 * mu[:, None] * ddot(sym_grad(u), sym_grad(v)) + lam[:, None] * div(u) * div(v)
        )
        return sp.tril(form.assemble(self.basis)).tocsc()

    @cached_property
    def _taylor_hood_order(self) -> np.ndarray:
        """Number in papilla's order of each unknown in scikit-fem's, pressures included."""
        scalar, order = self.space.displacement, np.arange(self.space.unknowns)
        for c in range(3):
            order[self.basis.nodal_dofs[c]] = 3 * scalar.nodal_dofs[0] + c
            order[self.basis.edge_dofs[c]] = 3 * scalar.edge_dofs[0] + c
        return order


def one_material(layer: Layer) -> dict[int, Layer]:
    """The same material in both layers."""
    return {OUTER: layer, INNER: layer}


def _reordered(lower: sp.csc_matrix, order: np.ndarray) -> sp.csc_matrix:
    full = (lower + sp.tril(lower, -1).T).tocsr()
    return sp.tril(full[order][:, order]).tocsc()
