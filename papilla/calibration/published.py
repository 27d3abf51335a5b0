"""The published quadratic form of S_d, its exact inverse, and equations (9) and (10) of the 2006 paper as printed.

S_d = a f^2 + b f + c E^2 + d E + e (9), f in gram-force, E in MPa. S_d's unit is not stated there, so readings in
microstrain are compared up to one scale factor; (10) is not the exact inverse of (9), because its coefficients were
printed with two digits.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from papilla import checks
from papilla.errors import InputError
from papilla.short_repr import short_repr
from papilla.units import gf_to_newton

FORWARD_TERMS = ("f2", "f", "E2", "E", "1")
INVERSE_TERMS = ("sd", "f2", "f", "1")

Predict = Callable[[ArrayLike, ArrayLike], np.ndarray]
"""S_d in microstrain at forces (N) and moduli (MPa): `Calibration.predict`."""


@dataclass(frozen=True, eq=False)
class Quadratic:
    """A fitted regression of the published form.

    Parameters
    ----------
    coefficients, stderr : (5,) in the order of `FORWARD_TERMS`; stderr is NaN if the data leave no degrees of freedom.
    covariance : (5, 5) of the coefficients.
    rms, max : of the residuals, microstrain.
    modulus_MPa : range of moduli that was fitted.
    condition : condition number of the normalised columns.
    notes : weaknesses of the fit, a sentence each.
    """

    coefficients: np.ndarray
    stderr: np.ndarray
    covariance: np.ndarray
    rms: float
    max: float
    modulus_MPa: tuple[float, float]
    condition: float
    notes: tuple[str, ...] = ()
    __repr__ = short_repr

    def __call__(self, force_gf: ArrayLike, modulus_MPa: ArrayLike) -> np.ndarray:
        """S_d in microstrain at forces (gf) and moduli (MPa) that broadcast."""
        return quadratic(self.coefficients, force_gf, modulus_MPa)

    @cached_property
    def inverse(self) -> "QuadraticInverse":
        """The exact inverse on the rising branch."""
        return invert_quadratic(self.coefficients, self.modulus_MPa)


@dataclass(frozen=True, eq=False)
class QuadraticInverse:
    """E = branch * sqrt(k0 S_d + k1 f^2 + k2 f + k3) - shift, with f in gf and S_d in microstrain.

    coefficients : (4,) in the order of `INVERSE_TERMS`; branch : sign of the E2 coefficient;
    modulus_MPa : (low, high) where the quadratic rises with E, inside the fitted range; None if it rises nowhere.
    """

    coefficients: np.ndarray
    shift: float
    branch: int
    modulus_MPa: tuple[float, float] | None
    __repr__ = short_repr

    def __call__(self, sd_microstrain: ArrayLike, force_gf: ArrayLike) -> np.ndarray:
        """E in MPa; NaN if S_d belongs to no modulus of the rising range."""
        sd, f = np.asarray(sd_microstrain, float), np.asarray(force_gf, float)
        per_sd, per_f2, per_f, constant = self.coefficients
        square = per_sd * sd + (per_f2 * f + per_f) * f + constant
        modulus = self.branch * np.sqrt(np.where(square >= 0, square, np.nan)) - self.shift
        if self.modulus_MPa is None:
            return np.full_like(modulus, np.nan)[()]
        low, high = self.modulus_MPa
        slack = checks.ROUNDING * (abs(self.shift) + high)
        return np.where((modulus >= low - slack) & (modulus <= high + slack), modulus, np.nan)[()]


def quadratic(coefficients: Sequence[float] | np.ndarray, force_gf: ArrayLike, modulus_MPa: ArrayLike) -> np.ndarray:
    """a f^2 + b f + c E^2 + d E + e at forces (gf) and moduli (MPa) that broadcast."""
    a, b, c, d, e = coefficients
    f, E = np.asarray(force_gf, float), np.asarray(modulus_MPa, float)
    return ((a * f + b) * f + (c * E + d) * E + e)[()]


def invert_quadratic(coefficients: Sequence[float] | np.ndarray, modulus_MPa: tuple[float, float]) -> QuadraticInverse:
    """The exact inverse of S_d = a f^2 + b f + c E^2 + d E + e on its rising branch, within a range of moduli.

    dS_d/dE = 2 c (E + shift) with shift = d / 2c, so the rising root has the sign of c. Raises `InputError` for c = 0.
    """
    a, b, c, d, e = (float(value) for value in coefficients)
    if c == 0 or not all(map(math.isfinite, (a, b, c, d, e))):
        raise InputError(f"the quadratic has no inverse: its E2 coefficient is {c:g}")
    shift = d / (2 * c)
    low, high = modulus_MPa
    low, high = (max(low, -shift), high) if c > 0 else (low, min(high, -shift))
    inverse = np.array([1 / c, -a / c, -b / c, shift**2 - e / c])
    return QuadraticInverse(inverse, shift, 1 if c > 0 else -1, (low, high) if low < high else None)


SPECIMENS_MPA = (0.089, 0.51, 0.72)
"""Moduli of the published silicone specimens."""
PUBLISHED_FORCE_GF = (5.0, 100.0)
"""Forces for which (9) was fitted: its S_d is negative below, and specimens could be distinguished up to about 100
gf."""
PUBLISHED_FORWARD = (-0.0314, 14.5, 87.2, 104.5, -81.9)
"""Eq. (9): a, b, c, d, e with f in gf and E in MPa."""
PUBLISHED_INVERSE = QuadraticInverse(np.array([0.0115, 0.00036, -0.166, 1.3]), 0.6, 1, (-0.6, np.inf))
"""Eq. (10) as printed."""


def published_sd(force_gf: ArrayLike, modulus_MPa: ArrayLike) -> np.ndarray:
    """S_d of eq. (9) at forces (gf) and moduli (MPa) that broadcast; the unit is not stated there."""
    return quadratic(PUBLISHED_FORWARD, force_gf, modulus_MPa)


def exact_inverse(digits: int | None = None) -> QuadraticInverse:
    """The exact inverse of eq. (9), with its coefficients rounded to `digits` significant digits if given."""
    exact = invert_quadratic(PUBLISHED_FORWARD, (0.0, np.inf))
    if digits is None:
        return exact
    rounded = np.array([float(f"{value:.{digits - 1}e}") for value in exact.coefficients])
    return QuadraticInverse(rounded, float(f"{exact.shift:.{digits - 1}e}"), exact.branch, (-np.inf, np.inf))


def compare_with_published(predict: Predict, force_gf: ArrayLike) -> tuple[np.ndarray, np.ndarray, float]:
    """S_d that `predict` gives (k, 3) in microstrain at forces (gf) and published moduli, that of (9), and the scale.

    scale : published S_d per microstrain that fits best. Raises `InputError` if the calibration does not cover them.
    """
    force = np.asarray(force_gf, float)[:, None]
    ours = predict(gf_to_newton(force), np.array(SPECIMENS_MPA)[None, :])
    if not np.isfinite(ours).all():
        raise InputError("the calibration does not cover the published forces and moduli (10-100 gf, 0.089-0.72 MPa)")
    theirs = published_sd(force, np.array(SPECIMENS_MPA)[None, :])
    return ours, theirs, float((ours * theirs).sum() / (ours**2).sum())
