"""Elastic half-space under a point force and under a uniformly loaded disc (mm, N, MPa; z is depth into the solid)."""

import math

import numpy as np
from scipy.special import ellipe, ellipkm1

from papilla import checks
from papilla.errors import InputError


def boussinesq_displacement(points, force: float, modulus: float, nu: float):
    """Displacement in mm under a point force along +z (into the solid) at the origin: u_z = F/(pi E* r) on the surface.

    u_z = F/(4 pi G) [z^2/s^3 + 2(1-nu)/s], u_x = F/(4 pi G) [x z/s^3 - (1-2nu) x/(s (s+z))], u_y alike; s = |point|.

    `points` is (..., 3) in mm with z >= 0, `force` in N, `modulus` in MPa; the result is (..., 3).
    Raises `InputError` for points above the surface, at the origin or not finite, modulus <= 0, nu outside [0, 0.5].
    Source: Johnson (1985), section 3.2, doi:10.1017/CBO9781139171731.
    """
    points, s = surface_points(points)
    modulus, nu = checks.positive("modulus (MPa)", modulus), checks.poisson("nu", nu)
    z = points[..., 2:]
    scale = checks.finite("force (N)", force) * (1 + nu) / (2 * math.pi * modulus)
    radial = z / s**3 - (1 - 2 * nu) / (s * (s + z))
    return scale * np.concatenate([points[..., :2] * radial, z**2 / s**3 + 2 * (1 - nu) / s], axis=-1)


def boussinesq_stress(points, force: float, nu: float):
    """Stress in MPa (tension positive) under a point force along +z at the origin; independent of the modulus.

    `points` is (..., 3) in mm with z >= 0, `force` in N; the result is (..., 3, 3).
    Raises `InputError` for points above the surface, at the origin or not finite, or nu outside [0, 0.5].
    Source: Johnson (1985), section 3.2, doi:10.1017/CBO9781139171731.
    """
    points, s = surface_points(points)
    nu, scale = checks.poisson("nu", nu), checks.finite("force (N)", force) / (2 * math.pi)
    z, s = points[..., 2:, None], s[..., None]
    stress = -3 * z * points[..., :, None] * points[..., None, :] / s**5
    plane = points[..., :2]
    hoop = np.eye(2) * (1 / (s * (s + z)) - z / s**3)
    dyad = plane[..., :, None] * plane[..., None, :] * (2 * s + z) / (s**3 * (s + z) ** 2)
    # hoop - dyad is the in-plane part that vanishes for nu = 0.5
    stress[..., :2, :2] -= (1 - 2 * nu) * (hoop - dyad)
    return scale * stress


def boussinesq_strain(points, force: float, modulus: float, nu: float):
    """Strain tensor (..., 3, 3) under a point force: Hooke's law on `boussinesq_stress`, whose arguments it takes.

    Raises `InputError` as `boussinesq_stress` does, and for modulus (MPa) <= 0.
    Source: Johnson (1985), section 3.2, doi:10.1017/CBO9781139171731.
    """
    stress = boussinesq_stress(points, force, nu)
    trace = np.trace(stress, axis1=-2, axis2=-1)[..., None, None]
    return ((1 + nu) * stress - nu * trace * np.eye(3)) / checks.positive("modulus (MPa)", modulus)


def uniform_disc_displacement(r, radius: float, pressure: float, e_star: float):
    """Normal surface displacement in mm at distances r >= 0 (mm, any shape) from the middle of a loaded disc.

    Inside (4 p c/(pi E*)) E(r^2/c^2); outside (4 p r/(pi E*)) [E(c^2/r^2) - (1 - c^2/r^2) K(c^2/r^2)], c the radius.
    The middle sinks by 2 p c/E*. Raises `InputError` for r negative or not finite, radius or e_star <= 0.
    Source: Johnson (1985), section 3.4, doi:10.1017/CBO9781139171731.
    """
    r = np.asarray(r, dtype=float)
    if not np.all(np.isfinite(r) & (r >= 0)):
        raise InputError(f"distance r (mm) must be finite and at least 0, got {np.min(r):g} to {np.max(r):g}")
    radius, scale = _disc(radius, pressure, e_star)
    inner, outer = np.minimum(r / radius, 1.0), np.maximum(r / radius, 1.0)
    m, complement = outer**-2, (1 - 1 / outer) * (1 + 1 / outer)
    # (1 - m) K(m) tends to 0 at the rim, where K itself is infinite
    rim = complement * ellipkm1(np.where(complement > 0, complement, 1.0))
    return 4 / math.pi * scale * np.where(r < radius, ellipe(inner**2), outer * (ellipe(m) - rim))


def uniform_disc_mean_displacement(radius: float, pressure: float, e_star: float) -> float:
    """Mean normal displacement in mm over a disc of `radius` (mm) under uniform `pressure` (MPa): 16 p c/(3 pi E*).

    Raises `InputError` for radius or e_star (MPa) <= 0 or a pressure that is not finite.
    Source: Johnson (1985), section 3.4, doi:10.1017/CBO9781139171731.
    """
    return 16 / (3 * math.pi) * _disc(radius, pressure, e_star)[1]


def _disc(radius, pressure, e_star):
    """Radius, and p c/E* in mm."""
    radius = checks.positive("disc radius (mm)", radius)
    return radius, checks.finite("pressure (MPa)", pressure) * radius / checks.positive("contact modulus (MPa)", e_star)


def surface_points(points):
    """Points (..., 3) on or below the surface as floats, and their distances (..., 1) from the origin, all > 0."""
    points = np.asarray(points, dtype=float)
    if points.ndim == 0 or points.shape[-1] != 3:
        raise InputError(f"points must have shape (..., 3), got {points.shape}")
    s = np.linalg.norm(points, axis=-1, keepdims=True)
    if not np.all(np.isfinite(s) & (s > 0) & (points[..., 2:] >= 0)):
        raise InputError("points (mm) must be finite, at depth z >= 0 and away from the origin, where the force acts")
    return points, s
