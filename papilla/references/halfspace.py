"""Elastic half-space, bare or covered by a stack of bonded layers (mm, N, MPa; z is depth into the solid)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from papilla.core import checks
from papilla.core.errors import InputError


def boussinesq_displacement(points: ArrayLike, force: float, modulus: float, nu: float) -> np.ndarray:
    """Displacement (mm) by a point force at the origin along +z (into the solid).

    u_z = F/(4 pi G) [z^2/s^3 + 2(1-nu)/s], u_x = F/(4 pi G) [x z/s^3 - (1-2nu) x/(s (s+z))], u_y likewise, s = |point|;
    on the surface u_z = F/(pi E* r).

    `points` is (..., 3) in mm with z >= 0, `force` in N, `modulus` in MPa; the result is (..., 3).
    Raises `InputError` for points above the surface, at the origin or not finite, modulus <= 0, nu outside [0, 0.5].
    Source: Johnson (1985), section 3.2, doi:10.1017/CBO9781139171731.
    """
    points = np.asarray(points, dtype=float)
    if points.ndim == 0 or points.shape[-1] != 3:
        raise InputError(f"points must have shape (..., 3), got {points.shape}")
    s, z = np.linalg.norm(points, axis=-1, keepdims=True), points[..., 2:]
    if not np.all(np.isfinite(s) & (s > 0) & (z >= 0)):
        raise InputError("points (mm) must be finite, at depth z >= 0 and away from the origin, where the force acts")
    modulus, nu = checks.positive("modulus (MPa)", modulus), checks.poisson("nu", nu)
    scale = checks.finite("force (N)", force) * (1 + nu) / (2 * math.pi * modulus)
    radial = z / s**3 - (1 - 2 * nu) / (s * (s + z))
    return scale * np.concatenate([points[..., :2] * radial, z**2 / s**3 + 2 * (1 - nu) / s], axis=-1)


def uniform_disc_mean_displacement(radius: float, pressure: float, e_star: float) -> float:
    """Mean normal displacement (mm) of a disc of `radius` c (mm) under uniform `pressure` p (MPa): 16 p c/(3 pi E*).

    Raises `InputError` for radius or e_star (MPa) <= 0 or a pressure that is not finite.
    Source: Johnson (1985), section 3.4, doi:10.1017/CBO9781139171731.
    """
    scale = checks.finite("pressure (MPa)", pressure) * checks.positive("disc radius (mm)", radius)
    return 16 / (3 * math.pi) * scale / checks.positive("contact modulus (MPa)", e_star)


def halfspace_stiffness(wavenumber: ArrayLike, e_star: float) -> np.ndarray:
    """Normal pressure over normal surface displacement of a half-space, MPa/mm: E* q / 2.

    `wavenumber` q in 1/mm, any array > 0; `e_star` in MPa. Raises `InputError` unless both are positive.
    Source: Johnson (1985), section 13.2, doi:10.1017/CBO9781139171731.
    """
    return 0.5 * checks.positive("contact modulus (MPa)", e_star) * _positive(wavenumber)


class Solid(Protocol):
    """An elastic solid, such as `papilla.HalfSpace`: Young's modulus in MPa, Poisson's ratio."""

    @property
    def modulus(self) -> float:
        """Young's modulus, MPa."""

    @property
    def nu(self) -> float:
        """Poisson's ratio."""


@dataclass(frozen=True)
class StackLayer:
    """One layer of a stack: `thickness` in mm, `modulus` in MPa, `nu` in [0, 0.5]. Raises `InputError` otherwise."""

    thickness: float
    modulus: float
    nu: float

    def __post_init__(self):
        checks.positive("layer thickness (mm)", self.thickness)
        checks.positive("layer modulus (MPa)", self.modulus)
        checks.poisson("layer nu", self.nu)


def layered_halfspace_stiffness(wavenumber: ArrayLike, layers: Sequence[StackLayer], base: Solid | None) -> np.ndarray:
    """Normal pressure over normal displacement at the surface of a stack of layers without friction, MPa/mm.

    `layers` are listed from the surface down; `base` is the half-space below them, or None for a rigid base. At each
    wavenumber the 2 x 2 compliance C (displacement = C traction, tangential and normal) at the base is continued
    upwards through each layer; the stiffness is 1/C_nn at the surface. Stable for any q h.

    `wavenumber` q in 1/mm, any array > 0; the result has its shape.
    Raises `InputError` for wavenumbers that are not positive, and for a stack without layers on a rigid base.
    Source: Perriot and Barthel (2004), doi:10.1557/jmr.2004.19.2.600.
    """
    q = np.asarray(wavenumber, dtype=float)
    return 1 / layered_surface_compliance(q, layers, base)[..., 1, 1]


def layered_surface_compliance(wavenumber: ArrayLike, layers: Sequence[StackLayer], base: Solid | None) -> np.ndarray:
    """Displacement amplitudes per traction amplitude at a stack's surface, plane strain: (..., 2, 2) in mm/MPa.

    The first component is along the surface (times sin qx), the second inward (times cos qx). `layers` and `base` are
    as in `layered_halfspace_stiffness`, which is the inverse of the last entry. The Fourier integral over q is the
    response to a line load. Raises `InputError` as `layered_halfspace_stiffness` does. Source: Li and Popov (2020),
    doi:10.1177/1350650119854250; by the recursion of Perriot and Barthel (2004).
    """
    q = _positive(wavenumber)
    flat = q.ravel()
    bodies: list[Solid] = [*layers] if base is None else [*layers, base]
    if not bodies:
        raise InputError("layered surface: no layer on a rigid base, expected a layer or an elastic base")
    # Tractions are divided by 2 q and a reference modulus, so that C is of order 1
    reference = bodies[0].modulus
    compliance = np.zeros((flat.size, 2, 2))
    if base is not None:
        modes = _decaying_modes(np.zeros(flat.size), base.modulus / reference / (2 * (1 + base.nu)), base.nu)
        compliance = _right_divide(modes[:, :2], modes[:, 2:])
    for layer in reversed(layers):
        Q = flat * layer.thickness
        mu = layer.modulus / reference / (2 * (1 + layer.nu))
        thin = Q < 1
        above = np.empty_like(compliance)
        above[thin] = _through_thin(compliance[thin], Q[thin], mu, layer.nu)
        above[~thin] = _through_thick(compliance[~thin], Q[~thin], mu, layer.nu)
        compliance = above
    # The outward normal is -z, so the tractions on the body are minus its stresses
    return (compliance / (-2 * reference * flat)[:, None, None]).reshape(*q.shape, 2, 2)


def _through_thin(compliance, Q, mu, nu):
    """Compliance above a thin layer, by the transfer matrix of (U, W, tau, sigma): exact as Q tends to 0."""
    generator = np.array(
        [
            [0, 1, 2 / mu, 0],
            [-nu / (1 - nu), 0, 0, (1 - 2 * nu) / (mu * (1 - nu))],
            [mu / (1 - nu), 0, 0, nu / (1 - nu)],
            [0, 0, -1, 0],
        ]
    )
    T = expm(generator * Q[:, None, None])
    T_uu, T_ut, T_tu, T_tt = T[:, :2, :2], T[:, :2, 2:], T[:, 2:, :2], T[:, 2:, 2:]
    return np.linalg.solve(T_uu - compliance @ T_tu, compliance @ T_tt - T_ut)


def _through_thick(compliance, Q, mu, nu):
    """Compliance above a thick layer, by modes that decay downwards and upwards: no exponential grows."""
    mirror = np.diag([1.0, -1.0, -1.0, 1.0])
    down_here, across = _decaying_modes(np.zeros_like(Q), mu, nu), _decaying_modes(Q, mu, nu)
    up_here, up_across = mirror @ down_here, mirror @ across
    # U - C t = 0 at the bottom gives the reflection R of the downward modes: residual_down + residual_up R = 0
    residual = [modes[:, :2] - compliance @ modes[:, 2:] for modes in (across, up_here)]
    surface = down_here + up_across @ np.linalg.solve(residual[1], -residual[0])
    return _right_divide(surface[:, :2], surface[:, 2:])


def _decaying_modes(depth, mu, nu):
    """(n, 4, 2): U, W, tau/(2 q), sigma/(2 q) of the two modes decaying with the scaled depth q z (n,).

    Displacement (U sin qx, W cos qx), W downward: the potential (1, 1) and the Papkovich mode (qz, qz + 3 - 4 nu).
    """
    ones = np.ones_like(depth)
    potential = np.stack([ones, ones, -mu * ones, -mu * ones], axis=-1)
    papkovich = np.stack([depth, depth + 3 - 4 * nu, -mu * (depth + 1 - 2 * nu), -mu * (depth + 2 - 2 * nu)], axis=-1)
    return np.stack([potential, papkovich], axis=-1) * np.exp(-depth)[:, None, None]


def _right_divide(A, B):
    """A B^-1 of stacked 2 x 2 matrices."""
    return np.linalg.solve(B.swapaxes(-1, -2), A.swapaxes(-1, -2)).swapaxes(-1, -2)


def _positive(wavenumber):
    q = np.asarray(wavenumber, dtype=float)
    if not np.all(np.isfinite(q) & (q > 0)):
        raise InputError(f"wavenumber (1/mm) must be finite and greater than 0, got {np.min(q):g} to {np.max(q):g}")
    return q
