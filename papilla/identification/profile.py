"""The 95 % interval of a weakly determined parameter, by the profile of chi-square.

The interval are the values x at which chi-square, with all other
parameters fitted again, is within 3.84 of its minimum: chi2_p(x) = min over the others of chi2(x, others)
<= chi2_p(best) + 1.96^2 (Venzon and Moolgavkar 1988, doi:10.2307/2347496). The covariance at the best fit is a parabola
through that curve and misleads where the curve is flat on one side. The curve is walked outwards in steps of 0.75
standard deviations, each fit starting at the end of the last one and at the start values of a whole fit (far out there
may be another minimum), until it rises above the level. Brent's method finds the crossing. Priors are part of
chi-square. The curve without the prior of the parameter itself shows whether the presses or the prior limit the
interval (`ParameterProfile.verdict`). Cost: one fit per step.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from papilla.identification.fit import MISFIT_CHI_SQUARE, Identification, descend, starts_of
from papilla.identification.parameters import physical
from papilla.identification.problem import Problem

INTERVAL_HALF_WIDTH_SIGMAS = 1.959964
"""Half width of a 95 % interval, in standard deviations."""

CLOSE_TO_BOUND = 1e-3
"""Share of the range between its bounds within which a parameter counts as being at a bound."""

RATIO_WORDS = "the ratio of the moduli"

PROFILE_STEP_SIGMAS, MOST_PROFILE_STEPS, PROFILE_END_ACCURACY = 0.75, 12, 0.005
"""Step, in standard deviations; largest number of steps on each side; and accuracy of an end, in standard
deviations."""


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
