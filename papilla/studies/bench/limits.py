"""What the machine allows: operations and bytes of factor and solves, against measured arithmetic and memory speed."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from time import perf_counter

import numpy as np
import scipy.sparse as sp

from papilla.fem.discrete.solver import BATCH

GEMM_SIZE = 1500
"""Of a matrix product, large enough to reach the peak and small enough for a fraction of a second."""

STREAM_ENTRIES = 2**23
"""Of each array that is streamed: 64 MiB, more than the caches hold."""

REPEATS = 3

PASSES = 2
"""Forward and backward substitution each read the factor once."""


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
        seconds = _best(lambda: np.matmul(a, a, out=product))
        arrays = [[np.ones(STREAM_ENTRIES) for _ in range(3)] for _ in range(cores)]
        with ThreadPoolExecutor(cores) as pool:
            stream = _best(lambda: list(pool.map(lambda abc: np.add(abc[0], abc[1], out=abc[2]), arrays)))
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

    def to_json(self) -> dict:
        """Plain values."""
        return {
            "flops": self.flops,
            "bytes": self.nbytes,
            "machine_flops": self.machine.flops,
            "machine_bytes_per_s": self.machine.bandwidth,
            "least_seconds": self.seconds,
            "binding": self.binding,
        }

    @property
    def binding(self) -> str:
        """What binds, in words."""
        by_flops = self.flops / self.machine.flops >= self.nbytes / self.machine.bandwidth
        return "arithmetic" if by_flops else "memory bandwidth"


def factor_flops(matrix: sp.csc_matrix) -> float:
    """Operations of the LDL^T of a lower triangle in rslab's ordering: a front of m rows eliminates p of them for
    sum over k < p of (m - k)^2."""
    import rslab

    fronts = np.array(rslab.analyze(matrix, path="ldlt", threads=1).front_dims, dtype=float)
    pivots, rows = fronts.T
    left = rows - pivots
    return float((_squares(rows) - _squares(left)).sum())


def factor_bound(flops: float, nonzeros: int, machine: Machine) -> Bound:
    """Of the factorisation: each entry of the factor is at least written once."""
    return Bound(flops, 8.0 * nonzeros, machine)


def solve_bound(nonzeros: int, columns: int, machine: Machine) -> Bound:
    """Of `columns` right-hand sides in batches: every batch reads the factor in each pass."""
    batches = -(-columns // BATCH)
    return Bound(2.0 * PASSES * nonzeros * columns, 8.0 * PASSES * nonzeros * batches, machine)


def _squares(n: np.ndarray) -> np.ndarray:
    """1 + 4 + ... + n^2."""
    return n * (n + 1) * (2 * n + 1) / 6


def _best(work: Callable[[], object]) -> float:
    seconds = []
    for _ in range(REPEATS):
        began = perf_counter()
        work()
        seconds.append(perf_counter() - began)
    return min(seconds)
