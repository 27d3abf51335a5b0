"""A periodic reading under an unknown stroke: maximum likelihood over a window, by Gauss and Newton's steps.

The phase (in cycles, t s before now) is phi + f S(t) + g C(t), with S'' = -k S and C' = S: a constant speed is k = 0, a
sinusoidal stroke k = (2 pi / period)^2, and either is exact through its turn, where the profile is read backwards. The
reading is an offset with a slope and the harmonics of that phase; of the first one only the cosine, which says what
phase is. What was learned of the profile before the window is a prior (moving-horizon estimation: Rao, Rawlings & Mayne
2003, doi:10.1109/TAC.2002.808470).
"""

from typing import NamedTuple

import numpy as np

HARMONICS = 5
BAND = 0.4
"""Of the sampling rate: harmonics above it are expected to have been removed by anti-aliasing."""
KNOTS = 8
"""Moments along the window at which the chirp may jump, as a hand's does that is no sinusoid, and the offset bend."""
MOTION, TREND, SHAPE = 4, 2 + KNOTS, 2 * HARMONICS - 1
"""Parameters: phi (cycles), f (Hz), g (Hz/s), k (1/s^2); offset, slope and its changes; cosines and sines."""
FAINT = 2.5
"""Energy over the noise, for each parameter, that a fit must explain: noise explains one."""
TURN, BENT = 0.1, 0.02
"""Cycles by which a step may turn the phase at most; and bend it beyond what is linear in the stiffness."""
_HELD = 1e-2
"""1/s^2 below which a stiffness is as good as none over any window, and its series is used."""


class Stroke(NamedTuple):
    """A fit.

    motion (4,) at the last reading; jumps (8,) of the chirp (Hz/s), the youngest `age` s ago, the others `spacing`
    apart; trend (10,) : offset, its change over the window, and the change of this at each knot; shape (9,) : cosine of
    the first harmonic, cosine and sine of each other; covariance (31, 31) of these in their order.
    noise : variance of a reading; residual (m,); gain : energy that the harmonics explain, in units of the noise.
    """

    motion: np.ndarray
    jumps: np.ndarray
    age: float
    spacing: float
    trend: np.ndarray
    shape: np.ndarray
    covariance: np.ndarray
    noise: float
    residual: np.ndarray
    gain: float

    @property
    def values(self) -> np.ndarray:
        """All parameters (31,)."""
        return np.concatenate([self.motion, self.jumps, self.trend, self.shape])

    @property
    def knots(self) -> np.ndarray:
        """(8,) times of the jumps, s before now."""
        return -(self.age + self.spacing * np.arange(KNOTS))

    @property
    def proved(self) -> bool:
        """Whether the harmonics explain so much that noise does not."""
        return self.gain > FAINT * (MOTION + KNOTS + TREND + SHAPE)


def swung(stiffness: float, time):
    """S, C, dS/dk, dC/dk and S' at times (m,) or at one."""
    if abs(stiffness) < _HELD:
        cube = time**3 / 6
        quartic = cube * time / 4
        return time - stiffness * cube, time**2 / 2 - stiffness * quartic, -cube, -quartic, 1 - stiffness * time**2 / 2
    root = np.emath.sqrt(stiffness)
    turned = np.cos(root * time).real
    sine = (np.sin(root * time) / root).real
    cosine = (1 - turned) / stiffness
    by_sine = (time * turned - sine) / (2 * stiffness)
    return sine, cosine, by_sine, (time * sine - 2 * cosine) / (2 * stiffness), turned


def moved(motion: np.ndarray, time: float) -> np.ndarray:
    """The motion (4,) told of a moment `time` later."""
    phase, rate, chirp, stiffness = motion.tolist()
    sine, cosine, _, _, turned = swung(stiffness, time)
    return np.array([
        phase + rate * sine + chirp * cosine, rate * turned + chirp * sine, chirp * turned - stiffness * rate * sine,
        stiffness,
    ])  # fmt: skip


def rate_at(stroke: Stroke, time: float) -> tuple[float, np.ndarray]:
    """Rate in Hz at a time, and its derivatives (12,) by the motion and the jumps."""
    _, rate, chirp, stiffness = stroke.motion.tolist()
    sine, _, by_sine, _, turned = swung(stiffness, time)
    bent = np.minimum(time - stroke.knots, 0.0)
    slopes = np.array([0.0, turned, sine, -0.5 * rate * time * sine + chirp * by_sine, *bent])
    return rate * turned + chirp * sine + float(bent @ stroke.jumps), slopes


def phase_at(stroke: Stroke, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Phase (m,) in cycles at times (m,), and |rate| in Hz."""
    phase, rate, chirp, stiffness = stroke.motion.tolist()
    sine, cosine, _, _, turned = swung(stiffness, time)
    before = np.minimum(time[:, None] - stroke.knots, 0.0)
    phase = phase + rate * sine + chirp * cosine + 0.5 * before**2 @ stroke.jumps
    return phase, np.abs(rate * turned + chirp * sine + before @ stroke.jumps)


def profile(phase: np.ndarray, speed: np.ndarray, rate_Hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Columns of the shape (m, 9) at phases and |rates| (m,), and what they change by with the phase, a cycle."""
    orders = np.arange(1, HARMONICS + 1)
    waves = np.exp(2j * np.pi * np.outer(phase, orders)) * (np.outer(speed, orders) < BAND * rate_Hz)
    slopes = 2j * np.pi * orders * waves
    columns, changes = (np.column_stack([part.real, part[:, 1:].imag]) for part in (waves, slopes))
    return columns, changes


def trend_of(time: np.ndarray, before: np.ndarray) -> np.ndarray:
    """(m, 10) columns of the offset, its change over the window, and its kinks; before (m, 8) : s before each knot."""
    return np.column_stack([np.ones(len(time)), time / -time[0], before / -time[0]])


def improved(stroke: Stroke, readings: np.ndarray, time: np.ndarray, rate_Hz: float, prior, about) -> Stroke:
    """One step from a stroke, on readings (m,), NaN where missing, at times (m,) before now.

    prior (31, 31), about (31,) : information that is known of the parameters, and where it is centred.
    """
    seen, values = np.isfinite(readings), stroke.values
    _, rate, chirp, stiffness = stroke.motion.tolist()
    sine, cosine, by_sine, by_cosine, _ = swung(stiffness, time)
    columns, slopes = profile(*phase_at(stroke, time), rate_Hz)
    before = np.minimum(time[:, None] - stroke.knots, 0.0)
    trend, bends = trend_of(time, before), 0.5 * before**2
    motion = np.column_stack([np.ones(len(time)), sine, cosine, rate * by_sine + chirp * by_cosine, bends])
    jacobian = np.hstack([motion * (slopes @ stroke.shape)[:, None], trend, columns]) * seen[:, None]
    residual = np.where(seen, readings - trend @ stroke.trend - columns @ stroke.shape, 0.0)
    normal = jacobian.T @ jacobian / stroke.noise + prior
    scale = np.sqrt(normal.diagonal())
    inverse = np.linalg.inv(normal / np.outer(scale, scale) + 1e-10 * np.eye(len(scale))) / np.outer(scale, scale)
    step = inverse @ (jacobian.T @ residual / stroke.noise + prior @ (about - values))
    # Gauss and Newton's step holds where the readings are straight in the parameters.
    turn = float(np.abs((motion @ step[: MOTION + KNOTS])[seen]).max(initial=0.0))
    bend = abs(rate * float(time[0]) ** 5) * float(step[MOTION - 1]) ** 2 / 60
    step *= min(TURN / max(turn, 1e-12), (BENT / max(bend, 1e-12)) ** 0.5, 1.0)
    waves = columns @ (values + step)[-SHAPE:]
    waves = np.where(seen, waves - waves[seen].mean() if seen.any() else 0.0, 0.0)
    parts = np.split(values + step, [MOTION, MOTION + KNOTS, MOTION + KNOTS + TREND])
    return stroke._replace(
        motion=parts[0], jumps=parts[1], trend=parts[2], shape=parts[3], covariance=inverse,
        residual=residual - jacobian @ step, gain=float(waves @ waves) / stroke.noise,
    )  # fmt: skip
