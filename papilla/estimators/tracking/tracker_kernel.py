"""One sample of the guided tracker: the bank proposes, the phase filter tracks, the supervisor decides between them."""

import math
from collections.abc import Callable

from papilla.estimators.tracking import bank_kernel, guide_kernel, phase_kernel, vectors
from papilla.estimators.tracking.bank_kernel import (
    WEIGHT,
    clear_bank,
    feed_bank,
    move_bank,
)
from papilla.estimators.tracking.guide_kernel import (
    COAST,
    GAP,
    LOCKED,
    VELOCITY,
    restart_window,
    supervise,
    watch,
)
from papilla.estimators.tracking.phase_kernel import (
    COLOUR,
    EXCESS,
    NOISE,
    SPEED,
    STRENGTH,
    TRUE_K,
    TRUE_P,
    feed_phase,
    move_phase,
    turning,
)

TAKEN, NO_READING, NO_VELOCITY, TOO_FAST, STILL = range(5)
WAVENUMBER_OUT, SIGMA_OUT, OUTCOME_OUT, LOCKED_OUT, STRENGTH_OUT, PHASE_OUT, PHASE_SIGMA_OUT, COLOUR_OUT = range(8)
ANSWER = 8
"""Columns of an answer."""


def travelled(settings, guide, velocity):
    """Distance in mm since the last known velocity, and how well it is known."""
    before, gap = guide[VELOCITY], guide[GAP]
    guide[VELOCITY], guide[GAP] = velocity, 0.0
    if before != before:
        before, gap = velocity, 0.0
    # Rows without a velocity took their time too; the path between two velocities is known to a quarter of its range.
    return 0.5 * (before + velocity) * settings.dt * (1.0 + gap), 0.25 * abs(velocity - before) * settings.dt * gap


def track_sample(settings, memory, reading, velocity):
    """Take one reading and velocity (mm/s); what became of it: TAKEN ... STILL."""
    guide, phase, sums = memory.guide, memory.phase, memory.bank.sums
    if not abs(velocity) < 1e6:
        guide[GAP] += 1.0
        return NO_VELOCITY
    adrift = guide[GAP] > settings.guide.gap
    dx, slack = travelled(settings.guide, guide, velocity)
    moves = abs(dx) > settings.phase.still
    track = phase.track
    if moves:
        square = track[SPEED]
        track[SPEED] = dx * dx if square == 0.0 else square + settings.guide.speed * (dx * dx - square)
    move_bank(settings.bank, memory.bank, dx)
    slips = turning(settings.phase, track, dx) and settings.phase.shear > 0.0
    if slips or adrift:
        # The skin is still turning over, or the way was not seen: earlier positions are not those of the skin.
        sums[WEIGHT] = 0.0
    locked = guide[LOCKED] == 1.0
    if locked:
        move_phase(settings.phase, phase, dx, slack)
        if adrift or (slips and phase.cov[1, 1] > settings.guide.lost):
            guide[COAST] = 1.0
    if not abs(reading) < settings.guide.limit:
        return NO_READING
    step = abs(float(phase.state[0]) * dx)
    if step > settings.phase.band or abs(dx) * settings.bank.step * settings.bank.low > settings.phase.band:
        return TOO_FAST
    if sums[WEIGHT] == 0.0:
        restart_window(memory, reading)
    feed_bank(settings.bank, memory.bank, reading)
    if locked and guide[COAST] == 0.0:
        error, variance = feed_phase(settings.phase, phase, reading, step)
        watch(settings.guide, memory, reading, error, variance)
    supervise(settings, memory, dx, step)
    if locked and not sound(settings.bank, phase):
        guide[LOCKED] = guide[COAST] = 0.0
        phase.state[:] = 0.0
    return TAKEN if moves else STILL


def sound(bank, phase):
    """Whether the tracker is inside the bank's wavenumbers and its covariance is one."""
    inside = 0.8 * bank.low * bank.step < phase.state[0] < 1.2 * bank.high * bank.step
    return inside and phase.cov[0, 0] > 0.0 and phase.cov[1, 1] > 0.0 and phase.track[TRUE_K] > 0.0


def track_block(settings, memory, rows, answers):
    """Take rows (n, 2) of reading and velocity; answers (n, 8): wavenumber, its sd, what became of the sample, whether
    the tracker is locked, its signal to noise: mean square slope over noise variance, phase and its sd, and
    how much of the signal's power is left as colour."""
    track = memory.phase.track
    for i in range(rows.shape[0]):
        answers[i, OUTCOME_OUT] = track_sample(settings, memory, float(rows[i, 0]), float(rows[i, 1]))
        answers[i, WAVENUMBER_OUT] = memory.phase.state[0]
        answers[i, SIGMA_OUT] = math.sqrt(max(track[TRUE_K], 0.0) * max(track[EXCESS], 1.0))
        answers[i, LOCKED_OUT] = memory.guide[LOCKED]
        answers[i, STRENGTH_OUT] = track[STRENGTH] / max(track[NOISE], 1e-300)
        answers[i, PHASE_OUT] = memory.phase.state[1]
        answers[i, PHASE_SIGMA_OUT] = math.sqrt(max(track[TRUE_P], 0.0))
        answers[i, COLOUR_OUT] = track[COLOUR]


KERNELS: tuple[Callable, ...] = (
    *vectors.LOOPS,
    clear_bank,
    move_bank,
    feed_bank,
    bank_kernel.window_length,
    bank_kernel.lowest,
    bank_kernel.harmonics_of,
    bank_kernel.fit_series,
    bank_kernel.between,
    bank_kernel.look,
    bank_kernel.nominate,
    bank_kernel.rounding,
    bank_kernel.prefer_multiple,
    phase_kernel.present_harmonics,
    phase_kernel.colour,
    phase_kernel.measure_slope,
    phase_kernel.lock_phase,
    turning,
    move_phase,
    phase_kernel.take_phase,
    phase_kernel.correct_truth,
    phase_kernel.close_period,
    phase_kernel.watch_colour,
    feed_phase,
    restart_window,
    watch,
    guide_kernel.convinced,
    guide_kernel.take_look,
    guide_kernel.choose,
    guide_kernel.try_multiple,
    guide_kernel.usable,
    guide_kernel.trusted,
    guide_kernel.beside,
    guide_kernel.find_phase,
    guide_kernel.clear_average,
    guide_kernel.lock_to_nominee,
    guide_kernel.decide,
    guide_kernel.leave_submultiple,
    guide_kernel.pause,
    supervise,
    travelled,
    sound,
    track_sample,
    track_block,
)
"""Every function in the order of their calls, for `kernels`."""

APART: tuple[Callable, ...] = (
    bank_kernel.fit_series,
    bank_kernel.nominate,
    phase_kernel.measure_slope,
    phase_kernel.lock_phase,
    restart_window,
    guide_kernel.take_look,
    guide_kernel.choose,
    guide_kernel.try_multiple,
    guide_kernel.lock_to_nominee,
    guide_kernel.decide,
    guide_kernel.leave_submultiple,
)
"""Those of them that few samples need: compiled into each caller they would only take long to compile."""
