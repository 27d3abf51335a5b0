"""One sample of the velocity-blind tracker: a bank of chirps proposes, the phase filter tracks, a guide decides."""

import math
from typing import NamedTuple

import numpy as np

from papilla.estimators.tracking import blind_filter, blind_search
from papilla.estimators.tracking.blind_filter import (
    AGE,
    CHIRP,
    COLOUR,
    EXCESS,
    FIRST,
    LEAST,
    NOISE,
    PHI,
    RATE,
    SCALE,
    SURPRISE,
    TURNED,
    FilterSettings,
    lock,
    move,
    pin,
    rate_before,
    rest,
    take,
)
from papilla.estimators.tracking.blind_loops import LOOPS
from papilla.estimators.tracking.blind_search import (
    BEHIND,
    CALM,
    OFFERED,
    PAID,
    SWING,
    TAKEN,
    Look,
    SearchSettings,
    search,
)
from papilla.estimators.tracking.blind_vectors import VECTORS, begin_with, symmetrise

(LOCKED, PLACE, SEEN, COUNT, PART, MEAN, POWER, HELD, HELD_VAR, LENGTH, LENGTH_VAR, LATE, LEVEL, FASTEST) = range(14)
"""Scalars of the supervisor: whether the filter is locked; the ring's oldest place; samples seen, and since the last
look began; the next part of a look, 0 between two; fading mean and variance of the readings; the frequency of the last
answer in Hz and its variance; the wavelength and its variance; the place of the oldest velocity; the largest variance
of the readings, and speed, fading."""
GUIDE = 14
OK, SEARCHING, QUIET, MISSING = range(4)


class GuideSettings(NamedTuple):
    """limit: smallest |reading| that is saturated; lag: samples; search, doubt, calm: samples from look to look without
    a lock, with one that is young or in doubt, and otherwise; young: samples; surprised, noisy: mean normalised square
    of the innovations, and noise in units of the least one, beyond which a lock is doubted; pulled: the same of the
    motion's noise; coloured: correlation of an innovation with the next one, beyond which a lock is not believed; loud:
    noise in a_1^2 beyond which that, and that it grew, counts; rival: nats by which a nominee must explain late
    readings better than the lock foresaw them, or than noise; lost: phase variance at which a lock is given up; still:
    share of a sample in the readings' variance; quiet, weak: noise variances, and share of its largest value that fades
    in `hold` s, below which nothing moves; faint, proved: nats in a window by which the fundamental of a lock that is
    believed beats noise, and rad that it has followed; crawl: share of the largest speed below which a speed tells no
    wavelength; slow: sds of rate and chirp when nothing moves, as fractions of w's rms (and 1/s); vague: largest sigma
    of a frequency called OK, as a fraction of w's rms, and of its own for a wavelength; turn, worn: s in which a
    frequency, and a wavelength, that are only held are worth nothing."""

    limit: float
    lag: float
    search: float
    doubt: float
    calm: float
    young: float
    surprised: float
    noisy: float
    pulled: float
    coloured: float
    loud: float
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
    worn: float


class Settings(NamedTuple):
    """Settings of the three parts."""

    filter: FilterSettings
    search: SearchSettings
    guide: GuideSettings


class Memory(NamedTuple):
    """All arrays that a tracker remembers; `row` and `across` only within a sample."""

    state: np.ndarray
    cov: np.ndarray
    track: np.ndarray
    pins: np.ndarray
    guide: np.ndarray
    ring: np.ndarray
    costs: np.ndarray
    speeds: np.ndarray
    look: Look
    row: np.ndarray
    across: np.ndarray


def look_on(settings, memory):
    """One part of a look; after the last, consider what was found."""
    guide, search_for = memory.guide, settings.search
    memory.look.scalars[BEHIND] += 1.0
    left = search_for.parts - int(guide[PART])
    # Without a lock to follow there is time for both parts of a block.
    both = guide[LOCKED] == 0.0 and left % 2 == 0 and int(guide[PART]) > search_for.chirps.shape[0] + 1
    for _ in range(2 if both else 1):
        part = int(guide[PART])
        if not search(search_for, memory.look, memory.ring, memory.costs, int(guide[PLACE]), part):
            guide[PART] = 0.0
            return
        guide[PART] = part + 1.0
    if guide[PART] == search_for.parts:
        guide[PART] = 0.0
        consider(settings, memory)


def consider(settings, memory):
    """Lock to the fit of a look, if it did not lose the phase, and the readings since the window's middle were cheaper
    to it than to the lock.

    Costs are twice the nats of what was foreseen, by the lock or, where there was none, by noise.
    """
    look, state, track = memory.look, memory.state, memory.track
    cheaper = look.scalars[PAID] - look.scalars[OFFERED]
    if not (cheaper > 2.0 * settings.guide.rival and look.spread[PHI, PHI] < settings.guide.lost):
        return
    memory.costs[:] = look.scalars[OFFERED] / max(look.scalars[TAKEN], 1.0)
    begin_with(look.theta, look.spread, state, memory.cov)
    half = -0.5 * settings.search.times[0]
    lock(settings.filter, state, memory.cov, track, memory.pins, look.scalars[blind_search.NOISE], look.scalars[SWING])
    track[TURNED] = half * abs(state[RATE] - 0.5 * half * state[CHIRP])
    memory.guide[LOCKED] = 1.0


def follow(settings, memory, reading, usable):
    """The filter's part of a sample: move, take the reading; give up a lost phase or an alias."""
    track, cov, guide = memory.track, memory.cov, memory.guide
    move(settings.filter, memory.state, cov, track)
    if usable:
        error, variance = take(
            settings.filter, memory.state, cov, track, memory.row, memory.across, memory.pins, reading
        )  # fmt: skip
        memory.costs[int(guide[PLACE])] = error * error / variance + math.log(variance)
    pin(settings.filter, memory.state, cov, track, memory.pins)
    if not cov[PHI, PHI] < settings.guide.lost:
        guide[LOCKED] = 0.0
    # A fundamental beyond the pass band is an alias that the filter ran off to.
    if abs(memory.state[RATE]) > settings.filter.band:
        guide[LOCKED] = track[SCALE] = 0.0


def doubted(settings, memory):
    """Whether the lock foresees the readings worse than it says, or loudly worse than it did of late."""
    track, first = memory.track, memory.state[FIRST]
    loud = track[NOISE] > settings.guide.loud * first * first
    louder = loud and track[NOISE] > settings.guide.noisy * track[LEAST] > 0.0
    return track[SURPRISE] > settings.guide.surprised or louder


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
    """Whether the lock explains the readings: corrections of its motion are white, loud innovations too, its noise is
    no larger than of late, its fundamental stands out of it, and it has followed whole periods, unlike a step.

    The noise is learned, so that what a wrong lock leaves passes for it: the innovations alone would not tell.
    """
    track, first = memory.track, memory.state[FIRST]
    if track[EXCESS] >= settings.guide.pulled or track[TURNED] < settings.guide.proved or doubted(settings, memory):
        return False
    if track[COLOUR] > settings.guide.coloured and track[NOISE] > settings.guide.loud * first * first:
        return False
    nats = 0.5 * settings.search.window * settings.search.stride * math.log(1.0 + 0.5 * first * first / track[NOISE])
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
        mean, variance = rate_before(settings.filter, memory.state, memory.track, memory.pins, part.lag)
        # Where the smoothed noise of the motion is larger than its variance says, so is the error.
        variance *= max(float(memory.track[EXCESS]), 1.0) / 39.47841760435743
        guide[HELD] = abs(mean) / 6.283185307179586
        guide[HELD_VAR] = variance if known else max(variance, guide[HELD_VAR])
        known = known and variance < (part.vague * scale) ** 2
    frequency, sigma = guide[HELD], math.sqrt(guide[HELD_VAR])
    guide[LENGTH_VAR] += settings.filter.dt / part.worn * guide[LENGTH] * guide[LENGTH]
    if known and sigma < part.vague * frequency and speed > part.crawl * guide[FASTEST] and status != QUIET:
        variance = (speed * sigma / (frequency * frequency)) ** 2
        # Of this wavelength and the one that is held, the better known; there may be none to hold.
        if not variance > guide[LENGTH_VAR]:
            guide[LENGTH], guide[LENGTH_VAR] = speed / frequency, variance
    answer[0], answer[1] = frequency, sigma
    answer[2], answer[3] = guide[LENGTH], math.sqrt(guide[LENGTH_VAR])
    answer[4] = SEARCHING if status == OK and not known else status


def track_block(settings, memory, rows, answers):
    """Answers (n, 5) to rows (n, 2) of reading and velocity."""
    guide, part, track = memory.guide, settings.guide, memory.track
    length, enough = memory.ring.shape[0], settings.search.window * settings.search.stride
    for number in range(rows.shape[0]):
        reading, velocity = float(rows[number, 0]), float(rows[number, 1])
        usable = abs(reading) < part.limit
        place = int(guide[PLACE])
        memory.ring[place] = reading if usable else math.nan
        status = OK if usable else MISSING
        if usable and quiet(settings, memory, reading):
            status = QUIET
        memory.costs[place] = math.nan
        if guide[LOCKED] == 1.0:
            if status == QUIET:
                rest(memory.state, memory.cov, track, part.slow)
            follow(settings, memory, reading, usable)
        guide[PLACE] = (place + 1) % length
        guide[SEEN] = min(guide[SEEN] + 1.0, 1e9)
        guide[COUNT] += 1.0
        every = part.calm
        if guide[LOCKED] == 0.0:
            every = part.search
        elif track[AGE] < part.young or doubted(settings, memory):
            every = part.doubt
        if status == QUIET:
            guide[PART] = 0.0
        elif guide[PART] > 0.0:
            look_on(settings, memory)
        elif guide[COUNT] >= every and guide[SEEN] >= enough:
            guide[COUNT] = 0.0
            memory.look.scalars[CALM] = (1.0 - memory.look.scalars[CALM]) * (1.0 - guide[LOCKED])
            symmetrise(memory.cov)
            look_on(settings, memory)
        respond(settings, memory, velocity, status, answers[number])


OWN = (
    *blind_filter.KERNELS,
    *blind_search.KERNELS,
    consider,
    look_on,
    follow,
    quiet,
    doubted,
    believed,
    respond,
    track_block,
)
KERNELS, COMPILED = (*VECTORS, *OWN), (*LOOPS, *OWN)
"""All kernels, the entry last: as they run, and as they are compiled."""
