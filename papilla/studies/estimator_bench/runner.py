"""The comparison: every method on every scene, in as many processes as requested."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from papilla.errors import InputError
from papilla.studies.estimator_bench.honesty import Row, Run, faults, judged, row_of
from papilla.studies.estimator_bench.methods import METHODS, PUBLISHED, chosen
from papilla.studies.estimator_bench.scenes import CLAIMS, SCENES, WAVELENGTHS_MM, scene
from papilla.studies.runner import run_jobs
from papilla.units import US_PER_S


@dataclass(frozen=True)
class Plan:
    """The size of a comparison.

    scenes, methods : parts of their names, none for all. seeds : one run each; from `CLAIMS` on parameters are drawn.
    longest_s : scenes at more than 1 mm/s are cut to it. snr_dB : texture over the noise of a sample.
    Raises `InputError` for no seeds.
    """

    scenes: tuple[str, ...] = ()
    methods: tuple[str, ...] = ()
    seeds: tuple[int, ...] = tuple(range(CLAIMS, CLAIMS + 8))
    longest_s: float = 4.0
    snr_dB: float = 20.0

    def __post_init__(self):
        if not self.seeds:
            raise InputError("seeds must hold at least one seed, got none")


LONG = Plan()
SHORT = Plan(
    methods=tuple(name for name, method in METHODS.items() if method.kind != PUBLISHED and name != "MUSIC"),
    seeds=(CLAIMS,),
    longest_s=2.5,
)
"""For quick runs and tests: one run per scene is not enough for a verdict."""


def wavelength_of(seed: int) -> float:
    """The wavelength of a run in mm: one of five for tuning, any of 0.6-3.0 for claims."""
    if seed < CLAIMS:
        return WAVELENGTHS_MM[seed % len(WAVELENGTHS_MM)]
    low, high = WAVELENGTHS_MM[0], WAVELENGTHS_MM[-1]
    # Not the scene's own random numbers: its first draw is the speed, and the two would be correlated.
    return low * (high / low) ** float(np.random.default_rng([seed, 1]).uniform())


def runs_of(name: str, seed: int, methods: Sequence[str], plan: Plan, say: Callable[[str], None]) -> list[Run]:
    """One run of each method on a scene."""
    recipe = SCENES[name]
    seconds = recipe.seconds if "slow" in name else min(recipe.seconds, plan.longest_s)
    made = scene(name, wavelength_of(seed), snr_dB=plan.snr_dB, seed=seed, seconds=seconds, drawn=seed >= CLAIMS)
    found = []
    for method in methods:
        began = time.perf_counter()
        answer = METHODS[method].run(made.time_s, made.readings, made.known_mm_s)
        us = US_PER_S * (time.perf_counter() - began) / made.time_s.size
        found.append(judged(made, answer, METHODS[method].path_mm, us))
    return found


def compare(
    plan: Plan = LONG, *, workers: int = 1, progress: Callable[[int, int], None] = lambda done, total: None
) -> tuple[Row, ...]:
    """A row for each scene and method of the plan, on `workers` processes; raises `InputError` for unknown names."""
    names, methods = chosen("scene", plan.scenes, SCENES), chosen("estimator", plan.methods, METHODS)
    jobs = {f"{name}, seed {seed}": (name, seed, methods, plan) for name in names for seed in plan.seeds}
    results = []
    for _, found in run_jobs(runs_of, jobs, processes=workers):
        results.append(found)
        progress(len(results), len(jobs))
    rows: list[Row] = []
    for number, name in enumerate(names):
        own = results[number * len(plan.seeds) : (number + 1) * len(plan.seeds)]
        here = [row_of(name, method, runs) for method, runs in zip(methods, zip(*own, strict=True), strict=True)]
        rows += [replace(row, faults=faults(row, here)) for row in here]
    return tuple(rows)
