"""Spectral stiffness (pressure over normal displacement at one wavenumber) of layers on a rigid or elastic base."""

import numpy as np
from numpy.polynomial.legendre import leggauss

from papilla import checks
from papilla.errors import InputError

DEFICIT_CUTOFF = 24.0
"""Q = q h beyond which `bonded_layer_deficit` is below 1e-17."""


def halfspace_stiffness(wavenumber, e_star: float):
    """Normal pressure over normal surface displacement of a half-space, MPa/mm: E* q / 2.

    `wavenumber` q in 1/mm, any array > 0; `e_star` in MPa. Raises `InputError` unless both are positive.
    Source: Johnson (1985), section 13.2, doi:10.1017/CBO9781139171731.
    """
    return 0.5 * checks.positive("contact modulus (MPa)", e_star) * positive_wavenumber(wavenumber)


def bonded_layer_stiffness(wavenumber, thickness: float, modulus: float, nu: float):
    """Normal pressure over normal surface displacement of a layer bonded to a rigid base, MPa/mm.

    K(q) = (E* q/2) [(3-4nu) cosh 2Q + 2Q^2 + 4nu(2nu-3) + 5] / [(3-4nu) sinh 2Q - 2Q], Q = q h, frictionless top.
    It tends to E* q/2 for large Q, and to the oedometric modulus over h (nu = 0.5: 3 E*/(4 q^2 h^3)) for small Q.

    `wavenumber` q in 1/mm, any array > 0; `thickness` h in mm, `modulus` in MPa. No overflow, no cancellation.
    Raises `InputError` unless wavenumber, thickness and modulus are positive and nu is in [0, 0.5].
    Source: Johnson (1985), section 5.8, doi:10.1017/CBO9781139171731.
    """
    q, nu = positive_wavenumber(wavenumber), checks.poisson("layer nu", nu)
    Q = q * checks.positive("layer thickness (mm)", thickness)
    e_star = checks.positive("layer modulus (MPa)", modulus) / (1 - nu**2)
    decay, numerator = scaled_numerator(Q, nu)
    # (3-4nu)(sinh 2Q - 2Q) + 4Q(1-2nu): both terms positive, scaled by 2 exp(-2Q)
    denominator = (3 - 4 * nu) * _scaled_sinh_excess(2 * Q) + 8 * Q * (1 - 2 * nu) * decay
    return 0.5 * e_star * q * numerator / denominator


def bonded_layer_deficit(Q, nu: float):
    """Share W(Q) of the half-space's compliance that a bonded layer lacks: 1/K = (2/(E* q)) (1 - W), Q = q h >= 0.

    W falls from 1 at Q = 0 to 4 Q^2 exp(-2Q)/(3 - 4nu) and is computed without cancellation; dimensionless.
    Raises `InputError` for Q negative or NaN, or nu outside [0, 0.5]. Source: as `bonded_layer_stiffness`.
    """
    Q, nu = np.asarray(Q, dtype=float), checks.poisson("layer nu", nu)
    if not np.all(Q >= 0):
        raise InputError(f"scaled wavenumber Q must be at least 0, got a minimum of {np.min(Q):g}")
    decay, numerator = scaled_numerator(Q, nu)
    return 2 * decay * ((3 - 4 * nu) * decay + 2 * Q * Q + 2 * Q + 5 - 12 * nu + 8 * nu**2) / numerator


def positive_wavenumber(wavenumber):
    """The wavenumber in 1/mm as a float array; raises `InputError` unless every value is finite and > 0."""
    q = np.asarray(wavenumber, dtype=float)
    if not np.all(np.isfinite(q) & (q > 0)):
        raise InputError(f"wavenumber (1/mm) must be finite and greater than 0, got {np.min(q):g} to {np.max(q):g}")
    return q


def panel_quadrature(low: float, high: float, panels: int):
    """Nodes and weights of 16-point Gauss-Legendre quadrature on `panels` equal parts of [low, high]."""
    x, w = leggauss(16)
    width = (high - low) / panels
    left = low + width * np.arange(panels)
    return (left[:, None] + 0.5 * width * (x + 1)).ravel(), np.tile(0.5 * width * w, panels)


def scaled_numerator(Q, nu):
    """exp(-2Q), Q = q h, and the numerator of K times 2 exp(-2Q)."""
    decay = np.exp(-2 * Q)
    return decay, (3 - 4 * nu) * (1 + decay**2) + 2 * decay * (2 * Q * Q + 5 + 4 * nu * (2 * nu - 3))


def _scaled_sinh_excess(x):
    """2 exp(-x) (sinh x - x) for x >= 0, by its series below 1."""
    small = np.minimum(x, 1.0)
    term, series = small**3 / 6, np.zeros_like(small)
    for n in range(2, 11):
        series = series + term
        term = term * small**2 / (2 * n * (2 * n + 1))
    return np.where(x < 1, 2 * np.exp(-x) * series, -np.expm1(-2 * x) - 2 * x * np.exp(-x))
