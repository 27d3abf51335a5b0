"""A closed triangulated surface of the user, treated as exact geometry."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from papilla import checks
from papilla.short_repr import short_repr

if TYPE_CHECKING:
    from pyvista import PolyData

FEATURE_DEG = 30.0  # Normals are smoothed across edges with a smaller angle


@dataclass(frozen=True, eq=False)
class TriangleSurface:
    """A closed, outward-oriented triangulation; lengths in mm.

    Parameters
    ----------
    vertices : (n, 3) float.
    triangles : (m, 3) int.
    base_z : height of the finger's base plane; triangles within `tolerance` of it are the surface's flat base.
    tolerance : length that counts as zero.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    base_z: float
    tolerance: float
    __repr__ = short_repr

    @cached_property
    def _poly(self) -> "PolyData":
        """The surface for VTK, with normals split at sharp edges."""
        import pyvista

        poly = pyvista.PolyData.from_regular_faces(self.vertices, self.triangles)
        return poly.compute_normals(
            cell_normals=False, split_vertices=True, feature_angle=FEATURE_DEG, consistent_normals=False
        )

    @cached_property
    def in_base(self) -> np.ndarray:
        """Mask (m,) of the triangles that lie in the base plane."""
        return np.all(np.abs(self.vertices[self.triangles, 2] - self.base_z) <= self.tolerance, axis=1)

    @cached_property
    def _rim(self) -> "PolyData":
        """The edges between the flat base and the rest, as lines for VTK."""
        import pyvista

        edges = np.sort(self.triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
        flat, steep = edges[self.in_base].reshape(-1, 2), edges[~self.in_base].reshape(-1, 2)
        both = np.array(sorted(set(map(tuple, flat.tolist())) & set(map(tuple, steep.tolist()))))
        return pyvista.line_segments_from_points(self.vertices[both].reshape(-1, 3))

    def level(self, points: np.ndarray) -> np.ndarray:
        """(n,) signed distance in mm, negative inside."""
        import pyvista

        cloud = pyvista.PolyData(np.ascontiguousarray(points, dtype=float))
        return np.asarray(cloud.compute_implicit_distance(self._poly)["implicit_distance"], dtype=float)

    def project(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) closest points of the surface."""
        return _closest(self._poly, points)[1]

    def project_in_base(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) closest points of the rim of the flat base, with z of the base plane."""
        foot = _closest(self._rim, points)[1]
        foot[:, 2] = self.base_z
        return foot

    def height(self, xy: np.ndarray) -> np.ndarray:
        """(n,) largest z of the surface above each point of `xy` (n, 2); NaN if there is none."""
        from scipy.spatial import cKDTree

        z = np.full(len(xy), -np.inf)
        centre, radius = self._discs
        found = cKDTree(xy).query_ball_point(centre, radius) if len(xy) else []
        point = np.array([number for near in found for number in near], dtype=int)
        triangle = np.repeat(np.arange(len(found)), [len(near) for near in found])
        np.maximum.at(z, point, _height_in(xy[point], self.vertices[self.triangles[triangle]]))
        return np.where(np.isfinite(z), z, np.nan)

    @cached_property
    def _discs(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres (m, 2) and radii (m,) of discs in the x-y plane, each around a triangle."""
        corners = self.vertices[self.triangles][:, :, :2]
        centre = corners.mean(axis=1)
        return centre, np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1) * (1 + checks.ROUNDING)

    def normal(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) unit outward normals, interpolated over the triangle closest to each point."""
        cells, feet = _closest(self._poly, points)
        corners = self._poly.regular_faces[cells]
        p = np.asarray(self._poly.points, dtype=float)[corners]
        weights = np.stack(
            [np.linalg.norm(np.cross(p[:, (k + 1) % 3] - feet, p[:, (k + 2) % 3] - feet), axis=1) for k in range(3)],
            axis=1,
        )
        normals = np.einsum("nk,nki->ni", weights, np.asarray(self._poly.point_data["Normals"], dtype=float)[corners])
        return normals / np.linalg.norm(normals, axis=1)[:, None]

    def facet_deviation(self, around: np.ndarray, reach: float) -> float:
        """Largest distance (mm), over the facets within `reach` of a point (3,), to the smooth surface that they
        approximate.

        The quadratic surface through a facet's vertices v with normals n lies the mean of (v - c) . n / 2 above its
        centre c (Boubekeur and Alexa 2008, doi:10.1145/1409060.1409094): h^2 / (6 R) for edges h on a sphere.
        """
        corner = self._poly.regular_faces
        corners = np.asarray(self._poly.points, dtype=float)[corner]
        arms = corners - corners.mean(axis=1, keepdims=True)
        rise = np.einsum("mki,mki->m", arms, np.asarray(self._poly.point_data["Normals"], dtype=float)[corner]) / 6
        size = np.linalg.norm(arms, axis=2).max(axis=1)
        near = np.linalg.norm(corners.mean(axis=1) - around, axis=1) <= reach + size
        return float(np.abs(rise[near]).max(initial=0.0))


def _closest(poly: "PolyData", points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cells (n,) closest to points (n, 3), and their closest points (n, 3)."""
    if len(points) == 0:
        return np.empty(0, dtype=int), np.empty((0, 3))
    cells, feet = poly.find_closest_cell(np.ascontiguousarray(points, dtype=float), return_closest_point=True)
    return np.atleast_1d(cells), np.reshape(feet, (-1, 3))


def _cross(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def _height_in(xy: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """z (k,) of triangles (k, 3, 3) above points (k, 2); -inf if a point is not above its triangle."""
    flat = corners[:, :, :2]
    ahead, behind = (np.roll(flat, shift, axis=1) for shift in (-1, -2))
    area = _cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0])
    weight = _cross(ahead - xy[:, None], behind - xy[:, None]) / np.where(area == 0, np.nan, area)[:, None]
    # Rounding must not exclude a point on an edge from both of its triangles.
    inside = weight.min(axis=1) >= -checks.ROUNDING
    return np.where(inside, np.einsum("kc,kc->k", weight, corners[:, :, 2]), -np.inf)
