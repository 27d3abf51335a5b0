"""Sparse lower triangles from element blocks: what is coupled is found once, then blocks are summed over cells."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp


@dataclass(frozen=True, eq=False)
class Couplings:
    """The distinct pairs of numbers that share a cell; m cells, k pairs in each, p distinct ones.

    local : (2, k) row and column within a cell of its pairs.
    rows, columns : (p,) numbers of the distinct pairs, by column, then by row.
    place : (m, k) which of them each cell's pairs are.
    """

    local: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    place: np.ndarray

    @classmethod
    def between(cls, rows: np.ndarray, columns: np.ndarray) -> "Couplings":
        """All pairs of row numbers (m, a) and column numbers (m, b) of each cell."""
        return cls._of(rows, columns, np.indices((rows.shape[1], columns.shape[1])).reshape(2, -1))

    @classmethod
    def lower(cls, numbers: np.ndarray) -> "Couplings":
        """The pairs of each cell's numbers (m, a), which must ascend, with row >= column."""
        return cls._of(numbers, numbers, np.array(np.tril_indices(numbers.shape[1])))

    @classmethod
    def _of(cls, rows, columns, local) -> "Couplings":
        size = int(rows.max()) + 1
        keys = columns[:, local[1]] * size + rows[:, local[0]]
        distinct, place = np.unique(keys, return_inverse=True)
        rows, columns = (distinct % size).astype(np.int32), (distinct // size).astype(np.int32)
        return cls(local, rows, columns, place.reshape(keys.shape))

    def total(self, values: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Sums (p, c) over `cells` (mask) of what each of their pairs has: values (cells, k, c)."""
        place = self.place[cells].ravel()
        ones, starts = np.ones(len(place)), np.arange(len(place) + 1)
        return sp.csc_matrix((ones, place, starts), shape=(len(self.rows), len(place))) @ values.reshape(len(place), -1)

    def entries(self, row_size: int, column_size: int) -> tuple[np.ndarray, np.ndarray]:
        """Row and column (p, row_size * column_size) of the scalar entries of blocks that are as large."""
        i, j = np.indices((row_size, column_size), dtype=np.int32).reshape(2, -1)
        return row_size * self.rows[:, None] + i, column_size * self.columns[:, None] + j


@dataclass(frozen=True, eq=False)
class Layout:
    """CSC structure of a lower triangle; `source` says from which of the given values each entry comes."""

    indices: np.ndarray
    starts: np.ndarray
    source: np.ndarray

    @classmethod
    def of(cls, rows: np.ndarray, columns: np.ndarray, size: int) -> "Layout":
        """Structure of the (size, size) matrix whose values (n,) are in distinct rows and columns (n,).

        Values above the diagonal are left out.
        """
        kept = np.flatnonzero(rows >= columns)
        structure = sp.coo_matrix((kept, (rows[kept], columns[kept])), shape=(size, size)).tocsc()
        structure.sort_indices()
        return cls(structure.indices, structure.indptr, structure.data)

    def matrix(self, values: np.ndarray) -> sp.csc_matrix:
        """The matrix that has the given values (n,)."""
        size = len(self.starts) - 1
        # Copies: whoever drops zeros from the matrix would change the structure of the next one
        structure = self.indices.copy(), self.starts.copy()
        return sp.csc_matrix((values[self.source], *structure), shape=(size, size))


def scaled(matrix: sp.csc_matrix, scale: np.ndarray) -> sp.csc_matrix:
    """The matrix (n, n) with its rows and its columns multiplied by `scale` (n,)."""
    data = matrix.data * (scale[matrix.indices] * np.repeat(scale, np.diff(matrix.indptr)))
    return sp.csc_matrix((data, matrix.indices, matrix.indptr), shape=matrix.shape)


def restricted(matrix: sp.csc_matrix, free: np.ndarray) -> sp.csc_matrix:
    """The rows and columns of the matrix (n, n) that `free` (mask) chooses."""
    columns = np.repeat(np.arange(len(free)), np.diff(matrix.indptr))
    kept = free[matrix.indices] & free[columns]
    number, size = np.cumsum(free) - 1, int(free.sum())
    starts = np.append(0, np.cumsum(np.bincount(number[columns[kept]], minlength=size)))
    return sp.csc_matrix((matrix.data[kept], number[matrix.indices[kept]], starts), shape=(size, size))
