"""Flat bodies in the finger's place: half-space, bonded layer and stacks, computed by the finger's code.

They are meshed for a contact of radius 1 mm. `stack_sphere` is the second method for stacks: a rigid sphere on them by
integral transforms.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.polynomial.legendre import leggauss

from papilla.core import settings
from papilla.fem import FingerModel, Press, ReducedFinger
from papilla.fem.reduction.patch import quadrature
from papilla.mesh.layered import LayeredMesh
from papilla.model.finger import Dome, Finger, Gauge, Layer
from papilla.model.specimen import HalfSpace, Sphere
from papilla.references import StackLayer, bonded_layer_sphere, halfspace_stiffness, layered_halfspace_stiffness
from papilla.verify.case import Case
from papilla.verify.structured import cylinder, growing

BODY_SIZES = settings.parameters(__name__)
BALL_RADIUS, BALL_SPECIMEN = BODY_SIZES.ball_mm, Sphere(BODY_SIZES.rigid_MPa, BODY_SIZES.ball_mm)
CHORDS_FOR_ELLIPSES, FEW_CHORDS = BODY_SIZES.chords_for_ellipses, BODY_SIZES.few_chords
PATCH_MM, DEEP_MM, FINEST_CELL_MM = (
    BODY_SIZES.patch_mm,
    BODY_SIZES.deep_mm,
    BODY_SIZES.fine_zone_mm / BODY_SIZES.rings,
)


@dataclass(frozen=True)
class PlaneSurface:
    """The plane at height `z` (mm) as a surface of `papilla.mesh.surfaces.Surface`."""

    z: float

    def level(self, points: np.ndarray) -> np.ndarray:
        """(n,) height above the plane."""
        return points[:, 2] - self.z

    def project(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) points straight above or below on the plane."""
        return np.column_stack([points[:, :2], np.full(len(points), self.z)])

    project_in_base = project

    def height(self, xy: np.ndarray) -> np.ndarray:
        """(n,) z of the plane, which has no end."""
        return np.full(len(xy), self.z)

    def normal(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) upwards."""
        return np.tile([0.0, 0.0, 1.0], (len(points), 1))


class FlatModel(FingerModel):
    """`FingerModel` of a mesh below z = 0 with flat skin, interface and bone; only the surfaces are another's.

    `sites` are the x (mm) of gauges of `length` mm along x at the depth `interface` (mm).
    """

    def __init__(
        self, mesh: LayeredMesh, outer: Layer, inner: Layer, patch_mm: float, *, interface=1.0, sites=(0.0,), length=1.0
    ):
        size = 10 * float(np.abs(mesh.points).max())
        shape = Dome((size,) * 3, (size / 2,) * 3, (size / 4,) * 3)
        # Closed forms are for one line of the grid
        sizes = {"length_mm": length, "width_mm": 1e-6 * length, "backing_mm": (2 * length, length)}
        gauges = tuple(Gauge(f"g{k}", x_mm=x, **sizes) for k, x in enumerate(sites))
        super().__init__(Finger("flat body", shape, outer, inner, gauges, patch_radius=patch_mm), mesh)
        bottom = float(mesh.points[:, 2].min())
        self.surfaces = {"skin": PlaneSurface(0.0), "interface": PlaneSurface(-interface), "bone": PlaneSurface(bottom)}


def with_gap(reduced: ReducedFinger, radius_x: float, radius_y: float) -> ReducedFinger:
    """The flat body with a skin of the gap x^2 / (2 Rx) + y^2 / (2 Ry), radii in mm, so that a flat presses on it."""
    points, weights, hats = quadrature(reduced.patch)
    gap = points[:, 0] ** 2 / (2 * radius_x) + points[:, 1] ** 2 / (2 * radius_y)
    return replace(reduced, patch=replace(reduced.patch, gap=reduced.patch.gap + hats.T @ (weights * gap)))


def half_space(layer: Layer, chords: int = BODY_SIZES.chords, **gauges: Any) -> FlatModel:
    """A graded block of `DEEP_MM` contact radii, with the gauges of `FlatModel`.

    It takes 2.1 GB with 8 chords a quarter circle, 1.6 with 6 and 1.1 with 4.
    """
    mesh = cylinder(
        _radii(DEEP_MM, BODY_SIZES.growth), growing(FINEST_CELL_MM, BODY_SIZES.growth_down, DEEP_MM), 3, chords
    )
    return FlatModel(mesh, layer, layer, PATCH_MM, **gauges)


def bonded_layer(layer: Layer, thickness: float, lower: Layer | None = None, sites=(0.0,)) -> FlatModel:
    """A layer of `thickness` mm on a rigid table, several times as wide; its lower half may be of another material."""
    depths, width = (growing(FINEST_CELL_MM, BODY_SIZES.growth_in_layer, thickness), BODY_SIZES.layer_width * thickness)
    mesh = cylinder(_radii(width, BODY_SIZES.growth_in_layer), depths, len(depths) // 2, BODY_SIZES.chords)
    return FlatModel(mesh, layer, lower or layer, PATCH_MM, interface=thickness / 2, sites=sites)


def coated(
    coat: Layer,
    substrate: Layer,
    thickness: float,
    depth: float,
    width: float,
    ratio=BODY_SIZES.growth,
    chords=BODY_SIZES.chords,
) -> FlatModel:
    """A coat of `thickness` mm on a substrate that reaches `depth` mm further down to a rigid table.

    Elements grow by `ratio` outwards and downwards; a hard coat bends over many thicknesses, and needs a small one.
    """
    top = growing(FINEST_CELL_MM, BODY_SIZES.growth_in_coat, thickness)
    below = thickness + growing(BODY_SIZES.below_coat * thickness, ratio, depth)[1:]
    mesh = cylinder(_radii(width, ratio), np.append(top, below), len(top) - 1, chords)
    return FlatModel(mesh, coat, substrate, PATCH_MM, interface=thickness)


def at_unit_contact(chi: float, modulus: float) -> tuple[float, float]:
    """Thickness and indentation (mm) at which the ball's contact on an incompressible bonded layer has a radius of
    1 mm, as the meshes are made for; `chi` is the root of ball radius times indentation, over the thickness."""
    unit = bonded_layer_sphere(1 / BALL_RADIUS, BALL_RADIUS, 1 / chi, modulus, 0.5)
    return 1 / (chi * unit.contact_radius), 1 / (BALL_RADIUS * unit.contact_radius**2)


def compared(name: str, against: str, pressed: Press, exact, **bounds: float) -> Iterator[Case]:
    """A case for each quantity that has a bound: "force", "radius" or "area" of contact, "peak_pressure" ..."""
    for key, bound in bounds.items():
        word = key.replace("_", " ")
        measure = f"contact {word}" if key in ("area", "radius") else word
        yield Case(f"{name}, {word}", f"{measure} {against}", off(_of(pressed, key), _of(exact, key)), bound)


def off(computed: float, exact: float) -> float:
    """Relative error."""
    return abs(float(computed) / float(exact) - 1)


def apart(computed: np.ndarray, exact: np.ndarray) -> float:
    """Largest difference over the largest exact value."""
    return float(np.abs(computed - exact).max() / np.abs(exact).max())


def _of(contact, key: str) -> float:
    """The quantity `key` of a contact, or its area from a radius, or the reverse."""
    circle = getattr(contact, "contact_area", None) or np.pi * getattr(contact, "contact_radius", np.nan) ** 2
    area = getattr(contact, "area", circle)
    quantities = {"area": area, "radius": np.sqrt(area / np.pi)}
    return quantities[key] if key in quantities else getattr(contact, key)


def surface_pressure(reduced: ReducedFinger, pressure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (k, 2) in mm and forces (k,) in N that represent a nodal pressure on the whole patch."""
    points, weights, hats = quadrature(reduced.patch, subdivisions=2)
    force = weights * (hats @ pressure)
    images = reduced.patch.images
    return np.concatenate([points * image for image in images]), np.tile(force, len(images))


def _radii(width: float, ratio: float) -> np.ndarray:
    fine = np.linspace(0, BODY_SIZES.fine_zone_mm, BODY_SIZES.rings + 1)
    return np.append(fine, BODY_SIZES.fine_zone_mm + growing(ratio * fine[1], ratio, width)[1:])


@dataclass(frozen=True)
class StackContact:
    """Force (N), indentation (mm) and peak pressure (MPa) of a contact of a given radius (mm)."""

    contact_radius: float
    force: float
    indentation: float
    peak_pressure: float


def stack_sphere(
    contact_radius: float, radius: float, layers: Sequence[StackLayer], base: HalfSpace | None
) -> StackContact:
    """Rigid frictionless sphere of `radius` mm (as a paraboloid) on a stack, for a contact of `contact_radius` mm.

    With the pressure's Hankel transform int_0^a phi(t) cos(qt) dt and W(q) = 1 - E* q / (2 K(q)), K the stack's
    stiffness and E* its top layer's contact modulus, the displacement d - r^2/(2R) under the sphere demands

        phi(t) - (2/pi) int_0^a phi(s) int_0^inf W(q) cos(qs) cos(qt) dq ds = (E*/pi) (d - t^2/R),  phi(a) = 0,

    which is linear in d and 1/R; F = 2 pi int phi dt and p(0) = -int phi'(t)/t dt.
    Source: Lebedev and Ufliand (1958), PMM 22, 442; the stiffness of stacks is `layered_halfspace_stiffness`.
    """
    top = layers[0]
    e_star = top.modulus / (1 - top.nu**2)
    x, weights = leggauss(BODY_SIZES.nodes)
    tau, weights = np.append((x + 1) / 2, 1.0), np.append(weights / 2, 0.0)
    q, q_weights = _wavenumbers(top.thickness, contact_radius)
    lacking = 1 - halfspace_stiffness(q, e_star) / layered_halfspace_stiffness(q, layers, base)
    waves = np.cos(contact_radius * np.outer(tau, q))
    coupling = 2 / math.pi * contact_radius * (waves * (q_weights * lacking)) @ waves.T
    right = np.stack([np.ones_like(tau), (contact_radius * tau) ** 2 / radius], axis=1)
    flat, bowl = np.linalg.solve(np.eye(len(tau)) - coupling * weights, right).T
    indentation = float(bowl[-1] / flat[-1])
    phi = e_star / math.pi * (indentation * flat - bowl)
    slope = Chebyshev.fit(tau**2, phi, BODY_SIZES.nodes // 2, domain=[0, 1]).deriv()
    return StackContact(
        contact_radius=contact_radius,
        force=2 * math.pi * contact_radius * float(weights @ phi),
        indentation=indentation,
        peak_pressure=-2 / contact_radius * float(weights @ slope(tau**2)),
    )


def _wavenumbers(thickness: float, contact_radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights (1/mm) from 0 to the cutoff; panels shrink towards 0, where a hard coat acts as a plate."""
    longest, widest = (BODY_SIZES.cutoff / thickness, min(1 / thickness, BODY_SIZES.widest / contact_radius))
    edges = np.append(0, np.geomspace(BODY_SIZES.narrowest * widest, widest, BODY_SIZES.panels))
    edges = np.append(edges, np.linspace(widest, longest, 2 + math.ceil((longest - widest) / widest))[1:])
    x, weights = leggauss(BODY_SIZES.panel_nodes)
    width = np.diff(edges)
    nodes = edges[:-1, None] + width[:, None] * (x + 1) / 2
    return nodes.ravel(), (width[:, None] * weights / 2).ravel()
