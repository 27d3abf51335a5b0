"""Closed surfaces as a starting point for a user's finger: a half ellipsoid on its base, as an STL file."""

from pathlib import Path

import numpy as np

SUBDIVISIONS = 4
"""Subdivisions of an icosahedron's faces. A file has 130 kB, and its facets lie within 0.01 mm of the ellipsoid at the
apex."""

APEX_SHARE = 0.3
"""Angle between points at the apex relative to the mean: facets are smallest where the finger is touched."""

RIM_POINTS = 72
"""Number of points around the edge of the base."""


def write_half_ellipsoid(path: Path, semi_axes_mm: tuple[float, float, float]) -> None:
    """Write the half at z >= 0 of an ellipsoid around the origin as a closed binary STL file, in mm."""
    import meshio
    import pyvista as pv
    from scipy.spatial import ConvexHull

    sphere = np.asarray(pv.Icosphere(nsub=SUBDIVISIONS).points, dtype=float)
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
    meshio.stl.write(path, meshio.Mesh(points, [("triangle", triangles)]), binary=True)
