"""Notes about an identification: weakly determined parameters, values that priors decide, influential presses.

`diagnose` runs a few more fits where a parameter is poorly determined (profile likelihood) and where two gauges may be
swapped; all other notes follow from the Jacobian of the fit. `record` makes the part of the identification that a
design file keeps.

The profile gives the interval of a weakly determined parameter: the values x at which chi-square, with all other
parameters fitted again, is within 3.84 of its minimum: chi2_p(x) = min over the others of chi2(x, others)
<= chi2_p(best) + 1.96^2 (Venzon and Moolgavkar 1988, doi:10.2307/2347496). The covariance at the best fit is a parabola
through that curve and misleads where the curve is flat on one side. The curve is walked outwards in steps of 0.75
standard deviations, each fit starting at the end of the last one and at the start values of a whole fit (far out there
may be another minimum), until it rises above the level. Brent's method finds the crossing. Priors are part of
chi-square. The curve without the prior of the parameter itself shows whether the presses or the prior limit the
interval (`Profile.verdict`). Cost: one fit per step.
"""

import math
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.optimize import brentq

from papilla.core.units import PER_CENT
from papilla.identification.fit import MISFIT_CHI_SQUARE, Identification, descend, starts_of
from papilla.identification.parameters import CONTACT_MOVES, PARAMETERS_BY_NAME, kind, physical
from papilla.identification.problem import Problem
from papilla.model.parts import Identified

INTERVAL_HALF_WIDTH_SIGMAS = 1.959964
"""Half width of a 95 % interval, in standard deviations."""

CLOSE_TO_BOUND = 1e-3
"""Share of the range between its bounds within which a parameter counts as being at a bound."""

RATIO_WORDS = "the ratio of the moduli"

PROFILE_STEP_SIGMAS, MOST_PROFILE_STEPS, PROFILE_END_ACCURACY = 0.75, 12, 0.005
"""Step, in standard deviations; largest number of steps on each side; and accuracy of an end, in standard
deviations."""

PRIOR_DECIDES = 0.7
"""Ratio of the standard deviation after the fit to that of the prior, above which the prior rather than the presses
determines the value."""

CORRELATED_PARAMETERS = 0.95
"""Correlation of two nonlinear parameters above which only a combination of them is determined."""

POORLY_KNOWN_SIGMA = 0.15
"""Standard deviation (relative, for logarithmic parameters) above which the interval is that of the profile
likelihood."""

INFLUENTIAL_PRESS_SIGMAS = 1.0
"""Change of a parameter, in standard deviations, when one press is left out, above which the press is named."""

DEAD_GAUGE_SIGMAS = 4.0
"""Range of a gauge's readings, in standard deviations of their noise, below which it does not follow the presses."""

SWAPPED_CHI_SQUARE = 2 * math.log(1000)
"""Fall of chi-square, relative to chi-square per degree of freedom, above which two gauges count as swapped: the prior
assumption is one swapped pair in a hundred logs of ten pairs each."""

IN_EACH_GAUGE = ("common_gain", "common_lever_mm")
"""Quantities that are recorded as each gauge's gain and lever."""


@dataclass(frozen=True)
class ParameterProfile:
    """The 95 % interval of a parameter (in its unit), where chi-square with all others fitted rises by 3.84.

    verdict : without the parameter's own prior, "bounded", "one-sided" or "flat": chi-square rises that far before the
    bounds on both sides, on one, or on none; in the last two cases the prior limits the interval. cut_off_by :
    parameters that are at a bound where the interval ends, which is then too short.
    """

    name: str
    lower: float
    upper: float
    verdict: str
    cut_off_by: tuple[str, ...] = ()

    @property
    def notes(self) -> list[str]:
        """Notes about the interval, a sentence each."""
        interval, notes = f"{self.lower:.3g} to {self.upper:.3g}", []
        if self.verdict != "bounded":
            where = "on one side alone" if self.verdict == "one-sided" else "on neither side"
            notes.append(f"the presses bound {self.name} {where}: its prior decides, and makes it {interval}")
        if self.cut_off_by:
            names = " and ".join(self.cut_off_by)
            notes.append(f"the interval of {self.name}, {interval}, is cut off where {names} comes to its bound")
        return notes


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Notes about an `Identification` from n presses.

    influence : (n,) largest change of a parameter other than the gauges', in standard deviations, by leaving out each
    press (to first order). condition : condition number of the presses' information, columns scaled.
    """

    status: str
    notes: tuple[str, ...]
    intervals: dict[str, tuple[float, float]]
    profiles: tuple[ParameterProfile, ...]
    influence: np.ndarray
    condition: float


def diagnose(found: Identification) -> Diagnosis:
    """Diagnose an identification; runs a few more fits where a parameter is poorly determined."""
    profiles = tuple(
        profile(found, name)
        for name, sigma, linear in zip(found.names, found.sigma, found.problem.linear, strict=True)
        if not linear and sigma > POORLY_KNOWN_SIGMA and name != "stick_share"
    )
    half = INTERVAL_HALF_WIDTH_SIGMAS * found.sigma
    ends = zip(found.names, (found.vector - half).tolist(), (found.vector + half).tolist(), strict=True)
    intervals = {name: (physical(name, low), physical(name, high)) for name, low, high in ends}
    intervals |= {interval.name: (interval.lower, interval.upper) for interval in profiles}
    if "stick_share" in intervals:
        low, high = intervals["stick_share"]
        intervals["stick_share"] = max(low, 0.0), min(high, 1.0)
    moved = influence_by_parameter(found)
    largest = np.array([max(changes) for changes in zip(*moved.values(), strict=True)])
    notes = (
        *([found.asked] if found.asked else []),
        *found.problem.log.notes,
        *found.problem.log.sizes,
        *_of_the_presses(found),
        *_of_the_fit(found, profiles),
        *_of_gauges(found),
        *(sentence for interval in profiles for sentence in interval.notes),
    )
    if largest.size and largest.max() > INFLUENTIAL_PRESS_SIGMAS:
        press = int(largest.argmax())
        name = max(moved, key=lambda parameter: moved[parameter][press])
        notes += (f"press {press + 1} alone moves {name} by about {largest[press]:.2g} of its standard deviations",)
    good = "ok" if not notes else "doubtful"
    if turned := _backwards(found):
        good += f", but {len(turned)} of {len(found.problem.gauges)} gauges read backwards"
    notes += (*turned, *_rubbing(found, intervals))
    quality = f"chi-square {found.chi_square:.3g} at {found.freedom:.3g} degrees of freedom"
    status = f"{good}: identified from {len(found.problem.log)} presses, {quality}"
    return Diagnosis(status, notes, intervals, profiles, largest, _condition(found))


def record(found: Identification, diagnosis: Diagnosis, specimen: str) -> Identified:
    """The `[identified]` table of an identification: parameters of the finger, and the tilt at which it was pressed.

    The moduli of the specimens are not recorded, but their uncertainty is part of the covariance of the others.
    Parameters that all gauges share are recorded for each gauge.
    """
    problem = found.problem
    names, values, by_free = _recorded(found)
    covariance = by_free @ ((found.covariance + found.covariance.T) / 2) @ by_free.T
    half = INTERVAL_HALF_WIDTH_SIGMAS * np.sqrt(np.diag(covariance))
    intervals = dict(zip(names, zip(values - half, values + half, strict=True), strict=True)) | diagnosis.intervals
    return Identified(
        status=diagnosis.status,
        presses=len(problem.log),
        specimen=specimen,
        friction=problem.shapes[0].friction,
        zeros_microstrain=tuple(problem.each("zero_microstrain", found.values).tolist()),
        touch_down_mm=found.values["touch_down_mm"],
        parameters=names,
        logarithmic=tuple(PARAMETERS_BY_NAME[kind(name)].logarithmic for name in names),
        values=tuple(values.tolist()),
        lower=tuple(float(intervals[name][0]) for name in names),
        upper=tuple(float(intervals[name][1]) for name in names),
        covariance=tuple(map(tuple, ((covariance + covariance.T) / 2).tolist())),
        chi_square=found.chi_square,
        freedom=found.freedom,
        force_error=problem.noise.force,
        noise_microstrain=problem.noise.readings_microstrain,
        notes=diagnosis.notes,
    )


def _recorded(fit: Identification) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    """What the design file records of an identification: names and values (p,), and derivatives (p, f) by the free
    parameters."""
    every = dict(zip(fit.names, np.eye(len(fit.names)), strict=True))
    rows = {
        name: derivatives
        for name, derivatives in every.items()
        if kind(name) not in ("specimen_modulus", *IN_EACH_GAUGE)
    }
    values = {name: fit.values[name] for name in rows}
    none = np.zeros(len(fit.names))
    if any(name in every for name in IN_EACH_GAUGE):
        for gauge in fit.finger.gauges:
            for name, value, by_lever in (
                (f"gain.{gauge.name}", gauge.membrane_gain, 0.0),
                (f"lever_mm.{gauge.name}", gauge.lever_mm, gauge.membrane_gain),
            ):
                values[name] = value
                rows[name] = value * every.get("common_gain", none) + by_lever * every.get("common_lever_mm", none)
    return tuple(rows), np.array([values[name] for name in rows]), np.array(list(rows.values()))


def influence_by_parameter(fit: Identification) -> dict[str, np.ndarray]:
    """(n,) change of each parameter other than the gauges', in standard deviations, when each press is left out.

    One Gauss-Newton step from the fit with the weights of all presses (Cook and Weisberg, Residuals and Influence in
    Regression, 1982, chapter 5). A new fit without the press also finds new weights and follows the curvature of the
    model: for one log 0.45 instead of 0.93 standard deviations.
    """
    problem = fit.problem
    which = np.array([not PARAMETERS_BY_NAME[kind(name)].each_gauge for name in fit.names])
    n, channels = problem.measured.shape
    if not which.any() or n < 2:
        return {}
    residuals, jacobian = problem.linearised(fit.vector)
    size = np.linalg.norm(jacobian, axis=0)
    scaled = jacobian / size
    information = scaled.T @ scaled
    spread = np.sqrt(np.diag(np.linalg.inv(information)))[which]
    moved = np.zeros((n, int(which.sum())))
    for press in range(n):
        own_rows = slice(press * channels, (press + 1) * channels)
        # Information without this press, and the step that its missing residuals cause.
        without = information - scaled[own_rows].T @ scaled[own_rows]
        shift = np.linalg.lstsq(without, scaled[own_rows].T @ residuals[own_rows])[0]
        moved[press] = np.abs(shift[which] / spread)
    names = [name for name, counts in zip(fit.names, which, strict=True) if counts]
    return dict(zip(names, moved.T, strict=True))


def _condition(fit: Identification) -> float:
    # Without the priors' rows: what do the presses alone determine?
    rows = fit.problem.jacobian(fit.vector)[: -(len(fit.names) + 1)]
    values = np.linalg.svd(rows / np.maximum(np.linalg.norm(rows, axis=0), np.finfo(float).tiny), compute_uv=False)
    return float(values[0] / max(values[-1], np.finfo(float).tiny))


def _of_the_presses(fit: Identification) -> list[str]:
    """Notes that follow from the choice of presses."""
    problem, log = fit.problem, fit.problem.log
    notes = []
    inner, outer = fit.values["inner_modulus_MPa"], fit.values["outer_modulus_MPa"]
    if len(log) < 2 or (np.ptp(log.force_N) == 0 and np.ptp(log.modulus_MPa) == 0):
        notes.append("all presses are one and the same scene: priors decide most results")
    elif np.ptp(log.modulus_MPa) == 0:
        notes.append(
            "all presses are on one modulus: a specimen of another one, far from it, would separate moduli from gains"
        )
    if log.stated_sd is not None:
        notes.append("S_d alone: ratios of the gauges' gains are assumed to be the design's, and their zeros to be 0")
    if hard := int(problem.strained(inner).sum()):
        notes.append(f"{hard} of {len(log)} presses strain this finger more than was measured at finite strain")
    outside = np.zeros(len(log), bool)
    for shape in problem.shapes:
        loads = log.force_N[shape.rows], problem.moduli(fit.values)[shape.rows]
        outside[shape.rows] = ~shape.responses[0].inside(*loads, outer, inner)
    if outside.any():
        notes.append(f"{int(outside.sum())} of {len(log)} presses lie outside of what the model covers for this finger")
    if not problem.shapes[0].responses[0].large_strain:
        notes.append(
            "large strain is not known for this geometry, friction or specimen, and not included: 2 to 4 % of S_d"
        )
    return notes


def _of_the_fit(fit: Identification, profiles: tuple[ParameterProfile, ...]) -> list[str]:
    """Notes about the fit: bounds, priors that decide, specimens, correlations, misfit, swapped gauges, rivals."""
    problem, ended = fit.problem, at_bounds(fit.problem, fit.vector)
    notes = [f"{name} ended at its bound, beyond what is known of silicones" for name in ended if name != RATIO_WORDS]
    if beyond := problem.beyond(fit.vector):
        notes.append(
            f"the ratio of the moduli is {PER_CENT * abs(beyond):.1g} % outside of 1 to 16, where fingers are known"
        )
    for name, sigma, linear in zip(fit.names, fit.sigma, problem.linear, strict=True):
        explained = name in problem.specimens or any(
            interval.name == name and interval.verdict != "bounded" for interval in profiles
        )
        if not (linear or explained or name == "stick_share") and sigma > PRIOR_DECIDES * problem.priors[name][1]:
            notes.append(f"the presses do not determine {name}: its prior decides")
    for name, specimen in problem.specimens.items():
        off = np.log(fit.values[name] / problem.held[name]) / specimen.sigma
        if abs(off) > INTERVAL_HALF_WIDTH_SIGMAS:
            notes.append(
                f"the specimen of {problem.held[name]:g} MPa came out at {fit.values[name]:.3g}, {abs(off):.2g} of "
                "the standard deviations that modulus_sigma_MPa states"
            )
    outside = np.flatnonzero(~problem.linear)
    for a, b in combinations(outside.tolist(), 2):
        together = fit.covariance[a, b] / (fit.sigma[a] * fit.sigma[b])
        if abs(together) > CORRELATED_PARAMETERS:
            names = fit.names[a], fit.names[b]
            wide = (
                ": take their intervals 1.5 times as wide" if {kind(name) for name in names} <= {*CONTACT_MOVES} else ""
            )
            notes.append(f"{names[0]} and {names[1]} are determined together only (correlation {together:.3f}){wide}")
    if fit.freedom > 0 and fit.chi_square / fit.freedom > MISFIT_CHI_SQUARE:
        excess = fit.chi_square / fit.freedom
        notes.append(f"the model does not fit: chi-square is {excess:.3g} times its freedom; all sigmas are widened")
    notes += _swapped(fit)
    if fit.rival is not None and fit.rival < INTERVAL_HALF_WIDTH_SIGMAS**2:
        notes.append(f"another finger fits as well, chi-square only {fit.rival:.2g} more: press other specimens too")
    return notes


def _swapped(fit: Identification) -> list[str]:
    """The pair of gauges, if any, whose readings fit far better swapped."""
    problem, names, costs = fit.problem, fit.problem.gauges, {}
    if fit.chi_square < SWAPPED_CHI_SQUARE:
        return []
    for a, b in combinations(range(len(problem.reading_names)), 2):
        order = np.arange(len(names))
        order[[a, b]] = b, a
        # Fit the log with two columns exchanged, from the moduli that were found.
        turned = replace(problem, log=replace(problem.log, readings=problem.log.readings[:, order])).weighted()
        _, vector = descend(turned, fit.vector[~problem.linear])
        costs[names[a], names[b]], _ = descend(turned.weighted(vector), vector[~problem.linear])
    if not costs:
        return []
    (first, second), least = min(costs.items(), key=lambda pair: pair[1])
    if fit.chi_square - least < SWAPPED_CHI_SQUARE * max(1.0, least / max(fit.freedom, 1.0)):
        return []
    return [f"{first} and {second} look swapped: chi-square would be {least:.3g} instead of {fit.chi_square:.3g}"]


def _of_gauges(fit: Identification) -> list[str]:
    """Notes about single gauges: those that hardly respond, or whose gain and lever are not determined separately."""
    notes: list[str] = []
    problem = fit.problem
    if problem.log.stated_sd is not None:
        return notes
    gains = [np.inf] * len(problem.gauges) if problem.gains is None else problem.gains.tolist()
    for name, moved, gain in zip(problem.gauges, np.ptp(problem.log.readings, axis=0), gains, strict=True):
        lever = f"lever_mm.{name}"
        if moved < DEAD_GAUGE_SIGMAS * problem.noise.readings_microstrain:
            notes.append(f"{name} hardly follows the presses ({moved:.3g} µε in all): dead, loose, or far away")
        elif lever in fit.names and fit[lever][1] > PRIOR_DECIDES * PARAMETERS_BY_NAME["lever_mm"].sigma * gain:
            notes.append(f"the presses do not separate lever and gain of {name}: the prior decides")
    return notes


def _backwards(fit: Identification) -> list[str]:
    """Gauges with negative gain. It does not make a fit doubtful, because their leads may be swapped."""
    gains = [(name.split(".")[1], *fit[name]) for name in fit.names if kind(name) == "gain"]
    return [
        f"{gauge} reads backwards (gain {gain:.3g})"
        for gauge, gain, sigma in gains
        if gain + INTERVAL_HALF_WIDTH_SIGMAS * sigma < 0
    ]


def _rubbing(fit: Identification, intervals: dict[str, tuple[float, float]]) -> list[str]:
    """The share of stick if the friction was not stated. It does not make a fit doubtful, because all intervals contain
    it."""
    if "stick_share" not in fit.names:
        return []
    low, high = intervals["stick_share"]
    return [
        f"friction was not stated: the presses have {PER_CENT * fit['stick_share'][0]:.0f} % of the effect of stick "
        f"({PER_CENT * low:.0f} to {PER_CENT * high:.0f}), which intervals contain; --friction states it"
    ]


def profile(found: Identification, name: str) -> ParameterProfile:
    """The profile of a nonlinear parameter; each step costs a fit."""
    place = found.names.index(name)
    best, sigma = float(found.vector[place]), float(found.sigma[place])
    # If the model does not fit, the level grows with chi-square per degree of freedom, as the sigmas do.
    excess = found.chi_square / found.freedom if found.freedom > 0 else 1.0
    level = INTERVAL_HALF_WIDTH_SIGMAS**2 * (excess if excess > MISFIT_CHI_SQUARE else 1.0)
    curve = _Curve(found, name)
    least = curve(best)
    ends = []
    for side, sign in zip(found.problem.bounds, (-1.0, 1.0), strict=True):
        limit = float(side[place])
        curve.others = np.delete(found.vector, place)
        end = best
        for k in range(1, MOST_PROFILE_STEPS + 1):
            value = sign * min(sign * (best + sign * PROFILE_STEP_SIGMAS * k * sigma), sign * limit)
            if curve(value, anywhere=True) - least > level:
                end = brentq(lambda x: curve(x) - least - level, end, value, xtol=PROFILE_END_ACCURACY * sigma)
                break
            end = value
            if value == limit:
                break
        ends.append(end)
        # Where the interval ends and where the bounds are: both are needed for the verdict and for what cuts the
        # interval off.
        curve(end)
        curve(limit)
    # Would the presses alone, without the parameter's prior, have bounded it?
    without = curve.without_prior
    low = min(without.values())
    rises = [max(cost for value, cost in without.items() if sign * (value - best) >= 0) - low for sign in (-1, 1)]
    verdict = ("flat", "one-sided", "bounded")[sum(rise > level for rise in rises)]
    cut = sorted({name for end in ends for name in curve.at_bounds[end]})
    return ParameterProfile(name, physical(name, ends[0]), physical(name, ends[1]), verdict, tuple(cut))


class _Curve:
    """Least chi-square with one parameter held at a value in the scale of the fit; results are kept."""

    def __init__(self, fit: Identification, name: str):
        self._problem, self._name = fit.problem, name
        self._place = fit.names.index(name)
        self.others = np.delete(fit.vector, self._place)
        self.without_prior: dict[float, float] = {}
        self.at_bounds: dict[float, list[str]] = {}

    def __call__(self, value: float, *, anywhere: bool = False) -> float:
        """Chi-square including all priors. The fit starts where the last one ended and, with `anywhere`, also at the
        start values of a whole fit, because far out there may be another minimum."""
        if value not in self.without_prior:
            free = tuple(name for name in self._problem.free if name != self._name)
            values = {**self._problem.held, self._name: physical(self._name, value)}
            rest = replace(self._problem, free=free, held=values)
            starts = (self.others[~rest.linear], *(starts_of(rest) if anywhere else ()))
            fits = (descend(rest, start) for start in starts)
            self.without_prior[value], self.others = min(fits, key=lambda fit: fit[0])
            self.at_bounds[value] = at_bounds(rest, self.others)
        middle, sigma = self._problem.priors[self._name]
        return self.without_prior[value] + ((value - middle) / sigma) ** 2


def at_bounds(problem: Problem, vector: np.ndarray) -> list[str]:
    """Names of what is at a bound in a vector (f,): nonlinear parameters and the ratio of moduli. A share of stick may
    be 0 or 1."""
    low, high = problem.bounds
    near = np.minimum(vector - low, high - vector) < CLOSE_TO_BOUND * (high - low)
    named = [
        name
        for name, close, linear in zip(problem.free, near, problem.linear, strict=True)
        if close and not linear and name != "stick_share"
    ]
    return [*named, *([RATIO_WORDS] if problem.beyond(vector) else [])]
