"""Errors of measured presses by their cause: stated, or estimated from repeated presses.

Repeated presses differ by noise alone, because the model has the same error in all of them. Restricted maximum
likelihood estimates the noise (Patterson and Thompson 1971, doi:10.1093/biomet/58.3.545), because an error of the force
changes all channels of a press together. The stated noise counts as `STATED_FREEDOM` repeats.
"""

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import helmert
from scipy.optimize import minimize

from papilla.core import checks
from papilla.core.units import PER_CENT
from papilla.identification.presses import places
from papilla.logs.presses import USUAL_FORCE_ERROR

if TYPE_CHECKING:
    from papilla.identification.problem import Problem

SAME_FORCE = 1.02
"""Largest ratio of forces between presses that count as repeats; the model accounts for the difference of their
forces."""

STATED_FREEDOM = 4.0

AT_MOST = 1e3
"""Largest ratio of the estimated noise to the stated one, and of the stated to the estimated."""


@dataclass(frozen=True)
class PressNoise:
    """Standard deviations of the errors that are not in the model, each independent from press to press.

    readings_microstrain : of a gauge. force : relative; all gauges of a press share it. indentation_mm : of the stage.
    model, depth : relative errors of the model in gauge strain (twice as much in curvature) and in indentation; they
    are similar in all presses (`problem.MODEL_ERROR_PATTERNS`). On twelve drawn domes strain differed from an
        independent code at finite strain by 0.2 to 0.3 % rms of the largest, indentation by 0.1 to 0.3 %
        (`python benchmarks/own_fingers.py --draws 12`); a gauge away from the largest by twice that share of its own.
    beyond : added to `model` if a press strains the finger more than the range of large strain that was measured.
    repeats : degrees of freedom of repeated presses from which the first three were estimated; 0 if they are stated.
    """

    readings_microstrain: float = 5.0
    force: float = USUAL_FORCE_ERROR
    indentation_mm: float = 0.02
    model: float = 0.005
    depth: float = 0.005
    beyond: float = 0.02
    repeats: int = 0

    def __post_init__(self) -> None:
        for item in fields(self):
            if item.name != "repeats":
                checks.positive(f"noise {item.name}", getattr(self, item.name))

    @property
    def words(self) -> str:
        """The noise in words, and whether it is stated or estimated."""
        parts = f"readings {self.readings_microstrain:.3g} µε, force {PER_CENT * self.force:.2g} %"
        return f"{parts}, {f'estimated from {self.repeats} repeats' if self.repeats else 'as stated'}"


def estimated_noise(problem: "Problem", vector: np.ndarray) -> PressNoise:
    """The noise of a problem's presses, estimated from repeated ones at a fitted vector (f,); the stated noise, if no
    press is repeated or if the rows are samples of touches (`t_s`), which share an error of force."""
    groups = _groups(problem) if problem.log.t_s is None else []
    if not groups:
        return problem.noise
    stated = np.array([problem.reading_noise, problem.noise.force, problem.noise.indentation_mm])
    deep = problem.measured.shape[1] > len(problem.reading_names)
    stated = stated if deep else stated[:2]
    modelled = problem.modelled(vector)
    # Differences between repeats contain no error of the model; Helmert's are independent, m - 1 of m presses.
    off, slope = problem.measured - modelled.values, modelled.by_ln_force
    parts = [(helmert(len(rows)) @ off[rows], slope[rows].mean(axis=0)) for rows in groups]
    freedom = sum(len(contrasts) for contrasts, _ in parts)

    def minus_twice_log_likelihood(ln_variance: np.ndarray) -> float:
        """Minus twice the log likelihood, as a function of the logarithms of the variances: readings, force and, if
        measured, indentation."""
        variance = np.exp(ln_variance)
        diagonal = np.full(problem.measured.shape[1], variance[0])
        diagonal[len(problem.reading_names) :] = variance[-1]
        # The stated variances as so many earlier repeats: a few presses cannot move the noise far.
        total = STATED_FREEDOM * float((ln_variance + stated**2 / variance).sum())
        for contrasts, slope in parts:
            covariance = np.diag(diagonal) + variance[1] * np.outer(slope, slope)
            total += len(contrasts) * float(np.linalg.slogdet(covariance)[1])
            total += float(np.einsum("kc,cd,kd->", contrasts, np.linalg.inv(covariance), contrasts))
        return total

    start, reach = 2 * np.log(stated), 2 * np.log(AT_MOST)
    sides = [(middle - reach, middle + reach) for middle in start]
    sigma = np.exp(minimize(minus_twice_log_likelihood, start, method="L-BFGS-B", bounds=sides).x / 2)
    # The estimate is of S_d or of a gauge, whichever was measured; the noise is stated for a gauge.
    readings = float(sigma[0]) * problem.noise.readings_microstrain / problem.reading_noise
    depth = float(sigma[2]) if deep else problem.noise.indentation_mm
    return replace(
        problem.noise, readings_microstrain=readings, force=float(sigma[1]), indentation_mm=depth, repeats=freedom
    )


def _groups(problem: "Problem") -> list[np.ndarray]:
    """Rows of presses under one condition, two or more in each group."""
    log = problem.log
    on = np.zeros(len(log)) if log.on is None else log.on
    keys = np.column_stack([log.modulus_MPa, places(log), on])
    _, which = np.unique(keys, axis=0, return_inverse=True)
    groups: list[list[int]] = []
    for key in range(which.max() + 1):
        rows = np.flatnonzero(which == key)
        rows = rows[np.argsort(log.force_N[rows], kind="stable")]
        group = [int(rows[0])]
        for press in rows[1:].tolist():
            if log.force_N[press] > SAME_FORCE * log.force_N[group[0]]:
                groups.append(group)
                group = []
            group.append(press)
        groups.append(group)
    return [np.array(group) for group in groups if len(group) > 1]
