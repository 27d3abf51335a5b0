"""Halves cells that are too large, until none is: bisection of longest edges, without hanging vertices.

Every cell that is too large asks for its longest edge to be halved. If any edge of a cell is halved, its longest edge
is halved, too (otherwise it would become a sliver), which may affect its neighbours; this is repeated until no edge is
added. All edges have one order, the longest first. A cell is split at its first halved edge, then its parts at theirs.
Two cells split their common face in the same order, so the parts match.

Rivara, Int. J. Numer. Methods Eng. 20 (1984) 745, doi:10.1002/nme.1620200412.
"""

from itertools import combinations

import numpy as np

from papilla.mesh.cells import EDGES_OF_TET, TaggedCells, places

LENGTH_DECIMALS = 9
"""Decimals (mm) of the lengths by which edges are ordered, so that rounding does not decide the order."""

NEVER_HALVED = np.iinfo(np.int64).max  # Rank of an edge that is not halved


def bisected(cells: TaggedCells, chosen: np.ndarray) -> TaggedCells:
    """`cells` with the cells `chosen` (m,) bool, and neighbours if necessary, cut at their longest edges.

    New vertices are middles of straight edges; the caller moves them onto curved surfaces. The parts of cells and faces
    inherit layers, surfaces and planes.
    """
    points, tets = cells.points, cells.tets
    count = len(points)
    ends, of_tet = np.unique(np.sort(tets[:, EDGES_OF_TET]).reshape(-1, 2), axis=0, return_inverse=True)
    of_tet = of_tet.reshape(len(tets), -1)
    length = np.round(np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1), LENGTH_DECIMALS)
    rank = np.empty(len(ends), dtype=int)
    rank[np.argsort(-length, kind="stable")] = np.arange(len(ends))
    longest = np.take_along_axis(of_tet, rank[of_tet].argmin(axis=1)[:, None], axis=1)[:, 0]
    halved = np.zeros(len(ends), dtype=bool)
    halved[longest[chosen]] = True
    while not halved[asked := longest[halved[of_tet].any(axis=1)]].all():
        halved[asked] = True
    ends, rank = ends[halved], rank[halved]

    def split(simplices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The parts (k, d) of simplices (m, d), and the number (k,) of the simplex from which each comes."""
        parent, pairs = np.arange(len(simplices)), np.array(list(combinations(range(simplices.shape[1]), 2)))
        while len(simplices):
            # An edge with a new vertex is not among the old edges, so it is not halved again.
            edges = simplices[:, pairs]
            place = places(edges, ends, count)
            order = np.where((place >= 0) & (edges.max(axis=2) < count), rank[place], NEVER_HALVED)
            first = order.argmin(axis=1)
            rows = np.flatnonzero(np.take_along_axis(order, first[:, None], axis=1)[:, 0] < NEVER_HALVED)
            if not len(rows):
                break
            middle = count + np.take_along_axis(place[rows], first[rows, None], axis=1)[:, 0]
            second = simplices[rows].copy()
            a, b = pairs[first[rows]].T
            simplices = simplices.copy()
            simplices[rows, b], second[np.arange(len(rows)), a] = middle, middle
            simplices, parent = np.vstack([simplices, second]), np.concatenate([parent, parent[rows]])
        return simplices, parent

    if not len(ends):
        return cells
    cut, parent = split(tets)
    return TaggedCells(
        np.vstack([points, points[ends].mean(axis=1)]),
        cut,
        cells.layer[parent],
        {name: split(faces)[0] for name, faces in cells.on_surface.items()},
        tuple(split(faces)[0] for faces in cells.on_plane),
    )
