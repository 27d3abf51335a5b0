"""Static and kinetic friction in both directions from tangential and normal force, the sensor's offset removed.

While the finger slides, the tangential force is T = offset + mu_+ N one way and T = offset - mu_- N the other way. A
Kalman filter of (mu_+, mu_-, offset) takes one look at T and N for every half millimetre of steady sliding: its
covariance says by itself what one direction, or a constant normal force, leaves unknown.
"""

import math
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.stream import Stream
from papilla.status import Status

_NONE = math.nan
MEMORY_MM = 50.0
"""Slid path after which what was learnt of a direction has faded to 1 / e."""


class FrictionStatus(Status):
    """What became of an answer; the greater the number, the more is missing."""

    OK = 0, "ok"
    ALIKE = 1, "the normal force varied too little to tell the directions apart: they share the difference"
    ONE_WAY = 2, "slid one way only: the offset of the sensor is not removed"
    STATIC_BELOW_KINETIC = 3, "the breakaway is below the kinetic friction: its peak was not seen"
    OUTLIER = 4, "the forces contradict all sliding so far: left out"
    CHANGED = 5, "the friction changed: learning anew"
    NO_CONTACT = 6, "no contact"
    NOT_SLIDING = 7, "has not slid yet"
    BAD_INPUT = 8, "a force or the velocity is missing or not finite"


OK, ALIKE, ONE_WAY, STATIC_BELOW_KINETIC, OUTLIER, CHANGED, NO_CONTACT, NOT_SLIDING, BAD_INPUT = map(
    int, FrictionStatus
)

_NO_PULL = (-math.inf, 0.0)
LOOK_MM = 0.5
"""Path of one look. Friction differs from place to place, so readings closer than that do not count as new ones."""
SETTLE = 5.0
"""Time constants of the low-pass after a start or a turn before a sample counts as steady sliding."""
MEDIAN = 5
"""Samples whose median goes on, of each column: a burst of up to two wrong samples leaves no trace."""
GATE = 5.0
"""Standard deviations from which a look contradicts the others."""
CHANGE_LOOKS = 4
"""Contradicting looks in a row (2 mm of path) that are a change of friction, not a fault."""
ANISOTROPY = 0.05
"""Prior standard deviation of mu_+ - mu_-, in their mean: a worn skin or a woven cloth has about as much."""
MU_SIGMA = 1.0
"""Prior standard deviation of a coefficient of friction: next to no prior."""
SCATTER = 0.02
"""Scatter of T / N among looks that is taken for granted until looks have shown theirs; it weighs as much as
`SCATTER_LOOKS` looks do."""
SCATTER_LOOKS = 4.0
LEAST_SCATTER = 1e-3
"""Scatter of T / N that no force sensor is better than: its own linearity."""
MEDIAN_BEND = 0.404
"""Variance of the second differences of medians of five samples of white noise, over that of the noise."""
REST_NOISES, NOISE_SAMPLES = 4.0, 200.0
"""Standard deviations of the velocity's noise below which the finger rests, and samples that this is known from."""
REST_SHARE = 0.02
"""Share of the greatest recent speed below which the finger rests: an encoder's noise grows with what it measures."""
TOLD_APART = 0.5
"""Share of its prior that the standard deviation of mu_+ - mu_- must fall below for the directions to be told apart."""


class FrictionEstimate(NamedTuple):
    """mu_kinetic and mu_static of the direction of the last sliding, offset_N, their standard deviations, and status.

    The status is a `FrictionStatus`. NaN where there is no answer. Of a block, arrays (n,).
    """

    mu_kinetic: float | np.ndarray
    mu_static: float | np.ndarray
    offset_N: float | np.ndarray
    mu_kinetic_sigma: float | np.ndarray
    mu_static_sigma: float | np.ndarray
    offset_sigma_N: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self):
        """The status in words: a string, or a list of them."""
        return FrictionStatus.in_words(self.status)


def _no_answer(status: int) -> FrictionEstimate:
    return FrictionEstimate(_NONE, _NONE, _NONE, _NONE, _NONE, _NONE, status)


_NOTHING_YET = _no_answer(NOT_SLIDING)


class Look(NamedTuple):
    """Sums over samples of steady sliding: how many, their path in mm, tangential and normal force in N."""

    samples: int = 0
    path: float = 0.0
    tangential: float = 0.0
    normal: float = 0.0


@dataclass
class FrictionState:
    """All that the estimator remembers.

    P (3, 3), x (3,) : mu_+, mu_-, offset in N, with their covariance.
    scatter : mean square of the looks' residuals over N, and `looks` : how many looks it comes from.
    contradicting : the contradicting looks in a row. slid : whether there was a look in either direction.
    remark : CHANGED, OUTLIER or OK.
    recent : the last samples, that the median is taken of; before : the last two medians of the velocity.
    tangential, normal, velocity : behind the low-pass; NaN before the first sample.
    top : greatest recent speed in mm/s; noise : standard deviation of the velocity's noise in mm/s.
    heading : 1, -1, or 0 where the finger has not moved; sliding : samples since the start, up to the longest that
    matters; look : the look that is being taken.
    peak : greatest tangential force towards the movement, and the normal force then, of this start; pulls : the same of
    the rest before it, towards positive and negative velocities; breakaway : of the last whole start of each direction.
    """

    P: np.ndarray
    x: np.ndarray = field(default_factory=lambda: np.zeros(3))
    scatter: float = SCATTER**2
    looks: float = SCATTER_LOOKS
    contradicting: int = 0
    slid: tuple[bool, bool] = (False, False)
    remark: int = OK
    recent: tuple[tuple[float, ...], ...] = ()
    before: tuple[float, float] = (0.0, 0.0)
    tangential: float = _NONE
    normal: float = _NONE
    velocity: float = _NONE
    top: float = 0.0
    noise: float = 0.0
    heading: int = 0
    sliding: int = 0
    look: Look = Look()
    peak: tuple[float, float] = _NO_PULL
    pulls: tuple[tuple[float, float], ...] = (_NO_PULL, _NO_PULL)
    breakaway: tuple[tuple[float, float], ...] = ((_NONE, _NONE), (_NONE, _NONE))


class Friction(Stream):
    """Streaming coefficients of friction; one sample is (tangential_N, force_N, velocity_mm_s).

    tangential_N is positive where friction opposes a positive velocity_mm_s. Forces and velocity pass a median of five
    samples and a first-order low-pass. It also lowers the breakaway peak, so a static coefficient is only worth stating
    with `low_pass_Hz`: a peak that lasts 1 / (2 pi low_pass_Hz) is read at 63 % of its height over the kinetic level.

    Kinetic: the filter of this module's text. Looks that contradict it are left out, and four in a row are a change of
    friction, after which both directions are learnt anew.
    Static: (T - offset) / N at the greatest T between coming to rest and `onset_s` after the start; of the last start
    of each direction. A start without a rest (a turn between two samples) has only the time after it.

    Parameters
    ----------
    sample_rate_Hz, low_pass_Hz : low_pass_Hz < sample_rate_Hz / 2.
    rest_mm_s : speed below it is rest; None takes it from the noise of the velocity. A speed below 2 % of the greatest
        recent one is rest too.
    contact_N : normal force below it is no contact; it ends a start.
    onset_s : how long after the start the breakaway may come.
    memory_mm : slid path after which what was learnt of a direction has faded to 1 / e.
    offset_sigma_N : standard deviation of what the tangential sensor reads without a load.

    Raises `InputError` for unusable values.
    """

    columns = ("tangential_N", "force_N", "velocity_mm_s")
    answer: ClassVar[type] = FrictionEstimate

    def __init__(
        self,
        *,
        sample_rate_Hz: float = 1000.0,
        low_pass_Hz: float = 20.0,
        rest_mm_s: float | None = None,
        contact_N: float = 0.02,
        onset_s: float = 0.1,
        memory_mm: float = MEMORY_MM,
        offset_sigma_N: float = 0.2,
    ):
        rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
        self.low_pass_Hz = checks.positive("low_pass_Hz", low_pass_Hz)
        if not self.low_pass_Hz < 0.5 * rate:
            raise InputError(f"low_pass_Hz must be below half of sample_rate_Hz, got {low_pass_Hz:g} at {rate:g} Hz")
        self._step = 1 / rate
        self._gain = 1 - math.exp(-2 * math.pi * self.low_pass_Hz / rate)
        self._rest = None if rest_mm_s is None else checks.positive("rest_mm_s", rest_mm_s)
        self._contact = checks.positive("contact_N", contact_N)
        self._onset = max(round(checks.positive("onset_s", onset_s) * rate), 1)
        self._settled = max(self._onset, math.ceil(SETTLE * rate / (2 * math.pi * self.low_pass_Hz)))
        self._shortest = math.ceil(rate / (math.pi * self.low_pass_Hz))
        self._length = checks.positive("memory_mm", memory_mm)
        self._prior = np.zeros((3, 3))
        self._prior[:2, :2] = MU_SIGMA**2 + np.array([[1, -1], [-1, 1]]) * (ANISOTROPY / 2) ** 2
        self._prior[2, 2] = checks.positive("offset_sigma_N", offset_sigma_N) ** 2
        self.reset()

    def _fresh(self) -> FrictionState:
        return FrictionState(self._prior.copy())

    def _remember(self, memory: FrictionState) -> None:
        self._memory = memory
        self._answers = self._answer(0), self._answer(1)

    @property
    def coefficients(self) -> tuple[FrictionEstimate, FrictionEstimate]:
        """What is known of each direction: velocity > 0, velocity < 0."""
        return self._answers

    def _take(self, sample: tuple[float, ...]) -> FrictionEstimate:
        """A sample with a missing value changes nothing."""
        if not math.isfinite(sum(sample)):
            return _no_answer(BAD_INPUT)
        memory = self._memory
        memory.recent = (*memory.recent[1 - MEDIAN :], sample)
        tangential, normal, velocity = [sorted(column)[len(column) // 2] for column in zip(*memory.recent, strict=True)]
        if memory.tangential != memory.tangential:
            memory.tangential, memory.normal, memory.velocity = tangential, normal, velocity
            memory.before = velocity, velocity
        # Second differences hold the noise and next to nothing of a movement.
        earlier, last = memory.before
        bend = (velocity - 2 * last + earlier) ** 2 / MEDIAN_BEND
        memory.noise = math.sqrt(memory.noise**2 + (bend - memory.noise**2) / NOISE_SAMPLES)
        memory.before = last, velocity
        memory.tangential += self._gain * (tangential - memory.tangential)
        memory.normal += self._gain * (normal - memory.normal)
        memory.velocity += self._gain * (velocity - memory.velocity)
        if normal < self._contact or memory.normal < self._contact:
            memory.sliding, memory.look, memory.pulls = 0, Look(), (_NO_PULL, _NO_PULL)
            return _no_answer(NO_CONTACT)
        self._follow(velocity)
        return self._answers[0 if memory.heading > 0 else 1] if memory.heading else _NOTHING_YET

    def _follow(self, velocity: float) -> None:
        """Rest, start or steady sliding: what this sample is, and what is learnt from it."""
        memory, speed = self._memory, abs(velocity)
        path = speed * self._step
        memory.top = max(memory.top * math.exp(-path / self._length), abs(memory.velocity))
        still = REST_NOISES * memory.noise if self._rest is None else self._rest
        heading = 0 if speed < max(still, REST_SHARE * memory.top) else 1 if velocity > 0 else -1
        if heading == 0:
            memory.sliding, memory.look = 0, Look()
            pulls = zip((memory.tangential, -memory.tangential), memory.pulls, strict=True)
            memory.pulls = tuple(max((pull, memory.normal), before) for pull, before in pulls)
            return
        if heading != memory.heading or memory.sliding == 0:
            # The peak may come before the velocity shows; a turn without a sample at rest has none before it.
            memory.heading, memory.sliding, memory.look = heading, 0, Look()
            memory.peak, memory.pulls = memory.pulls[0 if heading > 0 else 1], (_NO_PULL, _NO_PULL)
        memory.sliding = min(memory.sliding + 1, self._settled + 1)
        if memory.sliding <= self._onset:
            memory.peak = max(memory.peak, (heading * memory.tangential, memory.normal))
            if memory.sliding == self._onset:
                up, down = memory.breakaway
                memory.breakaway = (memory.peak, down) if heading > 0 else (up, memory.peak)
                self._remember(memory)
        if memory.sliding > self._settled:
            samples, before, tangential, normal = memory.look
            memory.look = Look(samples + 1, before + path, tangential + memory.tangential, normal + memory.normal)
            if memory.look.path >= LOOK_MM and memory.look.samples >= self._shortest:
                self._learn(memory.look)
                memory.look = Look()

    def _learn(self, look: Look) -> None:
        """One look: learnt, left out because it contradicts the others, or the last sign of a change."""
        memory, way = self._memory, 0 if self._memory.heading > 0 else 1
        tangential, normal = look.tangential / look.samples, look.normal / look.samples
        H = np.array([normal, 0.0, 1.0] if way == 0 else [0.0, -normal, 1.0])
        self._fade(way, look.path)
        residual = tangential - float(H @ memory.x)
        spread = float(H @ memory.P @ H) + memory.scatter * normal**2
        memory.contradicting = memory.contradicting + 1 if residual**2 > GATE**2 * spread else 0
        memory.slid = memory.slid[0] or way == 0, memory.slid[1] or way == 1
        if memory.contradicting == CHANGE_LOOKS:
            memory.x[:2], memory.P[:2, :], memory.P[:, :2] = 0.0, 0.0, 0.0
            memory.P[:2, :2] = self._prior[:2, :2]
            memory.scatter, memory.looks, memory.contradicting = SCATTER**2, SCATTER_LOOKS, 0
            memory.remark, memory.slid = CHANGED, (way == 0, way == 1)
        elif memory.contradicting:
            memory.remark = OUTLIER
        elif memory.remark != CHANGED or memory.looks >= 2 * SCATTER_LOOKS:
            memory.remark = OK
        if not memory.contradicting:
            self._correct(H, tangential - float(H @ memory.x), normal)
        self._remember(memory)

    def _fade(self, way: int, path: float) -> None:
        """After `path` mm more in a direction, what its looks told beyond the others fades."""
        P = self._memory.P
        own = 1 / np.linalg.inv(P)[way, way]
        P[way, way] = max(P[way, way], min(P[way, way] + own * math.expm1(path / self._length), MU_SIGMA**2))

    def _correct(self, H: np.ndarray, residual: float, normal: float) -> None:
        """The Kalman correction by one look, and the looks' scatter with its residual in it."""
        memory, R = self._memory, self._memory.scatter * normal**2
        S = float(H @ memory.P @ H) + R
        K = memory.P @ H / S
        rest = np.eye(3) - np.outer(K, H)
        # A residual's square is S on average, of which R is the scatter's own share.
        scatter = (memory.looks * memory.scatter + residual**2 * R / S / normal**2) / (memory.looks + 1)
        memory.x = memory.x + K * residual
        memory.P = rest @ memory.P @ rest.T + R * np.outer(K, K)
        memory.scatter, memory.looks = max(scatter, LEAST_SCATTER**2), min(memory.looks + 1, self._length / LOOK_MM)

    def _answer(self, way: int) -> FrictionEstimate:
        """What is known of a direction: 0 for velocity > 0, 1 for velocity < 0."""
        memory = self._memory
        if not any(memory.slid):
            return _NOTHING_YET
        (offset, offset_sigma), (mu, sigma) = (
            (float(memory.x[number]), math.sqrt(memory.P[number, number])) for number in (2, way)
        )
        if not memory.slid[way]:
            mu = sigma = _NONE
        pull, normal = memory.breakaway[way]
        static = static_sigma = _NONE
        if normal > 0:
            static = (pull - (1 - 2 * way) * offset) / normal
            static_sigma = math.hypot(offset_sigma / normal, math.sqrt(memory.scatter))
        return FrictionEstimate(mu, static, offset, sigma, static_sigma, offset_sigma, self._status(static, mu))

    def _status(self, static: float, mu: float) -> int:
        memory = self._memory
        if memory.remark:
            return memory.remark
        if static < mu * (1 - 2 * math.sqrt(memory.scatter)):
            return STATIC_BELOW_KINETIC
        if not all(memory.slid):
            return ONE_WAY
        apart = memory.P[0, 0] + memory.P[1, 1] - 2 * memory.P[0, 1]
        return ALIKE if apart > (TOLD_APART * ANISOTROPY) ** 2 else OK
