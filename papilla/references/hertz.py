"""Hertz contact of smooth bodies, its finite-sphere correction, and the JKR pull-off force (mm, N, MPa)."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from papilla import checks
from papilla.errors import InputError

MAX_RADIUS_RATIO = 1e4
"""Largest ratio of principal radii that `hertz_ellipse` accepts; beyond it the contact is a line, not an ellipse."""


def effective_modulus(E1: float, nu1: float, E2: float = math.inf, nu2: float = 0.0) -> float:
    """Contact modulus E* in MPa of two bodies: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.

    Moduli in MPa; `inf` is a rigid body (the default of the second), and one of the two must be finite.

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


def composite_radius(radius1: float, radius2: float = math.inf) -> float:
    """Relative radius R in mm of two bodies in one plane: 1/R = 1/R1 + 1/R2.

    A negative radius is a concave body, `inf` a flat one. Raises `InputError` for a zero or NaN radius and for
    bodies that conform (1/R <= 0). Source: Johnson (1985), section 4.1, doi:10.1017/CBO9781139171731.
    """
    for name, radius in (("first radius (mm)", radius1), ("second radius (mm)", radius2)):
        if not math.isinf(radius) and checks.finite(name, radius) == 0:
            raise InputError(f"{name} must not be 0")
    curvature = 1 / radius1 + 1 / radius2
    if curvature <= 0:
        raise InputError(f"radii {radius1:g} and {radius2:g} mm conform: 1/R1 + 1/R2 must be > 0, got {curvature:g}")
    return 1 / curvature


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

    def pressure(self, x, y):
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
    """Elliptic contact under `force` in N, with gap x^2/(2 Rx) + y^2/(2 Ry); the axes keep their orientation.

    With k = b/a <= 1 (long axis over the larger radius R'), m = 1 - k^2 and D = (K - E)/m of parameter m,
    a^3 = 3 F D R'/(pi E*) and d = 3 F K/(2 pi E* a).

    `radius_x`, `radius_y` are the composite radii in mm in the x-z and y-z planes, `e_star` is in MPa.
    Raises `InputError` unless all are > 0 and the ratio of radii is at most `MAX_RADIUS_RATIO`.
    Source: Johnson (1985), section 4.2, doi:10.1017/CBO9781139171731.
    """
    force = checks.positive("force (N)", force)
    major, k, K, D = _ellipse(radius_x, radius_y)
    e_star = checks.positive("contact modulus (MPa)", e_star)
    a = (3 * force * D * major / (math.pi * e_star)) ** (1 / 3)
    return _oriented(force, 1.5 * force * K / (math.pi * e_star * a), a, k, radius_x >= radius_y)


def hertz_ellipse_at(indentation: float, radius_x: float, radius_y: float, e_star: float) -> HertzContact:
    """`hertz_ellipse` at a given `indentation` in mm instead of a given force: a^2 = 2 D R' d / K.

    Raises `InputError` as `hertz_ellipse` does. Source: Johnson (1985), section 4.2, doi:10.1017/CBO9781139171731.
    """
    indentation = checks.positive("indentation (mm)", indentation)
    major, k, K, D = _ellipse(radius_x, radius_y)
    e_star = checks.positive("contact modulus (MPa)", e_star)
    a = math.sqrt(2 * D * major * indentation / K)
    return _oriented(math.pi * e_star * a * indentation / (1.5 * K), indentation, a, k, radius_x >= radius_y)


def _oriented(force, indentation, major, k, long_in_x):
    a, b = (major, k * major) if long_in_x else (k * major, major)
    return HertzContact(force, indentation, a, b)


def _ellipse(radius_x, radius_y):
    """Larger radius, axis ratio k, K and D of the contact ellipse."""
    radius_x, radius_y = checks.positive("radius_x (mm)", radius_x), checks.positive("radius_y (mm)", radius_y)
    ratio = max(radius_x, radius_y) / min(radius_x, radius_y)
    if ratio > MAX_RADIUS_RATIO:
        raise InputError(f"radii {radius_x:g} and {radius_y:g} mm: ratio must be at most {MAX_RADIUS_RATIO:g}")
    return max(radius_x, radius_y), *_axis_ratio(ratio)


@lru_cache(maxsize=1024)
def _axis_ratio(radius_ratio: float) -> tuple[float, float, float]:
    """(k, K, D) such that R'/R'' = (K - D)/(k^2 D); secant steps in log k, where the log of that is nearly linear."""
    target = math.log(radius_ratio)
    step, log_k, slope = math.inf, 0.0, -1.5
    error = -target
    while abs(step) > 1e-15 + 1e-13 * abs(log_k):
        step = -error / slope
        log_k += step
        K, D = _elliptic_KD(math.exp(log_k))
        before, error = error, math.log((K - D) / D) - 2 * log_k - target
        if abs(error) < 4e-16 * (1 + target) or error == before:
            break
        slope = (error - before) / step
    k = math.exp(log_k)
    return k, *_elliptic_KD(k)


def _elliptic_KD(k: float) -> tuple[float, float]:
    """Complete elliptic integrals K and D = (K - E)/m at complementary modulus k, by the arithmetic-geometric mean.

    Gauss's sum for K - E is divided by m term by term, so the circular limit k = 1 does not cancel (DLMF 19.8.6).
    """
    mean, geometric, scale, total = 0.5 * (1 + k), math.sqrt(k), 1.0, 0.5
    c2_over_m = 0.25 * (1 - k) / (1 + k)
    while True:
        total += scale * c2_over_m
        if scale * c2_over_m < 1e-17 * total:
            K = 0.5 * math.pi / mean
            return K, K * total
        # c_(n+1) = c_n^2 / (4 a_(n+1)), hence its square over m from the square before
        c2 = c2_over_m * (1 - k * k)
        mean, geometric, scale = 0.5 * (mean + geometric), math.sqrt(mean * geometric), 2 * scale
        c2_over_m *= c2 / (16 * mean * mean)


def finite_sphere_factor(indentation: float, radius: float) -> float:
    """Force of a rigid sphere over that of the paraboloid of Hertz, at the same indentation (both in mm).

    With x = a/R: d = a artanh(x) and F = E*/2 [(a^2 + R^2) 2 artanh(x) - 2 a R]; the factor is 1 - d/(10 R) + ...

    Raises `InputError` unless both are > 0 and indentation <= radius.
    Source: Sneddon (1965), doi:10.1016/0020-7225(65)90019-4.
    """
    radius = checks.positive("radius (mm)", radius)
    depth = checks.positive("indentation (mm)", indentation) / radius
    if depth > 1:
        raise InputError(f"indentation must be at most the radius {radius:g} mm, got {indentation:g}")
    x = math.sqrt(math.tanh(depth))
    for _ in range(50):
        step = (x * math.atanh(x) - depth) / (math.atanh(x) + x / (1 - x * x))
        x -= step
        if abs(step) <= 1e-15 * x:
            break
    # Below x = 0.1 the closed form cancels to rounding; its series is exact there
    if x > 0.1:
        force = (1 + x * x) * math.atanh(x) - x
    else:
        force = 4 * sum(n * x ** (2 * n + 1) / (4 * n * n - 1) for n in range(1, 12))
    return force / (4 / 3 * depth**1.5)


def jkr_pull_off(work_of_adhesion: float, radius: float) -> float:
    """Pull-off force in N of an adhesive sphere: 3/2 pi w R, with w in N/mm (1 J/m2 = 1e-3 N/mm) and R in mm.

    Raises `InputError` unless both are > 0. Source: Johnson, Kendall, Roberts (1971), doi:10.1098/rspa.1971.0141.
    """
    radius = checks.positive("radius (mm)", radius)
    return 1.5 * math.pi * checks.positive("work of adhesion (N/mm)", work_of_adhesion) * radius
