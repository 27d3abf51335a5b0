"""Values of displacement fields at given points: a point locator that tolerates points a little outside the cells.

Gauge points lie on the exact interface, up to a sagitta off the faceted one, and cell faces are hit at machine
precision; the cell that holds a point best is taken, and its polynomial is evaluated where the point is.
"""

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from papilla.errors import InputError
from papilla.fem.discrete.elements import Space

CANDIDATES = 80
"""Cells looked at for each point, nearest centroids first."""

TOLERANCE = 0.25
"""How negative the smallest barycentric coordinate may be before a point counts as outside the mesh."""


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
    count = min(CANDIDATES, len(corners))
    candidates = tree.query(points, k=count)[1].reshape(len(points), count)
    edges = (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
    inverse = np.linalg.inv(edges)
    local = np.einsum("kcij,kcj->kci", inverse[candidates], points[:, None] - corners[candidates, 0])
    margin = np.minimum(local.min(axis=2), 1 - local.sum(axis=2))
    best = margin.argmax(axis=1)
    pick = np.arange(len(points))
    worst = margin[pick, best]
    if worst.min() < -TOLERANCE:
        x, y, z = points[worst.argmin()]
        raise InputError(f"point ({x:.3g}, {y:.3g}, {z:.3g}) mm lies outside the mesh")
    return candidates[pick, best], local[pick, best]
