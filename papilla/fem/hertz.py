"""The `hertz` rung: a Hertzian ellipse of pressure whose size minimises the energy, on the finger's influence rows.

For a pressure p = p0 sqrt(1 - (x/a)^2 - (y/b)^2) of force F on surfaces of gap x^2/(2 Rx) + y^2/(2 Ry), the energy is
F^2 c(a) / 2 + F (a^2/Rx + b^2/Ry) / 10; with the c of a half-space, 3 / (5 a E*) for a circle, its minimum is Hertz's
own result. Here E*(a) of finger and specimen is measured on their compliance, so that layers, bone and a thin specimen
count; towards a = 0 it is the outer layer's. A scene is then a look-up in tables over a.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from papilla.errors import ContactRangeError
from papilla.fem.compliance import quadrature
from papilla.fem.reduced import ReducedFinger
from papilla.fem.scene import Press, press_result
from papilla.references import hertz_ellipse
from papilla.references.hertz import MAX_RADIUS_RATIO
from papilla.specimen import Specimen, Sphere

SMALLEST = 2.0
"""Smallest radius, in patch edge lengths, at which E* is measured; below, it goes to its known limit at a = 0."""

ELLIPSE_SUBDIVISIONS = 6
"""Parts of a triangle's edge for the integral of a Hertzian pressure."""

TABLE_POINTS = 32

CURVATURE_REACH = 4.0
"""Distance (mm) from the touch-down point over which the skin's curvature is fitted."""


@dataclass(frozen=True, eq=False)
class HertzTable:
    """Force-indexed tables of Hertz presses of one finger on one specimen.

    force, radius, indentation : (k,) N, mm, mm; strain, curvature : (k, g) per newton; aspect = b / a.
    """

    force: np.ndarray
    radius: np.ndarray
    indentation: np.ndarray
    strain: np.ndarray
    curvature: np.ndarray
    aspect: float


@dataclass(frozen=True)
class HertzScene:
    """Semi-axes (mm), peak pressure (MPa), indentation (mm) and gauge quantities (g,) of one Hertz press."""

    force: float
    semi_axes: tuple[float, float]
    peak_pressure: float
    indentation: float
    strain: np.ndarray
    curvature: np.ndarray


def hertz_scene(
    reduced: ReducedFinger, specimen: Specimen, force: float | None, indentation: float | None
) -> HertzScene:
    """One press by force (N) or indentation (mm); raises `ContactRangeError` where the ellipse leaves the patch."""
    table = hertz_table(reduced, specimen)
    cube_root = np.cbrt(table.force)
    if indentation is not None:
        _refuse_beyond(indentation, table.indentation[-1], "an indentation", "mm")
        # Interpolated as below, in force^(2/3), where Hertz's law is a straight line
        force = float(np.interp(indentation, table.indentation, cube_root**2) ** 1.5)
    assert force is not None
    _refuse_beyond(force, table.force[-1] * (1 + 1e-12), "a force", "N")
    at = np.cbrt(force)
    radius = float(np.interp(at, cube_root, table.radius))
    semi_axes = (radius, radius * table.aspect)
    return HertzScene(
        force=force,
        semi_axes=semi_axes,
        peak_pressure=1.5 * force / (np.pi * semi_axes[0] * semi_axes[1]),
        indentation=float(np.interp(at**2, cube_root**2, table.indentation)),
        strain=force * np.array([np.interp(at, cube_root, column) for column in table.strain.T]),
        curvature=force * np.array([np.interp(at, cube_root, column) for column in table.curvature.T]),
    )


def hertz_press(
    reduced: ReducedFinger,
    specimen: Specimen,
    force: float | None,
    indentation: float | None,
    status: str,
    began: float,
) -> Press:
    """One press by force (N) or indentation (mm) as a `Press` that says `status`; raises `ContactRangeError`."""
    scene = hertz_scene(reduced, specimen, force, indentation)
    a, b = scene.semi_axes
    patch = reduced.patch
    x, y = patch.xy.T
    shape = np.sqrt(np.maximum(0.0, 1 - (x / a) ** 2 - (y / b) ** 2))
    # An ellipse between the nodes goes to the nearest one; whatever they sample of it, they carry the force
    shape[np.argmin(np.hypot(x, y))] += float(not shape.any())
    pressure = scene.force / (reduced.multiplicity * patch.mass @ shape) * shape
    return press_result(
        reduced,
        specimen,
        began,
        force=scene.force,
        fidelity="hertz",
        indentation=scene.indentation,
        contact_area=float(np.pi * a * b),
        peak_pressure=scene.peak_pressure,
        strain=scene.strain,
        curvature=scene.curvature,
        force_balance=abs(float(reduced.multiplicity * patch.mass @ pressure) - scene.force) / scene.force,
        status=status,
        resolved=True,
        pressure=pressure,
        active=shape > 0,
    )


@lru_cache(maxsize=64)
def hertz_table(reduced: ReducedFinger, specimen: Specimen) -> HertzTable:
    """Tables over the contact radius, from nothing to where the ellipse reaches the rim of the patch."""
    rx, ry = _radii(reduced, specimen)
    unit = hertz_ellipse(1.0, rx, ry, 1.0)
    aspect = unit.b / unit.a
    bend = (1 / rx + aspect**2 / ry) / 10
    largest = _largest_radius(reduced, aspect)
    edge = float(reduced.patch.edge_length[np.argmin(reduced.patch.node_gap)])
    if min(largest, largest * aspect) < SMALLEST * edge:
        raise ContactRangeError(
            f"rung hertz needs a patch that holds its ellipse: {largest:.2g} x {largest * aspect:.2g} mm at most "
            f"on {edge:.2g} mm elements"
        )
    smallest = min(SMALLEST * edge, largest / 4)
    radius = np.append(np.geomspace(1e-3 * smallest, smallest, 40)[:-1], np.linspace(smallest, largest, 400))
    # Mean displacement under unit force: 0.8 of Hertz's at the centre, for any aspect
    compliance = CubicSpline(
        radius, 0.8 * unit.indentation * unit.a / _modulus(reduced, specimen, aspect, smallest, largest)(radius)
    )
    slope = compliance(radius, 1) / radius - compliance(radius) / radius**2
    force = -4 * bend * radius / slope
    keep = np.append(True, np.diff(np.maximum.accumulate(force)) > 0) & (force > 0)
    indentation = force * compliance(radius) / radius + bend * radius**2
    influence = _influence(reduced, aspect, smallest, largest)(radius[keep] ** 2)
    gauges = len(reduced.gauge_names)
    return HertzTable(
        force=np.append(0, force[keep]),
        radius=np.append(0, radius[keep]),
        indentation=np.append(0, indentation[keep]),
        strain=np.vstack([influence[:1, :gauges], influence[:, :gauges]]),
        curvature=np.vstack([influence[:1, gauges:], influence[:, gauges:]]),
        aspect=aspect,
    )


def _modulus(reduced, specimen, aspect: float, smallest: float, largest: float) -> PchipInterpolator:
    """E* (MPa) of finger and specimen under a Hertzian ellipse, as a function of its radius from 0 to `largest`."""
    tabulated = np.geomspace(smallest, largest, TABLE_POINTS)
    shapes = _ellipses(reduced, tuple(tabulated), aspect)
    own = reduced.compliance + reduced.specimen_compliance(specimen)
    energy = (np.einsum("ki,ij,kj->k", shapes, matrix, shapes, optimize=True) for matrix in (reduced.half_space, own))
    limit = 1 / (1 / reduced.outer_modulus + (1 - specimen.nu**2) / specimen.modulus)
    return PchipInterpolator(np.append(0, tabulated), np.append(limit, np.divide(*energy)))


@lru_cache(maxsize=8)
def _influence(reduced: ReducedFinger, aspect: float, smallest: float, largest: float) -> PchipInterpolator:
    """Gauge strain and curvature (2 g,) per newton on a Hertzian ellipse, as a function of its radius squared."""
    radii = (*(np.linspace(0.05, 0.95, 10) * smallest), *np.geomspace(smallest, largest, TABLE_POINTS))
    shapes = _ellipses(reduced, radii, aspect)
    rows = np.concatenate([reduced.strain_rows, reduced.curvature_rows])
    load = reduced.multiplicity * shapes @ reduced.patch.mass
    # On a coarse patch the smallest ellipses fall between the quadrature points
    caught = load > 0
    per_force = (shapes @ rows.T)[caught] / load[caught, None]
    return PchipInterpolator(np.append(0, np.square(radii)[caught]), np.vstack([per_force[:1], per_force]))


@lru_cache(maxsize=16)
def _ellipses(reduced: ReducedFinger, radii: tuple[float, ...], aspect: float) -> np.ndarray:
    """Nodal pressures (k, n) of Hertzian ellipses of unit peak, projected so that force and moments are kept."""
    points, weights, hats = quadrature(reduced.patch, subdivisions=ELLIPSE_SUBDIVISIONS)
    square = points[:, 0] ** 2 + (points[:, 1] / aspect) ** 2
    shape = np.sqrt(np.maximum(0.0, 1 - square / np.square(radii)[:, None]))
    mass = (hats.T @ (hats.multiply(weights[:, None]))).toarray()
    return np.linalg.solve(mass, (hats.T @ (weights * shape).T)).T


def _radii(reduced: ReducedFinger, specimen: Specimen) -> tuple[float, float]:
    """Radii of curvature (mm) of the gap along x and y of the contact plane, fitted near the touch-down point."""
    patch = reduced.patch
    points, weights, hats = quadrature(patch)
    x, y = points.T
    terms = np.stack([x**2 / 2, y**2 / 2, x * y, x**4, x**2 * y**2, y**4, np.ones_like(x)], axis=1)
    distance = np.hypot(*patch.xy.T)
    near = distance <= max(CURVATURE_REACH, np.sort(distance)[min(15, len(distance) - 1)])
    weak_terms = (hats.T @ (weights[:, None] * terms))[near] / patch.mass[near, None]
    curvature_x, curvature_y = np.linalg.lstsq(weak_terms, patch.node_gap[near], rcond=None)[0][:2]
    if isinstance(specimen, Sphere):
        curvature_x, curvature_y = curvature_x + 1 / specimen.radius, curvature_y + 1 / specimen.radius
    if min(curvature_x, curvature_y) <= max(curvature_x, curvature_y) / MAX_RADIUS_RATIO:
        raise ContactRangeError("rung hertz needs a skin that is convex, in both directions, where it is touched")
    return 1 / curvature_x, 1 / curvature_y


def _largest_radius(reduced: ReducedFinger, aspect: float) -> float:
    """Semi-axis a (mm) of the largest ellipse that stays inside the patch, whether the skin goes on there or ends."""
    x, y = reduced.patch.xy[reduced.patch.outline].T
    return float(np.sqrt(x**2 + (y / aspect) ** 2).min())


def _refuse_beyond(value, limit: float, what: str, unit: str) -> None:
    if value > limit:
        raise ContactRangeError(
            f"{what} of {value:g} {unit} takes the contact to the rim of its patch ({limit:.3g} {unit})"
        )
