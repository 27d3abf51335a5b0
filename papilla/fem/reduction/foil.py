"""A finger whose gauges are elastic foils, with membrane and bending stiffness on the interface.

The membrane stiffness is part of the matrix, on the area of the foils' backings. The bending stiffness k acts on the
curvature of the backing that the gauge measures, one more spring for each gauge. With the gauge's functional c the
solution is corrected without a new factorisation (Woodbury):

    (K + k c c^T)^-1 f = u - K^-1 c k (c . u) / (1 + k c . K^-1 c),    u = K^-1 f.
"""

from functools import cached_property
from itertools import product

import numpy as np
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementVector, FacetBasis, LinearForm
from skfem.helpers import ddot, grad

from papilla import checks
from papilla.fem.discrete.assembly import scaled
from papilla.fem.discrete.elements import parity_signs
from papilla.fem.reduction.finger_model import FingerModel
from papilla.fem.reduction.gauges import curvature_functional, gauge_frame
from papilla.finger import Finger
from papilla.mesh.layered import LayeredMesh
from papilla.units import GRAVITY_N_MM3, MICROSTRAIN_PER_STRAIN

FOIL_NU = 0.34
"""Poisson's ratio of polyimide."""

INDICATOR_ORDER = 8
"""Order of the quadrature on the interface's triangles, because backings end inside them."""


BENT_ORDER = 4
"""Order of the quadrature over cells with bent edges."""


class FoiledModel(FingerModel):
    """`FingerModel` with foils of `membrane` (E t / (1 - nu^2), N/mm) and `bending` (N mm) stiffness.

    A polyimide foil of 0.1 mm has 300 N/mm and 0.25 N mm. Raises `InputError` for negative values.
    """

    def __init__(self, finger: Finger, mesh: LayeredMesh, membrane: float, bending: float = 0.0):
        super().__init__(finger, mesh)
        self.membrane = checks.within("foil membrane (N/mm)", membrane, 0.0, 1e9)
        self.bending = checks.within("foil bending (N mm)", bending, 0.0, 1e9)
        self._frames = [(gauge, gauge_frame(finger, gauge, self.surfaces["interface"])) for gauge in finger.gauges]
        self._springs: dict[tuple[int, int], tuple[sp.csr_matrix, np.ndarray, np.ndarray]] = {}

    @cached_property
    def matrix(self) -> sp.csc_matrix:
        """Lower triangle of the dimensionless matrix, with the foils' membranes."""
        facets = self.space.facets(self.space.mesh.boundaries["interface"])
        element = ElementVector(self.space.scalar_element)
        basis = FacetBasis(self.space.skmesh, element, facets=facets, intorder=INDICATOR_ORDER)

        @BilinearForm
        def membrane(u, v, w):
            tangent = np.eye(3)[:, :, None, None] - np.einsum("i...,j...->ij...", w.n, w.n)
            strains = [np.einsum("ik...,kl...,lj...->ij...", tangent, grad(x), tangent) for x in (u, v)]
            first, second = ((one + one.swapaxes(0, 1)) / 2 for one in strains)
            trace = np.einsum("ii...->...", first) * np.einsum("ii...->...", second)
            return self._cover(w.x) * ((1 - FOIL_NU) * ddot(first, second) + FOIL_NU * trace)

        size = self.space.unknowns
        foil = sp.tril(self.membrane * membrane.assemble(basis)).tocoo()
        whole = sp.csc_matrix((foil.data, (foil.row, foil.col)), shape=(size, size))
        return (super().matrix + scaled(whole, self._scale)).tocsc()

    def _cover(self, points: np.ndarray) -> np.ndarray:
        """Number of backings, mirror images included, that cover points (3, ...) of the cell's interface."""
        total = np.zeros(points.shape[1:])
        for gauge, frame in self._frames:
            for sign in (np.array([*image, 1]) for image in _images(self.mesh)):
                offset = points * sign[:, None, None] - frame.site[:, None, None]
                sides = zip((frame.along, frame.across), gauge.backing_mm, strict=True)
                inside = [np.abs(np.einsum("i,i...->...", axis, offset)) <= side / 2 for axis, side in sides]
                near = np.einsum("i,i...->...", frame.normal, offset) > -max(gauge.backing_mm)
                total += inside[0] & inside[1] & near
        return total

    def _solve(self, parity: tuple[int, int], load: np.ndarray) -> np.ndarray:
        """Displacement (3 * nodes, k) under displacement loads (3 * nodes, k)."""
        found = super()._solve(parity, load)
        if self.bending == 0:
            return found
        if parity not in self._springs:
            functionals = [curvature_functional(*pair, self.surfaces["interface"]) for pair in self._frames]
            rows = self.rows(functionals, parity)
            moved = super()._solve(parity, rows.T.toarray())
            areas = np.array([np.prod(gauge.backing_mm) for gauge, _ in self._frames])
            soft = np.diag(len(self._all_parities()) / (self.bending * areas))
            self._springs[parity] = rows, moved, np.linalg.inv(soft + rows @ moved)
        rows, moved, stiff = self._springs[parity]
        return found - moved @ (stiff @ (rows @ found))


def weight_readings(model: FingerModel, density_g_cm3: float = 1.0) -> np.ndarray:
    """Readings (g,) in microstrain under the finger's own weight, which acts from the apex towards the base."""
    nodes = _node_volumes(model)
    total = np.zeros(len(model.finger.gauges))
    for parity, field in model.reading_adjoints().items():
        signs = sum(parity_signs(parity, image)[..., 2] for image in _images(model.mesh))
        total += signs * np.einsum("n,ng->g", nodes, field[:, 2])
    return -MICROSTRAIN_PER_STRAIN * GRAVITY_N_MM3 * checks.positive("density (g/cm3)", density_g_cm3) * total


def _images(mesh: LayeredMesh) -> list[np.ndarray]:
    """Signs (2,) along x and y of the cell's images by the mirrors of the mesh."""
    return [np.array(signs) for signs in product(*((1, -1) if axis in mesh.mirrors else (1,) for axis in "xy"))]


def _node_volumes(model: FingerModel) -> np.ndarray:
    """Integrals (nodes,) of the displacement's shape functions over the cell, mm3."""
    basis = Basis(model.space.skmesh, model.space.scalar_element, intorder=BENT_ORDER)
    return LinearForm(lambda v, w: v).assemble(basis)
