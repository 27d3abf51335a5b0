"""One element on one mesh, measured in a separate process: seconds, peak memory and answers of its fidelities.

`BenchRow` is the result: the cost of a fidelity on a mesh, and its difference from the finest mesh. Its presses are
those whose errors are measured, and the thousand that a calibration needs.
"""

import math
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np

from papilla import mesh as meshes
from papilla.core.errors import ContactRangeError, PapillaError
from papilla.core.outside import read_text
from papilla.core.units import gf_to_newton
from papilla.core.workers import Processes
from papilla.fem import FingerModel, ReducedFinger, press, press_finite
from papilla.fem.discrete.elements import DEFAULT_ELEMENT, SYMMETRIC_PARITY, TaylorHood
from papilla.model.finger import Finger
from papilla.model.specimen import THICKNESS_MM, Block

STATUS_ANSWERED = "answered"
"""Status of a fidelity that answered all presses."""

HIDDEN_FIELDS = ("seconds_scenes", "stages", "answers")
"""Fields from which rows are made, and which their JSON does not contain."""

MIB_BYTES, SWEEP_SCENES = 2**20, 1000
"""Bytes of a MiB, and the scenes of a sweep."""

MOST_REPEATS, ENOUGH_S = 3, 6.0
"""Largest number of repetitions of a set-up, and the time after which they end; the fastest counts, because it is
disturbed least."""

SWEEP_SPECIMEN = Block(0.51, THICKNESS_MM)
"""The specimen of a sweep, of the middle published modulus (MPa, mm)."""

FORCES_GF = (10, 15, 20, 30, 50, 70, 100)
"""Forces at which the linear fidelities are compared."""

FINITE_FORCES_GF = (10, 30, 100)
"""Forces at which fidelity finite is compared; one press takes seconds."""

COMPARED_QUANTITIES = ("sd", "indentation", "contact_area")

DRAWN_MODULI_MPA, DRAWN_GF = (0.05, 0.72), (5.0, 100.0)
"""Ranges of moduli (MPa), log-uniform, and forces (gf), uniform, from which presses are drawn."""


@dataclass(frozen=True, eq=False)
class BenchRow:
    """What a fidelity with one element on one mesh costs, and its errors: fractions, the worst over `forces_gf`.

    fidelity, element, size_mm : what is measured.
    dofs : unknowns factorised (clamped and mirrored ones removed); patch_nodes : of the reduced finger.
    factor_nonzeros : entries of the factor.
    stages : seconds of basis, assembly, factorisation and reduction, the mesh being cached; seconds_setup is their sum.
    seconds_per_scene : median; seconds_scenes : the 1000 scenes of a sweep; seconds_thousand : with the set-up.
    peak_memory_MiB : of the process that did nothing else.
    answers : (3, forces) of `papilla.cli.speed.scenes.QUANTITIES` at `forces_gf`.
    status : "answered", or why the fidelity refused; seconds of scenes and errors are then NaN.
    error_sd, error_indentation, error_area : of S_d, indentation and contact area of a block of 0.51 MPa and 10 mm,
        against the same on a mesh of `reference_size_mm`. Linear fidelities are compared with contact by Taylor-Hood,
        finite with finite: its errors are those of its mesh. 0 where `reference` is true, by definition.
    small_strain_sd, small_strain_indentation : finite against contact by Taylor-Hood on its own mesh, which is what
        small-strain theory costs; None for the other fidelities.
    pareto : whether no other row is both cheaper (seconds_thousand) and better (error_sd); finite, whose errors mean
        something else, and the reference take no part.
    None stands where a fidelity has no such thing.
    """

    fidelity: str
    element: str
    size_mm: float
    forces_gf: tuple[float, ...]
    dofs: int
    patch_nodes: int | None
    factor_nonzeros: int | None
    stages: dict[str, float]
    seconds_per_scene: float
    seconds_scenes: float
    peak_memory_MiB: float
    answers: np.ndarray
    status: str = STATUS_ANSWERED
    error_sd: float = math.nan
    error_indentation: float = math.nan
    error_area: float = math.nan
    reference_size_mm: float = math.nan
    reference: bool = False
    small_strain_sd: float | None = None
    small_strain_indentation: float | None = None
    pareto: bool = False

    @property
    def seconds_setup(self) -> float:
        """Basis, assembly, factorisation and reduction."""
        return sum(self.stages.values())

    @property
    def seconds_thousand(self) -> float:
        """Set-up and the 1000 scenes of a sweep together."""
        return self.seconds_setup + self.seconds_scenes

    def to_json(self) -> dict:
        """The documented keys, as plain values."""
        public = {name: value for name, value in vars(self).items() if name not in HIDDEN_FIELDS}
        return public | {"seconds_setup": self.seconds_setup, "seconds_thousand": self.seconds_thousand}

    def against(self, finest: "BenchRow", linear: "BenchRow | None" = None) -> "BenchRow":
        """The row with its errors against another; `linear` is fidelity contact on the mesh of a finite row."""
        errors: dict[str, Any] = {}
        errors |= zip(("error_sd", "error_indentation", "error_area"), worst(self, finest), strict=True)
        if linear is not None:
            errors |= zip(("small_strain_sd", "small_strain_indentation"), worst(linear, self)[:2], strict=True)
        return replace(self, **errors, reference_size_mm=finest.size_mm, reference=self is finest)


def worst(measured_row: BenchRow, against: BenchRow) -> list[float]:
    """Largest relative differences (3) of the answers over the forces that both have."""
    mine, theirs = (
        dict(zip(measured.forces_gf, measured.answers.T, strict=True)) for measured in (measured_row, against)
    )
    return np.max([np.abs(mine[gf] / theirs[gf] - 1) for gf in mine.keys() & theirs.keys()], axis=0).tolist()


def measure_apart(*job: Any) -> list[BenchRow]:
    """`measure` in a fresh process. The mesh must be in the cache, or the peak memory would include the mesher."""
    with Processes(1) as pool:
        return pool.submit(measure, *job).result()


def measure(
    finger: Finger, size_mm: float, element: str | None, forces_gf: tuple[float, ...] = FORCES_GF
) -> list[BenchRow]:
    """Measure hertz and contact of an element in this process; without `element` fidelity finite, in which every press
    assembles and factorises again. Rows have no errors yet."""
    mesh = meshes.build(finger, size_mm=size_mm)
    if element is None:
        seconds: list[float] = []

        def push(force: float):
            presses = press_finite(finger, mesh, SWEEP_SPECIMEN, force=force)
            seconds.append(presses.seconds)
            return presses

        values, status = _answers(push, forces_gf)
        median = float(np.median(seconds)) if status == STATUS_ANSWERED else np.nan
        dofs = int(TaylorHood(mesh.cell()).free(SYMMETRIC_PARITY, mesh.mirrors).sum())
        return [BenchRow("finite", DEFAULT_ELEMENT, size_mm, forces_gf, dofs, None, None, {},
                         median, SWEEP_SCENES * median, peak_memory_MiB(), values, status)]  # fmt: skip
    model, reduced, stages = set_up(finger, mesh, element)
    presses: dict[str, dict[str, Any]] = {}
    for fidelity in ("hertz", "contact"):

        def pressed(force: float, pressed_by: str = fidelity):
            return press(reduced, SWEEP_SPECIMEN, force=force, fidelity=pressed_by)

        values, status = _answers(pressed, forces_gf)
        total = median = np.nan
        if status == STATUS_ANSWERED:
            try:
                total, median = thousand(reduced, fidelity)
            except ContactRangeError as error:
                status = f"refused in part: {error}"
        presses[fidelity] = {"seconds_per_scene": median, "seconds_scenes": total, "answers": values, "status": status}
        presses[fidelity]["peak_memory_MiB"] = peak_memory_MiB()
    free, factor = model.factor()
    common: dict[str, Any] = {"dofs": int(free.sum()), "factor_nonzeros": factor.nonzeros}
    common |= {"element": element, "size_mm": size_mm, "forces_gf": forces_gf}
    del model, factor
    runs = [stages]
    while len(runs) < MOST_REPEATS and sum(sum(run.values()) for run in runs) < ENOUGH_S:
        runs.append(set_up(finger, mesh, element)[2])
    common |= {"patch_nodes": len(reduced.patch.xy), "stages": min(runs, key=lambda run: sum(run.values()))}
    return [BenchRow(fidelity, **common, **presses_of) for fidelity, presses_of in presses.items()]


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
        result = step()
        clock.append(perf_counter())
    return model, result, dict(zip(steps, np.diff(clock).tolist(), strict=True))


def peak_memory_MiB() -> float:
    """Largest resident size of this process so far."""
    status = Path("/proc/self/status")
    if status.exists():
        # ru_maxrss would include the memory of the parent at the start of this process
        line = next(line for line in read_text(status).splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) * 1024 / MIB_BYTES
    if os.name == "nt":
        return float("nan")
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / MIB_BYTES if sys.platform == "darwin" else peak * 1024 / MIB_BYTES


def answers(pressed: Callable[[float], object], forces_gf: tuple[float, ...], names=COMPARED_QUANTITIES) -> np.ndarray:
    """S_d in microstrain, indentation in mm and contact area in mm2 from `pressed` at each force: (3, forces); or other
    quantities by their `names`."""
    presses = [pressed(gf_to_newton(gf)) for gf in forces_gf]
    return np.array([[getattr(scene, name) for scene in presses] for name in names])


def drawn(reduced: ReducedFinger, count: int, seed: int = 0, **how) -> list[float]:
    """Processor seconds of each of `count` scenes, each with its own modulus and force; `how` : further arguments of
    `press`."""
    rng, seconds = np.random.default_rng(seed), []
    moduli = DRAWN_MODULI_MPA[0] * (DRAWN_MODULI_MPA[1] / DRAWN_MODULI_MPA[0]) ** rng.uniform(size=count)
    for modulus, force_gf in zip(moduli, rng.uniform(*DRAWN_GF, count), strict=True):
        specimen = Block(float(modulus), SWEEP_SPECIMEN.thickness)
        began = process_time()
        press(reduced, specimen, force=float(gf_to_newton(force_gf)), **how)
        seconds.append(process_time() - began)
    return seconds


def _answers(pressed, forces_gf: tuple[float, ...]) -> tuple[np.ndarray, str]:
    """Answers (3, forces) and the status; NaN and the reason if the fidelity refuses."""
    try:
        return answers(pressed, forces_gf), STATUS_ANSWERED
    except PapillaError as error:
        return np.full((len(COMPARED_QUANTITIES), len(forces_gf)), np.nan), f"refused: {error}"


def thousand(reduced: ReducedFinger, fidelity: str) -> tuple[float, float]:
    """Seconds of a thousand drawn scenes, and the median of one."""
    began = perf_counter()
    seconds = drawn(reduced, SWEEP_SCENES, fidelity=fidelity)
    return perf_counter() - began, float(np.median(seconds))
