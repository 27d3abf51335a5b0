"""How much memory is left, what a job on a mesh takes, and the refusal of one that takes more, before it starts.

What counts as free: on Linux what the kernel could give without swapping, or less where a control group (a container, a
batch job) allows less; elsewhere the free pages or, where the system does not count them, all of its memory. Where
nothing is known (Windows) nothing is refused.

The law, in bytes, of condensing a cell of c tetrahedra and n unknowns (`FingerModel.reduce`), with p parities
factorised and k patch nodes:

    OVERHEAD + ASSEMBLY c + p (FACTOR n^(4/3) + SCRATCH n) + PAIRS k^2

n^(4/3) is what nested dissection fills in three dimensions (George 1973, doi:10.1137/0710032). Against the peak
resident size of a process of its own, less its size before, on the default finger (`tests/fem/test_memory.py` repeats
the lines of 0.7 mm), the law is within a factor of `SPREAD`:

| size_mm, where | tetrahedra | measured GB | law / measured |
|---|---|---|---|
| 2.0, 0.7, 0.35, apex | 2632, 7425, 40,157 | 0.25, 0.62, 3.53 | 0.89, 0.94, 1.03 |
| 2.0, 0.7, 0.5, off the apex (p = 4) | 2632, 7425, 15,038 | 0.52, 1.49, 3.54 | 1.02, 1.16, 1.11 |
| 2.0, 1.0, apex, no mirrors | 10,528, 20,652 | 0.80, 1.60 | 1.06, 1.13 |
| 1.2, 0.7, 0.5, finite strain | 4573, 7425, 14,646 | 0.41, 0.60, 1.35 | 0.97, 1.07, 0.99 |
"""

import math
import os
from collections.abc import Callable
from pathlib import Path, PurePosixPath

from papilla.checks import SIZE_OPTION
from papilla.errors import MemoryEstimateError

OVERHEAD, ASSEMBLY, FACTOR, SCRATCH, PAIRS = 60e6, 25e3, 190, 2300, 800

FINITE_ASSEMBLY = 30e3
"""In place of ASSEMBLY for a press at finite strain, whose tangents are made for all cells at once."""

SPREAD = 1.4  # Largest factor between the law and what was measured
UNKNOWNS_PER_CELL, COLUMNS = 4.8, 0.4
"""n of c tetrahedra, and k over c^(2/3), of Taylor-Hood on meshes of the default finger."""

MEMINFO = Path("/proc/meminfo")
CGROUPS_OF_SELF = Path("/proc/self/cgroup")
CGROUP_ROOTS = {"v1": (Path("/sys/fs/cgroup/memory"),), "v2": (Path("/sys/fs/cgroup"), Path("/sys/fs/cgroup/unified"))}
CGROUP_FILES = {
    "v1": ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
    "v2": ("memory.max", "memory.current", "inactive_file"),
}
"""Limit and usage in bytes, and the line of `memory.stat` with the cached files in it, which the kernel gives back."""

GIB = 2**30


def reduction_bytes(cells: float, unknowns: float, columns: float, parities: int = 1) -> float:
    """Peak memory (bytes) of assembling, factorising for some parities and condensing to patch columns."""
    factors = parities * (FACTOR * unknowns ** (4 / 3) + SCRATCH * unknowns)
    return OVERHEAD + ASSEMBLY * cells + factors + PAIRS * columns**2


def finite_bytes(cells: float, unknowns: float, columns: float) -> float:
    """Peak memory (bytes) of a press at finite strain: one parity, and the response to all columns kept."""
    factor = FACTOR * unknowns ** (4 / 3) + SCRATCH * unknowns
    return OVERHEAD + FINITE_ASSEMBLY * cells + factor + 8 * unknowns * columns


def least_bytes(cells: float) -> float:
    """Peak memory (bytes) of the cheapest use of a mesh with so many tetrahedra in its cell: pressed at the apex."""
    return reduction_bytes(cells, UNKNOWNS_PER_CELL * cells, COLUMNS * cells ** (2 / 3))


def refuse_reduction(cells: int, unknowns: int, columns: int, parities: int, size_mm: float) -> None:
    """Raise `MemoryEstimateError` where condensing a cell to `columns` patch nodes would not fit.

    `parities` are those still to factor; with none there is nothing to refuse.
    """
    if parities:
        job = f"factorising {parities} times " if parities > 1 else "factorising "
        _refuse_mesh(job, (cells, unknowns, columns), size_mm, lambda c, n, k: reduction_bytes(c, n, k, parities))


def refuse_finite(cells: int, unknowns: int, columns: int, size_mm: float) -> None:
    """Raise `MemoryEstimateError` where a press at finite strain with `columns` patch nodes would not fit."""
    _refuse_mesh("pressing at finite strain ", (cells, unknowns, columns), size_mm, finite_bytes)


def _refuse_mesh(job: str, size: tuple[int, int, int], size_mm: float, law: Callable[..., float]) -> None:
    cells, unknowns, columns = size
    what = f"{job}a mesh of {cells:,} tetrahedra ({unknowns:,} unknowns, size_mm {size_mm:g})"
    refuse_size(what, size_mm, lambda ratio: law(cells / ratio**3, unknowns / ratio**3, columns / ratio**2))


def refuse_size(job: str, size_mm: float, needed: Callable[[float], float]) -> None:
    """Raise `MemoryEstimateError` where `job` does not fit, with the element size that would.

    `needed(ratio)` are its bytes with elements that are `ratio` times as large as `size_mm`.
    """
    refuse_beyond(needed(1), job, lambda free: _coarser(size_mm, needed, free))


def refuse_beyond(needed: float, job: str, advice: Callable[[int], str]) -> None:
    """Raise `MemoryEstimateError` where `job` needs more bytes than are free; `advice(free)` says what would do."""
    free = available_bytes()
    if free is not None and needed > free:
        found = f"{job} needs about {in_gib(needed)} of memory, {in_gib(free)} are free"
        raise MemoryEstimateError(f"{found}: {advice(free)}")


def _coarser(size_mm: float, needed: Callable[[float], float], free: int) -> str:
    ratios = (10 ** (step / 200) for step in range(401))
    fitting = next((ratio for ratio in ratios if needed(ratio) <= free), None)
    if fitting is None:
        return "no coarser mesh would do, free some memory"
    size = size_mm * fitting
    step = 10.0 ** (math.floor(math.log10(size)) - 1)
    return f"mesh with size_mm >= {math.ceil(size / step) * step:.2g} ({SIZE_OPTION})"


def in_gib(number: float) -> str:
    """Bytes in words, to two digits."""
    return f"{number / GIB:.2g} GiB" if number < 99.5 * GIB else f"{number / GIB:.0f} GiB"


def available_bytes() -> int | None:
    """Memory (bytes) that this process may still take without swapping; None where the system does not tell."""
    known = [free for free in (_of_machine(), *_of_cgroups()) if free is not None]
    return min(known) if known else None


def _of_machine() -> int | None:
    try:
        lines = MEMINFO.read_text().splitlines()
        return next(1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:"))
    except (OSError, ValueError, IndexError, StopIteration):
        pass
    for pages in ("SC_AVPHYS_PAGES", "SC_PHYS_PAGES"):
        try:
            count = os.sysconf(pages) * os.sysconf("SC_PAGE_SIZE")
        except (AttributeError, ValueError, OSError):
            continue
        if count > 0:
            return count
    return None


def _of_cgroups() -> list[int]:
    """What each control group around this process still allows."""
    try:
        lines = CGROUPS_OF_SELF.read_text().splitlines()
    except OSError:
        return []
    free = []
    for line in lines:
        _, controllers, path = line.split(":", 2)
        kind = "v2" if not controllers else "v1" if "memory" in controllers.split(",") else None
        if kind is not None:
            own = PurePosixPath(path.lstrip("/"))
            groups = {root / group for root in CGROUP_ROOTS[kind] for group in (own, *own.parents)}
            free += [left for group in groups if (left := _left_in(group, *CGROUP_FILES[kind])) is not None]
    return free


def _left_in(group: Path, limit: str, usage: str, cached: str) -> int | None:
    try:
        allowed, used = int((group / limit).read_text()), int((group / usage).read_text())
        counts = dict(line.split() for line in (group / "memory.stat").read_text().splitlines())
        return max(0, allowed - used + int(counts.get(cached, 0)))
    except (OSError, ValueError):
        # No such file, or "max": this group has no limit
        return None
