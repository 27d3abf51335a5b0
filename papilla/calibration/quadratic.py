"""The published form of the calibration, S_d = a f^2 + b f + c E^2 + d E + e (2006, eq. 9), and its exact inverse.

f in gram-force, E in MPa, S_d in microstrain: the units of the publication.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from papilla.errors import InputError

FORWARD_TERMS = ("f2", "f", "E2", "E", "1")
INVERSE_TERMS = ("sd", "f2", "f", "1")


@dataclass(frozen=True, eq=False)
class Quadratic:
    """A fitted regression of the published form.

    Parameters
    ----------
    coefficients, stderr : (5,) in the order of `FORWARD_TERMS`; stderr is NaN where the data leave no freedom.
    covariance : (5, 5) of the coefficients.
    rms, max : of the residuals, microstrain.
    modulus_MPa : range of moduli that was fitted.
    condition : condition number of the normalised columns.
    notes : what a reader has to doubt, a sentence each.
    """

    coefficients: np.ndarray
    stderr: np.ndarray
    covariance: np.ndarray
    rms: float
    max: float
    modulus_MPa: tuple[float, float]
    condition: float
    notes: tuple[str, ...] = ()

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
    modulus_MPa : (low, high) where the quadratic rises with E, inside the fitted range; None where it nowhere does.
    """

    coefficients: np.ndarray
    shift: float
    branch: int
    modulus_MPa: tuple[float, float] | None

    def __call__(self, sd_microstrain: ArrayLike, force_gf: ArrayLike) -> np.ndarray:
        """E in MPa; NaN where S_d belongs to no modulus of the rising range (answers outside it are refused)."""
        sd, f = np.asarray(sd_microstrain, float), np.asarray(force_gf, float)
        per_sd, per_f2, per_f, constant = self.coefficients
        square = per_sd * sd + (per_f2 * f + per_f) * f + constant
        modulus = self.branch * np.sqrt(np.where(square >= 0, square, np.nan)) - self.shift
        if self.modulus_MPa is None:
            return np.full_like(modulus, np.nan)[()]
        low, high = self.modulus_MPa
        slack = 1e-9 * (abs(self.shift) + high)
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
    return QuadraticInverse(
        coefficients=np.array([1 / c, -a / c, -b / c, shift**2 - e / c]),
        shift=shift,
        branch=1 if c > 0 else -1,
        modulus_MPa=(low, high) if low < high else None,
    )
