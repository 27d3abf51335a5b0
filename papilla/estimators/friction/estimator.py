"""Static and kinetic friction in both directions, from tangential and normal force, without the sensor's offset.

The model of steady sliding is T = T0 + s mu N, with the direction s = 1 or -1 and the offset T0 of the sensor. Samples
are collected in blocks of 40 ms; the trimmed means of a block give mu = s (T - T0) / N.

A regression of T over N for both unknowns fails: mu itself changes with load, speed, wear and place, and the regression
attributes the change to T0. So T0 is learnt separately, only from what shows it: air, turns and rests (`offset`). mu is
a mean over 0.1 s of sliding (`Direction`); it is kept as means of s T and N, without T0, and so follows a new T0 at
once. The sigma of mu holds the scatter from block to block, the error of the last block and the sigma of T0. As long as
nothing shows T0, mu is about T / N with the sigma that follows from the prior of T0, and the status says so (ADR 0010,
0028).

The static coefficient is the greatest median of five samples, (T - T0) / N, between rest and steady sliding.
"""

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np

from papilla.core import checks
from papilla.core.status import Status
from papilla.core.units import SAMPLE_RATE_HZ
from papilla.estimators.friction.direction import (
    BREAKAWAY_MEDIAN_SAMPLES,
    CHANGE_BLOCKS,
    LEAST_SCATTER,
    Direction,
    Peak,
)
from papilla.estimators.friction.offset import FORCE_EXPONENT_RMS, BlockMeans, ForceOffset, Source, Stroke
from papilla.estimators.stream import Stream

MU_WANDER = 0.03
"""Relative standard deviation of the change of mu in 1 s of sliding; it grows with the root of the time."""
BLOCK_S, TRIMMED_SHARE = 0.04, 0.1
"""Length of a block; and the share of the largest and of the smallest samples that its means leave out, at least one of
each."""
MEMORY_S = 0.1
"""Time of sliding over which mu is averaged: after 0.3 s a change is followed up to 5 % of itself."""
SLIDING_SETTLE_S, SLIDING_SETTLE_MM, SIGN_MM_S = 0.1, 1.5, 5.0
"""Time and path from a start or a turn to steady sliding, while the skin shears and the breakaway passes; a velocity of
exactly 1 or -1 is only a sign, and counts as SIGN_MM_S."""
NO_PULL = 0.25
"""Share of the slow mean of mu below which a finger counts as resting, whatever its velocity."""
SURE_MU_SIGMA, PRIOR_SURE = 0.08, 0.02
"""Relative sigma of mu up to which it is ok; and the part of it by the offset up to which the prior of the offset is
enough."""
REST_NOISES, NOISE_SAMPLES, LEAST_MM_S = 4.0, 200.0, 1e-6
"""The finger rests below REST_NOISES standard deviations of a block's velocity, whose noise is averaged over
NOISE_SAMPLES; and always below LEAST_MM_S."""
REST_SHARE, TOP_MM = 0.02, 50.0
"""The finger also rests below this share of the largest speed on the last TOP_MM, because an encoder's noise grows with
its speed."""
THIRD_DIFFERENCE, TAIL_SAMPLES = 3.016, 10
"""Median size of third differences of white noise of standard deviation 1; and number of samples of earlier blocks that
are used as well, because a block may have one sample."""
STATIC_HZ, START_SCATTER = 400.0, 0.03
"""Sampling rate above which a breakaway of 15 ms is visible; and relative standard deviation of the largest pull of a
start, because the skin gives way place by place."""


_NONE = math.nan


class FrictionStatus(Status):
    """Status of an answer; the greater the number, the more is missing."""

    OK = "ok"
    STATIC_NOT_SEEN = "ok, but the last start showed no breakaway: no static coefficient"
    ONE_WAY = "one way: nothing shows the offset of the tangential force"
    UNSURE = "its sigma is more than 8 %"
    OUTLIER = "the forces contradict all sliding so far: left out"
    CHANGED = "the friction changed: learning again"
    NO_PULL = "hardly any tangential force although the velocity shows sliding: is the finger at rest?"
    NEGATIVE = "negative: the tangential force or the velocity has the wrong sign, or the force's zero is wrong"
    NO_CONTACT = "no contact"
    NOT_SLIDING = "has not slid yet"
    BAD_INPUT = "a force or the velocity is missing or not finite"


class FrictionEstimate(NamedTuple):
    """mu_kinetic and mu_static of the direction of the last sliding, offset_N, their standard deviations, and status.

    The status is a `FrictionStatus`. NaN where there is no answer. Of a block, arrays (n,).
    """

    mu_kinetic: float | np.ndarray = _NONE
    mu_static: float | np.ndarray = _NONE
    offset_N: float | np.ndarray = _NONE
    mu_kinetic_sigma: float | np.ndarray = _NONE
    mu_static_sigma: float | np.ndarray = _NONE
    offset_sigma_N: float | np.ndarray = _NONE
    status: int | np.ndarray = int(FrictionStatus.NOT_SLIDING)

    @property
    def sentence(self) -> Any:
        """The status in words: a string, or a list of them."""
        return FrictionStatus.in_words(self.status)


NOT_SLIDING = FrictionEstimate()
NO_CONTACT = NOT_SLIDING._replace(status=int(FrictionStatus.NO_CONTACT))
BAD_INPUT_FRICTION = NOT_SLIDING._replace(status=int(FrictionStatus.BAD_INPUT))


@dataclass
class FrictionState:
    """State of the estimator.

    samples : (T, N, v) of the block that is being filled; tail : the last ones before it. directions : towards positive
    and negative velocities. top : greatest recent speed, mm/s; noise : standard deviation of the velocity's noise,
    mm/s, from `known` samples. heading : 1, -1, or 0 at rest; last : the last one that was not 0. settling : blocks
    since the start; slid : mm since the start. standing : whether there was contact before the start. note : CHANGED,
    OUTLIER, NO_PULL or OK. answer : for the samples of the next block.
    """

    offset: ForceOffset
    samples: list[tuple[float, ...]] = field(default_factory=list)
    tail: tuple[tuple[float, ...], ...] = ()
    directions: tuple[Direction, Direction] = field(default_factory=lambda: (Direction(1), Direction(-1)))
    top: float = 0.0
    noise: float = 0.0
    known: float = 0.0
    heading: int = 0
    last: int = 0
    settling: int = 0
    slid: float = 0.0
    standing: bool = False
    note: FrictionStatus = FrictionStatus.OK
    answer: FrictionEstimate = NOT_SLIDING


def _middle(values: tuple[float, ...]) -> list[float]:
    """Sorted values without the largest and the smallest share."""
    cut = math.ceil(TRIMMED_SHARE * len(values)) if len(values) >= BREAKAWAY_MEDIAN_SAMPLES else 0
    return sorted(values)[cut : len(values) - cut]


def _mean(values: list[float]) -> float:
    return math.fsum(values) / len(values)


def _noise(values: tuple[float, ...]) -> float:
    """Standard deviation of white noise in values (n,): third differences contain it and almost nothing of a movement,
    and their median ignores single faults."""
    fours = zip(values, values[1:], values[2:], values[3:], strict=False)
    sizes = sorted(abs(a - d + 3 * (c - b)) for a, b, c, d in fours)
    return sizes[len(sizes) // 2] / THIRD_DIFFERENCE if sizes else 0.0


class Friction(Stream):
    """Online estimate of friction coefficients; one sample is (tangential_N, force_N, velocity_mm_s).

    tangential_N is positive if friction opposes a positive velocity_mm_s; the sign of the velocity is enough.

    Kinetic: mean over the last 0.1 s of steady sliding; the answer changes every 40 ms. A block that contradicts the
    mean is left out; the third one in a row is a change of friction, and the direction is learnt again. Static: largest
    (T - offset) / N from rest to steady sliding, over medians of five samples, for the last start in each direction.
    There is none below 400 Hz, because a breakaway may fall between the samples, and none if a start never pulls as
    much as the sliding after it.

    Parameters
    ----------
    sample_rate_Hz : of the stream.
    rest_mm_s : a lower speed is rest; None derives it from the noise of the velocity. A speed below 2 % of the largest
        recent one is rest, too.
    contact_N : a smaller normal force is no contact; it ends a start.
    memory_mm : path of sliding over which mu is averaged; None: 0.1 s of sliding.
    offset_sigma_N : standard deviation of the tangential sensor's reading without a load.

    Raises `InputError` for unusable values.
    """

    columns = ("tangential_N", "force_N", "velocity_mm_s")
    answer: ClassVar[type] = FrictionEstimate

    def __init__(
        self,
        *,
        sample_rate_Hz: float = SAMPLE_RATE_HZ,
        rest_mm_s: float | None = None,
        contact_N: float = 0.02,
        memory_mm: float | None = None,
        offset_sigma_N: float = 0.2,
    ):
        rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
        self._size = max(round(BLOCK_S * rate), 1)
        self._block_s, self._fast = self._size / rate, rate >= STATIC_HZ
        self._rest = None if rest_mm_s is None else checks.positive("rest_mm_s", rest_mm_s)
        self._contact = checks.positive("contact_N", contact_N)
        self._length = None if memory_mm is None else checks.positive("memory_mm", memory_mm)
        self._prior = Source(0.0, checks.positive("offset_sigma_N", offset_sigma_N) ** 2)
        self.reset()

    def _fresh(self) -> FrictionState:
        return FrictionState(ForceOffset(self._prior, self._prior))

    @property
    def coefficients(self) -> tuple[FrictionEstimate, FrictionEstimate]:
        """Estimates for each direction: velocity > 0, velocity < 0."""
        forward, backward = self._memory.directions
        return self._answer(forward), self._answer(backward)

    def _take(self, sample: tuple[float, ...]) -> FrictionEstimate:
        """A sample with a missing value changes nothing."""
        if not math.isfinite(sum(sample)):
            return BAD_INPUT_FRICTION
        memory = self._memory
        memory.samples.append(sample)
        if len(memory.samples) == self._size:
            # The last samples of earlier blocks come along, because noise and medians need more than a block may hold.
            window, memory.samples = (*memory.tail, *memory.samples), []
            memory.tail = window[-TAIL_SAMPLES:]
            self._block(window)
            if memory.last:
                memory.answer = self._answer(memory.directions[memory.last < 0])
        return memory.answer if sample[1] >= self._contact else NO_CONTACT

    def _block(self, window: tuple[tuple[float, ...], ...]) -> None:
        """Decide whether a block is air, rest, start or steady sliding, and learn from it."""
        memory, offset = self._memory, self._memory.offset
        forces, normals, velocities = zip(*window, strict=True)
        force, normal, velocity = (_middle(column[-self._size :]) for column in (forces, normals, velocities))
        block = BlockMeans(_mean(force), _mean(normal), _mean(velocity), _noise(forces))
        heading = self._heading(velocities, block.velocity)
        # Any sample without contact ends the stroke. Only a block entirely without contact shows the offset.
        if normal[0] < self._contact:
            memory.heading, memory.standing = 0, False
            offset.rests, offset.moving = (), None
            self._forget_start()
            if normal[-1] < self._contact:
                offset.in_air(block, self._size)
            return
        offset.air_run = 0
        if heading and not self._idle(heading, block):
            directions = self._sliding(heading, block)
        else:
            # The end of a stroke is not part of the next start.
            directions = [direction for direction in memory.directions if direction.s != memory.heading]
            memory.heading, memory.standing = 0, True
            offset.at_rest(block)
        if self._fast and directions:
            samples = np.array(window[-self._size - BREAKAWAY_MEDIAN_SAMPLES + 1 :])
            for direction in directions:
                direction.start(samples, block.noise, offset.all.value_N, self._contact)

    def _heading(self, velocities: tuple[float, ...], mean: float) -> int:
        """1, -1, or 0 at rest or if the block contains a turn."""
        memory, size = self._memory, self._size
        memory.known = min(memory.known + size, max(NOISE_SAMPLES, size))
        memory.noise += (_noise(velocities) - memory.noise) * size / memory.known
        # The largest speed fades over the path, not over time, so that a long rest does not forget it.
        memory.top = max(memory.top * math.exp(-abs(mean) * self._block_s / TOP_MM), abs(mean))
        slowest = REST_NOISES * memory.noise / math.sqrt(size) if self._rest is None else self._rest
        slowest = max(slowest, REST_SHARE * memory.top, LEAST_MM_S)
        # The two halves of a block with a turn have different signs; one slow half makes it a rest.
        half = (size + 1) // 2
        first, second = _mean(_middle(velocities[-size:][:half])), _mean(_middle(velocities[-half:]))
        return 0 if min(abs(first), abs(second)) < slowest or first * second < 0 else 1 if mean > 0 else -1

    def _settled(self) -> bool:
        memory = self._memory
        return memory.settling * self._block_s > SLIDING_SETTLE_S and memory.slid > SLIDING_SETTLE_MM

    def _idle(self, heading: int, block: BlockMeans) -> bool:
        """Whether hardly anything pulls although the velocity shows sliding: a start, or a rest that the velocity does
        not show."""
        memory, offset = self._memory, self._memory.offset
        direction = memory.directions[heading < 0]
        least, pull = NO_PULL * direction.slow_mu * block.normal, heading * (block.tangential - offset.all.value_N)
        # The test needs an offset whose error is smaller than the pull in question.
        sure = offset.observed or offset.prior.variance_N2 < least**2
        idle = direction.blocks > 0 and sure and pull <= least
        if idle and memory.heading == heading and self._settled():
            memory.note = FrictionStatus.NO_PULL
        return idle

    def _forget_start(self) -> None:
        for direction in self._memory.directions:
            direction.peak = Peak()

    def _sliding(self, heading: int, block: BlockMeans) -> list[Direction]:
        """Take a block of a start or of steady sliding; returns the directions that begin to slide: one, or none."""
        memory, offset = self._memory, self._memory.offset
        direction = memory.directions[heading < 0]
        if heading != memory.heading:
            if memory.heading:
                self._forget_start()
            memory.heading, memory.last, memory.settling, memory.slid = heading, heading, 0, 0.0
        before, path = self._settled(), self._block_s * abs(block.velocity)
        memory.settling += 1
        # A velocity that is only a sign tells no path: a usual slow speed is assumed.
        memory.slid += path if abs(block.velocity) != 1.0 else SIGN_MM_S * self._block_s
        offset.moving = block.tangential, block.normal
        for way in memory.directions:
            way.age += self._block_s
        if not self._settled():
            return [direction]
        if not before:
            # The start is over. A finger that touched while moving has no breakaway.
            if memory.standing:
                direction.breakaway = direction.peak._replace(sigma=math.hypot(direction.peak.sigma, block.noise))
            memory.standing = True
            self._forget_start()
            offset.keep_turns(*(way.stroke for way in memory.directions))
            direction.stroke, direction.outliers = Stroke(), ()
        # Weight of one block in a mean that fades over 0.1 s, or over the stated path.
        gain = 1 - math.exp(-self._block_s / MEMORY_S if self._length is None else -path / self._length)
        learnt = direction.take(block, self._size, offset.all.value_N, gain)
        if learnt is None:
            memory.note = FrictionStatus.OUTLIER
            return []
        if not learnt:
            memory.note = FrictionStatus.CHANGED
        elif memory.note != FrictionStatus.CHANGED or direction.blocks >= 2 * CHANGE_BLOCKS:
            memory.note = FrictionStatus.OK
        offset.sliding(block, *(way.stroke for way in memory.directions))
        return []

    def _answer(self, direction: Direction) -> FrictionEstimate:
        """The answer for a direction."""
        if not direction.blocks:
            return NOT_SLIDING
        (offset, variance), peak, nothing = self._memory.offset.all, direction.breakaway, math.nan
        mu, offset_sigma = direction.mu(offset), math.sqrt(variance)
        # The offset's error divided by the normal force; and that of mu itself: scatter, lag behind a change, force and
        # time since the last block. Both are independent, so squares add.
        relative = LEAST_SCATTER**2 + FORCE_EXPONENT_RMS**2 * direction.log_variance + MU_WANDER**2 * direction.age
        sigma = math.sqrt(variance / direction.normal**2 + (direction.variance + direction.error**2 + relative * mu**2))
        static = (peak.pull - direction.s * offset) / peak.normal
        static_sigma = math.hypot(offset_sigma, peak.sigma, START_SCATTER * peak.pull) / peak.normal
        status = self._status(mu, sigma, offset_sigma / direction.normal)
        # A static coefficient below the kinetic one means that the start was missed (a slow start, or one between
        # samples).
        if static + 2 * peak.sigma / peak.normal < mu:
            static = static_sigma = nothing
            status = max(status, FrictionStatus.STATIC_NOT_SEEN)
        if status == FrictionStatus.NEGATIVE:
            mu = sigma = static = static_sigma = nothing
        return FrictionEstimate(mu, static, offset, sigma, static_sigma, offset_sigma, int(status))

    def _status(self, mu: float, sigma: float, by_offset: float) -> FrictionStatus:
        if mu < 0:
            return FrictionStatus.NEGATIVE
        if self._memory.note:
            return self._memory.note
        if not self._memory.offset.observed and by_offset > PRIOR_SURE * mu:
            return FrictionStatus.ONE_WAY
        return FrictionStatus.OK if sigma <= SURE_MU_SIGMA * mu else FrictionStatus.UNSURE
