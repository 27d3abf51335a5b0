"""Surface displacement of a layer bonded to a rigid base, minus that of a half-space: a smooth function of distance."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import j0

from papilla import checks
from papilla.errors import InputError
from papilla.references.layer import DEFICIT_CUTOFF, bonded_layer_deficit, panel_quadrature

FAR = 50.0
"""Distance over thickness beyond which the layer's own displacement, which decays at least as exp(-0.739 r/h), is 0."""

KNOTS = 1500


def bonded_layer_kernel(r, thickness: float, nu: float):
    """Green's function of a bonded layer minus the half-space's, times E, by direct quadrature: 1/mm.

    u(r) = [kernel(r) + (1 - nu^2)/(pi r)] F / E is the normal surface displacement in mm at `r` mm from a force F:
    kernel(r) = E/(2 pi) int (1/K(q) - 2/(E* q)) J0(q r) q dq, with K the `bonded_layer_stiffness`. It is negative:
    the layer is stiffer than the half-space.

    `r` is any array of distances >= 0, `thickness` is in mm; the result has the shape of r.
    Raises `InputError` for r negative or not finite, thickness <= 0 or nu outside [0, 0.5].
    Source: Hankel transform of Johnson (1985), section 5.8, doi:10.1017/CBO9781139171731.
    """
    r, thickness, nu = _checked(r, thickness, nu)
    scaled = r / thickness
    near = scaled < FAR
    deficit = np.divide(1.0, scaled, out=np.empty_like(scaled), where=~near)
    deficit[near] = _deficit_transform(scaled[near], nu)
    return -(1 - nu**2) / (math.pi * thickness) * deficit


@dataclass(frozen=True)
class BondedLayerKernel:
    """`bonded_layer_kernel` for one `thickness` (mm) and `nu`, from a table made once per nu: kernel(r) in 1/mm.

    Displacement in mm = [kernel(r) + (1 - nu^2)/(pi r)] * force / E. The table is within 1e-9 of kernel(0).
    Raises `InputError` for thickness <= 0 or nu outside [0, 0.5], and for r negative or not finite when called.
    """

    thickness: float
    nu: float

    def __post_init__(self):
        checks.positive("layer thickness (mm)", self.thickness)
        checks.poisson("layer nu", self.nu)

    def __call__(self, r):
        r, thickness, nu = _checked(r, self.thickness, self.nu)
        scaled = r / thickness
        deficit = _table(nu)(np.arcsinh(np.minimum(scaled, FAR)))
        np.divide(1.0, scaled, out=deficit, where=scaled >= FAR)
        return -(1 - nu**2) / (math.pi * thickness) * deficit


def _checked(r, thickness, nu):
    r = np.asarray(r, dtype=float)
    if not np.all(np.isfinite(r) & (r >= 0)):
        raise InputError(f"distance r (mm) must be finite and at least 0, got {np.min(r):g} to {np.max(r):g}")
    return r, checks.positive("layer thickness (mm)", thickness), checks.poisson("layer nu", nu)


@lru_cache(maxsize=64)
def _table(nu: float) -> CubicSpline:
    """Spline of the deficit's transform over asinh(r/h), which spaces the knots as the function varies."""
    knots = np.linspace(0.0, math.asinh(FAR), KNOTS)
    return CubicSpline(knots, _deficit_transform(np.sinh(knots), nu), bc_type=((1, 0.0), "not-a-knot"))


def _deficit_transform(scaled, nu):
    """int_0^inf W(Q) J0(Q s) dQ of the deficit W at scaled distances s = r/h < 50, shape of `scaled`."""
    flat = np.ravel(scaled)
    result = np.empty(flat.shape)
    order = np.argsort(flat)
    # Fewer panels do where J0 oscillates less: each holds at most a period and a half, on 16 nodes
    for chunk in np.array_split(order, max(1, math.ceil(len(order) / 64))):
        if len(chunk):
            nodes, weights = panel_quadrature(0.0, DEFICIT_CUTOFF, 8 + math.ceil(DEFICIT_CUTOFF * flat[chunk[-1]] / 9))
            result[chunk] = j0(np.outer(flat[chunk], nodes)) @ (weights * bonded_layer_deficit(nodes, nu))
    return result.reshape(np.shape(scaled))
