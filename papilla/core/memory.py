"""The memory that a computation on a mesh needs, and its refusal before it starts if more is needed than is free.

Where the system does not say how much is free, nothing is refused.

`FingerModel.reduce` condenses a cell of the mesh (the meshed quarter, or the whole) with c tetrahedra, n unknowns and k
patch nodes. With p parities (even and odd parts of a load) to factorise it needs, in bytes,

    OVERHEAD + ASSEMBLY c + p (FACTOR n^(4/3) + SCRATCH n) + PAIRS k^2.

n^(4/3) is the fill of nested dissection in three dimensions (George 1973, doi:10.1137/0710032). On the default finger
the formula is within a factor of `MEASURED_MEMORY_RATIO` of the growth of the peak resident memory of a separate
process (`tests/fem/reduction/test_memory.py` repeats the rows of 0.7 mm):

| size_mm, place | tetrahedra | measured GB | formula / measured |
|---|---|---|---|
| 2.0, 0.7, 0.35, apex | 2632, 7425, 40,157 | 0.25, 0.62, 3.53 | 0.89, 0.94, 1.03 |
| 2.0, 0.7, 0.5, off the apex (p = 4) | 2632, 7425, 15,038 | 0.52, 1.49, 3.54 | 1.02, 1.16, 1.11 |
| 2.0, 1.0, apex, no mirrors | 10,528, 20,652 | 0.80, 1.60 | 1.06, 1.13 |
| 1.2, 0.7, 0.5, finite strain | 4573, 7425, 14,646 | 0.41, 0.60, 1.35 | 0.97, 1.07, 0.99 |
"""

import math
from collections.abc import Callable

from papilla.core import seams
from papilla.core.checks import SIZE_OPTION
from papilla.core.errors import MemoryEstimateError

OVERHEAD_BYTES, ASSEMBLY_BYTES, FACTOR_BYTES, SCRATCH_BYTES, PAIR_BYTES = 60e6, 25e3, 190, 2300, 800

FINITE_ASSEMBLY = 30e3
"""Replaces ASSEMBLY for a press at finite strain, which computes the tangents of all cells at once."""

MEASURED_MEMORY_RATIO = 1.4  # Largest ratio of the measured memory to that of the formula
UNKNOWNS_PER_CELL, PATCH_COLUMNS = 4.8, 0.4
"""n / c, and k / c^(2/3), of Taylor-Hood elements on meshes of the default finger."""

BYTES_PER_GIB = 2**30


def reduction_bytes(cells: float, unknowns: float, columns: float, parities: int = 1) -> float:
    """Peak memory (bytes) of assembling, factorising for `parities` and condensing to `columns` patch nodes."""
    factors = parities * (FACTOR_BYTES * unknowns ** (4 / 3) + SCRATCH_BYTES * unknowns)
    return OVERHEAD_BYTES + ASSEMBLY_BYTES * cells + factors + PAIR_BYTES * columns**2


def finite_bytes(cells: float, unknowns: float, columns: float) -> float:
    """Peak memory (bytes) of a press at finite strain: one parity, and the stored response to all patch columns."""
    factor = FACTOR_BYTES * unknowns ** (4 / 3) + SCRATCH_BYTES * unknowns
    return OVERHEAD_BYTES + FINITE_ASSEMBLY * cells + factor + 8 * unknowns * columns


def least_bytes(cells: float) -> float:
    """Peak memory (bytes) of the cheapest use of a mesh with `cells` tetrahedra in its cell: a press at the apex."""
    return reduction_bytes(cells, UNKNOWNS_PER_CELL * cells, PATCH_COLUMNS * cells ** (2 / 3))


def refuse_reduction(cells: int, unknowns: int, columns: int, parities: int, size_mm: float) -> None:
    """Raise `MemoryEstimateError` if condensing a cell to `columns` patch nodes needs more memory than is free.

    `parities` still have to be factorised; if there are none, nothing is refused.
    """
    if parities:
        job = f"factorising {parities} times " if parities > 1 else "factorising "
        _refuse_mesh(job, (cells, unknowns, columns), size_mm, lambda c, n, k: reduction_bytes(c, n, k, parities))


def refuse_finite(cells: int, unknowns: int, columns: int, size_mm: float) -> None:
    """Raise `MemoryEstimateError` if a press at finite strain with `columns` patch nodes needs too much memory."""
    _refuse_mesh("pressing at finite strain ", (cells, unknowns, columns), size_mm, finite_bytes)


def _refuse_mesh(job: str, size: tuple[int, int, int], size_mm: float, law: Callable[..., float]) -> None:
    cells, unknowns, columns = size
    what = f"{job}a mesh of {cells:,} tetrahedra ({unknowns:,} unknowns, size_mm {size_mm:g})"
    refuse_size(what, size_mm, lambda ratio: law(cells / ratio**3, unknowns / ratio**3, columns / ratio**2))


def refuse_size(job: str, size_mm: float, needed: Callable[[float], float]) -> None:
    """Raise `MemoryEstimateError` if `job` needs more memory than is free; the message says which element size fits.

    `needed(ratio)` is its memory (bytes) with elements `ratio` times as large as `size_mm`.
    """
    refuse_beyond(needed(1), job, lambda free: _coarser(size_mm, needed, free))


def refuse_beyond(needed: float, job: str, advice: Callable[[int], str]) -> None:
    """Raise `MemoryEstimateError` if `job` needs more bytes than are free; `advice(free)` says what would fit."""
    free = available_bytes()
    if free is not None and needed > free:
        shortage = f"{job} needs about {in_gib(needed)} of memory, {in_gib(free)} are free"
        raise MemoryEstimateError(f"{shortage}: {advice(free)}")


def _coarser(size_mm: float, needed: Callable[[float], float], free: int) -> str:
    """Advice: the smallest size_mm, up to 100 times the wanted one, whose need of memory is within `free` bytes."""
    ratios = (10 ** (step / 200) for step in range(401))
    fitting = next((ratio for ratio in ratios if needed(ratio) <= free), None)
    if fitting is None:
        return "no coarser mesh would fit, free some memory"
    size = size_mm * fitting
    step = 10.0 ** (math.floor(math.log10(size)) - 1)
    return f"mesh with size_mm >= {math.ceil(size / step) * step:.2g} ({SIZE_OPTION})"


def in_gib(number: float) -> str:
    """Bytes as text in GiB, with two digits."""
    return f"{number / BYTES_PER_GIB:.2g} GiB" if number < 99.5 * BYTES_PER_GIB else f"{number / BYTES_PER_GIB:.0f} GiB"


def available_bytes() -> int | None:
    """Memory (bytes) that this process can still use without swapping; None if the system does not say."""
    return seams.free_bytes()
