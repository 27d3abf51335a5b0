"""The meshed part of a finger: its surfaces and flat faces, its mirrors, and the sites of its gauges. Lengths in mm."""

import math
from dataclasses import dataclass

import numpy as np

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.mesh.surface_files import read_nested
from papilla.mesh.surfaces import LARGEST_MM, SMALLEST_MM, Ellipsoid, EllipticCylinder, Surface, TriangleSurface
from papilla.model.finger import Dome, Finger, Gauge, Slab

SURFACE_NAMES = ("skin", "interface", "bone")  # Names of the surfaces, from the outside in
PATCH_RADIUS_SHARE = 0.75
"""Patch radius over `narrowest_mm`: 15 mm on the default finger, beyond which its skin is steep."""
WALKED_STEPS_A_HEIGHT = 68
"""Steps along a surface per height of its apex, with which arc lengths are accurate to 1e-4; on the interface of
the default finger they are 0.25 mm long."""


@dataclass(frozen=True)
class Plane:
    """A flat face where coordinate `axis` equals `value` (mm); `role` is "base", "mirror" or "end".

    `outward` is the sign of the coordinate's direction out of the body.
    """

    axis: int
    value: float
    outward: int
    role: str


@dataclass(frozen=True, eq=False)
class MeshGeometry:
    """The meshed part of a finger: all of it, or the quarter that `mirrors` repeat; `low` and `high` (3,) are its
    smallest and largest coordinates in mm."""

    surfaces: dict[str, Surface]
    planes: tuple[Plane, ...]
    mirrors: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray

    @property
    def apex(self) -> np.ndarray:
        """The point (3,) of the skin above the origin; raises `InputError` if there is none."""
        z = self.surfaces["skin"].height(np.zeros((1, 2)))[0]
        if np.isnan(z):
            raise InputError("the outer surface has nothing above x = 0, y = 0: centre the finger there")
        return np.array([0.0, 0.0, z])


def body_of(finger: Finger) -> MeshGeometry:
    """The body to mesh of a finger; raises what `surfaces_of` raises."""
    shape = finger.shape
    if isinstance(shape, Dome | Slab):
        longest = max(2 * max(shape.outer), getattr(shape, "depth", 0.0))
        checks.within("longest side of the finger (mm)", longest, SMALLEST_MM, LARGEST_MM)
    surfaces = surfaces_of(finger)
    skin = surfaces["skin"]
    if isinstance(skin, TriangleSurface):
        base = Plane(2, skin.base_z, -1, "base")
        return MeshGeometry(surfaces, (base,), (), skin.vertices.min(axis=0), skin.vertices.max(axis=0))
    planes = [Plane(0, 0.0, -1, "mirror"), Plane(1, 0.0, -1, "mirror"), Plane(2, 0.0, -1, "base")]
    high = shape.outer
    if isinstance(shape, Slab):
        high = (shape.outer[0], shape.depth / 2, shape.outer[1])
        planes.append(Plane(1, shape.depth / 2, 1, "end"))
    return MeshGeometry(surfaces, tuple(planes), ("x", "y"), np.zeros(3), np.array(high))


def narrowest_mm(finger: Finger) -> float:
    """Smallest of a finger's height and half breadths, without a slab's depth; raises what `surfaces_of` raises."""
    return min(_narrow_side_mm(finger))


def sharpest_mm(finger: Finger) -> float:
    """`narrowest_mm` or, if it is less, the apex's radius of curvature, that of an ellipsoid of this height and
    breadth."""
    breadth, height = _narrow_side_mm(finger)
    return min(breadth, height, breadth**2 / height)


def _narrow_side_mm(finger: Finger) -> tuple[float, float]:
    """Smaller half breadth, without a slab's depth, and height."""
    body = body_of(finger)
    x, y, height = (body.high - body.low).tolist()
    halves = [side if name in body.mirrors else side / 2 for name, side in zip("xy", (x, y), strict=True)]
    return halves[0] if isinstance(finger.shape, Slab) else min(halves), height


def patch_radius_mm(finger: Finger) -> float:
    """The largest distance of the contact from the touch-down point: the design's or, if it states none,
    `PATCH_RADIUS_SHARE` of `narrowest_mm`; on a slab also to the corners of a contact of that half width at both ends.

    Raises what `surfaces_of` raises, if the design states none.
    """
    if finger.patch_radius is not None:
        return finger.patch_radius
    along = finger.shape.depth / 2 if isinstance(finger.shape, Slab) else 0.0
    return math.hypot(PATCH_RADIUS_SHARE * narrowest_mm(finger), along)


def surfaces_of(finger: Finger) -> dict[str, Surface]:
    """The surfaces "skin", "interface" and "bone" of a finger.

    Raises `FileAccessError` or `FileFormatError` for surface files that cannot be used, `InputError` for a gauge of
    such a finger that does not lie on the interface.
    """
    shape = finger.shape
    if isinstance(shape, Dome):
        return dict(zip(SURFACE_NAMES, map(Ellipsoid, (shape.outer, shape.interface, shape.bone)), strict=True))
    if isinstance(shape, Slab):
        sections = zip(SURFACE_NAMES, (shape.outer, shape.interface, shape.bone), strict=True)
        return {name: EllipticCylinder(axes, shape.depth) for name, axes in sections}
    surfaces = read_nested((shape.outer, shape.interface, shape.bone))
    for gauge in finger.gauges:
        if np.isnan(surfaces[1].height(np.array([[gauge.x_mm, gauge.y_mm]]))[0]):
            raise InputError(
                f"gauge {gauge.name} lies outside the interface: {shape.interface} has nothing above "
                f"x {gauge.x_mm:g}, y {gauge.y_mm:g} mm"
            )
    return dict(zip(SURFACE_NAMES, surfaces, strict=True))


def gauge_site(finger: Finger, gauge: Gauge, interface: Surface) -> np.ndarray:
    """Point (3,) of the interface at the gauge's site, in mm; raises `InputError` if there is none."""
    x, shape = gauge.x_mm, finger.shape
    if x is None:
        # An ellipse parameter in the interface's section at the gauge's y
        assert isinstance(shape, Dome | Slab) and gauge.angle_deg is not None
        half_width = shape.interface[0]
        if isinstance(shape, Dome):
            half_width *= math.sqrt(1 - (gauge.y_mm / shape.interface[1]) ** 2)
        x = half_width * math.sin(math.radians(gauge.angle_deg))
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
    """The point (3,) of a surface at a distance (mm, positive or negative) from another point, in the section along x
    (0) or y (1); NaN if the surface ends before. Midpoint rule."""
    apex = float(surface.height(np.zeros((1, 2)))[0])
    tall = apex if math.isfinite(apex) else float(np.linalg.norm(start))
    at, steps = start, max(1, math.ceil(abs(distance) / (tall / WALKED_STEPS_A_HEIGHT))) if distance else 0
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


def facet_deviation(surface: Surface, around: np.ndarray, reach: float) -> float:
    """Distance (mm), within `reach` of a point (3,), of the facets of a surface from the smooth body that they
    approximate.

    It is 0 for exact surfaces. If the indentation is not much larger, the facets affect the contact.
    """
    deviation = getattr(surface, "facet_deviation", None)
    return 0.0 if deviation is None else float(deviation(around, reach))
