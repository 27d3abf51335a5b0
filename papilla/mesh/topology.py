"""Faces, neighbours and components of tetrahedral meshes."""

import numpy as np
import scipy.sparse as sp

FACES_OF_TET = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
"""Vertices of the face opposite each vertex, normal pointing out of a positively oriented tetrahedron."""


def paired_faces(tets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each distinct face (k, 3), oriented out of its first cell, and its cells (k, 2); the second is -1 if there is
    none."""
    faces = np.asarray(tets, dtype=np.int64)[:, FACES_OF_TET].reshape(-1, 3)
    owner = np.repeat(np.arange(len(tets)), 4)
    # One number per face: three numbers of 21 bits fit into an integer
    low, middle, high = np.sort(faces, axis=1).T
    _, first, number = np.unique((low << 42) | (middle << 21) | high, return_index=True, return_inverse=True)
    second = np.delete(np.arange(len(faces)), first)
    cells = np.full((len(first), 2), -1)
    cells[:, 0] = owner[first]
    cells[number[second], 1] = owner[second]
    return faces[first], cells


def components(cells: np.ndarray, count: int) -> np.ndarray:
    """Component number (count,) of each cell, joined through shared faces (k, 2), whose second cell may be -1."""
    from scipy.sparse.csgraph import connected_components

    inner = cells[cells[:, 1] >= 0]
    graph = sp.coo_matrix((np.ones(len(inner)), (inner[:, 0], inner[:, 1])), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def compact(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The mesh without the points that no cell uses."""
    used, number = np.unique(cells, return_inverse=True)
    return points[used], number.reshape(cells.shape)


def volumes(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Signed volumes (m,) in mm^3."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (points[tets[:, 1:]] - points[tets[:, :1]]).transpose(1, 2, 0)
    return (ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)) / 6
