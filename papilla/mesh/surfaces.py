"""Surfaces of a finger for meshing and gauges: the exact ones of domes and slabs, and triangulations from files.

Each has level, projection, height and normal. All lengths in mm.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from papilla.core import checks
from papilla.core.errors import MeshError
from papilla.core.short_repr import short_repr
from papilla.mesh.cells import edges_of

if TYPE_CHECKING:
    from pyvista import PolyData

FEATURE_DEG = 30.0  # Normals of triangulations are smoothed across edges with a smaller angle
SMALLEST_MM, LARGEST_MM = 1.0, 1000.0  # Range of a finger's longest side (mm): other values are probably not in mm

Triangulation = tuple[np.ndarray, np.ndarray]
"""Vertices (n, 3) in mm and triangles (m, 3)."""


class Surface(Protocol):
    """Functions that meshing and gauges need of a surface; points are (n, 3) in mm."""

    def level(self, points: np.ndarray) -> np.ndarray:
        """(n,) mm: zero on the surface, negative inside; near the surface the signed distance to first order."""

    def project(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) points exactly on the surface, close to the given points if these are close to the surface."""

    def project_in_base(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) points on the curve where the surface meets the base plane, for points near that curve."""

    def height(self, xy: np.ndarray) -> np.ndarray:
        """(n,) z of the upper sheet over `xy` (n, 2); NaN outside."""

    def normal(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) unit outward normals at points on (or near) the surface."""


@dataclass(frozen=True)
class Ellipsoid:
    """The upper half of (x/a)^2 + (y/b)^2 + (z/c)^2 = 1 about the origin; `axes` are a, b, c."""

    axes: tuple[float, ...]

    @property
    def semi_axes(self) -> np.ndarray:
        """(3,) in mm."""
        return np.array(self.axes)

    def level(self, points: np.ndarray) -> np.ndarray:
        """(n,) (k - 1) / |grad k| with k = |(x/a, y/b, z/c)|: the signed distance to first order."""
        k = np.linalg.norm(points / self.semi_axes, axis=1)
        slope = np.linalg.norm(points / self.semi_axes**2, axis=1)
        # At the centre the gradient has no direction; any value gives the right sign.
        reach = np.divide(k, slope, out=np.full(len(points), float(self.semi_axes.min())), where=slope > 0)
        return (k - 1) * reach

    def project(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) the points scaled about the origin, or the cylinder's axis, onto the surface: zeros stay exactly zero.

        This is not the nearest point, but differs from it only to second order in the distance.
        """
        scale = np.linalg.norm(points / self.semi_axes, axis=1)[:, None]
        return np.where(np.isfinite(self.semi_axes), points / scale, points)

    project_in_base = project

    def height(self, xy: np.ndarray) -> np.ndarray:
        """(n,) z = c sqrt(1 - (x/a)^2 - (y/b)^2); NaN outside."""
        a, b, c = self.semi_axes
        square = 1 - (xy[:, 0] / a) ** 2 - (xy[:, 1] / b) ** 2
        return c * np.sqrt(np.where(square >= 0, square, np.nan))

    def normal(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) gradient of (x/a)^2 + (y/b)^2 + (z/c)^2, normalised."""
        gradient = points / self.semi_axes**2
        return gradient / np.linalg.norm(gradient, axis=1)[:, None]


@dataclass(frozen=True)
class EllipticCylinder(Ellipsoid):
    """The upper half of an elliptic cylinder along y with `axes` a and c; `level` ignores its ends."""

    depth: float

    @property
    def semi_axes(self) -> np.ndarray:
        """(3,) in mm, infinite along y."""
        return np.array([self.axes[0], np.inf, self.axes[1]])

    def height(self, xy: np.ndarray) -> np.ndarray:
        """(n,) as of an ellipsoid; NaN beyond |y| = depth / 2."""
        return np.where(np.abs(xy[:, 1]) <= self.depth / 2, super().height(xy), np.nan)


@dataclass(frozen=True, eq=False)
class TriangleSurface:
    """A closed, outward-oriented triangulation of the user, treated as exact geometry; lengths in mm.

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

        edges = np.sort(edges_of(self.triangles), axis=2)
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
        """(n, 3) closest points of the rim of the flat base, with z of the base plane; raises `MeshError` for points of
        a surface that is clear of this plane."""
        if not len(points):
            return np.empty((0, 3))
        if not self.in_base.any():
            raise MeshError("a layer above the base is thinner than its elements: use a smaller size")
        foot = _closest(self._rim, points)[1]
        foot[:, 2] = self.base_z
        return foot

    def height(self, xy: np.ndarray) -> np.ndarray:
        """(n,) largest z of the surface above each point of `xy` (n, 2); NaN if there is none."""
        from scipy.spatial import cKDTree

        z = np.full(len(xy), -np.inf)
        centre, radius = self._discs
        candidates = cKDTree(xy).query_ball_point(centre, radius) if len(xy) else []
        point = np.array([number for near in candidates for number in near], dtype=int)
        triangle = np.repeat(np.arange(len(candidates)), [len(near) for near in candidates])
        np.maximum.at(z, point, _height_in(xy[point], self.vertices[self.triangles[triangle]]))
        return np.where(np.isfinite(z), z, np.nan)

    @cached_property
    def _discs(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres (m, 2) and radii (m,) of discs in the x-y plane, each around a triangle."""
        corners = self.vertices[self.triangles][:, :, :2]
        centre = corners.mean(axis=1)
        return centre, np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1) * (1 + checks.ROUNDING_SHARE)

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
    inside = weight.min(axis=1) >= -checks.ROUNDING_SHARE
    return np.where(inside, np.einsum("kc,kc->k", weight, corners[:, :, 2]), -np.inf)
