"""From tagged cells to the final mesh: vertices moved onto the exact surfaces, poor cells relaxed, edges bent, the mesh
checked and mirrored."""

from collections.abc import Iterable

import numpy as np

from papilla.core.checks import SIZE_OPTION
from papilla.core.errors import MeshError
from papilla.core.progress import Progress, silent
from papilla.mesh.body import MeshGeometry
from papilla.mesh.cells import (
    EDGES_OF_TET,
    TaggedCells,
    components,
    edges_of,
    mean_ratio,
    paired_faces,
    places,
    volumes,
)
from papilla.mesh.layered import LayeredMesh, mirrored
from papilla.mesh.surfaces import Ellipsoid, Surface

POOR_MEAN_RATIO = 0.1  # Mean ratio below which a cell is relaxed
RELAXATION_SWEEPS = 30
STEP_FRACTIONS = (1.0, 0.5, 0.2)  # Fractions of the way to the middle of the neighbours that are tried

SMALLEST_BENT_JACOBIAN = 0.1
"""Smallest Jacobian of a bent cell relative to the straight one; below it the cell keeps its straight edges."""


def finished(
    body: MeshGeometry, cells: TaggedCells, size_mm: float, keep_bone: bool, progress: Progress = silent
) -> LayeredMesh:
    """The mesh of `cells`, which lie in `body` and on its surfaces; raises `MeshError` if it is unusable."""
    flat = [faces for plane, faces in zip(body.planes, cells.on_plane, strict=True) if plane.role == "base"]
    clamped = flat if keep_bone else [*flat, cells.on_surface["bone"]]
    names = {name: cells.on_surface[name] for name in ("skin", "interface")}
    boundaries = {**names, "base": np.vstack(clamped)}
    refuse_unusable(LayeredMesh(cells.points, cells.tets, cells.layer, boundaries, size_mm))
    faces = [(surface, cells.on_surface[name]) for name, surface in body.surfaces.items()]
    edges, middles, straight = bent_edges(cells.points, cells.tets, faces)
    if straight:
        progress(f"{straight} edges stay straight: bent to the surface, their cells would turn over")
    cell = LayeredMesh(cells.points, cells.tets, cells.layer, boundaries, size_mm, (), edges, middles)
    return mirrored(cell, body.mirrors) if body.mirrors else cell


def refuse_unusable(mesh: LayeredMesh) -> None:
    """Raise `MeshError` for a mesh with flat or inverted cells, or of more than one part."""
    volume = volumes(mesh.points, mesh.tets)
    scale = np.abs(volume).mean()
    bad = int(np.sum(volume <= 1e-9 * scale))
    if bad:
        raise MeshError(f"{bad} of {len(volume)} tetrahedra are flat or inverted: try another size_mm ({SIZE_OPTION})")
    faces, cells = paired_faces(mesh.tets)
    parts = int(components(cells, len(mesh.tets)).max()) + 1
    if parts > 1:
        raise MeshError(f"the mesh falls into {parts} separate parts: try another size_mm ({SIZE_OPTION})")


class Constraints:
    """Which surface and which planes each vertex must stay on."""

    def __init__(self, body: MeshGeometry, cells: TaggedCells):
        count = len(cells.points)
        self.body = body
        self.on_plane: np.ndarray = np.zeros((len(body.planes), count), dtype=bool)
        for mask, faces in zip(self.on_plane, cells.on_plane, strict=True):
            mask[faces] = True
        bases = np.array([plane.role == "base" for plane in body.planes])
        self.in_base: np.ndarray = np.any(self.on_plane[bases], axis=0)
        on_surface = np.zeros((len(body.surfaces), count), dtype=bool)
        for mask, name in zip(on_surface, body.surfaces, strict=True):
            mask[cells.on_surface[name]] = True
        if np.any(on_surface.sum(axis=0) > 1):
            raise MeshError("two surfaces share a vertex: a layer is thinner than its elements; use a smaller size")
        self.on_surface = on_surface

    def apply(self, points: np.ndarray, vertices: np.ndarray) -> np.ndarray:
        """The points (k, 3) of the numbered vertices (k,), moved onto their surfaces and planes."""
        points = points.copy()
        for plane, mask in zip(self.body.planes, self.on_plane, strict=True):
            points[mask[vertices], plane.axis] = plane.value
        for surface, mask in zip(self.body.surfaces.values(), self.on_surface, strict=True):
            inside, rim = mask[vertices] & ~self.in_base[vertices], mask[vertices] & self.in_base[vertices]
            points[inside] = surface.project(points[inside])
            points[rim] = surface.project_in_base(points[rim])
        return points


def snap(body: MeshGeometry, cells: TaggedCells) -> np.ndarray:
    """The points (n, 3) of the cells: those on surfaces and planes moved exactly onto them, poor cells relaxed.

    Raises `MeshError` if surfaces touch. The caller must check that no cell is inverted.
    """
    constraints = Constraints(body, cells)
    points = constraints.apply(cells.points, np.arange(len(cells.points)))
    return relax(points, cells.tets, constraints)


def relax(points: np.ndarray, tets: np.ndarray, constraints: Constraints, poor: float = POOR_MEAN_RATIO) -> np.ndarray:
    """Smart Laplacian smoothing of poor cells: a move is kept only if it raises the worst quality around its vertex."""
    points = points.copy()
    quality = mean_ratio(points, tets)
    order = np.argsort(tets, axis=None, kind="stable")
    starts = np.searchsorted(tets.ravel()[order], np.arange(len(points) + 1))
    for _ in range(RELAXATION_SWEEPS):
        improved = False
        for vertex in np.unique(tets[quality < poor]):
            around = order[starts[vertex] : starts[vertex + 1]] // 4
            improved |= _move(points, tets, quality, vertex, around, constraints)
        if not improved:
            break
    return points


def _move(points, tets, quality, vertex, around, constraints) -> bool:
    """Move one vertex towards the middle of its neighbours as far as this improves the quality; updates `points` and
    `quality`."""
    ring = np.setdiff1d(tets[around], [vertex])
    towards = points[ring].mean(axis=0) - points[vertex]
    old = points[vertex].copy()
    for step in STEP_FRACTIONS:
        points[vertex] = constraints.apply((old + step * towards)[None], np.array([vertex]))[0]
        new = mean_ratio(points, tets[around])
        if new.min() > quality[around].min():
            quality[around] = new
            return True
    points[vertex] = old
    return False


def bent_edges(
    points: np.ndarray, tets: np.ndarray, faces: Iterable[tuple[Surface, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray, int]:
    """Edges (k, 2) on the surfaces of triangles (m, 3), their middles (k, 3) on these surfaces, and the number of edges
    that stay straight because a cell would become flat or inverted.

    A surface from a file is only as exact as its facets, so its edges stay straight.
    """
    edges, middles = np.empty((0, 2), dtype=int), np.empty((0, 3))
    for surface, triangles in faces:
        if isinstance(surface, Ellipsoid):
            on = np.unique(np.sort(edges_of(triangles).reshape(-1, 2), axis=1), axis=0)
            edges, middles = np.vstack([edges, on]), np.vstack([middles, surface.project(points[on].mean(axis=1))])
    edges_before = len(edges)
    while len(edges):
        place = places(tets[:, EDGES_OF_TET], edges, len(points))
        bent = place >= 0
        bow = np.where(bent[..., None], middles[place] - points[edges[place]].mean(axis=2), 0.0)
        cells = np.flatnonzero(bent.any(axis=1))
        squeezed = cells[_smallest_jacobian(points[tets[cells]], bow[cells]) < SMALLEST_BENT_JACOBIAN]
        if not len(squeezed):
            break
        keep = np.ones(len(edges), dtype=bool)
        keep[place[squeezed][bent[squeezed]]] = False
        edges, middles = edges[keep], middles[keep]
    return edges, middles, edges_before - len(edges)


def _smallest_jacobian(corners: np.ndarray, bow: np.ndarray) -> np.ndarray:
    """(m,) smallest Jacobian, over that of the straight cell, of cells (m, 4, 3) whose middles of edges are moved by
    `bow` (m, 6, 3); at corners, middles of edges and the middle of the cell."""
    vertices = np.eye(corners.shape[1])
    share = np.vstack([vertices, vertices[EDGES_OF_TET].mean(axis=1), vertices.mean(axis=0)])
    slope = vertices[:, 1:] - vertices[:, :1]
    a, b = EDGES_OF_TET.T
    # A bubble function 4 l_a l_b for each edge
    bubbles = 4 * (share[:, a, None] * slope[b] + share[:, b, None] * slope[a])
    straight = (corners[:, 1:] - corners[:, :1]).swapaxes(1, 2)
    bent = straight[:, None] + np.einsum("mei,qej->mqij", bow, bubbles)
    return (np.linalg.det(bent) / np.linalg.det(straight)[:, None]).min(axis=1)
