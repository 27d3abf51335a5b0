"""Surface of a half-space and of a bonded layer under normal and tangential point forces (mm, N, MPa).

z is depth into the solid, rows and columns of a Green's tensor are x, y, z: u = green @ force / modulus. A layer's is
the half-space's plus a smooth tensor of distance, by Hankel transforms of its spectral compliance: at wavenumber q the
in-plane displacements (along the wave and down) answer the in-plane tractions, and shear across the wave stands alone.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import j0, j1, jv

from papilla import checks
from papilla.errors import InputError
from papilla.references.halfspace import surface_points
from papilla.references.kernel import FAR, KNOTS
from papilla.references.layer import DEFICIT_CUTOFF, bonded_layer_deficit, panel_quadrature, scaled_numerator


def cerruti_displacement(points, force: float, modulus: float, nu: float):
    """Displacement (..., 3) in mm of a half-space under a tangential force (N) along x at the origin.

    With s = |point|, G the shear modulus: u_x = F/(4 pi G) {1/s + x^2/s^3 + (1-2nu) [1/(s+z) - x^2/(s (s+z)^2)]},
    u_y = F/(4 pi G) {x y/s^3 - (1-2nu) x y/(s (s+z)^2)}, u_z = F/(4 pi G) {x z/s^3 + (1-2nu) x/(s (s+z))}.

    `points` (..., 3) in mm with z >= 0, `modulus` in MPa. Raises `InputError` as `boussinesq_displacement` does.
    Source: Johnson (1985), section 3.6, doi:10.1017/CBO9781139171731.
    """
    points, s = surface_points(points)
    modulus, nu = checks.positive("modulus (MPa)", modulus), checks.poisson("nu", nu)
    scale = checks.finite("force (N)", force) * (1 + nu) / (2 * math.pi * modulus)
    x, z, along = points[..., :1], points[..., 2:], np.array([1.0, 0.0, 0.0])
    dyad, sunk = x * points / s**3, 1 / (s + z)
    sideways = along * sunk - x * points * [1.0, 1.0, 0.0] * sunk**2 / s
    down = np.array([0.0, 0.0, 1.0]) * x * sunk / s
    return scale * (along / s + dyad + (1 - 2 * nu) * (sideways + down))


def halfspace_green(xy, nu: float):
    """Surface Green's tensor (..., 3, 3) of a half-space, times its modulus, at offsets (..., 2) from the force: 1/mm.

    With e the unit offset and r its length, times pi/(1+nu): tangential [(1-nu) 1 + nu e e]/r, normal (1-nu)/r,
    coupling +-(1-2nu)/2 e/r: a push draws the surface towards it. Raises `InputError` at the origin.
    Source: Johnson (1985), sections 3.2 and 3.6, doi:10.1017/CBO9781139171731.
    """
    xy, nu = np.asarray(xy, dtype=float), checks.poisson("nu", nu)
    r = np.linalg.norm(xy, axis=-1)
    if not np.all(np.isfinite(r) & (r > 0)):
        raise InputError("offsets (mm) must be finite and away from the force")
    direction = xy / r[..., None]
    radial = ((1 + nu) / math.pi * factor / r for factor in _half_space(nu))
    return green_tensor(direction, *radial)


def _half_space(nu):
    """Factors of 1/r in the radial functions, times (1+nu)/(pi E): normal, mean, deviator, coupling."""
    return 1 - nu, 1 - nu / 2, nu / 2, (1 - 2 * nu) / 2


def green_tensor(direction, normal, mean, deviator, coupling):
    """The isotropic tensor (..., 3, 3) of four radial functions (...): normal; tangential mean * 1 + deviator *
    (2 e e - 1); u_z = coupling e . force and u_e = -coupling * normal force. `direction` e is (..., 2)."""
    tensor = np.zeros((*np.shape(normal), 3, 3))
    dyad = direction[..., :, None] * direction[..., None, :]
    tensor[..., :2, :2] = (mean - deviator)[..., None, None] * np.eye(2) + 2 * deviator[..., None, None] * dyad
    tensor[..., 2, 2] = normal
    tensor[..., 2, :2] = coupling[..., None] * direction
    tensor[..., :2, 2] = -coupling[..., None] * direction
    return tensor


def bonded_layer_compliance(wavenumber, thickness: float, modulus: float, nu: float):
    """Spectral compliance (..., 3, 3) of a layer bonded to a rigid base, mm/MPa: real amplitudes of u over traction.

    Tractions (t_l sin qx, t_s sin qx, t_n cos qx) give (u_l sin qx, u_s sin qx, u_n cos qx), l along and s across the
    wave, n down. With Q = q h, D = (3-4nu) cosh 2Q + 2Q^2 + 4nu(2nu-3) + 5 and G the shear modulus:
    l, n: (1-nu)/(G q) [(3-4nu) sinh 2Q +- 2Q]/D; coupling l n: -[(1-2nu)(3-4nu)(cosh 2Q - 1) - 2Q^2]/(2 G q D); across:
    tanh Q/(G q). `wavenumber` in 1/mm > 0. Raises `InputError` for values that are not positive.
    Source: two-mode solution of Johnson (1985), section 5.8, doi:10.1017/CBO9781139171731.
    """
    q = np.asarray(wavenumber, dtype=float)
    if not np.all(np.isfinite(q) & (q > 0)):
        raise InputError("wavenumber (1/mm) must be finite and greater than 0")
    shear = checks.positive("layer modulus (MPa)", modulus) / (2 * (1 + checks.poisson("layer nu", nu)))
    normal, along, across, coupling = _deficits(q * checks.positive("layer thickness (mm)", thickness), nu)
    result = np.zeros((*q.shape, 3, 3))
    for k, value in enumerate(((1 - nu) * (1 - along), 1 - across, (1 - nu) * (1 - normal))):
        result[..., k, k] = value
    result[..., 0, 2] = result[..., 2, 0] = -(1 - 2 * nu - coupling) / 2
    return result / (shear * q[..., None, None])


@dataclass(frozen=True)
class BondedLayerGreen:
    """Surface Green's tensor of a bonded layer minus the half-space's, times E, from tables: (..., 3, 3) in 1/mm.

    u = [green(xy) + halfspace_green(xy, nu)] @ force / E; smooth, and finite at the origin. The normal part is
    `BondedLayerKernel`. `thickness` in mm; raises `InputError` for thickness <= 0 or nu outside [0, 0.5].
    Source: Hankel transforms of `bonded_layer_compliance`.
    """

    thickness: float
    nu: float

    def __post_init__(self):
        checks.positive("layer thickness (mm)", self.thickness)
        checks.poisson("layer nu", self.nu)

    def __call__(self, xy):
        xy = np.asarray(xy, dtype=float)
        r = np.linalg.norm(xy, axis=-1)
        direction = np.divide(xy, r[..., None], out=np.zeros_like(xy), where=r[..., None] > 0)
        return green_tensor(direction, *self.radial(r))

    def radial(self, r):
        """The four radial functions (..., in 1/mm) at distances r >= 0 (mm): normal, mean, deviator, coupling."""
        scaled, nu = np.asarray(r, dtype=float) / self.thickness, self.nu
        near = _table(nu)(np.arcsinh(np.minimum(scaled, FAR)))
        # Beyond the table the layer's own displacement is nothing, and the half-space's is taken away
        beyond = np.divide(1.0, scaled, out=np.zeros_like(scaled), where=scaled >= FAR)
        lacking = np.where((scaled < FAR)[..., None], near, np.array(_half_space(nu)) * beyond[..., None])
        return tuple(np.moveaxis(-(1 + nu) / (math.pi * self.thickness) * lacking, -1, 0))


@lru_cache(maxsize=64)
def _table(nu: float) -> CubicSpline:
    """Splines of the four transforms over asinh(r/h)."""
    knots = np.linspace(0.0, math.asinh(FAR), KNOTS)
    return CubicSpline(knots, _transforms(np.sinh(knots), nu))


def _transforms(scaled, nu):
    """What bonding takes from the half-space's radial functions (m, 4), times pi h/(1+nu), at s = r/h (m, rising).

    int (1-nu) W_n J0, int [(1-nu) W_l + W_s]/2 J0, int [W_s - (1-nu) W_l]/2 J2, int V/2 J1 over Q from 0.
    """
    result = np.empty((len(scaled), 4))
    for chunk in np.array_split(np.arange(len(scaled)), max(1, math.ceil(len(scaled) / 64))):
        s = scaled[chunk]
        # Each panel holds at most a period and a half of the Bessel functions, on 16 nodes
        Q, weights = panel_quadrature(0.0, DEFICIT_CUTOFF, 8 + math.ceil(DEFICIT_CUTOFF * s[-1] / 9))
        normal, along, across, coupling = (weights * deficit for deficit in _deficits(Q, nu))
        waves = np.outer(s, Q)
        even, along = j0(waves), (1 - nu) * along
        columns = even @ ((1 - nu) * normal), even @ (along + across) / 2, jv(2, waves) @ (across - along) / 2
        result[chunk] = np.stack([*columns, j1(waves) @ coupling / 2], axis=1)
    return result


def _deficits(Q, nu):
    """Shares of the half-space's compliance that the layer lacks: normal, along, across; and V, with coupling
    proportional to 1 - 2nu - V. All fall as exp(-2Q), and none cancels."""
    decay, numerator = scaled_numerator(Q, nu)
    along = 2 * decay * ((3 - 4 * nu) * decay + 2 * Q * Q - 2 * Q + 5 - 12 * nu + 8 * nu**2) / numerator
    across = 2 * decay / (1 + decay)
    coupling = 2 * decay * ((1 - 2 * nu) * (2 * Q * Q + 8 * (1 - nu) ** 2) + 2 * Q * Q) / numerator
    return bonded_layer_deficit(Q, nu), along, across, coupling
