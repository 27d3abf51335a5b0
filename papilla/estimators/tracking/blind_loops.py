"""The functions of `blind_vectors` by the same names, as loops for the compiler."""

import math


def carry_motion(cov, dt, stiff, rate):
    """The same, one shear after another."""
    half = 0.5 * dt * dt
    for j in range(cov.shape[1]):
        cov[0, j] += dt * cov[1, j] + half * cov[2, j]
        cov[1, j] += dt * cov[2, j]
        cov[2, j] -= dt * (stiff * cov[1, j] + rate * cov[3, j])
    for i in range(cov.shape[0]):
        cov[i, 0] += dt * cov[i, 1] + half * cov[i, 2]
        cov[i, 1] += dt * cov[i, 2]
        cov[i, 2] -= dt * (stiff * cov[i, 1] + rate * cov[i, 3])


def add_diagonal(cov, drift, factor):
    """The same, entry by entry."""
    for i in range(drift.shape[0]):
        cov[i, i] += factor * drift[i]


def faded_row(state, spread, count, row):
    """The same without lists."""
    cosine, sine, fade = math.cos(state[0]), math.sin(state[0]), math.exp(-0.5 * spread)
    amplitude = state[5]
    reading, slope = state[4] + amplitude * cosine * fade, -amplitude * sine * fade
    curved = 0.5 * amplitude * amplitude * (1.0 - fade * fade * (1.0 + spread))
    row[:] = 0.0
    row[4] = 1.0
    row[5] = cosine * fade
    c, s, odd, weight = cosine, sine, fade, fade
    for h in range(2, count + 1):
        c, s = c * cosine - s * sine, s * cosine + c * sine
        odd *= fade * fade
        weight *= odd
        at = 2 * h + 2
        in_phase, quadrature = state[at], state[at + 1]
        reading += weight * (in_phase * c + quadrature * s)
        slope += h * weight * (quadrature * c - in_phase * s)
        power = 0.5 * (in_phase * in_phase + quadrature * quadrature)
        curved += power * (1.0 - weight * weight * (1.0 + h * h * spread))
        row[at] = weight * c
        row[at + 1] = weight * s
    row[0] = slope
    return reading, max(curved, 0.0)


def spread_rows(cov, row, across):
    """The same; the row's entries of rate, chirp and stiffness are zero."""
    across[:] = 0.0
    total = 0.0
    for j in range(cov.shape[0]):
        factor = row[j]
        if factor != 0.0:
            for i in range(cov.shape[1]):
                across[i] += factor * cov[j, i]
    for j in range(cov.shape[0]):
        total += row[j] * across[j]
    return total


def take_rows(state, cov, pins, across, variance, error):
    """The same, row by row."""
    rows, inverse = cov.shape[0], 1.0 / variance
    for i in range(rows):
        gain = across[i] * inverse
        for j in range(cov.shape[1]):
            cov[i, j] -= gain * across[j]
    gain = inverse * error
    for j in range(cov.shape[1]):
        state[j] += across[j] * gain
    for j in range(pins.shape[0]):
        pins[j] -= across[rows + j] * across[rows + j] * inverse


def symmetrise(cov):
    """The same, pair by pair."""
    for i in range(cov.shape[0]):
        for j in range(i):
            cov[i, j] = cov[j, i] = 0.5 * (cov[i, j] + cov[j, i])


def centred(weights, known, readings, pair):
    """The same, reading by reading."""
    window, present, total, energy = weights.shape[0], 0.0, 0.0, 0.0
    for i in range(window):
        present += weights[i] * known[i]
        total += weights[i] * known[i] * readings[i]
    mean = total / present if present > 0.0 else 0.0
    for i in range(window):
        value = (readings[i] - mean) * known[i]
        pair[0, i] = pair[1, window - 1 - i] = value
        energy += weights[i] * value * value
    return mean, energy, present


def correlate(pair, table, parts):
    """The same, reading by reading."""
    parts[:] = 0.0
    for t in range(table.shape[0]):
        first, second = pair[0, t], pair[1, t]
        for j in range(table.shape[1]):
            parts[0, j] += first * table[t, j]
            parts[1, j] += second * table[t, j]


def add_squares(parts, factor, share):
    """The same, entry by entry."""
    for side in range(2):
        for j in range(parts.shape[1]):
            share[side, j] += factor * parts[side, j] * parts[side, j]


def comb(share, low, teeth):
    """The same, place by place."""
    columns = (low + share.shape[1] - 1) // teeth + 1 - low
    best, row, column = -1.0, 0, 0
    for i in range(share.shape[0]):
        for j in range(columns):
            total = share[i, j]
            for h in range(2, teeth + 1):
                total += share[i, h * (low + j) - low]
            if total > best:
                best, row, column = total, i, j
    return best, row, column


def unrolled(ring, at, stride, known, values):
    """The same, reading by reading."""
    for row in range(known.shape[0]):
        total, count = 0.0, 0
        for sub in range(stride):
            value = ring[(at + row * stride + sub) % ring.shape[0]]
            if not math.isnan(value):
                total += value
                count += 1
        known[row] = min(count, 1)
        values[row] = total / max(count, 1)


def demodulated(rate, chirp, times, weighted):
    """The same, reading by reading."""
    cosine, sine = 0.0, 0.0
    for i in range(times.shape[0]):
        phase = times[i] * (rate + 0.5 * chirp * times[i])
        cosine += weighted[i] * math.cos(phase)
        sine += weighted[i] * math.sin(phase)
    return cosine, sine


def faded_block(theta, spread, count, times, known, values, basis, residual):
    """The same, reading by reading."""
    fade = math.exp(-0.5 * spread)
    first = theta[5]
    curved = 0.5 * first * first * (1.0 - fade * fade * (1.0 + spread))
    for h in range(2, count + 1):
        weight = fade ** (h * h)
        power = 0.5 * (theta[2 * h + 2] * theta[2 * h + 2] + theta[2 * h + 3] * theta[2 * h + 3])
        curved += power * (1.0 - weight * weight * (1.0 + h * h * spread))
    basis[:] = 0.0
    for place in range(times.shape[0]):
        time = times[place]
        phase = theta[0] + time * (theta[1] + 0.5 * theta[2] * time)
        cosine, sine = math.cos(phase), math.sin(phase)
        c, s, odd, weight = known[place] * cosine, known[place] * sine, fade, fade
        basis[4, place], basis[5, place] = known[place], fade * c
        model, slope = theta[4] * known[place] + first * fade * c, -first * fade * s
        for h in range(2, count + 1):
            c, s = c * cosine - s * sine, s * cosine + c * sine
            odd *= fade * fade
            weight *= odd
            at = 2 * h + 2
            basis[at, place], basis[at + 1, place] = weight * c, weight * s
            model += theta[at] * basis[at, place] + theta[at + 1] * basis[at + 1, place]
            slope += h * (theta[at + 1] * basis[at, place] - theta[at] * basis[at + 1, place])
        residual[place] = known[place] * values[place] - model
        basis[0, place], basis[1, place], basis[2, place] = slope, slope * time, 0.5 * slope * time * time
    return max(curved, 0.0)


def take_block(theta, cov, basis, residual, noise, square, solved):
    """The same by Cholesky's factor, in place of the matrix."""
    size, count = basis.shape
    for i in range(size):
        for k in range(count):
            solved[i, k] = 0.0
        for j in range(size):
            for k in range(count):
                solved[i, k] += cov[i, j] * basis[j, k]
    for k in range(count):
        solved[size, k] = residual[k]
        for j in range(k + 1):
            square[k, j] = 0.0
    for i in range(size):
        for k in range(count):
            for j in range(k + 1):
                square[k, j] += basis[i, k] * solved[i, j]
    determinant = 0.0
    for k in range(count):
        square[k, k] += noise
        for j in range(k + 1):
            total = square[k, j]
            for i in range(j):
                total -= square[k, i] * square[j, i]
            square[k, j] = math.sqrt(total) if k == j else total / square[j, j]
        determinant += 2.0 * math.log(square[k, k])
        inverse = 1.0 / square[k, k]
        for i in range(size + 1):
            total = solved[i, k]
            for j in range(k):
                total -= square[k, j] * solved[i, j]
            solved[i, k] = total * inverse
    squares = 0.0
    for k in range(count):
        squares += solved[size, k] * solved[size, k]
    for i in range(size):
        for j in range(i + 1):
            total = 0.0
            for k in range(count):
                total += solved[i, k] * solved[j, k]
            cov[i, j] -= total
            if i != j:
                cov[j, i] -= total
        total = 0.0
        for k in range(count):
            total += solved[i, k] * solved[size, k]
        theta[i] += total
    return squares, determinant


def weighed(known, told, costs, blank):
    """The same, cost by cost."""
    total = 0.0
    for i in range(known.shape[0]):
        total += known[i] * (costs[i] if told[i] > 0.0 else blank)
    return total


def begin_with(theta, spread, state, cov):
    """The same, entry by entry."""
    for i in range(theta.shape[0]):
        state[i] = theta[i]
        for j in range(theta.shape[0]):
            cov[i, j] = spread[i, j]


LOOPS = (
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
