"""Static and kinetic friction in both directions, from tangential and normal force, without the sensor's offset.

The model of steady sliding is T = T0 + s mu N, with the direction s = 1 or -1 and the offset T0 of the sensor. Samples
are collected in blocks of 40 ms; the trimmed means of a block give mu = s (T - T0) / N.

A regression of T over N for both unknowns fails: mu itself changes with load, speed, wear and place, and the regression
attributes the change to T0. So T0 is learnt separately, only from what shows it: air, turns and rests (`offset`). mu is
a mean over 0.1 s of sliding (`direction`); it is kept as means of s T and N, without T0, and so follows a new T0 at
once. The sigma of mu holds the scatter from block to block, the error of the last block and the sigma of T0. As long as
nothing shows T0, mu is about T / N with the sigma that follows from the prior of T0, and the status says so (ADR 0010,
0028).

The static coefficient is the greatest median of five samples, (T - T0) / N, between rest and steady sliding.
"""

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from papilla import checks
from papilla.estimators.friction.answer import FrictionEstimate, FrictionStatus
from papilla.estimators.friction.direction import CHANGE_BLOCKS, MEDIAN, Direction, Peak
from papilla.estimators.friction.offset import Block, Offset, Source, Stroke
from papilla.estimators.stream import Stream
from papilla.logs.quantities import SAMPLE_RATE_HZ

BLOCK_S, TRIMMED = 0.04, 0.1
"""Length of a block; and the share of the largest and of the smallest samples that its means leave out, at least one of
each."""
MEMORY_S = 0.1
"""Time of sliding over which mu is averaged: after 0.3 s a change is followed up to 5 % of itself."""
SETTLE_S, SETTLE_MM, SIGN_MM_S = 0.1, 1.5, 5.0
"""Time and path from a start or a turn to steady sliding, while the skin shears and the breakaway passes; a velocity of
exactly 1 or -1 is only a sign, and counts as SIGN_MM_S."""
NO_PULL = 0.25
"""Share of the slow mean of mu below which a finger counts as resting, whatever its velocity."""
SURE, PRIOR_SURE = 0.08, 0.02
"""Relative sigma of mu up to which it is ok; and the part of it by the offset up to which the prior of the offset is
enough."""
REST_NOISES, NOISE_SAMPLES, LEAST_MM_S = 4.0, 200.0, 1e-6
"""The finger rests below REST_NOISES standard deviations of a block's velocity, whose noise is averaged over
NOISE_SAMPLES; and always below LEAST_MM_S."""
REST_SHARE, TOP_MM = 0.02, 50.0
"""The finger also rests below this share of the largest speed on the last TOP_MM, because an encoder's noise grows with
its speed."""
THIRD_DIFFERENCE, TAIL = 3.016, 10
"""Median size of third differences of white noise of standard deviation 1; and number of samples of earlier blocks that
are used as well, because a block may have one sample."""
STATIC_HZ, START_SCATTER = 400.0, 0.03
"""Sampling rate above which a breakaway of 15 ms is visible; and relative standard deviation of the largest pull of a
start, because the skin gives way place by place."""
NO_CONTACT, NOT_SLIDING, BAD_INPUT = (
    FrictionEstimate(status=int(status))
    for status in (FrictionStatus.NO_CONTACT, FrictionStatus.NOT_SLIDING, FrictionStatus.BAD_INPUT)
)


@dataclass
class FrictionState:
    """State of the estimator.

    samples : (T, N, v) of the block that is being filled; tail : the last ones before it. directions : towards positive
    and negative velocities. top : greatest recent speed, mm/s; noise : standard deviation of the velocity's noise,
    mm/s, from `known` samples. heading : 1, -1, or 0 at rest; last : the last one that was not 0. settling : blocks
    since the start; slid : mm since the start. standing : whether there was contact before the start. remark : CHANGED,
    OUTLIER, NO_PULL or OK. answer : for the samples of the next block.
    """

    offset: Offset
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
    remark: FrictionStatus = FrictionStatus.OK
    answer: FrictionEstimate = NOT_SLIDING


def _middle(values: tuple[float, ...]) -> list[float]:
    """Sorted values without the largest and the smallest share."""
    cut = math.ceil(TRIMMED * len(values)) if len(values) >= MEDIAN else 0
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
        return FrictionState(Offset(self._prior, self._prior))

    @property
    def coefficients(self) -> tuple[FrictionEstimate, FrictionEstimate]:
        """Estimates for each direction: velocity > 0, velocity < 0."""
        forward, backward = self._memory.directions
        return self._answer(forward), self._answer(backward)

    def _take(self, sample: tuple[float, ...]) -> FrictionEstimate:
        """A sample with a missing value changes nothing."""
        if not math.isfinite(sum(sample)):
            return BAD_INPUT
        memory = self._memory
        memory.samples.append(sample)
        if len(memory.samples) == self._size:
            # The last samples of earlier blocks come along, because noise and medians need more than a block may hold.
            window, memory.samples = (*memory.tail, *memory.samples), []
            memory.tail = window[-TAIL:]
            self._block(window)
            if memory.last:
                memory.answer = self._answer(self._direction(memory.last))
        return memory.answer if sample[1] >= self._contact else NO_CONTACT

    def _direction(self, heading: int) -> Direction:
        return self._memory.directions[0 if heading > 0 else 1]

    def _block(self, window: tuple[tuple[float, ...], ...]) -> None:
        """Decide whether a block is air, rest, start or steady sliding, and learn from it."""
        memory, offset = self._memory, self._memory.offset
        forces, normals, velocities = zip(*window, strict=True)
        normal, velocity = _middle(normals[-self._size :]), _mean(_middle(velocities[-self._size :]))
        block = Block(_mean(_middle(forces[-self._size :])), _mean(normal), velocity, _noise(forces))
        heading = self._heading(velocities, velocity)
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
            samples = np.array(window[-self._size - MEDIAN + 1 :])
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
        return memory.settling * self._block_s > SETTLE_S and memory.slid > SETTLE_MM

    def _idle(self, heading: int, block: Block) -> bool:
        """Whether hardly anything pulls although the velocity shows sliding: a start, or a rest that the velocity does
        not show."""
        memory, direction, offset = self._memory, self._direction(heading), self._memory.offset
        least, pull = NO_PULL * direction.slow_mu * block.normal, heading * (block.tangential - offset.all.value_N)
        # The test needs an offset whose error is smaller than the pull in question.
        known = offset.observed or offset.prior.variance_N2 < least**2
        idle = direction.blocks > 0 and known and pull <= least
        if idle and memory.heading == heading and self._settled():
            memory.remark = FrictionStatus.NO_PULL
        return idle

    def _forget_start(self) -> None:
        for direction in self._memory.directions:
            direction.peak = Peak()

    def _sliding(self, heading: int, block: Block) -> list[Direction]:
        """Take a block of a start or of steady sliding; returns the directions that begin to slide: one, or none."""
        memory, direction, offset = self._memory, self._direction(heading), self._memory.offset
        if heading != memory.heading:
            if memory.heading:
                self._forget_start()
            memory.heading, memory.last, memory.settling, memory.slid = heading, heading, 0, 0.0
        before, path = self._settled(), self._block_s * abs(block.velocity)
        memory.settling += 1
        # A velocity that is only a sign tells no path: a usual slow speed is assumed.
        memory.slid += path if abs(block.velocity) != 1.0 else SIGN_MM_S * self._block_s
        offset.moving = block.tangential, block.normal
        for each in memory.directions:
            each.age += self._block_s
        if not self._settled():
            return [direction]
        if not before:
            # The start is over. A finger that touched while moving has no breakaway.
            if memory.standing:
                direction.breakaway = direction.peak._replace(sigma=math.hypot(direction.peak.sigma, block.noise))
            memory.standing = True
            self._forget_start()
            offset.keep_turns(*(each.stroke for each in memory.directions))
            direction.stroke, direction.outliers = Stroke(), ()
        # Weight of one block in a mean that fades over 0.1 s, or over the stated path.
        gain = 1 - math.exp(-self._block_s / MEMORY_S if self._length is None else -path / self._length)
        learnt = direction.take(block, self._size, offset.all.value_N, gain)
        if learnt is None:
            memory.remark = FrictionStatus.OUTLIER
            return []
        if not learnt:
            memory.remark = FrictionStatus.CHANGED
        elif memory.remark != FrictionStatus.CHANGED or direction.blocks >= 2 * CHANGE_BLOCKS:
            memory.remark = FrictionStatus.OK
        offset.sliding(block, *(each.stroke for each in memory.directions))
        return []

    def _answer(self, direction: Direction) -> FrictionEstimate:
        """The answer for a direction."""
        if not direction.blocks:
            return NOT_SLIDING
        (offset, variance), peak, nothing = self._memory.offset.all, direction.breakaway, math.nan
        mu, offset_sigma = direction.mu(offset), math.sqrt(variance)
        # The offset's error divided by the normal force, and the scatter of mu itself: independent, so squares add.
        sigma = math.sqrt(variance / direction.normal**2 + direction.model_variance(mu))
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
        if self._memory.remark:
            return self._memory.remark
        if not self._memory.offset.observed and by_offset > PRIOR_SURE * mu:
            return FrictionStatus.ONE_WAY
        return FrictionStatus.OK if sigma <= SURE * mu else FrictionStatus.UNSURE
