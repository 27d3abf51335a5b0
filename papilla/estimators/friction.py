"""Static and kinetic friction in both directions from tangential and normal force, the sensor's offset removed.

While the finger slides, the tangential force is T = offset + mu_+ N one way and T = offset - mu_- N the other way. A
Kalman filter of (mu_+, mu_-, offset) takes one look at T and N for every half millimetre of steady sliding: its
covariance says by itself what one direction, or a constant normal force, leaves unknown.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.errors import InputError
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
    """Sums over the samples of one look: how many, their path in mm, tangential and normal force in N."""

    samples: int = 0
    path: float = 0.0
    tangential: float = 0.0
    normal: float = 0.0


@dataclass(frozen=True)
class FrictionState:
    """All that the estimator remembers.

    x (3,) and P (3, 3) : mu_+, mu_-, offset in N, and their covariance.
    scatter : mean square of the looks' residuals over N, and `looks` : how many looks it comes from.
    recent : the last samples, that the median is taken of.
    tangential, normal, velocity : behind the low-pass; NaN before the first sample.
    top : greatest recent speed in mm/s; noise : standard deviation of the velocity's noise in mm/s;
    before : its last two medians.
    heading : 1, -1, or 0 where the finger has not moved.
    sliding : samples since the start, up to the longest that matters.
    look : the look that is being taken.
    contradicting : the contradicting looks in a row.
    slid : whether there was a look in either direction.
    remark : CHANGED, OUTLIER or OK.
    peak : greatest tangential force towards the movement, and the normal force then, of this start.
    pulls : the same of the rest before it, towards positive and negative velocities.
    breakaway : the same of the last whole start of each direction.
    """

    x: tuple[float, ...]
    P: tuple[tuple[float, ...], ...]
    scatter: float = SCATTER**2
    looks: float = SCATTER_LOOKS
    recent: tuple[tuple[float, float, float], ...] = ()
    tangential: float = _NONE
    normal: float = _NONE
    velocity: float = _NONE
    top: float = 0.0
    noise: float = 0.0
    before: tuple[float, float] = (0.0, 0.0)
    heading: int = 0
    sliding: int = 0
    look: Look = Look()
    contradicting: int = 0
    slid: tuple[bool, bool] = (False, False)
    remark: int = OK
    peak: tuple[float, float] = _NO_PULL
    pulls: tuple[tuple[float, float], ...] = (_NO_PULL, _NO_PULL)
    breakaway: tuple[tuple[float, float], ...] = ((_NONE, _NONE), (_NONE, _NONE))


class Friction:
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

    _recent: tuple[tuple[float, float, float], ...]
    _tangential: float
    _normal: float
    _velocity: float
    _top: float
    _noise: float
    _before: tuple[float, float]
    _heading: int
    _sliding: int
    _look: Look
    _peak: tuple[float, float]
    _pulls: tuple[tuple[float, float], ...]

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
        self._memory = checks.positive("memory_mm", memory_mm)
        self._prior = np.zeros((3, 3))
        self._prior[:2, :2] = MU_SIGMA**2 + np.array([[1, -1], [-1, 1]]) * (ANISOTROPY / 2) ** 2
        self._prior[2, 2] = checks.positive("offset_sigma_N", offset_sigma_N) ** 2
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.state = FrictionState((0.0, 0.0, 0.0), tuple(map(tuple, self._prior.tolist())))

    @property
    def state(self) -> FrictionState:
        """All that the estimator remembers, to be kept or to be set again."""
        return replace(self._kept, **{name: getattr(self, f"_{name}") for name in _FAST})

    @state.setter
    def state(self, state: FrictionState) -> None:
        self._kept = state
        for name in _FAST:
            setattr(self, f"_{name}", getattr(state, name))
        self._answers = self._solve()

    @property
    def coefficients(self) -> tuple[FrictionEstimate, FrictionEstimate]:
        """What is known of each direction: velocity > 0, velocity < 0."""
        return self._answers

    def process(self, block) -> FrictionEstimate:
        """Estimates after each row of a block (n, 3); bit for bit what `update` gives row by row.

        Raises `InputError` for a block of another shape.
        """
        rows = np.asarray(block, float)
        if rows.ndim != 2 or rows.shape[1] != 3:
            shape = " x ".join(map(str, rows.shape))
            raise InputError(f"a block must be n x 3 (tangential_N, force_N, velocity_mm_s), got {shape}")
        answers = np.array([self.update(row) for row in rows.tolist()]).reshape(-1, len(FrictionEstimate._fields))
        *values, status = answers.T
        return FrictionEstimate._make([*values, status.astype(int)])

    def update(self, sample) -> FrictionEstimate:
        """The estimate after one more sample (tangential_N, force_N, velocity_mm_s).

        A sample with a missing value changes nothing. Raises `InputError` for a sample of another length.
        """
        if len(sample) != 3:
            raise InputError(f"a sample must be (tangential_N, force_N, velocity_mm_s), got {len(sample)} values")
        tangential, normal, velocity = map(float, sample)
        if not (tangential - tangential == 0.0 and normal - normal == 0.0 and velocity - velocity == 0.0):
            return _no_answer(BAD_INPUT)
        self._recent = (*self._recent[1 - MEDIAN :], (tangential, normal, velocity))
        tangential, normal, velocity = (sorted(column)[len(column) // 2] for column in zip(*self._recent, strict=True))
        if self._tangential != self._tangential:
            self._tangential, self._normal, self._velocity = tangential, normal, velocity
            self._before = (velocity, velocity)
        # Second differences hold the noise and next to nothing of a movement.
        bend = (velocity - 2 * self._before[1] + self._before[0]) ** 2 / MEDIAN_BEND
        self._noise = math.sqrt(self._noise**2 + (bend - self._noise**2) / NOISE_SAMPLES)
        self._before = (self._before[1], velocity)
        self._tangential += self._gain * (tangential - self._tangential)
        self._normal += self._gain * (normal - self._normal)
        self._velocity += self._gain * (velocity - self._velocity)
        if normal < self._contact or self._normal < self._contact:
            self._sliding, self._look, self._pulls = 0, Look(), (_NO_PULL, _NO_PULL)
            return _no_answer(NO_CONTACT)
        self._follow(velocity)
        return self._answers[0 if self._heading > 0 else 1] if self._heading else _NOTHING_YET

    def _follow(self, velocity: float) -> None:
        """Rest, start or steady sliding: what this sample is, and what is learnt from it."""
        speed = abs(velocity)
        path = speed * self._step
        self._top = max(self._top * math.exp(-path / self._memory), abs(self._velocity))
        still = REST_NOISES * self._noise if self._rest is None else self._rest
        heading = 0 if speed < max(still, REST_SHARE * self._top) else 1 if velocity > 0 else -1
        if heading == 0:
            self._sliding, self._look = 0, Look()
            pulls = zip((self._tangential, -self._tangential), self._pulls, strict=True)
            self._pulls = tuple(max((pull, self._normal), before) for pull, before in pulls)
            return
        if heading != self._heading or self._sliding == 0:
            # The peak may come before the velocity shows; a turn without a sample at rest has none before it.
            self._heading, self._sliding, self._look = heading, 0, Look()
            self._peak, self._pulls = self._pulls[0 if heading > 0 else 1], (_NO_PULL, _NO_PULL)
        self._sliding = min(self._sliding + 1, self._settled + 1)
        if self._sliding <= self._onset:
            self._peak = max(self._peak, (heading * self._tangential, self._normal))
            if self._sliding == self._onset:
                up, down = self._kept.breakaway
                self._learnt(breakaway=(self._peak, down) if heading > 0 else (up, self._peak))
        if self._sliding > self._settled:
            samples, before, tangential, normal = self._look
            self._look = Look(samples + 1, before + path, tangential + self._tangential, normal + self._normal)
            if self._look.path >= LOOK_MM and self._look.samples >= self._shortest:
                self._take(self._look)
                self._look = Look()

    def _take(self, look: Look) -> None:
        """One look: learnt, left out because it contradicts the others, or the last sign of a change."""
        kept = self._kept
        x, P = np.array(kept.x), self._faded(np.array(kept.P), look.path)
        seen = (self._heading, look.tangential / look.samples, look.normal / look.samples)
        H, residual, R = _measurement(x, seen, kept.scatter)
        slid = tuple(was or self._heading == way for was, way in zip(kept.slid, (1, -1), strict=True))
        remark = kept.remark if kept.remark == CHANGED and kept.looks < 2 * SCATTER_LOOKS else OK
        if residual**2 <= GATE**2 * (H @ P @ H + R):
            x, P, scatter, looks = _corrected(x, P, seen, kept.scatter, kept.looks)
            contradicting = 0
        else:
            contradicting = kept.contradicting + 1
            scatter, looks, remark = kept.scatter, kept.looks, OUTLIER
        if contradicting == CHANGE_LOOKS:
            x[:2], P[:2, :], P[:, :2] = 0.0, 0.0, 0.0
            P[:2, :2] = self._prior[:2, :2]
            scatter, looks, remark = SCATTER**2, SCATTER_LOOKS, CHANGED
            x, P, scatter, looks = _corrected(x, P, seen, scatter, looks)  # the looks before it are still in between
            slid, contradicting = (self._heading > 0, self._heading < 0), 0
        values = {"scatter": scatter, "looks": min(looks, self._memory / LOOK_MM), "remark": remark}
        self._learnt(
            x=tuple(x.tolist()), P=tuple(map(tuple, P.tolist())), contradicting=contradicting, slid=slid, **values
        )

    def _faded(self, P: np.ndarray, path: float) -> np.ndarray:
        """The covariance (3, 3) after `path` mm more in this direction: what its looks told beyond the others fades."""
        way = 0 if self._heading > 0 else 1
        own = 1 / np.linalg.inv(P)[way, way]
        faded = P.copy()
        faded[way, way] = max(P[way, way], min(P[way, way] + own * math.expm1(path / self._memory), MU_SIGMA**2))
        return faded

    def _learnt(self, **changes) -> None:
        self._kept = replace(self._kept, **changes)
        self._answers = self._solve()

    def _solve(self) -> tuple[FrictionEstimate, FrictionEstimate]:
        """The answers for both directions from what is kept."""
        return self._answer(0), self._answer(1)

    def _answer(self, way: int) -> FrictionEstimate:
        kept = self._kept
        if not any(kept.slid):
            return _NOTHING_YET
        known, towards = kept.slid[way], 1 - 2 * way
        offset, offset_sigma = kept.x[2], math.sqrt(kept.P[2][2])
        mu, sigma = (kept.x[way], math.sqrt(kept.P[way][way])) if known else (_NONE, _NONE)
        pull, normal = kept.breakaway[way]
        static = static_sigma = _NONE
        if normal > 0:
            static = (pull - towards * offset) / normal
            static_sigma = math.hypot(offset_sigma / normal, math.sqrt(kept.scatter))
        return FrictionEstimate(mu, static, offset, sigma, static_sigma, offset_sigma, self._status(static, mu))

    def _status(self, static: float, mu: float) -> int:
        kept = self._kept
        if kept.remark:
            return kept.remark
        if static < mu * (1 - 2 * math.sqrt(kept.scatter)):
            return STATIC_BELOW_KINETIC
        if not all(kept.slid):
            return ONE_WAY
        apart = kept.P[0][0] + kept.P[1][1] - 2 * kept.P[0][1]
        return ALIKE if apart > (TOLD_APART * ANISOTROPY) ** 2 else OK


_FAST = (
    "recent",
    "tangential",
    "normal",
    "velocity",
    "top",
    "noise",
    "before",
    "heading",
    "sliding",
    "look",
    "peak",
    "pulls",
)
"""Fields of the state that change with every sample: attributes, because a frozen state a sample costs too much."""


def _measurement(x: np.ndarray, seen, scatter: float) -> tuple[np.ndarray, float, float]:
    """H (3,), the residual and its variance R of a look (heading, T, N)."""
    heading, tangential, normal = seen
    H = np.array([normal, 0.0, 1.0] if heading > 0 else [0.0, -normal, 1.0])
    return H, tangential - float(H @ x), scatter * normal**2


def _corrected(x, P, seen, scatter, looks) -> tuple[np.ndarray, np.ndarray, float, float]:
    """The Kalman correction by one look, and the looks' scatter with its residual in it."""
    H, residual, R = _measurement(x, seen, scatter)
    S = float(H @ P @ H) + R
    K = P @ H / S
    rest = np.eye(3) - np.outer(K, H)
    # A residual's square is S on average, of which R is the scatter's own share.
    scatter = (looks * scatter + residual**2 * R / S / seen[2] ** 2) / (looks + 1)
    return x + K * residual, rest @ P @ rest.T + R * np.outer(K, K), max(scatter, LEAST_SCATTER**2), looks + 1
