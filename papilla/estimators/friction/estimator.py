"""Static and kinetic friction in both directions from tangential and normal force, the sensor's offset removed.

The model is T = offset + s mu N, s = 1 or -1 for the direction of sliding: a look at T and N (40 ms of steady sliding)
tells mu = s (T - offset) / N. mu changes with load, speed, wear and place, so it is followed by a short mean (`way`),
and its sigma holds the scatter from look to look and what the last look was off by. The offset is learnt apart from it,
from what tells it (`offset`); the means do not contain it, so mu follows it at once. Where nothing tells the offset, mu
is about T / N with the prior's sigma, and the status says so.
"""

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from papilla import checks
from papilla.estimators.friction.answer import FrictionEstimate, FrictionStatus
from papilla.estimators.friction.offset import Look, Offset, Reading, Stroke
from papilla.estimators.friction.way import CHANGE_LOOKS, MEDIAN, Peak, Way
from papilla.estimators.stream import Stream

LOOK_S, TRIMMED = 0.04, 0.1
"""Length of a look; its means are without this share of the greatest and of the least samples, so without faults."""
MEMORY_S = 0.1
"""Sliding over which mu is averaged: a change is followed to 5 % of itself in 0.3 s."""
SETTLE_S, SETTLE_MM, SIGN_MM_S = 0.1, 1.5, 5.0
"""Time and path from a start or a turn to steady sliding, while the skin shears and the breakaway passes; and the speed
that a velocity of exactly 1 or -1 is taken for, which is a sign alone."""
NO_PULL = 0.25
"""Share of the usual mu below which a finger rests whatever its velocity says."""
SURE, TOLD = 0.08, 0.02
"""Relative sigma up to which the kinetic coefficient is ok; and up to which an offset is told by its prior alone."""
REST_NOISES, NOISE_SAMPLES, LEAST_MM_S = 4.0, 200.0, 1e-6
"""Standard deviations of a look's velocity below which the finger rests; samples that its noise is known from; and a
speed that nothing slides below."""
REST_SHARE, TOP_MM = 0.02, 50.0
"""Share of the greatest speed over this path below which the finger rests: an encoder's noise grows with what it
measures."""
THIRD_DIFFERENCE, TAIL = 3.016, 10
"""Median size of third differences of noise with the standard deviation 1; and samples of earlier looks that they are
taken with, because a look may have one sample."""
STATIC_HZ, START_SCATTER = 400.0, 0.03
"""Sampling rate from which a breakaway of 15 ms is seen; and relative standard deviation of a start's greatest pull,
because the skin gives way place by place."""
NO_CONTACT, NOT_SLIDING, BAD_INPUT = (
    FrictionEstimate(status=int(status))
    for status in (FrictionStatus.NO_CONTACT, FrictionStatus.NOT_SLIDING, FrictionStatus.BAD_INPUT)
)


@dataclass
class FrictionState:
    """All that the estimator remembers.

    samples : (T, N, v) of the look that is being taken; tail : the last ones before it. ways : towards positive and
    negative velocities. top : greatest recent speed, mm/s; noise : standard deviation of the velocity's noise, mm/s,
    from `known` samples. heading : 1, -1, or 0 at rest; last : the last that was not 0. settling : looks since the
    start, and slid : mm since. standing : whether it was in contact before the start. remark : CHANGED, OUTLIER,
    NO_PULL or OK. answer : to the next samples.
    """

    offset: Offset
    samples: list[tuple[float, ...]] = field(default_factory=list)
    tail: tuple[tuple[float, ...], ...] = ()
    ways: tuple[Way, Way] = field(default_factory=lambda: (Way(1), Way(-1)))
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
    """Sorted values without the greatest and the least."""
    cut = math.ceil(TRIMMED * len(values)) if len(values) >= MEDIAN else 0
    return sorted(values)[cut : len(values) - cut]


def _mean(values: list[float]) -> float:
    return math.fsum(values) / len(values)


def _noise(values: tuple[float, ...]) -> float:
    """Standard deviation of white noise in values (n,): third differences hold it and next to nothing of a movement,
    and their median no fault."""
    fours = zip(values, values[1:], values[2:], values[3:], strict=False)
    sizes = sorted(abs(a - d + 3 * (c - b)) for a, b, c, d in fours)
    return sizes[len(sizes) // 2] / THIRD_DIFFERENCE if sizes else 0.0


class Friction(Stream):
    """Streaming coefficients of friction; one sample is (tangential_N, force_N, velocity_mm_s).

    tangential_N is positive where friction opposes a positive velocity_mm_s, of which the sign is enough.

    Kinetic: of the last 0.1 s of steady sliding; the answer changes every 40 ms. A look that contradicts the mean is
    left out, and the third in a row is a change of friction, from which the direction is learnt anew.
    Static: (T - offset) / N where it is greatest from coming to rest until steady sliding, of medians of five samples;
    of the last start of each direction. There is none below 400 Hz, where a breakaway may fall between the samples, and
    none of a start that nowhere pulls as much as the sliding after it.

    Parameters
    ----------
    sample_rate_Hz : of the stream.
    rest_mm_s : speed below it is rest; None takes it from the noise of the velocity. A speed below 2 % of the greatest
        recent one is rest too.
    contact_N : normal force below it is no contact; it ends a start.
    memory_mm : slid path that mu is averaged over; None: 0.1 s of sliding.
    offset_sigma_N : standard deviation of what the tangential sensor reads without a load.

    Raises `InputError` for unusable values.
    """

    columns = ("tangential_N", "force_N", "velocity_mm_s")
    answer: ClassVar[type] = FrictionEstimate

    def __init__(
        self,
        *,
        sample_rate_Hz: float = 1000.0,
        rest_mm_s: float | None = None,
        contact_N: float = 0.02,
        memory_mm: float | None = None,
        offset_sigma_N: float = 0.2,
    ):
        rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
        self._size = max(round(LOOK_S * rate), 1)
        self._look_s, self._fast = self._size / rate, rate >= STATIC_HZ
        self._rest = None if rest_mm_s is None else checks.positive("rest_mm_s", rest_mm_s)
        self._contact = checks.positive("contact_N", contact_N)
        self._length = None if memory_mm is None else checks.positive("memory_mm", memory_mm)
        self._prior = Reading(0.0, checks.positive("offset_sigma_N", offset_sigma_N) ** 2)
        self.reset()

    def _fresh(self) -> FrictionState:
        return FrictionState(Offset(self._prior, self._prior))

    @property
    def coefficients(self) -> tuple[FrictionEstimate, FrictionEstimate]:
        """What is known of each direction: velocity > 0, velocity < 0."""
        forward, backward = self._memory.ways
        return self._answer(forward), self._answer(backward)

    def _take(self, sample: tuple[float, ...]) -> FrictionEstimate:
        """A sample with a missing value changes nothing."""
        if not math.isfinite(sum(sample)):
            return BAD_INPUT
        memory = self._memory
        memory.samples.append(sample)
        if len(memory.samples) == self._size:
            window, memory.samples = (*memory.tail, *memory.samples), []
            memory.tail = window[-TAIL:]
            self._look(window)
            if memory.last:
                memory.answer = self._answer(self._way(memory.last))
        return memory.answer if sample[1] >= self._contact else NO_CONTACT

    def _way(self, heading: int) -> Way:
        return self._memory.ways[0 if heading > 0 else 1]

    def _look(self, window: tuple[tuple[float, ...], ...]) -> None:
        """Air, rest, start or steady sliding: what a look is, and what is learnt from it."""
        memory, offset = self._memory, self._memory.offset
        forces, normals, velocities = zip(*window, strict=True)
        normal, velocity = _middle(normals[-self._size :]), _mean(_middle(velocities[-self._size :]))
        look = Look(_mean(_middle(forces[-self._size :])), _mean(normal), velocity, _noise(forces))
        heading = self._heading(velocities, velocity)
        if normal[0] < self._contact:
            memory.heading, memory.standing = 0, False
            offset.still, offset.moving = (), None
            self._forget_start()
            if normal[-1] < self._contact:
                offset.fly(look, self._size)
            return
        offset.flying = 0
        if heading and not self._idle(heading, look):
            ways = self._slide(heading, look)
        else:
            # The end of a stroke is none of the next start.
            ways = [way for way in memory.ways if way.s != memory.heading]
            memory.heading, memory.standing = 0, True
            offset.stand(look)
        if self._fast and ways:
            samples = np.array(window[-self._size - MEDIAN + 1 :])
            for way in ways:
                way.start(samples, look.noise, offset.all.value_N, self._contact)

    def _heading(self, velocities: tuple[float, ...], mean: float) -> int:
        """1, -1, or 0 at rest or where the look holds a turn."""
        memory, size = self._memory, self._size
        memory.known = min(memory.known + size, max(NOISE_SAMPLES, size))
        memory.noise += (_noise(velocities) - memory.noise) * size / memory.known
        memory.top = max(memory.top * math.exp(-abs(mean) * self._look_s / TOP_MM), abs(mean))
        still = REST_NOISES * memory.noise / math.sqrt(size) if self._rest is None else self._rest
        still = max(still, REST_SHARE * memory.top, LEAST_MM_S)
        first, second = (
            _mean(_middle(half)) for half in (velocities[-size:][: (size + 1) // 2], velocities[-(size + 1) // 2 :])
        )
        return 0 if min(abs(first), abs(second)) < still or first * second < 0 else 1 if mean > 0 else -1

    def _settled(self) -> bool:
        memory = self._memory
        return memory.settling * self._look_s > SETTLE_S and memory.slid > SETTLE_MM

    def _idle(self, heading: int, look: Look) -> bool:
        """Whether hardly anything pulls though the velocity says sliding: a start, or a rest that is not told."""
        memory, way, offset = self._memory, self._way(heading), self._memory.offset
        least = NO_PULL * way.usual
        told = offset.told or offset.prior.variance_N2 < (least * look.normal) ** 2
        idle = way.looks > 0 and told and heading * (look.tangential - offset.all.value_N) <= least * look.normal
        if idle and memory.heading == heading and self._settled():
            memory.remark = FrictionStatus.NO_PULL
        return idle

    def _forget_start(self) -> None:
        for way in self._memory.ways:
            way.peak = Peak()

    def _slide(self, heading: int, look: Look) -> list[Way]:
        """A look at the start, or one of steady sliding; the direction that starts, if one does."""
        memory, way, offset = self._memory, self._way(heading), self._memory.offset
        if heading != memory.heading:
            if memory.heading:
                self._forget_start()
            memory.heading, memory.last, memory.settling, memory.slid = heading, heading, 0, 0.0
        before, path = self._settled(), self._look_s * abs(look.velocity)
        memory.settling += 1
        memory.slid += path if abs(look.velocity) != 1.0 else SIGN_MM_S * self._look_s
        offset.moving = look.tangential, look.normal
        for each in memory.ways:
            each.age += self._look_s
        if not self._settled():
            return [way]
        if not before:
            # The start is over. A finger that came down in motion has no breakaway.
            if memory.standing:
                way.breakaway = way.peak._replace(sigma=math.hypot(way.peak.sigma, look.noise))
            memory.standing = True
            self._forget_start()
            offset.turn(*(each.stroke for each in memory.ways))
            way.stroke, way.odd = Stroke(), ()
        gain = 1 - math.exp(-self._look_s / MEMORY_S if self._length is None else -path / self._length)
        learnt = way.take(look, self._size, offset.all.value_N, gain)
        if learnt is None:
            memory.remark = FrictionStatus.OUTLIER
            return []
        if not learnt:
            memory.remark = FrictionStatus.CHANGED
        elif memory.remark != FrictionStatus.CHANGED or way.looks >= 2 * CHANGE_LOOKS:
            memory.remark = FrictionStatus.OK
        offset.slide(look, *(each.stroke for each in memory.ways))
        return []

    def _answer(self, way: Way) -> FrictionEstimate:
        """What is known of a direction."""
        if not way.looks:
            return NOT_SLIDING
        (offset, variance), peak, nothing = self._memory.offset.all, way.breakaway, math.nan
        mu, offset_sigma = way.mu(offset), math.sqrt(variance)
        sigma = math.sqrt(variance / way.normal**2 + way.model_variance(mu))
        static = (peak.pull - way.s * offset) / peak.normal
        static_sigma = math.hypot(offset_sigma, peak.sigma, START_SCATTER * peak.pull) / peak.normal
        status = self._status(mu, sigma, offset_sigma / way.normal)
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
        if not self._memory.offset.told and by_offset > TOLD * mu:
            return FrictionStatus.ONE_WAY
        return FrictionStatus.OK if sigma <= SURE * mu else FrictionStatus.UNSURE
