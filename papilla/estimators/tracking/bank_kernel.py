"""Arithmetic of the wavenumber bank: sums over a fading window, and the least-squares spectrum they hold.

The window fades with distance and time. At the wavenumbers k_j = j step, the sums of w y exp(j k x) and w exp(j k x)
give the exact weighted least squares of b + a cos kx + c sin kx, for windows shorter than a period too; at the
multiples of one of them, that of a whole harmonic series. Source: Zechmeister & Kürster (2009),
doi:10.1051/0004-6361:200811296.
"""

import math
from typing import NamedTuple

import numpy as np

from papilla.estimators.tracking.vectors import add_waves, explain, normal_equations, solve

WEIGHT, READING, SQUARE, LEVER, SPREAD, PLACE, ORIGIN, RIVAL, KEEP, SHIFT = range(10)
"""Scalars of a bank: sums of w, w y, w y^2, w d, w d^2 with d the distance from here, the wrapped position, the reading
that is subtracted, the sum of the tracker's own squared surprise over the same window, and what the window has faded
by and moved since the last reading."""
SUMS = 10
FIT = 3
"""Harmonics of a fit: with the phase, offset and wavenumber eight numbers, which a period of 20 samples can carry."""
RIDGE = 1e-3
"""Fraction of the weight that holds what a short window does not show near zero."""
WAVENUMBER, PHASE, AMPLITUDE, OFFSET, REST, EXPLAINED, LENGTH, SAMPLES, PARAMETERS, INDEX, SERIES = range(11)
"""A nominee: wavenumber, phase here, amplitude, offset, squares left, squares explained, length of the window, its
weight, parameters, index in the bank, and from `SERIES` on the in-phase and quadrature parts of harmonics 2, 3 ..."""
NOMINEE = SERIES + 2 * (FIT - 1)


class BankSettings(NamedTuple):
    """step: rad/mm between wavenumbers; low, high: indices searched; length: mm over which the window fades; keep: how
    much of it a sample keeps; period: 2 pi / step in mm; orders: (m,) 0, 1, 2 ...; mixing: of the normal equations."""

    step: float
    low: int
    high: int
    length: float
    keep: float
    period: float
    orders: np.ndarray
    mixing: np.ndarray


class Bank(NamedTuple):
    """What a bank remembers: sums by wavenumber (2, 2, m), scalars, last spectrum and nominee; then room to work."""

    fields: np.ndarray
    sums: np.ndarray
    power: np.ndarray
    nominee: np.ndarray
    room: np.ndarray
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
    sums[:] = 0.0
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
    keep, dx, value = float(sums[KEEP]), float(sums[SHIFT]), reading - float(sums[ORIGIN])
    weight, lever = float(sums[WEIGHT]), float(sums[LEVER])
    sums[SPREAD] = keep * (float(sums[SPREAD]) - 2 * dx * lever + dx * dx * weight)
    sums[LEVER] = keep * (lever - dx * weight)
    sums[WEIGHT] = keep * weight + 1.0
    sums[READING] = keep * float(sums[READING]) + value
    sums[SQUARE] = keep * float(sums[SQUARE]) + value * value
    sums[RIVAL] *= keep
    sums[KEEP], sums[SHIFT] = 1.0, 0.0
    add_waves(settings.orders, bank.room, bank.fields, keep, settings.step * float(sums[PLACE]), value)


def window_length(sums):
    """Length in mm of the rectangular window with this one's spread."""
    weight = float(sums[WEIGHT])
    mean = float(sums[LEVER]) / weight
    return math.sqrt(12 * max(float(sums[SPREAD]) / weight - mean * mean, 0.0))


def lowest(settings, sums, periods):
    """Index of the smallest wavenumber of which the window holds `periods`."""
    return max(settings.low, math.ceil(periods * settings.period / (window_length(sums) + 1e-9)))


def harmonics_of(bank, index):
    """How many harmonics of a wavenumber are fitted: their normal equations need the sums at twice the highest."""
    return min(FIT, (bank.fields.shape[2] - 1) // (2 * index))


def fit_series(settings, bank, index):
    """Least squares of a constant and harmonics of one wavenumber into `bank.fit`; the squares left."""
    size = 2 * harmonics_of(bank, index) + 1
    normal_equations(settings.mixing, bank.fields, index, bank.gram, bank.right)
    explained = solve(bank.gram, bank.right, size, bank.fit)
    return max(float(bank.sums[SQUARE]) - explained, 0.0)


def between(below, middle, above):
    """Place of a peak among three neighbours, in steps: a window that fades exponentially has a Lorentzian line, whose
    reciprocal is a parabola."""
    if not min(below, middle, above) > 0.0:
        return 0.0
    left, centre, right = 1.0 / below, 1.0 / middle, 1.0 / above
    curvature = left - 2 * centre + right
    return min(max(0.5 * (left - right) / curvature, -0.5), 0.5) if curvature > 0.0 else 0.0


def look(bank):
    """Take the spectrum of the window."""
    explain(bank.fields, bank.power)


def nominate(settings, bank, best):
    """Fit the bank's wavenumber `best` into the nominee."""
    power, sums, nominee, fit = bank.power, bank.sums, bank.nominee, bank.fit
    rest = fit_series(settings, bank, best)
    shift = between(power[best - 1], power[best], power[best + 1]) * settings.step
    weight = float(sums[WEIGHT])
    wavenumber = settings.step * best
    a, b = float(fit[1]), float(fit[2])
    delay = math.atan2(b, a)
    nominee[WAVENUMBER] = wavenumber + shift
    # The phase is known best in the middle of the window: the shifted wavenumber turns it about that point.
    nominee[PHASE] = wavenumber * float(sums[PLACE]) - delay - shift * float(sums[LEVER]) / weight
    nominee[AMPLITUDE] = math.sqrt(a * a + b * b)
    nominee[OFFSET] = float(fit[0] + sums[ORIGIN])
    nominee[REST] = rest
    nominee[EXPLAINED] = max(float(sums[SQUARE]) - float(sums[READING]) ** 2 / weight - rest, 0.0)
    nominee[LENGTH] = window_length(sums)
    nominee[SAMPLES] = weight
    nominee[INDEX] = best
    harmonics = harmonics_of(bank, best)
    nominee[PARAMETERS] = 2.0 * harmonics + 2.0
    nominee[SERIES:] = 0.0
    for h in range(2, harmonics + 1):
        cosine, sine = math.cos(h * delay), math.sin(h * delay)
        a, b = float(fit[2 * h - 1]), float(fit[2 * h])
        nominee[SERIES + 2 * h - 4] = a * cosine + b * sine
        nominee[SERIES + 2 * h - 3] = b * cosine - a * sine


def rounding(bank):
    """Squares that are not told from none."""
    return max(1e-12 * float(bank.sums[SQUARE]), 1e-300)


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


def new_bank(settings):
    """A bank that knows nothing."""
    size = 2 * FIT + 1
    return Bank(
        fields=np.zeros((2, 2, settings.orders.size)),
        sums=np.zeros(SUMS),
        power=np.zeros(settings.high + 1),
        nominee=np.zeros(NOMINEE),
        room=np.zeros((2, settings.orders.size)),
        score=np.zeros(settings.high - settings.low),
        gram=np.zeros((size, size)),
        right=np.zeros(size),
        fit=np.zeros(size),
    )


def mixing_of_moments():
    """(size^2, 2, size): the normal equations of 1, cos, sin, cos 2 ... from the sums of cos m, sin m, m = 0 ... 2 FIT.

    Products of sinusoids of h and k are sinusoids of h - k and h + k.
    """
    size = 2 * FIT + 1
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
    return mixing.reshape(size * size, 2, size)
