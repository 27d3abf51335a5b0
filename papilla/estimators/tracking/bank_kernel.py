"""Arithmetic of the wavenumber bank: sums over a fading window, and the least-squares spectrum they hold.

The window fades with distance and time. At every wavenumber k_j = j step, the sums of w y exp(j k x), w exp(j k x) and
w exp(2j k x) give the exact weighted least squares of b + a cos kx + c sin kx, for windows shorter than a period too.
Source: Zechmeister & Kürster (2009), doi:10.1051/0004-6361:200811296.
"""

import math
from typing import NamedTuple

import numpy as np

WEIGHT, READING, SQUARE, LEVER, SPREAD, PLACE, ORIGIN, RIVAL = range(8)
"""Scalars of a bank: sums of w, w y, w y^2, w d, w d^2 with d the distance from here, the wrapped position, the reading
that is subtracted, and the sum of the tracker's own squared surprise over the same window."""
SUMS = 8


class BankSettings(NamedTuple):
    """step: rad/mm between wavenumbers; side: their number is its square; low, high: indices searched; length: mm over
    which the window fades; keep: how much of it a sample keeps; period: 2 pi / step in mm; second, third: weights of
    harmonics in the choice of the fundamental."""

    step: float
    side: int
    low: int
    high: int
    length: float
    keep: float
    period: float
    second: float
    third: float
    harmonics: int


def clear_bank(fields, sums, reading):
    """Forget the window; `reading` becomes the origin of the readings, so that a large offset costs no digits."""
    fields[:] = 0.0
    place = sums[PLACE]
    sums[:] = 0.0
    sums[PLACE] = place
    sums[ORIGIN] = reading


def move_bank(settings, fields, sums, dx):
    """Let the window fade while the finger moves on by dx in mm."""
    keep = settings.keep * math.exp(-abs(dx) / settings.length)
    weight, lever = sums[WEIGHT], sums[LEVER]
    sums[SPREAD] = keep * (sums[SPREAD] - 2 * dx * lever + dx * dx * weight)
    sums[LEVER] = keep * (lever - dx * weight)
    sums[WEIGHT] = keep * weight
    sums[READING] *= keep
    sums[SQUARE] *= keep
    sums[RIVAL] *= keep
    fields *= keep
    place = sums[PLACE] + dx
    sums[PLACE] = place - settings.period * math.floor(place / settings.period)


def feed_bank(settings, fields, sums, reading):
    """Add one reading at the present position."""
    value = reading - sums[ORIGIN]
    sums[WEIGHT] += 1.0
    sums[READING] += value
    sums[SQUARE] += value * value
    turn = settings.step * sums[PLACE]
    index = np.arange(settings.side) * turn
    # exp(j k x) of side^2 wavenumbers from 2 side of them: the wavenumbers are equally spaced.
    fine = np.exp(1j * index)
    coarse = np.exp(1j * (settings.side * index))
    wave = (coarse.reshape(-1, 1) * fine).reshape(-1)
    fields[0] += value * wave
    fields[1] += wave
    fields[2] += wave * wave


def spectrum(fields, sums):
    """(count,) squares that each wavenumber explains beyond a constant."""
    weight = sums[WEIGHT]
    mean = sums[READING] / weight
    cosine, sine = fields[1].real, fields[1].imag
    yc = fields[0].real - mean * cosine
    ys = fields[0].imag - mean * sine
    cc = 0.5 * (weight + fields[2].real) - cosine * cosine / weight
    ss = 0.5 * (weight - fields[2].real) - sine * sine / weight
    cs = 0.5 * fields[2].imag - cosine * sine / weight
    determinant = cc * ss - cs * cs
    # Windows that do not resolve a wavenumber explain nothing with it.
    trusted = determinant > 1e-3 * weight * weight
    safe = np.where(trusted, determinant, 1.0)
    a = np.where(trusted, (yc * ss - ys * cs) / safe, 0.0)
    b = np.where(trusted, (ys * cc - yc * cs) / safe, 0.0)
    return a * yc + b * ys


def moment(fields, sums, index):
    """Sum of w exp(j k x) at a multiple of the step, of either sign; 0 beyond the bank: windows average it out."""
    at = abs(index)
    size = fields.shape[1]
    if at == 0:
        return complex(sums[WEIGHT], 0.0)
    if at < size:
        value = fields[1, at]
    elif at % 2 == 0 and at // 2 < size:
        value = fields[2, at // 2]
    else:
        return complex(0.0, 0.0)
    return value if index > 0 else value.conjugate()


def fit_harmonics(fields, sums, index, harmonics, ridge, gram, right):
    """Least squares of a constant and `harmonics` harmonics of one wavenumber of the bank; returns the squares left.

    `right` (2 harmonics + 1) receives b, a_1, c_1, a_2 ...; `ridge` is a fraction of the weight that holds what the
    window does not show near zero.
    """
    size = 2 * harmonics + 1
    weight = sums[WEIGHT]
    gram[0, 0] = weight
    right[0] = sums[READING]
    for h in range(1, harmonics + 1):
        value = fields[0, h * index]
        right[2 * h - 1], right[2 * h] = value.real, value.imag
        first = moment(fields, sums, h * index)
        gram[0, 2 * h - 1] = gram[2 * h - 1, 0] = first.real
        gram[0, 2 * h] = gram[2 * h, 0] = first.imag
        for k in range(1, h + 1):
            plus, minus = moment(fields, sums, (h + k) * index), moment(fields, sums, (h - k) * index)
            gram[2 * h - 1, 2 * k - 1] = gram[2 * k - 1, 2 * h - 1] = 0.5 * (minus.real + plus.real)
            gram[2 * h, 2 * k] = gram[2 * k, 2 * h] = 0.5 * (minus.real - plus.real)
            gram[2 * h - 1, 2 * k] = gram[2 * k, 2 * h - 1] = 0.5 * (plus.imag - minus.imag)
            gram[2 * h, 2 * k - 1] = gram[2 * k - 1, 2 * h] = 0.5 * (plus.imag + minus.imag)
        gram[2 * h - 1, 2 * h - 1] += ridge * weight
        gram[2 * h, 2 * h] += ridge * weight
    moments = right[:size].copy()
    right[:size] = np.linalg.solve(gram[:size, :size], moments)
    return sums[SQUARE] - moments @ right[:size]


def add_up(settings, power, start, stop, score):
    """Score of each fundamental: its power, and that of its second and third harmonic with less weight.

    A submultiple that owns the true fundamental as its harmonic must not win.
    """
    size = power.shape[0]
    padded = np.zeros(3 * size)
    padded[:size] = power
    score[:] = padded[start:stop] + settings.second * padded[2 * start : 2 * stop : 2]
    score += settings.third * padded[3 * start : 3 * stop : 3]


def look(settings, fields, sums, power, average, share):
    """Take the spectrum of the window, and its `share` into the average over many windows, in units of their noise."""
    power[:] = spectrum(fields, sums)
    weight = sums[WEIGHT]
    total = sums[SQUARE] - sums[READING] ** 2 / weight
    rest = max(total - power[settings.low : settings.high].max(), 1e-3 * total)
    if rest > 0.0:
        average *= 1.0 - share
        average += share / rest * weight * power


def between(below, middle, above):
    """Place of a peak among three neighbours, in steps: a window that fades exponentially has a Lorentzian line, whose
    reciprocal is a parabola."""
    if not min(below, middle, above) > 0.0:
        return 0.0
    left, centre, right = 1.0 / below, 1.0 / middle, 1.0 / above
    curvature = left - 2 * centre + right
    return min(max(0.5 * (left - right) / curvature, -0.5), 0.5) if curvature > 0.0 else 0.0


def nominate(settings, fields, sums, power, best, found, gram, right):
    """Fit the bank's wavenumber `best`, into `found`: wavenumber, phase here, amplitude, offset, squares left, squares
    explained, length of the window, its weight, parameters, then c_2, s_2, c_3 ... relative to the phase."""
    size = power.shape[0]
    shift = between(power[best - 1], power[best], power[best + 1])
    weight = sums[WEIGHT]
    harmonics = max(min(settings.harmonics, (size - 1) // best), 1)
    rest = fit_harmonics(fields, sums, best, harmonics, 1e-3, gram, right)
    spread = max(sums[SPREAD] / weight - (sums[LEVER] / weight) ** 2, 0.0)
    wavenumber = settings.step * best
    delay = math.atan2(right[2], right[1])
    # The phase is known best in the middle of the window: the shifted wavenumber turns it about that point.
    lever = -sums[LEVER] / weight
    found[0] = wavenumber + shift * settings.step
    found[1] = wavenumber * sums[PLACE] - delay + shift * settings.step * lever
    found[2] = math.sqrt(right[1] ** 2 + right[2] ** 2)
    found[3] = right[0] + sums[ORIGIN]
    found[4] = max(rest, 0.0)
    found[5] = max(sums[SQUARE] - sums[READING] ** 2 / weight - rest, 0.0)
    found[6] = math.sqrt(12 * spread)
    found[7] = weight
    found[8] = 2.0 * harmonics + 2.0
    found[9:] = 0.0
    for h in range(2, harmonics + 1):
        cosine, sine = math.cos(h * delay), math.sin(h * delay)
        a, b = right[2 * h - 1], right[2 * h]
        found[2 * h + 5] = a * cosine + b * sine
        found[2 * h + 6] = b * cosine - a * sine


FIT = 3
FOUND = 2 * FIT + 7
