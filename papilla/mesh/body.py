"""The meshed part of a finger: surfaces, flat faces, mirrors, and the closed triangulations for the mesher."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.finger import Dome, Finger, Slab
from papilla.mesh.finger_surfaces import surfaces_of
from papilla.mesh.soup import Triangulation, quarter_cylinder, quarter_ellipsoid, scattered
from papilla.mesh.surfaces import LARGEST_MM, SMALLEST_MM, Ellipsoid, EllipticCylinder, Surface

FACETS_PER_RADIUS, FACET_SIZES = 18, 1.1
"""Edges on curved faces have the length of the largest radius over the first number, or the element size times the
second, if that is longer."""


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
class Body:
    """The meshed part of a finger: all of it, or the quarter that `mirrors` repeat.

    Parameters
    ----------
    low, high : (3,) smallest and largest coordinates in mm.
    facet_mm, variant : edge length of the triangulations of exact surfaces, and number of the variant: each has its own
        triangulation.
    """

    surfaces: dict[str, Surface]
    planes: tuple[Plane, ...]
    mirrors: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    facet_mm: float = math.inf
    variant: int = 0

    @cached_property
    def triangulations(self) -> tuple[Triangulation, ...]:
        """A closed triangulation of each nested body, for the mesher; surfaces from files keep their own."""
        random = np.random.default_rng(self.variant) if self.variant else None
        return tuple(_triangulated(surface, self.facet_mm, random) for surface in self.surfaces.values())

    @property
    def apex(self) -> np.ndarray:
        """The point (3,) of the skin above the origin; raises `InputError` if there is none."""
        z = self.surfaces["skin"].height(np.zeros((1, 2)))[0]
        if np.isnan(z):
            raise InputError("the outer surface has nothing above x = 0, y = 0: centre the finger there")
        return np.array([0.0, 0.0, z])


def body_of(finger: Finger, size_mm: float, variant: int = 0) -> Body:
    """The body to mesh of a finger with elements of `size_mm`; raises what `surfaces_of` raises."""
    shape = finger.shape
    if isinstance(shape, Dome | Slab):
        longest = max(2 * max(shape.outer), getattr(shape, "depth", 0.0))
        checks.within("longest side of the finger (mm)", longest, SMALLEST_MM, LARGEST_MM)
    surfaces = surfaces_of(finger)
    if isinstance(shape, Dome | Slab):
        planes = [Plane(0, 0.0, -1, "mirror"), Plane(1, 0.0, -1, "mirror"), Plane(2, 0.0, -1, "base")]
        high = shape.outer if isinstance(shape, Dome) else (shape.outer[0], shape.depth / 2, shape.outer[1])
        if isinstance(shape, Slab):
            planes.append(Plane(1, shape.depth / 2, 1, "end"))
        facet = max(max(shape.outer) / FACETS_PER_RADIUS, FACET_SIZES * size_mm)
        return Body(surfaces, tuple(planes), ("x", "y"), np.zeros(3), np.array(high), facet, variant)
    from papilla.mesh.triangle_surface import TriangleSurface

    skin = surfaces["skin"]
    assert isinstance(skin, TriangleSurface)
    base = Plane(2, skin.base_z, -1, "base")
    return Body(surfaces, (base,), (), skin.vertices.min(axis=0), skin.vertices.max(axis=0))


def narrowest_mm(finger: Finger) -> float:
    """Smallest of a finger's height and half breadths, without a slab's depth; raises what `surfaces_of` raises."""
    body = body_of(finger, LARGEST_MM)
    half = (body.high - body.low) / [1 if name in body.mirrors else 2 for name in "xyz"]
    half[2] *= 2
    return float(half[[0, 2]].min() if isinstance(finger.shape, Slab) else half.min())


def _triangulated(surface: Surface, facet: float, random: np.random.Generator | None) -> Triangulation:
    """A closed triangulation of a surface with edges of about `facet` mm; with `random` its points are shifted along
    the surface."""
    if not isinstance(surface, Ellipsoid):
        from papilla.mesh.triangle_surface import TriangleSurface

        assert isinstance(surface, TriangleSurface)
        return surface.vertices, surface.triangles
    divisions = max(6, round(np.pi / 2 * max(surface.axes) / facet))
    if isinstance(surface, EllipticCylinder):
        vertices, triangles = quarter_cylinder(surface, divisions)
    else:
        vertices, triangles = quarter_ellipsoid(surface, divisions)
    return (vertices if random is None else scattered(vertices, triangles, surface, random)), triangles
