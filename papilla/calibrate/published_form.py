"""What the papers print, and a calibration compared with it: the form S_d = a f^2 + b f + c E^2 + d E + e, refit by
least squares, its coefficients (9) and (10), and depths of presses.

(9) and (10) are printed in the 2006 paper. The unit of S_d is not stated there. (10) is not the exact inverse of (9),
because its coefficients were printed with two digits.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from papilla.calibrate.press_table import cached_press
from papilla.calibration import Calibration
from papilla.calibration.published import (
    FORWARD_TERMS,
    SPECIMENS_MPA,
    Quadratic,
    QuadraticInverse,
    compare_with_published,
    published_sd,
)
from papilla.errors import InputError
from papilla.fem import ReducedFinger, press
from papilla.finger import Finger
from papilla.short_repr import short_repr
from papilla.specimen import HalfSpace
from papilla.units import gf_to_newton, newton_to_gf

HEAVY_GF = 30.0
"""Smallest force at which the S_d of (9) depends little on its modulus term at zero force, which no contact can
have."""
DEAD = 1e-10
"""Singular value of the normalised columns, relative to the largest, below which a combination of terms is not
determined."""

PUBLISHED_POINTS = ((0.20, gf_to_newton(0.70)), (0.80, gf_to_newton(38.37)), (1.0, 0.6))
"""Depth (mm) and force (N) of presses on gratings (2006; 1 mm of 2011), from where the touch was detected."""

RIGID = HalfSpace(1e4)
"""Specimen that stands for the gratings, because the papers state neither their material nor the contact."""


def fit_quadratic(force_N: ArrayLike, modulus_MPa: ArrayLike, sd_microstrain: ArrayLike) -> Quadratic:
    """Fit the published form to presses.

    Parameters
    ----------
    force_N, modulus_MPa, sd_microstrain : (n,) finite. Only moduli in the published range 0.089-0.72 MPa are used if
        there are at least three of them; otherwise all are used, and a note says so.

    The columns are scaled to unit length and solved by singular values, so units do not matter. Raises `InputError` if
    there are fewer than five presses or if they do not determine all five terms (the message names those that are not
    determined).
    """
    force, modulus, sd = (np.asarray(values, float) for values in (force_N, modulus_MPa, sd_microstrain))
    low, high = SPECIMENS_MPA[0], SPECIMENS_MPA[-1]
    # The ends of the range count, although a table rounds its moduli.
    chosen = (modulus >= low * (1 - 1e-9)) & (modulus <= high * (1 + 1e-9))
    notes = []
    if len(np.unique(modulus[chosen])) < 3:
        chosen = np.ones(len(modulus), bool)
        notes.append(f"fewer than three moduli in {low}-{high} MPa, the published range: all are fitted")
    force, modulus, sd = newton_to_gf(force[chosen]), modulus[chosen], sd[chosen]
    if len(sd) < 5:
        raise InputError(f"five coefficients need at least five presses, got {len(sd)}")
    columns = np.column_stack([force**2, force, modulus**2, modulus, np.ones_like(force)])
    lengths = np.sqrt((columns**2).sum(axis=0))
    left, singular, right = np.linalg.svd(columns / lengths, full_matrices=False)
    _refuse_dead_terms(singular, right)
    coefficients = (right.T @ ((left.T @ sd) / singular)) / lengths
    residual = sd - columns @ coefficients
    freedom = len(sd) - 5
    variance = float(residual @ residual) / freedom if freedom else np.nan
    scaled = right.T / singular
    covariance = variance * (scaled @ scaled.T) / np.outer(lengths, lengths)
    return Quadratic(
        coefficients=coefficients,
        stderr=np.sqrt(np.diag(covariance)),
        covariance=covariance,
        rms=float(np.sqrt((residual**2).mean())),
        max=float(np.abs(residual).max()),
        modulus_MPa=(float(modulus.min()), float(modulus.max())),
        condition=float(singular[0] / singular[-1]),
        notes=(*notes, *_doubts(force, modulus, sd, residual, coefficients, covariance)),
    )


def _refuse_dead_terms(singular: np.ndarray, right: np.ndarray) -> None:
    """Raise `InputError` naming the terms in combinations of vanishing singular value."""
    void = right[singular < DEAD * singular[0]]
    if len(void):
        dead = [name for name, share in zip(FORWARD_TERMS, np.abs(void).max(axis=0), strict=True) if share > 1e-3]
        raise InputError(
            f"the presses do not determine the terms {', '.join(dead)} of the quadratic: "
            "give at least three forces and three moduli"
        )


def _doubts(force, modulus, sd, residual, coefficients, covariance) -> list[str]:
    """Doubts about the coefficients, as sentences."""
    notes = []
    for name, values in (("moduli", modulus), ("forces", force)):
        if len(np.unique(values)) == 3:
            notes.append(f"three {name} for three coefficients: an exact interpolation in them, with no freedom left")
    if len(sd) == 5:
        notes.append("five presses for five coefficients: no residual, so no error bars")
        return notes
    size = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = covariance / np.outer(size, size)
    for i, j in zip(*np.triu_indices(5, 1), strict=True):
        if abs(correlation[i, j]) > 0.95:
            pair = f"{FORWARD_TERMS[i]} and {FORWARD_TERMS[j]}"
            notes.append(f"the coefficients of {pair} are correlated ({correlation[i, j]:+.3f})")
    uncertain = [name for name, c, s in zip(FORWARD_TERMS, coefficients, size, strict=True) if abs(c) < 2 * s]
    if uncertain:
        notes.append(f"not distinguishable from zero at two standard errors: {', '.join(uncertain)}")
    if _is_misfit(force, modulus, residual):
        notes.append(
            "the residuals follow a pattern over force and modulus: the form does not fit, so the standard errors "
            "describe misfit, not noise"
        )
    return notes


def _is_misfit(force, modulus, residual) -> bool:
    """Whether neighbours (next force at the same modulus) have alike residuals: Durbin-Watson ratio below 1."""
    order = np.lexsort((force, modulus))
    same = np.diff(modulus[order]) == 0
    steps = np.diff(residual[order])[same]
    power = float((residual**2).mean())
    return len(steps) >= 10 and power > 0 and float((steps**2).mean()) < power


@dataclass(frozen=True)
class RoundingError:
    """Error that rounding the coefficients of the inverse causes over 5-100 gf and 0.05-1 MPa.

    largest_MPa : the error of E of largest size, with its sign, at (at_gf, at_MPa); relative : the same as a fraction
    of E; rms_MPa : over the grid.
    """

    largest_MPa: float
    at_gf: float
    at_MPa: float
    relative: float
    rms_MPa: float


def rounding_error(inverse: QuadraticInverse, moduli: ArrayLike | None = None) -> RoundingError:
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

    scale : published S_d per microstrain of the calibration; relative_rms : of the difference, over the rms of the
    published values, and heavy_rms the same from `HEAVY_GF` on, with the same scale; press_rms, heavy_press_rms : of
    the differences press by press, each over its own published value, where light presses count as much as heavy ones.
    force_gf (k,), published and scaled (k, 3): the values that were compared.
    """

    scale: float
    relative_rms: float
    heavy_rms: float
    press_rms: float
    heavy_press_rms: float
    force_gf: np.ndarray
    published: np.ndarray
    scaled: np.ndarray
    __repr__ = short_repr


def compare(calibration: Calibration, force_gf: ArrayLike = tuple(range(10, 101, 10))) -> Comparison:
    """Compare a calibration's S_d with eq. (9) at the three published moduli; the scale is fitted by least squares.

    Raises `InputError` if the calibration does not cover those forces and moduli.
    """
    force = np.asarray(force_gf, float)
    ours, theirs, scale = compare_with_published(calibration.predict, force)
    return Comparison(scale, *_misfits(scale * ours - theirs, theirs, force), force, theirs, scale * ours)


def covered_comparison(calibration: Calibration) -> Comparison | None:
    """`compare`, or None if the calibration does not cover the published forces and moduli."""
    try:
        return compare(calibration)
    except InputError:
        return None


def _misfits(difference: np.ndarray, theirs: np.ndarray, force_gf: np.ndarray) -> tuple[float, float, float, float]:
    """Root mean square of differences (k, 3) relative to that of the published values, for all forces and for those
    from `HEAVY_GF` on (NaN if there are none); and the same for differences relative to their own published values."""
    heavy = force_gf >= HEAVY_GF
    parts = (difference, theirs), (difference[heavy], theirs[heavy])
    whole = [float(np.sqrt((off**2).sum() / (of**2).sum())) if of.size else np.nan for off, of in parts]
    each = [float(np.sqrt(np.mean((off / of) ** 2))) if of.size else np.nan for off, of in parts]
    return whole[0], whole[1], each[0], each[1]


@dataclass(frozen=True)
class Depth:
    """A published depth (mm) at a force (N), and that of a finger: its indentation plus the touch-down offset of its
    bench."""

    published_mm: float
    force_N: float
    depth_mm: float

    @property
    def error(self) -> float:
        """Relative error of the finger's depth."""
        return self.depth_mm / self.published_mm - 1


def published_depths(finger: Finger, reduced: ReducedFinger) -> list[Depth]:
    """The published depths and those of a finger on a rigid flat, which stands for the gratings of the papers."""
    return [
        Depth(depth, force, cached_press(press, reduced, RIGID, force_N=force).indentation + finger.bench.touch_down)
        for depth, force in PUBLISHED_POINTS
    ]
