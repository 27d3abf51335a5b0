"""What memory a mesh costs to be used, before there is one: nobody should mesh for long and be refused then.

The law, in bytes, of condensing a cell of c tetrahedra and n unknowns (`papilla.fem.FingerModel.reduce`), with p
parities factorised and k patch nodes:

    OVERHEAD + ASSEMBLY c + p (FACTOR n^(4/3) + SCRATCH n) + PAIRS k^2

n^(4/3) is what nested dissection fills in three dimensions (George 1973, doi:10.1137/0710032). Against the peak
resident size of a process of its own, less its size before, on the default finger (`tests/fem/test_memory.py` repeats
the lines of 0.7 mm), the law is within a factor of `SPREAD`:

| size_mm, where | tetrahedra | measured GB | law / measured |
|---|---|---|---|
| 2.0, 0.7, 0.35, apex | 2632, 7425, 40,157 | 0.25, 0.62, 3.53 | 0.89, 0.94, 1.03 |
| 2.0, 0.7, 0.5, off the apex (p = 4) | 2632, 7425, 15,038 | 0.52, 1.49, 3.54 | 1.02, 1.16, 1.11 |
| 2.0, 1.0, apex, no mirrors | 10,528, 20,652 | 0.80, 1.60 | 1.06, 1.13 |
| 2.0, 0.7, finite strain | 2632, 7425 | 0.39, 0.87 | 1.00, 1.22 |
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from papilla.memory import refuse_beyond
from papilla.mesh.body import Body
from papilla.mesh.sizing import Sizing

OVERHEAD, ASSEMBLY, FACTOR, SCRATCH, PAIRS = 60e6, 25e3, 190, 2300, 800

FINITE_ASSEMBLY = 85e3
"""In place of ASSEMBLY for a press at finite strain, whose tangents are made for all cells at once."""

SPREAD = 1.4
"""Largest factor between the law and what was measured."""

UNKNOWNS_PER_CELL, COLUMNS = 4.8, 0.4
"""n of c tetrahedra, and k over c^(2/3), of Taylor-Hood on meshes of the default finger."""

SAMPLES = 32
"""Points along each axis of the body's box in which its volume is sampled."""


def reduction_bytes(cells: float, unknowns: float, columns: float, parities: int = 1) -> float:
    """Peak memory (bytes) of assembling, factorising for some parities and condensing to patch columns."""
    factors = parities * (FACTOR * unknowns ** (4 / 3) + SCRATCH * unknowns)
    return OVERHEAD + ASSEMBLY * cells + factors + PAIRS * columns**2


def finite_bytes(cells: float, unknowns: float, columns: float) -> float:
    """Peak memory (bytes) of a press at finite strain: one parity, and the response to all columns kept."""
    factor = FACTOR * unknowns ** (4 / 3) + SCRATCH * unknowns
    return OVERHEAD + FINITE_ASSEMBLY * cells + factor + 8 * unknowns * columns


def bytes_of(cells: float) -> float:
    """Peak memory (bytes) of the cheapest use of a mesh with so many tetrahedra in its cell: pressed at the apex."""
    return reduction_bytes(cells, UNKNOWNS_PER_CELL * cells, COLUMNS * cells ** (2 / 3))


def refuse_size(body: Body, sizing: Sizing, keep_bone: bool) -> None:
    """Raise `MemoryEstimateError` where the mesh that `sizing` asks for could not be pressed in the memory left."""
    samples = _samples(body, keep_bone)

    def cells(ratio: float) -> float:
        return replace(sizing, near_mm=ratio * sizing.near_mm).cell_count(*samples)

    refuse_beyond(
        bytes_of(cells(1)),
        f"factorising a mesh of about {cells(1):,.0f} tetrahedra (size_mm {sizing.near_mm:g})",
        lambda free: coarser(sizing.near_mm, lambda ratio: bytes_of(cells(ratio)), free),
    )


def coarser(size_mm: float, needed: Callable[[float], float], free: int) -> str:
    """What to mesh with instead: `needed(ratio)` are the bytes with elements that are `ratio` times as large."""
    fitting = next((ratio for ratio in np.geomspace(1, 100, 400) if needed(ratio) <= free), None)
    if fitting is None:
        return "no coarser mesh would do, free some memory"
    size = size_mm * fitting
    step = 10.0 ** (np.floor(np.log10(size)) - 1)
    return f"mesh with size_mm >= {np.ceil(size / step) * step:.2g}"


def _samples(body: Body, keep_bone: bool) -> tuple[np.ndarray, float]:
    """Points (n, 3) spread evenly over what will be meshed, and the volume (mm3) that each stands for."""
    lines = [
        low + (high - low) * (np.arange(SAMPLES) + 0.5) / SAMPLES for low, high in zip(body.low, body.high, strict=True)
    ]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    meshed = body.surfaces["skin"].level(points) <= 0
    if not keep_bone:
        meshed &= body.surfaces["bone"].level(points) > 0
    return points[meshed], float(np.prod(body.high - body.low)) / SAMPLES**3
