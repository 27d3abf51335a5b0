"""One element on one mesh, measured in a process of its own: seconds, peak memory and answers of its rungs."""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from time import perf_counter

import numpy as np

from papilla import mesh as meshes
from papilla.errors import PapillaError
from papilla.fem import FingerModel, ReducedFinger
from papilla.fem.discrete.solver import BATCH
from papilla.fem.discrete.space import SYMMETRIC
from papilla.fem.discrete.taylor_hood import TaylorHood
from papilla.finger import Finger
from papilla.studies.bench.limits import factor_flops
from papilla.studies.bench.scenes import FORCES_GF, QUANTITIES, answers, finite_answers, thousand

LINEAR_RUNGS = ("hertz", "contact")

REPEATS, ENOUGH_S = 3, 6.0
"""A set-up is repeated so often, or until this time is gone, and the fastest counts: the least disturbed."""

MIB = 2**20

ANSWERED = "answered"
"""Status of a rung that answered every scene."""


@dataclass(frozen=True)
class Job:
    """What a process measures: the linear rungs of `element`, or rung finite where `element` is None."""

    finger: Finger
    size_mm: float
    element: str | None
    forces_gf: tuple[float, ...] = FORCES_GF


@dataclass(frozen=True, eq=False)
class Measured:
    """What one rung of a job took and answered; None where it has no such thing.

    dofs, factor_nonzeros : unknowns that are factorised (clamped and mirrored ones removed), entries of their factor.
    factor_flops : operations that the factorisation takes.
    stages : seconds of basis, assembly, factorisation and reduction; their sum is the set-up.
    seconds_per_column : of one of the right-hand sides that the factor solves `BATCH` at once.
    seconds_per_scene : median; seconds_thousand : all scenes of a sweep.
    answers : (3, forces) of `papilla.studies.bench.scenes.QUANTITIES`.
    status : `ANSWERED`, or why the rung refused: seconds of scenes and answers are then NaN.
    """

    job: Job
    fidelity: str
    dofs: int
    patch_nodes: int | None
    factor_nonzeros: int | None
    factor_flops: float | None
    stages: dict[str, float]
    seconds_per_column: float | None
    seconds_per_scene: float
    seconds_thousand: float
    peak_memory_MiB: float
    answers: np.ndarray
    status: str


def measure_apart(job: Job) -> tuple[Measured, ...]:
    """Measure a job in a fresh process. Its mesh must be in the cache, or its making counts in the peak memory."""
    with ProcessPoolExecutor(max_workers=1, mp_context=get_context("spawn")) as pool:
        return pool.submit(measure, job).result()


def measure(job: Job) -> tuple[Measured, ...]:
    """Measure a job in this process: hertz and contact of an element, or rung finite."""
    mesh = meshes.build(job.finger, size_mm=job.size_mm)
    if job.element is None:
        return (_measure_finite(job, mesh),)
    model, reduced, stages = set_up(job.finger, mesh, job.element)
    found = {}
    for fidelity in LINEAR_RUNGS:
        try:
            outcome = (answers(reduced, fidelity, job.forces_gf), *thousand(reduced, fidelity), ANSWERED)
        except PapillaError as error:
            outcome = (_no_answers(job), np.nan, np.nan, f"refused: {error}")
        found[fidelity] = (*outcome, peak_memory_MiB())
    free, factor = model.factor()
    per_column = _seconds_per_column(factor)
    nonzeros, flops = factor.nonzeros, factor_flops(factor.matrix)
    del model, factor
    stages = _fastest_set_up(job, mesh, stages)
    return tuple(
        Measured(job, fidelity, int(free.sum()), len(reduced.patch.xy), nonzeros, flops, stages, per_column, median,
                 total, peak, values, status)
        for fidelity, (values, total, median, status, peak) in found.items()
    )  # fmt: skip


def set_up(finger: Finger, mesh, element: str) -> tuple[FingerModel, ReducedFinger, dict[str, float]]:
    """A model and its reduced finger, and the seconds of each stage on the way."""
    clock = [perf_counter()]
    model = FingerModel(finger, mesh, element)
    steps = {
        "basis": lambda: model.space.displacement,
        "assembly": lambda: model.matrix,
        "factorisation": model.factor,
        "reduction": model.reduce,
    }
    for step in steps.values():
        found = step()
        clock.append(perf_counter())
    return model, found, dict(zip(steps, np.diff(clock).tolist(), strict=True))


def peak_memory_MiB() -> float:
    """Largest resident size of this process so far."""
    status = Path("/proc/self/status")
    if status.exists():
        # ru_maxrss would include what the parent had when it started this process
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) * 1024 / MIB
    if os.name == "nt":
        return float("nan")
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / MIB if sys.platform == "darwin" else peak * 1024 / MIB


def _fastest_set_up(job: Job, mesh, first: dict[str, float]) -> dict[str, float]:
    runs = [first]
    while len(runs) < REPEATS and sum(sum(run.values()) for run in runs) < ENOUGH_S:
        runs.append(set_up(job.finger, mesh, str(job.element))[2])
    return min(runs, key=lambda run: sum(run.values()))


def _seconds_per_column(factor) -> float:
    rhs = np.random.default_rng(0).standard_normal((factor.matrix.shape[0], BATCH))
    clock = [perf_counter()]
    for _ in range(REPEATS):
        factor.solve(rhs)
        clock.append(perf_counter())
    return float(np.diff(clock).min()) / BATCH


def _measure_finite(job: Job, mesh) -> Measured:
    """Rung finite has no set-up of its own: every press assembles and factorises anew."""
    try:
        values, seconds = finite_answers(job.finger, mesh, job.forces_gf)
        status = ANSWERED
    except PapillaError as error:
        values, seconds, status = _no_answers(job), [np.nan], f"refused: {error}"
    peak, median = peak_memory_MiB(), float(np.median(seconds))
    dofs = int(TaylorHood(mesh.cell()).free(SYMMETRIC, mesh.mirrors).sum())
    return Measured(job, "finite", dofs, None, None, None, {}, None, median, 1000 * median, peak, values, status)


def _no_answers(job: Job) -> np.ndarray:
    return np.full((len(QUANTITIES), len(job.forces_gf)), np.nan)
