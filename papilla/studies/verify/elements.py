"""Elasticity on a mesh by any of papilla's elements: loads, prescribed displacements, errors against a field."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from skfem import Basis, FacetBasis, LinearForm

from papilla.fem.discrete.assembly import lame
from papilla.fem.discrete.elements import Space, space_of
from papilla.fem.discrete.solver import factorise
from papilla.fem.reduction.finger_model import INCOMPRESSIBLE, STABILISATION
from papilla.finger import Layer
from papilla.mesh.layered import INNER, OUTER, LayeredMesh

QUADRATURE_ORDER = 5
"""Quadrature order for loads and errors, which are not polynomials."""

VectorField = Callable[[np.ndarray], np.ndarray]
"""Points (3, ...) in mm -> values (3, ...)."""


@dataclass(frozen=True, eq=False)
class Discretisation:
    """One element on one mesh; fields are displacements (nodes, 3) in mm."""

    mesh: LayeredMesh
    element: str

    @cached_property
    def space(self) -> Space:
        """The element's space on the mesh."""
        return space_of(self.element, self.mesh)

    @cached_property
    def basis(self) -> Basis:
        """Scalar basis for loads and errors."""
        return Basis(self.space.skmesh, self.space.scalar_element, intorder=QUADRATURE_ORDER)

    @property
    def points(self) -> np.ndarray:
        """Positions (3, nodes) in mm."""
        return self.space.displacement.doflocs

    def solve(self, layers: dict[int, Layer], load: np.ndarray, held: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Displacement (nodes, 3) under a load (nodes, 3), the nodes `held` (mask) having the given values (nodes, 3).

        Pressure mass is added to the factored matrix if a layer has almost none, as in `FingerModel`.
        """
        space, size = self.space, load.size
        matrix = near = space.matrix(layers)
        for number in space.layer_numbers:
            mu, compressibility = lame(layers[number])
            if space.pressures and mu * compressibility < INCOMPRESSIBLE:
                near = near - STABILISATION / mu * space.part("mass", number)
        known, free = np.zeros(space.unknowns), np.ones(space.unknowns, dtype=bool)
        known[:size], free[:size] = np.where(held[:, None], values, 0.0).ravel(), np.repeat(~held, 3)
        rhs = -(matrix + sp.tril(matrix, -1).T) @ known
        rhs[:size] += load.ravel()
        lower, stabilised = (part.tocsr()[free][:, free].tocsc() for part in (matrix, near))
        factor = factorise(lower, space.pressures, stabilised=None if near is matrix else stabilised)
        known[free] = factor.solve(rhs[free, None])[:, 0]
        return known[:size].reshape(-1, 3)

    def body_load(self, force: VectorField) -> np.ndarray:
        """Load (nodes, 3) of a body force (N/mm3)."""
        return _load(self.basis, force)

    def surface_load(self, traction: VectorField, facets: np.ndarray) -> np.ndarray:
        """Load (nodes, 3) of a traction (MPa) on some facets."""
        mesh, element = self.space.skmesh, self.space.scalar_element
        return _load(FacetBasis(mesh, element, facets=facets, intorder=QUADRATURE_ORDER), traction)

    def errors(self, solution: np.ndarray, field: VectorField, gradient: VectorField) -> tuple[float, float]:
        """Relative errors in L2 and in the H1 seminorm; the gradient (3, 3, ...) has the derivative's axis last."""
        found = [self.basis.interpolate(component) for component in solution.T.copy()]
        x = np.asarray(self.basis.global_coordinates())
        values, slopes = np.stack([np.asarray(part) for part in found]), np.stack([part.grad for part in found])
        norms = ((values - field(x), field(x)), (slopes - gradient(x), gradient(x)))
        low, high = (np.sqrt((e**2 * self.basis.dx).sum() / (n**2 * self.basis.dx).sum()) for e, n in norms)
        return float(low), float(high)


def one_material(layer: Layer) -> dict[int, Layer]:
    """The same material in both layers."""
    return {OUTER: layer, INNER: layer}


def _load(basis: Basis, field: VectorField) -> np.ndarray:
    values = field(np.asarray(basis.global_coordinates()))
    return np.stack([LinearForm(lambda v, w: w["f"] * v).assemble(basis, f=part) for part in values], axis=1)
