"""Sums over small arrays, each in two forms: a few NumPy calls, and the same as loops for the compiler.

Everything else in the kernels is one source; `LOOPS` names the loops that stand in for the calls when it is compiled.
"""

import math
from collections.abc import Callable

import numpy as np


def add_waves(orders, room, fields, keep, turn, value):
    """Let `fields` (2, 2, m) fade by `keep` and add cos, sin of `orders` (m,) times `turn`: times `value`, and alone.
    `room` (2, m) is overwritten."""
    fields *= keep
    angles = orders * turn
    np.cos(angles, out=room[0])
    np.sin(angles, out=room[1])
    fields[1] += room
    room *= value
    fields[0] += room


def add_waves_loop(orders, room, fields, keep, turn, value):
    """The angles are equally spaced: products of `side` fine and `side` coarse turns, so two sines suffice."""
    side = int(math.sqrt(orders.shape[0]) + 0.5)
    fine_c, fine_s = room[0], room[1]
    step_c, step_s = math.cos(turn), math.sin(turn)
    leap_c, leap_s = math.cos(side * turn), math.sin(side * turn)
    c, s = 1.0, 0.0
    for i in range(side):
        fine_c[i], fine_s[i] = c, s
        c, s = c * step_c - s * step_s, s * step_c + c * step_s
    c, s = 1.0, 0.0
    for j in range(side):
        block = fields[:, :, j * side : (j + 1) * side]
        readings_c, readings_s, weights_c, weights_s = block[0, 0], block[0, 1], block[1, 0], block[1, 1]
        for i in range(side):
            cosine = c * fine_c[i] - s * fine_s[i]
            sine = s * fine_c[i] + c * fine_s[i]
            readings_c[i] = keep * readings_c[i] + value * cosine
            readings_s[i] = keep * readings_s[i] + value * sine
            weights_c[i] = keep * weights_c[i] + cosine
            weights_s[i] = keep * weights_s[i] + sine
        c, s = c * leap_c - s * leap_s, s * leap_c + c * leap_s


def explain(fields, power):
    """Into `power` (count,): the squares that a sinusoid of each wavenumber explains beyond a constant."""
    count = power.shape[0]
    weight = fields[1, 0, 0]
    waves = fields[1, :, :count]
    right = fields[0, :, :count] - fields[0, 0, 0] / weight * waves
    double = fields[1, 0, : 2 * count : 2]
    squares = waves * waves / -weight
    squares += 0.5 * weight
    double = 0.5 * double
    squares[0] += double
    squares[1] -= double
    cross = 0.5 * fields[1, 1, : 2 * count : 2] - waves[0] * waves[1] / weight
    determinant = squares[0] * squares[1] - cross * cross
    explained = right * right * squares[::-1]
    total = explained[0] + explained[1] - 2 * cross * right[0] * right[1]
    # Windows that do not resolve a wavenumber explain nothing with it.
    determinant[determinant < 1e-3 * weight * weight] = np.inf
    np.divide(total, determinant, out=power)


def explain_loop(fields, power):
    """The same, wavenumber by wavenumber."""
    readings_c, readings_s, weights_c, weights_s = fields[0, 0], fields[0, 1], fields[1, 0], fields[1, 1]
    weight = weights_c[0]
    mean, inverse, least = readings_c[0] / weight, 1.0 / weight, 1e-3 * weight * weight
    for j in range(power.shape[0]):
        c, s = weights_c[j], weights_s[j]
        yc, ys = readings_c[j] - mean * c, readings_s[j] - mean * s
        cc = 0.5 * (weight + weights_c[2 * j]) - c * c * inverse
        ss = 0.5 * (weight - weights_c[2 * j]) - s * s * inverse
        cs = 0.5 * weights_s[2 * j] - c * s * inverse
        determinant = cc * ss - cs * cs
        trusted = determinant >= least
        power[j] = (yc * yc * ss + ys * ys * cc - 2 * cs * yc * ys) / determinant if trusted else 0.0


def add_up(power, start, score):
    """Into `score` (n,): the power of each fundamental from index `start` on, that of its second and third harmonic
    with half and a third of the weight: a submultiple that owns the true fundamental as its harmonic must not win."""
    stop = start + score.shape[0]
    score[:] = power[start:stop]
    for order in (2, 3):
        harmonics = power[order * start : order * stop : order]
        score[: harmonics.shape[0]] += harmonics / order


def add_up_loop(power, start, score):
    """The same, fundamental by fundamental."""
    for i in range(score.shape[0]):
        index = start + i
        total = power[index]
        if 2 * index < power.shape[0]:
            total += power[2 * index] / 2
        if 3 * index < power.shape[0]:
            total += power[3 * index] / 3
        score[i] = total


def largest(values, start):
    """Index of the largest of `values` from `start` on."""
    return start + int(np.argmax(values[start:]))


def largest_loop(values, start):
    """The same."""
    best = start
    for i in range(start, values.shape[0]):
        if values[i] > values[best]:
            best = i
    return best


def middle(values):
    """The upper median."""
    return np.partition(values, values.shape[0] // 2)[values.shape[0] // 2]


def middle_loop(values):
    """The value that half of the others are not above."""
    half = values.shape[0] // 2
    for value in values:
        smaller = equal = 0
        for other in values:
            smaller += other < value
            equal += other == value
        if smaller <= half < smaller + equal:
            return value
    return math.nan


def fade_into(average, power, keep, share):
    """average = keep average + share power."""
    average *= keep
    average += share * power


def fade_into_loop(average, power, keep, share):
    """The same."""
    for i in range(power.shape[0]):
        average[i] = keep * average[i] + share * power[i]


def normal_equations(mixing, fields, index, gram, right):
    """Normal equations of 1, cos, sin, cos 2 ... of the wavenumber `index`, from the sums at its multiples.

    `mixing` (size^2, 2, size) turns the moments into `gram` (size, size). Rows that need moments beyond the bank are
    not usable.
    """
    size = right.shape[0]
    moments = np.zeros((2, size))
    known = min(size - 1, (fields.shape[2] - 1) // index)
    moments[:, : known + 1] = fields[1, :, : known * index + 1 : index]
    np.dot(mixing.reshape(size * size, 2 * size), moments.reshape(-1), out=gram.reshape(-1))
    right[:] = 0.0
    right[0] = fields[0, 0, 0]
    known = min(size // 2, known)
    right[1 : 2 * known + 1] = fields[0, :, index : known * index + 1 : index].T.reshape(-1)


def normal_equations_loop(mixing, fields, index, gram, right):
    """The same; most of `mixing` is zero, each entry has two moments."""
    size = right.shape[0]
    last = fields.shape[2] - 1
    for row in range(size):
        for column in range(row + 1):
            total = 0.0
            h, k = (row + 1) // 2, (column + 1) // 2
            for order in (h - k, h + k):
                if order * index <= last:
                    at = row * size + column
                    total += mixing[at, 0, order] * fields[1, 0, order * index]
                    total += mixing[at, 1, order] * fields[1, 1, order * index]
                if k == 0:
                    break
            gram[row, column] = gram[column, row] = total
    right[:] = 0.0
    right[0] = fields[0, 0, 0]
    for h in range(1, size // 2 + 1):
        if h * index <= last:
            right[2 * h - 1] = fields[0, 0, h * index]
            right[2 * h] = fields[0, 1, h * index]


def solve(gram, right, size, answer):
    """Solve the leading `size` equations of a positive definite matrix into `answer`; its product with `right`."""
    answer[:size] = np.linalg.solve(gram[:size, :size], right[:size])
    return np.dot(answer[:size], right[:size])


def solve_loop(gram, right, size, answer):
    """The same by Cholesky's factors, in place of the matrix."""
    for i in range(size):
        for j in range(i + 1):
            total = gram[i, j]
            for k in range(j):
                total -= gram[i, k] * gram[j, k]
            gram[i, j] = math.sqrt(total) if i == j else total / gram[j, j]
    for i in range(size):
        total = right[i]
        for k in range(i):
            total -= gram[i, k] * answer[k]
        answer[i] = total / gram[i, i]
    product = 0.0
    for i in range(size - 1, -1, -1):
        total = answer[i]
        for k in range(i + 1, size):
            total -= gram[k, i] * answer[k]
        answer[i] = total / gram[i, i]
        product += answer[i] * right[i]
    return product


def harmonic_row(orders, state, present, row):
    """Fill `row` with the derivative of the reading by the state, of the first `present` harmonics; the reading.

    The state is wavenumber, phase, shear, offset, then in-phase and quadrature amplitudes, the first of these none.
    """
    count = orders.shape[0]
    angles = orders[:present] * state[1]
    cosine, sine = np.cos(angles), np.sin(angles)
    row[4:] = 0.0
    row[4 : 4 + present] = cosine
    row[4 + count : 4 + count + present] = sine
    quadrature = state[4 + count : 4 + count + present]
    row[1] = np.dot(orders[:present], quadrature * cosine - state[4 : 4 + present] * sine)
    row[4 + count] = 0.0
    return np.dot(row[3:], state[3:])


def harmonic_row_loop(orders, state, present, row):
    """The same by recursion from the first harmonic."""
    count = orders.shape[0]
    cosine, sine = math.cos(state[1]), math.sin(state[1])
    row[4:] = 0.0
    reading, slope = state[3], 0.0
    c, s = 1.0, 0.0
    for h in range(present):
        c, s = c * cosine - s * sine, s * cosine + c * sine
        row[4 + h], row[4 + count + h] = c, s
        in_phase, quadrature = state[4 + h], state[4 + count + h]
        reading += in_phase * c + quadrature * s
        slope += orders[h] * (quadrature * c - in_phase * s)
    row[1] = slope
    row[4 + count] = 0.0
    return reading


def spread_row(cov, row, across):
    """across = cov row; returns row across."""
    np.dot(cov, row, out=across)
    return np.dot(row, across)


def spread_row_loop(cov, row, across):
    """The same; `cov` is symmetric, and the row's wavenumber and shear entries are zero."""
    size = row.shape[0]
    across[:] = 0.0
    for j in range(size):
        if row[j] != 0.0:
            factor = row[j]
            for i in range(size):
                across[i] += factor * cov[j, i]
    total = 0.0
    for i in range(size):
        total += row[i] * across[i]
    return total


def take_error(state, cov, across, variance, error):
    """state += across error / variance, cov -= across across' / variance."""
    gain = across / variance
    state += gain * error
    cov -= np.multiply.outer(across, gain)


def take_error_loop(state, cov, across, variance, error):
    """The same, row by row."""
    size = state.shape[0]
    for i in range(size):
        gain = across[i] / variance
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
    add_waves: add_waves_loop,
    explain: explain_loop,
    add_up: add_up_loop,
    largest: largest_loop,
    middle: middle_loop,
    fade_into: fade_into_loop,
    normal_equations: normal_equations_loop,
    solve: solve_loop,
    harmonic_row: harmonic_row_loop,
    spread_row: spread_row_loop,
    take_error: take_error_loop,
    carry: carry_loop,
}
"""NumPy form -> loop form."""
