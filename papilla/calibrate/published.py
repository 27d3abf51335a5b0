"""The published regression (9) and inverse (10) of the 2006 paper, and how a calibration compares with them.

S_d's unit is not stated there, and the exact inverse of (9) is not (10): its coefficients were printed with two digits.
"""

from dataclasses import dataclass

import numpy as np

from papilla.calibrate.press_table import SPECIMENS_MPA
from papilla.calibration import Calibration
from papilla.calibration.quadratic import QuadraticInverse, invert_quadratic
from papilla.errors import InputError
from papilla.units import gf_to_newton

PUBLISHED_FORWARD = (-0.0314, 14.5, 87.2, 104.5, -81.9)
"""Eq. (9): a, b, c, d, e with f in gf and E in MPa."""
PUBLISHED_INVERSE = QuadraticInverse(np.array([0.0115, 0.00036, -0.166, 1.3]), 0.6, 1, (-0.6, np.inf))
"""Eq. (10) as printed."""


def published_sd(force_gf, modulus_MPa):
    """S_d of eq. (9) at forces (gf) and moduli (MPa) that broadcast; the unit is not stated there."""
    a, b, c, d, e = PUBLISHED_FORWARD
    f, E = np.asarray(force_gf, float), np.asarray(modulus_MPa, float)
    return a * f**2 + b * f + c * E**2 + d * E + e


def exact_inverse(digits: int | None = None) -> QuadraticInverse:
    """The exact inverse of eq. (9); with its coefficients rounded to so many significant digits, if asked."""
    exact = invert_quadratic(PUBLISHED_FORWARD, (0.0, np.inf))
    if digits is None:
        return exact
    rounded = np.array([float(f"{value:.{digits - 1}e}") for value in exact.coefficients])
    return QuadraticInverse(rounded, float(f"{exact.shift:.{digits - 1}e}"), exact.branch, (-np.inf, np.inf))


@dataclass(frozen=True)
class RoundingError:
    """What rounding the inverse's coefficients costs over 5-100 gf and 0.05-1 MPa.

    largest_MPa : the error of E of largest size, with its sign, at (at_gf, at_MPa); relative : the same as a fraction
    of E; rms_MPa : over the grid.
    """

    largest_MPa: float
    at_gf: float
    at_MPa: float
    relative: float
    rms_MPa: float


def rounding_error(inverse: QuadraticInverse, moduli=None) -> RoundingError:
    """Error of E that an inverse makes on eq. (9)'s own S_d, over 5-100 gf x 0.05-1 MPa (or the given moduli)."""
    force = np.linspace(5, 100, 96)[:, None]
    modulus = np.linspace(0.05, 1.0, 96)[None, :] if moduli is None else np.asarray(moduli, float)[None, :]
    error = inverse(published_sd(force, modulus), force) - modulus
    i, j = np.unravel_index(np.nanargmax(np.abs(error)), error.shape)
    worst, at = float(error[i, j]), float(modulus[0, j])
    rms = float(np.sqrt(np.nanmean(error**2)))
    return RoundingError(worst, float(force[i, 0]), at, worst / at, rms)


@dataclass(frozen=True, eq=False)
class Comparison:
    """A calibration against eq. (9) up to one scale factor.

    scale : published S_d per microstrain of the calibration; relative_rms : of the difference, as a fraction of the rms
    of the published values; force_gf (k,), published and scaled (k, 3): the values that were compared.
    """

    scale: float
    relative_rms: float
    force_gf: np.ndarray
    published: np.ndarray
    scaled: np.ndarray


def compare(calibration: Calibration, force_gf=(10, 20, 30, 40, 50, 60, 70, 80, 90, 100)) -> Comparison:
    """Compare a calibration's S_d with eq. (9) at the three published moduli; the scale is fitted by least squares.

    Raises `InputError` where the calibration does not cover those forces and moduli.
    """
    force = np.asarray(force_gf, float)
    ours = calibration.predict(gf_to_newton(force)[:, None], np.array(SPECIMENS_MPA)[None, :])
    if not np.isfinite(ours).all():
        raise InputError("the calibration does not cover the published forces and moduli (10-100 gf, 0.089-0.72 MPa)")
    theirs = published_sd(force[:, None], np.array(SPECIMENS_MPA)[None, :])
    scale = float((ours * theirs).sum() / (ours**2).sum())
    difference = scale * ours - theirs
    relative = float(np.sqrt((difference**2).mean() / (theirs**2).mean()))
    return Comparison(scale, relative, force, theirs, scale * ours)
