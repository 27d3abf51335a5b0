"""Hertz contact of smooth bodies, and the approach that two spheres share (2006, equations (6)-(8)); mm, N, MPa."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import elliprd, elliprf

from papilla.core import checks
from papilla.core.errors import InputError

MAX_RADIUS_RATIO = 1e4
"""Largest ratio of principal radii that `hertz_ellipse` accepts; beyond it the contact is a line, not an ellipse."""


def effective_modulus(E1: float, nu1: float, E2: float = math.inf, nu2: float = 0.0) -> float:
    """Contact modulus E* in MPa of two bodies: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.

    Moduli in MPa; `inf` means rigid (default of the second body). One of the two must be finite.

    Raises `InputError` for moduli that are not positive, two rigid bodies, or nu outside [0, 0.5].
    Source: Johnson, Contact Mechanics (1985), section 4.2, doi:10.1017/CBO9781139171731.
    """
    compliance = 0.0
    for body, modulus, nu in (("first", E1, nu1), ("second", E2, nu2)):
        if modulus != math.inf:
            modulus = checks.positive(f"modulus of the {body} body (MPa)", modulus)
        compliance += (1 - checks.poisson(f"nu of the {body} body", nu) ** 2) / modulus
    if compliance == 0:
        raise InputError("effective_modulus: both bodies are rigid, expected a finite modulus for at least one")
    return 1 / compliance


@dataclass(frozen=True)
class HertzContact:
    """A Hertzian contact: an elliptic patch with semi-axis `a` along x and `b` along y.

    Parameters
    ----------
    force : normal force, N.
    indentation : approach of distant points, mm.
    a, b : semi-axes along x and y, mm.
    """

    force: float
    indentation: float
    a: float
    b: float

    @property
    def area(self) -> float:
        """Contact area, mm2."""
        return math.pi * self.a * self.b

    @property
    def peak_pressure(self) -> float:
        """Pressure p0 in the middle, MPa: 3 F / (2 pi a b)."""
        return 1.5 * self.force / self.area

    def pressure(self, x: ArrayLike, y: ArrayLike) -> np.ndarray:
        """Pressure p0 sqrt(1 - (x/a)^2 - (y/b)^2) in MPa at (x, y) mm from the middle; arrays broadcast, 0 outside."""
        inside = 1 - (np.asarray(x) / self.a) ** 2 - (np.asarray(y) / self.b) ** 2
        return self.peak_pressure * np.sqrt(np.maximum(inside, 0.0))


def hertz_sphere(force: float, radius: float, e_star: float) -> HertzContact:
    """Sphere on a flat under `force` in N: F = 4/3 E* sqrt(R) d^1.5, a^2 = R d.

    `radius` is the composite radius in mm, `e_star` the contact modulus in MPa. Raises `InputError` unless all are > 0.
    Source: Johnson (1985), section 4.2, doi:10.1017/CBO9781139171731.
    """
    return hertz_ellipse(force, radius, radius, e_star)


def hertz_sphere_at(indentation: float, radius: float, e_star: float) -> HertzContact:
    """`hertz_sphere` at a given `indentation` in mm instead of a given force: F = 4/3 E* sqrt(R) d^1.5.

    Raises `InputError` unless all are > 0. Source: Johnson (1985), section 4.2, doi:10.1017/CBO9781139171731.
    """
    return hertz_ellipse_at(indentation, radius, radius, e_star)


def hertz_ellipse(force: float, radius_x: float, radius_y: float, e_star: float) -> HertzContact:
    """Elliptic contact under `force` (N) of bodies with the gap x^2/(2 Rx) + y^2/(2 Ry).

    The long semi-axis a lies along the larger radius R'. With k = b/a <= 1, m = 1 - k^2, the complete elliptic
    integrals K and E of parameter m, and D = (K - E)/m: a^3 = 3 F D R'/(pi E*) and d = 3 F K/(2 pi E* a).

    `radius_x`, `radius_y` are the composite radii in mm in the x-z and y-z planes, `e_star` is in MPa.
    Raises `InputError` unless all are > 0 and the ratio of radii is at most `MAX_RADIUS_RATIO`.
    Source: Johnson (1985), section 4.2, doi:10.1017/CBO9781139171731.
    """
    force = checks.positive("force (N)", force)
    major, k, K, D = _ellipse(radius_x, radius_y)
    e_star = checks.positive("contact modulus (MPa)", e_star)
    a = (3 * force * D * major / (math.pi * e_star)) ** (1 / 3)
    axes = (a, k * a) if radius_x >= radius_y else (k * a, a)
    return HertzContact(force, 1.5 * force * K / (math.pi * e_star * a), *axes)


def hertz_ellipse_at(indentation: float, radius_x: float, radius_y: float, e_star: float) -> HertzContact:
    """`hertz_ellipse` at a given `indentation` in mm instead of a given force: a^2 = 2 D R' d / K.

    Raises `InputError` as `hertz_ellipse` does. Source: Johnson (1985), section 4.2, doi:10.1017/CBO9781139171731.
    """
    indentation = checks.positive("indentation (mm)", indentation)
    major, k, K, D = _ellipse(radius_x, radius_y)
    e_star = checks.positive("contact modulus (MPa)", e_star)
    a = math.sqrt(2 * D * major * indentation / K)
    axes = (a, k * a) if radius_x >= radius_y else (k * a, a)
    return HertzContact(math.pi * e_star * a * indentation / (1.5 * K), indentation, *axes)


@dataclass(frozen=True)
class SharedApproach:
    """Parts of the approach (mm) by which the first and the second body deform, and their contact area (mm2)."""

    first: float
    second: float
    area: float


def shared_approach(
    force: float, radius: float, E_first: float, E_second: float, nu_first: float = 0.5, nu_second: float = 0.5
) -> SharedApproach:
    """Two spheres of `radius` (mm) each under `force` (N): Hertz's approach, shared in proportion to their compliances.

    w_o / w_f = [(1 - nu_o^2) / E_o] / [(1 - nu_f^2) / E_f] is equation (7) of 2006 for equal nu, and A = pi (R / 2)
    (w_f + w_o). Equation (6) prints pi R (w_f + w_o), which holds for a sphere on a flat and is twice too large for two
    equal spheres. Moduli in MPa. Raises `InputError` for values that are not positive, or nu outside [0, 0.5]. Source:
    Johnson (1985), section 4.2, doi:10.1017/CBO9781139171731; 2006 paper, equations (6) and (7).
    """
    composite = checks.positive("radius (mm)", radius) / 2
    contact = hertz_sphere(force, composite, effective_modulus(E_first, nu_first, E_second, nu_second))
    first = 1 / effective_modulus(E_first, nu_first)
    share = first * effective_modulus(E_first, nu_first, E_second, nu_second)
    return SharedApproach(share * contact.indentation, (1 - share) * contact.indentation, contact.area)


def printed_area(w_f: float, w_o: float, radius: float) -> float:
    """Contact area (mm2) of equation (6) of 2006 as printed: pi R (w_f + w_o), lengths in mm.

    Raises `InputError` for a radius that is not positive. Source: 2006 paper, section IV.A (its hertzian half:
    Johnson (1985), section 4.2, doi:10.1017/CBO9781139171731).
    """
    return math.pi * checks.positive("radius (mm)", radius) * (w_f + w_o)


def printed_area_per_approach(E_f: float, E_o: float, radius: float) -> float:
    """A / w_f (mm) of equation (8) of 2006 as printed: pi R (1 + E_f / E_o), moduli in MPa, R in mm.

    It does not depend on the force, and for hard objects it tends to pi R, so it hardly distinguishes them.
    Raises `InputError` for values that are not positive.
    Source: 2006 paper, section IV.A (its hertzian half: Johnson (1985), section 4.2, doi:10.1017/CBO9781139171731).
    """
    ratio = checks.positive("E_f (MPa)", E_f) / checks.positive("E_o (MPa)", E_o)
    return math.pi * checks.positive("radius (mm)", radius) * (1 + ratio)


def _ellipse(radius_x, radius_y):
    """Larger radius, axis ratio k, K and D of the contact ellipse."""
    radius_x, radius_y = checks.positive("radius_x (mm)", radius_x), checks.positive("radius_y (mm)", radius_y)
    ratio = max(radius_x, radius_y) / min(radius_x, radius_y)
    if ratio > MAX_RADIUS_RATIO:
        raise InputError(f"radii {radius_x:g} and {radius_y:g} mm: ratio must be at most {MAX_RADIUS_RATIO:g}")
    return max(radius_x, radius_y), *_axis_ratio(ratio)


@lru_cache(maxsize=1024)
def _axis_ratio(radius_ratio: float) -> tuple[float, float, float]:
    """(k, K, D) with R'/R'' = (K - D)/(k^2 D), solved for log k, of which the log of the ratio is nearly linear."""

    def error(log_k: float) -> float:
        K, D = _elliptic_KD(math.exp(log_k))
        return math.log((K - D) / D) - 2 * log_k - math.log(radius_ratio)

    k = math.exp(brentq(error, -math.log(2 * MAX_RADIUS_RATIO), 0.01, xtol=1e-15)) if radius_ratio > 1 else 1.0
    return k, *_elliptic_KD(k)


def _elliptic_KD(k: float) -> tuple[float, float]:
    """Complete elliptic integrals K and D = (K - E)/m at complementary modulus k; no cancellation in D near k = 1."""
    return float(elliprf(0, k * k, 1)), float(elliprd(0, k * k, 1)) / 3
