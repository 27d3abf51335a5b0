"""Skin, interface and bone of a finger as surfaces, and where its gauges sit on the interface. All lengths in mm."""

import math

import numpy as np

from papilla.errors import InputError
from papilla.finger import Dome, Finger, Gauge, Slab, Surfaces
from papilla.mesh.surface_files import read_nested
from papilla.mesh.surfaces import Ellipsoid, EllipticCylinder, Surface

NAMES = ("skin", "interface", "bone")  # Names of the surfaces, from the outside in
WALK_MM = 0.25  # Step along a surface, with which arc lengths are accurate to 1e-4


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


def _from_files(finger: Finger, shape: Surfaces) -> dict[str, Surface]:
    """The surfaces of a finger that reads them from files, with its gauges checked."""
    surfaces = read_nested((shape.outer, shape.interface, shape.bone))
    for gauge in finger.gauges:
        if np.isnan(surfaces[1].height(np.array([[gauge.x_mm, gauge.y_mm]]))[0]):
            raise InputError(
                f"gauge {gauge.name} lies outside the interface: {shape.interface} has nothing above "
                f"x {gauge.x_mm:g}, y {gauge.y_mm:g} mm"
            )
    return dict(zip(NAMES, surfaces, strict=True))


def gauge_site(finger: Finger, gauge: Gauge, interface: Surface) -> np.ndarray:
    """Point (3,) of the interface at the gauge's site, in mm; raises `InputError` if there is none."""
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
    """The point (3,) of a surface at a distance (mm, positive or negative) from another point, in the section along x
    (0) or y (1); NaN if the surface ends before. Midpoint rule in steps of `WALK_MM`."""
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
    """x (mm) for an ellipse parameter in the interface's section at the gauge's y."""
    shape = finger.shape
    assert isinstance(shape, Dome | Slab) and gauge.angle_deg is not None
    half_width = shape.interface[0]
    if isinstance(shape, Dome):
        half_width *= math.sqrt(1 - (gauge.y_mm / shape.interface[1]) ** 2)
    return half_width * math.sin(math.radians(gauge.angle_deg))


def facet_deviation(surface: Surface, around: np.ndarray, reach: float) -> float:
    """Distance (mm), within `reach` of a point (3,), of the facets of a surface from the smooth body that they
    approximate.

    It is 0 for exact surfaces. If the indentation is not much larger, the facets affect the contact.
    """
    own = getattr(surface, "facet_deviation", None)
    return 0.0 if own is None else float(own(around, reach))
