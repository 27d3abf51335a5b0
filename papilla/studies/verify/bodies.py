"""Flat bodies of the contact cases: half-space, bonded layer and stacks, meshed for a contact of radius 1 mm."""

from collections.abc import Iterator

import numpy as np

from papilla.fem import Press, ReducedFinger
from papilla.fem.reduction.patch import quadrature
from papilla.finger import Layer
from papilla.references import bonded_layer_sphere
from papilla.specimen import Sphere
from papilla.studies.case import Case
from papilla.studies.verify.flat import FlatModel
from papilla.studies.verify.structured import cylinder, growing

BALL_RADIUS = 100.0
"""Radius (mm) of the ball: large compared with the contact, so that ball and paraboloid agree."""

BALL = Sphere(1e9, BALL_RADIUS)

RINGS, FINE_ZONE, PATCH = 14, 1.3, 1.7
"""Rings of equal width up to the fine zone's radius, and the patch's radius, in mm."""

CHORDS, CHORDS_FOR_ELLIPSES, FEW_CHORDS = 6, 8, 4
"""Chords per quarter circle: usually, for ellipses, and where a coarse circle suffices."""

DEEP = 600.0
"""Width and depth (mm) of the block that represents a half-space: its clamped boundary costs 0.2 % of the force."""


def half_space(
    layer: Layer, chords: int = CHORDS, gauge_sites: tuple[float, ...] = (0.0,), gauge_depth: float = 1.0
) -> FlatModel:
    """A graded block of `DEEP` contact radii, with gauges of 0.5 mm at a depth (mm) below the surface.

    It takes 2.1 GB with 8 chords a quarter circle, 1.6 with 6 and 1.1 with 4.
    """
    mesh = cylinder(_radii(DEEP, 1.6), growing(FINE_ZONE / RINGS, 1.5, DEEP), 3, chords)
    return FlatModel(mesh, layer, layer, PATCH, interface=gauge_depth, gauge_sites=gauge_sites, gauge_length=0.5)


def bonded_layer(
    layer: Layer, thickness: float, lower: Layer | None = None, gauge_sites: tuple[float, ...] = (0.0,)
) -> FlatModel:
    """A layer of `thickness` mm on a rigid table, eight times as wide; its lower half may be of another material."""
    depths = growing(FINE_ZONE / RINGS, 1.45, thickness)
    mesh = cylinder(_radii(8 * thickness, 1.45), depths, len(depths) // 2, CHORDS)
    return FlatModel(mesh, layer, lower or layer, PATCH, interface=thickness / 2, gauge_sites=gauge_sites)


def coated(
    coat: Layer,
    substrate: Layer,
    thickness: float,
    *,
    depth: float,
    width: float,
    ratio: float = 1.6,
    chords: int = CHORDS,
) -> FlatModel:
    """A coat of `thickness` mm on a substrate that reaches `depth` mm further down to a rigid table.

    Elements grow by `ratio` outwards and downwards; a hard coat bends over many thicknesses, and needs a small one.
    """
    top = growing(FINE_ZONE / RINGS, 1.35, thickness)
    below = thickness + growing(0.2 * thickness, ratio, depth)[1:]
    mesh = cylinder(_radii(width, ratio), np.append(top, below), len(top) - 1, chords)
    return FlatModel(mesh, coat, substrate, PATCH, interface=thickness)


def at_unit_contact(chi: float, modulus: float) -> tuple[float, float]:
    """Thickness and indentation (mm) at which the ball's contact on an incompressible bonded layer has a radius of
    1 mm, as the meshes are made for, and `chi` thicknesses."""
    unit = bonded_layer_sphere(1 / BALL_RADIUS, BALL_RADIUS, 1 / chi, modulus, 0.5)
    return 1 / (chi * unit.contact_radius), 1 / (BALL_RADIUS * unit.contact_radius**2)


def compared(name: str, against: str, found: Press, exact, **bounds: float) -> Iterator[Case]:
    """A case for each quantity that has a bound: "force", "radius" or "area" of contact, "peak_pressure" ..."""
    for key, bound in bounds.items():
        word = key.replace("_", " ")
        measure = f"contact {word}" if key in ("area", "radius") else word
        yield Case(f"{name}, {word}", f"{measure} {against}", off(_of(found, key), _of(exact, key)), bound)


def off(found: float, exact: float) -> float:
    """Relative error."""
    return abs(float(found) / float(exact) - 1)


def _of(contact, key: str) -> float:
    """The quantity `key` of a contact, or its area from a radius, or the reverse."""
    circle = getattr(contact, "contact_area", None) or np.pi * getattr(contact, "contact_radius", np.nan) ** 2
    area = getattr(contact, "area", circle)
    known = {"area": area, "radius": np.sqrt(area / np.pi)}
    return known[key] if key in known else getattr(contact, key)


def surface_pressure(reduced: ReducedFinger, pressure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (k, 2) in mm and forces (k,) in N that represent a nodal pressure on the whole patch."""
    points, weights, hats = quadrature(reduced.patch, subdivisions=2)
    force = weights * (hats @ pressure)
    images = reduced.patch.images
    return np.concatenate([points * image for image in images]), np.tile(force, len(images))


def _radii(width: float, ratio: float) -> np.ndarray:
    fine = np.linspace(0, FINE_ZONE, RINGS + 1)
    return np.append(fine, FINE_ZONE + growing(ratio * fine[1], ratio, width)[1:])
