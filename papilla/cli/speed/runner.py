"""Runs the bench: each fidelity, element and mesh in its own process, one after the other; then the conclusions."""

import os
from dataclasses import dataclass, replace

import numpy as np

from papilla import mesh as meshes
from papilla.cli.speed.measure import FINITE_FORCES_GF, FORCES_GF, STATUS_ANSWERED, BenchRow, measure_apart
from papilla.core.errors import ContactRangeError
from papilla.core.progress import Progress, silent
from papilla.core.units import MS_PER_S, PER_CENT
from papilla.fem.discrete.elements import DEFAULT_ELEMENT, ELEMENTS_BY_NAME
from papilla.model.finger import Finger


@dataclass(frozen=True)
class Plan:
    """What is measured: element sizes (mm) of the linear fidelities and of finite, the last of each their reference.

    other_sizes_mm are those of P1 and P2; default_mm is the mesh whose stages are reported.
    """

    sizes_mm: tuple[float, ...]
    other_sizes_mm: tuple[float, ...]
    default_mm: float
    finite_sizes_mm: tuple[float, ...]
    finite_forces_gf: tuple[float, ...] = FINITE_FORCES_GF


FULL_PLAN = Plan((2.0, 1.4, 1.0, 0.7, 0.35), (2.0, 1.4, 1.0, 0.7), meshes.DEFAULT_SIZE_MM, (2.0, 1.4, 1.0, 0.7))

SHORT_PLAN = Plan((2.8, 2.0, meshes.DEFAULT_SIZE_MM), (2.8,), 2.8, (2.8, 2.0), (100,))
"""Coarse meshes, compared with the shipped one."""


@dataclass(frozen=True)
class SpeedBench:
    """All rows of the bench; `default` is the row of the default mesh."""

    finger_name: str
    rows: tuple[BenchRow, ...]
    default: BenchRow
    cores: int

    def to_json(self) -> dict:
        """The bench as plain values, with the documented keys of `papilla bench --json`.

        `profile` has the stages of the default row.
        """
        contact = max((row for row in self.rows if row.fidelity == "contact"), key=lambda row: row.patch_nodes or 0)
        return {
            "finger": self.finger_name,
            "cores": self.cores,
            "rows": [row.to_json() for row in self.rows],
            "profile": {"size_mm": self.default.size_mm, "seconds": self.default.stages},
            "largest_contact": {"patch_nodes": contact.patch_nodes, "seconds_per_scene": contact.seconds_per_scene},
        }

    def sentences(self) -> list[str]:
        """The conclusions from the rows, in words."""
        default = self.default
        stages = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in default.stages.items())
        largest = self.to_json()["largest_contact"]
        contact_ms = MS_PER_S * largest["seconds_per_scene"]
        sentences = [
            f"set-up of {default.element} on {default.size_mm:g} mm: {stages}",
            f"a contact scene at {largest['patch_nodes']} patch nodes: {contact_ms:.2f} ms",
        ]
        refused = [row for row in self.rows if row.status != STATUS_ANSWERED]
        sentences += [f"{row.fidelity}, {row.element}, {row.size_mm:g} mm {row.status}" for row in refused]
        finite = [row for row in self.rows if row.small_strain_sd is not None and row.status == STATUS_ANSWERED]
        if finite:
            finest = min(finite, key=lambda row: row.size_mm)
            forces = ", ".join(f"{gf:g}" for gf in finest.forces_gf)
            sentences.append(
                f"small strain costs up to {PER_CENT * (finest.small_strain_sd or 0):.1f} % in S_d and "
                f"{PER_CENT * (finest.small_strain_indentation or 0):.1f} % in indentation at {forces} gf: "
                "fidelity contact against fidelity finite on one mesh; rows do not count it"
            )
        return sentences


def bench(finger: Finger, plan: Plan = FULL_PLAN, *, progress: Progress = silent) -> SpeedBench:
    """Measure fidelities, elements and meshes of a finger, each in a process of its own, one after the other.

    `progress` is called with a line of text for each stage. Raises what meshing and presses raise.
    """
    jobs: list[tuple[float, str | None, tuple[float, ...]]] = [
        (size, element, FORCES_GF)
        for element in ELEMENTS_BY_NAME
        for size in (plan.sizes_mm if element == DEFAULT_ELEMENT else plan.other_sizes_mm)
    ]
    jobs += [(size, None, plan.finite_forces_gf) for size in plan.finite_sizes_mm]
    for size in sorted({size for size, *_ in jobs}, reverse=True):
        progress(f"mesh of {size:g} mm")
        meshes.build(finger, size_mm=size, progress=progress)
    measured: dict[tuple[str, str, float], BenchRow] = {}
    for number, (size, element, forces_gf) in enumerate(jobs, 1):
        progress(f"{number} of {len(jobs)}: {element or 'fidelity finite'} on {size:g} mm")
        for bench_row in measure_apart(finger, size, element, forces_gf):
            measured[bench_row.fidelity, bench_row.element, bench_row.size_mm] = bench_row
    truth = measured["contact", DEFAULT_ELEMENT, plan.sizes_mm[-1]]
    if truth.status != STATUS_ANSWERED:
        raise ContactRangeError(f"the finest mesh, which all others are compared with, gives no answer: {truth.status}")
    rows = {}
    for (fidelity, element, size), bench_row in measured.items():
        finest, linear = truth, None
        if fidelity == "finite":
            finest, linear = measured[fidelity, element, plan.finite_sizes_mm[-1]], measured["contact", element, size]
        rows[fidelity, element, size] = bench_row.against(finest, linear)
    marked = dict(zip(rows, with_front(list(rows.values())), strict=True))
    default = marked["contact", DEFAULT_ELEMENT, plan.default_mm]
    return SpeedBench(finger.name, tuple(marked.values()), default, os.cpu_count() or 1)


def with_front(rows: list[BenchRow]) -> list[BenchRow]:
    """The rows, those on the Pareto front of seconds and error marked."""
    linear = [row for row in rows if row.fidelity != "finite" and not row.reference and row.status == STATUS_ANSWERED]
    front = pareto_front(np.array([row.seconds_thousand for row in linear]), np.array([row.error_sd for row in linear]))
    best = [row for row, keeps in zip(linear, front, strict=True) if keeps]
    return [replace(row, pareto=any(row is best_row for best_row in best)) for row in rows]


def pareto_front(seconds: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Mask (n,) of the entries that no other beats in one of seconds and error without losing in the other."""
    cheaper = (seconds[:, None] <= seconds) & (error[:, None] <= error)
    strictly = (seconds[:, None] < seconds) | (error[:, None] < error)
    return np.asarray(~(cheaper & strictly).any(axis=0))
