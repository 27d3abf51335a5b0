"""Quality figures of tetrahedra and of layered meshes."""

import numpy as np

from papilla.mesh.layered import BONE, INNER, OUTER, LayeredMesh
from papilla.mesh.topology import FACES_OF_TET, volumes

LAYER_NAMES = {OUTER: "outer", INNER: "inner", BONE: "bone"}
EDGES_OF_TET = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


def mean_ratio(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """(m,) 12 (3 V)^(2/3) / (sum of squared edges), signed: 1 for a regular tetrahedron, <= 0 flat or inverted.

    Liu and Joe, BIT 34 (1994) 268, doi:10.1007/BF01955874.
    """
    volume = volumes(points, tets)
    edges = points[tets[:, EDGES_OF_TET[:, 1]]] - points[tets[:, EDGES_OF_TET[:, 0]]]
    return np.sign(volume) * 12 * (3 * np.abs(volume)) ** (2 / 3) / np.einsum("mei,mei->m", edges, edges)


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
    ends = mesh.points[mesh.tets[:, EDGES_OF_TET]]
    edges = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
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
            for number, name in LAYER_NAMES.items()
            if np.any(mesh.layer == number)
        },
    }
