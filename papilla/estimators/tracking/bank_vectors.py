"""Sums of the wavenumber bank over its arrays, in the two forms that `vectors` describes.

`fields` (2, n) holds cosines and sines: those that the readings are multiplied with, then from `split` on those of the
window alone, both of wavenumber 0, 1, 2 ... in rows of `SIDE`.
"""

import math
from collections.abc import Callable

import numpy as np

SIDE = 32
"""Waves that are turned together: a whole number of vectors on any machine."""
RIDGE = 1e-3
"""Fraction of the weight that holds what a short window does not show near zero."""


def add_waves(turns, fine, fields, split, keep, turn, value):
    """Let `fields` fade by `keep` and add the waves at the angle `turn`, times `value` before `split`.

    Equally spaced angles: each row is the first, `fine` (2, SIDE), turned on. `turns` holds the imaginary orders of the
    first row, then those of the first wave of each row.
    """
    side = fine.shape[1]
    waves = np.exp(turns * turn)
    leaps = waves[side:]
    leaps[: split // side] *= value
    added = np.dot(leaps[:, None], waves[None, :side]).reshape(-1)
    fields *= keep
    fields[0] += added.real
    fields[1] += added.imag


def add_waves_loop(turns, fine, fields, split, keep, turn, value):
    """The same; the first row by doubling its length, so that two sines suffice."""
    side = fine.shape[1]
    step_c, step_s = math.cos(turn), math.sin(turn)
    fine[0, 0], fine[1, 0] = 1.0, 0.0
    known = 1
    while known < side:
        for i in range(known):
            fine[0, known + i] = fine[0, i] * step_c - fine[1, i] * step_s
            fine[1, known + i] = fine[0, i] * step_s + fine[1, i] * step_c
        step_c, step_s = step_c * step_c - step_s * step_s, 2 * step_c * step_s
        known *= 2
    c, s = value, 0.0
    for start in range(0, fields.shape[1], side):
        if start == split:
            c, s = 1.0, 0.0
        cosines, sines = fields[0, start : start + side], fields[1, start : start + side]
        fine_c, fine_s = fine[0], fine[1]
        for i in range(side):
            cosines[i] = keep * cosines[i] + (c * fine_c[i] - s * fine_s[i])
            sines[i] = keep * sines[i] + (s * fine_c[i] + c * fine_s[i])
        c, s = c * step_c - s * step_s, c * step_s + s * step_c


def turns_of_rows(readings: int, weights: int) -> np.ndarray:
    """The `turns` of `add_waves` for so many rows before and after `split`."""
    return 1j * np.concatenate([np.arange(SIDE), SIDE * np.arange(readings), SIDE * np.arange(weights)])


def explain(fields, split, power):
    """Into `power` (count,): the squares that a sinusoid of each wavenumber explains beyond a constant."""
    count = power.shape[0]
    weight = float(fields[0, split])
    waves = fields[:, split : split + count]
    right = fields[:, :count] - float(fields[0, 0]) / weight * waves
    double = 0.5 * fields[:, split : split + 2 * count : 2]
    squares = waves * waves
    squares *= -1 / weight
    squares += 0.5 * weight
    squares[0] += double[0]
    squares[1] -= double[0]
    cross = double[1] - waves[0] * waves[1] / weight
    determinant = squares[0] * squares[1] - cross * cross
    explained = right * right * squares[::-1]
    total = explained[0] + explained[1] - 2 * cross * right[0] * right[1]
    # Windows that do not resolve a wavenumber explain nothing with it.
    determinant[determinant < 1e-3 * weight * weight] = np.inf
    np.divide(total, determinant, out=power)


def explain_loop(fields, split, power):
    """The same, wavenumber by wavenumber."""
    readings_c, readings_s, weights_c, weights_s = fields[0], fields[1], fields[0, split:], fields[1, split:]
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
    """The same, order by order."""
    count = power.shape[0]
    for i in range(score.shape[0]):
        score[i] = power[start + i]
    for order in range(2, 4):
        for i in range(min(score.shape[0], (count - 1) // order - start + 1)):
            score[i] += power[order * (start + i)] / order


def largest(values, start):
    """Index of the largest of `values` from `start` on."""
    return start + int(values[start:].argmax())


def largest_loop(values, start):
    """The same."""
    best, most = start, values[start]
    for i in range(start, values.shape[0]):
        if values[i] > most:
            best, most = i, values[i]
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


def normal_equations(mixing, fields, split, index, gram, right):
    """Normal equations of 1, cos, sin, cos 2 ... of the wavenumber `index`, from the sums at its multiples.

    `mixing` (size^2, 2 size) turns the moments into `gram` (size, size). Rows that need moments beyond the bank are not
    usable.
    """
    size = right.shape[0]
    last = (fields.shape[1] - split - 1) // index
    moments = np.zeros((2, size))
    known = min(size - 1, last)
    moments[:, : known + 1] = fields[:, split : split + known * index + 1 : index]
    np.dot(mixing, moments.reshape(-1), out=gram.reshape(-1))
    known = min(size // 2, (split - 1) // index)
    right[:] = 0.0
    right[0] = fields[0, 0]
    right[1 : 2 * known : 2] = fields[0, index : known * index + 1 : index]
    right[2 : 2 * known + 1 : 2] = fields[1, index : known * index + 1 : index]


def normal_equations_loop(mixing, fields, split, index, gram, right):
    """The same, by products of sinusoids of h and k: sinusoids of h - k and h + k."""
    window, last = fields[:, split:], fields.shape[1] - split - 1
    weight = window[0, 0]
    gram[0, 0], right[0] = weight, fields[0, 0]
    for h in range(1, right.shape[0] // 2 + 1):
        row = 2 * h - 1
        known = h * index <= last
        gram[row, 0] = gram[0, row] = window[0, h * index] if known else 0.0
        gram[row + 1, 0] = gram[0, row + 1] = window[1, h * index] if known else 0.0
        known = h * index < split
        right[row] = fields[0, h * index] if known else 0.0
        right[row + 1] = fields[1, h * index] if known else 0.0
        for k in range(1, h + 1):
            column, apart, together = 2 * k - 1, (h - k) * index, (h + k) * index
            c, s = (0.5 * window[0, together], 0.5 * window[1, together]) if together <= last else (0.0, 0.0)
            below_c, below_s = (0.5 * window[0, apart], 0.5 * window[1, apart]) if apart <= last else (0.0, 0.0)
            gram[row, column] = gram[column, row] = below_c + c
            gram[row + 1, column + 1] = gram[column + 1, row + 1] = below_c - c
            gram[row + 1, column] = gram[column, row + 1] = s + below_s
            gram[row, column + 1] = gram[column + 1, row] = s - below_s
        gram[row, row] += RIDGE * weight
        gram[row + 1, row + 1] += RIDGE * weight


def mixing_of_moments(harmonics: int) -> np.ndarray:
    """(size^2, 2 size) with size = 2 harmonics + 1: the normal equations of 1, cos, sin, cos 2 ... from the sums of
    cos m, then of sin m, m = 0 ... 2 harmonics."""
    size = 2 * harmonics + 1
    mixing = np.zeros((size, size, 2, size))
    for row in range(size):
        for column in range(size):
            h, k = (row + 1) // 2, (column + 1) // 2
            sines = (row > 0 and row % 2 == 0) + (column > 0 and column % 2 == 0)
            if sines == 1:
                sine, cosine = (h, k) if row % 2 == 0 and row > 0 else (k, h)
                mixing[row, column, 1, h + k] += 0.5
                mixing[row, column, 1, abs(sine - cosine)] += math.copysign(0.5, sine - cosine)
            else:
                mixing[row, column, 0, abs(h - k)] += 0.5
                mixing[row, column, 0, h + k] += -0.5 if sines == 2 else 0.5
        if row:
            mixing[row, row, 0, 0] += RIDGE
    return mixing.reshape(size * size, 2 * size)


LOOPS: dict[Callable, Callable] = {
    add_waves: add_waves_loop,
    explain: explain_loop,
    add_up: add_up_loop,
    largest: largest_loop,
    middle: middle_loop,
    fade_into: fade_into_loop,
    normal_equations: normal_equations_loop,
}
"""NumPy form -> loop form."""
