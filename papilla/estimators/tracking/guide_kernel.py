"""The supervisor of the guided tracker: it watches the filter and lets it lock to what the bank proposes."""

import math
from typing import NamedTuple

import numpy as np

from papilla.estimators.tracking.bank_kernel import (
    AMPLITUDE,
    EXPLAINED,
    LENGTH,
    LEVER,
    NOMINEE,
    OFFSET,
    PARAMETERS,
    PHASE,
    READING,
    REST,
    RIVAL,
    SAMPLES,
    SQUARE,
    WAVENUMBER,
    WEIGHT,
    Bank,
    BankSettings,
    clear_bank,
    fit_series,
    look,
    lowest,
    nominate,
    prefer_multiple,
    window_length,
)
from papilla.estimators.tracking.bank_vectors import add_up, fade_into, largest, middle
from papilla.estimators.tracking.phase_kernel import (
    AGE,
    FIRST,
    NOISE,
    OFFSET_AT,
    SPEED,
    SURPRISE,
    TURN_AROUND,
    Phase,
    PhaseSettings,
    lock_phase,
    measure_slope,
    take_phase,
)

LOCKED, VELOCITY, GAP, COUNT, NOMINATED, SINCE, RINGING, INJECT, LOOKS, TRAVEL, COAST, TOKENS, ROUGH, BESIDE = range(14)
"""Scalars of the supervisor: whether the tracker is locked, the last velocity, samples since then, samples since the
last look, whether it brought a nominee, distance since the nomination, whether there is an alarm, for how many samples
the offset is still freed, looks in the average, distance since the last look, whether the phase is being looked for,
alarms that are left, recent mean square of the innovations over the noise's variance, and the recent mean of the log of
their mean square over what the nominees leave."""
GUIDE = 14
STRIDE = 4
"""A look takes four samples, a part each, so that every sample costs the same."""


class GuideSettings(NamedTuple):
    """dt: seconds a sample; every, rare: samples between two looks at the bank, and while the mean normalised squared
    innovation is below `doubt`; evidence: nats by which a nominee must beat
    noise or the tracker, beyond the price of its parameters; alarm, calm: mean normalised squared innovation that
    starts and ends an alarm; inject: samples for which an alarm frees the offset; alarms, refill: how many there may
    be in a row, and how many come back in a sample; speed: share of a sample in the mean square of dx; periods: of
    the nominee that the window must span (what repeats contradicts a wrong one);
    settle: samples after a lock without alarm; looks: lengths of the bank that
    are averaged; clear, better: ratio of the average's peak to its median, and to the tracker's place, from which it
    may overrule; apart: cycles over the window by which a nominee differs; lost: phase variance from which a turn
    loses the phase; wild: mean log of innovations over the nominees' rest at which the tracker is beside the line;
    share: of a look in that mean; limit: largest |reading| that is taken for one; gap: samples without a velocity after
    which the place is not known; plain: noise variances that a nominee of a short window may leave; even: power in odd
    harmonics over that in even ones at which the wavenumber is a submultiple; mature: samples after a lock from which
    that is asked; slow: mean squares of dx below which nothing is decided, as friction falls there and that looks like
    a long wavelength."""

    dt: float
    every: int
    rare: int
    doubt: float
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
    share: float
    limit: float
    gap: float
    plain: float
    even: float
    mature: float
    slow: float


class Memory(NamedTuple):
    """All arrays that a tracker remembers, and room to work."""

    bank: Bank
    phase: Phase
    guide: np.ndarray
    average: np.ndarray


class Settings(NamedTuple):
    """Settings of the three parts."""

    bank: BankSettings
    phase: PhaseSettings
    guide: GuideSettings


def restart_window(memory, reading):
    """Forget the bank's window, and a look that is under way."""
    clear_bank(memory.bank, reading)
    memory.guide[COUNT] = memory.guide[NOMINATED] = 0.0


def watch(settings, memory, reading, error, variance):
    """Notice surprise: forget the bank's window when it starts and when it ends, and free the offset meanwhile."""
    guide, sums, track = memory.guide, memory.bank.sums, memory.phase.track
    noise, surprise = track[NOISE], track[SURPRISE]
    sums[RIVAL] += noise * (error * error / variance + math.log(variance / noise))
    tokens = min(guide[TOKENS] + settings.refill, settings.alarms)
    ringing = guide[RINGING] == 1.0
    # While the offset is freed it follows anything: what counts then is the innovation against the noise alone.
    rough = guide[ROUGH]
    rough += 0.125 * (min(error * error / noise, 16.0) - rough)
    guide[ROUGH] = rough
    if track[AGE] < settings.settle:
        track[SURPRISE] = 1.0
        guide[RINGING] = 0.0
    elif not ringing and surprise > settings.alarm and tokens >= 1.0:
        guide[RINGING] = 1.0
        tokens -= 1.0
        guide[INJECT] = settings.inject
        restart_window(memory, reading)
    elif ringing and rough < settings.calm:
        guide[RINGING] = 0.0
        restart_window(memory, reading)
    guide[TOKENS] = tokens
    if guide[RINGING] == 1.0 and guide[INJECT] >= 1.0:
        guide[INJECT] -= 1.0
        memory.phase.cov[OFFSET_AT, OFFSET_AT] += min(error * error, 9.0 * variance)


def convinced(settings, memory):
    """Whether the nominee explains this window better than noise (no lock yet) or than the tracker's wavelength does.

    A change must beat what the tracker foresaw and what its wavelength could explain if all else were fitted anew: a
    jump of the baseline spoils the first, but not the second.
    """
    bank, nominee, noise = memory.bank, memory.bank.nominee, memory.phase.track[NOISE]
    weight, count = bank.sums[WEIGHT], nominee[PARAMETERS]
    floor = weight * settings.phase.floor
    # Whoever has tracked for a memory has seen many windows: one alone must say twice as much against that.
    evidence = settings.guide.evidence * (2.0 if memory.phase.track[AGE] > settings.phase.memory else 1.0)
    price = evidence + 0.5 * count * math.log(weight)
    rest = nominee[REST] + floor
    if memory.guide[LOCKED] == 0.0:
        return 0.5 * weight * math.log((nominee[EXPLAINED] + rest) / rest) > price
    rival, wavenumber = max(bank.sums[RIVAL], floor), float(memory.phase.state[0])
    foreseen = 0.5 * weight * math.log(rival / rest) < price or rival - rest < 2.0 * price * noise
    if foreseen and memory.guide[COAST] == 0.0:
        return False
    if abs(nominee[WAVENUMBER] - wavenumber) * nominee[LENGTH] < settings.guide.apart * TURN_AROUND:
        return False
    spare = max(weight - count, 1.0)
    short = nominee[LENGTH] * nominee[WAVENUMBER] < 2 * TURN_AROUND
    if short and rest > settings.guide.plain * noise * spare:
        # Of a window this short many wavelengths explain a part: only one that leaves mere noise is the new one.
        return False
    below = int(wavenumber / settings.bank.step)
    for index in range(max(below, 1), below + 2):
        own = fit_series(settings.bank, bank, index)
        if 0.5 * weight * math.log((own + floor) / rest) < evidence + math.log(weight):
            return False
    return True


def take_look(settings, memory, travel):
    """First part of a look: the spectrum of the window, and its share in the average over many windows, in units of
    their noise."""
    bank, guide = memory.bank, memory.guide
    weight = bank.sums[WEIGHT]
    guide[NOMINATED] = 0.0
    if weight < 12.0:
        return
    look(settings.bank, bank)
    share = min(travel / (settings.guide.looks * settings.bank.length), 1.0)
    total = bank.sums[SQUARE] - bank.sums[READING] ** 2 / weight
    best = largest(bank.power, settings.bank.low)
    rest = max(total - float(bank.power[best]), 1e-3 * total)
    if rest > 0.0:
        fade_into(memory.average, bank.power, 1.0 - share, share / rest * weight)
    guide[LOOKS] += share


def choose(settings, memory):
    """Second part of a look: nominate the wavenumber with the highest score of those that the window spans."""
    bank, guide = memory.bank, memory.guide
    low = lowest(settings.bank, bank.sums, settings.guide.periods)
    seen = guide[LOCKED] == 0.0 or window_length(bank.sums) * float(memory.phase.state[0]) > 0.7 * TURN_AROUND
    if low >= settings.bank.high - 1 or not seen:
        return
    add_up(bank.power, settings.bank.low, bank.score)
    best = largest(bank.score, low - settings.bank.low) + settings.bank.low
    if guide[LOCKED] == 1.0 and best == settings.bank.low and bank.power[best - 1] > bank.power[best]:
        # A step of the baseline is explained most by the longest wavelength, but is no peak there.
        return
    nominate(settings.bank, bank, best)
    guide[NOMINATED], guide[SINCE] = 1.0, 0.0


def try_multiple(settings, memory, order):
    """Third part of a look, and the start of the last: the nominee must not be a submultiple."""
    if prefer_multiple(settings.bank, memory.bank, order, settings.guide.evidence):
        memory.guide[SINCE] = 0.0


def usable(memory):
    """Whether the nominee has an amplitude and a window with more samples than it has parameters."""
    nominee = memory.bank.nominee
    return nominee[AMPLITUDE] > 0.0 and memory.bank.sums[WEIGHT] > 2 * nominee[PARAMETERS]


def trusted(settings, memory):
    """Whether the nominee's window holds enough periods to overrule a tracker of this age."""
    nominee, age = memory.bank.nominee, memory.phase.track[AGE]
    periods = nominee[LENGTH] * nominee[WAVENUMBER] / TURN_AROUND
    return periods > (3.0 if age > settings.phase.memory else 2.0)


def beside(settings, memory):
    """Whether the tracker has sat beside the line, too near for `convinced`, for some windows: its innovations are far
    above what the nominees leave."""
    guide, sums, nominee = memory.guide, memory.bank.sums, memory.bank.nominee
    spare = sums[WEIGHT] - nominee[PARAMETERS]
    if guide[COAST] == 1.0 or guide[LOCKED] == 0.0 or guide[RINGING] == 1.0 or spare < 12.0:
        return False
    floor = settings.phase.floor
    ratio = math.log((sums[RIVAL] / sums[WEIGHT] + floor) / (nominee[REST] / spare + floor))
    guide[BESIDE] += settings.guide.share * (ratio - guide[BESIDE])
    return guide[BESIDE] > settings.guide.wild and trusted(settings, memory)


def decide(settings, memory):
    """Last part of a look: lock to the nominee where the window, or the average of many windows, convinces."""
    bank, guide = memory.bank, memory.guide
    try_multiple(settings, memory, 3)
    wins = usable(memory) and convinced(settings, memory)
    wins = wins or beside(settings, memory)
    spanned = window_length(bank.sums) * float(memory.phase.state[0])
    if not wins and guide[COAST] == 1.0 and spanned > settings.guide.periods * TURN_AROUND:
        find_phase(settings, memory)
    elif not wins and guide[LOOKS] > 0.6:
        best = clear_average(settings, memory)
        if best >= lowest(settings.bank, bank.sums, settings.guide.periods):
            nominate(settings.bank, bank, best)
            guide[SINCE] = 0.0
            wins = usable(memory)
    if wins:
        lock_to_nominee(settings, memory)


def find_phase(settings, memory):
    """After a turn that left the phase unknown: measure it with the window since then, at the tracker's wavenumber."""
    bank, phase, nominee = memory.bank, memory.phase, memory.bank.nominee
    wavenumber = float(phase.state[0])
    best = min(max(int(wavenumber / settings.bank.step + 0.5), settings.bank.low), settings.bank.high - 1)
    nominate(settings.bank, bank, best)
    if not usable(memory):
        return
    weight, count, amplitude = bank.sums[WEIGHT], nominee[PARAMETERS], nominee[AMPLITUDE]
    variance = 2 * nominee[REST] / ((weight - count) * weight * amplitude**2) + 0.003
    if variance < 0.1:
        lever = -bank.sums[LEVER] / weight
        take_phase(phase, nominee[PHASE] + (wavenumber - nominee[WAVENUMBER]) * lever, variance)
        phase.cov[OFFSET_AT, :] = 0.0
        phase.cov[:, OFFSET_AT] = 0.0
        phase.cov[OFFSET_AT, OFFSET_AT] = 0.05 * amplitude**2
        phase.state[OFFSET_AT] = nominee[OFFSET]
        memory.guide[COAST] = 0.0


def clear_average(settings, memory):
    """Index of the wavenumber that stands out of the average over many windows and is not the tracker's, or -1."""
    low, score = settings.bank.low, memory.bank.score
    add_up(memory.average, low, score)
    best = largest(score, 0)
    top = float(score[best])
    if memory.guide[LOCKED] == 1.0:
        place = float(memory.phase.state[0]) / settings.bank.step - low
        below = int(min(max(place, 0.0), score.shape[0] - 2.0))
        if abs(best - place) < 1.5 or top < settings.guide.better * max(score[below], score[below + 1]):
            return -1
    return best + low if top > settings.guide.clear * middle(score) else -1


def lock_to_nominee(settings, memory):
    """Start the tracker anew at the nominee."""
    guide, sums, nominee = memory.guide, memory.bank.sums, memory.bank.nominee
    spare = nominee[SAMPLES] - nominee[PARAMETERS]
    left = max(nominee[REST] / spare, settings.phase.floor)
    track = memory.phase.track
    # Off the line, what the wavelength does not explain passed for noise.
    if guide[LOCKED] == 0.0 or (trusted(settings, memory) and left < track[NOISE]):
        track[NOISE] = left
    nominee[PHASE] += nominee[WAVENUMBER] * guide[SINCE]
    lock_phase(settings.phase, memory.phase, nominee, -sums[LEVER] / sums[WEIGHT])
    guide[LOCKED] = 1.0
    guide[LOOKS] = guide[COAST] = guide[RINGING] = guide[BESIDE] = 0.0
    memory.average[:] = 0.0
    sums[RIVAL] = nominee[REST]


def leave_submultiple(settings, memory):
    """Double the tracker's wavenumber where nearly all of its power is in the second and fourth harmonic."""
    state, nominee, bank = memory.phase.state, memory.bank.nominee, memory.bank
    count = settings.phase.orders.shape[0]
    odd = even = 0.0
    for h in range(count):
        in_phase, quadrature = float(state[FIRST + h]), float(state[FIRST + count + h])
        power = in_phase * in_phase + quadrature * quadrature
        if h % 2:
            even += power
        else:
            odd += power
    if odd >= settings.guide.even * even or 2 * state[0] > settings.bank.step * settings.bank.high:
        return
    a, c = float(state[FIRST + 1]), float(state[FIRST + count + 1])
    for index in range(NOMINEE):
        nominee[index] = 0.0
    nominee[WAVENUMBER], nominee[PHASE] = 2 * float(state[0]), 2 * float(state[1]) - math.atan2(c, a)
    nominee[AMPLITUDE], nominee[OFFSET] = math.sqrt(a * a + c * c), float(state[OFFSET_AT])
    nominee[LENGTH], nominee[SAMPLES] = window_length(bank.sums), bank.sums[WEIGHT]
    nominee[REST] = memory.phase.track[NOISE] * nominee[SAMPLES]
    memory.guide[SINCE] = memory.guide[NOMINATED] = 0.0
    lock_to_nominee(settings, memory)


def supervise(settings, memory, dx, step):
    """One part of a look: a sample each."""
    guide = memory.guide
    count = int(guide[COUNT])
    guide[TRAVEL] += abs(dx)
    guide[SINCE] += dx
    if count == 0:
        take_look(settings, memory, guide[TRAVEL])
        guide[TRAVEL] = 0.0
    elif count == 1 and memory.bank.sums[WEIGHT] >= 12.0:
        choose(settings, memory)
    elif count == 2:
        measure_slope(settings.phase, memory.phase, step)
        if guide[NOMINATED] == 1.0:
            try_multiple(settings, memory, 2)
        if guide[LOCKED] == 1.0 and memory.phase.track[AGE] > settings.guide.mature:
            leave_submultiple(settings, memory)
    elif count == 3 and guide[NOMINATED] == 1.0 and dx * dx >= settings.guide.slow * memory.phase.track[SPEED]:
        decide(settings, memory)
    guide[COUNT] = 0.0 if count + 1 >= pause(settings, memory) else count + 1.0


def pause(settings, memory):
    """Samples from one look to the next: more of them while a tracker of some age foresees the readings."""
    track, guide = memory.phase.track, settings.guide
    calm = memory.guide[LOCKED] == 1.0 and memory.guide[COAST] == 0.0 and track[SURPRISE] < guide.doubt
    return guide.rare if calm and track[AGE] > settings.phase.memory else guide.every
