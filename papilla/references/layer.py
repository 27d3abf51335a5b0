"""Surface of a layer on a rigid base, less that of a half-space: smooth functions of distance (mm, N, MPa).

z is depth into the solid, rows and columns of a Green's tensor are x, y, z: u = green @ force / modulus. What bonding
takes from the half-space's tensor are Hankel transforms of its share of the spectral compliance: at wavenumber q the
displacements along the wave and down answer the tractions there, and shear across the wave stands alone. With Q = q h,
D = (3-4nu) cosh 2Q + 2Q^2 + 4nu(2nu-3) + 5 and G the shear modulus, they are (Johnson 1985, section 5.8,
doi:10.1017/CBO9781139171731)

    down, along : (1-nu)/(G q) [(3-4nu) sinh 2Q -+ 2Q]/D,        across : tanh Q/(G q),
    coupling : [2Q^2 - (1-2nu)(3-4nu)(cosh 2Q - 1)]/(2 G q D).

A layer that slides on its base without friction is half of one of 2h that is pressed from both sides:
down : (1-nu)/(G q) (cosh 2Q - 1)/(sinh 2Q + 2Q). Nothing holds it sideways.
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
"""Q = q h beyond which `bonded_layer_deficit` is below 1e-17."""

FAR, KNOTS = 50.0, 1500
"""Distance over thickness beyond which the layer's own displacement, which decays at least as exp(-0.739 r/h), is 0."""


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
        # Beyond the table the layer's own displacement is nothing, and the half-space's is taken away
        beyond = np.divide(1.0, scaled, out=np.zeros_like(scaled), where=scaled >= FAR)
        columns = zip(_tables(self.nu, self.bonded)[:count], _half_space(self.nu), strict=False)
        lacking = (np.where(scaled < FAR, table(place), factor * beyond) for table, factor in columns)
        return [-(1 + self.nu) / (math.pi * self.thickness) * column for column in lacking]


class LayerKernel(_Layer):
    """Normal displacement of a layer under a normal force minus the half-space's, times E: kernel(r) in 1/mm.

    Displacement in mm = [kernel(r) + (1 - nu^2)/(pi r)] * force / E, at distances r >= 0 mm of any shape; from tables
    made once per `nu`, within 1e-9 of kernel(0). Raises `InputError` for `thickness` (mm) <= 0 or nu outside [0, 0.5],
    and for r negative or not finite when called. Source: Hankel transform of the module's formulae.
    """

    def __call__(self, r: ArrayLike) -> np.ndarray:
        return self._radial(r, 1)[0]


class BondedLayerGreen(_Layer):
    """Surface Green's tensor (..., 3, 3) of a bonded layer minus the half-space's, times E, at offsets (..., 2): 1/mm.

    The half-space's, times pi r/(1+nu), with e the unit offset: tangential (1-nu) 1 + nu e e, normal 1-nu, coupling
    +-(1-2nu)/2 e: a push draws the surface towards it. What is left is smooth, and finite at the origin; its normal
    part is `LayerKernel`. Raises `InputError` as that does. Source: Hankel transforms of the module's formulae.
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
    """Share W(Q) of the half-space's normal compliance that a bonded layer lacks, Q = q h >= 0 of any shape.

    W falls from 1 at Q = 0 to 4 Q^2 exp(-2Q)/(3 - 4nu) and is computed without cancellation; dimensionless.
    Raises `InputError` for Q negative or NaN, or nu outside [0, 0.5].
    Source: Johnson (1985), section 5.8, doi:10.1017/CBO9781139171731.
    """
    return _deficits(_scaled(Q), checks.poisson("layer nu", nu))[0]


def sliding_layer_deficit(Q: ArrayLike) -> np.ndarray:
    """As `bonded_layer_deficit`, of a layer that slides on its base without friction; the same for every nu.

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
    """Factors of 1/r in the half-space's radial functions, times (1+nu)/(pi E): normal, mean, deviator, coupling."""
    return 1 - nu, 1 - nu / 2, nu / 2, (1 - 2 * nu) / 2


@lru_cache(maxsize=64)
def _tables(nu: float, bonded: bool) -> tuple[CubicSpline, ...]:
    """Splines of the four transforms over asinh(r/h), which spaces the knots as they vary."""
    knots = np.linspace(0.0, math.asinh(FAR), KNOTS)
    values, slope = _transforms(np.sinh(knots), nu, bonded)
    return tuple(
        CubicSpline(knots, column, bc_type=((1, start), "not-a-knot"))
        for column, start in zip(values.T, (0.0, 0.0, 0.0, slope), strict=True)
    )


def _transforms(scaled, nu, bonded):
    """What the base takes from the radial functions (m, 4), times pi h/(1+nu), at s = r/h (m, rising); the last slope.

    int (1-nu) W_n J0, int [(1-nu) W_l + W_s]/2 J0, int [W_s - (1-nu) W_l]/2 J2, int V/2 J1 over Q from 0.
    """
    result, slope = np.empty((len(scaled), 4)), 0.0
    for chunk in np.array_split(np.arange(len(scaled)), math.ceil(len(scaled) / 64)):
        s = scaled[chunk]
        # Each panel holds at most a period and a half of the Bessel functions, on 16 nodes
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
    """Shares of the half-space's compliance that the layer lacks: normal, along, across; and V, with coupling
    proportional to 1 - 2nu - V. All fall as exp(-2Q), and none cancels."""
    decay = np.exp(-2 * Q)
    numerator = (3 - 4 * nu) * (1 + decay**2) + 2 * decay * (2 * Q * Q + 5 + 4 * nu * (2 * nu - 3))
    common = (3 - 4 * nu) * decay + 2 * Q * Q + 5 - 12 * nu + 8 * nu**2
    normal, along = (2 * decay * (common + sign * 2 * Q) / numerator for sign in (1, -1))
    coupling = 2 * decay * ((1 - 2 * nu) * (2 * Q * Q + 8 * (1 - nu) ** 2) + 2 * Q * Q) / numerator
    return normal, along, 2 * decay / (1 + decay), coupling
