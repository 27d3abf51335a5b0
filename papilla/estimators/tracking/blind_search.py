"""Where a velocity-blind tracker may lock: a bank of chirps, frequency times relative chirp rate, over one window.

A chirp of relative rate a warps time: tau = t + a t^2 / 2 counts the periods of every frequency and of its harmonics
alike. The share of the weighted energy that a harmonic sum explains is the likelihood (Quinn & Thomson 1991,
doi:10.1093/biomet/78.1.65), with a price for each harmonic: so f is preferred to f/2 and to 2f.
"""

import math
from typing import NamedTuple

import numpy as np

from papilla.estimators.tracking.vectors import solve

CHIRPS = (0.0, 2.5, 6.0, 12.0)
"""Relative chirp rates of the bank in 1/s, of either sign: what a stroke of 1 Hz has over 83 % of its time."""
HARMONICS = 3


class SearchSettings(NamedTuple):
    """window, stride: samples of the bank after and before averaging `stride` of them; low, high: first and one past
    the last place of the frequency grid; step: its spacing in rad/s; dt: seconds from one averaged sample to the next;
    chirps: (a,) rates; weights: (window,); table: (a * (high - low) * 2, window) cosine and sine of each chirp;
    evidence: nats that a nominee must have over noise; total, effective: sum of the weights, number of samples that
    they are worth."""

    window: int
    stride: int
    low: int
    high: int
    step: float
    dt: float
    chirps: np.ndarray
    weights: np.ndarray
    table: np.ndarray
    evidence: float
    total: float
    effective: float


class Room(NamedTuple):
    """Arrays that a look overwrites: readings of the window and the same turned around (2, window), their products with
    the table (., 2), the fraction explained (2 a, frequencies), the nominee (6,), and what a fit needs."""

    pair: np.ndarray
    parts: np.ndarray
    share: np.ndarray
    nominee: np.ndarray
    row: np.ndarray
    gram: np.ndarray
    right: np.ndarray
    solved: np.ndarray


def search_room(settings: SearchSettings) -> Room:
    """Room for the looks of one bank."""
    size = 2 * HARMONICS + 1
    shape = {
        "pair": (2, settings.window),
        "parts": (len(settings.table), 2),
        "share": (2 * len(settings.chirps), settings.high - settings.low),
        "nominee": (6,),
        "row": (size,),
        "gram": (size, size),
        "right": (size,),
        "solved": (size,),
    }
    return Room(**{name: np.zeros(shape[name]) for name in Room._fields})


def search_settings(rate: float, lowest: float, highest: float, periods: float, evidence: float) -> SearchSettings:
    """A bank from `lowest` to `highest` Hz whose window holds `periods` of the lowest."""
    stride = max(int(rate / (2.5 * highest)), 1)
    dt = stride / rate
    window = math.ceil(periods / lowest / dt)
    weights = np.hanning(window + 2)[1:-1]
    step = 0.5 / (window * dt)
    low, high = math.ceil(lowest / step - 1e-9), int(highest / step + 1e-9) + 1
    time = (np.arange(window) - 0.5 * (window - 1)) * dt
    chirps = np.array(CHIRPS)
    warped = time + 0.5 * chirps[:, None] * time**2
    angle = 2 * math.pi * step * np.arange(low, high)[:, None] * warped[:, None, :]
    table = np.stack([np.cos(angle), np.sin(angle)], axis=2).reshape(-1, window) * weights
    total = float(weights.sum())
    effective = total**2 / float(np.sum(weights**2))
    return SearchSettings(
        window, stride, low, high, 2 * math.pi * step, dt, chirps, weights, np.ascontiguousarray(table), evidence,
        total, effective,
    )  # fmt: skip


def gather(settings, ring, at, pair):
    """Fill `pair` (2, window) with the ring's readings less their mean, oldest first, and with them turned around.

    Returns (mean, weighted energy); the energy is negative where more than a quarter is missing, or all is one value.
    """
    window, stride = settings.window, settings.stride
    length = window * stride
    present, mean = 0.0, 0.0
    for row in range(window):
        total, count = 0.0, 0
        for sub in range(stride):
            value = ring[(at + row * stride + sub) % length]
            if not math.isnan(value):
                total += value
                count += 1
        pair[0, row] = total / count if count else math.nan
        if count:
            present += settings.weights[row]
            mean += settings.weights[row] * pair[0, row]
    if present < 0.75 * settings.total:
        return 0.0, -1.0
    mean /= present
    energy = 0.0
    for row in range(window):
        pair[0, row] = 0.0 if math.isnan(pair[0, row]) else pair[0, row] - mean
        pair[1, window - 1 - row] = pair[0, row]
        energy += settings.weights[row] * pair[0, row] * pair[0, row]
    # What rounding leaves of a constant is nothing to look at.
    return mean, energy if energy > settings.total * (1e-12 * mean) ** 2 else -1.0


def shares(settings, room, energy):
    """Fill `room.share` with the fraction of the energy that each chirp of the bank explains."""
    parts = room.parts
    for place in range(parts.shape[0]):
        for side in range(2):
            parts[place, side] = np.dot(settings.table[place], room.pair[side])
    count = settings.high - settings.low
    for a in range(settings.chirps.shape[0]):
        for j in range(count):
            at = 2 * (a * count + j)
            for side in range(2):
                power = parts[at, side] * parts[at, side] + parts[at + 1, side] * parts[at + 1, side]
                room.share[2 * a + side, j] = 2.0 * power / (settings.total * energy)


def best_place(settings, share):
    """(nats beyond the price, row, column of `share`, number of harmonics) of the likeliest place."""
    best, row, column, number = -1e300, 0, 0, 1
    price = math.log(settings.effective)
    count = settings.high - settings.low
    for i in range(share.shape[0]):
        for j in range(count):
            total = 0.0
            for h in range(1, HARMONICS + 1):
                place = h * (settings.low + j) - settings.low
                if place >= count:
                    break
                total += share[i, place]
                nats = -0.5 * settings.effective * math.log(1.0 - min(total, 0.9999)) - h * price
                if nats > best:
                    best, row, column, number = nats, i, j, h
    return best, row, column, number


def fit(settings, room, rate, chirp, number):
    """Weighted least squares of an offset and `number` harmonics of one chirp; the energy that is left.

    The coefficients, in `room.solved`, are those of 1, then cosine and sine of each harmonic about the window's middle.
    """
    size = 2 * number + 1
    row, gram, right = room.row, room.gram, room.right
    row[0] = 1.0
    gram[:] = 0.0
    right[:] = 0.0
    energy = 0.0
    for place in range(settings.window):
        time = (place - 0.5 * (settings.window - 1)) * settings.dt
        phase = rate * time * (1.0 + 0.5 * chirp * time)
        for h in range(1, number + 1):
            row[2 * h - 1], row[2 * h] = math.cos(h * phase), math.sin(h * phase)
        weight, reading = settings.weights[place], room.pair[0, place]
        energy += weight * reading * reading
        for i in range(size):
            right[i] += weight * reading * row[i]
            for j in range(size):
                gram[i, j] += weight * row[i] * row[j]
    for i in range(size):
        gram[i, i] += 1e-9 * settings.total
    return max(energy - solve(gram, right, size, room.solved), 0.0)


def nominate(settings, ring, at, room):
    """Look for a chirp in the ring (oldest reading at `at`); fill `room.nominee` for the middle of the window.

    It is (phase, w, g, offset, amplitude, residual variance). Returns the nats beyond noise and their price
    (negative where there is nothing to look at), and the variance of the window.
    """
    mean, energy = gather(settings, ring, at, room.pair)
    if energy <= 0.0:
        return -1.0, 0.0
    share, nominee, solved = room.share, room.nominee, room.solved
    shares(settings, room, energy)
    _, row, column, number = best_place(settings, share)
    shift = 0.0
    if 0 < column < settings.high - settings.low - 1:
        left, middle, right = share[row, column - 1], share[row, column], share[row, column + 1]
        bend = left - 2 * middle + right
        if bend < 0.0:
            shift = min(max(0.5 * (left - right) / bend, -0.5), 0.5)
    rate = (settings.low + column + shift) * settings.step
    chirp = settings.chirps[row // 2] * (1 - 2 * (row % 2))
    left_over = fit(settings, room, rate, chirp, number)
    nominee[0] = math.atan2(-solved[2], solved[1])
    nominee[1] = rate
    nominee[2] = rate * chirp
    nominee[3] = mean + solved[0]
    nominee[4] = math.sqrt(solved[1] * solved[1] + solved[2] * solved[2])
    nominee[5] = left_over / settings.total * settings.stride
    ratio = max(left_over / energy, 1e-6)
    nats = -0.5 * settings.effective * math.log(ratio) - number * math.log(settings.effective)
    return nats, energy / settings.total * settings.stride


KERNELS = (solve, gather, shares, best_place, fit, nominate)
