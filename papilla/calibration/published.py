"""Equations (9) and (10) of the 2006 paper as printed, the exact inverse of (9), and the difference of readings from
them.

S_d's unit is not stated there, so readings in microstrain are compared up to one scale factor; (10) is not the exact
inverse of (9), because its coefficients were printed with two digits.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from papilla.calibration.record import QuadraticInverse, invert_quadratic, quadratic
from papilla.errors import InputError
from papilla.units import gf_to_newton

if TYPE_CHECKING:
    from papilla.calibration.record import Calibration

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


def compare_with_published(calibration: "Calibration", force_gf: ArrayLike) -> tuple[np.ndarray, np.ndarray, float]:
    """S_d of a calibration (k, 3) in microstrain at forces (gf) and the published moduli, that of (9), and the scale.

    scale : published S_d per microstrain that fits best. Raises `InputError` if the calibration does not cover them.
    """
    force = np.asarray(force_gf, float)[:, None]
    ours = calibration.predict(gf_to_newton(force), np.array(SPECIMENS_MPA)[None, :])
    if not np.isfinite(ours).all():
        raise InputError("the calibration does not cover the published forces and moduli (10-100 gf, 0.089-0.72 MPa)")
    theirs = published_sd(force, np.array(SPECIMENS_MPA)[None, :])
    return ours, theirs, float((ours * theirs).sum() / (ours**2).sum())
