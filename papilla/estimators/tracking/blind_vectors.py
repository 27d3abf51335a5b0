"""Sums over the small arrays of the velocity-blind tracker as a few NumPy calls; `blind_loops` has them as loops."""

import math

import numpy as np


def carry_motion(cov, dt, stiff, rate):
    """cov (n, m) := F cov F' of the phase's motion (rows and columns 0 ... 3); columns from n on are only led by F."""
    turned = np.array(
        [
            [1.0, dt, 0.5 * dt * dt, 0.0],
            [0.0, 1.0, dt, 0.0],
            [0.0, -dt * stiff, 1.0 - dt * dt * stiff, -dt * rate],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
    cov[:4] = turned @ cov[:4]
    cov[:, :4] = cov[:, :4] @ turned.T


def add_diagonal(cov, drift, factor):
    """Add `factor` times `drift` (n,) to the diagonal of cov (n, m)."""
    cov.reshape(-1)[:: cov.shape[1] + 1] += factor * drift


def faded_row(state, spread, count, row):
    """Fill `row` (n,) with the mean derivative of the reading, of `count` harmonics, for a phase of variance `spread`.

    Returns the mean reading, and the variance that its curvature adds to the linear part.
    """
    phase, _, _, _, offset, amplitude, *others = state.tolist()
    cosine, sine, fade = math.cos(phase), math.sin(phase), math.exp(-0.5 * spread)
    reading, slope = offset + amplitude * cosine * fade, -amplitude * sine * fade
    curved = 0.5 * amplitude * amplitude * (1.0 - fade * fade * (1.0 + spread))
    filled = [0.0, 0.0, 0.0, 0.0, 1.0, cosine * fade]
    c, s, odd, weight = cosine, sine, fade, fade
    for h in range(2, count + 1):
        c, s = c * cosine - s * sine, s * cosine + c * sine
        odd *= fade * fade
        weight *= odd
        in_phase, quadrature = others[2 * h - 4], others[2 * h - 3]
        reading += weight * (in_phase * c + quadrature * s)
        slope += h * weight * (quadrature * c - in_phase * s)
        power = 0.5 * (in_phase * in_phase + quadrature * quadrature)
        curved += power * (1.0 - weight * weight * (1.0 + h * h * spread))
        filled += [weight * c, weight * s]
    filled[0] = slope
    row[: len(filled)] = filled
    row[len(filled) :] = 0.0
    return reading, max(curved, 0.0)


def spread_rows(cov, row, across):
    """across (m,) = row (n,) times cov (n, m); returns the row's own variance."""
    np.dot(row, cov, out=across)
    return float(np.dot(row, across[: row.size]))


def take_rows(state, cov, pins, across, variance, error):
    """state (m,) += across error / variance, cov (n, m) -= its first n times across; pins (m - n,) lose their part."""
    gain = across / variance
    state += error * gain
    rows = cov.shape[0]
    cov -= np.multiply.outer(gain[:rows], across)
    pins -= gain[rows:] * across[rows:]


def symmetrise(cov):
    """Remove what rounding adds to the difference of the square part of cov (n, m) and its transpose."""
    square = cov[:, : cov.shape[0]]
    square[:] = 0.5 * (square + square.T)


def centred(weights, known, readings, pair):
    """Fill `pair` (2, window) with the readings less their weighted mean, and with them turned around; missing: 0.

    Returns (mean, weighted energy, weight present).
    """
    here = weights * known
    present = float(here.sum())
    mean = float(np.dot(here, readings)) / present if present > 0.0 else 0.0
    np.subtract(readings, mean, out=pair[0])
    pair[0] *= known
    pair[1] = pair[0, ::-1]
    return mean, float(np.dot(weights, pair[0] * pair[0])), present


def correlate(pair, table, parts):
    """parts (2, count) = pair (2, window) times table (window, count)."""
    np.dot(pair, table, out=parts)


def add_squares(parts, factor, share):
    """share (2, count) += factor parts^2."""
    share += factor * parts * parts


def comb(share, low, teeth):
    """Largest sum of `share` (rows, count) over `teeth` harmonics of one frequency; column 0 is `low` grid steps.

    Returns (the sum, its row, its column); the sum is -1 where no frequency has that many harmonics in the grid.
    """
    count = share.shape[1]
    columns = (low + count - 1) // teeth + 1 - low
    if columns <= 0:
        return -1.0, 0, 0
    total = share[:, :columns].copy()
    for h in range(2, teeth + 1):
        total += share[:, h * low - low : h * (low + columns) - low : h]
    row, column = divmod(int(np.argmax(total)), columns)
    return float(total[row, column]), row, column


def unrolled(ring, at, stride, known, values):
    """Fill `values` (n,) with the ring's from place `at` on, averaged over `stride`; `known` with 1, or 0 for none."""
    rows = ring.take(np.arange(at, at + known.size * stride), mode="wrap").reshape(known.size, stride)
    here = rows == rows
    count = here.sum(axis=1)
    np.minimum(count, 1.0, out=known)
    np.divide(np.where(here, rows, 0.0).sum(axis=1), np.maximum(count, 1), out=values)


def demodulated(rate, chirp, times, weighted):
    """(sum of cos, sum of sin) of the phase rate t + chirp t^2 / 2 times `weighted` (n,)."""
    phase = times * (rate + 0.5 * chirp * times)
    return float(np.dot(np.cos(phase), weighted)), float(np.dot(np.sin(phase), weighted))


def faded_block(theta, spread, count, times, known, values, basis, residual):
    """`faded_row` of a block of readings (m,) at `times` before theta's: basis (n, m), and residual (m,) of the values.

    Returns the variance that the curvature adds.
    """
    orders = np.arange(1.0, count + 1)
    weights = np.exp(-0.5 * spread * orders * orders)
    phase = theta[0] + times * (theta[1] + 0.5 * theta[2] * times)
    waves = np.exp(1j * np.multiply.outer(orders, phase)) * np.multiply.outer(weights, known)
    amplitudes = theta[4 : 2 * count + 4].reshape(count, 2)
    in_phase, quadrature = amplitudes[:, 0].copy(), amplitudes[:, 1]
    in_phase[0], quadrature = theta[5], np.concatenate(([0.0], quadrature[1:]))
    basis[1:] = 0.0
    basis[4] = known
    basis[5] = waves.real[0]
    basis[6 : 2 * count + 4 : 2], basis[7 : 2 * count + 4 : 2] = waves.real[1:], waves.imag[1:]
    np.subtract(known * values, theta[4:] @ basis[4:], out=residual)
    slope = (orders * quadrature) @ waves.real - (orders * in_phase) @ waves.imag
    basis[0] = slope
    np.multiply(slope, times, out=basis[1])
    np.multiply(basis[1], 0.5 * times, out=basis[2])
    power = 0.5 * (in_phase * in_phase + quadrature * quadrature)
    return max(float(np.dot(power, 1.0 - weights * weights * (1.0 + spread * orders * orders))), 0.0)


def take_block(theta, cov, basis, residual, noise, square, solved):
    """Kalman update of theta (n,) and cov (n, n) with the residuals (m,) of a block in white noise of that variance.

    Returns (squared residuals over their covariance, logarithm of its determinant). `solved` (n + 1, m) is
    overwritten, `square` (m, m) for the loops.
    """
    spread = cov @ basis
    covariance = basis.T @ spread
    covariance.reshape(-1)[:: residual.size + 1] += noise
    root = np.linalg.cholesky(covariance)
    solved[:-1], solved[-1] = spread, residual
    whitened = np.linalg.solve(root, solved.T)
    theta += whitened[:, :-1].T @ whitened[:, -1]
    cov -= whitened[:, :-1].T @ whitened[:, :-1]
    return float(np.dot(whitened[:, -1], whitened[:, -1])), 2.0 * float(np.log(root.diagonal()).sum())


def weighed(known, told, costs, blank):
    """Sum of the costs (n,) that are told, or `blank`, of the readings that are known."""
    return float(np.dot(known, np.where(told > 0.0, costs, blank)))


def begin_with(theta, spread, state, cov):
    """The leading n of state and of the columns of cov: those of a fit (n,) and (n, n)."""
    state[: theta.size] = theta
    cov[:, : theta.size] = spread


VECTORS = (
    carry_motion,
    add_diagonal,
    faded_row,
    spread_rows,
    take_rows,
    symmetrise,
    unrolled,
    demodulated,
    faded_block,
    take_block,
    weighed,
    centred,
    correlate,
    add_squares,
    comb,
    begin_with,
)
