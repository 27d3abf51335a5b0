"""The best fit of a problem of presses: the parameters of a finger and their covariance."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from papilla.calibrate.identification.parameters import MOVES, OF_THE_LOG, PARAMETERS, kind, physical
from papilla.calibrate.identification.posing import moved_by
from papilla.calibrate.identification.presses import NOT_STATED
from papilla.calibrate.identification.problem import Problem
from papilla.calibrate.identification.repeats import estimated_noise
from papilla.fem.reduction.family import with_moduli
from papilla.finger import Finger
from papilla.finger_parts import Identified
from papilla.short_repr import html_table

ROUNDS = 10
"""Largest number of fits; each uses the weights that follow from the one before it."""

SETTLED = 0.01
"""Change of every parameter between two fits, in standard deviations, below which the fits end."""

OUTLYING = 4.0
"""Weighted residual above which a reading counts less (Cauchy weights)."""

KEPT = 3
"""Number of the best first fits that are continued to convergence."""

MISFIT = 1.5
"""Chi-square per degree of freedom above which the model does not fit; all sigmas are then multiplied by its square
root."""


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
        shown = ", ".join(f"{name} {self[name][0]:.4g}" for name in self.names if not PARAMETERS[kind(name)].each_gauge)
        return f"<Identification from {len(self.problem.log)} presses: {shown}>"

    def _repr_html_(self) -> str:
        """Parameters with their standard deviations as a table, for notebooks."""
        rows = [(name, *self[name], PARAMETERS[kind(name)].unit) for name in self.names]
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
        found = with_moduli(self.problem.finger, values["outer_modulus_MPa"], values["inner_modulus_MPa"])
        gauges = []
        for gauge in found.gauges:
            gain = values["common_gain"] * values[f"gain.{gauge.name}"]
            lever = values["common_gain"] * values[f"lever_mm.{gauge.name}"] + gain * values["common_lever_mm"]
            along, across = moved_by(values, gauge.name)
            moved = gauge.moved_mm[0] + along, gauge.moved_mm[1] + across
            gauges.append(replace(gauge, membrane_gain=gain, lever_mm=lever, moved_mm=moved))
        return replace(found, gauges=tuple(gauges))

    def with_record(self, record: Identified) -> Finger:
        """The identified finger with the record of its identification, and its bench."""
        bench = replace(self.finger.bench, touch_down=record.touch_down_mm, thickness=self.values["thickness_mm"])
        if record.friction != NOT_STATED:
            bench = replace(bench, friction=record.friction)
        return replace(self.finger, identified=record, bench=bench)

    def at(self, force_N: np.ndarray, modulus_MPa: np.ndarray) -> np.ndarray:
        """(n, c) predicted measurements of other presses by forces (n,) on specimens of moduli (n,), zeros included."""
        return self.other_presses(force_N, modulus_MPa).modelled(self.vector).values

    def other_presses(self, force_N: np.ndarray, modulus_MPa: np.ndarray) -> Problem:
        """The problem of other presses (n,) on the first shape of specimen, to predict their measurements and
        derivatives."""
        return self.problem.of(force_N, modulus_MPa)

    @cached_property
    def residuals(self) -> np.ndarray:
        """(n, c) measured minus modelled values: readings in microstrain, then indentation in mm."""
        return self.problem.measured - self.problem.modelled(self.vector).values


def solve(problem: Problem, progress: Callable[[str], None] | None = None) -> Identification:
    """Fit a problem from several starts; each fit is repeated with the weights that follow from it."""
    if progress is not None:
        progress("identifying")
    first = problem.weighted()
    found = sorted((descend(first, start) for start in starts_of(first)), key=lambda one: one[0])
    # Repeated presses tell the noise, but only with a model that already fits.
    first = replace(first, noise=estimated_noise(first, found[0][1]))
    ends = [_followed(first, vector) for _, vector in _distinct(found)[:KEPT]]
    ends.sort(key=lambda one: one[0])
    cost, last, vector = ends[0]
    # Another minimum counts only if its nonlinear parameters differ; else it is the same finger found twice.
    others = [one[0] - cost for one in ends[1:] if np.abs(one[2] - vector)[~problem.linear].max(initial=0.0) > 0.05]
    return _judged(last, vector, min(others, default=None))


def solved_from(problem: Problem, vector: np.ndarray) -> Identification:
    """The fit of a problem from one start vector (f,), continued to convergence."""
    _, last, found = _followed(problem, vector)
    return _judged(last, found, None)


def starts_of(problem: Problem) -> list[np.ndarray]:
    """Start values of the nonlinear parameters, and for each parameter one prior standard deviation to both sides."""
    outside = ~problem.linear
    middle = problem.start[outside]
    names = [name for name, linear in zip(problem.free, problem.linear, strict=True) if not linear]
    # A parameter that is known well, or has a small effect, starts only at its prior
    widths = np.diag([PARAMETERS[kind(name)].sigma for name in names])
    widths = widths[[kind(name) not in (*MOVES, *OF_THE_LOG, "common_gain") for name in names]]
    return [middle, *(middle + widths), *(middle - widths)]


def descend(problem: Problem, start: np.ndarray) -> tuple[float, np.ndarray]:
    """Cost and vector (f,) of the best fit from a start (others,) of the nonlinear parameters."""
    if not len(start):
        vector = problem.solved(start)
        return float((problem.residuals(vector) ** 2).sum()), vector
    low, high = (side[~problem.linear] for side in problem.bounds)
    # `least_squares` asks for residuals and Jacobian in two calls; both come from one evaluation.
    known: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def at(outside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if outside.tobytes() not in known:
            known.clear()
            known[outside.tobytes()] = problem.projected(outside)
        return known[outside.tobytes()]

    margin = 1e-6 * (high - low)
    done = least_squares(
        lambda outside: at(outside)[0],
        np.clip(start, low + margin, high - margin),
        lambda outside: at(outside)[1],
        (low, high),
        x_scale=(high - low) / 4,
        xtol=1e-9,
        ftol=1e-9,
        gtol=1e-9,
        max_nfev=60,
    )
    return 2 * float(done.cost), problem.solved(done.x)


def _distinct(found: list[tuple[float, np.ndarray]]) -> list[tuple[float, np.ndarray]]:
    """Fits in order of rising cost, without those that ended in a minimum that is already in the list."""
    kept: list[tuple[float, np.ndarray]] = []
    for cost, vector in found:
        if all(abs(cost - other) > 1e-3 * (1 + other) for other, _ in kept):
            kept.append((cost, vector))
    return kept


def _followed(problem: Problem, vector: np.ndarray) -> tuple[float, Problem, np.ndarray]:
    """Fit again, each time with the weights that follow from the last fit, until they no longer change the result."""
    for _ in range(ROUNDS):
        problem = problem.weighted(vector).downweighted(vector, OUTLYING)
        before = vector
        cost, vector = descend(problem, vector[~problem.linear])
        sigma = np.sqrt(np.diag(_covariance(problem, vector)))
        if np.abs((vector - before) / sigma).max() < SETTLED:
            break
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
    residuals, jacobian = problem.residuals(vector), problem.jacobian(vector)
    of_presses = residuals[:-priors]
    covariance = _covariance(problem, vector)
    # Degrees of freedom that the presses themselves lose to the fit: a parameter that its prior decides uses none.
    used = float(np.trace(covariance @ (jacobian[:-priors].T @ jacobian[:-priors])))
    freedom = float(np.isfinite(problem.measured).sum()) - used
    chi_square = float((of_presses**2).sum())
    if freedom > 0 and chi_square / freedom > MISFIT:
        covariance = covariance * (chi_square / freedom)
    return Identification(problem, vector, covariance, chi_square, freedom, rival)
