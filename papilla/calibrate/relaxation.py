"""Fits the Prony series of relaxing silicone to a touch that is held.

While the contact grows, a relaxing finger responds like an elastic one to its equivalent force, F_e = integral of E(0)
J(t - s) dF(s) (`papilla.references.viscoelastic`): exactly on a rigid specimen, nearly on one that is much harder than
the finger. The elastic response is y = a f(k F_e) + c, where f is that of a finger's model and k corrects its
stiffness; without a model f is a power of the force. A touch whose force or depth is held determines all unknowns.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from papilla.errors import InputError
from papilla.logs import PressLog
from papilla.logs.presses import loading, touches
from papilla.references import Prony

if TYPE_CHECKING:
    from papilla.calibrate.identification import Identification

POWERS, STIFFER = (0.3, 1.2), (0.3, 3.0)
"""Bounds of the exponent of the force in an elastic response (2/3 for the depth of a ball, up to 1 for readings), and
of the factor k of a model."""

SHRINKING = 0.02
"""Share of its range by which a response may fall below its earlier maximum before the contact counts as shrinking."""

RESOLVED = (2.0, 2.0)
"""A relaxation time can be determined if it is at least so many steps of the log, and at most the log's duration
divided by the second number."""

STARTS = (0.02, 0.1, 0.5)
"""Start values of the relaxation time of a one-term fit, relative to the log's duration; two terms start from all
pairs."""


@dataclass(frozen=True)
class Relaxation:
    """A Prony series of p terms, fitted to n rows of a log.

    share_sigma, time_sigma : (p,) standard deviations; those of the times are relative. power : exponent of the force,
    or the factor k of a model. rms : of the residuals, relative to the observed range. rate_per_s : range of d ln F /
    dt in the rows of the loading. doubts : a sentence each.
    """

    prony: Prony
    share_sigma: tuple[float, ...]
    time_sigma: tuple[float, ...]
    power: float
    rms: float
    rate_per_s: tuple[float, float]
    doubts: tuple[str, ...]


def fit_relaxation(
    time_s: ArrayLike,
    force_N: ArrayLike,
    observed: ArrayLike,
    *,
    terms: int = 1,
    elastic: Callable[[np.ndarray], np.ndarray] | None = None,
) -> Relaxation:
    """Fit one or two Prony terms to a touch that is loaded and held.

    Parameters
    ----------
    time_s : (n,) rising, from the moment of touch. force_N : (n,) > 0. observed : (n,) indentation (mm) or S_d
        (microstrain), of any unit and zero.
    elastic : response at forces (n,) of a finger that does not relax. Without it a power of the force is used, which
        ignores the effect of bone and layers.

    Rows after the contact begins to shrink are left out. Raises `InputError` for another number of terms, values that
    are not finite, or fewer rows than three more than the fit has unknowns.
    """
    time, force, seen = (np.asarray(values, float) for values in (time_s, force_N, observed))
    if terms not in (1, 2):
        raise InputError(f"terms of relaxation must be 1 or 2, got {terms!r}")
    if not (time.shape == force.shape == seen.shape and time.ndim == 1):
        raise InputError("time_s, force_N and observed must be (n,) of one length")
    if not all(np.isfinite(part).all() for part in (time, force, seen)) or (force <= 0).any():
        raise InputError("time_s, force_N and observed must be finite, and forces greater than 0")
    time, force, seen = (part[: _growing(seen)] for part in (time, force, seen))
    unknowns = 2 * terms + 3
    if len(time) < unknowns + 3:
        raise InputError(
            f"{len(time)} rows while the contact grows are too few for {terms} terms: at least {unknowns + 3}"
        )
    span, shape = float(time[-1] - time[0]), POWERS if elastic is None else STIFFER
    low = np.array([1e-4] * terms + [np.log(1e-3 * span)] * terms + [shape[0]])
    high = np.array([0.95 / terms] * terms + [np.log(10 * span)] * terms + [shape[1]])
    wide = float(np.ptp(seen)) or 1.0

    def residuals(vector: np.ndarray) -> np.ndarray:
        prony = Prony(tuple(vector[:terms]), tuple(np.exp(vector[terms : 2 * terms]) * _APART[:terms]))
        felt = prony.strained(time, force)
        answer = felt ** vector[-1] if elastic is None else elastic(vector[-1] * felt)
        # Factor a and zero c are linear: they are solved for each trial (variable projection).
        columns = np.column_stack([answer, np.ones_like(time)])
        return (seen - columns @ np.linalg.lstsq(columns, seen)[0]) / wide

    fits = []
    for first in STARTS:
        others = [one for one in STARTS if one > first] if terms == 2 else [None]
        for second in others:
            taus = np.log(span * np.array([one for one in (first, second) if one is not None]))
            begin = np.concatenate([[0.3 / terms] * terms, taus, [2 / 3 if elastic is None else 1.0]])
            fits.append(least_squares(residuals, begin, bounds=(low, high), x_scale=np.maximum(np.abs(begin), 0.1)))
    best = min(fits, key=lambda one: one.cost)
    # With `wide` the residuals are dimensionless; their scatter is the noise: s^2 = 2 cost / (n - unknowns).
    freedom = len(time) - unknowns
    covariance = np.linalg.pinv(best.jac.T @ best.jac) * 2 * best.cost / freedom
    sigma = np.sqrt(np.diag(covariance))
    taus = np.exp(best.x[terms : 2 * terms]) * _APART[:terms]
    order = np.argsort(taus)
    return Relaxation(
        Prony(tuple(best.x[:terms][order].tolist()), tuple(taus[order].tolist())),
        tuple(sigma[:terms][order].tolist()),
        tuple(sigma[terms : 2 * terms][order].tolist()),
        float(best.x[-1]),
        float(np.sqrt(2 * best.cost / len(time))),
        _rates(time, force),
        _doubts(best.x[:terms][order], taus[order], sigma[:terms][order], time),
    )


@dataclass(frozen=True)
class TouchRelaxation:
    """How the silicone of an identified finger relaxes, from one touch.

    fitted : the Prony series. modulus_MPa : of the specimen. by : what was fitted, "indentation" or "S_d".
    crept : least and largest equivalent force over force in the rows of the loading.
    """

    fitted: Relaxation
    modulus_MPa: float
    by: str
    crept: tuple[float, float]

    @property
    def recorded(self) -> dict:
        """The fields for `papilla.finger_parts.Identified`."""
        prony = self.fitted.prony
        return {"relaxation_shares": prony.shares, "relaxation_times_s": prony.times_s, "crept": self.crept}

    def to_json(self) -> dict:
        """Everything as plain values."""
        fitted = self.fitted
        names = ("share", "share_sigma", "time_s", "time_relative_sigma")
        terms = zip(fitted.prony.shares, fitted.share_sigma, fitted.prony.times_s, fitted.time_sigma, strict=True)
        return {
            "modulus_MPa": self.modulus_MPa,
            "by": self.by,
            "terms": [dict(zip(names, term, strict=True)) for term in terms],
            "rms": fitted.rms,
            "loading_rate_per_s": list(fitted.rate_per_s),
            "crept": list(self.crept),
            "doubts": list(fitted.doubts),
        }


def fit_touch(found: "Identification", log: PressLog, terms: int) -> TouchRelaxation:
    """Fit Prony terms to the longest touch of a log, with the identified finger as the elastic model.

    found : identification from presses on one specimen. log : the whole log, with times and readings of the same
    gauges. Indentations are fitted if the log has them, else S_d. Raises as `fit_relaxation`.
    """
    time, problem, values = log.t_s, found.problem, found.values
    assert time is not None, "a log over time has times"
    rows = max(touches(log.modulus_MPa), key=lambda touch: float(np.ptp(time[touch])))
    gain, lever, zeros = (problem.each(name, values) for name in ("gain", "lever_mm", "zero_microstrain"))
    response, modulus = problem.shapes[0].responses[0], float(log.modulus_MPa[rows[0]])
    deep = log.indentation_mm
    seen = (log.readings - zeros).std(axis=1) if deep is None else deep

    def elastic(force: np.ndarray) -> np.ndarray:
        moduli = values["outer_modulus_MPa"], values["inner_modulus_MPa"]
        felt = response.felt(force, np.full(len(force), modulus), *moduli)
        if deep is not None:
            return felt.indentation
        return np.einsum("nqg,qg->ng", felt.values, np.array([gain, lever])).std(axis=1)

    fitted = fit_relaxation(time[rows], log.force_N[rows], seen[rows], terms=terms, elastic=elastic)
    return TouchRelaxation(fitted, modulus, "S_d" if deep is None else "indentation", crept(fitted.prony, log))


def crept(prony: Prony, log: PressLog) -> tuple[float, float]:
    """Least and greatest ratio of equivalent force to force in the rows of the loading, in a whole log over time."""
    assert log.t_s is not None, "a log over time has times"
    loads, ratios = loading(log.force_N, log.modulus_MPa), []
    for rows in touches(log.modulus_MPa):
        ratio = prony.strained(log.t_s[rows], log.force_N[rows]) / log.force_N[rows]
        ratios.append(ratio[loads[rows]])
    found = np.concatenate(ratios)
    return float(found.min()), float(found.max())


_APART = np.array([1.0, 1.0 + 1e-9])
"""Smallest ratio of two times of a series, so that they stay two terms."""


def _growing(seen: np.ndarray) -> int:
    """Number of rows before the observed response falls."""
    fallen = seen < np.maximum.accumulate(seen) - SHRINKING * np.ptp(seen)
    return int(np.argmax(fallen)) if fallen.any() else len(seen)


def _rates(time: np.ndarray, force: np.ndarray) -> tuple[float, float]:
    rates = np.diff(np.log(force)) / np.diff(time)
    rising = rates[rates > 0]
    return (float(rising.min()), float(rising.max())) if len(rising) else (0.0, 0.0)


def _doubts(shares: np.ndarray, taus: np.ndarray, sigma: np.ndarray, time: np.ndarray) -> tuple[str, ...]:
    """Sentences on times outside of the range that the log resolves, and on shares that may be zero."""
    said = []
    shortest, longest = RESOLVED[0] * float(np.median(np.diff(time))), float(time[-1] - time[0]) / RESOLVED[1]
    for share, tau, one in zip(shares, taus, sigma, strict=True):
        if not shortest <= tau <= longest:
            said.append(f"a time of {tau:.3g} s is outside of what the log resolves, {shortest:.3g} to {longest:.3g} s")
        if one > share / 2:
            said.append(f"the share at {tau:.3g} s, {share:.2g}, may be zero (sigma {one:.2g})")
    return tuple(said)
