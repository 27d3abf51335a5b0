"""What theory and the machine allow: growth of cost with the unknowns n, and the least seconds of factor and solves.

For a cube of n unknowns nested dissection fills O(n^(4/3)) entries of the factor with O(n^2) operations, and no
ordering does with less (George 1973, doi:10.1137/0710032); a solve touches each entry once. A mesh that is fine at the
contact alone lies between a cube and a sheet, where the same bounds are n log n and n^(3/2).
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from papilla.fem.discrete.solver import BATCH
from papilla.studies.bench.row import BenchRow
from papilla.studies.bench.scenes import fastest

GEMM_SIZE = 1500
"""Of a matrix product, large enough to reach the peak and small enough for a fraction of a second."""

STREAM_ENTRIES = 2**23
"""Of each array that is streamed: 64 MiB, more than the caches hold."""

PASSES = 2
"""Forward and backward substitution each read the factor once."""


@dataclass(frozen=True)
class Power:
    """A quantity fitted by coefficient * n^exponent, and the exponent of its bound for a cube."""

    exponent: float
    bound: float
    coefficient: float

    @classmethod
    def fitted(cls, dofs: Sequence[float], values: Sequence[float], bound: float) -> "Power":
        """Least squares of log value against log n."""
        exponent, offset = np.polyfit(np.log(dofs), np.log(values), 1)
        return cls(float(exponent), bound, float(np.exp(offset)))


@dataclass(frozen=True)
class Growth:
    """Powers of the number of unknowns, fitted over `dofs`, of one element's factor and its use."""

    element: str
    dofs: tuple[int, ...]
    factor_nonzeros: Power
    factor_flops: Power
    factor_seconds: Power
    solve_seconds: Power

    @classmethod
    def of(cls, rows: Sequence[BenchRow]) -> "Growth":
        """Growth over rows of one element on at least two meshes."""
        ordered = sorted(rows, key=lambda row: row.dofs)
        dofs = tuple(row.dofs for row in ordered)
        costs = [
            (row.factor_nonzeros, row.factor_flops, row.stages["factorisation"], row.seconds_per_column)
            for row in ordered
        ]
        bounds = (4 / 3, 2.0, 2.0, 4 / 3)
        return cls(ordered[0].element, dofs, *map(Power.fitted, [dofs] * 4, zip(*costs, strict=True), bounds))


@dataclass(frozen=True)
class Machine:
    """Measured speed on all cores: double-precision products (flop/s) and streamed memory (byte/s)."""

    flops: float
    bandwidth: float

    @classmethod
    def measured(cls) -> "Machine":
        """The best of a few runs of a matrix product, and of adding two long arrays to a third."""
        cores = os.cpu_count() or 1
        a = np.random.default_rng(0).standard_normal((GEMM_SIZE, GEMM_SIZE))
        product = np.empty_like(a)
        seconds = fastest(lambda: np.matmul(a, a, out=product))
        arrays = [[np.ones(STREAM_ENTRIES) for _ in range(3)] for _ in range(cores)]
        with ThreadPoolExecutor(cores) as pool:
            stream = fastest(lambda: list(pool.map(lambda abc: np.add(abc[0], abc[1], out=abc[2]), arrays)))
        return cls(2 * GEMM_SIZE**3 / seconds, cores * 3 * 8 * STREAM_ENTRIES / stream)


@dataclass(frozen=True)
class Bound:
    """The least seconds that a step can take, by its arithmetic and by its memory traffic."""

    flops: float
    nbytes: float
    machine: Machine

    @property
    def seconds(self) -> float:
        """The larger of both: what binds."""
        return max(self.flops / self.machine.flops, self.nbytes / self.machine.bandwidth)

    @property
    def binding(self) -> str:
        """What binds, in words."""
        return "arithmetic" if self.seconds == self.flops / self.machine.flops else "memory bandwidth"

    def sentence(self, name: str, measured: float) -> str:
        """The bound beside the seconds that were measured."""
        return (
            f"{name}: at least {self.seconds:.2f} s on this machine, by {self.binding}; "
            f"{measured / self.seconds:.1f} times that was measured"
        )

    def to_json(self) -> dict:
        """Plain values."""
        machine = {"machine_flops": self.machine.flops, "machine_bytes_per_s": self.machine.bandwidth}
        known = {"flops": self.flops, "bytes": self.nbytes, **machine}
        return known | {"least_seconds": self.seconds, "binding": self.binding}


def factor_flops(matrix: sp.csc_matrix) -> float:
    """Operations of the LDL^T of a lower triangle in rslab's ordering: a front of m rows eliminates p of them for
    sum over k < p of (m - k)^2."""
    import rslab

    pivots, rows = np.array(rslab.analyze(matrix, path="ldlt", threads=1).front_dims, dtype=float).T
    squares = [n * (n + 1) * (2 * n + 1) / 6 for n in (rows, rows - pivots)]
    return float((squares[0] - squares[1]).sum())


def bounds_of(flops: float, nonzeros: int, columns: int, machine: Machine) -> dict[str, Bound]:
    """Of the factorisation, which at least writes each entry of the factor once, and of solves with `columns`
    right-hand sides in batches, each of which reads the factor in each pass."""
    read = 8.0 * PASSES * nonzeros * -(-columns // BATCH)
    solves = Bound(2.0 * PASSES * nonzeros * columns, read, machine)
    return {"factorisation": Bound(flops, 8.0 * nonzeros, machine), "solves": solves}
