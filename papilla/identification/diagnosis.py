"""Notes about an identification: weakly determined parameters, values that priors decide, influential presses.

`diagnose` runs a few more fits where a parameter is poorly determined (profile likelihood) and where two gauges may be
swapped; all other notes follow from the Jacobian of the fit. `record` makes the part of the identification that a
design file keeps.
"""

import math
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from papilla.core.units import PER_CENT
from papilla.identification.fit import MISFIT_CHI_SQUARE, Identification, descend
from papilla.identification.parameters import CONTACT_MOVES, PARAMETERS_BY_NAME, kind, physical
from papilla.identification.profile import INTERVAL_HALF_WIDTH_SIGMAS, RATIO_WORDS, ParameterProfile, at_bounds, profile
from papilla.identification.suggest import narrowing_press, sd_slopes
from papilla.model.parts import Identified

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

DOUBTFUL_SD_SIGMA = 0.03
"""Standard deviation of S_d of other presses, relative, rms over the domain, above which an identification is doubtful:
a finger of average gauges from five presses well chosen has less."""

IN_EACH_GAUGE = ("common_gain", "common_lever_mm")
"""Quantities that are recorded as each gauge's gain and lever."""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Notes about an `Identification` from n presses.

    status : begins with "doubtful" where something contradicts the fit, or where its own covariance says that S_d of
    other presses is known badly. A parameter that the presses do not determine is a note: intervals contain it.
    sd_sigma : standard deviation of ln S_d of other presses by the covariance, rms over the domain.
    influence : (n,) largest change of a parameter other than the gauges', in standard deviations, by leaving out each
    press (to first order). condition : condition number of the presses' information, columns scaled.
    """

    status: str
    notes: tuple[str, ...]
    intervals: dict[str, tuple[float, float]]
    profiles: tuple[ParameterProfile, ...]
    influence: np.ndarray
    condition: float
    sd_sigma: float


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
    of_sd = sd_slopes(found.problem, found.vector)[0]
    sd_sigma = float(np.sqrt(np.einsum("mf,fg,mg->m", of_sd, found.covariance, of_sd).mean()))
    doubts = [
        *([found.asked] if found.asked else []),
        *found.problem.log.notes,
        *found.problem.log.sizes,
        *_doubts_of_presses(found),
        *_doubts_of_fit(found),
        *_dead_gauges(found),
    ]
    if sd_sigma > DOUBTFUL_SD_SIGMA:
        doubts.append(f"S_d of other presses is known to {PER_CENT * sd_sigma:.2g} % only (one standard deviation)")
    notes = (
        *doubts,
        *_of_the_presses(found),
        *_undetermined(found, profiles),
        *(sentence for interval in profiles for sentence in interval.notes),
        *_narrowed(found, profiles),
    )
    if largest.size and largest.max() > INFLUENTIAL_PRESS_SIGMAS:
        press = int(largest.argmax())
        name = max(moved, key=lambda parameter: moved[parameter][press])
        notes += (f"press {press + 1} alone moves {name} by about {largest[press]:.2g} of its standard deviations",)
    good = "doubtful" if doubts else "ok"
    if turned := _backwards(found):
        good += f", but {len(turned)} of {len(found.problem.gauges)} gauges read backwards"
    notes += (*turned, *_rubbing(found, intervals))
    quality = f"chi-square {found.chi_square:.3g} at {found.freedom:.3g} degrees of freedom"
    status = f"{good}: identified from {len(found.problem.log)} presses, {quality}"
    return Diagnosis(status, notes, intervals, profiles, largest, _condition(found), sd_sigma)


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
    """What the presses do not tell, and the intervals contain."""
    problem, log = fit.problem, fit.problem.log
    notes = []
    if np.ptp(log.modulus_MPa) == 0 and np.ptp(log.force_N) > 0:
        notes.append(
            "all presses are on one modulus: a specimen of another one, far from it, would separate moduli from gains"
        )
    if log.stated_sd is not None:
        notes.append("S_d alone: ratios of the gauges' gains are assumed to be the design's, and their zeros to be 0")
    if hard := int(problem.strained(fit.values["inner_modulus_MPa"]).sum()):
        notes.append(f"{hard} of {len(log)} presses strain this finger more than was measured at finite strain")
    return notes


def _doubts_of_presses(fit: Identification) -> list[str]:
    """Presses that tell nothing of others, or of which the model does not know enough."""
    problem, log = fit.problem, fit.problem.log
    notes = []
    inner, outer = fit.values["inner_modulus_MPa"], fit.values["outer_modulus_MPa"]
    if len(log) < 2 or (np.ptp(log.force_N) == 0 and np.ptp(log.modulus_MPa) == 0):
        notes.append("all presses are one and the same scene: priors decide most results")
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


def _doubts_of_fit(fit: Identification) -> list[str]:
    """What contradicts the fit: bounds, specimens, misfit, swapped gauges, rivals."""
    problem, ended = fit.problem, at_bounds(fit.problem, fit.vector)
    notes = [f"{name} ended at its bound, beyond what is known of silicones" for name in ended if name != RATIO_WORDS]
    if beyond := problem.beyond(fit.vector):
        notes.append(
            f"the ratio of the moduli is {PER_CENT * abs(beyond):.1g} % outside of 1 to 16, where fingers are known"
        )
    for name, specimen in problem.specimens.items():
        off = np.log(fit.values[name] / problem.held[name]) / specimen.sigma
        if abs(off) > INTERVAL_HALF_WIDTH_SIGMAS:
            notes.append(
                f"the specimen of {problem.held[name]:g} MPa came out at {fit.values[name]:.3g}, {abs(off):.2g} of "
                "the standard deviations that modulus_sigma_MPa states"
            )
    if fit.freedom > 0 and fit.chi_square / fit.freedom > MISFIT_CHI_SQUARE:
        excess = fit.chi_square / fit.freedom
        notes.append(f"the model does not fit: chi-square is {excess:.3g} times its freedom; all sigmas are widened")
    notes += _swapped(fit)
    if fit.rival is not None and fit.rival < INTERVAL_HALF_WIDTH_SIGMAS**2:
        notes.append(f"another finger fits as well, chi-square only {fit.rival:.2g} more: press other specimens too")
    return notes


def _undetermined(fit: Identification, profiles: tuple[ParameterProfile, ...]) -> list[str]:
    """Parameters that the presses do not determine, or only together with another one."""
    problem, notes = fit.problem, []
    for name, sigma, linear in zip(fit.names, fit.sigma, problem.linear, strict=True):
        explained = name in problem.specimens or any(
            interval.name == name and interval.verdict != "bounded" for interval in profiles
        )
        if not (linear or explained or name == "stick_share") and sigma > PRIOR_DECIDES * problem.priors[name][1]:
            notes.append(f"the presses do not determine {name}: its prior decides")
    outside = np.flatnonzero(~problem.linear)
    for a, b in combinations(outside.tolist(), 2):
        together = fit.covariance[a, b] / (fit.sigma[a] * fit.sigma[b])
        if abs(together) > CORRELATED_PARAMETERS:
            names = fit.names[a], fit.names[b]
            wide = (
                ": take their intervals 1.5 times as wide" if {kind(name) for name in names} <= {*CONTACT_MOVES} else ""
            )
            notes.append(f"{names[0]} and {names[1]} are determined together only (correlation {together:.3f}){wide}")
    gains = np.full(len(problem.gauges), np.inf) if problem.gains is None else problem.gains
    for gauge, gain in zip(problem.gauges, gains.tolist(), strict=True):
        lever = f"lever_mm.{gauge}"
        if lever in fit.names and fit[lever][1] > PRIOR_DECIDES * PARAMETERS_BY_NAME["lever_mm"].sigma * gain:
            notes.append(f"the presses do not separate lever and gain of {gauge}: the prior decides")
    return notes


def _narrowed(fit: Identification, profiles: tuple[ParameterProfile, ...]) -> list[str]:
    """For each poorly known parameter, the press that would narrow its interval most."""
    notes = []
    for name in (profiled.name for profiled in profiles):
        force, modulus, after = narrowing_press(fit, name)
        notes.append(
            f"{name} is known to {PER_CENT * fit[name][1]:.0f} %: a press by {force:.2g} N on {modulus:.3g} MPa would "
            f"narrow it most, to {PER_CENT * after:.0f} %"
        )
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


def _dead_gauges(fit: Identification) -> list[str]:
    """Gauges that hardly respond."""
    problem = fit.problem
    if problem.log.stated_sd is not None:
        return []
    return [
        f"{name} hardly follows the presses ({moved:.3g} µε in all): dead, loose, or far away"
        for name, moved in zip(problem.gauges, np.ptp(problem.log.readings, axis=0), strict=True)
        if moved < DEAD_GAUGE_SIGMAS * problem.noise.readings_microstrain
    ]


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
