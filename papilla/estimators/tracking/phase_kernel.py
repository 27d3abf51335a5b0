"""Arithmetic of the space-domain tracker: an extended Kalman filter of wavenumber, phase, harmonics and offset.

State: k (rad/mm), phi (rad, of the fundamental here), a_1, the shear phase q, then (c_h, s_h) for h = 2 ... H, and the
offset b. The reading is b + a_1 cos phi + sum_h c_h cos h phi + s_h sin h phi. Moving by dx turns phi by k dx - q dr:
the skin trails the finger by q r / k, where r is 1 in steady sliding and turns to -1 over a distance after a reversal.
"""

import math
from typing import NamedTuple

NOISE, SPEED, AGE, TRUE_K, TRUE_KP, TRUE_P, RELAY, TURN, SEEN, STRENGTH = range(10)
"""Scalars of the tracker: noise variance of a reading, mean square of dx in mm^2, samples since the lock; the
covariance of (k, phi) errors of a wavenumber that does not drift (the filter's own one overstates it); where the skin
is between trailing on one side (1) and the other (-1), and its last change; samples seen; mean square slope by the
phase."""
TRACK = 10


class PhaseSettings(NamedTuple):
    """harmonics: number H; band: largest phase step of a harmonic in a sample, rad; loop: loop frequency in rad/sample;
    amplitude, offset: drift of amplitudes (a fraction of a_1) and of the offset (of the noise's sd) in a sample;
    forget: of the noise estimate per sample; floor: smallest noise variance; shear: mm by which the skin may trail (its
    sd, before it is known); relax: mm of sliding in which it turns over; still: dx in mm below which it stands."""

    harmonics: int
    band: float
    loop: float
    amplitude: float
    offset: float
    forget: float
    floor: float
    shear: float
    relax: float
    still: float


def harmonic_model(settings, state, step, row):
    """Fill `row` with the derivative of the reading by the state; return the reading. `step` is the phase step, rad."""
    last = settings.harmonics * 2 + 2
    phase = state[1]
    cosine, sine = math.cos(phase), math.sin(phase)
    amplitude = state[2]
    reading = state[last] + amplitude * cosine
    slope = -amplitude * sine
    row[:] = 0.0
    row[2] = cosine
    row[last] = 1.0
    c, s = cosine, sine
    for h in range(2, settings.harmonics + 1):
        if h * step > settings.band:
            break
        c, s = c * cosine - s * sine, s * cosine + c * sine
        at = 2 * h
        in_phase, quadrature = state[at], state[at + 1]
        reading += in_phase * c + quadrature * s
        slope += h * (quadrature * c - in_phase * s)
        row[at] = c
        row[at + 1] = s
    row[1] = slope
    return reading


def harmonic_slope(settings, state, step):
    """Mean square of d reading / d phi over a period, of the harmonics inside the band."""
    total = state[2] * state[2]
    for h in range(2, settings.harmonics + 1):
        if h * step > settings.band:
            break
        at = 2 * h
        total += h * h * (state[at] * state[at] + state[at + 1] * state[at + 1])
    return 0.5 * total


def lock_phase(settings, state, cov, track, nominee, lever):
    """Start the filter at a nominee of the bank; `lever` is the distance in mm from the middle of the window to
    here."""
    size = 2 * settings.harmonics + 3
    amplitude, length, count = nominee[2], max(nominee[6], 1e-9), nominee[7]
    variance = nominee[4] / max(count - nominee[8], 1.0)
    phase_variance = min(2 * variance / (amplitude * amplitude * count) + 0.003, 1.0)
    wave_variance = 12 * phase_variance / (length * length)
    state[:] = 0.0
    state[0], state[1], state[2], state[size - 1] = nominee[0], nominee[1], amplitude, nominee[3]
    cov[:] = 0.0
    cov[0, 0] = wave_variance
    cov[1, 1] = phase_variance + lever * lever * wave_variance
    cov[0, 1] = cov[1, 0] = lever * wave_variance
    cov[2, 2] = 0.09 * amplitude * amplitude
    cov[3, 3] = (settings.shear * nominee[0]) ** 2
    for h in range(2, settings.harmonics + 1):
        at = 2 * h
        cov[at, at] = cov[at + 1, at + 1] = (0.4 * amplitude / h) ** 2
        if 2 * h + 6 < nominee.shape[0]:
            state[at], state[at + 1] = nominee[2 * h + 5], nominee[2 * h + 6]
    cov[size - 1, size - 1] = 0.09 * amplitude * amplitude
    track[TRUE_K], track[TRUE_KP], track[TRUE_P] = cov[0, 0], cov[0, 1], cov[1, 1]
    track[AGE] = 0.0


def turning(settings, track, dx):
    """Turn the relay of the shear over the distance dx; whether it is still on its way, the first motion excepted."""
    if dx == 0.0:
        return False
    side = math.copysign(1.0, dx)
    if track[RELAY] == 0.0:
        track[RELAY] = side
    track[TURN] = (side - track[RELAY]) * -math.expm1(-abs(dx) / settings.relax)
    track[RELAY] += track[TURN]
    return abs(side - track[RELAY]) > 0.1


def move_phase(settings, state, cov, track, dx):
    """Time update: the finger moves on by dx in mm."""
    size = 2 * settings.harmonics + 3
    if dx != 0.0:
        dr = track[TURN]
        state[1] += state[0] * dx - state[3] * dr
        if abs(state[1]) > 6.283185307179586:
            state[1] -= 6.283185307179586 * math.floor(state[1] / 6.283185307179586)
        cov[1] += dx * cov[0] - dr * cov[3]
        cov[:, 1] += dx * cov[:, 0] - dr * cov[:, 3]
        track[TRUE_P] += dx * (2 * track[TRUE_KP] + dx * track[TRUE_K])
        track[TRUE_KP] += dx * track[TRUE_K]
    step = abs(state[0] * dx)
    noise = track[NOISE]
    square = max(track[SPEED], 1e-30)
    track[STRENGTH] = harmonic_slope(settings, state, step)
    drift = settings.loop**4 * min(noise / max(track[STRENGTH], 1e-30), 10.0) / square
    cov[0, 0] += drift
    if abs(dx) <= settings.still:
        track[TRUE_K] += drift
    drift = (settings.amplitude * state[2]) ** 2
    cov[2, 2] += drift
    for h in range(2, settings.harmonics + 1):
        at = 2 * h
        own = drift / (h * h)
        cov[at, at] += own
        cov[at + 1, at + 1] += own
    cov[size - 1, size - 1] += settings.offset * settings.offset * noise


def take_phase(state, cov, track, phase, variance):
    """Measurement update with the phase itself, which is known but for whole turns."""
    turns = (phase - state[1]) / (2 * math.pi)
    error = 2 * math.pi * (turns - math.floor(turns + 0.5))
    across = cov[:, 1].copy()
    total = across[1] + variance
    state += across / total * error
    cov -= across.reshape(-1, 1) / total * across
    track[TRUE_K], track[TRUE_KP], track[TRUE_P] = cov[0, 0], cov[0, 1], cov[1, 1]


def feed_phase(settings, state, cov, track, row, reading, step):
    """Measurement update with one reading; returns the innovation and its variance."""
    error = reading - harmonic_model(settings, state, step, row)
    across = cov @ row
    within = row @ across
    noise = track[NOISE]
    variance = within + noise
    gain = across / variance
    state += gain * error
    scaled = across / math.sqrt(variance)
    cov -= scaled.reshape(-1, 1) * scaled
    k, p, g = gain[0], gain[1], row[1]
    kk, kp, pp = track[TRUE_K], track[TRUE_KP], track[TRUE_P]
    stay = 1.0 - p * g
    track[TRUE_K] = kk - 2 * k * g * kp + k * k * (g * g * pp + noise)
    track[TRUE_KP] = stay * (kp - k * g * pp) + k * p * noise
    track[TRUE_P] = stay * stay * pp + p * p * noise
    track[AGE] += 1.0
    track[SEEN] += 1.0
    forget = max(settings.forget, 2.0 / (20.0 + track[SEEN]))
    # A step must not pass for noise: squares beyond 2 sd count as 2 sd, and 0.92 is the mean of what is left.
    square = min(error * error / variance, 4.0) / 0.9205
    track[NOISE] = max(noise * (1.0 + forget * (square - 1.0)), settings.floor)
    return error, variance
