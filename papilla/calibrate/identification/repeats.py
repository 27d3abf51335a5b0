"""Noise of a bench, estimated from repeated presses.

Repeated presses differ by noise alone, because the model has the same error in all of them. Restricted maximum
likelihood estimates the noise (Patterson and Thompson 1971, doi:10.1093/biomet/58.3.545), because an error of the force
changes all channels of a press together. The stated noise counts as `STATED_FREEDOM` repeats.
"""

from dataclasses import replace

import numpy as np
from scipy.linalg import helmert
from scipy.optimize import minimize

from papilla.calibrate.identification.noise import Noise
from papilla.calibrate.identification.presses import places
from papilla.calibrate.identification.problem import Modelled, Problem

SAME_FORCE = 1.02
"""Largest ratio of forces between presses that count as repeats; the model accounts for the difference of their
forces."""

STATED_FREEDOM = 4.0


def estimated_noise(problem: Problem, vector: np.ndarray) -> Noise:
    """The noise of a problem's presses, estimated from repeated ones at a fitted vector (f,); the stated noise, if no
    press is repeated or if the rows are samples of touches (`t_s`), which share an error of force."""
    groups = _groups(problem) if problem.log.t_s is None else []
    if not groups:
        return problem.noise
    stated = np.array([problem.reading_noise, problem.noise.force, problem.noise.indentation_mm])
    deep = problem.measured.shape[1] > problem.reading_count
    stated = stated if deep else stated[:2]
    modelled = problem.modelled(vector)
    parts = [_contrasts(problem, modelled, rows) for rows in groups]
    freedom = sum(len(contrasts) for contrasts, _ in parts)

    def minus_twice_log_likelihood(ln_variance: np.ndarray) -> float:
        """Minus twice the log likelihood, as a function of the logarithms of the variances: readings, force and, if
        measured, indentation."""
        variance = np.exp(ln_variance)
        own = np.full(problem.measured.shape[1], variance[0])
        own[problem.reading_count :] = variance[-1]
        # The stated variances as so many earlier repeats: a few presses cannot move the noise far.
        total = STATED_FREEDOM * float((ln_variance + stated**2 / variance).sum())
        for contrasts, slope in parts:
            covariance = np.diag(own) + variance[1] * np.outer(slope, slope)
            total += len(contrasts) * float(np.linalg.slogdet(covariance)[1])
            total += float(np.einsum("kc,cd,kd->", contrasts, np.linalg.inv(covariance), contrasts))
        return total

    # Bounds: noise from 1/1000 to 1000 times the stated one
    start = 2 * np.log(stated)
    sides = [(one - 2 * np.log(1e3), one + 2 * np.log(1e3)) for one in start]
    found = np.exp(minimize(minus_twice_log_likelihood, start, method="L-BFGS-B", bounds=sides).x / 2)
    # The estimate is of S_d or of a gauge, whichever was measured; the noise is stated for a gauge.
    readings = float(found[0]) * problem.noise.readings_microstrain / problem.reading_noise
    depth = float(found[2]) if deep else problem.noise.indentation_mm
    return replace(
        problem.noise, readings_microstrain=readings, force=float(found[1]), indentation_mm=depth, repeats=freedom
    )


def _groups(problem: Problem) -> list[np.ndarray]:
    """Rows of presses under one condition, two or more in each group."""
    log = problem.log
    on = np.zeros(len(log)) if log.on is None else log.on
    keys = np.column_stack([log.modulus_MPa, places(log), on])
    _, which = np.unique(keys, axis=0, return_inverse=True)
    found: list[list[int]] = []
    for key in range(which.max() + 1):
        rows = np.flatnonzero(which == key)
        rows = rows[np.argsort(log.force_N[rows], kind="stable")]
        group = [int(rows[0])]
        for row in rows[1:].tolist():
            if log.force_N[row] > SAME_FORCE * log.force_N[group[0]]:
                found.append(group)
                group = []
            group.append(row)
        found.append(group)
    return [np.array(group) for group in found if len(group) > 1]


def _contrasts(problem: Problem, modelled: Modelled, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Independent differences (m - 1, c) of m repeated presses, and the mean derivative (c,) by ln force."""
    # Differences between repeats contain no error of the model; Helmert's are independent.
    off = (problem.measured - modelled.values)[rows]
    return helmert(len(rows)) @ off, modelled.by_ln_force[rows].mean(axis=0)
