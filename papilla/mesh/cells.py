"""Cells of tetrahedral meshes: faces, edges, neighbours, layers, volumes and quality."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy.sparse as sp

from papilla.mesh.layered import LAYER_NUMBERS, LayeredMesh

FACES_OF_TET = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
"""Vertices of the face opposite each vertex, normal pointing out of a positively oriented tetrahedron."""

TET_CORNERS = len(FACES_OF_TET)
EDGES_OF_TET = np.array([*combinations(range(TET_CORNERS), 2)])


@dataclass(frozen=True, eq=False)
class TaggedCells:
    """Tetrahedra with their layers, and the faces (k, 3) on each surface and each plane, oriented outwards."""

    points: np.ndarray
    tets: np.ndarray
    layer: np.ndarray
    on_surface: dict[str, np.ndarray]
    on_plane: tuple[np.ndarray, ...]


def paired_faces(tets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each distinct face (k, 3), oriented out of its first cell, and its cells (k, 2); the second is -1 if there is
    none."""
    faces = np.asarray(tets, dtype=np.int64)[:, FACES_OF_TET].reshape(-1, 3)
    owner = np.repeat(np.arange(len(tets)), TET_CORNERS)
    # One number per face: three numbers of 21 bits fit into an integer
    low, middle, high = np.sort(faces, axis=1).T
    _, first, number = np.unique((low << 42) | (middle << 21) | high, return_index=True, return_inverse=True)
    second = np.delete(np.arange(len(faces)), first)
    cells = np.full((len(first), 2), -1)
    cells[:, 0] = owner[first]
    cells[number[second], 1] = owner[second]
    return faces[first], cells


def edges_of(triangles: np.ndarray) -> np.ndarray:
    """(m, 3, 2) directed edges of triangles (m, 3)."""
    return np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)


def places(simplices: np.ndarray, among: np.ndarray, count: int) -> np.ndarray:
    """The place (...) in `among` (n, d) of the simplex with the same vertices as each of `simplices` (..., d), -1 if it
    is not there; vertex numbers are below `count`."""
    digits = count ** np.arange(among.shape[1])
    keys, wanted = (np.sort(vertices, axis=-1) @ digits for vertices in (among, simplices))
    order = np.argsort(keys)
    place = order[np.searchsorted(keys[order], wanted).clip(max=len(keys) - 1)]
    return np.where(keys[place] == wanted, place, -1)


def between(faces: np.ndarray, cells: np.ndarray, layer: np.ndarray, inside: int, around: int) -> np.ndarray:
    """Faces between two layers, oriented from the inner to the outer one."""
    first, second = layer[cells[:, 0]], np.where(cells[:, 1] >= 0, layer[cells[:, 1]], -1)
    ahead = faces[(first == inside) & (second == around)]
    behind = faces[(first == around) & (second == inside)]
    return np.vstack([ahead, behind[:, ::-1]])


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


def positively_oriented(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """The tetrahedra with two vertices swapped if the volume is negative."""
    return np.where(volumes(points, tets)[:, None] < 0, tets[:, [0, 2, 1, 3]], tets)


def mean_ratio(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """(m,) 12 (3 V)^(2/3) / (sum of squared edges), signed: 1 for a regular tetrahedron, <= 0 flat or inverted.

    Liu and Joe, BIT 34 (1994) 268, doi:10.1007/BF01955874.
    """
    volume = volumes(points, tets)
    edges = points[tets[:, EDGES_OF_TET[:, 1]]] - points[tets[:, EDGES_OF_TET[:, 0]]]
    return np.sign(volume) * 12 * (3 * np.abs(volume)) ** (2 / 3) / np.einsum("mei,mei->m", edges, edges)


def edge_lengths(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """(m, 6) lengths of the edges in mm."""
    ends = points[tets[:, EDGES_OF_TET]]
    return np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)


def dihedral_angles(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """(m, 6) dihedral angles in degrees."""
    corners = points[tets[:, FACES_OF_TET]]
    normals = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
    normals /= np.linalg.norm(normals, axis=2)[:, :, None]
    cosines = np.einsum("mei,mei->me", normals[:, EDGES_OF_TET[:, 0]], normals[:, EDGES_OF_TET[:, 1]])
    return 180 - np.degrees(np.arccos(np.clip(cosines, -1, 1)))


def quality(mesh: LayeredMesh) -> dict:
    """Figures of a mesh, ready for JSON.

    `cells`, `points`; `mean_ratio_min` and `mean_ratio_mean` (1 is a regular tetrahedron), `dihedral_min_deg`,
    `dihedral_max_deg`, `edge_min_mm`, `edge_max_mm`, and `volume_mm3` of each layer that has cells.
    """
    ratio = mean_ratio(mesh.points, mesh.tets)
    angles = dihedral_angles(mesh.points, mesh.tets)
    edges = edge_lengths(mesh.points, mesh.tets)
    volume = volumes(mesh.points, mesh.tets)
    return {
        "cells": len(mesh.tets),
        "points": len(mesh.points),
        "mean_ratio_min": float(ratio.min()),
        "mean_ratio_mean": float(ratio.mean()),
        "dihedral_min_deg": float(angles.min()),
        "dihedral_max_deg": float(angles.max()),
        "edge_min_mm": float(edges.min()),
        "edge_max_mm": float(edges.max()),
        "volume_mm3": {
            name: float(volume[mesh.layer == number].sum())
            for name, number in LAYER_NUMBERS.items()
            if np.any(mesh.layer == number)
        },
    }
