"""What is meshed of a finger: surfaces, flat faces, mirrors, and the closed triangulations for the mesher."""

from dataclasses import dataclass

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.finger import Dome, Finger, Slab
from papilla.mesh.soup import Triangulation, quarter_cylinder, quarter_ellipsoid, scattered
from papilla.mesh.surfaces import LARGEST_MM, SMALLEST_MM, Ellipsoid, EllipticCylinder, Surface, surfaces_of

FACETS_PER_RADIUS, FACET_SIZES = 18, 1.1
"""Triangulated curved faces have edges of the largest radius over the one, or element size times the other, if more."""


@dataclass(frozen=True)
class Plane:
    """A flat face where coordinate `axis` equals `value` (mm); `role` is "base", "mirror" or "end".

    `outward` is the sign of the coordinate's direction out of the body.
    """

    axis: int
    value: float
    outward: int
    role: str


@dataclass(frozen=True)
class Body:
    """The part of a finger that is meshed: all of it, or the quarter that `mirrors` repeat."""

    surfaces: dict[str, Surface]
    planes: tuple[Plane, ...]
    mirrors: tuple[str, ...]
    triangulations: tuple[Triangulation, ...]

    @property
    def low(self) -> np.ndarray:
        """Smallest coordinates (3,) in mm."""
        return self.triangulations[0][0].min(axis=0)

    @property
    def high(self) -> np.ndarray:
        """Largest coordinates (3,) in mm."""
        return self.triangulations[0][0].max(axis=0)

    @property
    def apex(self) -> np.ndarray:
        """The point (3,) of the skin over the origin; raises `InputError` where there is none."""
        z = self.surfaces["skin"].height(np.zeros((1, 2)))[0]
        if np.isnan(z):
            raise InputError("the outer surface has nothing above x = 0, y = 0: centre the finger there")
        return np.array([0.0, 0.0, z])


def body_of(finger: Finger, size_mm: float, variant: int = 0) -> Body:
    """The body to mesh of a finger with elements of `size_mm`; raises what `surfaces_of` raises.

    Each variant has its own triangulation of exact surfaces; those read from files are what they are.
    """
    if isinstance(finger.shape, Dome | Slab):
        longest = max(2 * max(finger.shape.outer), getattr(finger.shape, "depth", 0.0))
        checks.within("longest side of the finger (mm)", longest, SMALLEST_MM, LARGEST_MM)
    surfaces = surfaces_of(finger)
    if isinstance(finger.shape, Dome | Slab):
        planes = [Plane(0, 0.0, -1, "mirror"), Plane(1, 0.0, -1, "mirror"), Plane(2, 0.0, -1, "base")]
        if isinstance(finger.shape, Slab):
            planes.append(Plane(1, finger.shape.depth / 2, 1, "end"))
        facet = max(max(finger.shape.outer) / FACETS_PER_RADIUS, FACET_SIZES * size_mm)
        random = np.random.default_rng(variant)
        parts = tuple(_quarter(surface, facet, random if variant else None) for surface in surfaces.values())
        return Body(surfaces, tuple(planes), ("x", "y"), parts)
    from papilla.mesh.triangle_surface import TriangleSurface

    whole = [surface for surface in surfaces.values() if isinstance(surface, TriangleSurface)]
    base = Plane(2, whole[0].base_z, -1, "base")
    return Body(surfaces, (base,), (), tuple((surface.vertices, surface.triangles) for surface in whole))


def _quarter(surface: Surface, facet: float, random: np.random.Generator | None) -> Triangulation:
    assert isinstance(surface, Ellipsoid)
    divisions = max(6, round(np.pi / 2 * max(surface.axes) / facet))
    if isinstance(surface, EllipticCylinder):
        vertices, triangles = quarter_cylinder(surface, divisions)
    else:
        vertices, triangles = quarter_ellipsoid(surface, divisions)
    return (vertices if random is None else scattered(vertices, triangles, surface, random)), triangles
