"""Sums over small arrays, each in two forms: a few NumPy calls, and the same as loops for the compiler.

Everything else in the kernels is one source; `LOOPS` names the loops that stand in for the calls when it is compiled.
"""

import math
from collections.abc import Callable

import numpy as np

from papilla.estimators.tracking import bank_vectors


def solve(gram, right, size, answer):
    """Solve the leading `size` equations of a positive definite matrix into `answer`; its product with `right`."""
    from scipy.linalg.lapack import dposv

    # Symmetric: its transpose is what LAPACK's order of the entries makes of it.
    _, found, failed = dposv(gram[:size, :size].T, right[:size])
    answer[:size] = math.nan if failed else found
    return float(np.dot(answer[:size], right[:size]))


def solve_loop(gram, right, size, answer):
    """The same by Cholesky's factors, in place of the matrix; the reciprocals of their diagonal stand in for it."""
    for i in range(size):
        for j in range(i + 1):
            total = gram[i, j]
            for k in range(j):
                total -= gram[i, k] * gram[j, k]
            gram[i, j] = 1.0 / math.sqrt(total) if i == j else total * gram[j, j]
    for i in range(size):
        total = right[i]
        for k in range(i):
            total -= gram[i, k] * answer[k]
        answer[i] = total * gram[i, i]
    product = 0.0
    for i in range(size - 1, -1, -1):
        total = answer[i]
        for k in range(i + 1, size):
            total -= gram[k, i] * answer[k]
        answer[i] = total * gram[i, i]
        product += answer[i] * right[i]
    return product


def harmonic_row(orders, state, present, row):
    """Fill `row` with the derivative of the reading by the state, of the first `present` harmonics; the reading.

    The state is wavenumber, phase, shear, offset, then in-phase and quadrature amplitudes, the first of these none.
    """
    values, count = state.tolist(), len(orders)
    turn, wave = complex(math.cos(values[1]), math.sin(values[1])), 1.0 + 0.0j
    waves = [0.0] * (2 * count)
    reading, slope = values[3], 0.0
    for h in range(present):
        wave *= turn
        part = complex(values[4 + h], -values[4 + count + h]) * wave
        reading += part.real
        slope -= (h + 1) * part.imag
        waves[h], waves[count + h] = wave.real, wave.imag
    waves[count] = 0.0
    row[1] = slope
    row[4:] = waves
    return reading


def harmonic_row_loop(orders, state, present, row):
    """The same by recursion from the first harmonic."""
    count = orders.shape[0]
    cosine, sine = math.cos(state[1]), math.sin(state[1])
    reading, slope = state[3], 0.0
    c, s = 1.0, 0.0
    for h in range(present):
        c, s = c * cosine - s * sine, s * cosine + c * sine
        row[4 + h], row[4 + count + h] = c, s
        in_phase, quadrature = state[4 + h], state[4 + count + h]
        reading += in_phase * c + quadrature * s
        slope += orders[h] * (quadrature * c - in_phase * s)
    for h in range(present, count):
        row[4 + h] = row[4 + count + h] = 0.0
    row[1] = slope
    row[4 + count] = 0.0
    return reading


def spread_row(cov, row, across):
    """across = cov row; returns row across."""
    np.dot(cov, row, out=across)
    return float(np.dot(row, across))


def spread_row_loop(cov, row, across):
    """The same; `cov` is symmetric, and many of the row's entries are zero: two of its rows at a time."""
    size = row.shape[0]
    across[:] = 0.0
    for j in range(0, size - size % 2, 2):
        first, second = row[j], row[j + 1]
        if first != 0.0 or second != 0.0:
            for i in range(size):
                across[i] += first * cov[j, i] + second * cov[j + 1, i]
    if size % 2:
        for i in range(size):
            across[i] += row[size - 1] * cov[size - 1, i]
    total = 0.0
    for i in range(size):
        total += row[i] * across[i]
    return total


def take_error(state, cov, across, variance, error):
    """state += across error / variance, cov -= across across' / variance."""
    state += across * (error / variance)
    cov -= np.dot(across[:, None], (across / variance)[None, :])


def take_error_loop(state, cov, across, variance, error):
    """The same, row by row."""
    size, certainty = state.shape[0], 1.0 / variance
    for i in range(size):
        gain = across[i] * certainty
        state[i] += gain * error
        for j in range(size):
            cov[i, j] -= gain * across[j]


def carry(cov, shape, drift, dx, dr):
    """Covariance after phase += wavenumber dx - shear dr; `shape` (size,) times `drift` adds to the variances."""
    change = dx * cov[0]
    if dr != 0.0:
        change -= dr * cov[2]
    cov[1] += change
    cov[:, 1] += change
    cov[1, 1] += dx * (dx * cov[0, 0] - dr * cov[0, 2]) - dr * (dx * cov[2, 0] - dr * cov[2, 2])
    cov.reshape(-1)[:: cov.shape[0] + 1] += shape * drift


def carry_loop(cov, shape, drift, dx, dr):
    """The same, column by column; the phase's own first, while its row is still the old one."""
    change = dx * cov[0, 1] - dr * cov[2, 1]
    cov[1, 1] += 2 * change + dx * (dx * cov[0, 0] - dr * cov[0, 2]) - dr * (dx * cov[2, 0] - dr * cov[2, 2])
    for j in range(cov.shape[0]):
        if j != 1:
            change = dx * cov[0, j] - dr * cov[2, j]
            cov[1, j] += change
            cov[j, 1] += change
        cov[j, j] += shape[j] * drift


LOOPS: dict[Callable, Callable] = {
    **bank_vectors.LOOPS,
    solve: solve_loop,
    harmonic_row: harmonic_row_loop,
    spread_row: spread_row_loop,
    take_error: take_error_loop,
    carry: carry_loop,
}
"""NumPy form -> loop form."""
