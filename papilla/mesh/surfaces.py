"""The three surfaces of a finger (skin, interface, bone) as exact geometry: level, projection, height and normal.

Analytic shapes are defined here; surfaces read from files live in `papilla.mesh.triangle_surface`. All lengths in mm.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from papilla.errors import InputError
from papilla.finger import Dome, Finger, Gauge, Slab, Surfaces

NAMES = ("skin", "interface", "bone")  # Names of the surfaces, from the outside in
SMALLEST_MM, LARGEST_MM = 1.0, 1000.0  # A finger whose longest side is outside these was hardly written in mm
WALK_MM = 0.25  # Step along a surface: arc lengths within 1e-4 of it


class Surface(Protocol):
    """What meshing and gauges ask of a surface; points are (n, 3) in mm."""

    def level(self, points: np.ndarray) -> np.ndarray:
        """(n,) mm: zero on the surface, negative inside; near the surface the signed distance to first order."""

    def project(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) points exactly on the surface, near the given ones where these are near the surface."""

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
        # At the centre the gradient has no direction; any of its values gives the right sign.
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
        """(n,) z = c sqrt(1 - (x/a)^2 - (y/b)^2); NaN where that is not real."""
        a, b, c = self.semi_axes
        square = 1 - (xy[:, 0] / a) ** 2 - (xy[:, 1] / b) ** 2
        return c * np.sqrt(np.where(square >= 0, square, np.nan))

    def normal(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) gradient of (x/a)^2 + (y/b)^2 + (z/c)^2, normalised."""
        gradient = points / self.semi_axes**2
        return gradient / np.linalg.norm(gradient, axis=1)[:, None]


@dataclass(frozen=True)
class EllipticCylinder(Ellipsoid):
    """The upper half of an elliptic cylinder along y with `axes` a and c; `level` does not count its ends."""

    depth: float

    @property
    def semi_axes(self) -> np.ndarray:
        """(3,) in mm, infinite along y."""
        return np.array([self.axes[0], np.inf, self.axes[1]])

    def height(self, xy: np.ndarray) -> np.ndarray:
        """(n,) as of an ellipsoid; NaN beyond |y| = depth / 2."""
        return np.where(np.abs(xy[:, 1]) <= self.depth / 2, super().height(xy), np.nan)


def surfaces_of(finger: Finger) -> dict[str, Surface]:
    """The surfaces "skin", "interface" and "bone" of a finger.

    Raises `FileAccessError` or `FileFormatError` for surface files that cannot be used, `InputError` for a gauge of
    such a finger that does not lie on the interface.
    """
    shape = finger.shape
    if isinstance(shape, Dome):
        ellipsoids = [Ellipsoid(axes) for axes in (shape.outer, shape.interface, shape.bone)]
        return dict(zip(NAMES, ellipsoids, strict=True))
    if isinstance(shape, Slab):
        cylinders = [EllipticCylinder(axes, shape.depth) for axes in (shape.outer, shape.interface, shape.bone)]
        return dict(zip(NAMES, cylinders, strict=True))
    return _from_files(finger, shape)


def gauge_site(finger: Finger, gauge: Gauge, interface: Surface) -> np.ndarray:
    """Point (3,) of the interface where the gauge sits, in mm; raises `InputError` where there is none."""
    x = gauge.x_mm if gauge.x_mm is not None else _x_of_angle(finger, gauge)
    z = float(interface.height(np.array([[x, gauge.y_mm]]))[0])
    if not math.isfinite(z):
        raise InputError(f"gauge {gauge.name} lies outside the interface: nothing at x {x:g}, y {gauge.y_mm:g} mm")
    site = np.array([x, gauge.y_mm, z])
    for axis, distance in zip((0, 1), gauge.moved_mm, strict=True):
        site = _walked(interface, site, axis, distance)
    if not np.isfinite(site).all():
        raise InputError(f"gauge {gauge.name} was moved off the interface: moved_mm {list(gauge.moved_mm)}")
    return site


def _walked(surface: Surface, start: np.ndarray, axis: int, distance: float) -> np.ndarray:
    """The point (3,) of a surface at a distance (mm, of either sign) from another, in its section along x (0) or y (1);
    NaN where the surface ends before. Midpoint rule in steps of `WALK_MM`."""
    at, steps = start, max(1, math.ceil(abs(distance) / WALK_MM)) if distance else 0
    for _ in range(steps):
        half = at
        for share in (0.5, 1.0):
            normal = surface.normal(half[None])[0]
            onward = (
                at[:2] + share * distance / steps * normal[2] / math.hypot(normal[axis], normal[2]) * np.eye(2)[axis]
            )
            half = np.append(onward, surface.height(onward[None]))
            if not math.isfinite(half[2]):
                return half
        at = half
    return at


def _x_of_angle(finger: Finger, gauge: Gauge) -> float:
    """x (mm) of an ellipse parameter in the interface's section at the gauge's y."""
    shape = finger.shape
    assert isinstance(shape, Dome | Slab) and gauge.angle_deg is not None
    half_width = shape.interface[0]
    if isinstance(shape, Dome):
        half_width *= math.sqrt(1 - (gauge.y_mm / shape.interface[1]) ** 2)
    return half_width * math.sin(math.radians(gauge.angle_deg))


def facet_deviation(surface: Surface, around: np.ndarray, reach: float) -> float:
    """How far (mm) the facets of a surface within `reach` of a point (3,) lie from the smooth body they stand for.

    It is 0 for exact surfaces. A contact that is not much deeper feels the facets.
    """
    own = getattr(surface, "facet_deviation", None)
    return 0.0 if own is None else float(own(around, reach))


def _from_files(finger: Finger, shape: Surfaces) -> dict[str, Surface]:
    from papilla.mesh.surface_files import read_nested

    surfaces = read_nested((shape.outer, shape.interface, shape.bone))
    for gauge in finger.gauges:
        if np.isnan(surfaces[1].height(np.array([[gauge.x_mm, gauge.y_mm]]))[0]):
            raise InputError(
                f"gauge {gauge.name} lies outside the interface: {shape.interface} has nothing above "
                f"x {gauge.x_mm:g}, y {gauge.y_mm:g} mm"
            )
    return dict(zip(NAMES, surfaces, strict=True))
