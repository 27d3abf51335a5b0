"""One sample of the velocity-blind tracker: a bank of chirps proposes, the phase filter tracks, a guide decides."""

import math
from typing import NamedTuple

import numpy as np

from papilla.estimators.tracking import blind_filter, blind_search
from papilla.estimators.tracking.blind_filter import (
    AGE,
    CHIRP,
    EXCESS,
    FIRST,
    NOISE,
    PHI,
    RATE,
    SCALE,
    SURPRISE,
    TURNED,
    FilterSettings,
    lock,
    move,
    rate_before,
    symmetrise,
    take,
)
from papilla.estimators.tracking.blind_search import Room, SearchSettings, nominate

LOCKED, PLACE, SEEN, COUNT, MEAN, POWER, HELD, HELD_VAR, LENGTH, LENGTH_VAR, LATE, LEVEL, FASTEST = range(13)
"""Scalars of the supervisor: whether the filter is locked; the ring's oldest place; samples seen, and since the last
look; fading mean and variance of the readings; the frequency of the last answer in Hz and its variance; the wavelength
and its variance; the place of the oldest velocity; the largest variance of the readings, and speed, fading."""
GUIDE = 13
OK, SEARCHING, QUIET, MISSING = range(4)


class GuideSettings(NamedTuple):
    """limit: smallest |reading| that is saturated; lag: s; search, doubt, calm: samples between looks without a lock,
    with one that is young or surprised, and otherwise; young: samples; surprised: mean normalised square beyond which
    a lock is doubted and the motion freed; shake: by that much, as the filter's jerk; rival: nats by which a nominee
    must foresee half a window better than the lock did, or than noise; lost: phase variance at which a lock is given
    up; still: share of a sample in the readings' variance; quiet, weak: noise variances, and share of its largest value
    that fades in `hold` s, below which nothing moves; faint, proved: nats in a window by which the fundamental of a
    lock that is believed beats noise, and rad that it has followed; crawl: share of the largest speed below which a
    speed tells no wavelength; slow: sds of rate and chirp when nothing moves, as fractions of w's rms (and 1/s); vague:
    largest sigma of a frequency called OK, as a fraction of w's rms, and of its own for a wavelength; turn: s in which
    a frequency that is only held is worth nothing."""

    limit: float
    lag: float
    search: float
    doubt: float
    calm: float
    young: float
    surprised: float
    shake: float
    rival: float
    lost: float
    still: float
    quiet: float
    weak: float
    hold: float
    faint: float
    proved: float
    crawl: float
    slow: tuple[float, float]
    vague: float
    turn: float


class Settings(NamedTuple):
    """Settings of the three parts."""

    filter: FilterSettings
    search: SearchSettings
    guide: GuideSettings


class Memory(NamedTuple):
    """All arrays that a tracker remembers; those from `row` on only within a sample."""

    state: np.ndarray
    cov: np.ndarray
    track: np.ndarray
    guide: np.ndarray
    ring: np.ndarray
    costs: np.ndarray
    speeds: np.ndarray
    row: np.ndarray
    across: np.ndarray
    spare_state: np.ndarray
    spare_cov: np.ndarray
    spare_track: np.ndarray
    spare_costs: np.ndarray
    room: Room


def cost(error, variance):
    """Twice the nats that a reading costs whoever foresaw it so."""
    return error * error / variance + math.log(variance)


def replay(settings, memory):
    """Lock at the nominee in the middle of the window and take the readings since; returns what they cost, a reading.

    Readings before the lock cost nothing; `costs` is overwritten from the middle on.
    """
    ring, costs, nominee = memory.ring, memory.costs, memory.room.nominee
    length, at = ring.shape[0], int(memory.guide[PLACE])
    first = (length + 1) // 2
    # The first move must end at the first reading behind the middle.
    nominee[0] += nominee[1] * (first - 1 - 0.5 * (length - 1)) * settings.filter.dt
    lock(settings.filter, memory.state, memory.cov, memory.track, nominee, 0.5 * settings.search.step, 3.0 * nominee[1])
    for back in range(first, length):
        place = (at + back) % length
        move(settings.filter, memory.state, memory.cov, memory.track)
        costs[place] = math.nan
        if not math.isnan(ring[place]):
            error, variance = take(
                settings.filter, memory.state, memory.cov, memory.track, memory.row, memory.across, ring[place]
            )  # fmt: skip
            costs[place] = cost(error, variance)


def paid(costs, ring, at, blank):
    """Sum of the costs of the window's second half; a reading that nobody foresaw costs `blank`."""
    length, total = costs.shape[0], 0.0
    for back in range((length + 1) // 2, length):
        place = (at + back) % length
        if not math.isnan(ring[place]):
            total += blank if math.isnan(costs[place]) else costs[place]
    return total


def swap(first, second):
    """Exchange the contents of two arrays (n,)."""
    for i in range(first.shape[0]):
        first[i], second[i] = second[i], first[i]


def exchange(memory):
    """Exchange the filter, and what it paid, with the spare one."""
    swap(memory.state, memory.spare_state)
    swap(memory.track, memory.spare_track)
    swap(memory.costs, memory.spare_costs)
    for i in range(memory.cov.shape[0]):
        swap(memory.cov[i], memory.spare_cov[i])


def look(settings, memory):
    """Ask the bank; lock at its nominee where that beats noise, and what the lock foresaw, by enough nats."""
    guide = memory.guide
    at = int(guide[PLACE])
    nats, variance = nominate(settings.search, memory.ring, at, memory.room)
    if nats <= settings.search.evidence:
        return
    before = paid(memory.costs, memory.ring, at, 1.0 + math.log(variance))
    exchange(memory)
    replay(settings, memory)
    if before - paid(memory.costs, memory.ring, at, 0.0) > 2.0 * settings.guide.rival:
        guide[LOCKED] = 1.0
    else:
        exchange(memory)


def rest(settings, memory):
    """Nothing moves: the rate is zero, and what it will be is open."""
    state, cov, square = memory.state, memory.cov, memory.track[SCALE]
    for at in (RATE, CHIRP):
        state[at] = 0.0
        cov[at] = 0.0
        cov[:, at] = 0.0
    cov[RATE, RATE] = settings.guide.slow[0] ** 2 * square
    cov[CHIRP, CHIRP] = settings.guide.slow[1] ** 2 * square


def follow(settings, memory, reading, usable):
    """The filter's part of a sample: move, take the reading, free the motion when surprised; give up a lost phase."""
    track, cov, guide = memory.track, memory.cov, memory.guide
    place = int(guide[PLACE])
    move(settings.filter, memory.state, cov, track)
    if usable:
        error, variance = take(settings.filter, memory.state, cov, track, memory.row, memory.across, reading)
        memory.costs[place] = cost(error, variance)
    excess = track[SURPRISE] - settings.guide.surprised
    if excess > 0.0 and track[AGE] > 20.0:
        cov[CHIRP, CHIRP] += excess * settings.guide.shake**2 * track[SCALE] * settings.filter.dt
    if not cov[PHI, PHI] < settings.guide.lost:
        guide[LOCKED] = 0.0


def quiet(settings, memory, reading):
    """Keep the readings' mean and variance; whether the latter is no more than noise."""
    guide = memory.guide
    share = max(settings.guide.still, 1.0 / (guide[SEEN] + 1.0))
    away = reading - guide[MEAN]
    guide[MEAN] += share * away
    guide[POWER] += share * ((1.0 - share) * away * away - guide[POWER])
    guide[LEVEL] = max(guide[LEVEL] * (1.0 - settings.filter.dt / settings.guide.hold), guide[POWER])
    limit = min(settings.guide.quiet * memory.track[NOISE], settings.guide.weak * guide[LEVEL])
    return guide[SEEN] * settings.guide.still > 2.0 and guide[POWER] <= limit


def believed(settings, memory):
    """Whether the lock explains the readings: corrections of its motion are white, its fundamental stands out of noise,
    and it has followed whole periods since, which a step of the offset is not.

    The noise is learned, so that what a wrong lock leaves passes for it: the innovations alone would not tell.
    """
    track, first = memory.track, memory.state[FIRST]
    if track[EXCESS] >= settings.filter.pulled or track[TURNED] < settings.guide.proved:
        return False
    nats = 0.5 * memory.ring.shape[0] * math.log(1.0 + 0.5 * first * first / track[NOISE])
    return nats > settings.guide.faint


def respond(settings, memory, velocity, status, answer):
    """Fill `answer` (frequency, sigma, wavelength, sigma, status); what is not known is held, its sigma growing."""
    guide, part = memory.guide, settings.guide
    speeds, late = memory.speeds, int(guide[LATE])
    speeds[late] = abs(velocity)
    late = (late + 1) % speeds.shape[0]
    guide[LATE] = late
    speed, scale = speeds[late], math.sqrt(memory.track[SCALE]) / 6.283185307179586
    guide[FASTEST] *= 1.0 - settings.filter.dt / part.hold
    if speed > guide[FASTEST]:
        guide[FASTEST] = speed
    growth = settings.filter.dt / part.turn
    known = guide[LOCKED] == 1.0 and believed(settings, memory)
    if not known:
        guide[HELD_VAR] = min(guide[HELD_VAR] + growth * scale * scale, max(guide[HELD_VAR], scale * scale))
    # A lock in doubt goes on from an answer, its sigma no less than that of one that is held; it does not begin one.
    if known or (guide[LOCKED] == 1.0 and not math.isnan(guide[HELD])):
        mean, variance = rate_before(memory.state, memory.cov, part.lag)
        variance /= 39.47841760435743
        guide[HELD] = abs(mean) / 6.283185307179586
        guide[HELD_VAR] = variance if known else max(variance, guide[HELD_VAR])
        known = known and variance < (part.vague * scale) ** 2
    frequency, sigma = guide[HELD], math.sqrt(guide[HELD_VAR])
    if known and sigma < part.vague * frequency and speed > part.crawl * guide[FASTEST] and status != QUIET:
        guide[LENGTH] = speed / frequency
        guide[LENGTH_VAR] = (guide[LENGTH] * sigma / frequency) ** 2
    else:
        guide[LENGTH_VAR] += growth * guide[LENGTH] * guide[LENGTH]
    answer[0], answer[1] = frequency, sigma
    answer[2], answer[3] = guide[LENGTH], math.sqrt(guide[LENGTH_VAR])
    answer[4] = SEARCHING if status == OK and not known else status


def track_block(settings, memory, rows, answers):
    """Answers (n, 5) to rows (n, 2) of reading and velocity."""
    guide, part = memory.guide, settings.guide
    length = memory.ring.shape[0]
    for number in range(rows.shape[0]):
        reading, velocity = rows[number, 0], rows[number, 1]
        usable = abs(reading) < part.limit
        place = int(guide[PLACE])
        memory.ring[place] = reading if usable else math.nan
        status = OK if usable else MISSING
        if usable and quiet(settings, memory, reading):
            status = QUIET
        memory.costs[place] = math.nan
        if guide[LOCKED] == 1.0:
            if status == QUIET:
                rest(settings, memory)
            follow(settings, memory, reading, usable)
        guide[PLACE] = (place + 1) % length
        guide[SEEN] = min(guide[SEEN] + 1.0, 1e9)
        guide[COUNT] += 1.0
        every = part.calm
        if guide[LOCKED] == 0.0:
            every = part.search
        elif memory.track[AGE] < part.young or memory.track[SURPRISE] > part.surprised:
            every = part.doubt
        if guide[COUNT] >= every and guide[SEEN] >= length and status != QUIET:
            guide[COUNT] = 0.0
            symmetrise(memory.cov)
            look(settings, memory)
        respond(settings, memory, velocity, status, answers[number])


KERNELS = (
    *blind_filter.KERNELS,
    *blind_search.KERNELS,
    cost,
    replay,
    paid,
    swap,
    exchange,
    look,
    rest,
    follow,
    quiet,
    believed,
    respond,
    track_block,
)
