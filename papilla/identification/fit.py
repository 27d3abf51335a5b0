"""`identify`: the best fit of a problem of presses; further parameters are freed if the presses do not fit otherwise.

The fit starts from several places, because chi-square may have more than one minimum. Each descent varies the nonlinear
parameters alone (`Problem.projected`); weights follow from the fit before. If the model does not fit, a score test
finds the shift of a gauge or the tilt that would help most.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from operator import itemgetter

import numpy as np

from papilla.core.errors import InputError
from papilla.core.least_squares import least_squares
from papilla.core.progress import Progress, silent
from papilla.core.short_repr import html_table
from papilla.fem.reduction.family import with_moduli
from papilla.identification.noise import PressNoise, estimated_noise
from papilla.identification.parameters import (
    CONTACT_MOVES,
    OF_THE_LOG,
    PARAMETERS_BY_NAME,
    checked_values,
    kind,
    linear_last,
    names_of,
    physical,
)
from papilla.identification.posing import ensure_physics, family_of, moved_by, problem_of, with_moves
from papilla.identification.presses import NOT_STATED, refuse_far
from papilla.identification.problem import Problem
from papilla.logs import PressLog
from papilla.model.finger import Finger
from papilla.model.parts import Identified
from papilla.model.specimen import Friction, Specimen

MOST_FITS = 10
"""Largest number of fits; each uses the weights that follow from the one before it."""

SETTLED_CHANGE_SIGMAS = 0.01
"""Change of every parameter between two fits, in standard deviations, below which the fits end."""

DESCENT_TOLERANCE, MOST_DESCENT_EVALUATIONS = 1e-9, 60
"""Relative tolerances and largest number of evaluations of a descent."""

START_BOUND_MARGIN = 1e-6
"""Share of the range between its bounds by which a start value lies inside."""

ANOTHER_MINIMUM_DISTANCE = 0.05
"""Difference of a nonlinear parameter (relative, for logarithmic ones) above which a minimum is another finger."""

SAME_COST = 1e-3
"""Relative difference of costs up to which two fits have ended in the same minimum."""

CONTINUED_FITS = 3
"""Number of the best first fits that are continued to convergence."""

MISFIT_CHI_SQUARE = 1.5
"""Chi-square per degree of freedom above which the model does not fit; all sigmas are then multiplied by its square
root."""

MOST_FREED = 2
"""Largest number of parameters that are freed in this way: with more, the fit would only absorb other errors."""

LEAST_FALL = 0.3
"""Share by which each freed parameter must lower chi-square."""

TRIED_PARAMETERS = 3
"""Number of likely parameters of which each is tried."""

ALIKE_CHI_SQUARE = 3.84
"""Difference of chi-square up to which two parameters explain the presses equally well: the 95 % quantile for one
degree of freedom."""


@dataclass(frozen=True, eq=False)
class Identification:
    """A finger identified from n presses; f parameters were free.

    problem : presses, model and weights of the last fit. vector : (f,) in the scale of the fit (logarithms, for
    logarithmic parameters), and covariance (f, f) in it. chi_square, freedom : of the presses' weighted residuals.
    rival : cost of the next best minimum above this one; None if all starts ended in the same minimum. asked : a
    sentence on the parameters that were freed because the presses do not fit otherwise; empty if there are none.
    """

    problem: Problem
    vector: np.ndarray
    covariance: np.ndarray
    chi_square: float
    freedom: float
    rival: float | None = None
    asked: str = ""

    def __repr__(self) -> str:
        listed = ", ".join(
            f"{name} {self[name][0]:.4g}" for name in self.names if not PARAMETERS_BY_NAME[kind(name)].each_gauge
        )
        return f"<Identification from {len(self.problem.log)} presses: {listed}>"

    def _repr_html_(self) -> str:
        """Parameters with their standard deviations as a table, for notebooks."""
        rows = [(name, *self[name], PARAMETERS_BY_NAME[kind(name)].unit) for name in self.names]
        title = f"Identification from {len(self.problem.log)} presses"
        return html_table(title, rows, ("parameter", "value", "sigma (relative, for moduli and gains)", "unit"))

    @property
    def names(self) -> tuple[str, ...]:
        """The free parameters."""
        return self.problem.free

    @cached_property
    def values(self) -> dict[str, float]:
        """All parameters in their units, including those that were held."""
        return self.problem.values(self.vector)

    @cached_property
    def sigma(self) -> np.ndarray:
        """(f,) standard deviations in the scale of the fit: relative, for logarithmic parameters."""
        return np.sqrt(np.diag(self.covariance))

    def __getitem__(self, name: str) -> tuple[float, float]:
        """Value (in its unit) and standard deviation (in the scale of the fit) of a free parameter."""
        place = self.names.index(name)
        return physical(name, float(self.vector[place])), float(self.sigma[place])

    @cached_property
    def finger(self) -> Finger:
        """The design with the identified moduli, gains, levers and places of the gauges."""
        values = self.values
        finger = with_moduli(self.problem.finger, values["outer_modulus_MPa"], values["inner_modulus_MPa"])
        gauges = []
        for gauge in finger.gauges:
            gain = values["common_gain"] * values[f"gain.{gauge.name}"]
            lever = values["common_gain"] * values[f"lever_mm.{gauge.name}"] + gain * values["common_lever_mm"]
            along, across = moved_by(values, gauge.name)
            moved = gauge.moved_mm[0] + along, gauge.moved_mm[1] + across
            gauges.append(replace(gauge, membrane_gain=gain, lever_mm=lever, moved_mm=moved))
        return replace(finger, gauges=tuple(gauges))

    def with_record(self, record: Identified) -> Finger:
        """The identified finger with the record of its identification, and its bench."""
        bench = replace(self.finger.bench, touch_down=record.touch_down_mm, thickness=self.values["thickness_mm"])
        if record.friction != NOT_STATED:
            bench = replace(bench, friction=record.friction)
        return replace(self.finger, identified=record, bench=bench)

    def at(self, force_N: np.ndarray, modulus_MPa: np.ndarray) -> np.ndarray:
        """(n, c) predicted measurements of other presses by forces (n,) on specimens of moduli (n,), zeros included."""
        return self.problem.of(force_N, modulus_MPa).modelled(self.vector).values

    @property
    def measured_sd(self) -> np.ndarray:
        """(n,) S_d of the presses in microstrain, without the identified zeros of the gauges."""
        log, zeros = self.problem.log, self.problem.each("zero_microstrain", self.values)
        return (log.readings - zeros).std(axis=1) if log.stated_sd is None else log.stated_sd

    @cached_property
    def residuals(self) -> np.ndarray:
        """(n, c) measured minus modelled values: readings in microstrain, then indentation in mm."""
        return self.problem.measured - self.problem.modelled(self.vector).values


def identify(
    log: PressLog,
    finger: Finger,
    *,
    free: Sequence[str] = (),
    fix: Mapping[str, float] | None = None,
    specimen: Specimen | None = None,
    noise: PressNoise | None = None,
    friction: Friction | None = None,
    size_mm: float | None = None,
    processes: int = 1,
    progress: Progress = silent,
) -> Identification:
    """Identify a finger of known geometry from presses on specimens of known modulus.

    Places of gauges and tilt are held unless `free` names them. If the model does not fit the presses, but fits with
    one or two of them free, these are freed, and the identification says so (`asked`).

    Parameters
    ----------
    finger : geometry and Poisson's ratios; its moduli are the middle of their priors.
    free : names of `PARAMETERS` to fit besides both moduli, gains, levers, zeros, and the touch-down offset where there
        are indentations. fix : values (in their units) at which parameters are held.
    specimen : what was pressed, if the log does not say it; its modulus is ignored. noise : of the presses. friction :
        as for `papilla.fem.press`. If they are None, those of the finger's `bench` are taken.
    size_mm : elements at the contact. processes : number of processes that measure large strain at the same time, if it
        is not known.

    Raises `InputError` for a log of another finger, of presses far from the apex, unknown names, or fewer measurements
    than a fit needs, and what `papilla.fem.reduction.family.family` raises.
    """
    if processes > 1:
        rubbing = finger.bench.friction if friction is None else friction
        ensure_physics(finger, rubbing, processes=processes, progress=progress)
    problem = problem_of(log, finger, free, fix or {}, specimen, noise, friction, size_mm, progress)
    fixed = checked_values(fix or {}, finger)
    return freed(solve(problem, progress), tuple(fixed), size_mm, progress)


def solve(problem: Problem, progress: Progress = silent) -> Identification:
    """Fit a problem from several starts; each fit is repeated with the weights that follow from it."""
    progress("identifying")
    first = problem.weighted()
    fits = sorted((descend(first, start) for start in starts_of(first)), key=itemgetter(0))
    # Repeated presses tell the noise, but only with a model that already fits.
    first = replace(first, noise=estimated_noise(first, fits[0][1]))
    ends = [_followed(first, vector) for _, vector in _distinct(fits)[:CONTINUED_FITS]]
    ends.sort(key=itemgetter(0))
    cost, last, vector = ends[0]
    # Another minimum counts only if its nonlinear parameters differ; else it is the same finger found twice.
    outside = ~problem.linear
    rivals = [
        end[0] - cost
        for end in ends[1:]
        if np.abs(end[2] - vector)[outside].max(initial=0.0) > ANOTHER_MINIMUM_DISTANCE
    ]
    return _judged(last, vector, min(rivals, default=None))


def starts_of(problem: Problem) -> list[np.ndarray]:
    """Start values of the nonlinear parameters, and for each parameter one prior standard deviation to both sides."""
    outside = ~problem.linear
    middle = problem.start[outside]
    kinds = [kind(name) for name, linear in zip(problem.free, problem.linear, strict=True) if not linear]
    # A parameter that is known well, or has a small effect, starts only at its prior
    widths = np.diag([PARAMETERS_BY_NAME[name].sigma for name in kinds])
    widths = widths[[name not in (*CONTACT_MOVES, *OF_THE_LOG, "common_gain") for name in kinds]]
    return [middle, *(middle + widths), *(middle - widths)]


def descend(problem: Problem, start: np.ndarray) -> tuple[float, np.ndarray]:
    """Cost and vector (f,) of the best fit from a start (others,) of the nonlinear parameters."""
    if not len(start):
        vector = problem.solved(start)
        return float((problem.residuals(vector) ** 2).sum()), vector
    low, high = (side[~problem.linear] for side in problem.bounds)
    margin = START_BOUND_MARGIN * (high - low)
    limits: dict = dict.fromkeys(("xtol", "ftol", "gtol"), DESCENT_TOLERANCE) | {"max_nfev": MOST_DESCENT_EVALUATIONS}
    begin = np.clip(start, low + margin, high - margin)
    descent = least_squares(problem.projected, begin, both=True, bounds=(low, high), x_scale=(high - low) / 4, **limits)
    return descent.cost, problem.solved(descent.vector)


def _distinct(fits: list[tuple[float, np.ndarray]]) -> list[tuple[float, np.ndarray]]:
    """Fits in order of rising cost, without those that ended in a minimum that is already in the list."""
    distinct: list[tuple[float, np.ndarray]] = []
    for cost, vector in fits:
        if all(abs(cost - earlier) > SAME_COST * (1 + earlier) for earlier, _ in distinct):
            distinct.append((cost, vector))
    return distinct


def _followed(problem: Problem, vector: np.ndarray) -> tuple[float, Problem, np.ndarray]:
    """Fit again, each time with the weights that follow from the last fit, until they no longer change the result."""
    for _ in range(MOST_FITS):
        problem = problem.weighted(vector).downweighted(vector)
        before = vector
        cost, vector = descend(problem, vector[~problem.linear])
        sigma = np.sqrt(np.diag(_covariance(problem, vector)))
        if np.abs((vector - before) / sigma).max() < SETTLED_CHANGE_SIGMAS:
            break
        problem = problem.with_alike_zeros(vector, sigma)
    return cost, problem, vector


def _covariance(problem: Problem, vector: np.ndarray) -> np.ndarray:
    """Inverse of the information of presses and priors. Columns are scaled first, because they have different units.

    The last residual, which keeps the ratio of the moduli inside the family, does not count as information.
    """
    jacobian = problem.jacobian(vector)[:-1]
    size = np.linalg.norm(jacobian, axis=0)
    return np.linalg.inv((jacobian / size).T @ (jacobian / size)) / np.outer(size, size)


def _judged(problem: Problem, vector: np.ndarray, rival: float | None) -> Identification:
    """The result of a fit: covariance, chi-square and degrees of freedom; sigmas are widened if the model does not
    fit."""
    priors = len(problem.free) + 1
    residuals, jacobian = problem.linearised(vector)
    of_presses = residuals[:-priors]
    covariance = _covariance(problem, vector)
    # Degrees of freedom that the presses themselves lose to the fit: a parameter that its prior decides uses none.
    used = float(np.trace(covariance @ (jacobian[:-priors].T @ jacobian[:-priors])))
    freedom = float(np.isfinite(problem.measured).sum()) - used
    chi_square = float((of_presses**2).sum())
    if freedom > 0 and chi_square / freedom > MISFIT_CHI_SQUARE:
        covariance = covariance * (chi_square / freedom)
    return Identification(problem, vector, covariance, chi_square, freedom, rival)


def freed(fit: Identification, fixed: tuple[str, ...], size_mm: float | None, progress: Progress) -> Identification:
    """The identification after freeing further parameters, if the model did not fit before and fits then.

    fixed : parameters that must not be freed.
    """
    if not _misfit(fit) or fit.problem.log.stated_sd is not None:
        return fit
    try:
        best = replace(fit, problem=_moving(fit.problem, size_mm, progress))
    except InputError:
        return fit  # Neither contacts nor gauges of this finger can be moved that far
    names: list[str] = []
    alike: list[str] = []
    while _misfit(best) and len(names) < MOST_FREED:
        # Score test first: a whole fit for each candidate would take minutes.
        gains = {name: _gain(best, name) for name in _candidates(best.problem, fixed)}
        likely = sorted(gains, key=lambda name: -gains[name])[:TRIED_PARAMETERS]
        progress(f"the model does not fit: with {', '.join(likely) or 'nothing more'} free")
        tried = {name: _with_free(best, name) for name in likely}
        name = min(tried, key=lambda candidate: tried[candidate].chi_square, default="")
        if not name or tried[name].chi_square > (1 - LEAST_FALL) * best.chi_square:
            break
        best = tried.pop(name)
        names.append(name)
        alike = [candidate for candidate in tried if tried[candidate].chi_square < best.chi_square + ALIKE_CHI_SQUARE]
    # Only if the model then fits: otherwise the freed parameter would only hide another error.
    if not names or _misfit(best):
        return fit
    named = " and ".join(f"{name} ({best[name][0]:+.2g} {PARAMETERS_BY_NAME[kind(name)].unit})" for name in names)
    fell = f"chi-square fell from {fit.chi_square:.3g} to {best.chi_square:.3g}"
    others = f"; {' or '.join(alike)} instead of {names[-1]} does as well" if alike else ""
    return replace(best, asked=f"{named} was freed because the presses do not fit otherwise: {fell}{others}")


def _with_free(fit: Identification, name: str) -> Identification:
    """The fit with one more parameter free, started from the earlier fit."""
    free = linear_last((*fit.names, name))
    at = dict(zip(fit.names, fit.vector.tolist(), strict=True))
    _, last, vector = _followed(
        replace(fit.problem, free=free), np.array([at.get(parameter, 0.0) for parameter in free])
    )
    return _judged(last, vector, None)


def _misfit(fit: Identification) -> bool:
    return fit.freedom > 0 and fit.chi_square > MISFIT_CHI_SQUARE * fit.freedom


def _moving(problem: Problem, size_mm: float | None, progress: Progress) -> Problem:
    """The problem with the changes by contacts beside the apex and by moved gauges."""
    if all(shape.off_apex is not None for shape in problem.shapes):
        return problem
    relatives = family_of(problem.finger, size_mm=size_mm, progress=progress)
    return replace(problem, shapes=with_moves(problem.shapes, relatives, progress))


def _candidates(problem: Problem, fixed: tuple[str, ...]) -> list[str]:
    """Places and tilts that are neither free nor held, and that these presses could determine."""
    names = []
    for name in names_of(problem.finger):
        if kind(name) not in CONTACT_MOVES or name in problem.free or name in fixed:
            continue
        off_apex = problem.shapes[0].off_apex
        assert off_apex is not None
        flat = all(shape.specimen.curvature == (0.0, 0.0) for shape in problem.shapes)
        try:
            refuse_far(problem.log, off_apex.limits, (*problem.free, name))
        except InputError:
            continue
        if flat or not name.startswith("tilt"):
            names.append(name)
    return names


def _gain(fit: Identification, name: str) -> float:
    """Fall of chi-square plus priors with one more parameter free, to first order (Rao's score test)."""
    problem = replace(fit.problem, free=(*fit.names, name))
    vector = np.append(fit.vector, 0.0)
    residuals, jacobian = problem.linearised(vector)
    others = np.linalg.qr(jacobian[:, :-1])[0]
    column = jacobian[:, -1] - others @ (others.T @ jacobian[:, -1])
    size = float(column @ column)
    return float(column @ residuals) ** 2 / size if size > 0 else 0.0
