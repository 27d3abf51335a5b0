"""MKL Pardiso through PyPardiso, for symmetric indefinite matrices with one sparsity pattern: analysed once, factored
often."""

from functools import lru_cache

import numpy as np
import scipy.sparse as sp

SYMMETRIC_INDEFINITE = -2

SETTINGS = {1: 1, 2: 3, 8: 2, 10: 8, 24: 1}
"""Pardiso's parameters, numbered from 1: own settings; threaded nested dissection; at most two refinements; pivots
perturbed below 1e-8; two-level factorisation. These were the fastest, with residuals below 1e-12."""

ANALYSE, FACTORISE_AND_SOLVE = 11, 23


@lru_cache(maxsize=1)
def engine():
    """PyPardiso's solver, configured; made once, because it searches the whole installation for MKL, which takes
    seconds.

    Raises `ImportError` if MKL is not found.
    """
    from pypardiso import PyPardisoSolver

    solver = PyPardisoSolver(mtype=SYMMETRIC_INDEFINITE)
    for number, value in SETTINGS.items():
        solver.set_iparm(number, value)
    return solver


class SymmetricPardiso:
    """Solves (base + added entries) x = b on the free unknowns of a symmetric matrix `base`, on `threads` threads.

    base : (n, n), its upper triangle or all of it; every entry that is added later must be stored, possibly as zero.
    free : (m,) numbers of the unknowns that are not held at zero.
    """

    def __init__(self, base: sp.spmatrix, free: np.ndarray, threads: int):
        self._size = base.shape[0]
        self._free = free
        self._number = np.full(self._size, -1)
        self._number[free] = np.arange(len(free))
        entries = base.tocoo()
        rows, columns = self._number[entries.row], self._number[entries.col]
        kept = (rows >= 0) & (rows <= columns)
        shape = (len(free), len(free))
        self._upper = sp.csr_matrix((entries.data[kept], (rows[kept], columns[kept])), shape=shape)
        self._upper.sort_indices()
        self._solver = engine()
        self._solver.libmkl.MKL_Set_Num_Threads(threads)
        self._run(ANALYSE, self._upper, np.zeros(len(free)))

    def solve(self, added: sp.coo_matrix, rhs: np.ndarray) -> np.ndarray:
        """Solution (n,), zero where not free, of the system with the symmetric matrix `added` (n, n) on top of base."""
        matrix = self._upper.copy()
        rows, columns = self._number[added.row], self._number[added.col]
        kept = (rows >= 0) & (rows <= columns)
        places = stored_at(matrix.indptr, matrix.indices, rows[kept], columns[kept])
        np.add.at(matrix.data, places, added.data[kept])
        solution = np.zeros(self._size)
        solution[self._free] = self._run(FACTORISE_AND_SOLVE, matrix, np.ascontiguousarray(rhs[self._free]))
        return solution

    def close(self) -> None:
        """Release the memory of the factorisation."""
        self._solver.free_memory(everything=True)

    def _run(self, phase: int, upper: sp.csr_matrix, rhs: np.ndarray) -> np.ndarray:
        self._solver.set_phase(phase)
        # The documented way to a single phase: `solve` would analyse every new matrix again
        return self._solver._call_pardiso(upper, rhs)


def stored_at(starts: np.ndarray, columns: np.ndarray, rows: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Positions in a CSR matrix with sorted `columns` and row `starts` of its entries in `rows` and columns
    `others`."""
    # 64 bits, because a row times the size exceeds 32 bits on usual meshes
    touched, which = np.unique(rows.astype(np.int64), return_inverse=True)
    spans = [np.arange(starts[row], starts[row + 1]) for row in touched]
    stored = np.concatenate(spans)
    size = int(columns.max()) + 1
    keys = np.repeat(touched, [len(span) for span in spans]) * size + columns[stored]
    return stored[np.searchsorted(keys, touched[which] * size + others)]
