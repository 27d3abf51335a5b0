"""Arithmetic of the velocity-blind tracker: a Kalman filter of the phase of a periodic signal that moves to and fro.

State: phase phi (rad) of the fundamental, its rate w (rad/s), the chirp g = dw/dt (rad/s^2), the stiffness k (1/s^2) of
the motion, the offset b, a_1, then (c_h, s_h) for h = 2 ... H. The reading is
b + a_1 cos phi + sum_h c_h cos h phi + s_h sin h phi; the motion is dphi/dt = w, dw/dt = g, dg/dt = -k w + white noise.
A constant speed (k = 0) and a sinusoidal stroke are both exact; w changes its sign at a reversal.

Behind the state come `PINS` rates of the past, constants that later readings still correct (fixed-point smoothing,
Simon 2006, Optimal State Estimation, section 9.2): the answer is one of them. How much noise the motion and the offset
have is learned: where their corrections go one way for long, their smoothed noise is larger than its variance says,
and the score of the likelihood is for more of it (Koopman & Shephard 1992, doi:10.1093/biomet/79.4.823).
"""

import math
from typing import NamedTuple

import numpy as np

from papilla.estimators.tracking.blind_vectors import add_diagonal, carry_motion, faded_row, spread_rows, take_rows

PHI, RATE, CHIRP, STIFF, OFFSET, FIRST = range(6)
PINS = 6
NOISE, LEAST, SCALE, SURPRISE, AGE, TURNED, EXCESS = range(7)
PULL, PULL_VAR, JERK, PUSH, PUSH_VAR, DRIFT, SLOT, SINCE, LAST, COLOUR = range(7, 17)
"""Scalars of the filter: noise variance of a reading, and the least of late; fading mean square of w; fading mean of
the squared innovation over its variance; samples since the lock, rad passed since; fading mean of the chirp's
normalised smoothed noise squared (1 if true), the sum behind it and its variance; the noise of the motion; sum,
variance and noise of the offset; which pin is the newest, samples since it was set; the last
normalised innovation, and the fading mean of its products with the next one."""
TRACK = 17


class FilterSettings(NamedTuple):
    """dt: seconds a sample; harmonics: number H; band: rad/s beyond which a harmonic is not expected; jerk: least,
    largest and first noise of the motion, a fraction of w's rms a s^2 and sqrt(Hz); wander: least and largest of the
    offset, in a_1 per sqrt(s); learn: by which share of itself each grows a sample and unit of score; doubled: largest
    squares that count; memory: what is left of either sum a sample later; stiffness: drift of k in 1/s^2 per sqrt(s);
    shape: (n,) variances that the amplitudes drift a sample, in a_1^2 and units of the offset's noise,
    which like them comes from pressing; pressed: up to this one; tail: power of the harmonics beyond H in a_1^2, and
    rad a sample below which the first of them is as good as constant; forget, alert: shares of a sample in the noise
    and in the surprise; settled: samples after which the noise is known; least: s in which the least noise grows by e;
    start: sd of k at a lock, 1/s^2; floor: smallest noise variance, in a_1^2; every: samples from pin to pin."""

    dt: float
    harmonics: int
    band: float
    jerk: tuple[float, float, float]
    wander: tuple[float, float]
    learn: tuple[float, float]
    doubled: tuple[float, float]
    memory: tuple[float, float]
    stiffness: float
    shape: np.ndarray
    pressed: float
    tail: tuple[float, float]
    forget: float
    alert: float
    settled: float
    least: float
    start: float
    floor: float
    every: int


def move(settings, state, cov, track):
    """Time update by one sample of state (n + PINS,) and cov (n, n + PINS)."""
    dt = settings.dt
    rate, chirp, stiff = float(state[RATE]), float(state[CHIRP]), float(state[STIFF])
    turn = dt * (rate + 0.5 * dt * chirp)
    phase = float(state[PHI]) + turn
    if abs(phase) > 6.283185307179586:
        phase -= 6.283185307179586 * math.floor(phase / 6.283185307179586)
    rate += dt * chirp
    state[PHI], state[RATE], state[CHIRP] = phase, rate, chirp - dt * stiff * rate
    track[TURNED] += abs(turn)
    carry_motion(cov, dt, stiff, rate)
    scale = float(track[SCALE])
    scale += dt * (rate * rate - scale)
    track[SCALE] = scale
    power = float(state[FIRST]) ** 2
    add_diagonal(cov, settings.shape, power * min(float(track[DRIFT]), settings.pressed) ** 2)
    cov[CHIRP, CHIRP] += float(track[JERK]) ** 2 * scale * dt
    cov[STIFF, STIFF] += settings.stiffness * settings.stiffness * dt
    cov[OFFSET, OFFSET] += float(track[DRIFT]) ** 2 * power * dt


def take(settings, state, cov, track, row, across, pins, reading):
    """Measurement update with one reading; returns the innovation and its variance.

    The derivative is the mean one under a Gaussian phase: harmonic h fades as exp(-h^2 var(phi) / 2), so that a vague
    phase is first told by the fundamental (statistical linearisation, Gelb 1974, section 6.2).
    """
    count, size = 1, row.shape[0]
    rate = abs(float(state[RATE]))
    while count < settings.harmonics and (count + 1) * rate <= settings.band:
        count += 1
    mean, curved = faded_row(state[:size], max(float(cov[PHI, PHI]), 0.0), count, row)
    noise = float(track[NOISE])
    error = reading - mean
    # What the harmonics left out say goes one way for as long as they do not turn: it counts as one reading.
    turn, tail = (settings.harmonics + 1) * rate * settings.dt, 0.0
    if turn < 1.0:
        tail = settings.tail[0] * float(state[FIRST]) ** 2 / max(turn, settings.tail[1])
    variance = spread_rows(cov, row, across) + curved + noise + tail
    take_rows(state, cov, pins, across, variance, error)
    age = float(track[AGE]) + 1.0
    track[AGE] = age
    square = error * error / variance
    track[SURPRISE] += settings.alert * (min(square, 25.0) - track[SURPRISE])
    white = error / math.sqrt(variance)
    track[COLOUR] += settings.alert * (min(max(white * float(track[LAST]), -9.0), 9.0) - track[COLOUR])
    track[LAST] = white
    chirp, offset = float(across[CHIRP]) / variance, float(across[OFFSET]) / variance
    moved = noticed(track, PULL, settings.memory[0], chirp * error, chirp * chirp * variance)
    track[EXCESS] += settings.alert * (min(moved, 50.0) - track[EXCESS])
    shifted = noticed(track, PUSH, settings.memory[1], offset * error, offset * offset * variance)
    if age > 20.0:
        learn(track, JERK, settings.learn[0] * (min(moved, settings.doubled[0]) - 1.0), settings.jerk)
        learn(track, DRIFT, settings.learn[1] * (min(shifted, settings.doubled[1]) - 1.0), settings.wander)
    # A step must not pass for noise: squares beyond 3 sd count as 3 sd, and 0.9950 is the mean of what is left.
    surplus = (min(square, 9.0) / 0.9950 - 1.0) * noise / (noise + tail)
    forget = max(settings.forget, 2.0 / (20.0 + age))
    noise = max(noise * (1.0 + forget * surplus), settings.floor * float(state[FIRST]) ** 2)
    track[NOISE] = noise
    if age > settings.settled:
        least = float(track[LEAST]) * (1.0 + settings.dt / settings.least)
        track[LEAST] = min(least, noise) if least > 0.0 else noise
    return error, variance


def noticed(track, at, memory, step, variance):
    """Let the sum at `track[at]` fade and grow by a correction, and its variance too; its normalised square."""
    total = memory * float(track[at]) + step
    spread = memory * memory * float(track[at + 1]) + variance
    track[at], track[at + 1] = total, spread
    return total * total / max(spread, 1e-300)


def learn(track, at, growth, limits):
    """Let a noise grow by a share of itself, within its limits."""
    track[at] = min(max(float(track[at]) * (1.0 + growth), limits[0]), limits[1])


def pin(settings, state, cov, track, pins):
    """Remember the rate as it is now, every few samples, in place of the oldest one."""
    track[SINCE] += 1.0
    if track[SINCE] >= settings.every:
        track[SINCE] = 0.0
        slot = (int(track[SLOT]) + 1) % PINS
        set_pin(state, cov, pins, slot, 0.0)
        track[SLOT] = slot


def set_pin(state, cov, pins, slot, age):
    """Set a pin to the rate `age` seconds ago, by the chirp of now."""
    size = cov.shape[0]
    state[size + slot] = state[RATE] - age * state[CHIRP]
    for i in range(size):
        cov[i, size + slot] = cov[i, RATE] - age * cov[i, CHIRP]
    pins[slot] = cov[RATE, size + slot] - age * cov[CHIRP, size + slot]


def rate_before(settings, state, track, pins, lag):
    """(w, its variance) `lag` samples ago, between the two pins next to it."""
    age = max(lag - float(track[SINCE]), 0.0) / settings.every
    back = min(int(age), PINS - 2)
    part, slot = age - back, int(track[SLOT])
    size = state.shape[0] - PINS
    newer, older = (slot - back) % PINS, (slot - back - 1) % PINS
    mean = (1.0 - part) * float(state[size + newer]) + part * float(state[size + older])
    return mean, max((1.0 - part) * float(pins[newer]) + part * float(pins[older]), 0.0)


def rest(state, cov, track, slow):
    """Nothing moves: the rate is zero, and what it and the chirp will be is open by `slow` in units of w's rms."""
    for part in range(2):
        at = RATE + part
        state[at] = 0.0
        cov[at] = 0.0
        cov[:, at] = 0.0
        cov[at, at] = slow[part] ** 2 * track[SCALE]


def lock(settings, state, cov, track, pins, noise, swing):
    """Begin at a state and covariance that were set already, the noise variance of a reading being `noise`, w^2 of late
    `swing`."""
    amplitude = state[FIRST] ** 2
    track[SCALE] = max(track[SCALE], swing)
    track[NOISE] = max(noise, settings.floor * amplitude)
    track[SURPRISE], track[AGE], track[TURNED], track[EXCESS] = 1.0, 0.0, 0.0, 0.0
    track[PULL] = track[PULL_VAR] = track[PUSH] = track[PUSH_VAR] = track[LAST] = track[COLOUR] = 0.0
    track[JERK] = settings.jerk[2]
    track[DRIFT] = settings.wander[0]
    track[SLOT], track[SINCE] = 0.0, 0.0
    for back in range(PINS):
        set_pin(state, cov, pins, (PINS - back) % PINS, back * settings.every * settings.dt)


KERNELS = (noticed, learn, move, take, set_pin, pin, rate_before, rest, lock)
