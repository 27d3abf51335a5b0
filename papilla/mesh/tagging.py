"""Sorts the mesher's output: layers by centroid, faces by the surface or plane on which they lie."""

from dataclasses import dataclass

import numpy as np

from papilla.checks import SIZE_OPTION
from papilla.errors import MeshError
from papilla.mesh.body import Body
from papilla.mesh.cells import compact, paired_faces
from papilla.mesh.layered import BONE, INNER, OUTER

FLAT_COSINE = 0.8
"""A boundary face near a plane lies on it if its normal is at most 37 degrees from the plane's."""


@dataclass(frozen=True, eq=False)
class TaggedCells:
    """Tetrahedra with their layers, and the faces (k, 3) on each surface and each plane, oriented outwards."""

    points: np.ndarray
    tets: np.ndarray
    layer: np.ndarray
    on_surface: dict[str, np.ndarray]
    on_plane: tuple[np.ndarray, ...]


def tag(body: Body, points: np.ndarray, tets: np.ndarray, keep_bone: bool, reach: float) -> TaggedCells:
    """Tag a raw mesh of `body`; the bone's cells are dropped unless `keep_bone`.

    Cells outside the body are dropped. `reach` (mm) is the largest distance by which the mesher may have moved a flat
    face. Raises `MeshError` if a layer has no cells or a boundary face lies on no surface or plane.
    """
    tets = tets[_inside(body, points[tets].mean(axis=1))]
    centroids = points[tets].mean(axis=1)
    layer = np.full(len(tets), OUTER)
    layer[body.surfaces["interface"].level(centroids) < 0] = INNER
    layer[body.surfaces["bone"].level(centroids) < 0] = BONE
    parts = ((OUTER, "outer layer"), (INNER, "inner layer"), (BONE, "bone"))
    missing = [name for number, name in parts if not np.any(layer == number)]
    if missing:
        raise MeshError(f"the {' and the '.join(missing)} got no tetrahedra: take a smaller size_mm ({SIZE_OPTION})")
    if not keep_bone:
        keep = layer != BONE
        tets, layer = tets[keep], layer[keep]
    points, tets = compact(points, tets)
    return _sort_faces(body, points, tets, layer, reach)


def _inside(body: Body, centroids: np.ndarray) -> np.ndarray:
    inside = body.surfaces["skin"].level(centroids) < 0
    for plane in body.planes:
        inside &= plane.outward * (centroids[:, plane.axis] - plane.value) < 0
    return inside


def _sort_faces(body, points, tets, layer, reach) -> TaggedCells:
    """Sort the outer faces onto planes, skin and bone, and find those between layers; raises `MeshError`."""
    faces, cells = paired_faces(tets)
    outside = cells[:, 1] < 0
    rim, rim_layer = faces[outside], layer[cells[outside, 0]]
    flat = [_on_plane(points, rim, plane, reach) for plane in body.planes]
    curved = ~np.any(flat, axis=0)
    centres = points[rim].mean(axis=1)
    on_bone = np.abs(body.surfaces["bone"].level(centres)) < np.abs(body.surfaces["skin"].level(centres))
    if np.any(curved & ~on_bone & (rim_layer != OUTER)) or np.any(curved & on_bone & (rim_layer == OUTER)):
        raise MeshError(f"a layer is open, its cells on the surface of another: take a smaller size_mm ({SIZE_OPTION})")
    shared = {pair: between(faces, cells, layer, *pair) for pair in ((INNER, OUTER), (BONE, INNER), (BONE, OUTER))}
    if len(shared[BONE, OUTER]):
        raise MeshError(f"the bone touches the outer layer: take a smaller size_mm ({SIZE_OPTION})")
    on_surface = {
        "skin": rim[curved & ~on_bone],
        "interface": shared[INNER, OUTER],
        "bone": np.vstack([rim[curved & on_bone], shared[BONE, INNER]]),
    }
    return TaggedCells(points, tets, layer, on_surface, tuple(rim[on] for on in flat))


def _on_plane(points, faces, plane, reach) -> np.ndarray:
    corners = points[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    cosine = np.abs(normal[:, plane.axis]) / np.linalg.norm(normal, axis=1)
    near = np.all(np.abs(corners[:, :, plane.axis] - plane.value) < reach, axis=1)
    return near & (cosine > FLAT_COSINE)


def between(faces: np.ndarray, cells: np.ndarray, layer: np.ndarray, inside: int, around: int) -> np.ndarray:
    """Faces between two layers, oriented from the inner to the outer one."""
    first, second = layer[cells[:, 0]], np.where(cells[:, 1] >= 0, layer[cells[:, 1]], -1)
    ahead = faces[(first == inside) & (second == around)]
    behind = faces[(first == around) & (second == inside)]
    return np.vstack([ahead, behind[:, ::-1]])
