"""Fits the five-coefficient form for a microcontroller. The fit minimises errors of the modulus, not of S_d."""

from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from papilla.calibration import Calibration
from papilla.calibration.compact import Compact, ln_sd
from papilla.errors import InputError
from papilla.units import gf_to_newton

FORCE_N = (gf_to_newton(10.0), gf_to_newton(100.0))
MODULUS_MPA = (0.05, 0.72)
"""Forces and moduli that are used if a calibration covers more: the range in which a modulus can be recovered."""
GRID = 24
START = (10.0, 0.5, -0.05, -3.0, 0.2)
STEEP = 1e-3
"""Smallest slope d ln S_d / d ln E in the weights: a press with a smaller slope says little about the modulus, and its
weight does not grow further."""


def fit_compact(calibration: Calibration) -> Compact:
    """Fit the form to a calibration's surface, over the part of 10-100 gf and 0.05-0.72 MPa that the calibration
    covers.

    Residuals are of ln S_d over the form's own slope in ln E, so that they are errors of the modulus. Raises
    `InputError` if the calibration covers too little of that range, or its S_d does not follow the form.
    """
    force = _inside(calibration.domain["force_N"], FORCE_N, "forces")
    modulus = _inside(calibration.domain["modulus_MPa"], MODULUS_MPA, "moduli")
    x, y = (part.ravel() for part in np.meshgrid(np.log(force), np.log(modulus), indexing="ij"))
    known = np.log(calibration.predict(np.exp(x), np.exp(y)))
    x, y, known = (part[np.isfinite(known)] for part in (x, y, known))

    first = least_squares(lambda values: ln_sd(values, x, y) - known, (float(known.mean()), *START[1:]))
    weights = 1 / np.maximum(_slope(first.x, x, y), STEEP)
    found = least_squares(lambda values: weights * (ln_sd(values, x, y) - known), first.x)
    if not found.success or not np.isfinite(found.x).all():
        raise InputError(f"the compact form was not fitted: {found.message}")
    ranges = (float(force[0]), float(force[-1])), (float(modulus[0]), float(modulus[-1]))
    residual = ln_sd(found.x, x, y) - known
    doubts = [value for name, value in calibration.sigmas.items() if name not in ("measurement", "fit")]
    form = Compact(found.x, *ranges, 0.0, 0.0, float(np.sqrt(np.mean(residual**2))), float(np.hypot.reduce(doubts)))
    wide = Compact(found.x, ranges[0], (0.0, np.inf), 0.0, 0.0, form.sd_rms)
    recovered = np.array([wide.invert(float(np.exp(s)), float(np.exp(f)))[0] for s, f in zip(known, x, strict=True)])
    error = recovered / np.exp(y) - 1
    if not np.isfinite(error).all():
        raise InputError("the calibration's S_d does not follow the compact form: it has no inverse there")
    return Compact(
        found.x, *ranges, float(np.sqrt(np.mean(error**2))), float(np.abs(error).max()), form.sd_rms, form.doubt
    )


def _slope(values: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """d ln S_d / d ln E of the form at ln f = x and ln E = y."""
    softer = np.exp(values[3] + values[4] * x - y)
    return softer / (1 + softer)


def with_compact(calibration: Calibration) -> Calibration:
    """The calibration with its compact form, or without it if the form does not fit."""
    try:
        return replace(calibration, compact=fit_compact(calibration))
    except InputError:
        return calibration


def _inside(own: tuple[float, float], wanted: tuple[float, float], what: str) -> np.ndarray:
    low, high = max(own[0], wanted[0]), min(own[1], wanted[1])
    if not high > 1.5 * low:
        raise InputError(f"the calibration covers too little of the {what} that the compact form is for")
    return np.clip(np.geomspace(low, high, GRID), low, high)
