"""Arithmetic of the velocity-blind tracker: a Kalman filter of the phase of a periodic signal that moves to and fro.

State: phase phi (rad) of the fundamental, its rate w (rad/s), the chirp g = dw/dt (rad/s^2), the stiffness k (1/s^2) of
the motion, the offset b, a_1, then (c_h, s_h) for h = 2 ... H. The reading is
b + a_1 cos phi + sum_h c_h cos h phi + s_h sin h phi; the motion is dphi/dt = w, dw/dt = g, dg/dt = -k w + white noise.
A constant speed (k = 0) and a sinusoidal stroke are both exact; w changes its sign at a reversal.
"""

import math
from typing import NamedTuple

from papilla.estimators.tracking.vectors import spread_row, take_error

PHI, RATE, CHIRP, STIFF, OFFSET, FIRST = range(6)
NOISE, SCALE, SURPRISE, AGE, PULL, PULL_VAR, EXCESS, TURNED = range(8)
"""Scalars of the filter: noise variance of a reading, fading mean square of w, fading mean of the squared innovation
over its variance, samples since the lock; the fading sum of the chirp's corrections, its variance if they are white,
the fading mean of its normalised square; rad passed since the lock, of either sign."""
TRACK = 8


class FilterSettings(NamedTuple):
    """dt: seconds a sample; harmonics: number H; band: rad/s beyond which a harmonic is not expected; jerk: of the
    motion's noise, a fraction of w's rms a s^2 and sqrt(Hz); pulled, stretch, memory: its power grows by `stretch` for
    each unit by which EXCESS is above `pulled` (1 if white), the sum behind it fades by `memory` a sample; stiffness,
    amplitude, offset: drifts per sqrt(s), of k in 1/s^2, of the amplitudes in a_1, of b in a_1; forget, alert: shares
    of a sample in the noise and in the surprise; start: sd of k at a lock, 1/s^2; floor: smallest noise variance,
    in a_1^2."""

    dt: float
    harmonics: int
    band: float
    jerk: float
    pulled: float
    stretch: float
    memory: float
    stiffness: float
    amplitude: float
    offset: float
    forget: float
    alert: float
    start: float
    floor: float


def move(settings, state, cov, track):
    """Time update by one sample."""
    dt, size = settings.dt, state.shape[0]
    half = 0.5 * dt * dt
    turn = dt * state[RATE] + half * state[CHIRP]
    state[PHI] += turn
    track[TURNED] += abs(turn)
    if abs(state[PHI]) > 6.283185307179586:
        state[PHI] -= 6.283185307179586 * math.floor(state[PHI] / 6.283185307179586)
    state[RATE] += dt * state[CHIRP]
    rate, stiff = state[RATE], state[STIFF]
    state[CHIRP] -= dt * stiff * rate
    # The rows first, then the columns: F P F' of one shear after another.
    for j in range(size):
        cov[PHI, j] += dt * cov[RATE, j] + half * cov[CHIRP, j]
        cov[RATE, j] += dt * cov[CHIRP, j]
        cov[CHIRP, j] -= dt * (stiff * cov[RATE, j] + rate * cov[STIFF, j])
    for j in range(size):
        cov[j, PHI] += dt * cov[j, RATE] + half * cov[j, CHIRP]
        cov[j, RATE] += dt * cov[j, CHIRP]
        cov[j, CHIRP] -= dt * (stiff * cov[j, RATE] + rate * cov[j, STIFF])
    track[SCALE] += dt * (rate * rate - track[SCALE])
    jerk = settings.jerk
    swept = 1.0 + settings.stretch * max(track[EXCESS] - settings.pulled, 0.0)
    cov[CHIRP, CHIRP] += jerk * jerk * swept * track[SCALE] * dt
    cov[STIFF, STIFF] += settings.stiffness * settings.stiffness * dt
    power = state[FIRST] * state[FIRST] * dt
    cov[OFFSET, OFFSET] += settings.offset * settings.offset * power
    drift = settings.amplitude * settings.amplitude * power
    cov[FIRST, FIRST] += drift
    for h in range(2, settings.harmonics + 1):
        at = 2 * h + 2
        cov[at, at] += drift / (h * h)
        cov[at + 1, at + 1] += drift / (h * h)


def expected(settings, state, cov, row):
    """The expected reading under a Gaussian phase, and the variance that its curvature adds to the linear part.

    `row` is filled with the mean derivative of the reading by the state: harmonic h fades as exp(-h^2 var(phi) / 2),
    so that a vague phase is first told by the fundamental (statistical linearisation, Gelb 1974, section 6.2).
    """
    spread = max(cov[PHI, PHI], 0.0)
    cosine, sine = math.cos(state[PHI]), math.sin(state[PHI])
    fade = math.exp(-0.5 * spread)
    amplitude = state[FIRST]
    reading = state[OFFSET] + amplitude * cosine * fade
    slope = -amplitude * sine * fade
    curved = 0.5 * amplitude * amplitude * (1.0 - fade * fade * (1.0 + spread))
    row[:] = 0.0
    row[OFFSET] = 1.0
    row[FIRST] = cosine * fade
    c, s, odd, weight = cosine, sine, fade, fade
    for h in range(2, settings.harmonics + 1):
        if h * abs(state[RATE]) > settings.band:
            break
        c, s = c * cosine - s * sine, s * cosine + c * sine
        odd *= fade * fade
        weight *= odd
        at = 2 * h + 2
        in_phase, quadrature = state[at], state[at + 1]
        reading += weight * (in_phase * c + quadrature * s)
        slope += h * weight * (quadrature * c - in_phase * s)
        power = 0.5 * (in_phase * in_phase + quadrature * quadrature)
        curved += power * (1.0 - weight * weight * (1.0 + h * h * spread))
        row[at] = weight * c
        row[at + 1] = weight * s
    row[PHI] = slope
    return reading, max(curved, 0.0)


def take(settings, state, cov, track, row, across, reading):
    """Measurement update with one reading; returns the innovation and its variance."""
    mean, curved = expected(settings, state, cov, row)
    error = reading - mean
    variance = spread_row(cov, row, across) + curved + track[NOISE]
    take_error(state, cov, across, variance, error)
    pull = across[CHIRP] * across[CHIRP] / variance
    track[PULL] = settings.memory * track[PULL] + across[CHIRP] / variance * error
    track[PULL_VAR] = settings.memory * settings.memory * track[PULL_VAR] + pull
    drive = track[PULL] * track[PULL] / max(track[PULL_VAR], 1e-300)
    track[EXCESS] += settings.alert * (min(drive, 50.0) - track[EXCESS])
    square = error * error / variance
    track[SURPRISE] += settings.alert * (min(square, 25.0) - track[SURPRISE])
    track[AGE] += 1.0
    # A step must not pass for noise: squares beyond 3 sd count as 3 sd, and 0.9950 is the mean of what is left.
    surplus = min(square, 9.0) / 0.9950 - 1.0
    forget = max(settings.forget, 2.0 / (20.0 + track[AGE]))
    floor = settings.floor * state[FIRST] * state[FIRST]
    track[NOISE] = max(track[NOISE] * (1.0 + forget * surplus), floor)
    return error, variance


def rate_before(state, cov, lag):
    """(w, its variance) `lag` seconds ago, by the motion run backwards from what is known now."""
    rate, stiff = state[RATE], state[STIFF]
    half = 0.5 * lag * lag
    by_rate, by_stiff = 1.0 - stiff * half, -rate * half
    mean = by_rate * rate - lag * state[CHIRP]
    variance = by_rate * (by_rate * cov[RATE, RATE] - 2 * lag * cov[RATE, CHIRP] + 2 * by_stiff * cov[RATE, STIFF])
    variance += lag * (lag * cov[CHIRP, CHIRP] - 2 * by_stiff * cov[CHIRP, STIFF])
    variance += by_stiff * by_stiff * cov[STIFF, STIFF]
    return mean, max(variance, 0.0)


def lock(settings, state, cov, track, nominee, rate_sd, chirp_sd):
    """Start at a nominee (phase, w, g, offset, amplitude, noise variance); the sds are those of w and g."""
    state[:] = 0.0
    cov[:] = 0.0
    state[PHI], state[RATE], state[CHIRP] = nominee[0], nominee[1], nominee[2]
    state[OFFSET], state[FIRST], track[NOISE] = nominee[3], nominee[4], nominee[5]
    amplitude = state[FIRST] * state[FIRST]
    cov[PHI, PHI] = 0.1
    cov[RATE, RATE] = rate_sd * rate_sd
    cov[CHIRP, CHIRP] = chirp_sd * chirp_sd
    cov[STIFF, STIFF] = settings.start * settings.start
    cov[OFFSET, OFFSET] = cov[FIRST, FIRST] = 0.09 * amplitude
    for h in range(2, settings.harmonics + 1):
        at = 2 * h + 2
        cov[at, at] = cov[at + 1, at + 1] = 0.16 * amplitude / (h * h)
    track[SCALE] = state[RATE] * state[RATE]
    track[SURPRISE], track[AGE], track[TURNED] = 1.0, 0.0, 0.0
    track[PULL] = track[PULL_VAR] = track[EXCESS] = 0.0
    track[NOISE] = max(track[NOISE], settings.floor * amplitude)


def symmetrise(cov):
    """Remove what rounding adds to the difference of a covariance and its transpose."""
    for i in range(cov.shape[0]):
        for j in range(i):
            cov[i, j] = cov[j, i] = 0.5 * (cov[i, j] + cov[j, i])


KERNELS = (spread_row, take_error, move, expected, take, rate_before, lock, symmetrise)
