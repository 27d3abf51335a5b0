"""Bends the edges that lie on exact surfaces, so that quadratic cells follow the surface instead of its facets."""

from collections.abc import Iterable

import numpy as np

from papilla.mesh.surfaces import Ellipsoid, Surface

CORNERS = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
"""Local vertices of the edges of a cell."""

SQUEEZED = 0.1
"""Smallest Jacobian of a bent cell relative to the straight one; below it the cell keeps its straight edges."""


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
            on = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
            edges, middles = np.vstack([edges, on]), np.vstack([middles, surface.project(points[on].mean(axis=1))])
    whole = len(edges)
    sides = np.sort(tets[:, CORNERS], axis=2) @ [len(points), 1]
    while len(edges):
        keys = edges @ [len(points), 1]
        order = np.argsort(keys)
        place = order[np.searchsorted(keys[order], sides).clip(max=len(keys) - 1)]
        bent = keys[place] == sides
        bow = np.where(bent[..., None], middles[place] - points[edges[place]].mean(axis=2), 0.0)
        cells = np.flatnonzero(bent.any(axis=1))
        squeezed = cells[_smallest_jacobian(points[tets[cells]], bow[cells]) < SQUEEZED]
        if not len(squeezed):
            break
        keep = np.ones(len(edges), dtype=bool)
        keep[place[squeezed][bent[squeezed]]] = False
        edges, middles = edges[keep], middles[keep]
    return edges, middles, whole - len(edges)


def _smallest_jacobian(corners: np.ndarray, bow: np.ndarray) -> np.ndarray:
    """(m,) smallest Jacobian, over that of the straight cell, of cells (m, 4, 3) whose middles of edges are moved by
    `bow` (m, 6, 3); at corners, middles of edges and the middle of the cell."""
    share = np.vstack([np.eye(4), np.eye(4)[CORNERS].mean(axis=1), np.full((1, 4), 0.25)])
    slope = np.vstack([-np.ones(3), np.eye(3)])
    a, b = CORNERS.T
    # A bubble function 4 l_a l_b for each edge
    bubbles = 4 * (share[:, a, None] * slope[b] + share[:, b, None] * slope[a])
    straight = (corners[:, 1:] - corners[:, :1]).swapaxes(1, 2)
    bent = straight[:, None] + np.einsum("mei,qej->mqij", bow, bubbles)
    return (np.linalg.det(bent) / np.linalg.det(straight)[:, None]).min(axis=1)
