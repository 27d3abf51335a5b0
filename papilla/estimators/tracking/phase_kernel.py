"""Arithmetic of the space-domain tracker: an extended Kalman filter of wavenumber, phase, harmonics and offset.

State: k (rad/mm), phi (rad, of the fundamental here), the shear phase q, the offset b, then a_1 ... a_H and c_1 ...
The reading is b + sum_h a_h cos h phi + c_h sin h phi; c_1 = 0 says what phi is. Moving by dx turns phi by
k dx - q dr: the skin trails the finger by q r / k, where r is 1 in steady sliding and turns to -1 over a distance after
a reversal.
"""

import math
from typing import NamedTuple

import numpy as np

from papilla.estimators.tracking.bank_kernel import (
    AMPLITUDE,
    FIT,
    LENGTH,
    OFFSET,
    PARAMETERS,
    PHASE,
    REST,
    SAMPLES,
    SERIES,
    WAVENUMBER,
)
from papilla.estimators.tracking.vectors import carry, harmonic_row, spread_row, take_error

NOISE, SPEED, AGE, TRUE_K, TRUE_KP, TRUE_P, RELAY, TURN, SEEN, STRENGTH, SURPRISE = range(11)
KICK, DUE, BATCH, ANGLE, EXCESS, LAST, BEFORE, NEXT, SECOND, COLOUR = range(11, 21)
"""Scalars of the tracker: noise variance of a reading, mean square of dx in mm^2, samples since the lock; the
covariance of (k, phi) errors of a wavenumber that does not drift (the filter's own one overstates it); where the skin
is between trailing on one side (1) and the other (-1), and its last change; samples seen; mean square slope by the
phase; recent mean square of the normalised innovations; corrections of k since the present period began, their
variance in white noise, samples and angle since, and by how much the squares of such sums exceed that variance; the
last two innovations, mean products of neighbours and of next neighbours, and `colour`."""
TRACK = 21
OFFSET_AT, FIRST = 3, 4
TURN_AROUND = 2 * math.pi
FAR = 9.0
"""Normalised square from which an innovation is not noise, and counts as 3 sd: one in 370 samples of noise is."""
ODD = 2.0
"""Mean square of eight normalised innovations that noise alone passes in 1 % of all samples."""


class PhaseSettings(NamedTuple):
    """band: largest phase step of a harmonic in a sample, rad; loop: loop frequency in rad/sample; amplitude, offset:
    drift of amplitudes (a fraction of a_1) and of the offset (of the noise's sd) in a sample; forget: of the noise
    estimate per sample; floor: smallest noise variance; shear: mm by which the skin may trail (its sd, before it is
    known); relax: mm of sliding in which it turns over; still: dx in mm below which it stands; memory: samples that
    the excess of k's corrections is taken over; orders: (H,) 1, 2 ... H; shape: (2 H + 4,) drift of each amplitude."""

    band: float
    loop: float
    amplitude: float
    offset: float
    forget: float
    floor: float
    shear: float
    relax: float
    still: float
    memory: float
    orders: np.ndarray
    shape: np.ndarray


class Phase(NamedTuple):
    """What the filter remembers: state, its covariance, scalars; then room to work."""

    state: np.ndarray
    cov: np.ndarray
    track: np.ndarray
    row: np.ndarray
    across: np.ndarray


def present_harmonics(settings, step):
    """How many harmonics pass the anti-aliasing at a phase step in rad."""
    count = settings.orders.shape[0]
    return count if step * count <= settings.band else max(int(settings.band / step), 1)


def watch_colour(settings, track, error, variance):
    """Keep the innovations' autocovariance at one and two samples: none in noise, that of a line wherever one is left.

    With the cosines of an angle and of its double, one of the two is large at any frequency. A step of the baseline
    must not pass for a line: innovations beyond 3 sd count as 3 sd, and none while they surprise. A line
    that stays does not, being in the noise variance.
    """
    noise, share = track[NOISE], 2.0 / settings.memory
    most = math.sqrt(FAR * noise)
    value = min(max(error * math.sqrt(noise / variance), -most), most)
    last, before = track[LAST], track[BEFORE]
    if track[SURPRISE] < ODD:
        track[NEXT] += share * (value * last - track[NEXT])
        track[SECOND] += share * (value * before - track[SECOND])
    track[LAST], track[BEFORE] = value, last


def colour(settings, track, power):
    """Mean square of what is left in the innovations and is not white, over that of the texture's signal, `power`.

    White noise alone makes averages over N samples of sd noise / sqrt(N); three of these do not count.
    """
    chance = 3.0 * track[NOISE] * math.sqrt(1.0 / settings.memory)
    left = math.hypot(track[NEXT], track[SECOND]) - chance
    return max(left, 0.0) / max(power, 1e-300)


def measure_slope(settings, phase, step):
    """Keep the mean square of d reading / d phi over a period, of the harmonics inside the band, and the colour."""
    power, total, count, state = 0.0, 0.0, settings.orders.shape[0], phase.state
    for h in range(present_harmonics(settings, step)):
        in_phase, quadrature = float(state[FIRST + h]), float(state[FIRST + count + h])
        square = in_phase * in_phase + quadrature * quadrature
        power += square
        total += (h + 1) * (h + 1) * square
    phase.track[STRENGTH], phase.track[COLOUR] = 0.5 * total, colour(settings, phase.track, 0.5 * power)


def lock_phase(settings, phase, nominee, lever):
    """Start the filter at a nominee of the bank; `lever` is the distance in mm from the middle of the window to
    here."""
    state, cov, track = phase.state, phase.cov, phase.track
    count = settings.orders.shape[0]
    amplitude, length, samples = nominee[AMPLITUDE], max(nominee[LENGTH], 1e-9), nominee[SAMPLES]
    variance = nominee[REST] / max(samples - nominee[PARAMETERS], 1.0)
    phase_variance = min(2 * variance / (amplitude * amplitude * samples) + 0.003, 1.0)
    wave_variance = 12 * phase_variance / (length * length)
    state[:] = 0.0
    state[0], state[1], state[OFFSET_AT], state[FIRST] = (
        nominee[WAVENUMBER],
        nominee[PHASE],
        nominee[OFFSET],
        amplitude,
    )
    cov[:] = 0.0
    cov[0, 0] = wave_variance
    cov[1, 1] = phase_variance + lever * lever * wave_variance
    cov[0, 1] = cov[1, 0] = lever * wave_variance
    cov[2, 2] = (settings.shear * nominee[WAVENUMBER]) ** 2
    cov[OFFSET_AT, OFFSET_AT] = cov[FIRST, FIRST] = 0.09 * amplitude * amplitude
    for h in range(1, count):
        for at in (FIRST + h, FIRST + count + h):
            cov[at, at] = (0.4 * amplitude / (h + 1)) ** 2
        if h < FIT:
            state[FIRST + h] = nominee[SERIES + 2 * h - 2]
            state[FIRST + count + h] = nominee[SERIES + 2 * h - 1]
    track[TRUE_K], track[TRUE_KP], track[TRUE_P] = float(cov[0, 0]), float(cov[0, 1]), float(cov[1, 1])
    track[AGE] = track[KICK] = track[DUE] = track[BATCH] = track[ANGLE] = 0.0
    track[SURPRISE] = track[EXCESS] = 1.0
    measure_slope(settings, phase, 0.0)


def turning(settings, track, dx):
    """Turn the relay of the shear over the distance dx; whether it is still on its way, the first motion excepted."""
    if dx == 0.0:
        track[TURN] = 0.0
        return False
    side, relay = math.copysign(1.0, dx), track[RELAY]
    if relay == 0.0:
        relay = side
    left = side - relay
    turn = left if abs(left) < 1e-9 else left * -math.expm1(-abs(dx) / settings.relax)
    track[TURN] = turn
    track[RELAY] = relay + turn
    return abs(left - turn) > 0.1


def move_phase(settings, phase, dx, slack):
    """Time update: the finger moves on by dx in mm, known to `slack` mm."""
    state, cov, track = phase.state, phase.cov, phase.track
    dr, noise, wavenumber, first = track[TURN], track[NOISE], float(state[0]), float(state[FIRST])
    angle = float(state[1]) + wavenumber * dx - float(state[2]) * dr
    state[1] = angle - TURN_AROUND * math.floor(angle / TURN_AROUND)
    carry(cov, settings.shape, (settings.amplitude * first) ** 2, dx, dr)
    true_k, true_kp, true_p = track[TRUE_K], track[TRUE_KP], track[TRUE_P]
    track[TRUE_P] = true_p + dx * (2 * true_kp + dx * true_k)
    track[TRUE_KP] = true_kp + dx * true_k
    strength, square = max(track[STRENGTH], 1e-30), max(track[SPEED], 1e-30)
    drift = settings.loop**4 * min(noise / strength, 10.0) / square
    cov[0, 0] += drift
    if abs(dx) <= settings.still:
        track[TRUE_K] = true_k + drift
    cov[OFFSET_AT, OFFSET_AT] += settings.offset * settings.offset * noise
    if slack > 0.0:
        doubt = (wavenumber * slack) ** 2
        cov[1, 1] += doubt
        track[TRUE_P] += doubt


def take_phase(phase, angle, variance):
    """Measurement update with the phase itself, which is known but for whole turns."""
    state, cov, track = phase.state, phase.cov, phase.track
    turns = (angle - float(state[1])) / TURN_AROUND
    error = TURN_AROUND * (turns - math.floor(turns + 0.5))
    phase.row[:] = 0.0
    phase.row[1] = 1.0
    within = spread_row(cov, phase.row, phase.across)
    phase.row[OFFSET_AT] = 1.0
    take_error(state, cov, phase.across, within + variance, error)
    track[TRUE_K], track[TRUE_KP], track[TRUE_P] = float(cov[0, 0]), float(cov[0, 1]), float(cov[1, 1])


def correct_truth(track, across, row, total, noise, error):
    """Follow the covariance of the actual (k, phi) error, and what the corrections of k say about the noise."""
    certainty, g = 1.0 / total, float(row[1])
    k, p = float(across[0]) * certainty, float(across[1]) * certainty
    kk, kp, pp = track[TRUE_K], track[TRUE_KP], track[TRUE_P]
    stay = 1.0 - p * g
    track[TRUE_K] = kk - 2 * k * g * kp + k * k * (g * g * pp + noise)
    track[TRUE_KP] = stay * (kp - k * g * pp) + k * p * noise
    track[TRUE_P] = stay * stay * pp + p * p * noise
    track[KICK] += k * error
    track[DUE] += k * k * (g * g * pp + noise)


def close_period(settings, track, step):
    """At the end of a period of the texture: compare the sum of k's corrections with what white noise would make it.

    Coloured noise and errors of the model correct k again and again in one direction within a period; the error of k
    is then larger by the root of the excess (the idea of batch means). `step` is the phase step, rad.
    """
    samples, angle, due = track[BATCH] + 1.0, track[ANGLE] + step, track[DUE]
    if angle >= TURN_AROUND and samples >= 8.0 and due > 0.0:
        share = min(2.0 * samples / settings.memory, 0.25)
        kick, excess = track[KICK], track[EXCESS]
        track[EXCESS] = excess + share * (kick * kick / due - excess)
        samples = angle = track[KICK] = track[DUE] = 0.0
    track[BATCH], track[ANGLE] = samples, angle


def feed_phase(settings, phase, reading, step):
    """Measurement update with one reading; returns the innovation and the variance that it should have."""
    state, track, row, across = phase.state, phase.track, phase.row, phase.across
    error = reading - harmonic_row(settings.orders, state, present_harmonics(settings, step), row)
    within = spread_row(phase.cov, row, across)
    noise = track[NOISE]
    variance = within + noise
    normal = error * error / variance
    surprise = track[SURPRISE]
    surprise += 0.125 * (min(normal, 16.0) - surprise)
    track[SURPRISE] = surprise
    # While something else than noise disturbs the readings, they say less about the wavenumber.
    used = noise * surprise if surprise > ODD else noise
    if normal > FAR:
        used = max(used, error * error / FAR)
    take_error(state, phase.cov, across, within + used, error)
    correct_truth(track, across, row, within + used, used, error)
    close_period(settings, track, step)
    watch_colour(settings, track, error, variance)
    track[AGE] += 1.0
    seen = track[SEEN] + 1.0
    track[SEEN] = seen
    forget = max(settings.forget, 2.0 / (20.0 + seen))
    # A step must not pass for noise: squares beyond 2 sd count as 2 sd, and 0.92 is the mean of what is left.
    square = min(normal, 4.0) / 0.9205
    track[NOISE] = max(noise * (1.0 + forget * (square - 1.0)), settings.floor)
    return error, variance
