"""Arithmetic of the wavenumber bank: sums over a fading window, and the least-squares spectrum they hold.

The window fades with distance and time. At the wavenumbers k_j = j step, the sums of w y exp(j k x) and w exp(j k x)
give the exact weighted least squares of b + a cos kx + c sin kx, for windows shorter than a period too; at the
multiples of one of them, that of a whole harmonic series. Source: Zechmeister & Kürster (2009),
doi:10.1051/0004-6361:200811296.
"""

import math
from typing import NamedTuple

import numpy as np

from papilla.estimators.tracking.bank_vectors import (
    SIDE,
    add_waves,
    explain,
    mixing_of_moments,
    normal_equations,
    turns_of_rows,
)
from papilla.estimators.tracking.compiled import scalars
from papilla.estimators.tracking.vectors import solve

WEIGHT, READING, SQUARE, LEVER, SPREAD, PLACE, ORIGIN, RIVAL, KEEP, SHIFT = range(10)
"""Scalars of a bank: sums of w, w y, w y^2, w d, w d^2 with d the distance from here, the wrapped position, the reading
that is subtracted, the sum of the tracker's own squared surprise over the same window, and what the window has faded
by and moved since the last reading."""
SUMS = 10
FIT = 3
"""Harmonics of a fit: with the phase, offset and wavenumber eight numbers, which a period of 20 samples can carry."""
WAVENUMBER, PHASE, AMPLITUDE, OFFSET, REST, EXPLAINED, LENGTH, SAMPLES, PARAMETERS, INDEX, SERIES = range(11)
"""A nominee: wavenumber, phase here, amplitude, offset, squares left, squares explained, length of the window, its
weight, parameters, index in the bank, and from `SERIES` on the in-phase and quadrature parts of harmonics 2, 3 ..."""
NOMINEE = SERIES + 2 * (FIT - 1)


class BankSettings(NamedTuple):
    """step: rad/mm between wavenumbers; low, high: indices searched; length: mm over which the window fades; keep: how
    much of it a sample keeps; period: 2 pi / step in mm; split: where the sums of the window begin among the fields;
    turns, mixing: what `add_waves` and `normal_equations` need."""

    step: float
    low: int
    high: int
    length: float
    keep: float
    period: float
    split: int
    turns: np.ndarray
    mixing: np.ndarray


class Bank(NamedTuple):
    """What a bank remembers: sums by wavenumber (2, n), scalars, last spectrum and nominee; then room to work."""

    fields: np.ndarray
    sums: np.ndarray
    power: np.ndarray
    nominee: np.ndarray
    fine: np.ndarray
    score: np.ndarray
    gram: np.ndarray
    right: np.ndarray
    fit: np.ndarray


REMEMBERED = ("fields", "sums", "power", "nominee")


def clear_bank(bank, reading):
    """Forget the window; `reading` becomes the origin of the readings, so that a large offset costs no digits."""
    bank.fields[:] = 0.0
    sums = bank.sums
    place = sums[PLACE]
    for index in range(SUMS):
        sums[index] = 0.0
    sums[PLACE], sums[ORIGIN], sums[KEEP] = place, reading, 1.0


def move_bank(settings, bank, dx):
    """Let the window fade while the finger moves on by dx in mm."""
    sums = bank.sums
    sums[KEEP] *= settings.keep * math.exp(-abs(dx) / settings.length)
    sums[SHIFT] += dx
    place = sums[PLACE] + dx
    sums[PLACE] = place - settings.period * math.floor(place / settings.period)


def feed_bank(settings, bank, reading):
    """Add one reading at the present position."""
    sums = bank.sums
    keep, dx, value = sums[KEEP], sums[SHIFT], reading - sums[ORIGIN]
    weight, lever = sums[WEIGHT], sums[LEVER]
    sums[SPREAD] = keep * (sums[SPREAD] - 2 * dx * lever + dx * dx * weight)
    sums[LEVER] = keep * (lever - dx * weight)
    sums[WEIGHT] = keep * weight + 1.0
    sums[READING] = keep * sums[READING] + value
    sums[SQUARE] = keep * sums[SQUARE] + value * value
    sums[RIVAL] *= keep
    sums[KEEP], sums[SHIFT] = 1.0, 0.0
    add_waves(settings.turns, bank.fine, bank.fields, settings.split, keep, settings.step * sums[PLACE], value)


def window_length(sums):
    """Length in mm of the rectangular window with this one's spread."""
    weight = sums[WEIGHT]
    mean = sums[LEVER] / weight
    return math.sqrt(12 * max(sums[SPREAD] / weight - mean * mean, 0.0))


def lowest(settings, sums, periods):
    """Index of the smallest wavenumber of which the window holds `periods`."""
    return max(settings.low, math.ceil(periods * settings.period / (window_length(sums) + 1e-9)))


def harmonics_of(settings, bank, index):
    """How many harmonics of a wavenumber are fitted: their normal equations need the sums at twice the highest."""
    return min(FIT, (bank.fields.shape[1] - settings.split - 1) // (2 * index))


def fit_series(settings, bank, index):
    """Least squares of a constant and harmonics of one wavenumber into `bank.fit`; the squares left."""
    size = 2 * harmonics_of(settings, bank, index) + 1
    normal_equations(settings.mixing, bank.fields, settings.split, index, bank.gram, bank.right)
    explained = solve(bank.gram, bank.right, size, bank.fit)
    return max(bank.sums[SQUARE] - explained, 0.0)


def between(below, middle, above):
    """Place of a peak among three neighbours, in steps: a window that fades exponentially has a Lorentzian line, whose
    reciprocal is a parabola."""
    if not min(below, middle, above) > 0.0:
        return 0.0
    left, centre, right = 1.0 / below, 1.0 / middle, 1.0 / above
    curvature = left - 2 * centre + right
    return min(max(0.5 * (left - right) / curvature, -0.5), 0.5) if curvature > 0.0 else 0.0


def look(settings, bank):
    """Take the spectrum of the window."""
    explain(bank.fields, settings.split, bank.power)


def nominate(settings, bank, best):
    """Fit the bank's wavenumber `best` into the nominee."""
    power, sums, nominee, fit = bank.power, bank.sums, bank.nominee, bank.fit
    rest = fit_series(settings, bank, best)
    shift = between(float(power[best - 1]), float(power[best]), float(power[best + 1])) * settings.step
    weight = sums[WEIGHT]
    wavenumber = settings.step * best
    a, b = float(fit[1]), float(fit[2])
    delay = math.atan2(b, a)
    nominee[WAVENUMBER] = wavenumber + shift
    # The phase is known best in the middle of the window: the shifted wavenumber turns it about that point.
    nominee[PHASE] = wavenumber * sums[PLACE] - delay - shift * sums[LEVER] / weight
    nominee[AMPLITUDE] = math.sqrt(a * a + b * b)
    nominee[OFFSET] = float(fit[0]) + sums[ORIGIN]
    nominee[REST] = rest
    nominee[EXPLAINED] = max(sums[SQUARE] - sums[READING] ** 2 / weight - rest, 0.0)
    nominee[LENGTH] = window_length(sums)
    nominee[SAMPLES] = weight
    nominee[INDEX] = float(best)
    harmonics = harmonics_of(settings, bank, best)
    nominee[PARAMETERS] = 2.0 * harmonics + 2.0
    for index in range(SERIES, NOMINEE):
        nominee[index] = 0.0
    for h in range(2, harmonics + 1):
        cosine, sine = math.cos(h * delay), math.sin(h * delay)
        a, b = float(fit[2 * h - 1]), float(fit[2 * h])
        nominee[SERIES + 2 * h - 4] = a * cosine + b * sine
        nominee[SERIES + 2 * h - 3] = b * cosine - a * sine


def rounding(bank):
    """Squares that are not told from none."""
    return max(1e-12 * bank.sums[SQUARE], 1e-300)


def prefer_multiple(settings, bank, order, evidence):
    """Give the nomination to `order` times the nominee's wavenumber unless the nominee is better by `evidence` nats.

    A submultiple explains all that the true wavenumber does, its harmonics being among its own. Whether it was given.
    """
    power, nominee = bank.power, bank.nominee
    best = int(nominee[INDEX]) * order
    if best >= settings.high - 1:
        return False
    for near in (best - 1, best + 1):
        if power[near] > power[best]:
            best = near
    rest = fit_series(settings, bank, best)
    floor = rounding(bank)
    if 0.5 * nominee[SAMPLES] * math.log((rest + floor) / (nominee[REST] + floor)) >= evidence:
        return False
    nominate(settings, bank, best)
    return True


def bank_arrays(high: int) -> tuple[int, np.ndarray, np.ndarray]:
    """`split`, `turns` and `mixing` of a bank whose highest wavenumber has this index."""
    # Products of two waves up to the highest need the window's sums up to twice its wavenumber.
    readings, weights = high // SIDE + 1, 2 * high // SIDE + 1
    return readings * SIDE, turns_of_rows(readings, weights), mixing_of_moments(FIT)


def new_bank(settings, compiled: bool) -> Bank:
    """A bank that knows nothing."""
    size, rows = 2 * FIT + 1, settings.turns.size - SIDE
    return Bank(
        fields=np.zeros((2, rows * SIDE)),
        sums=scalars(SUMS, compiled),
        power=np.zeros(settings.high + 1),
        nominee=scalars(NOMINEE, compiled),
        fine=np.zeros((2, SIDE)),
        score=np.zeros(settings.high - settings.low),
        gram=np.zeros((size, size)),
        right=np.zeros(size),
        fit=np.zeros(size),
    )
