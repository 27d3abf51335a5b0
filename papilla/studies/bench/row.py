"""`BenchRow`: one row of the bench: the cost of a fidelity on a mesh, and its difference from the finest mesh."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

ANSWERED = "answered"
"""Status of a fidelity that answered all presses."""

HIDDEN = ("seconds_scenes", "stages", "answers")
"""Fields from which rows are made, and which their JSON does not contain."""


@dataclass(frozen=True, eq=False)
class BenchRow:
    """What a fidelity with one element on one mesh costs, and its errors: fractions, the worst over `forces_gf`.

    fidelity, element, size_mm : what is measured.
    dofs : unknowns factorised (clamped and mirrored ones removed); patch_nodes : of the reduced finger.
    factor_nonzeros : entries of the factor.
    stages : seconds of basis, assembly, factorisation and reduction, the mesh being cached; seconds_setup is their sum.
    seconds_per_scene : median; seconds_scenes : the 1000 scenes of a sweep; seconds_thousand : with the set-up.
    peak_memory_MiB : of the process that did nothing else.
    answers : (3, forces) of `papilla.studies.bench.scenes.QUANTITIES` at `forces_gf`.
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
    status: str = ANSWERED
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
        shown = {name: value for name, value in vars(self).items() if name not in HIDDEN}
        return shown | {"seconds_setup": self.seconds_setup, "seconds_thousand": self.seconds_thousand}

    def against(self, other: "BenchRow", linear: "BenchRow | None" = None) -> "BenchRow":
        """The row with its errors against another; `linear` is fidelity contact on the mesh of a finite row."""
        errors: dict[str, Any] = dict(
            zip(("error_sd", "error_indentation", "error_area"), worst(self, other), strict=True)
        )
        if linear is not None:
            errors |= zip(("small_strain_sd", "small_strain_indentation"), worst(linear, self)[:2], strict=True)
        return replace(self, **errors, reference_size_mm=other.size_mm, reference=self is other)


def worst(row: BenchRow, against: BenchRow) -> list[float]:
    """Largest relative differences (3) of the answers over the forces that both have."""
    mine, theirs = (dict(zip(one.forces_gf, one.answers.T, strict=True)) for one in (row, against))
    return np.max([np.abs(mine[gf] / theirs[gf] - 1) for gf in mine.keys() & theirs.keys()], axis=0).tolist()


def with_front(rows: list[BenchRow]) -> list[BenchRow]:
    """The rows, those on the Pareto front of seconds and error marked."""
    linear = [row for row in rows if row.fidelity != "finite" and not row.reference and row.status == ANSWERED]
    front = pareto_front(np.array([row.seconds_thousand for row in linear]), np.array([row.error_sd for row in linear]))
    best = [row for row, keeps in zip(linear, front, strict=True) if keeps]
    return [replace(row, pareto=any(row is one for one in best)) for row in rows]


def pareto_front(seconds: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Mask (n,) of the entries that no other beats in one of seconds and error without losing in the other."""
    cheaper = (seconds[:, None] <= seconds) & (error[:, None] <= error)
    strictly = (seconds[:, None] < seconds) | (error[:, None] < error)
    return np.asarray(~(cheaper & strictly).any(axis=0))
