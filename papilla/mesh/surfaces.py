"""The interface of a finger's surfaces for meshing and gauges, and the exact surfaces of domes and slabs: level,
projection, height and normal. Surfaces of triangles are in `papilla.mesh.triangle_surface`. All lengths in mm."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

SMALLEST_MM, LARGEST_MM = 1.0, 1000.0  # Range of a finger's longest side (mm): other values are probably not in mm


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
