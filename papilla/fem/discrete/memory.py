"""Refuses a model that would not fit into memory, before it is assembled: `papilla.mesh.memory` has the law.

The law looks ahead over the whole job. Each factorisation is checked once more by itself, against what the solver's
symbolic analysis says of it (`papilla.fem.discrete.solver`).
"""

from collections.abc import Callable
from functools import partial

from papilla.fem.discrete.space import Space
from papilla.memory import refuse_beyond
from papilla.mesh.memory import coarser, finite_bytes, reduction_bytes


def refuse_reduction(space: Space, columns: int, parities: int) -> None:
    """Raise `MemoryEstimateError` where condensing to `columns` patch nodes, with so many parities to factor, would
    not fit; with none to factor there is nothing to refuse."""
    if parities:
        times = f"{parities} times " if parities > 1 else ""
        _refuse(space, columns, f"factorising {times}", partial(reduction_bytes, parities=parities))


def refuse_finite(space: Space, columns: int) -> None:
    """Raise `MemoryEstimateError` where a press at finite strain with `columns` patch nodes would not fit."""
    _refuse(space, columns, "pressing at finite strain ", finite_bytes)


def _refuse(space: Space, columns: int, job: str, law: Callable[..., float]) -> None:
    cells, unknowns, size = len(space.mesh.tets), space.unknowns, space.mesh.size_mm

    def needed(ratio: float) -> float:
        return law(cells / ratio**3, unknowns / ratio**3, columns / ratio**2)

    what = f"{job}a mesh of {cells:,} tetrahedra ({unknowns:,} unknowns, size_mm {size:g})"
    refuse_beyond(needed(1), what, lambda free: coarser(size, needed, free))
