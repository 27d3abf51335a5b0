"""What one touch determines: the modulus of a specimen, from force and indentation (the slow method that the estimate
from gauges replaces), and the Prony series of a relaxing finger, from a touch that is held.

While the contact grows, a relaxing finger responds like an elastic one to its equivalent force, F_e = integral of E(0)
J(t - s) dF(s) (`papilla.references.viscoelastic`): exactly on a rigid specimen, nearly on one that is much harder than
the finger. The elastic response is y = a f(k F_e) + c, where f is that of a finger's model and k corrects its
stiffness; without a model f is a power of the force. A touch whose force or depth is held determines all unknowns.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import RectBivariateSpline
from scipy.special import stdtrit

from papilla.calibration import INTERVAL_PROBABILITY
from papilla.calibration.fitting.sweep import Sweep
from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.least_squares import least_squares
from papilla.logs import PressLog
from papilla.logs.presses import loading, touches
from papilla.references import Prony, bonded_layer_sphere

if TYPE_CHECKING:
    from papilla.identification import Identification

Depth = Callable[[float, np.ndarray], np.ndarray]
"""Indentation (n,) in mm that a specimen of a modulus (MPa) takes at forces (n,) in N."""
BALL_DEPTH_EXPONENT = 2 / 3
"""Exponent of the force in the depth of a ball."""
FEWEST_SERIES_POINTS = 4
"""Smallest number of points of a series: two unknowns, and some degrees of freedom for their errors."""
DERIVATIVE_STEP = 1e-4

FORCE_EXPONENT_LIMITS, MODEL_FACTOR_LIMITS = (0.3, BALL_DEPTH_EXPONENT, 1.2), (0.3, 1.0, 3.0)
"""Lower bound, start and upper bound of the exponent of the force in an elastic response (2/3 for the depth of a ball,
up to 1 for readings), and of the factor k of a model."""

SHRINKING_CONTACT_SHARE = 0.02
"""Share of its range by which a response may fall below its earlier maximum before the contact counts as shrinking."""

RESOLVED_TIME_RATIO = 2.0
"""A relaxation time can be determined if it is at least this many steps of the log, and at most its duration over
this."""

SPARE_ROWS = 3
"""Smallest number of rows beyond the unknowns of a series."""

LEAST_SHARE, SHARE_SUMS, RELAXATION_TIME_LIMITS = 1e-4, (0.3, 0.95), (1e-3, 10.0)
"""Lower bound of a share; start value and upper bound of the sum of shares; bounds of a time relative to the log's
duration."""

START_RELAXATION_TIMES = (0.02, 0.1, 0.5)
"""Start values of the relaxation time of a one-term fit, relative to the log's duration; two terms start from all
pairs."""

_APART = np.array([1.0, 1.0 + 1e-9])
"""Smallest ratio of two times of a series, so that they stay two terms."""


@dataclass(frozen=True)
class IndentationModulus:
    """modulus_MPa, its standard deviation and 95 % interval; offset_mm : indentation at which contact begins.

    rms_N : root mean square residual of the force; freedom : number of points minus two.
    """

    modulus_MPa: float
    sigma_MPa: float
    interval: tuple[float, float]
    offset_mm: float
    offset_sigma_mm: float
    rms_N: float
    freedom: int


def on_half_space(radius_mm: float, nu: float = 0.5) -> Depth:
    """A rigid ball on a thick and wide specimen: Hertz, d = (3 F / (4 E* sqrt(R)))^(2/3)."""
    radius = checks.positive("radius_mm", radius_mm)
    factor = 0.75 * (1 - checks.poisson("nu", nu) ** 2) / math.sqrt(radius)
    return lambda modulus, force: (factor * force / modulus) ** BALL_DEPTH_EXPONENT


def on_bonded_layer(radius_mm: float, thickness_mm: float, deepest_mm: float, nu: float = 0.5) -> Depth:
    """A rigid ball on a layer bonded to a rigid table (exact solution), up to an indentation of `deepest_mm`."""
    depth = np.geomspace(1e-3 * checks.positive("deepest_mm", deepest_mm), deepest_mm, 60)
    force = [bonded_layer_sphere(float(indentation), radius_mm, thickness_mm, 1.0, nu).force for indentation in depth]
    return lambda modulus, load: np.exp(np.interp(np.log(load / modulus), np.log(force), np.log(depth)))


def on_finger(sweep: Sweep) -> Depth:
    """A finger with its specimen; the indentations come from a sweep over force and modulus, NaN outside of it."""
    forces, moduli = np.unique(sweep.force_N), np.unique(sweep.modulus_MPa)
    order = np.lexsort((sweep.modulus_MPa, sweep.force_N))
    depth = sweep.indentation_mm[order].reshape(len(forces), len(moduli))
    complete = np.isfinite(depth).all(axis=0)
    spline = RectBivariateSpline(np.log(forces), np.log(moduli[complete]), np.log(depth[:, complete]))
    low, high = moduli[complete][0], moduli[complete][-1]

    def depth_at(modulus: float, force: np.ndarray) -> np.ndarray:
        inside = (force >= forces[0]) & (force <= forces[-1]) & (low <= modulus <= high)
        return np.where(inside, np.exp(spline.ev(np.log(force), np.full(len(force), np.log(modulus)))), np.nan)

    return depth_at


def fit_indentation(
    force_N: ArrayLike, indentation_mm: ArrayLike, depth: Depth, start_MPa: float = 0.3
) -> IndentationModulus:
    """Fit modulus and point of contact to a series; residuals are those of the force.

    Parameters
    ----------
    force_N, indentation_mm : (n,), n >= 4, of a loading. Points without a positive force are before contact and are
        left out. The indentation has an offset, which is fitted.
    depth : one of `on_half_space`, `on_bonded_layer`, `on_finger`, or your own.
    start_MPa : where the search begins.

    The interval uses Student's t and the linearised fit. Raises `InputError` for a series that is too short or that the
    model does not explain.
    """
    force, indentation = np.asarray(force_N, float), np.asarray(indentation_mm, float)
    usable = force.ndim == 1 and force.shape == indentation.shape and np.isfinite([force, indentation]).all()
    if not usable:
        raise InputError(
            f"force and indentation must be two equal finite columns, got {force.shape} and {indentation.shape}"
        )
    touching = force > 0
    force, indentation = force[touching], indentation[touching]
    if len(force) < FEWEST_SERIES_POINTS:
        raise InputError(f"a series needs {FEWEST_SERIES_POINTS} points in contact at least, got {len(force)}")
    start = math.log(checks.positive("start_MPa", start_MPa))

    def lacking(values: np.ndarray) -> np.ndarray:
        return indentation - values[1] - depth(math.exp(values[0]), force)

    def stiffness(values: np.ndarray) -> np.ndarray:
        less, middle, more = (
            depth(math.exp(values[0]), force * (1 + step)) for step in (-DERIVATIVE_STEP, 0.0, DERIVATIVE_STEP)
        )
        forward, backward = (more - middle) / (force * DERIVATIVE_STEP), (middle - less) / (force * DERIVATIVE_STEP)
        return 1 / np.where(np.isfinite(forward), forward, backward)

    try:
        first = least_squares(lacking, (start, float(np.min(indentation - depth(math.exp(start), force)))))
        weights = stiffness(first.vector)
        best = least_squares(lambda values: weights * lacking(values), first.vector)
    except ValueError as error:
        raise InputError("the series leaves the range of the indentation model") from error
    freedom = len(force) - 2
    relative, offset_sigma = np.sqrt(np.diag(best.covariance)).tolist()
    modulus, rms = math.exp(best.vector[0]), math.sqrt(best.cost / freedom)
    reach = float(stdtrit(freedom, 0.5 + INTERVAL_PROBABILITY / 2)) * relative
    interval = modulus * math.exp(-reach), modulus * math.exp(reach)
    return IndentationModulus(modulus, relative * modulus, interval, float(best.vector[1]), offset_sigma, rms, freedom)


@dataclass(frozen=True)
class Relaxation:
    """A Prony series of p terms, fitted to n rows of a log.

    share_sigma, time_sigma : (p,) standard deviations; those of the times are relative. power : exponent of the force,
    or the factor k of a model. rms : of the residuals, relative to the observed range. rate_per_s : range of d ln F /
    dt in the rows of the loading. notes : a sentence each.
    """

    prony: Prony
    share_sigma: tuple[float, ...]
    time_sigma: tuple[float, ...]
    power: float
    rms: float
    rate_per_s: tuple[float, float]
    notes: tuple[str, ...]


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
    if not all(np.isfinite(column).all() for column in (time, force, seen)) or (force <= 0).any():
        raise InputError("time_s, force_N and observed must be finite, and forces greater than 0")
    time, force, seen = (column[: _growing(seen)] for column in (time, force, seen))
    # Shares, times and the exponent (or k), and the linear factor and zero
    unknowns = (2 * terms + 1) + 2
    if len(time) < (least := unknowns + SPARE_ROWS):
        raise InputError(f"{len(time)} rows while the contact grows are too few for {terms} terms: at least {least}")
    span = float(time[-1] - time[0])
    softest, start, stiffest = FORCE_EXPONENT_LIMITS if elastic is None else MODEL_FACTOR_LIMITS
    briefest, longest = np.log(np.multiply(RELAXATION_TIME_LIMITS, span))
    begin_share, most = np.divide(SHARE_SUMS, terms)
    low = np.array([LEAST_SHARE] * terms + [briefest] * terms + [softest])
    high = np.array([most] * terms + [longest] * terms + [stiffest])
    wide = float(np.ptp(seen)) or 1.0

    def residuals(vector: np.ndarray) -> np.ndarray:
        prony = Prony(tuple(vector[:terms]), tuple(np.exp(vector[terms : 2 * terms]) * _APART[:terms]))
        felt = prony.strained(time, force)
        answer = felt ** vector[-1] if elastic is None else elastic(vector[-1] * felt)
        # Factor a and zero c are linear: they are solved for each trial (variable projection).
        columns = np.column_stack([answer, np.ones_like(time)])
        return (seen - columns @ np.linalg.lstsq(columns, seen)[0]) / wide

    fits = []
    for times in combinations(START_RELAXATION_TIMES, terms):
        begin = np.concatenate([[begin_share] * terms, np.log(span * np.array(times)), [start]])
        fits.append(least_squares(residuals, begin, bounds=(low, high), x_scale=np.maximum(np.abs(begin), 0.1)))
    best = min(fits, key=lambda fit: fit.cost)
    # The residuals are dimensionless; their scatter is the noise. Two terms of one relaxation are determined together
    # only: the pseudo-inverse leaves their difference out.
    inverse = np.linalg.pinv(best.jacobian.T @ best.jacobian)
    sigma = np.sqrt(np.diag(inverse * best.cost / (len(time) - unknowns)))
    taus = np.exp(best.vector[terms : 2 * terms]) * _APART[:terms]
    order = np.argsort(taus)
    sigmas = sigma[: 2 * terms].reshape(2, terms)
    shares, taus, share_sigma, time_sigma = (part[order] for part in (best.vector[:terms], taus, *sigmas))
    return Relaxation(
        Prony(tuple(shares.tolist()), tuple(taus.tolist())),
        tuple(share_sigma.tolist()),
        tuple(time_sigma.tolist()),
        float(best.vector[-1]),
        float(np.sqrt(best.cost / len(time))),
        _rates(time, force),
        _notes(shares, taus, share_sigma, time),
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
        """The fields for `papilla.model.parts.Identified`."""
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
            "doubts": list(fitted.notes),
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
    all_ratios = np.concatenate(ratios)
    return float(all_ratios.min()), float(all_ratios.max())


def _growing(seen: np.ndarray) -> int:
    """Number of rows before the observed response falls."""
    fallen = seen < np.maximum.accumulate(seen) - SHRINKING_CONTACT_SHARE * np.ptp(seen)
    return int(np.argmax(fallen)) if fallen.any() else len(seen)


def _rates(time: np.ndarray, force: np.ndarray) -> tuple[float, float]:
    rates = np.diff(np.log(force)) / np.diff(time)
    rising = rates[rates > 0]
    return (float(rising.min()), float(rising.max())) if len(rising) else (0.0, 0.0)


def _notes(shares: np.ndarray, taus: np.ndarray, sigma: np.ndarray, time: np.ndarray) -> tuple[str, ...]:
    """Sentences on times outside of the range that the log resolves, and on shares that may be zero."""
    notes = []
    shortest = RESOLVED_TIME_RATIO * float(np.median(np.diff(time)))
    longest = float(time[-1] - time[0]) / RESOLVED_TIME_RATIO
    for share, tau, share_sigma in zip(shares, taus, sigma, strict=True):
        if not shortest <= tau <= longest:
            notes.append(
                f"a time of {tau:.3g} s is outside of what the log resolves, {shortest:.3g} to {longest:.3g} s"
            )
        if share_sigma > share / 2:
            notes.append(f"the share at {tau:.3g} s, {share:.2g}, may be zero (sigma {share_sigma:.2g})")
    return tuple(notes)
