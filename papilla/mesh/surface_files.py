"""The user's surface files: read, and refused with one clear line if they cannot be meshed; and files to start from."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from papilla.core import cache
from papilla.core.errors import FileFormatError, MeshError
from papilla.core.files import replacing
from papilla.core.outside import BINARY_BYTES, read_bytes
from papilla.mesh.cells import compact, components, edges_of
from papilla.mesh.child import cells_of, run
from papilla.mesh.surfaces import LARGEST_MM, SMALLEST_MM, TriangleSurface, Triangulation

if TYPE_CHECKING:
    from pyvista import PolyData

SURFACE_SUFFIXES = (".stl", ".ply", ".vtp")
ZERO_LENGTH = 1e-5  # Length that counts as zero, in diagonals of the outer surface: STL keeps seven digits
THINNEST_LAYER_SHARE = 1e-3  # Smallest accepted layer thickness, as a fraction of the same

ICOSAHEDRON_SUBDIVISIONS = 4
"""Subdivisions of an icosahedron's faces. A file has 130 kB, and its facets lie within 0.01 mm of the ellipsoid at the
apex."""

APEX_SHARE = 0.3
"""Angle between points at the apex relative to the mean: facets are smallest where the finger is touched."""

RIM_POINTS = 72
"""Number of points around the edge of the base."""


def read_nested(paths: tuple[str, str, str]) -> list[TriangleSurface]:
    """Outer, interface and bone surface from files, each strictly inside the one before.

    The outer surface has a flat base. The others share its plane, or are clear of it.

    Raises `FileAccessError` (missing, unreadable) or `FileFormatError` (not a surface, open, non-manifold,
    self-intersecting, not in mm, no flat base, wrongly nested); the message names the file.
    """
    parts = [read_closed(path) for path in paths]
    outer = parts[0][0]
    diagonal = float(np.linalg.norm(np.ptp(outer, axis=0)))
    base_z = float(outer[:, 2].min())
    surfaces = [TriangleSurface(*triangulation, base_z, ZERO_LENGTH * diagonal) for triangulation in parts]
    if not surfaces[0].in_base.any():
        raise FileFormatError(f"{paths[0]}: the outer surface has no flat base at its lowest z, {base_z:g} mm")
    for k in (1, 2):
        _check_inside(surfaces[k], surfaces[k - 1], paths[k], paths[k - 1], THINNEST_LAYER_SHARE * diagonal)
    return surfaces


def read_closed(path: str) -> Triangulation:
    """Vertices (n, 3) in mm and outward triangles (m, 3) of one closed surface file; raises as `read_nested`."""
    vertices, triangles = _read(path)
    if len(triangles) == 0:
        raise FileFormatError(f"{path}: holds no triangles, or is no {Path(path).suffix} file")
    if not np.all(np.isfinite(vertices)):
        raise FileFormatError(f"{path}: a vertex is not finite")
    extent = np.ptp(vertices, axis=0)
    if extent.min() <= 1e-6 * extent.max():
        raise FileFormatError(f"{path}: the surface is flat, {_by(extent)} mm; a closed body is needed")
    if not SMALLEST_MM <= extent.max() <= LARGEST_MM:
        raise FileFormatError(
            f"{path}: the surface measures {_by(extent)} mm; a finger's longest side is between {SMALLEST_MM:g} and "
            f"{LARGEST_MM:g} mm: is the file in another unit?"
        )
    triangles = _outward(path, vertices, triangles)
    crossing = _first_crossing(vertices, triangles)
    if crossing is not None:
        raise FileFormatError(f"{path}: the surface intersects itself near {_at(crossing)}")
    return vertices, triangles


def _read(path: str) -> Triangulation:
    """Vertices and triangles of a surface file, read in a child process; cached by the file's content."""
    suffix = Path(path).suffix.lower()
    if suffix not in SURFACE_SUFFIXES:
        raise FileFormatError(f"{path}: surfaces are read from {', '.join(SURFACE_SUFFIXES)} files")
    content = read_bytes(path, "surface file", BINARY_BYTES)
    request = {"content": np.frombuffer(content, dtype=np.uint8), "suffix": np.array(suffix)}
    try:
        key = cache.key("papilla.mesh.worker", content, suffix)
        arrays = cache.fetch("surface", key, lambda: run("the reader of surfaces", "read_surface", request))
        vertices, triangles = cells_of(arrays, "the reader of surfaces", "triangles", 3, "vertices")
    except MeshError as error:
        raise FileFormatError(f"{path}: not a readable {suffix} file") from error
    return _joined(vertices, triangles) if len(triangles) else (vertices, triangles)


def _joined(vertices: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """Equal vertices joined (STL repeats each one in every triangle), degenerate triangles and unused vertices
    removed."""
    vertices, number = np.unique(vertices, axis=0, return_inverse=True)
    triangles = number.ravel()[triangles]
    a, b, c = triangles.T
    return compact(vertices, triangles[(a != b) & (b != c) & (c != a)])


def _outward(path: str, vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The triangles oriented with normals outwards; the surface must be closed and in one piece."""
    edges = np.sort(edges_of(triangles).reshape(-1, 2), axis=1)
    _, edge, counts = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    if np.any(counts == 1):
        raise FileFormatError(f"{path}: the surface is open: {np.sum(counts == 1)} edges belong to one triangle only")
    if np.any(counts > 2):
        raise FileFormatError(
            f"{path}: the surface is not a manifold: {np.sum(counts > 2)} edges belong to more than two triangles"
        )

    neighbours = np.argsort(edge.ravel(), kind="stable").reshape(-1, 2) // 3
    if components(neighbours, len(triangles)).max() > 0:
        raise FileFormatError(f"{path}: the surface is in more than one piece")
    turned = _poly(vertices, triangles).compute_normals(point_normals=False, consistent_normals=True)
    triangles = np.asarray(turned.regular_faces)
    directed = edges_of(triangles).reshape(-1, 2)
    if len(np.unique(directed, axis=0)) < len(directed):
        raise FileFormatError(f"{path}: the surface has only one side")
    corners = vertices[triangles] - vertices.mean(axis=0)
    volume = np.einsum("ni,ni->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    return triangles if volume > 0 else triangles[:, ::-1]


def _first_crossing(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray | None:
    """A point (3,) where an edge passes through a triangle that it does not belong to, or None."""
    edges = np.unique(np.sort(edges_of(triangles).reshape(-1, 2), axis=1), axis=0)
    hits = _hits(vertices, triangles, vertices, edges)
    return next((at for ends, cell, at in hits if not set(ends) & set(triangles[cell].tolist())), None)


def _hits(
    vertices: np.ndarray, triangles: np.ndarray, points: np.ndarray, edges: np.ndarray
) -> Iterator[tuple[list[int], int, np.ndarray]]:
    """Where edges (k, 2) of points (n, 3) pass through triangles: the edge's ends, the triangle, and the place (3,)."""
    from vtkmodules.vtkCommonCore import vtkIdList, vtkPoints
    from vtkmodules.vtkFiltersGeneral import vtkOBBTree

    if not len(edges) or not len(triangles):
        return
    tree = vtkOBBTree()
    tree.SetDataSet(_poly(vertices, triangles))
    tree.BuildLocator()
    hits, cells = vtkPoints(), vtkIdList()
    hits.SetDataTypeToDouble()
    for ends in edges.tolist():
        tree.IntersectWithLine(points[ends[0]], points[ends[1]], hits, cells)
        for k in range(cells.GetNumberOfIds()):
            yield ends, cells.GetId(k), np.array(hits.GetPoint(k))


def _poly(vertices: np.ndarray, triangles: np.ndarray) -> "PolyData":
    import pyvista

    return pyvista.PolyData.from_regular_faces(vertices, triangles)


def _check_inside(inner: TriangleSurface, outer: TriangleSurface, path: str, around: str, thinnest: float) -> None:
    """Check that every part of `inner` lies inside `outer`, with a layer between them except at a common base plane.

    `inner` may end in a flat base there, or be clear of the plane.
    """
    base_z, tolerance = inner.base_z, inner.tolerance
    levels, inside_out = outer.level(inner.vertices), inner.level(outer.vertices)
    free, around_free = (surface.vertices[:, 2] > base_z + tolerance for surface in (inner, outer))
    not_inside = f"{path}: is not inside {around}"
    if np.all(inside_out[around_free] < 0):
        raise FileFormatError(f"{not_inside}, but around it: the order is outer, interface, bone")
    if np.all(levels[free] > 0) and np.all(inside_out[around_free] > 0) and _apart(inner.vertices, outer.vertices):
        raise FileFormatError(f"{not_inside}, but {levels[free].min():.3g} mm away from it")
    lowest = inner.vertices[:, 2].min()
    if lowest < base_z - tolerance:
        raise FileFormatError(f"{path}: reaches below the base of the finger, z = {base_z:g} mm, to z = {lowest:g} mm")
    for points, level, from_to in (
        (inner.vertices[free], levels[free], "it reaches out"),
        (outer.vertices[around_free], -inside_out[around_free], f"{around} reaches in"),
    ):
        worst = int(level.argmax())
        if level[worst] > tolerance:
            raise FileFormatError(f"{not_inside}: {from_to} by {level[worst]:.3g} mm at {_at(points[worst])}")
        if level[worst] > -thinnest:
            margin = f"{abs(level[worst]):.2g} mm are left at {_at(points[worst])}"
            raise FileFormatError(f"{not_inside}, at least {thinnest:.2g} mm away from it everywhere: {margin}")
    if np.any(levels[~free] > tolerance):
        raise FileFormatError(f"{path}: its base reaches beyond that of {around}")
    crossing = _first_crossing_of(inner, levels, outer)
    if crossing is None:
        crossing = _first_crossing_of(outer, inside_out, inner)
    if crossing is not None:
        raise FileFormatError(f"{not_inside}: they cross near {_at(crossing)}")
    standing = np.setdiff1d(np.flatnonzero(~free), inner.triangles[inner.in_base])
    if len(standing):
        raise FileFormatError(
            f"{path}: touches the base of the finger, z = {base_z:g} mm, in a point or an edge at "
            f"{_at(inner.vertices[standing[0]])}: let it end there in a flat base, or at least {thinnest:.2g} mm above"
        )


def _apart(points: np.ndarray, others: np.ndarray) -> bool:
    """Whether the boxes around two sets of points do not overlap."""
    return bool(np.any((points.min(axis=0) > others.max(axis=0)) | (others.min(axis=0) > points.max(axis=0))))


def _first_crossing_of(surface: TriangleSurface, levels: np.ndarray, against: TriangleSurface) -> np.ndarray | None:
    """A point (3,) where an edge of a surface passes through another, or None. What both have in the base plane is no
    crossing.

    levels : (n,) of the surface's vertices with respect to the other. An edge that is shorter than the sum of the
    distances of its ends from the other surface does not reach it.
    """
    edges = np.unique(np.sort(edges_of(surface.triangles).reshape(-1, 2), axis=1), axis=0)
    ends = surface.vertices[edges]
    in_base = np.all(ends[:, :, 2] <= surface.base_z + surface.tolerance, axis=1)
    reaching = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) >= np.abs(levels[edges]).sum(axis=1)
    walls = against.triangles[~against.in_base]
    return next((at for _, _, at in _hits(against.vertices, walls, surface.vertices, edges[reaching & ~in_base])), None)


def _at(point: np.ndarray) -> str:
    return f"({', '.join(f'{value:.3g}' for value in point)}) mm"


def _by(extent: np.ndarray) -> str:
    return " x ".join(f"{value:.3g}" for value in extent)


def write_half_ellipsoid(path: Path, semi_axes_mm: tuple[float, float, float]) -> None:
    """Write the half at z >= 0 of an ellipsoid around the origin as a closed binary STL file, in mm."""
    import meshio
    import pyvista as pv
    from scipy.spatial import ConvexHull

    sphere = np.asarray(pv.Icosphere(nsub=ICOSAHEDRON_SUBDIVISIONS).points, dtype=float)
    angle = np.arccos(np.clip(sphere[:, 2], -1, 1)) / (np.pi / 2)  # 0 at the apex, 1 at the base
    upper = angle < 1 - np.pi / RIM_POINTS  # Points closer to the base would make slivers with its edge
    angle, turn = angle[upper], np.arctan2(sphere[upper, 1], sphere[upper, 0])
    angle = np.pi / 2 * angle * (APEX_SHARE + (1 - APEX_SHARE) * angle)
    dome = np.column_stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)])
    around = np.linspace(0, 2 * np.pi, RIM_POINTS, endpoint=False)
    points = np.vstack([dome, np.column_stack([np.cos(around), np.sin(around), np.zeros(RIM_POINTS)])]) * semi_axes_mm
    hull = ConvexHull(points)
    triangles = hull.simplices
    normals = np.cross(
        points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]
    )
    inward = np.einsum("ij,ij->i", normals, hull.equations[:, :3]) < 0
    triangles[inward] = triangles[inward, ::-1]
    with replacing(path) as temporary:
        meshio.stl.write(temporary, meshio.Mesh(points, [("triangle", triangles)]), binary=True)
