"""Where a velocity-blind tracker may lock: a bank of chirps over one window, then a fit that ends at the last reading.

A chirp of relative rate a warps time: tau = t + a t^2 / 2 counts the periods of every frequency and of its harmonics
alike. The share of the weighted energy that a harmonic sum explains is the likelihood (Quinn & Thomson 1991,
doi:10.1093/biomet/78.1.65), with a price for each harmonic: so f is preferred to f/2 and to 2f. The best place is
where a Kalman filter in few blocks begins, from the middle of the window to now. A look takes `parts` samples, a part
each.
"""

import math
from typing import NamedTuple

import numpy as np

from papilla.estimators.tracking.blind_filter import CHIRP, FIRST, OFFSET, PHI, RATE, STIFF, FilterSettings
from papilla.estimators.tracking.blind_vectors import (
    add_squares,
    carry_motion,
    centred,
    comb,
    correlate,
    demodulated,
    faded_block,
    take_block,
    unrolled,
    weighed,
)

CHIRPS = (0.0, 2.5, 6.0, 12.0)
"""Relative chirp rates of the bank in 1/s, of either sign: what a stroke of 1 Hz has over 83 % of its time."""
TEETH = 3
"""Harmonics that the bank adds up."""
LIVELY = (20.0, 5.0)
"""Noise of the motion that the fit expects, as a fraction of its rate a s^2 and sqrt(Hz): with a lock the first,
without one the two by turns. A lively one loses the phase of fine textures in noise, a calm one that of a hand."""
BENT = 3.2
"""Largest sd of a nominee's chirp in squared steps of the grid: by that it bends the phase by 4 rad at either end of
the window, and what is bent by more the bank would not have nominated."""
LEAPS = 10
"""Blocks in which the fit goes from the middle of the window to the last reading."""
MEAN, ENERGY, BEHIND, SWING, NOISE, ROWS, PRESENT, SPREAD, TAKEN, PAID, OFFERED, CALM = range(12)
"""Scalars of a look: mean and weighted energy of its window; readings since the time of theta; square of the nominee's
rate; noise variance of a reading; of the block that is next, how many readings, how many that are there, and the
variance of one; readings taken; twice the nats that they cost the lock, and the fit; whether
the look expects a calm motion."""


class SearchSettings(NamedTuple):
    """window, stride: samples of the bank after and before averaging `stride` of them; low: first place of the
    frequency grid; step: its spacing in rad/s; dt: seconds from one reading to the next; chirps: (a,) rates; hann:
    (window,) weights; times: (window,) s before the last reading; table: (2 a, window, count) cosine and sine of each
    chirp; evidence: nats that a nominee must have over noise; total, effective: sum of `hann`, number of samples that
    it is worth; band: rad/s beyond which a harmonic is not expected; lively: noises of the motion in the fit, as
    `blind_filter`'s jerk; start: sd of the stiffness, 1/s^2; parts: samples that a look takes."""

    window: int
    stride: int
    low: int
    step: float
    dt: float
    chirps: np.ndarray
    hann: np.ndarray
    times: np.ndarray
    table: np.ndarray
    evidence: float
    total: float
    effective: float
    band: float
    lively: tuple[float, float]
    start: float
    parts: int


class Look(NamedTuple):
    """Arrays of a look: scalars, readings of the window and the same turned around (2, window), fraction explained
    (2 a, count), state of the fit (n,) as in `blind_filter` and its covariance, basis and residual of the
    block that is next; those from `values` on only within a sample."""

    scalars: np.ndarray
    pair: np.ndarray
    share: np.ndarray
    theta: np.ndarray
    spread: np.ndarray
    basis: np.ndarray
    residual: np.ndarray
    values: np.ndarray
    known: np.ndarray
    told: np.ndarray
    correlated: np.ndarray
    square: np.ndarray
    solved: np.ndarray


LOOK_REMEMBERED = ("scalars", "pair", "share", "theta", "spread", "basis", "residual")


def look_room(settings: SearchSettings, size: int) -> Look:
    """Room for the looks of one bank, for a fit of `size` parameters."""
    groups, window, count = settings.table.shape
    shape = {
        "scalars": (12,),
        "pair": (2, window),
        "share": (groups, count),
        "theta": (size,),
        "spread": (size, size),
        "correlated": (2, count),
        "basis": (size, window),
        "square": (window, window),
        "solved": (size + 1, window),
    }
    return Look(**{name: np.zeros(shape.get(name, (window,))) for name in Look._fields})


def search_settings(
    rate: float, lowest: float, highest: float, periods: float, evidence: float, motion: FilterSettings
) -> SearchSettings:
    """A bank from `lowest` to `highest` Hz whose window holds `periods` of the lowest."""
    stride = max(int(rate / (2.5 * highest)), 1)
    dt = stride / rate
    window = math.ceil(periods / lowest / dt)
    hann = np.hanning(window + 2)[1:-1]
    step = 0.5 / (window * dt)
    low, high = math.ceil(lowest / step - 1e-9), int(highest / step + 1e-9) + 1
    time = (np.arange(window) - 0.5 * (window - 1)) * dt
    chirps = np.array(CHIRPS)
    warped = time + 0.5 * chirps[:, None] * time**2
    angle = 2 * math.pi * step * warped[:, :, None] * np.arange(low, high)
    table = np.stack([np.cos(angle), np.sin(angle)], axis=1) * hann[:, None]
    before = time - time[-1] - 0.5 * (stride - 1) / rate
    total = float(hann.sum())
    return SearchSettings(
        window=window,
        stride=stride,
        low=low,
        step=2 * math.pi * step,
        dt=1 / rate,
        chirps=chirps,
        hann=hann,
        times=before,
        table=np.ascontiguousarray(table.reshape(-1, window, high - low)),
        evidence=evidence,
        total=total,
        effective=total**2 / float(np.sum(hann**2)),
        band=motion.band,
        lively=LIVELY,
        start=motion.start,
        parts=2 + chirps.size + 2 * LEAPS,
    )


def search(settings, look, ring, costs, at, part):
    """Part 0 ... parts - 1 of a look at the ring (oldest reading at `at`); whether it is worth to go on."""
    chirps = settings.chirps.shape[0]
    if part == 0:
        return begin(settings, look, ring, at)
    if part <= chirps:
        explain(settings, look, part - 1)
        return True
    if part == chirps + 1:
        return nominate(settings, look) > settings.evidence
    step = part - chirps - 2
    if step % 2 == 0:
        foresee(settings, look, ring, costs, at, LEAPS - step // 2)
    else:
        leap(settings, look, step == 2 * LEAPS - 1)
    return True


def begin(settings, look, ring, at):
    """Take the window; nothing to look at where more than a quarter is missing, or all is one value."""
    window = settings.window * settings.stride
    unrolled(ring, at + ring.shape[0] - window, settings.stride, look.known, look.values)
    mean, energy, present = centred(settings.hann, look.known, look.values, look.pair)
    look.scalars[MEAN], look.scalars[ENERGY] = mean, energy
    look.scalars[BEHIND] = 0.5 * (window - 1)
    # What rounding leaves of a constant is nothing to look at.
    return present >= 0.75 * settings.total and energy > settings.total * (1e-12 * mean) ** 2


def explain(settings, look, number):
    """The fraction of the energy that a chirp of either sign explains at each frequency."""
    share = look.share[2 * number : 2 * number + 2]
    share[:] = 0.0
    for group in range(2 * number, 2 * number + 2):
        correlate(look.pair, settings.table[group], look.correlated)
        add_squares(look.correlated, 2.0 / (settings.total * float(look.scalars[ENERGY])), share)


def nominate(settings, look):
    """Set theta and its covariance, in the middle of the window, to the likeliest place of the bank.

    Returns its nats beyond noise and the price of its harmonics.
    """
    best, row, column, explained = -1e300, 0, 0, 0.0
    price = math.log(settings.effective)
    for teeth in range(1, TEETH + 1):
        total, i, j = comb(look.share, settings.low, teeth)
        nats = -0.5 * settings.effective * math.log(1.0 - min(total, 0.9999)) - teeth * price
        if nats > best:
            best, row, column, explained = nats, i, j, min(total, 0.9999)
    shift = 0.0
    if 0 < column < look.share.shape[1] - 1:
        left, middle = float(look.share[row, column - 1]), float(look.share[row, column])
        right = float(look.share[row, column + 1])
        bend = left - 2 * middle + right
        if bend < 0.0:
            shift = min(max(0.5 * (left - right) / bend, -0.5), 0.5)
    rate = (settings.low + column + shift) * settings.step
    chirp = settings.chirps[row // 2] * (1 - 2 * (row % 2)) * rate
    middle_s = 0.5 * (settings.times[0] + settings.times[settings.window - 1])
    np.multiply(settings.hann, look.pair[0], look.values)
    np.subtract(settings.times, middle_s, look.residual)
    cosine, sine = demodulated(rate, chirp, look.residual, look.values)
    scalars, theta = look.scalars, look.theta
    theta[:] = 0.0
    theta[PHI], theta[RATE], theta[CHIRP] = math.atan2(-sine, cosine), rate, chirp
    theta[OFFSET], theta[FIRST] = scalars[MEAN], 2.0 / settings.total * math.sqrt(cosine * cosine + sine * sine)
    open_up(settings, theta, look.spread)
    scalars[NOISE] = (1.0 - explained) * scalars[ENERGY] / settings.total * settings.stride
    scalars[SWING], scalars[TAKEN], scalars[PAID], scalars[OFFERED] = rate * rate, 0.0, 0.0, 0.0
    return best


def open_up(settings, theta, spread):
    """What is not known of a nominee: a place of the grid, its chirp, its amplitudes."""
    power = theta[FIRST] * theta[FIRST]
    spread[:] = 0.0
    spread[PHI, PHI] = 0.3
    spread[RATE, RATE] = settings.step * settings.step
    spread[CHIRP, CHIRP] = min(6.0 * theta[RATE], BENT * settings.step * settings.step) ** 2
    spread[STIFF, STIFF] = settings.start * settings.start
    spread[OFFSET, OFFSET] = spread[FIRST, FIRST] = 0.09 * power
    for i in range(FIRST + 1, theta.shape[0]):
        spread[i, i] = 0.16 * power / ((i - 2) // 2) ** 2


def carry(settings, look, time):
    """Theta and its covariance `time` seconds later."""
    theta, spread = look.theta, look.spread
    theta[PHI] += time * (theta[RATE] + 0.5 * time * theta[CHIRP])
    theta[RATE] += time * theta[CHIRP]
    theta[CHIRP] -= time * theta[STIFF] * theta[RATE]
    carry_motion(spread, time, theta[STIFF], theta[RATE])
    noise = settings.lively[int(look.scalars[CALM])] ** 2 * look.scalars[SWING] * time
    spread[CHIRP, CHIRP] += noise
    spread[RATE, RATE] += noise * time * time / 3.0


def foresee(settings, look, ring, costs, at, left):
    """Go on to the end of the next block, one of `left`; what it is expected to be, and what the lock paid for it."""
    scalars, theta, stride = look.scalars, look.theta, settings.stride
    behind = float(scalars[BEHIND])
    rows = min(int(behind) // stride // left, settings.window)
    # The middle of the window may lie between two readings.
    carry(settings, look, (rows * stride + behind - math.floor(behind)) * settings.dt)
    scalars[BEHIND] = math.floor(behind) - rows * stride
    first = (at + ring.shape[0] - int(behind)) % ring.shape[0]
    known, told, values, residual = look.known[:rows], look.told[:rows], look.values[:rows], look.residual[:rows]
    unrolled(ring, first, stride, known, values)
    unrolled(costs, first, stride, told, residual)
    blank = 1.0 + math.log(scalars[ENERGY] / settings.total * stride)
    scalars[PAID] += stride * weighed(known, told, residual, blank)
    count = theta.shape[0] // 2 - 2
    while count > 1 and count * abs(float(theta[RATE])) > settings.band:
        count -= 1
    times, vague = settings.times[settings.window - rows :], max(float(look.spread[PHI, PHI]), 0.0)
    curved = faded_block(theta, vague, count, times, known, values, look.basis[:, :rows], residual)
    scalars[SPREAD] = scalars[NOISE] / stride + curved
    scalars[ROWS], scalars[PRESENT] = rows, weighed(known, known, known, 0.0)


def leap(settings, look, last):
    """Take the block, and what it cost the fit; after the last one, go on to now."""
    scalars, stride, rows = look.scalars, settings.stride, int(look.scalars[ROWS])
    variance, noise, present = float(scalars[SPREAD]), float(scalars[NOISE]), float(scalars[PRESENT])
    if present > 0.0:
        squares, determinant = take_block(
            look.theta, look.spread, look.basis[:, :rows], look.residual[:rows], variance,
            look.square[:rows, :rows], look.solved[:, :rows],
        )  # fmt: skip
        # Of readings that were averaged the rest is noise as expected; those that are missing cost nothing.
        rest = (stride - 1.0) * (1.0 + math.log(noise)) + math.log(stride)
        scalars[OFFERED] += squares + determinant - (rows - present) * math.log(variance) + present * rest
        scalars[TAKEN] += present * stride
        scalars[NOISE] = noise * (0.5 + 0.5 * min(squares / present, 3.0))
    if last:
        carry(settings, look, scalars[BEHIND] * settings.dt)


KERNELS = (begin, explain, open_up, nominate, carry, foresee, leap, search)
