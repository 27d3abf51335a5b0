"""The section's finite elements, Taylor-Hood P2/P1 on triangles, condensed to its contact patch and its gauges.

`prepare_section` makes the condensed section once for a finger and keeps it in the cache: it is all that sliding needs.

All quantities are per mm along y, in plane strain. Pressure jumps across layers, as in three dimensions.
"""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, eigsh
from skfem import Basis, BilinearForm, ElementTriP1, ElementTriP2, ElementVector, MeshTri
from skfem.helpers import ddot, dot, sym_grad
from skfem.models.general import divu
from skfem.models.poisson import mass as product

from papilla.core import cache, checks
from papilla.core.errors import InputError, SolverError
from papilla.core.progress import Progress, silent
from papilla.core.units import MICROSTRAIN_PER_STRAIN, T_MM3_PER_G_CM3
from papilla.fem.discrete.assembly import lame
from papilla.fem.discrete.solver import Factor, factorise
from papilla.fem.reduction.gauges import gauge_functionals, gauge_weights
from papilla.mesh.body import surfaces_of
from papilla.mesh.cells import places
from papilla.mesh.layered import LAYER_NUMBERS
from papilla.mesh.section import SECTION_SIZE_MM, Section, build_section, section_finger
from papilla.model.finger import Finger, Layer, Slab

SECTION_QUADRATURE_ORDER = 4  # Exact for products of two P2 functions

SECTION_STABILISATION = 1e-9
"""Stabilisation of the pressure block, which is empty for nu = 0.5: only the factor contains it, solves are refined."""

SECTION_MODES = 40
"""Number of modes that are kept; the last one of the default finger's section is at 540 Hz."""

DENSITY_G_CM3 = 1.07
"""Density of silicone, g/cm3."""


@dataclass(frozen=True, eq=False)
class Modes:
    """Free vibrations, mass-normalised per mm along y: angular frequencies (k,) in rad/s, ascending, displacements (2n,
    k) of the patch, x then inward, and quantities of the gauges (q, g, k)."""

    omega: np.ndarray
    patch: np.ndarray
    gauges: np.ndarray


class SectionModel:
    """A finger's section on its mesh, factorised once.

    Raises `InputError` as `section_finger`, `SolverError` if the equations cannot be solved.
    """

    def __init__(self, finger: Finger, section: Section):
        self.finger, self.section = section_finger(finger), section
        self.mesh = MeshTri(section.points.T.copy(), section.triangles.T.copy(), sort_t=False)
        self.scalar = Basis(self.mesh, ElementTriP2(), intorder=SECTION_QUADRATURE_ORDER)
        self.vector = Basis(self.mesh, ElementVector(ElementTriP2()), intorder=SECTION_QUADRATURE_ORDER)

    @cached_property
    def nodes(self) -> int:
        """Number of displacement nodes."""
        return int(self.scalar.N)

    @cached_property
    def component(self) -> np.ndarray:
        """(2, nodes) number of the unknown that is displacement along x, z of each node."""
        numbers = np.empty((2, self.nodes), dtype=int)
        for dofs in ("nodal_dofs", "facet_dofs"):
            numbers[:, getattr(self.scalar, dofs)[0]] = getattr(self.vector, dofs)
        return numbers

    def _layers(self) -> list[tuple[np.ndarray, Layer]]:
        pairs = ((self.section.layer == number, getattr(self.finger, name)) for name, number in LAYER_NUMBERS.items())
        return [(np.flatnonzero(cells), layer) for cells, layer in pairs if layer is not None and cells.any()]

    @cached_property
    def system(self) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """The whole symmetric matrix of displacements and pressures in N/mm2, and the mass matrix in t/mm."""

        @BilinearForm
        def shear(u, v, w):
            return 2 * ddot(sym_grad(u), sym_grad(v))

        @BilinearForm
        def inertia(u, v, w):
            return dot(u, v)

        stiffness, mixed, pressures = 0, [], []
        for cells, layer in self._layers():
            mu, compressibility = lame(layer)
            u = Basis(self.mesh, ElementVector(ElementTriP2()), intorder=SECTION_QUADRATURE_ORDER, elements=cells)
            p = Basis(self.mesh, ElementTriP1(), intorder=SECTION_QUADRATURE_ORDER, elements=cells)
            vertices = np.unique(self.section.triangles[cells])
            stiffness = stiffness + mu * shear.assemble(u)
            # Pressures in units of the layer's modulus, so that all unknowns have similar size
            mixed.append(-mu * divu.assemble(u, p).tocsr()[vertices])
            pressures.append(-compressibility * mu**2 * product.assemble(p).tocsr()[vertices][:, vertices])
        B = sp.vstack(mixed)
        system = sp.bmat([[stiffness, B.T], [B, sp.block_diag(pressures)]]).tocsc()
        density = DENSITY_G_CM3 * T_MM3_PER_G_CM3
        mass = sp.block_diag([density * inertia.assemble(self.vector), sp.csc_matrix((B.shape[0],) * 2)])
        return system, mass.tocsc()

    @cached_property
    def free(self) -> np.ndarray:
        """Numbers of the unknowns that the clamped base leaves free."""
        facets = self.mesh.facets
        outer = np.isin(np.arange(facets.shape[1]), self.mesh.boundary_facets())
        clamped = np.isin(facets, self.section.base).all(axis=0) & outer
        still = np.concatenate([self.section.base, self.scalar.facet_dofs[0, clamped]])
        free = np.ones(self.system[0].shape[0], dtype=bool)
        free[self.component[:, still].ravel()] = False
        return np.flatnonzero(free)

    @cached_property
    def factor(self) -> Factor:
        """The factorised matrix of the free unknowns."""
        matrix = self.system[0][self.free][:, self.free]
        pressures = matrix.shape[0] - int((self.free < 2 * self.nodes).sum())
        empty = matrix.diagonal()[-pressures:] == 0
        if not empty.any():
            return factorise(sp.tril(matrix).tocsc(), pressures)
        size = abs(matrix.diagonal()).max()
        small = sp.diags(np.concatenate([np.zeros(matrix.shape[0] - pressures), -SECTION_STABILISATION * size * empty]))
        return factorise(sp.tril(matrix).tocsc(), pressures, stabilised=sp.tril(matrix + small).tocsc())

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Displacements (2 nodes, k) under loads (2 nodes, k) in N/mm."""
        inside = self.free < 2 * self.nodes
        right_side = np.zeros((len(self.free), loads.shape[1]))
        right_side[inside] = loads[self.free[inside]]
        moved = np.zeros_like(loads, dtype=float)
        moved[self.free[inside]] = self.factor.solve(right_side)[inside]
        return moved

    @cached_property
    def patch_vertices(self) -> np.ndarray:
        """(n,) vertices that may touch, from left to right."""
        vertices = np.unique(self.section.spans)
        return vertices[np.argsort(self.section.points[vertices, 0])]

    @cached_property
    def patch_weights(self) -> tuple[sp.csr_matrix, np.ndarray]:
        """Weak means (2n, 2 nodes) of the patch's displacement, x then inward (-z), over each vertex's hat function,
        and the hats' integrals (n,) in mm. The transpose is the load of a unit force that is distributed like the
        hat."""
        vertices, spans = self.patch_vertices, self.section.spans
        place = np.full(len(self.section.points), -1)
        place[vertices] = np.arange(len(vertices))
        length = np.linalg.norm(np.diff(self.section.points[spans], axis=1)[:, 0], axis=1)
        middle = self.scalar.facet_dofs[0, places(spans, self.mesh.facets.T, len(place))]
        hats = np.zeros(len(vertices))
        np.add.at(hats, place[spans], length[:, None] / 2)
        # Integrals of hats times P2 functions over an edge: length/6 at the hat's own vertex, length/3 in the middle, 0
        # at the other end
        rows = np.concatenate([place[spans].ravel(), place[spans].ravel()])
        columns = np.concatenate([spans.ravel(), np.repeat(middle, 2)])
        values = np.concatenate([np.repeat(length / 6, 2), np.repeat(length / 3, 2)]) / hats[rows]
        size = (len(vertices), 2 * self.nodes)
        along, up = (sp.csr_matrix((values, (rows, self.component[c][columns])), shape=size) for c in (0, 1))
        return sp.vstack([along, -up]).tocsr(), hats

    @cached_property
    def gauge_rows(self) -> sp.csr_matrix:
        """(q * g, 2 nodes) rows of the gauges' quantities, as in three dimensions: their functionals have no component
        along y."""
        functionals = gauge_functionals(self.finger, surfaces_of(self.finger)["interface"])
        return sp.vstack([self._row(f.points[:, [0, 2]], f.weights[:, [0, 2]]) for f in functionals]).tocsr()

    def _row(self, points: np.ndarray, weights: np.ndarray) -> sp.csr_matrix:
        """A functional of the displacement at points (k, 2), with weights (k, 2), as a row (1, 2 nodes)."""
        try:
            values = self.scalar.probes(points.T).tocsr()
        except ValueError as error:
            x, z = points[np.abs(points[:, 0]).argmax()]
            raise InputError(f"a gauge's foil reaches out of the section, to ({x:.3g}, {z:.3g}) mm: move it") from error
        flat = [sp.csr_matrix(values.T @ weights[:, c]) for c in (0, 1)]
        functional = sp.lil_matrix((1, 2 * self.nodes))
        for c in (0, 1):
            functional[0, self.component[c][flat[c].indices]] = flat[c].data
        return functional.tocsr()

    def condense(self) -> tuple[np.ndarray, np.ndarray]:
        """Compliance (2n, 2n) of the patch in mm per N/mm, x then inward, and gauge rows (q, g, 2n) per N/mm."""
        means, _ = self.patch_weights
        moved = self.solve(means.T.toarray())
        compliance = means @ moved
        rows = self.gauge_rows @ moved
        return (compliance + compliance.T) / 2, rows.reshape(-1, len(self.finger.gauges), compliance.shape[0])

    def modes(self, count: int) -> Modes:
        """The slowest `count` modes; raises `SolverError` if they are not found."""
        mass = self.system[1][self.free][:, self.free]
        size = mass.shape[0]
        inverse = LinearOperator((size, size), matvec=lambda b: self.factor.solve(np.reshape(b, (size, 1)))[:, 0])
        start = self.factor.solve(mass @ np.ones((size, 1)))[:, 0]
        try:
            squares, shapes = eigsh(
                self.system[0][self.free][:, self.free], k=count, M=mass, sigma=0.0, OPinv=inverse, v0=start
            )
        except (RuntimeError, ValueError) as error:
            raise SolverError(f"the section's modes were not found: {error}") from error
        shapes = shapes / np.sqrt(np.einsum("nk,nk->k", shapes, mass @ shapes))
        inside = self.free < 2 * self.nodes
        fields = np.zeros((2 * self.nodes, count))
        fields[self.free[inside]] = shapes[inside]
        means, _ = self.patch_weights
        gauges = (self.gauge_rows @ fields).reshape(-1, len(self.finger.gauges), count)
        return Modes(np.sqrt(squares), means @ fields, gauges)


@dataclass(frozen=True, eq=False, repr=False)
class ReducedSection:
    """A section per mm along y; n nodes of the surface that may touch, g gauges, q quantities, k modes.

    x, z : (n,) the nodes, and z averaged over their hat functions, mm. hats : (n, 2) width of each node's hat function
    to the left and to the right, 0 at a ridge's edge. compliance : (2n, 2n) displacement along x, then inward, under
    forces in the same order, mm per N/mm. rows : (q, g, 2n) quantities of the gauges per N/mm. weights : (q, g) of the
    quantities in a reading.
    modes : of free vibration. ridge_pitch : mm, 0 for a smooth skin. half_width : largest distance of the contact from
    the apex. bone_top : z of the bone's top.
    """

    x: np.ndarray
    z: np.ndarray
    hats: np.ndarray
    compliance: np.ndarray
    rows: np.ndarray
    weights: np.ndarray
    modes: Modes
    ridge_pitch: float
    half_width: float
    bone_top: float

    def __repr__(self) -> str:
        return f"ReducedSection({len(self.x)} nodes, {self.rows.shape[1]} gauges, ridge pitch {self.ridge_pitch:g} mm)"

    @property
    def reading_rows(self) -> np.ndarray:
        """(g, 2n) readings in microstrain per N/mm."""
        return MICROSTRAIN_PER_STRAIN * np.einsum("qg,qgn->gn", self.weights, self.rows)

    @property
    def reading_modes(self) -> np.ndarray:
        """(g, k) readings in microstrain per unit of each mode."""
        return MICROSTRAIN_PER_STRAIN * np.einsum("qg,qgk->gk", self.weights, self.modes.gauges)


def prepare_section(finger: Finger, *, size_mm: float = SECTION_SIZE_MM, progress: Progress = silent) -> ReducedSection:
    """Mesh, factorise and condense a finger's section, or take it from the cache.

    Raises `InputError` for a finger without an exact section and for a bad size, and `SolverError`.
    """
    checks.positive("size_mm", size_mm)
    extruded = section_finger(finger)

    def make() -> dict[str, np.ndarray]:
        progress("condensing the section, some seconds the first time")
        return _arrays(SectionModel(extruded, build_section(extruded, size_mm=size_mm)))

    key = cache.key(__name__, extruded.sha256, float(size_mm), SECTION_MODES, DENSITY_G_CM3)
    arrays = cache.fetch("section", key, make)
    modes = Modes(*(arrays.pop(f"mode_{field.name}") for field in fields(Modes)))
    half_width, bone = float(arrays.pop("half_width")), extruded.shape
    assert isinstance(bone, Slab)
    return ReducedSection(
        **arrays,
        weights=gauge_weights(extruded),
        modes=modes,
        ridge_pitch=extruded.ridges.pitch if extruded.ridges else 0.0,
        half_width=half_width,
        bone_top=bone.bone[1],
    )


def _arrays(model: SectionModel) -> dict[str, np.ndarray]:
    """The arrays of a `ReducedSection`, as they are cached."""
    compliance, rows = model.condense()
    modes = model.modes(SECTION_MODES)
    section, vertices = model.section, model.patch_vertices
    hats = np.zeros((len(vertices), 2))
    order = np.searchsorted(section.points[vertices, 0], section.points[section.spans, 0])
    width = np.diff(section.points[section.spans, 0], axis=1)[:, 0]
    hats[order[:, 0], 1] = hats[order[:, 1], 0] = width
    z = section.points[vertices, 1]
    neighbours = [np.roll(z, 1), np.roll(z, -1)]
    # The mean of a straight edge under a hat with its peak at one end lies a third of the way to the other end
    z_mean = z + sum(hats[:, c] * (neighbour - z) / 3 for c, neighbour in enumerate(neighbours)) / hats.sum(axis=1)
    return {
        "x": section.points[vertices, 0],
        "z": z_mean,
        "hats": hats,
        "compliance": compliance,
        "rows": rows,
        "half_width": np.array(section.half_width),
        **{f"mode_{field.name}": getattr(modes, field.name) for field in fields(Modes)},
    }
