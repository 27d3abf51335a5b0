"""Surface displacement of a layer on a rigid base minus that of a half-space, under point forces (mm, N, MPa).

z is depth into the solid; rows and columns of a Green's tensor are x, y, z: u = green @ force / modulus. The tensor of
the half-space is singular at the force. The difference of layer and half-space is smooth, so it can be tabulated. It is
the Hankel transform of the difference of their compliances at wavenumber q. These compliances relate displacements
along the wave and downwards to the tractions; shear across the wave is decoupled. With Q = q h, the shear modulus G and
D = (3-4nu) cosh 2Q + 2Q^2 + 4nu(2nu-3) + 5, a bonded layer has (Johnson 1985, section 5.8,
doi:10.1017/CBO9781139171731)

    down, along : (1-nu)/(G q) [(3-4nu) sinh 2Q -+ 2Q]/D,        across : tanh Q/(G q),
    coupling : [2Q^2 - (1-2nu)(3-4nu)(cosh 2Q - 1)]/(2 G q D).

A layer that slides on its base without friction is half of a layer of 2h pressed from both sides:
down : (1-nu)/(G q) (cosh 2Q - 1)/(sinh 2Q + 2Q). It can move sideways freely.

`bonded_layer_sphere` is the exact contact of a rigid sphere with a bonded layer without friction.
"""

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.special import j0, j1

from papilla.core import checks
from papilla.core.errors import InputError

DEFICIT_CUTOFF = 24.0
"""Value of Q = q h beyond which `bonded_layer_deficit` is below 1e-17."""

FAR_THICKNESSES, LAYER_TABLE_KNOTS = 50.0, 1500
"""Distance over thickness beyond which the layer's displacement, which decays as exp(-0.739 r/h) or faster, is set to
0; and number of knots of the tables up to there."""


MAX_CHI = 10.0
"""Largest chi = sqrt(R d)/h that `bonded_layer_sphere` resolves."""


@dataclass(frozen=True)
class _Layer:
    thickness: float
    nu: float
    bonded: bool = True

    def __post_init__(self):
        checks.positive("layer thickness (mm)", self.thickness)
        checks.poisson("layer nu", self.nu)

    def _radial(self, r, count):
        """The first `count` of the radial functions (..., in 1/mm) at r >= 0 mm: normal, mean, deviator, coupling."""
        r = np.asarray(r, dtype=float)
        if not np.all(np.isfinite(r) & (r >= 0)):
            raise InputError(f"distance r (mm) must be finite and at least 0, got {np.min(r):g} to {np.max(r):g}")
        scaled = r / self.thickness
        place = np.arcsinh(np.minimum(scaled, FAR_THICKNESSES))
        # Beyond the table the layer's displacement is 0, and the difference is minus that of the half-space
        beyond = np.divide(1.0, scaled, out=np.zeros_like(scaled), where=scaled >= FAR_THICKNESSES)
        columns = zip(_tables(self.nu, self.bonded)[:count], _half_space(self.nu), strict=False)
        lacking = (np.where(scaled < FAR_THICKNESSES, table(place), factor * beyond) for table, factor in columns)
        return [-(1 + self.nu) / (math.pi * self.thickness) * column for column in lacking]


class LayerKernel(_Layer):
    """Normal displacement of a layer under a normal force minus that of a half-space, times E: kernel(r) in 1/mm.

    The displacement is [kernel(r) + (1 - nu^2)/(pi r)] force / E (mm) at distances r >= 0 (mm, any shape). It is read
    from tables made once for each `nu`, accurate to 1e-9 of kernel(0). Raises `InputError` for `thickness` (mm) <= 0 or
    nu outside [0, 0.5]; a call raises it for r negative or not finite. Source: Hankel transform of the module's
    formulae.
    """

    def __call__(self, r: ArrayLike) -> np.ndarray:
        return self._radial(r, 1)[0]


class BondedLayerGreen(_Layer):
    """Surface Green's tensor of a bonded layer minus that of a half-space, times E: (..., 3, 3) in 1/mm.

    Called with offsets (..., 2) in mm from the force. With the unit offset e, the tensor of the half-space times
    pi r/(1+nu) has the tangential part (1-nu) 1 + nu e e, the normal part 1-nu and the coupling +-(1-2nu)/2 e: a normal
    force draws the surface towards itself. The difference is smooth and finite at the origin; its normal part is
    `LayerKernel`. Raises `InputError` as `LayerKernel` does. Source: Hankel transforms of the module's formulae.
    """

    def __call__(self, xy: ArrayLike) -> np.ndarray:
        xy = np.asarray(xy, dtype=float)
        r = np.linalg.norm(xy, axis=-1)
        normal, mean, deviator, coupling = self._radial(r, 4)
        direction = np.divide(xy, r[..., None], out=np.zeros_like(xy), where=r[..., None] > 0)
        dyad = direction[..., :, None] * direction[..., None, :]
        tensor = np.zeros((*r.shape, 3, 3))
        tensor[..., :2, :2] = (mean - deviator)[..., None, None] * np.eye(2) + 2 * deviator[..., None, None] * dyad
        tensor[..., 2, 2] = normal
        tensor[..., 2, :2] = coupling[..., None] * direction
        tensor[..., :2, 2] = -coupling[..., None] * direction
        return tensor


def bonded_layer_deficit(Q: ArrayLike, nu: float) -> np.ndarray:
    """W(Q) = 1 - (normal compliance of a bonded layer) / (that of a half-space), Q = q h >= 0 of any shape.

    W falls from 1 at Q = 0 to 4 Q^2 exp(-2Q)/(3 - 4nu); it is dimensionless and computed without cancellation.
    Raises `InputError` for Q negative or NaN, or nu outside [0, 0.5].
    Source: Johnson (1985), section 5.8, doi:10.1017/CBO9781139171731.
    """
    return _deficits(_scaled(Q), checks.poisson("layer nu", nu))[0]


def sliding_layer_deficit(Q: ArrayLike) -> np.ndarray:
    """As `bonded_layer_deficit`, for a layer that slides on its base without friction; it does not depend on nu.

    W falls from 1 at Q = 0 to 4 Q exp(-2Q). Raises `InputError` for Q negative or NaN.
    Source: Johnson (1985), section 5.8, doi:10.1017/CBO9781139171731.
    """
    Q = _scaled(Q)
    decay = np.exp(-2 * Q)
    bottom = -np.expm1(-4 * Q) + 4 * Q * decay
    return np.divide(2 * decay * (2 * Q - np.expm1(-2 * Q)), bottom, out=np.ones_like(Q), where=bottom > 0)


def _scaled(Q: ArrayLike) -> np.ndarray:
    Q = np.asarray(Q, dtype=float)
    if not np.all(Q >= 0):
        raise InputError(f"scaled wavenumber Q must be at least 0, got a minimum of {np.min(Q):g}")
    return Q


def panel_quadrature(low: float, high: float, panels: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of 16-point Gauss-Legendre quadrature on `panels` equal parts of [low, high]."""
    x, w = leggauss(16)
    width = (high - low) / panels
    starts = low + width * np.arange(panels)
    return (starts[:, None] + 0.5 * width * (x + 1)).ravel(), np.tile(0.5 * width * w, panels)


def _half_space(nu):
    """Coefficients of (1+nu)/(pi E r) in the radial functions of a half-space: normal, mean, deviator, coupling."""
    return 1 - nu, 1 - nu / 2, nu / 2, (1 - 2 * nu) / 2


@lru_cache(maxsize=64)
def _tables(nu: float, bonded: bool) -> tuple[CubicSpline, ...]:
    """Splines of the four transforms over asinh(r/h), so that knots are dense where the transforms vary fast."""
    knots = np.linspace(0.0, math.asinh(FAR_THICKNESSES), LAYER_TABLE_KNOTS)
    values, slope = _transforms(np.sinh(knots), nu, bonded)
    return tuple(
        CubicSpline(knots, column, bc_type=((1, start), "not-a-knot"))
        for column, start in zip(values.T, (0.0, 0.0, 0.0, slope), strict=True)
    )


def _transforms(scaled, nu, bonded):
    """Half-space minus layer, of the four radial functions times pi h/(1+nu), (m, 4) at rising s = r/h (m,).

    They are the integrals over Q >= 0 of (1-nu) W_n J0, [(1-nu) W_l + W_s]/2 J0, [W_s - (1-nu) W_l]/2 J2 and V/2 J1,
    with the deficits of `_deficits` and Bessel functions of s Q. Also returns the slope of the last at s = 0.
    """
    result, slope = np.empty((len(scaled), 4)), 0.0
    for chunk in np.array_split(np.arange(len(scaled)), math.ceil(len(scaled) / 64)):
        s = scaled[chunk]
        # A panel of 16 nodes contains at most a period and a half of the Bessel functions
        Q, weights = panel_quadrature(0.0, DEFICIT_CUTOFF, 8 + math.ceil(DEFICIT_CUTOFF * s[-1] / 9))
        deficits = _deficits(Q, nu) if bonded else (sliding_layer_deficit(Q), 0 * Q, 0 * Q, 0 * Q)
        normal, along, across, coupling = (weights * deficit for deficit in deficits)
        waves, along = np.outer(s, Q), (1 - nu) * along
        even, odd = j0(waves), j1(waves)
        second = np.divide(2 * odd, waves, out=np.ones_like(waves), where=waves > 0) - even
        columns = even @ ((1 - nu) * normal), even @ (along + across) / 2, second @ (across - along) / 2
        result[chunk] = np.stack([*columns, odd @ coupling / 2], axis=1)
        slope = float(coupling @ Q) / 4
    return result, slope


def _deficits(Q, nu):
    """1 - (compliance of layer) / (that of half-space): normal, along and across the wave; and V, where the coupling is
    proportional to 1 - 2nu - V. All decay as exp(-2Q) and are computed without cancellation."""
    decay = np.exp(-2 * Q)
    numerator = (3 - 4 * nu) * (1 + decay**2) + 2 * decay * (2 * Q * Q + 5 + 4 * nu * (2 * nu - 3))
    common = (3 - 4 * nu) * decay + 2 * Q * Q + 5 - 12 * nu + 8 * nu**2
    normal, along = (2 * decay * (common + sign * 2 * Q) / numerator for sign in (1, -1))
    coupling = 2 * decay * ((1 - 2 * nu) * (2 * Q * Q + 8 * (1 - nu) ** 2) + 2 * Q * Q) / numerator
    return normal, along, 2 * decay / (1 + decay), coupling


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
    spread = brentq(lambda s: s - _solve(chi * math.sqrt(s), nu)[0], 0.999, 4.001, xtol=1e-14, rtol=1e-14)
    spread, factor, tau, values = _solve(chi * math.sqrt(spread), nu)
    hertz = 4 / 3 * e_star * math.sqrt(radius) * indentation**1.5
    profile = Chebyshev.fit(tau**2, values, len(tau) // 2, domain=[0, 1])
    contact_radius = math.sqrt(spread * radius * indentation)
    return BondedLayerContact(
        factor * hertz, indentation, contact_radius, factor, e_star / math.pi * indentation * profile
    )


def _solve(scaled_radius: float, nu: float) -> tuple[float, float, np.ndarray, np.ndarray]:
    """Spread a^2/(R d), factor of Hertz's force, nodes tau = t/a of which the last is 1, and the scaled solution
    phi/((E*/pi) d) = unit - spread * square at them; `scaled_radius` is the contact radius over the thickness."""
    panels = 2 + math.ceil(scaled_radius / 4)
    tau, weights = panel_quadrature(0.0, 1.0, panels)
    Q, q_weights = panel_quadrature(0.0, DEFICIT_CUTOFF, 4 + math.ceil(DEFICIT_CUTOFF * scaled_radius / 9))
    tau, weights = np.append(tau, 1.0), np.append(weights, 0.0)
    waves = np.cos(scaled_radius * np.outer(tau, Q))
    coupling = 2 / math.pi * scaled_radius * (waves * (q_weights * bonded_layer_deficit(Q, nu))) @ waves.T
    right = np.stack([np.ones_like(tau), tau**2], axis=1)
    unit, square = np.linalg.solve(np.eye(len(tau)) - coupling * weights, right).T
    spread = float(unit[-1] / square[-1])
    values = unit - spread * square
    return spread, float(1.5 * math.sqrt(spread) * weights @ values), tau, values
