"""One sample of the guided tracker: the bank proposes, the phase filter tracks, the supervisor decides between them."""

import math
from typing import NamedTuple

import numpy as np

from papilla.estimators.tracking.bank_kernel import (
    LEVER,
    RIVAL,
    SPREAD,
    WEIGHT,
    BankSettings,
    add_up,
    between,
    clear_bank,
    feed_bank,
    fit_harmonics,
    look,
    moment,
    move_bank,
    nominate,
    spectrum,
)
from papilla.estimators.tracking.phase_kernel import (
    AGE,
    NOISE,
    SPEED,
    STRENGTH,
    TRUE_K,
    PhaseSettings,
    feed_phase,
    harmonic_model,
    harmonic_slope,
    lock_phase,
    move_phase,
    take_phase,
    turning,
)

LOCKED, VELOCITY, COUNT, ALARM, RINGING, INJECT, LOOKS, TRAVEL, COAST, TOKENS = range(10)
"""Scalars of the supervisor: whether the tracker is locked, the last velocity, samples and distance since the last
look, mean squared surprise, whether it is alarmed, for how many samples the offset is still freed, looks in the
average, whether the phase is being looked for, and alarms that are left."""
GUIDE = 10

TAKEN, NO_READING, NO_VELOCITY, TOO_FAST, STILL = range(5)


class GuideSettings(NamedTuple):
    """dt: seconds a sample; every: samples between two looks at the bank; evidence: nats by which a nominee must beat
    noise or the tracker, beyond the price of its parameters; alarm, calm: mean normalised squared innovation that
    starts and ends an alarm; inject: samples for which an alarm frees the offset; alarms, refill: how many there may
    be in a row, and how many come back in a sample; speed: share of a sample in the mean square of dx; periods: of
    the nominee that the window must span; settle: samples after a lock without alarm; looks: lengths of the bank that
    are averaged; clear, better: ratio of the average's peak to its median, and to the tracker's place, from which it
    may overrule; apart: cycles over the window by which a nominee differs; lost: phase variance from which a turn
    loses the phase; limit: largest |reading| that is taken for one."""

    dt: float
    every: int
    evidence: float
    alarm: float
    calm: float
    inject: float
    alarms: float
    refill: float
    speed: float
    periods: float
    settle: float
    looks: float
    clear: float
    better: float
    apart: float
    lost: float
    wild: float
    limit: float


class Memory(NamedTuple):
    """All arrays that a tracker remembers."""

    fields: np.ndarray
    sums: np.ndarray
    state: np.ndarray
    cov: np.ndarray
    track: np.ndarray
    guide: np.ndarray
    nominee: np.ndarray
    row: np.ndarray
    gram: np.ndarray
    right: np.ndarray
    power: np.ndarray
    average: np.ndarray
    score: np.ndarray


class Settings(NamedTuple):
    """Settings of the three parts."""

    bank: BankSettings
    phase: PhaseSettings
    guide: GuideSettings


def watch(settings, memory, reading, error, variance):
    """Notice surprise: forget the bank's window when it starts and when it ends, and free the offset meanwhile."""
    guide, sums = memory.guide, memory.sums
    normal = error * error / variance
    noise = memory.track[NOISE]
    sums[RIVAL] += noise * (normal + math.log(variance / noise))
    guide[ALARM] += 0.125 * (min(normal, 16.0) - guide[ALARM])
    guide[TOKENS] = min(guide[TOKENS] + settings.refill, settings.alarms)
    if memory.track[AGE] < settings.settle:
        guide[ALARM] = guide[RINGING] = 0.0
    elif guide[RINGING] == 0.0 and guide[ALARM] > settings.alarm and guide[TOKENS] >= 1.0:
        guide[RINGING] = 1.0
        guide[TOKENS] -= 1.0
        guide[INJECT] = settings.inject
        clear_bank(memory.fields, sums, reading)
    elif guide[RINGING] == 1.0 and guide[ALARM] < settings.calm:
        guide[RINGING] = 0.0
        clear_bank(memory.fields, sums, reading)
    if guide[RINGING] == 1.0 and guide[INJECT] >= 1.0:
        guide[INJECT] -= 1.0
        last = memory.state.shape[0] - 1
        memory.cov[last, last] += min(error * error, 9.0 * variance)


def convinced(settings, memory):
    """Whether the nominee explains this window better than noise (no lock yet) or than the tracker's wavelength does.

    A change must beat what the tracker foresaw and what its wavelength could explain if all else were fitted anew: a
    jump of the baseline spoils the first, but not the second.
    """
    nominee, noise, weight = memory.nominee, memory.track[NOISE], memory.sums[WEIGHT]
    count, floor = nominee[8], weight * settings.phase.floor
    price = settings.guide.evidence + 0.5 * count * math.log(weight)
    rest = nominee[4] + floor
    if memory.guide[LOCKED] == 0.0:
        return 0.5 * weight * math.log((nominee[5] + rest) / rest) > price
    rival = max(memory.sums[RIVAL], floor)
    foreseen = 0.5 * weight * math.log(rival / rest) < price or rival - rest < 2.0 * price * noise
    if foreseen and memory.guide[COAST] == 0.0:
        return False
    if abs(nominee[0] - memory.state[0]) * nominee[6] < settings.guide.apart * 2 * math.pi:
        return False
    below = int(memory.state[0] / settings.bank.step)
    for index in range(max(below, 1), min(below + 2, memory.power.shape[0])):
        harmonics = max(min(settings.bank.harmonics, (memory.power.shape[0] - 1) // index), 1)
        own = fit_harmonics(memory.fields, memory.sums, index, harmonics, 1e-3, memory.gram, memory.right)
        if 0.5 * weight * math.log((max(own, 0.0) + floor) / rest) < settings.guide.evidence + math.log(weight):
            return False
    return True


def supervise(settings, memory, travel):
    """Look at the bank and lock to its nominee where the window, or the average of many windows, convinces."""
    bank, sums, guide, score = settings.bank, memory.sums, memory.guide, memory.score
    weight = sums[WEIGHT]
    if weight < 12.0:
        return
    share = max(min(travel / (settings.guide.looks * bank.length), 1.0), 0.0)
    look(bank, memory.fields, sums, memory.power, memory.average, share)
    guide[LOOKS] += share
    spread = max(sums[SPREAD] / weight - (sums[LEVER] / weight) ** 2, 0.0)
    length = math.sqrt(12 * spread)
    low = max(bank.low, int(math.ceil(settings.guide.periods * 2 * math.pi / ((length + 1e-9) * bank.step))))
    seen = guide[LOCKED] == 0.0 or length * memory.state[0] > 0.7 * 2 * math.pi
    if low >= bank.high - 1 or not seen:
        return
    add_up(bank, memory.power, bank.low, bank.high, score)
    best = low + int(np.argmax(score[low - bank.low :]))
    nominate(bank, memory.fields, sums, memory.power, best, memory.nominee, memory.gram, memory.right)
    wins = memory.nominee[2] > 0.0 and weight > 2 * memory.nominee[8] and convinced(settings, memory)
    spare = weight - memory.nominee[8]
    if not wins and spare > 20.0 and guide[LOOKS] > 0.3 and guide[COAST] == 0.0:
        # Noise far above what the nominee leaves: the tracker sits beside the line, too near for the test above.
        wins = memory.track[NOISE] > settings.guide.wild * max(memory.nominee[4] / spare, settings.phase.floor)
    if not wins and guide[COAST] == 1.0 and length * memory.state[0] > settings.guide.periods * 2 * math.pi:
        find_phase(settings, memory)
    elif not wins and guide[LOOKS] > 0.6:
        best = clear_average(settings, memory)
        if best >= low:
            nominate(bank, memory.fields, sums, memory.power, best, memory.nominee, memory.gram, memory.right)
            wins = memory.nominee[2] > 0.0 and weight > 2 * memory.nominee[8]
    if wins:
        lock_to_nominee(settings, memory)


def find_phase(settings, memory):
    """After a turn that left the phase unknown: measure it with the window since then, at the tracker's wavenumber."""
    bank, sums, state, nominee = settings.bank, memory.sums, memory.state, memory.nominee
    best = min(max(int(round(state[0] / bank.step)), bank.low), bank.high - 1)
    nominate(bank, memory.fields, sums, memory.power, best, nominee, memory.gram, memory.right)
    weight, count = sums[WEIGHT], nominee[8]
    if not (nominee[2] > 0.0 and weight > 2 * count):
        return
    variance = 2 * nominee[4] / ((weight - count) * weight * nominee[2] ** 2) + 0.003
    if variance < 0.1:
        measured = nominee[1] + (state[0] - nominee[0]) * (-sums[LEVER] / weight)
        take_phase(state, memory.cov, memory.track, measured, variance)
        last = state.shape[0] - 1
        memory.cov[last, :] = 0.0
        memory.cov[:, last] = 0.0
        memory.cov[last, last] = 0.05 * nominee[2] ** 2
        state[last] = nominee[3]
        memory.guide[COAST] = 0.0


def clear_average(settings, memory):
    """Index of the wavenumber that stands out of the average over many windows and is not the tracker's, or -1."""
    bank, score = settings.bank, memory.score
    add_up(bank, memory.average, bank.low, bank.high, score)
    best = int(np.argmax(score))
    top = score[best]
    if not top > settings.guide.clear * np.median(score):
        return -1
    if memory.guide[LOCKED] == 1.0:
        place = memory.state[0] / bank.step - bank.low
        below = int(min(max(place, 0.0), score.shape[0] - 2.0))
        if abs(best - place) < 1.5 or top < settings.guide.better * max(score[below], score[below + 1]):
            return -1
    return best + bank.low


def lock_to_nominee(settings, memory):
    """Start the tracker anew at the nominee."""
    guide, track, sums, nominee = memory.guide, memory.track, memory.sums, memory.nominee
    weight = sums[WEIGHT]
    if guide[LOCKED] == 0.0:
        track[NOISE] = max(nominee[4] / (weight - nominee[8]), settings.phase.floor)
    lock_phase(settings.phase, memory.state, memory.cov, track, nominee, -sums[LEVER] / weight)
    guide[LOCKED] = 1.0
    guide[LOOKS] = guide[COAST] = 0.0
    memory.average[:] = 0.0
    sums[RIVAL] = nominee[4]


def track_sample(settings, memory, reading, velocity):
    """Take one reading and velocity (mm/s); what became of it: TAKEN ... STILL."""
    guide, track, state = memory.guide, memory.track, memory.state
    if not abs(velocity) < 1e6:
        guide[VELOCITY] = math.nan
        return NO_VELOCITY
    before = guide[VELOCITY] if guide[VELOCITY] == guide[VELOCITY] else velocity
    guide[VELOCITY] = velocity
    dx = 0.5 * (before + velocity) * settings.guide.dt
    moves = abs(dx) > settings.phase.still
    if moves:
        square = track[SPEED]
        track[SPEED] = dx * dx if square == 0.0 else square + settings.guide.speed * (dx * dx - square)
    move_bank(settings.bank, memory.fields, memory.sums, dx)
    slips = turning(settings.phase, track, dx) and settings.phase.shear > 0.0
    if slips:
        # The skin is still turning over: positions of the finger are not yet those of the skin.
        memory.sums[WEIGHT] = 0.0
    locked = guide[LOCKED] == 1.0
    if locked:
        move_phase(settings.phase, state, memory.cov, track, dx)
        if slips and memory.cov[1, 1] > settings.guide.lost:
            guide[COAST] = 1.0
    if not abs(reading) < settings.guide.limit:
        return NO_READING
    step = abs(state[0] * dx)
    if step > settings.phase.band or abs(dx) * settings.bank.step * settings.bank.low > settings.phase.band:
        return TOO_FAST
    if memory.sums[WEIGHT] == 0.0:
        clear_bank(memory.fields, memory.sums, reading)
    feed_bank(settings.bank, memory.fields, memory.sums, reading)
    if locked and guide[COAST] == 0.0:
        error, variance = feed_phase(settings.phase, state, memory.cov, track, memory.row, reading, step)
        watch(settings.guide, memory, reading, error, variance)
    guide[COUNT] += 1.0
    guide[TRAVEL] += abs(dx)
    if guide[COUNT] >= settings.guide.every:
        supervise(settings, memory, guide[TRAVEL])
        guide[COUNT] = guide[TRAVEL] = 0.0
    if locked and not sound(settings.bank, state, memory.cov, track):
        guide[LOCKED] = guide[COAST] = 0.0
        state[:] = 0.0
    return TAKEN if moves else STILL


def sound(bank, state, cov, track):
    """Whether the tracker is inside the bank's wavenumbers and its covariance is one."""
    inside = 0.8 * bank.low * bank.step < state[0] < 1.2 * bank.high * bank.step
    return inside and cov[0, 0] > 0.0 and cov[1, 1] > 0.0 and track[TRUE_K] > 0.0


def track_block(settings, memory, rows, answers):
    """Take rows (n, 2) of reading and velocity; answers (n, 5): wavenumber, its sd, what became of the sample, whether
    the tracker is locked, and its signal to noise: mean square slope over noise variance."""
    track = memory.track
    for i in range(rows.shape[0]):
        answers[i, 2] = track_sample(settings, memory, rows[i, 0], rows[i, 1])
        answers[i, 0] = memory.state[0]
        answers[i, 1] = math.sqrt(max(track[TRUE_K], 0.0))
        answers[i, 3] = memory.guide[LOCKED]
        answers[i, 4] = track[STRENGTH] / max(track[NOISE], 1e-300)


KERNELS = (
    clear_bank,
    move_bank,
    feed_bank,
    spectrum,
    moment,
    fit_harmonics,
    add_up,
    look,
    between,
    nominate,
    harmonic_model,
    harmonic_slope,
    lock_phase,
    turning,
    move_phase,
    take_phase,
    feed_phase,
    watch,
    convinced,
    find_phase,
    clear_average,
    lock_to_nominee,
    supervise,
    sound,
    track_sample,
    track_block,
)
"""Every function in the order of their calls, for `kernels`."""
