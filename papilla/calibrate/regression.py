"""Least-squares refit of the published form S_d = a f^2 + b f + c E^2 + d E + e, and what the fit has to confess."""

import numpy as np

from papilla.calibration.quadratic import FORWARD_TERMS, Quadratic
from papilla.errors import InputError
from papilla.units import newton_to_gf

PUBLISHED_MODULI_MPA = (0.089, 0.72)
"""Range of moduli that was published."""
DEAD = 1e-10
"""Singular value of the normalised columns, against the largest, below which a combination of terms is undetermined."""


def fit_quadratic(force_N, modulus_MPa, sd_microstrain) -> Quadratic:
    """Fit the published form to presses.

    Parameters
    ----------
    force_N, modulus_MPa, sd_microstrain : (n,) finite. Only moduli in the published 0.089-0.72 MPa are used where there
        are at least three of them; otherwise all are, and a note says so.

    The columns are scaled to unit length and solved by singular values, so units do not matter. Raises `InputError`
    where the presses do not determine all five terms (naming those they leave open) or are fewer than five.
    """
    force, modulus, sd = (np.asarray(values, float) for values in (force_N, modulus_MPa, sd_microstrain))
    low, high = PUBLISHED_MODULI_MPA
    # The ends count although a table of moduli rounds them.
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
        notes=(*notes, *_confess(force, modulus, sd, residual, coefficients, covariance)),
    )


def _refuse_dead_terms(singular: np.ndarray, right: np.ndarray) -> None:
    void = right[singular < DEAD * singular[0]]
    if len(void):
        dead = [name for name, share in zip(FORWARD_TERMS, np.abs(void).max(axis=0), strict=True) if share > 1e-3]
        raise InputError(
            f"the presses do not determine the terms {', '.join(dead)} of the quadratic: "
            "give at least three forces and three moduli"
        )


def _confess(force, modulus, sd, residual, coefficients, covariance) -> list[str]:
    """What a reader of the coefficients has to doubt."""
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
