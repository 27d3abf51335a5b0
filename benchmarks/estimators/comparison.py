"""The comparison: every method on every scene, judged by its share of answers, of false ones, and by its sigma.

A row is false if the method says "ok" and its error is more than 5 %, or if there is no line at all.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.estimators.methods import LONG_MM, METHODS, PRODUCT, PUBLISHED, RIVAL, Answer, chosen
from papilla.core import settings
from papilla.core.errors import InputError
from papilla.core.progress import CountedStep, Progress, silent
from papilla.core.units import PER_CENT, US_PER_S
from papilla.scenes.scenes import FIRST_CLAIM_SEED, SCENES_BY_NAME, WAVELENGTHS_MM, Scene, scene
from papilla.verify.case import Case
from papilla.verify.jobs import run_jobs

GIVEN = settings.parameters(__name__)


@dataclass(frozen=True)
class Run:
    """One method on one scene: relative errors (n,) (inf without an answer), errors over sigma, and rows that are ok,
    settled, counted (on 12 mm of path since the surface began), and those of them at which an answer may be asked
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
    recipe = SCENES_BY_NAME[made.name]
    changes = np.flatnonzero(np.diff(made.wavelength_mm, prepend=math.nan) != 0) if recipe.lined else np.array([0])
    began = changes[np.searchsorted(changes, np.arange(made.time_s.size), side="right") - 1]
    since_s, since_mm = (column - column[began] for column in (made.time_s, made.travelled_mm))
    off = [np.abs(answer.wavelength_mm - right) for right in (made.wavelength_mm, *made.others_mm)]
    nearest = np.nan_to_num(np.fmin.reduce(off), nan=math.inf)
    error = nearest / np.nan_to_num(made.wavelength_mm, nan=1.0)
    right = np.flatnonzero((answer.ok & (error <= GIVEN.wrong))[changes[-1] :])
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
    settled = (since_s > GIVEN.settled_s) & (since_mm > GIVEN.settled_periods * np.nan_to_num(made.wavelength_mm))
    first = right[0] / made.sample_rate_Hz if right.size else math.inf
    counted = since_mm > GIVEN.from_mm
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
    lined = SCENES_BY_NAME[scene].lined
    found, told = error[counted & lined], ok & lined
    return Row(
        scene,
        method,
        METHODS[method].kind,
        answered=_share(ok, asked),
        asked=_share(asked, counted),
        claimed=float(np.mean([(run.ok & run.counted).any() for run in runs])),
        false=_share(error > GIVEN.wrong, ok & ~steady),
        false_steady=_share(error > GIVEN.wrong, ok & steady),
        false_settled=_share(error > GIVEN.wrong, ok & settled),
        median=float(np.quantile(found, 0.5, method="lower")) if found.size else math.nan,
        over_5=float(np.mean(found > GIVEN.wrong)) if found.size else math.nan,
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
    scene = SCENES_BY_NAME[row.scene]
    if not scene.lined:
        return [Case("runs with an answer", "no line is there", row.claimed, GIVEN.most_runs_claimed)]
    other_methods = [other for other in others if other.kind == RIVAL]
    wanted = [
        Case("false", "share of ok rows", row.false, GIVEN.most_false),
        Case("false at a constant speed", "share of ok rows", row.false_steady, GIVEN.most_false),
        Case("false when settled", "share of ok rows", row.false_settled, GIVEN.most_false_settled),
        Case("outside two sigma", "share of ok rows", 1 - row.covered, 1 - GIVEN.least_covered),
    ]
    spectra = [other for other in other_methods if other.method in ("STFT over the path", "periodogram")]
    # A spectrum takes hum for the surface, and the scene states where the two can be distinguished.
    if scene.hums or any(other.over_5 <= GIVEN.trusted for other in spectra):
        wanted.append(Case("unanswered", "a spectrum is right here", 1 - row.answered, 1 - GIVEN.least_answered))
    for name, least in (("median", 0.0), ("over_5", GIVEN.most_false_settled)) if other_methods else ():
        best = min(getattr(other, name) for other in other_methods)
        allowed = max(GIVEN.beside_best * best, least)
        wanted.append(Case(name.replace("_5", " 5 %"), "against the best other method", getattr(row, name), allowed))
    return wanted


@dataclass(frozen=True)
class Plan:
    """The size of a comparison.

    scenes, methods : parts of their names, none for all. seeds : one run each; from `CLAIMS` on parameters are drawn.
    longest_s : scenes at more than 1 mm/s are cut to it. snr_dB : texture over the noise of a sample.
    Raises `InputError` for no seeds.
    """

    scenes: tuple[str, ...] = ()
    methods: tuple[str, ...] = ()
    seeds: tuple[int, ...] = tuple(range(FIRST_CLAIM_SEED, FIRST_CLAIM_SEED + 8))
    longest_s: float = 4.0
    snr_dB: float = 20.0

    def __post_init__(self):
        if not self.seeds:
            raise InputError("seeds must hold at least one seed, got none")


LONG = Plan()
SHORT = Plan(
    methods=tuple(name for name, method in METHODS.items() if method.kind != PUBLISHED and name != "MUSIC"),
    seeds=(FIRST_CLAIM_SEED,),
    longest_s=2.5,
)
"""For quick runs and tests: one run per scene is not enough for a verdict."""


def wavelength_of(seed: int) -> float:
    """The wavelength of a run in mm: one of five for tuning, any of 0.6-3.0 for claims."""
    if seed < FIRST_CLAIM_SEED:
        return WAVELENGTHS_MM[seed % len(WAVELENGTHS_MM)]
    low, high = WAVELENGTHS_MM[0], WAVELENGTHS_MM[-1]
    # Not the scene's own random numbers: its first draw is the speed, and the two would be correlated.
    return low * (high / low) ** float(np.random.default_rng([seed, 1]).uniform())


def runs_of(name: str, seed: int, methods: Sequence[str], plan: Plan, progress: Progress) -> list[Run]:
    """One run of each method on a scene."""
    recipe = SCENES_BY_NAME[name]
    seconds = recipe.seconds if "slow" in name else min(recipe.seconds, plan.longest_s)
    made = scene(
        name, wavelength_of(seed), snr_dB=plan.snr_dB, seed=seed, seconds=seconds, drawn=seed >= FIRST_CLAIM_SEED
    )
    found = []
    for method in methods:
        began = time.perf_counter()
        answer = METHODS[method].run(made.time_s, made.readings, made.known_mm_s)
        us = US_PER_S * (time.perf_counter() - began) / made.time_s.size
        found.append(judged(made, answer, METHODS[method].path_mm, us))
    return found


def compare(plan: Plan = LONG, *, workers: int = 1, progress: Progress = silent) -> tuple[Row, ...]:
    """A row for each scene and method of the plan, on `workers` processes; raises `InputError` for unknown names."""
    names, methods = chosen("scene", plan.scenes, SCENES_BY_NAME), chosen("estimator", plan.methods, METHODS)
    jobs = {f"{name}, seed {seed}": (name, seed, methods, plan) for name in names for seed in plan.seeds}
    results = []
    for _, found in run_jobs(runs_of, jobs, processes=workers):
        results.append(found)
        progress(CountedStep("scenes", len(results), len(jobs)))
    rows: list[Row] = []
    for number, name in enumerate(names):
        own = results[number * len(plan.seeds) : (number + 1) * len(plan.seeds)]
        here = [row_of(name, method, runs) for method, runs in zip(methods, zip(*own, strict=True), strict=True)]
        rows += [replace(row, faults=faults(row, here)) for row in here]
    return tuple(rows)
