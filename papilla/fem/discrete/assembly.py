"""Isotropic linear elasticity: constants of a layer, element blocks, and their assembly to sparse lower triangles.

Blocks are batched products of basis gradients, 3 x 3 for each pair of nodes of a cell. The coupled pairs are found
once; then blocks are summed over cells.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from papilla.model.finger import Layer

SPACE_AXES = 3  # Components of a displacement

LARGEST_COMPRESSIBILITY = 1e10
"""Largest mu/lambda that is used: for nu = 0 it is infinite and the pressure zero; this value leaves 1e-10 of it."""

CELLS_AT_ONCE = 1024
"""Number of cells whose element matrices are made at once, so that they stay in the processor's cache."""


def lame(layer: Layer) -> tuple[float, float]:
    """Shear modulus mu (MPa) and compressibility 1/lambda (1/MPa, zero for nu = 0.5) of a layer."""
    mu = layer.modulus / (2 * (1 + layer.nu))
    ratio = (1 - 2 * layer.nu) / (2 * layer.nu) if layer.nu > 0 else LARGEST_COMPRESSIBILITY
    return mu, min(ratio, LARGEST_COMPRESSIBILITY) / mu


def shear_blocks(gradients: np.ndarray, weights: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Element blocks (m, k, 9) of the form 2 eps(u) : eps(v).

    gradients : (m, a, 3, q) of the scalar basis functions at quadrature points of `weights` (m, q).
    pairs : (2, k) local numbers of test and trial function.
    """
    result = np.empty((len(weights), pairs.shape[1], SPACE_AXES, SPACE_AXES))
    for chunk, products in _products(gradients, weights, pairs):
        result[chunk] = products.swapaxes(-1, -2)
        diagonal = np.einsum("ekii->eki", result[chunk])
        diagonal += np.einsum("ekii->ek", products)[:, :, None]
    return result.reshape(*result.shape[:2], -1)


def volumetric_blocks(gradients: np.ndarray, weights: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Element blocks (m, k, 9) of the form div u div v; arguments as for `shear_blocks`."""
    result = np.concatenate([products for _, products in _products(gradients, weights, pairs)])
    return result.reshape(*result.shape[:2], -1)


def _products(gradients, weights, pairs) -> Iterator[tuple[slice, np.ndarray]]:
    """Cells, and integrals (cells, k, 3, 3) of the derivative of the test function along i times that of the trial
    function along j."""
    cells, nodes, _, points = gradients.shape
    for first in range(0, cells, CELLS_AT_ONCE):
        chunk = slice(first, min(first + CELLS_AT_ONCE, cells))
        flat = gradients[chunk].reshape(-1, SPACE_AXES * nodes, points)
        all_pairs = np.matmul(flat * weights[chunk, None, :], flat.transpose(0, 2, 1))
        # Pairs come first: NumPy moves an index array on both sides of a slice to the front
        chosen = all_pairs.reshape(-1, nodes, SPACE_AXES, nodes, SPACE_AXES)[:, pairs[0], :, pairs[1], :]
        yield chunk, chosen.swapaxes(0, 1)


@dataclass(frozen=True, eq=False)
class Couplings:
    """The distinct pairs of numbers that share a cell; m cells, k pairs in each, p distinct ones.

    local : (2, k) row and column within a cell of its pairs.
    rows, columns : (p,) numbers of the distinct pairs, sorted by column, then by row.
    place : (m, k) position of each cell's pairs among them.
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
        """Sums (p, c), over `cells` (mask), of the values (cells, k, c) of their pairs."""
        place = self.place[cells].ravel()
        ones, starts = np.ones(len(place)), np.arange(len(place) + 1)
        return sp.csc_matrix((ones, place, starts), shape=(len(self.rows), len(place))) @ values.reshape(len(place), -1)

    def entries(self, row_size: int, column_size: int) -> tuple[np.ndarray, np.ndarray]:
        """Row and column (p, row_size * column_size) of the scalar entries of blocks of this size."""
        i, j = np.indices((row_size, column_size), dtype=np.int32).reshape(2, -1)
        return row_size * self.rows[:, None] + i, column_size * self.columns[:, None] + j


@dataclass(frozen=True, eq=False)
class Layout:
    """CSC structure of a lower triangle; `source` gives, for each entry, the number of the value that it takes."""

    indices: np.ndarray
    starts: np.ndarray
    source: np.ndarray

    @classmethod
    def of(cls, rows: np.ndarray, columns: np.ndarray, size: int) -> "Layout":
        """Structure of the (size, size) matrix whose values (n,) are in distinct rows and columns (n,).

        Values above the diagonal are left out.
        """
        lower = np.flatnonzero(rows >= columns)
        structure = sp.coo_matrix((lower, (rows[lower], columns[lower])), shape=(size, size)).tocsc()
        structure.sort_indices()
        return cls(structure.indices, structure.indptr, structure.data)

    def matrix(self, values: np.ndarray) -> sp.csc_matrix:
        """The matrix with the given values (n,)."""
        size = len(self.starts) - 1
        # Copies, because a caller that drops zeros from the matrix would change the structure of the next one
        structure = self.indices.copy(), self.starts.copy()
        return sp.csc_matrix((values[self.source], *structure), shape=(size, size))


def scaled(matrix: sp.csc_matrix, scale: np.ndarray) -> sp.csc_matrix:
    """The matrix (n, n) with its rows and its columns multiplied by `scale` (n,)."""
    data = matrix.data * (scale[matrix.indices] * np.repeat(scale, np.diff(matrix.indptr)))
    return sp.csc_matrix((data, matrix.indices, matrix.indptr), shape=matrix.shape)


def restricted(matrix: sp.csc_matrix, free: np.ndarray) -> sp.csc_matrix:
    """The rows and columns of the matrix (n, n) that `free` (mask) chooses."""
    columns = np.repeat(np.arange(len(free)), np.diff(matrix.indptr))
    inside = free[matrix.indices] & free[columns]
    number, size = np.cumsum(free) - 1, int(free.sum())
    starts = np.append(0, np.cumsum(np.bincount(number[columns[inside]], minlength=size)))
    return sp.csc_matrix((matrix.data[inside], number[matrix.indices[inside]], starts), shape=(size, size))
