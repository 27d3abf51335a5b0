"""Moves vertices onto the exact surfaces and planes, and relaxes the cells that this squeezes."""

import numpy as np

from papilla.errors import MeshError
from papilla.mesh.body import Body
from papilla.mesh.cell_quality import mean_ratio
from papilla.mesh.tagging import TaggedCells

POOR = 0.1  # Mean ratio below which a cell is relaxed
SWEEPS = 30
STEPS = (1.0, 0.5, 0.2)  # Fractions of the way to the middle of the neighbours that are tried


class Constraints:
    """Which surface and which planes each vertex must stay on."""

    def __init__(self, body: Body, cells: TaggedCells):
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


def snap(body: Body, cells: TaggedCells) -> np.ndarray:
    """The points (n, 3) of the cells: those on surfaces and planes moved exactly onto them, poor cells relaxed.

    Raises `MeshError` if surfaces touch. The caller must check that no cell is inverted.
    """
    constraints = Constraints(body, cells)
    points = constraints.apply(cells.points, np.arange(len(cells.points)))
    return relax(points, cells.tets, constraints)


def relax(points: np.ndarray, tets: np.ndarray, constraints: Constraints, poor: float = POOR) -> np.ndarray:
    """Smart Laplacian smoothing of poor cells: a move is kept only if it raises the worst quality around its vertex."""
    points = points.copy()
    quality = mean_ratio(points, tets)
    order = np.argsort(tets, axis=None, kind="stable")
    starts = np.searchsorted(tets.ravel()[order], np.arange(len(points) + 1))
    for _ in range(SWEEPS):
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
    for step in STEPS:
        points[vertex] = constraints.apply((old + step * towards)[None], np.array([vertex]))[0]
        new = mean_ratio(points, tets[around])
        if new.min() > quality[around].min():
            quality[around] = new
            return True
    points[vertex] = old
    return False
