"""Axisymmetric contact with friction: flat punch and growing sphere (mm, N, MPa).

Two half-spaces couple pressure and shear through Dundurs' beta alone. With the transforms
P(k) = int_0^a f(t) cos kt dt of the pressure and Q(k) = int_0^a g(t) sin kt dt of the radial shear, a flat punch of
radius a = 1 and unit depth (f = 1 without friction) has

    f(t) - (2 beta/pi) int s g(s)/(s^2 - t^2) ds = 1                    uniform depth,
    g(t) + (2 beta t/pi) int f(s)/(s^2 - t^2) ds = 0,       t < c       stick,
    g(t) = (2 mu t/pi) int_t^1 p(r)/sqrt(r^2 - t^2) dr,     t > c       slip.

The integrals are principal values. c is the radius at which g is continuous, so that the shear is bounded. Each small
growth of a sphere's contact is such a punch of the present radius. So the sphere has the same c/a, and its force and
depth follow by integration over the radius.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipkm1

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.references.layer import panel_quadrature

_ELEMENTS = 240
"""Elements of the numerical solution with slip, smaller towards c and the edge: error 1e-4 in force and depth."""

_ALL_SLIPS = 5e-3
"""Stick radius (over a) below which Goodman's approximation is used: it changes force and depth very little there."""


@dataclass(frozen=True)
class FrictionalPunch:
    """A flat punch with friction, and the sphere in monotone loading with the same ratio of stick to contact radius.

    Parameters
    ----------
    stick_radius : c/a, 1 for full stick.
    force_factor : force over that of the frictionless punch at the same depth.
    depth_factor : depth of a sphere over a^2/R, which is that of a frictionless sphere with the contact radius a.
    shear_moment : int q r dA / (F a) of a sphere, a measure of the shear q; positive outward on the softer body.
    """

    stick_radius: float
    force_factor: float
    depth_factor: float
    shear_moment: float

    def sphere(self, contact_radius: float, radius: float, e_star: float) -> tuple[float, float]:
        """Force (N) and indentation (mm) of a sphere of `radius` (mm) at a contact radius (mm), `e_star` in MPa."""
        depth = self.depth_factor * contact_radius**2 / radius
        return self.force_factor * 4 / 3 * e_star * contact_radius * depth, depth


def dundurs_beta(modulus: float, nu: float, other_modulus: float = math.inf, other_nu: float = 0.5) -> float:
    """Dundurs' beta of a body on another: ((1-2nu)/G - (1-2nu')/G') / ((1-nu)/G + (1-nu')/G') / 2.

    Moduli in MPa; the other body is rigid by default. Positive if pressure draws the first body's surface inwards more.
    Raises `InputError` for moduli <= 0 or nu outside [0, 0.5]. Source: Dundurs (1969), doi:10.1115/1.3564739.
    """
    shear = checks.positive("modulus (MPa)", modulus) / (2 * (1 + checks.poisson("nu", nu)))
    checked_modulus = math.inf if other_modulus == math.inf else checks.positive("other modulus (MPa)", other_modulus)
    other_shear = checked_modulus / (2 * (1 + checks.poisson("other nu", other_nu)))
    top = (1 - 2 * nu) / shear - (1 - 2 * other_nu) / other_shear
    return top / (2 * ((1 - nu) / shear + (1 - other_nu) / other_shear))


@lru_cache(maxsize=64)
def frictional_punch(beta: float, friction: float = math.inf) -> FrictionalPunch:
    """Punch, and sphere in monotone loading, with Coulomb friction and Dundurs' beta; infinite friction is full stick.

    Full stick is Mossakovskii's solution f + i g = ((1+t)/(1-t))^(i theta)/sqrt(1 - beta^2), with theta =
    ln((1+beta)/(1-beta))/(2 pi) and the force factor pi theta/beta. With slip, Spence's equations (at the top of the
    module) are solved numerically. Raises `InputError` for beta outside (-0.5, 0.5] or friction <= 0. Sources: Spence
    (1968), doi:10.1098/rspa.1968.0105, and (1975), doi:10.1007/BF01126993; Mossakovskii (1963),
    doi:10.1016/0021-8928(63)90150-3.
    """
    beta = checks.within("Dundurs' beta", beta, -0.5, 0.5)
    if not friction > 0:
        raise InputError(f"friction must be greater than 0, got {friction:g}")
    size = abs(beta)
    if size < 1e-12:
        return FrictionalPunch(1.0, 1.0, 1.0, 0.0)
    if friction == math.inf:
        t, weights, f, g = _stick(size)
        return _punch(1.0, t, weights, f, math.copysign(1, beta) * g)
    approximate = goodman_stick_radius(size, friction)
    c = approximate
    if approximate > _ALL_SLIPS:
        low, high = approximate / 3, 1 - (1 - approximate) / 3
        c = brentq(lambda c: _jump(c, size, friction), low, high, xtol=1e-10)
    edges = _edges(c)
    f, g = _solve(edges, c, size, friction)
    return _punch(c, (edges[1:] + edges[:-1]) / 2, np.diff(edges), f, math.copysign(1, beta) * g)


def goodman_stick_radius(beta: float, friction: float) -> float:
    """Stick radius over contact radius if shear does not change the pressure: ln((1+c)/(1-c))/(2c) = mu/beta K'(c).

    It holds for small beta. Raises `InputError` unless beta and friction are positive.
    Sources: Goodman (1962), doi:10.1115/1.3640599; Spence (1975), doi:10.1007/BF01126993.
    """
    ratio = checks.positive("friction", friction) / checks.positive("Dundurs' beta", beta)
    # With x = artanh c, one bracket covers all c, down to a slip annulus of exp(-600)
    return math.tanh(brentq(lambda x: x / math.tanh(x) - ratio * ellipkm1(math.tanh(x) ** 2), 1e-300, 300.0))


def _punch(c, t, weights, f, g) -> FrictionalPunch:
    """The factors of `FrictionalPunch` from f and g at points t in (0, 1)."""
    force = float(weights @ f)
    # Surface outside the punch, integrated over the growth of the radius: int_0^1 x^2/sqrt(1 - x^2 t^2) dx
    outside = np.where(
        t < 1e-2, 1 / 3 + t * t / 10, (np.arcsin(t) - t * np.sqrt(1 - t * t)) / (2 * np.maximum(t, 1e-9) ** 3)
    )
    depth = 1 / (2 * (1 - 4 / math.pi * float(weights @ (f * outside))))
    return FrictionalPunch(c, force, depth, 1.5 * float(weights @ (t * g)) / force)


def _stick(beta: float):
    """Points, weights, f and g of full stick. In the variable v = artanh t the oscillation at the edge becomes a
    harmonic wave."""
    theta = math.log((1 + beta) / (1 - beta)) / (2 * math.pi)
    v, weights = panel_quadrature(0.0, 19.0, 60)
    scale = 1 / math.sqrt(1 - beta**2)
    return np.tanh(v), weights / np.cosh(v) ** 2, scale * np.cos(2 * theta * v), scale * np.sin(2 * theta * v)


def _edges(c: float) -> np.ndarray:
    """Edges of the elements on (0, 1), with c among them; elements are smaller towards c and 1."""
    x = np.linspace(0, 1, _ELEMENTS // 3 + 1)
    inner = c * (1 - (1 - x) ** 2)
    right = c + (1 - c) * np.where(x < 0.5, 2 * x**2, 1 - 8 * (1 - x) ** 4)
    return np.concatenate([inner, right[1:]])


def _solve(edges, c: float, beta: float, friction: float):
    """f and g, constant on each element, for a stick radius c."""
    t, count = (edges[1:] + edges[:-1])[:, None] / 2, len(edges) - 1
    first = np.diff(np.log(np.abs(edges**2 - t**2)) / 2, axis=1)
    second = np.diff(np.log(np.abs((edges - t) / (edges + t))) / (2 * t), axis=1)
    # int_t^1 p/sqrt(r^2 - t^2) dr: each jump of f, at s, contributes K'(t/s)/s
    s = edges[1:]
    elliptic = np.where(s > t, ellipkm1(np.minimum((t / s) ** 2, 1.0)) / s, 0.0)
    drawn = elliptic.copy()
    drawn[:, 1:] -= elliptic[:, :-1]
    sticking = t < c
    matrix = np.block(
        [
            [np.eye(count), -2 * beta / math.pi * first],
            [np.where(sticking, 2 * beta / math.pi * t * second, -2 * friction / math.pi * t * drawn), np.eye(count)],
        ]
    )
    return np.split(np.linalg.solve(matrix, np.repeat([1.0, 0.0], count)), 2)


def _jump(c: float, beta: float, friction: float) -> float:
    """Jump of g at c, extrapolated linearly from the elements on both sides."""
    edges = _edges(c)
    g, t = _solve(edges, c, beta, friction)[1], (edges[1:] + edges[:-1]) / 2
    k = int(np.searchsorted(edges, c))
    below = g[k - 1] + (g[k - 1] - g[k - 2]) / (t[k - 1] - t[k - 2]) * (c - t[k - 1])
    above = g[k] + (g[k + 1] - g[k]) / (t[k + 1] - t[k]) * (c - t[k])
    return float(below - above)
