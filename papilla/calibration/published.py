"""The published quadratic form of S_d: its fit to presses, its exact inverse, equations (9) and (10) of the 2006 paper
as printed, and a calibration compared with (9).

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

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.short_repr import short_repr
from papilla.core.units import gf_to_newton, newton_to_gf

FORWARD_TERMS = ("f2", "f", "E2", "E", "1")
INVERSE_TERMS = ("sd", "f2", "f", "1")

SPECIMENS_MPA = (0.089, 0.51, 0.72)
"""Moduli of the published silicone specimens."""
SMALLEST_TERM_SINGULAR_VALUE = 1e-10
"""Singular value of the normalised columns, relative to the largest, below which a combination of terms is not
determined."""

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
        slack = checks.ROUNDING_SHARE * (abs(self.shift) + high)
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
    modes, singular, right = np.linalg.svd(columns / lengths, full_matrices=False)
    _refuse_dead_terms(singular, right)
    coefficients = (right.T @ ((modes.T @ sd) / singular)) / lengths
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
        notes=(*notes, *_notes(force, modulus, sd, residual, coefficients, covariance)),
    )


def _refuse_dead_terms(singular: np.ndarray, right: np.ndarray) -> None:
    """Raise `InputError` naming the terms in combinations of vanishing singular value."""
    void = right[singular < SMALLEST_TERM_SINGULAR_VALUE * singular[0]]
    if len(void):
        dead = [name for name, share in zip(FORWARD_TERMS, np.abs(void).max(axis=0), strict=True) if share > 1e-3]
        raise InputError(
            f"the presses do not determine the terms {', '.join(dead)} of the quadratic: "
            "give at least three forces and three moduli"
        )


def _notes(force, modulus, sd, residual, coefficients, covariance) -> list[str]:
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


PUBLISHED_FORCE_GF = (5.0, 100.0)
"""Forces for which (9) was fitted: its S_d is negative below, and specimens could be distinguished up to about 100
gf."""
PUBLISHED_FORWARD = (-0.0314, 14.5, 87.2, 104.5, -81.9)
"""Eq. (9): a, b, c, d, e with f in gf and E in MPa."""
PUBLISHED_INVERSE = QuadraticInverse(np.array([0.0115, 0.00036, -0.166, 1.3]), 0.6, 1, (-0.6, np.inf))
"""Eq. (10) as printed."""
HEAVY_GF = 30.0
"""Smallest force at which the S_d of (9) depends little on its modulus term at zero force, which no contact can
have."""


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
class PublishedAgreement:
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


def compare(predict: Predict, force_gf: ArrayLike = tuple(range(10, 101, 10))) -> PublishedAgreement:
    """Compare a calibration's S_d with eq. (9) at the three published moduli; the scale is fitted by least squares.

    Raises `InputError` if the calibration does not cover those forces and moduli.
    """
    force = np.asarray(force_gf, float)
    ours, theirs, scale = compare_with_published(predict, force)
    return PublishedAgreement(scale, *_misfits(scale * ours - theirs, theirs, force), force, theirs, scale * ours)


def covered_comparison(predict: Predict) -> PublishedAgreement | None:
    """`compare`, or None if the calibration does not cover the published forces and moduli."""
    try:
        return compare(predict)
    except InputError:
        return None


def _misfits(difference: np.ndarray, theirs: np.ndarray, force_gf: np.ndarray) -> tuple[float, float, float, float]:
    """Root mean square of differences (k, 3) relative to that of the published values, for all forces and for those
    from `HEAVY_GF` on (NaN if there are none); and the same for differences relative to their own published values."""
    heavy = force_gf >= HEAVY_GF
    parts = (difference, theirs), (difference[heavy], theirs[heavy])
    overall = [float(np.sqrt((off**2).sum() / (of**2).sum())) if of.size else np.nan for off, of in parts]
    by_press = [float(np.sqrt(np.mean((off / of) ** 2))) if of.size else np.nan for off, of in parts]
    return overall[0], overall[1], by_press[0], by_press[1]
