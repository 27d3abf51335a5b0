"""The elements of the linear fidelities: displacement nodes on the cell of a mesh, mirror planes, matrices, evaluation.

Displacement unknowns are numbered 3 * node + component; pressures, if an element has any, follow.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree
from skfem import Basis, Element, ElementTetP1, ElementTetP2, MeshTet, MeshTet2

from papilla.core.errors import InputError
from papilla.fem.discrete.assembly import SPACE_AXES, Couplings, Layout, lame, shear_blocks, volumetric_blocks
from papilla.mesh.cells import TET_CORNERS, places
from papilla.mesh.layered import LayeredMesh
from papilla.model.finger import Layer

P2_QUADRATURE_ORDER = 2
"""Exact for products of two P2 gradients or of two P1 functions on straight tetrahedra."""

SYMMETRIC_PARITY = (1, 1)
"""The parity of fields that are symmetric about both mirror planes."""

CANDIDATE_CELLS = 80
"""Number of cells that are tested for each point, nearest centroids first."""

LIKELY_CELLS, INVERSION_STEPS = 6, 12
"""Number of these that are tested with their bent edges, and of Newton steps of the inversion there."""

BARYCENTRIC_TOLERANCE = 0.25
"""Most negative smallest barycentric coordinate of a point that still counts as inside the mesh."""


def image_of(points: np.ndarray, mirrors: tuple[str, ...]) -> np.ndarray:
    """Signs (k, 2) of the mirror image of the cell that contains each point."""
    images = np.ones((len(points), 2), dtype=int)
    for axis in ("xyz".index(name) for name in mirrors):
        images[points[:, axis] < 0, axis] = -1
    return images


def fold(points: np.ndarray, mirrors: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Points (k, 3) of the cell whose mirror images are the given points, and the signs (k, 2) of these images."""
    images = image_of(points, mirrors)
    return points * np.column_stack([images, np.ones(len(images), dtype=int)]), images


def parity_signs(parity: tuple[int, int], images: np.ndarray | tuple[int, int]) -> np.ndarray:
    """Factors (..., 3) that turn the displacement at points of the cell into that at their mirror images (..., 2).

    `parity` has +1 (symmetric) or -1 (antisymmetric) for the mirrors in x = 0 and y = 0; `images` have -1 for each
    mirror between the cell and the image.
    """
    images = np.asarray(images)
    factor = np.where(images < 0, parity, 1).prod(axis=-1)[..., None]
    return factor * np.concatenate([images, np.ones_like(factor)], axis=-1).astype(float)


@dataclass(frozen=True, eq=False)
class Space(ABC):
    """Displacements whose components all use one scalar element, on the cell of a mesh. Matrices are lower
    triangles."""

    mesh: LayeredMesh

    name: ClassVar[str]
    """Name of the element."""

    scalar_element: ClassVar[Element]

    pressures = 0
    """Number of pressure unknowns."""

    @abstractmethod
    def matrix(self, layers: Mapping[int, Layer]) -> sp.csc_matrix:
        """Lower triangle of the matrix for the given layers, in N/mm (displacement block).

        It is a combination of parts that are assembled once, so other moduli cost only one pass over the entries.
        """

    def part(self, name: str, layer: int | None = None) -> sp.csc_matrix:
        """One part of the matrix, at its place: "shear" of a layer, and further parts of the element."""
        blocks = getattr(self, name) if layer is None else getattr(self, name)[layer]
        matrix = self._filled(**{name if name in self._blocks else "shear": blocks})
        matrix.eliminate_zeros()
        return matrix

    @cached_property
    def _blocks(self) -> dict[str, tuple[Couplings, tuple[int, int]]]:
        """Kind of the matrix' blocks -> the pairs of numbers that have one, with rows and columns of a block."""
        return {"shear": (self._coupled_nodes, (SPACE_AXES, SPACE_AXES))}

    @cached_property
    def _layout(self) -> Layout:
        """Structure of the matrix; the numbers of pressures follow those of displacements."""
        entries: tuple[list[np.ndarray], list[np.ndarray]] = [], []
        for coupled, shape in self._blocks.values():
            for indices, numbers, size in zip(entries, coupled.entries(*shape), shape, strict=True):
                indices.append(numbers.ravel() + (SPACE_AXES * self.nodes if size == 1 else 0))
        rows, columns = map(np.concatenate, entries)
        return Layout.of(rows, columns, self.unknowns)

    def _filled(self, **blocks: np.ndarray) -> sp.csc_matrix:
        """The matrix with some kinds of its blocks, and zeros elsewhere."""
        sizes = {name: len(coupled.rows) * math.prod(shape) for name, (coupled, shape) in self._blocks.items()}
        values = [np.ravel(blocks[name]) if name in blocks else np.zeros(size) for name, size in sizes.items()]
        return self._layout.matrix(np.concatenate(values))

    @cached_property
    def skmesh(self) -> MeshTet:
        """The same tetrahedra as scikit-fem sees them (vertex numbers are kept), bent edges included."""
        mesh = self.mesh
        straight = MeshTet(mesh.points.T.copy(), mesh.tets.T.copy(), sort_t=False)
        if not len(mesh.edges):
            return straight
        curved = MeshTet2.from_mesh(straight)
        middle = len(mesh.points) + places(mesh.edges, straight.edges.T, len(mesh.points))
        curved.doflocs[:, middle] = mesh.middles.T
        return curved

    @cached_property
    def displacement(self) -> Basis:
        """Scalar basis, which each component uses."""
        return Basis(self.skmesh, self.scalar_element, intorder=P2_QUADRATURE_ORDER)

    @property
    def nodes(self) -> int:
        """Number of displacement nodes."""
        return int(self.displacement.N)

    @property
    def unknowns(self) -> int:
        """Number of all unknowns, before boundary conditions are applied."""
        return SPACE_AXES * self.nodes + self.pressures

    @cached_property
    def layer_numbers(self) -> list[int]:
        """The layers that occur in the mesh."""
        return [int(number) for number in np.unique(self.mesh.layer)]

    def free(self, parity: tuple[int, int], mirrors: tuple[str, ...]) -> np.ndarray:
        """Mask (unknowns,) of the unknowns that the clamped base and the mirror planes leave free, for fields of one
        parity."""
        free = np.ones(self.unknowns, dtype=bool)
        base = self.nodes_on(self.mesh.boundaries["base"])
        free[: SPACE_AXES * self.nodes].reshape(-1, SPACE_AXES)[base] = False
        for axis in ("xyz".index(name) for name in mirrors):
            on_plane = np.flatnonzero(self.displacement.doflocs[axis] == 0)
            # Across the plane a symmetric field is zero there, along the plane an antisymmetric one
            fixed_axes = (np.arange(SPACE_AXES) == axis) == (parity[axis] > 0)
            free[: SPACE_AXES * self.nodes].reshape(-1, SPACE_AXES)[np.ix_(on_plane, fixed_axes)] = False
        return free

    def nodes_on(self, triangles: np.ndarray) -> np.ndarray:
        """Numbers of the displacement nodes on the given (k, 3) vertex triangles."""
        return self.displacement.get_dofs(self.facets(triangles)).flatten()

    def facets(self, triangles: np.ndarray) -> np.ndarray:
        """Facet numbers (k,) of vertex triangles (k, 3)."""
        return places(triangles, self.skmesh.facets.T, len(self.mesh.points))

    @cached_property
    def shear(self) -> dict[int, np.ndarray]:
        """Layer -> blocks (pairs of nodes, 9) of the form 2 eps(u) : eps(v) over its cells; multiplied by mu."""
        return self._by_layer(shear_blocks)

    @cached_property
    def _cell_nodes(self) -> np.ndarray:
        """(m, a) node numbers of each cell, ascending, so that the lower triangle is the same for every cell."""
        return np.sort(self.displacement.element_dofs.T.astype(np.int64), axis=1)

    @cached_property
    def _coupled_nodes(self) -> Couplings:
        return Couplings.lower(self._cell_nodes)

    def _gradients(self, cells: np.ndarray) -> np.ndarray:
        """Gradients (cells, a, 3, q) of the basis functions, in the order of `_cell_nodes`."""
        gradients = np.stack([f[0].grad[:, cells] for f in self.displacement.basis]).transpose(2, 0, 1, 3)
        order = np.argsort(self.displacement.element_dofs.T[cells], axis=1)
        return np.take_along_axis(gradients, order[:, :, None, None], axis=1)

    def _by_layer(self, blocks) -> dict[int, np.ndarray]:
        """Layer -> sums (pairs of nodes, 9) of element blocks over its cells."""
        coupled, by_layer = self._coupled_nodes, {}
        for number in self.layer_numbers:
            cells = self.mesh.layer == number
            values = blocks(self._gradients(cells), self.displacement.dx[cells], coupled.local)
            by_layer[number] = coupled.total(values, cells)
        return by_layer


class TaylorHood(Space):
    """P2 displacement and layer-wise P1 pressure on the cell of a mesh: the element of all default results.

    The stress is sigma = 2 mu eps(u) - p I with p = -lambda div u, so that nu -> 0.5 causes no difficulty. The pressure
    is continuous inside a layer and jumps across the interface, like the true one: a pressure that is continuous there
    would smear the strain exactly where the gauges sit (docs/adr/0004).
    """

    name: ClassVar[str] = "Taylor-Hood"
    scalar_element: ClassVar[Element] = ElementTetP2()

    @cached_property
    def pressure_dofs(self) -> np.ndarray:
        """(m, 4) pressure numbers of each cell: one for each pair of vertex and layer."""
        key = self.mesh.tets * 4 + self.mesh.layer[:, None]
        return np.unique(key, return_inverse=True)[1].reshape(key.shape)

    @cached_property
    def pressures(self) -> int:  # type: ignore[override]
        """Number of pressure unknowns."""
        return int(self.pressure_dofs.max()) + 1

    def matrix(self, layers: Mapping[int, Layer]) -> sp.csc_matrix:
        """Lower triangle of the saddle-point matrix for the given layers, in N/mm (displacement block)."""
        constants = {number: lame(layers[number]) for number in self.layer_numbers}
        shear = reduce(np.add, (mu * self.shear[number] for number, (mu, _) in constants.items()))
        mass = reduce(np.add, (-ratio * self.mass[number] for number, (_, ratio) in constants.items()))
        return self._filled(shear=shear, divergence=self.divergence, mass=mass)

    def free(self, parity: tuple[int, int], mirrors: tuple[str, ...]) -> np.ndarray:
        """Mask (unknowns,) of the unknowns that the clamped base and the mirror planes leave free, for fields of one
        parity."""
        free = super().free(parity, mirrors)
        for axis in ("xyz".index(name) for name in mirrors):
            if parity[axis] < 0:
                # A pressure that is antisymmetric about a plane, and continuous there, is zero there
                on_plane = self.mesh.points[self.mesh.tets, axis] == 0
                free[SPACE_AXES * self.nodes + self.pressure_dofs[on_plane]] = False
        return free

    @cached_property
    def divergence(self) -> np.ndarray:
        """Blocks (pairs of pressure and node, 3) of the form -q div u."""
        cells = np.ones(len(self.mesh.tets), dtype=bool)
        gradients = self._gradients(cells)
        weighted = self._hats * self.displacement.dx[:, None, :]
        blocks = -np.matmul(weighted, gradients.reshape(len(cells), -1, gradients.shape[-1]).transpose(0, 2, 1))
        return self._blocks["divergence"][0].total(blocks.reshape(len(cells), -1, SPACE_AXES), cells)

    @cached_property
    def mass(self) -> dict[int, np.ndarray]:
        """Layer -> blocks (pairs of pressures, 1) of the form p q over its cells; multiplied by -1/lambda."""
        coupled, by_layer = self._coupled_pressures, {}
        for number in self.layer_numbers:
            cells = self.mesh.layer == number
            hats = self._hats[cells]
            blocks = np.matmul(hats * self.displacement.dx[cells][:, None, :], hats.transpose(0, 2, 1))
            by_layer[number] = coupled.total(blocks[:, coupled.local[0], coupled.local[1], None], cells)
        return by_layer

    @cached_property
    def _cell_pressures(self) -> np.ndarray:
        """(m, 4) pressure numbers of each cell, ascending."""
        return np.sort(self.pressure_dofs, axis=1)

    @cached_property
    def hats(self) -> np.ndarray:
        """Values (4, q) of the pressure's basis functions at the quadrature points, the same in all cells."""
        points, element = self.displacement.X, ElementTetP1()
        return np.stack([element.lbasis(points, vertex)[0] for vertex in range(self.mesh.tets.shape[1])])

    @cached_property
    def _hats(self) -> np.ndarray:
        """These values (m, 4, q) in the order of `_cell_pressures`."""
        return self.hats[np.argsort(self.pressure_dofs, axis=1)]

    @cached_property
    def _coupled_pressures(self) -> Couplings:
        return Couplings.lower(self._cell_pressures)

    @cached_property
    def _blocks(self) -> dict[str, tuple[Couplings, tuple[int, int]]]:
        """Kind of the matrix' blocks -> the pairs of numbers that have one, with rows and columns of a block."""
        mixed = Couplings.between(self._cell_pressures, self._cell_nodes)
        return {**super()._blocks, "divergence": (mixed, (1, SPACE_AXES)), "mass": (self._coupled_pressures, (1, 1))}


class PureDisplacement(Space):
    """Displacements without pressure unknowns; the volumetric energy is integrated exactly. Locks as nu approaches 0.5.

    If cells must keep their volume, the nodes have too few ways to deform, and the finger becomes too stiff (P2 loses 5
    % of its compliance between nu 0.49 and 0.49999, P1 most of it). The element serves for comparisons only.
    """

    def matrix(self, layers: Mapping[int, Layer]) -> sp.csc_matrix:
        """Lower triangle of the stiffness matrix for the given layers, in N/mm.

        Raises `InputError` if nu is 0.5, because lambda is then infinite.
        """
        constants = {number: lame(layers[number]) for number in self.layer_numbers}
        for number, (_, compressibility) in constants.items():
            if compressibility == 0:
                raise InputError(
                    f"element {self.name} needs nu below 0.5 in every layer, got {layers[number].nu:g}: use Taylor-Hood"
                )
        blocks = (
            mu * self.shear[number] + self.volumetric[number] / compressibility
            for number, (mu, compressibility) in constants.items()
        )
        return self._filled(shear=reduce(np.add, blocks))

    @cached_property
    def volumetric(self) -> dict[int, np.ndarray]:
        """Layer -> blocks (pairs of nodes, 9) of the form div u div v over its cells; multiplied by lambda."""
        return self._by_layer(volumetric_blocks)


class P2(PureDisplacement):
    """Quadratic displacement; locks mildly near nu = 0.5."""

    name: ClassVar[str] = "P2"
    scalar_element: ClassVar[Element] = ElementTetP2()


class P1(PureDisplacement):
    """Linear displacement, constant strain; locks badly near nu = 0.5."""

    name: ClassVar[str] = "P1"
    scalar_element: ClassVar[Element] = ElementTetP1()


ELEMENTS_BY_NAME: dict[str, type[Space]] = {space.name: space for space in (TaylorHood, P2, P1)}

DEFAULT_ELEMENT = TaylorHood.name


def space_of(element: str, cell: LayeredMesh) -> Space:
    """The space of an element on the cell of a mesh; raises `InputError` for an unknown name."""
    if element not in ELEMENTS_BY_NAME:
        raise InputError(f"element must be one of {', '.join(ELEMENTS_BY_NAME)}, got {element!r}")
    return ELEMENTS_BY_NAME[element](cell)


def interpolation(space: Space, points: np.ndarray) -> sp.csr_matrix:
    """Matrix (k, nodes) that evaluates a component of the displacement at `points` (k, 3), in mm, of the cell.

    Raises `InputError` for a point outside the mesh.
    """
    cells, local = locate(space, points)
    columns = space.displacement.element_dofs.T[cells]
    functions = range(columns.shape[1])
    values = np.stack([space.displacement.elem.lbasis(local.T, i)[0] for i in functions], axis=1)
    rows = np.repeat(np.arange(len(points)), len(functions))
    return sp.csr_matrix((values.ravel(), (rows, columns.ravel())), shape=(len(points), space.nodes))


def locate(space: Space, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cell number (k,) and reference coordinates (k, 3) of each point; raises `InputError` for one outside."""
    corners = space.mesh.points[space.mesh.tets]
    tree = cKDTree(corners.mean(axis=1))
    count = min(CANDIDATE_CELLS, len(corners))
    candidates = tree.query(points, k=count)[1].reshape(len(points), count)
    edges = (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
    inverse = np.linalg.inv(edges)
    local = np.einsum("kcij,kcj->kci", inverse[candidates], points[:, None] - corners[candidates, 0])
    margin = np.minimum(local.min(axis=2), 1 - local.sum(axis=2))
    pick = np.arange(len(points))[:, None]
    near = np.argsort(-margin, axis=1)[:, :LIKELY_CELLS]
    candidates, local = candidates[pick, near], _bent_local(space, inverse, points, candidates[pick, near])
    margin = np.minimum(local.min(axis=2), 1 - local.sum(axis=2))
    best, pick = margin.argmax(axis=1), pick[:, 0]
    worst = margin[pick, best]
    if worst.min() < -BARYCENTRIC_TOLERANCE:
        x, y, z = points[worst.argmin()]
        place = f"point ({x:.3g}, {y:.3g}, {z:.3g}) mm"
        raise InputError(f"{place} lies outside the mesh: a gauge (or its backing) reaches over the edge of the finger")
    return candidates[pick, best], local[pick, best]


def _bent_local(space: Space, inverse: np.ndarray, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Reference coordinates (k, c, 3) of points (k, 3) in cells (k, c) with bent edges.

    inverse : (m, 3, 3) inverse maps of the straight cells. They turn the remaining distance into the next step; edges
    are bent slightly, so few steps are needed.
    """
    nodes = space.skmesh.doflocs.T[space.skmesh.dofs.element_dofs.T[cells]]
    local = np.full((*cells.shape, SPACE_AXES), 1 / TET_CORNERS)
    for _ in range(INVERSION_STEPS if space.mesh.edges.size else 1):
        shapes = [space.skmesh.elem().lbasis(local.reshape(-1, SPACE_AXES).T, i)[0] for i in range(nodes.shape[2])]
        mapped = np.einsum("ikc,kcij->kcj", np.reshape(shapes, (-1, *cells.shape)), nodes)
        local = local + np.einsum("kcij,kcj->kci", inverse[cells], points[:, None] - mapped)
    return local


def evaluated(
    space: Space, mirrors: tuple[str, ...], fields: Mapping[tuple[int, int], np.ndarray], points: np.ndarray
) -> np.ndarray:
    """Sum (k, 3, ...), at points (k, 3) of the finger, of displacement fields: parity -> (nodes of the cell, 3, ...).

    Gauge points lie on the exact interface, up to a sagitta away from the facets, and may lie on a face within
    rounding. So the best cell for each point is chosen, and its polynomial is evaluated at the point.
    """
    folded, images = fold(points, mirrors)
    values = interpolation(space, folded)
    parts = []
    for parity, field in fields.items():
        at_points = (values @ field.reshape(len(field), -1)).reshape(len(points), *field.shape[1:])
        parts.append(at_points * parity_signs(parity, images).reshape(len(points), SPACE_AXES, *[1] * (field.ndim - 2)))
    return np.sum(parts, axis=0)
