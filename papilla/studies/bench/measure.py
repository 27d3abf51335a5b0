"""One element on one mesh, measured in a separate process: seconds, peak memory and answers of its fidelities."""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from papilla import mesh as meshes
from papilla.errors import ContactRangeError, PapillaError
from papilla.fem import FingerModel, ReducedFinger, press, press_finite
from papilla.fem.discrete.elements import DEFAULT_ELEMENT, SYMMETRIC, TaylorHood
from papilla.finger import Finger
from papilla.studies.bench.row import ANSWERED, BenchRow
from papilla.studies.bench.scenes import FORCES_GF, QUANTITIES, SPECIMEN, answers, thousand
from papilla.units import MS_PER_S

REPEATS, ENOUGH_S = 3, 6.0
"""Largest number of repetitions of a set-up, and the time after which they end; the fastest counts, because it is
disturbed least."""

MIB = 2**20


@dataclass(frozen=True)
class Job:
    """A measurement in a process: the linear fidelities of `element`, or fidelity finite if `element` is None."""

    finger: Finger
    size_mm: float
    element: str | None
    forces_gf: tuple[float, ...] = FORCES_GF


def measure_apart(job: Job) -> list[BenchRow]:
    """Measure a job in a fresh process. Its mesh must be in the cache, or the peak memory would include the mesher."""
    with ProcessPoolExecutor(max_workers=1, mp_context=get_context("spawn")) as pool:
        return pool.submit(measure, job).result()


def measure(job: Job) -> list[BenchRow]:
    """Measure a job in this process: hertz and contact of an element, or fidelity finite, in which every press
    assembles and factorises again. Rows have no errors yet."""
    mesh = meshes.build(job.finger, size_mm=job.size_mm)
    if job.element is None:
        seconds: list[float] = []

        def push(force: float):
            found = press_finite(job.finger, mesh, SPECIMEN, force=force)
            seconds.append(found.seconds)
            return found

        values, status = _answers(push, job)
        median = float(np.median(seconds)) if status == ANSWERED else np.nan
        dofs = int(TaylorHood(mesh.cell()).free(SYMMETRIC, mesh.mirrors).sum())
        return [BenchRow("finite", DEFAULT_ELEMENT, job.size_mm, job.forces_gf, dofs, None, None, {},
                         median, MS_PER_S * median, peak_memory_MiB(), values, status)]  # fmt: skip
    model, reduced, stages = set_up(job.finger, mesh, job.element)
    found: dict[str, dict[str, Any]] = {}
    for fidelity in ("hertz", "contact"):
        values, status = _answers(lambda force, own=fidelity: press(reduced, SPECIMEN, force=force, fidelity=own), job)
        total = median = np.nan
        if status == ANSWERED:
            try:
                total, median = thousand(reduced, fidelity)
            except ContactRangeError as error:
                status = f"refused in part: {error}"
        found[fidelity] = {"seconds_per_scene": median, "seconds_scenes": total, "answers": values, "status": status}
        found[fidelity]["peak_memory_MiB"] = peak_memory_MiB()
    free, factor = model.factor()
    common: dict[str, Any] = {"dofs": int(free.sum()), "factor_nonzeros": factor.nonzeros}
    common |= {"element": job.element, "size_mm": job.size_mm, "forces_gf": job.forces_gf}
    del model, factor
    runs = [stages]
    while len(runs) < REPEATS and sum(sum(run.values()) for run in runs) < ENOUGH_S:
        runs.append(set_up(job.finger, mesh, job.element)[2])
    common |= {"patch_nodes": len(reduced.patch.xy), "stages": min(runs, key=lambda run: sum(run.values()))}
    return [BenchRow(fidelity, **common, **own) for fidelity, own in found.items()]


def set_up(finger: Finger, mesh, element: str = DEFAULT_ELEMENT) -> tuple[FingerModel, ReducedFinger, dict[str, float]]:
    """A model and its reduced finger, and the seconds of each stage."""
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
        # ru_maxrss would include the memory of the parent at the start of this process
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) * 1024 / MIB
    if os.name == "nt":
        return float("nan")
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / MIB if sys.platform == "darwin" else peak * 1024 / MIB


def _answers(push, job: Job) -> tuple[np.ndarray, str]:
    """Answers (3, forces) and the status; NaN and the reason if the fidelity refuses."""
    try:
        return answers(push, job.forces_gf), ANSWERED
    except PapillaError as error:
        return np.full((len(QUANTITIES), len(job.forces_gf)), np.nan), f"refused: {error}"
