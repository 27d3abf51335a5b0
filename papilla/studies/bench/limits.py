"""What the machine allows: operations and bytes of factor and solves, against measured arithmetic and memory speed."""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from papilla.fem.discrete.solver import BATCH
from papilla.studies.bench.scenes import fastest

GEMM_SIZE = 1500
"""Of a matrix product, large enough to reach the peak and small enough for a fraction of a second."""

STREAM_ENTRIES = 2**23
"""Of each array that is streamed: 64 MiB, more than the caches hold."""

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
        return {
            "flops": self.flops,
            "bytes": self.nbytes,
            "machine_flops": self.machine.flops,
            "machine_bytes_per_s": self.machine.bandwidth,
            "least_seconds": self.seconds,
            "binding": self.binding,
        }


def factor_flops(matrix: sp.csc_matrix) -> float:
    """Operations of the LDL^T of a lower triangle in rslab's ordering: a front of m rows eliminates p of them for
    sum over k < p of (m - k)^2."""
    import rslab

    fronts = np.array(rslab.analyze(matrix, path="ldlt", threads=1).front_dims, dtype=float)
    pivots, rows = fronts.T
    left = rows - pivots
    return float((_squares(rows) - _squares(left)).sum())


def bounds_of(flops: float, nonzeros: int, columns: int, machine: Machine) -> dict[str, Bound]:
    """Of the factorisation, which at least writes each entry of the factor once, and of solves with `columns`
    right-hand sides in batches, each of which reads the factor in each pass."""
    batches = -(-columns // BATCH)
    return {
        "factorisation": Bound(flops, 8.0 * nonzeros, machine),
        "solves": Bound(2.0 * PASSES * nonzeros * columns, 8.0 * PASSES * nonzeros * batches, machine),
    }


def _squares(n: np.ndarray) -> np.ndarray:
    """1 + 4 + ... + n^2."""
    return n * (n + 1) * (2 * n + 1) / 6
