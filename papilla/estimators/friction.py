"""Static and kinetic friction in both directions from tangential and normal force, the sensor's offset removed.

The tangential force is read as T = offset + mu_+ N while sliding one way and T = offset - mu_- N the other way, both
behind the same low-pass. Sliding both ways tells the offset from friction: with one direction only, it is not removed.
"""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.status_words import status_in_words

_NONE = math.nan


class FrictionStatus(IntEnum):
    """What became of an answer; `sentence` says it in words."""

    OK = 0
    ALIKE = 1
    ONE_WAY = 2
    NO_CONTACT = 3
    NOT_SLIDING = 4
    BAD_INPUT = 5

    @property
    def sentence(self) -> str:
        """The status in words."""
        return _SENTENCES[self]


_SENTENCES = {
    FrictionStatus.OK: "ok",
    FrictionStatus.ALIKE: "the normal force varied too little to tell the directions apart: taken as alike",
    FrictionStatus.ONE_WAY: "slid one way only: the offset of the sensor is not removed",
    FrictionStatus.NO_CONTACT: "no contact",
    FrictionStatus.NOT_SLIDING: "has not slid yet",
    FrictionStatus.BAD_INPUT: "a force or the velocity is missing or not finite",
}
OK, ALIKE, ONE_WAY, NO_CONTACT, NOT_SLIDING, BAD_INPUT = map(int, FrictionStatus)

_NO_PULL = (-math.inf, 0.0)
DISTINCT_SPREAD = 0.1
"""Variation of the normal force (sd over mean) from which the directions are told apart instead of taken as alike."""
SETTLE = 3.0
"""Time constants of the low-pass after a start or a turn before a sample counts as steady sliding."""


class FrictionEstimate(NamedTuple):
    """mu_kinetic, mu_static of the direction of the last sliding, offset_N, and status (a `FrictionStatus`).

    NaN where there is no answer. Of a block, arrays (n,).
    """

    mu_kinetic: float | np.ndarray
    mu_static: float | np.ndarray
    offset_N: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self):
        """The status in words: a string, or a list of them."""
        return status_in_words(FrictionStatus, self.status)


class Direction(NamedTuple):
    """Weighted sums over steady sliding one way: weight, normal, tangential force, their squares and product.

    breakaway : greatest (tangential towards the movement) and the normal force then, of the last start; NaN before one.
    """

    weight: float = 0.0
    normal: float = 0.0
    tangential: float = 0.0
    normal2: float = 0.0
    product: float = 0.0
    breakaway: tuple[float, float] = (_NONE, _NONE)


@dataclass(frozen=True)
class FrictionState:
    """tangential, normal : low-passed forces (NaN before the first sample); forward, backward : see `Direction`.

    heading : 1, -1 or 0 (has not moved); sliding : samples since the start, up to the longest that matters; peak :
    greatest tangential force towards the movement, and the normal force then, of this start; pulls : the same of the
    rest before it, towards positive and negative velocities.
    """

    tangential: float = _NONE
    normal: float = _NONE
    forward: Direction = Direction()
    backward: Direction = Direction()
    heading: int = 0
    sliding: int = 0
    peak: tuple[float, float] = (-math.inf, 0.0)
    pulls: tuple[tuple[float, float], tuple[float, float]] = ((-math.inf, 0.0), (-math.inf, 0.0))


class Friction:
    """Streaming coefficients of friction; one sample is (tangential_N, force_N, velocity_mm_s).

    tangential_N is positive where friction opposes a positive velocity_mm_s. Both forces pass a first-order low-pass;
    it also lowers the breakaway peak, so a static coefficient is only worth stating with `low_pass_Hz`: a peak that
    lasts 1 / (2 pi low_pass_Hz) is read at 63 % of its height over the kinetic level.

    Kinetic: least squares of T = offset + mu_+ N (velocity > 0), offset - mu_- N (velocity < 0) over steady sliding.
    With a normal force that varies by less than 10 % these three are one too many: mu_+ = mu_- is taken then, and
    the status says so; with one direction only the offset is taken as zero, and the status says so.
    Static: (T - offset) / N at the greatest T between coming to rest and `onset_s` after the start; of the last start
    of each direction. A start without a rest (a turn between two samples) has only the time after it.

    Parameters
    ----------
    sample_rate_Hz, low_pass_Hz : low_pass_Hz < sample_rate_Hz / 2.
    rest_mm_s : |velocity| below it is rest. contact_N : normal force below it is no contact; it ends a start.
    onset_s : how long after the start the breakaway may come. memory_s : time constant of forgetting (sliding time).

    Raises `InputError` for unusable values.
    """

    def __init__(
        self,
        *,
        sample_rate_Hz: float = 1000.0,
        low_pass_Hz: float = 20.0,
        rest_mm_s: float = 1.0,
        contact_N: float = 0.02,
        onset_s: float = 0.1,
        memory_s: float = 10.0,
    ):
        rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
        self.low_pass_Hz = checks.positive("low_pass_Hz", low_pass_Hz)
        if not self.low_pass_Hz < 0.5 * rate:
            raise InputError(f"low_pass_Hz must be below half of sample_rate_Hz, got {low_pass_Hz:g} at {rate:g} Hz")
        self._gain = 1 - math.exp(-2 * math.pi * self.low_pass_Hz / rate)
        self._rest = checks.positive("rest_mm_s", rest_mm_s)
        self._contact = checks.positive("contact_N", contact_N)
        self._onset = max(round(checks.positive("onset_s", onset_s) * rate), 1)
        self._settled = max(self._onset, math.ceil(SETTLE * rate / (2 * math.pi * self.low_pass_Hz)))
        self._keep = math.exp(-1 / (checks.positive("memory_s", memory_s) * rate))
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.state = FrictionState()

    @property
    def state(self) -> FrictionState:
        """All that the estimator remembers, to be kept or to be set again."""
        (forward, backward), (up, down) = self._ways, self._pulls
        return FrictionState(self._t, self._n, forward, backward, self._heading, self._sliding, self._peak, (up, down))

    @state.setter
    def state(self, state: FrictionState) -> None:
        self._t, self._n = state.tangential, state.normal
        self._ways = [state.forward, state.backward]
        self._heading, self._sliding, self._peak = state.heading, state.sliding, state.peak
        self._pulls = list(state.pulls)
        self._solved = self._solve()

    @property
    def coefficients(self) -> tuple[FrictionEstimate, FrictionEstimate]:
        """What is known of each direction: velocity > 0, velocity < 0."""
        return self._estimate(0), self._estimate(1)

    def process(self, block) -> FrictionEstimate:
        """Estimates after each row of a block (n, 3); bit for bit what `update` gives row by row.

        Raises `InputError` for a block of another shape.
        """
        rows = np.asarray(block, float)
        if rows.ndim != 2 or rows.shape[1] != 3:
            shape = " x ".join(map(str, rows.shape))
            raise InputError(f"a block must be n x 3 (tangential_N, force_N, velocity_mm_s), got {shape}")
        answers = [self.update(row) for row in rows.tolist()]
        columns = zip(*answers, strict=True) if answers else ((), (), (), ())
        kinetic, static, offset, status = columns
        return FrictionEstimate(np.array(kinetic), np.array(static), np.array(offset), np.array(status, int))

    def update(self, sample) -> FrictionEstimate:
        """The estimate after one more sample (tangential_N, force_N, velocity_mm_s).

        A sample with a missing value changes nothing. Raises `InputError` for a sample of another length.
        """
        if len(sample) != 3:
            raise InputError(f"a sample must be (tangential_N, force_N, velocity_mm_s), got {len(sample)} values")
        tangential, normal, velocity = map(float, sample)
        if not (tangential - tangential == 0.0 and normal - normal == 0.0 and velocity - velocity == 0.0):
            return FrictionEstimate(_NONE, _NONE, _NONE, BAD_INPUT)
        if self._t != self._t:
            self._t, self._n = tangential, normal
        self._t += self._gain * (tangential - self._t)
        self._n += self._gain * (normal - self._n)
        if normal < self._contact or self._n < self._contact:
            self._sliding, self._pulls = 0, [_NO_PULL, _NO_PULL]
            return FrictionEstimate(_NONE, _NONE, _NONE, NO_CONTACT)
        self._follow(velocity)
        return self._estimate(0 if self._heading >= 0 else 1) if self._heading else _NOTHING_YET

    def _follow(self, velocity: float) -> None:
        """Rest, start or steady sliding: what this sample is, and what is learnt from it."""
        heading = 0 if abs(velocity) < self._rest else 1 if velocity > 0 else -1
        if heading == 0:
            self._sliding = 0
            for way, pull in enumerate((self._t, -self._t)):
                if pull > self._pulls[way][0]:
                    self._pulls[way] = (pull, self._n)
            return
        if heading != self._heading or self._sliding == 0:
            # The peak may come before the velocity shows; a turn without a sample at rest has none before it.
            self._heading, self._sliding, self._peak = heading, 0, self._pulls[0 if heading > 0 else 1]
            self._pulls = [_NO_PULL, _NO_PULL]
        self._sliding = min(self._sliding + 1, self._settled + 1)
        way = 0 if heading > 0 else 1
        pull = heading * self._t
        if self._sliding <= self._onset:
            if pull > self._peak[0] and self._n > 0:
                self._peak = (pull, self._n)
            if self._sliding == self._onset:
                self._ways[way] = self._ways[way]._replace(breakaway=self._peak)
        if self._sliding > self._settled:
            self._ways[way] = self._learnt(self._ways[way])
            self._solved = self._solve()

    def _learnt(self, way: Direction) -> Direction:
        """The sums with one more steady sample."""
        keep, t, n = self._keep, self._t, self._n
        return Direction(
            keep * way.weight + 1.0,
            keep * way.normal + n,
            keep * way.tangential + t,
            keep * way.normal2 + n * n,
            keep * way.product + n * t,
            way.breakaway,
        )

    def _solve(self) -> tuple[float, float, float, int]:
        """mu_+, mu_-, offset and status from the sums of both directions."""
        forward, backward = self._ways
        if not forward.weight and not backward.weight:
            return _NONE, _NONE, _NONE, NOT_SLIDING
        if not forward.weight or not backward.weight:
            way = forward if forward.weight else backward
            mu = way.product / way.normal2
            return (mu, _NONE, 0.0, ONE_WAY) if forward.weight else (_NONE, -mu, 0.0, ONE_WAY)
        if _spread(forward) > DISTINCT_SPREAD and _spread(backward) > DISTINCT_SPREAD:
            # The offset that leaves the least squares once each direction has its own best slope.
            one = forward.weight - forward.normal**2 / forward.normal2
            two = backward.weight - backward.normal**2 / backward.normal2
            level = forward.tangential - forward.normal * forward.product / forward.normal2
            level += backward.tangential - backward.normal * backward.product / backward.normal2
            offset = level / (one + two)
            status = OK
        else:
            up, down = forward.tangential / forward.weight, backward.tangential / backward.weight
            heavy, light = forward.normal / forward.weight, backward.normal / backward.weight
            offset = (up * light + down * heavy) / (heavy + light)
            status = ALIKE
        plus = (forward.product - offset * forward.normal) / forward.normal2
        minus = -(backward.product - offset * backward.normal) / backward.normal2
        return plus, minus, offset, status

    def _estimate(self, way: int) -> FrictionEstimate:
        plus, minus, offset, status = self._solved
        pull, normal = self._ways[way].breakaway
        towards = 1 - 2 * way
        known = 0.0 if offset != offset else offset
        static = (pull - towards * known) / normal if normal > 0 else _NONE
        return FrictionEstimate(minus if way else plus, static, offset, status)


_NOTHING_YET = FrictionEstimate(_NONE, _NONE, _NONE, NOT_SLIDING)


def _spread(way: Direction) -> float:
    """Standard deviation of the normal force over its mean."""
    mean = way.normal / way.weight
    return math.sqrt(max(way.normal2 / way.weight - mean * mean, 0.0)) / mean
