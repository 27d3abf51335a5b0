"""Statistics of a method on a scene: share of answers, share of false ones, and coverage of its sigma.

A row is false if the method says "ok" and its error is more than 5 %, or if there is no line at all.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from papilla.errors import InputError
from papilla.studies.case import Case
from papilla.studies.estimator_bench.methods import METHODS, PRODUCT, RIVAL, Answer
from papilla.studies.estimator_bench.other_methods import LONG_MM
from papilla.studies.estimator_bench.scenes import SCENES, Scene
from papilla.units import PER_CENT

WRONG = 0.05
SETTLED_S, SETTLED_PERIODS, FROM_MM = 0.3, 2.0, 12.0
"""Time and path since the surface began: after the first a false answer counts as settled; from the second on answers
are counted."""
MOST_FALSE, MOST_FALSE_SETTLED, LEAST_COVERED, LEAST_ANSWERED = 0.02, 0.005, 0.9, 0.8
MOST_RUNS_CLAIMED, BESIDE_BEST, TRUSTED = 0.01, 1.2, 0.05


@dataclass(frozen=True)
class Run:
    """One method on one scene: relative errors (n,) (inf without an answer), errors over sigma, and rows that are ok,
    settled, counted (on `FROM_MM` of path since the surface began), and those of them at which an answer may be asked
    for (`Scene.tellable`); steady : rows that say "ok, constant speed"; when the first right answer came; the mean
    square error over the bound (NaN where there is none); microseconds a sample."""

    error: np.ndarray
    over_sigma: np.ndarray
    ok: np.ndarray
    settled: np.ndarray
    counted: np.ndarray
    asked: np.ndarray
    steady: np.ndarray
    first_right_s: float
    bound_square: float
    us: float


@dataclass(frozen=True)
class Row:
    """One method on one scene over all runs; shares and errors are fractions.

    answered : share of ok among the rows at which an answer may be asked for, asked : the share of these among the
    counted ones. claimed : share of runs with any such row. false, false_settled :
    share of ok rows that are false, all and those after 0.3 s and two periods. median, over_5 : of the relative error
    of all counted rows, ok or not, and the share of them that is wrong or has no answer. rms : of ok rows, 1 at most.
    covered : share of ok rows within two sigma; over_sigma : RMS of their error over sigma. over_bound : RMS over the
    Cramér-Rao bound of the path that is remembered. first_right_s : median time from where the surface begins. us :
    microseconds a sample. faults : what misses its target, of the product alone.
    """

    scene: str
    method: str
    kind: str
    answered: float
    asked: float
    claimed: float
    false: float
    false_steady: float
    false_settled: float
    median: float
    over_5: float
    rms: float
    covered: float
    over_sigma: float
    over_bound: float
    first_right_s: float
    us: float
    runs: int
    faults: tuple[str, ...] = ()


def judged(made: Scene, answer: Answer, path_mm: float | None, us: float) -> Run:
    """Compare an answer with the scene's truth."""
    recipe = SCENES[made.name]
    changes = np.flatnonzero(np.diff(made.wavelength_mm, prepend=math.nan) != 0) if recipe.lined else np.array([0])
    began = changes[np.searchsorted(changes, np.arange(made.time_s.size), side="right") - 1]
    since_s, since_mm = (column - column[began] for column in (made.time_s, made.travelled_mm))
    off = [np.abs(answer.wavelength_mm - right) for right in (made.wavelength_mm, *made.others_mm)]
    nearest = np.nan_to_num(np.fmin.reduce(off), nan=math.inf)
    error = nearest / np.nan_to_num(made.wavelength_mm, nan=1.0)
    right = np.flatnonzero((answer.ok & (error <= WRONG))[changes[-1] :])
    square = math.nan
    if path_mm is not None and recipe.clean:
        try:
            path = min(path_mm, 0.8 * made.travelled_mm[-1])
            rows = made.judged() & (made.travelled_mm >= path) & answer.ok
            square = float(np.mean(error[rows] ** 2)) / made.bound(path_mm=path) ** 2 if rows.any() else math.nan
        except InputError:
            square = math.nan  # The scene is too short for a window that is judged
    with np.errstate(invalid="ignore"):
        over_sigma = np.nan_to_num(nearest / answer.sigma_mm, nan=math.inf).clip(max=1e9)
    settled = (since_s > SETTLED_S) & (since_mm > SETTLED_PERIODS * np.nan_to_num(made.wavelength_mm))
    first = right[0] / made.sample_rate_Hz if right.size else math.inf
    counted = since_mm > FROM_MM
    asked = counted & made.tellable(np.minimum(since_mm, LONG_MM))
    steady = np.zeros(len(error), bool) if answer.steady is None else answer.steady
    return Run(error, over_sigma, answer.ok, settled, counted, asked, steady, float(first), square, us)


def row_of(scene: str, method: str, runs: Sequence[Run]) -> Row:
    """The statistics of a method on a scene, over its runs."""
    error, over_sigma, ok, settled, counted, asked, steady = (
        np.concatenate([getattr(run, name) for run in runs])
        for name in ("error", "over_sigma", "ok", "settled", "counted", "asked", "steady")
    )
    squares = [run.bound_square for run in runs if run.bound_square == run.bound_square]
    # Without a line no answer has an error: every answer is false
    lined = SCENES[scene].lined
    found, told = error[counted & lined], ok & lined
    return Row(
        scene,
        method,
        METHODS[method].kind,
        answered=_share(ok, asked),
        asked=_share(asked, counted),
        claimed=float(np.mean([(run.ok & run.counted).any() for run in runs])),
        false=_share(error > WRONG, ok & ~steady),
        false_steady=_share(error > WRONG, ok & steady),
        false_settled=_share(error > WRONG, ok & settled),
        median=float(np.quantile(found, 0.5, method="lower")) if found.size else math.nan,
        over_5=float(np.mean(found > WRONG)) if found.size else math.nan,
        rms=math.sqrt(np.mean(np.minimum(error[told], 1) ** 2)) if told.any() else math.nan,
        covered=_share(over_sigma <= 2, told),
        over_sigma=math.sqrt(np.mean(over_sigma[told] ** 2)) if told.any() else math.nan,
        over_bound=math.sqrt(np.mean(squares)) if squares else math.nan,
        first_right_s=float(np.quantile([run.first_right_s for run in runs], 0.5, method="lower")),
        us=float(np.median([run.us for run in runs])),
        runs=len(runs),
    )


def _share(what, among) -> float:
    return float(np.mean(what[among])) if among.any() else math.nan


def faults(row: Row, others: Sequence[Row]) -> tuple[str, ...]:
    """The missed targets of a row of papilla's pipeline; `others` are the other methods on the same scene."""
    missed = (case for case in targets(row, others) if not math.isnan(case.value or 0.0) and not case.passed)
    return tuple(
        f"{case.what} {PER_CENT * (case.value or 0):.3g} > {PER_CENT * case.interval[1]:.2g} %" for case in missed
    )


def targets(row: Row, others: Sequence[Row]) -> list[Case]:
    """The shares and errors of a row of the pipeline that have a target, with the target; NaN if there is no such
    row."""
    if row.kind != PRODUCT:
        return []
    scene = SCENES[row.scene]
    if not scene.lined:
        return [Case("runs with an answer", "no line is there", row.claimed, MOST_RUNS_CLAIMED)]
    other_methods = [other for other in others if other.kind == RIVAL]
    wanted = [
        Case("false", "share of ok rows", row.false, MOST_FALSE),
        Case("false at a constant speed", "share of ok rows", row.false_steady, MOST_FALSE),
        Case("false when settled", "share of ok rows", row.false_settled, MOST_FALSE_SETTLED),
        Case("outside two sigma", "share of ok rows", 1 - row.covered, 1 - LEAST_COVERED),
    ]
    spectra = [other for other in other_methods if other.method in ("STFT over the path", "periodogram")]
    # A spectrum takes hum for the surface, and the scene states where the two can be distinguished.
    if scene.hums or any(other.over_5 <= TRUSTED for other in spectra):
        wanted.append(Case("unanswered", "a spectrum is right here", 1 - row.answered, 1 - LEAST_ANSWERED))
    for name, least in (("median", 0.0), ("over_5", MOST_FALSE_SETTLED)) if other_methods else ():
        best = min(getattr(other, name) for other in other_methods)
        allowed = max(BESIDE_BEST * best, least)
        wanted.append(Case(name.replace("_5", " 5 %"), "against the best other method", getattr(row, name), allowed))
    return wanted
