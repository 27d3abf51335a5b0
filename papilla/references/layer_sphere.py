"""Rigid sphere on an elastic layer bonded to a rigid base: exact frictionless contact."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from papilla import checks
from papilla.errors import InputError
from papilla.references.layer import DEFICIT_CUTOFF, bonded_layer_deficit, panel_quadrature

MAX_CHI = 10.0
"""Largest chi = sqrt(R d)/h that `bonded_layer_sphere` resolves."""


@dataclass(frozen=True)
class BondedLayerContact:
    """Axisymmetric contact of a rigid sphere with a bonded layer.

    Parameters
    ----------
    force : normal force, N.
    indentation : depth of the sphere's lowest point below the undeformed surface, mm.
    contact_radius : mm.
    hertz_factor : force over that on a half-space with the layer's E* at the same indentation (`hertz_sphere_at`).
    profile : solution phi of the dual integral equations as a polynomial in (t/a)^2, MPa mm; it gives the pressure.
    """

    force: float
    indentation: float
    contact_radius: float
    hertz_factor: float
    profile: Chebyshev = field(repr=False, compare=False)

    @property
    def area(self) -> float:
        """Contact area, mm2."""
        return math.pi * self.contact_radius**2

    @property
    def peak_pressure(self) -> float:
        """Pressure in the middle, MPa."""
        return float(self.pressure(0.0))

    def pressure(self, r: ArrayLike) -> np.ndarray:
        """Pressure in MPa at distances r >= 0 in mm from the middle, any shape; 0 outside the contact.

        p(r) = -int_r^a phi'(t)/sqrt(t^2 - r^2) dt; the substitution t^2 = r^2 + (a^2 - r^2) v^2 removes the
        singularity.
        """
        inside = np.maximum(1 - (np.asarray(r, dtype=float) / self.contact_radius) ** 2, 0.0)
        v, weights = panel_quadrature(0.0, 1.0, 4)
        slope = self.profile.deriv()(1 + inside[..., None] * (v**2 - 1))
        return -2 / self.contact_radius * np.sqrt(inside) * (slope @ weights)


def bonded_layer_sphere(
    indentation: float, radius: float, thickness: float, modulus: float, nu: float = 0.5
) -> BondedLayerContact:
    """Exact solution of a rigid frictionless sphere (a paraboloid r^2/2R) pressed into a bonded layer.

    With the transform P(q) = int_0^a phi(t) cos(qt) dt of the pressure and W = `bonded_layer_deficit`, the dual
    integral equations become one equation for phi,

        phi(t) - (2/pi) int_0^a phi(s) int_0^inf W(qh) cos(qs) cos(qt) dq ds = (E*/pi)(d - t^2/R),   phi(a) = 0,

    and F = 2 pi int_0^a phi dt. It is solved on Gauss-Legendre nodes to about 1e-10.

    Lengths in mm, `modulus` in MPa. Raises `InputError` for values that are not positive, nu outside [0, 0.5], or
    sqrt(radius * indentation)/thickness above `MAX_CHI`.
    Source: Lebedev and Ufliand (1958), PMM 22, 442; Hayes et al. (1972), doi:10.1016/0021-9290(72)90010-3.
    """
    indentation, radius = checks.positive("indentation (mm)", indentation), checks.positive("radius (mm)", radius)
    thickness = checks.positive("layer thickness (mm)", thickness)
    e_star = checks.positive("layer modulus (MPa)", modulus) / (1 - checks.poisson("layer nu", nu) ** 2)
    chi = math.sqrt(radius * indentation) / thickness
    if chi > MAX_CHI:
        raise InputError(f"sqrt(radius * indentation)/thickness must be at most {MAX_CHI:g}, got {chi:g}")
    # a^2/(R d) lies between 1 (half-space) and 4 (thin and incompressible)
    spread = brentq(lambda s: s - _solve(chi * math.sqrt(s), nu).spread, 0.999, 4.001, xtol=1e-14, rtol=1e-14)
    solution = _solve(chi * math.sqrt(spread), nu)
    hertz = 4 / 3 * e_star * math.sqrt(radius) * indentation**1.5
    return BondedLayerContact(
        force=solution.hertz_factor * hertz,
        indentation=indentation,
        contact_radius=math.sqrt(solution.spread * radius * indentation),
        hertz_factor=solution.hertz_factor,
        profile=e_star / math.pi * indentation * solution.profile(),
    )


@dataclass(frozen=True)
class _Solution:
    """Scaled solution phi = (E*/pi) d [unit - spread * square] at nodes tau = t/a; the last node is 1."""

    tau: np.ndarray
    values: np.ndarray
    spread: float
    hertz_factor: float

    def profile(self) -> Chebyshev:
        degree = len(self.tau) // 2
        return Chebyshev.fit(self.tau**2, self.values, degree, domain=[0, 1])


def _solve(scaled_radius: float, nu: float) -> _Solution:
    """Solution for `scaled_radius`, the contact radius over the thickness."""
    panels = 2 + math.ceil(scaled_radius / 4)
    tau, weights = panel_quadrature(0.0, 1.0, panels)
    Q, q_weights = panel_quadrature(0.0, DEFICIT_CUTOFF, 4 + math.ceil(DEFICIT_CUTOFF * scaled_radius / 9))
    tau, weights = np.append(tau, 1.0), np.append(weights, 0.0)
    waves = np.cos(scaled_radius * np.outer(tau, Q))
    coupling = 2 / math.pi * scaled_radius * (waves * (q_weights * bonded_layer_deficit(Q, nu))) @ waves.T
    right = np.stack([np.ones_like(tau), tau**2], axis=1)
    unit, square = np.linalg.solve(np.eye(len(tau)) - coupling * weights, right).T
    spread = unit[-1] / square[-1]
    values = unit - spread * square
    return _Solution(tau, values, float(spread), float(1.5 * math.sqrt(spread) * weights @ values))
