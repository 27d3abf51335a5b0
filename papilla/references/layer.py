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
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.special import j0, j1

from papilla import checks
from papilla.errors import InputError

DEFICIT_CUTOFF = 24.0
"""Value of Q = q h beyond which `bonded_layer_deficit` is below 1e-17."""

FAR, KNOTS = 50.0, 1500
"""Distance over thickness beyond which the layer's displacement, which decays as exp(-0.739 r/h) or faster, is set to
0; and number of knots of the tables up to there."""


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
        place = np.arcsinh(np.minimum(scaled, FAR))
        # Beyond the table the layer's displacement is 0, and the difference is minus that of the half-space
        beyond = np.divide(1.0, scaled, out=np.zeros_like(scaled), where=scaled >= FAR)
        columns = zip(_tables(self.nu, self.bonded)[:count], _half_space(self.nu), strict=False)
        lacking = (np.where(scaled < FAR, table(place), factor * beyond) for table, factor in columns)
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
    left = low + width * np.arange(panels)
    return (left[:, None] + 0.5 * width * (x + 1)).ravel(), np.tile(0.5 * width * w, panels)


def _half_space(nu):
    """Coefficients of (1+nu)/(pi E r) in the radial functions of a half-space: normal, mean, deviator, coupling."""
    return 1 - nu, 1 - nu / 2, nu / 2, (1 - 2 * nu) / 2


@lru_cache(maxsize=64)
def _tables(nu: float, bonded: bool) -> tuple[CubicSpline, ...]:
    """Splines of the four transforms over asinh(r/h), so that knots are dense where the transforms vary fast."""
    knots = np.linspace(0.0, math.asinh(FAR), KNOTS)
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
