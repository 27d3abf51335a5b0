"""Fits a periodic reading under an unknown stroke: maximum likelihood over a window, by Gauss-Newton steps.

The phase (in cycles, t s before now) is

  phi + f S(t) + g C(t),    S'' = -k S,  C' = S.

A constant speed is k = 0, a sinusoidal stroke k = (2 pi / period)^2; both are exact through the turn, after which the
profile is read backwards. The reading is an offset with a slope plus harmonics of the phase. The first harmonic has
only a cosine, which defines phase 0. The knowledge of the profile from before the window is a prior (moving-horizon
estimation: Rao, Rawlings & Mayne 2003, doi:10.1109/TAC.2002.808470).
"""

from typing import NamedTuple

import numpy as np

from papilla.core.units import TINY_DIVISOR
from papilla.estimators.wavelength.fundamental import FITTED_HARMONICS
from papilla.estimators.wavelength.spectrum import CYCLE_EXPONENT

HARMONIC_ORDERS = np.arange(1, FITTED_HARMONICS + 1)
CHIRP_BAND_LIMIT = 0.4
"""Frequency relative to the sampling rate above which an anti-aliasing filter has probably removed harmonics."""
FEWEST_READINGS = 32
"""In a window."""
MOTION_KNOTS = 8
"""Number of moments in the window at which the chirp may jump, because a hand is not exactly sinusoidal, and at which
the offset may bend."""
MOTION_PARAMETERS, TREND_PARAMETERS, SHAPE_PARAMETERS = 4, 2 + MOTION_KNOTS, 2 * FITTED_HARMONICS - 1
"""Parameters: phi (cycles), f (Hz), g (Hz/s), k (1/s^2); offset, slope and its changes; cosines and sines."""
_ENDS = np.cumsum([0, MOTION_PARAMETERS, MOTION_KNOTS, TREND_PARAMETERS, SHAPE_PARAMETERS]).tolist()
MOTION_PART, JUMPS_PART, TREND_PART, SHAPE_PART = map(slice, _ENDS[:-1], _ENDS[1:])
"""Where motion, jumps, trend and shape stand among all parameters."""
PRIOR_STIFFNESS_SIGMA = 60.0
"""Prior standard deviation of the stiffness (1/s^2)."""
FAINTEST_FIT_ENERGY = 2.5
"""Energy over the noise, per parameter, that a fit must explain: noise alone explains one."""
LARGEST_PHASE_STEP, PHASE_NONLINEARITY = 0.1, 0.02
"""Largest change of the phase by one step, in cycles; and its largest deviation from linearity in the stiffness."""
_HELD = 1e-2
"""Stiffness (1/s^2) below which its effect in any window is negligible, and its series is used."""


class MotionFit(NamedTuple):
    """A fitted motion and profile.

    motion (4,) at the last reading; jumps (8,) of the chirp (Hz/s), the youngest `age` s ago, the others `spacing`
    apart; trend (10,) : offset, its change over the window, and the kink at each knot; shape (9,) : cosine of the first
    harmonic, cosine and sine of each other one; covariance (31, 31) of these in this order.
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
        """(8,) times of the jumps, in s before now."""
        return -(self.age + self.spacing * np.arange(MOTION_KNOTS))

    @property
    def proved(self) -> bool:
        """Whether the harmonics explain more than noise could."""
        return self.gain > FAINTEST_FIT_ENERGY * SHAPE_PART.stop


def swung(stiffness: float, time):
    """S, C, dS/dk, dC/dk and S' at times (m,) or at one time."""
    # The closed forms divide by k; near 0 they lose all digits, so their series is used.
    if abs(stiffness) < _HELD:
        cube = time**3 / 6
        quartic = cube * time / 4
        return time - stiffness * cube, time**2 / 2 - stiffness * quartic, -cube, -quartic, 1 - stiffness * time**2 / 2
    # k > 0 is a swing (sine), k < 0 a motion that runs away (hyperbolic sine): one formula for both.
    root, (turn, swing) = abs(stiffness) ** 0.5, (np.cos, np.sin) if stiffness > 0 else (np.cosh, np.sinh)
    turned, sine = turn(root * time), swing(root * time) / root
    cosine = (1 - turned) / stiffness
    by_sine = (time * turned - sine) / (2 * stiffness)
    return sine, cosine, by_sine, (time * sine - 2 * cosine) / (2 * stiffness), turned


def moved(motion: np.ndarray, time: float) -> np.ndarray:
    """The motion (4,) with its time zero `time` later."""
    phase, rate, chirp, stiffness = motion.tolist()
    sine, cosine, _, _, turned = swung(stiffness, time)
    return np.array([
        phase + rate * sine + chirp * cosine, rate * turned + chirp * sine, chirp * turned - stiffness * rate * sine,
        stiffness,
    ])  # fmt: skip


def rates_at(stroke: MotionFit, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rates (m,) in Hz at times (m,), and their derivatives (m, 12) by the motion and the jumps."""
    _, rate, chirp, stiffness = stroke.motion.tolist()
    sine, _, by_sine, _, turned = swung(stiffness, time)
    # The parameters are those of the present. Before a jump the frequency differs from them by jump x (t - t_jump).
    bent = np.minimum(time[:, None] - stroke.knots, 0.0)
    by_stiffness = chirp * by_sine - 0.5 * rate * time * sine
    slopes = np.column_stack([np.zeros(len(time)), turned, sine, by_stiffness, bent])
    return rate * turned + chirp * sine + bent @ stroke.jumps, slopes


def phase_at(stroke: MotionFit, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Phase (m,) in cycles at times (m,), and |rate| in Hz."""
    sine, cosine, _, _, turned = swung(float(stroke.motion[-1]), time)
    return _phase(stroke, sine, cosine, turned, np.minimum(time[:, None] - stroke.knots, 0.0))


def _phase(stroke: MotionFit, sine, cosine, turned, before: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    phase, rate, chirp, _ = stroke.motion.tolist()
    bent = before @ stroke.jumps
    turns = phase + rate * sine + chirp * cosine + 0.5 * (before * before) @ stroke.jumps
    return turns, np.abs(rate * turned + chirp * sine + bent)


def profile(phase: np.ndarray, speed: np.ndarray, rate_Hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Columns of the shape (m, 9) at phases and |rates| (m,), and their derivatives by the phase, per cycle."""
    waves = _waves(phase, speed, rate_Hz)
    return _shaped(waves), _shaped(CYCLE_EXPONENT * HARMONIC_ORDERS * waves)


def _waves(phase: np.ndarray, speed: np.ndarray, rate_Hz: float) -> np.ndarray:
    """(m, 5) harmonics; 0 if the sampling rate does not show them."""
    waves = np.empty((len(phase), FITTED_HARMONICS), complex)
    waves[:, 0] = np.exp(CYCLE_EXPONENT * phase)
    for order in range(1, FITTED_HARMONICS):
        waves[:, order] = waves[:, order - 1] * waves[:, 0]
    waves *= np.outer(speed, HARMONIC_ORDERS) < CHIRP_BAND_LIMIT * rate_Hz
    return waves


def _shaped(waves: np.ndarray) -> np.ndarray:
    return np.concatenate([waves.real, waves[:, 1:].imag], axis=1)


def trend_of(time: np.ndarray, before: np.ndarray) -> np.ndarray:
    """(m, 10) columns of the offset, its change over the window, and its kinks; before (m, 8) : s before each knot."""
    return np.column_stack([np.ones(len(time)), time / -time[0], before / -time[0]])


class Design(NamedTuple):
    """The linearised model of a stroke: columns (m, 31) of derivatives of the readings by its parameters, 0 for missing
    readings; residual (m,); motion (m, 12) : derivatives of the phase by motion and jumps; seen (m,) : readings that
    are not missing; reach : of the window, s."""

    stroke: MotionFit
    columns: np.ndarray
    residual: np.ndarray
    motion: np.ndarray
    seen: np.ndarray
    reach: float


def designed(stroke: MotionFit, readings: np.ndarray, time: np.ndarray, rate_Hz: float) -> Design:
    """The first half of a Gauss-Newton step: the model of `stroke`, linearised for readings (m,), NaN if missing, at
    times (m,) before now."""
    seen, (_, rate, chirp, stiffness) = np.isfinite(readings), stroke.motion.tolist()
    sine, cosine, by_sine, by_cosine, turned = swung(stiffness, time)
    before = np.minimum(time[:, None] - stroke.knots, 0.0)
    waves = _waves(*_phase(stroke, sine, cosine, turned, before), rate_Hz)
    # Complex amplitudes a - i b, so that Re(waves @ shape) is the profile, and 2 pi i n times it its slope by the
    # phase.
    shape = stroke.shape[:FITTED_HARMONICS] - 1j * np.append(0.0, stroke.shape[FITTED_HARMONICS:])
    slopes = (waves @ (CYCLE_EXPONENT * HARMONIC_ORDERS * shape)).real
    # Derivatives of the phase by phi, f, g and k, and by each jump; times the slope of the profile they are those of
    # the reading. Offset and shape are linear: their columns are their values.
    by_stiffness = rate * by_sine + chirp * by_cosine
    motion = np.column_stack([np.ones(len(time)), sine, cosine, by_stiffness, 0.5 * before * before])
    columns = np.concatenate([motion * slopes[:, None], trend_of(time, before), _shaped(waves)], axis=1)
    fitted = columns[:, TREND_PART.start :] @ stroke.values[TREND_PART.start :]
    if not seen.all():
        columns *= seen[:, None]
    return Design(stroke, columns, np.where(seen, readings - fitted, 0.0), motion, seen, abs(float(time[0])))


def solved(design: Design, prior: np.ndarray, about: np.ndarray) -> MotionFit:
    """The second half: the improved stroke. prior (31, 31), about (31,) : prior information on the parameters, and its
    mean."""
    stroke, jacobian, residual, motion, seen, reach = design
    values = stroke.values
    normal = jacobian.T @ jacobian / stroke.noise + prior
    # Unit diagonal before inverting: the parameters' units differ by many powers of ten.
    scale = normal.diagonal() ** -0.5
    inverse = np.linalg.inv(normal * np.multiply.outer(scale, scale) + 1e-10 * np.eye(len(scale)))
    inverse *= np.multiply.outer(scale, scale)
    step = inverse @ (jacobian.T @ residual / stroke.noise + prior @ (about - values))
    # A Gauss-Newton step is valid as long as the readings are linear in the parameters.
    turn = float(np.abs((motion @ step[: JUMPS_PART.stop])[seen]).max(initial=0.0))
    bend = abs(float(stroke.motion[1]) * reach**5) * float(step[MOTION_PARAMETERS - 1]) ** 2 / 60
    # Shorten a step that would turn the phase by more than LARGEST_PHASE_STEP, or change k so much that its second
    # order counts.
    by_bend = (PHASE_NONLINEARITY / max(bend, TINY_DIVISOR)) ** 0.5
    step *= min(LARGEST_PHASE_STEP / max(turn, TINY_DIVISOR), by_bend, 1.0)
    values += step
    # The columns of missing readings are 0.
    waves = jacobian[:, SHAPE_PART] @ values[SHAPE_PART]
    # Energy of the harmonics about their mean: what the profile explains beyond an offset.
    power = float(waves @ waves) - float(waves.sum()) ** 2 / max(int(seen.sum()), 1)
    return stroke._replace(
        motion=values[MOTION_PART], jumps=values[JUMPS_PART], trend=values[TREND_PART], shape=values[SHAPE_PART],
        covariance=inverse, residual=residual - jacobian @ step, gain=power / stroke.noise,
    )  # fmt: skip
