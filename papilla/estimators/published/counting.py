"""Frequency and wavelength from the number of impulses in a sliding window."""

import math
from dataclasses import dataclass

from papilla.estimators.published.stream import (
    ALIASED,
    GAP,
    NO_VELOCITY,
    OK,
    SILENT,
    STANDSTILL,
    WARMING_UP,
    Answers,
    checked_ring,
)

CEILING = 0.9
"""Of the most impulses that a window can hold, one every second sample: from there on a count may be an alias."""
_NONE = math.nan
_Answer = tuple[float, float, int]


@dataclass(frozen=True)
class CountState:
    """seen : samples so far, up to one window; place : where the next sample goes in the rings.

    pulses, known, speeds : rings of impulses, of whether each sample could have one, and of |velocity|; count, valid,
    moving : impulses, samples that could have one and samples with a velocity in the rings; total, fresh : sum of the
    speeds, and of those since the ring began again, which replaces the other then.
    """

    seen: int = 0
    place: int = 0
    count: int = 0
    valid: int = 0
    moving: int = 0
    total: float = 0.0
    fresh: float = 0.0
    pulses: tuple[int, ...] = ()
    known: tuple[int, ...] = ()
    speeds: tuple[float, ...] = ()


class ImpulseCount:
    """Counts impulses over the last `samples` and says f = count / (per_period x duration).

    Without `paired` the wavelength is |velocity now| / f, with it the distance travelled while counting over the
    number of periods. fastest_mm_s : speed from which on no answer is given.
    """

    def __init__(self, samples: int, rate_Hz: float, per_period: int, paired: bool, fastest_mm_s: float):
        self._samples, self._rate, self._per_period = samples, rate_Hz, per_period
        self._paired, self._fastest = paired, fastest_mm_s
        self._half, self._most = samples // 2, CEILING * 0.5 * samples
        empty = (0,) * samples
        self.state = CountState(pulses=empty, known=empty, speeds=(_NONE,) * samples)

    @property
    def state(self) -> CountState:
        """All that the counter remembers, to be kept or to be set again."""
        rings = tuple(self._pulses), tuple(self._known), tuple(self._speeds)
        numbers = self._seen, self._place, self._count, self._valid, self._moving, self._total, self._fresh
        return CountState(*numbers, *rings)

    @state.setter
    def state(self, state: CountState) -> None:
        self._pulses = checked_ring("pulses", state.pulses, self._samples)
        self._known = checked_ring("known", state.known, self._samples)
        self._speeds = checked_ring("speeds", state.speeds, self._samples)
        self._seen, self._place, self._count = state.seen, state.place, state.count
        self._valid, self._moving = state.valid, state.moving
        self._total, self._fresh = state.total, state.fresh

    def advance(self, impulses, known, faults, velocities) -> Answers:
        """The answer after each sample: its impulse (0: none), whether it could have one, its fault, its velocity."""
        samples, pulses, knowns, speeds = self._samples, self._pulses, self._known, self._speeds
        seen, place, count, valid, moving = self._seen, self._place, self._count, self._valid, self._moving
        total, fresh = self._total, self._fresh
        answers: list[_Answer] = []
        for impulse, could, fault, velocity in zip(impulses, known, faults, velocities, strict=True):
            count -= pulses[place]
            valid -= knowns[place]
            old = speeds[place]
            if old == old:
                total -= old
                moving -= 1
            speed = abs(velocity)
            if speed < math.inf:
                total += speed
                fresh += speed
                moving += 1
            else:
                speed = _NONE
            pulses[place] = pulse = 1 if impulse else 0
            knowns[place] = 1 if could else 0
            speeds[place] = speed
            count += pulse
            valid += knowns[place]
            place += 1
            if place == samples:
                place, total, fresh = 0, fresh, 0.0
            if seen < samples:
                seen += 1
                answers.append((_NONE, _NONE, fault or WARMING_UP))
            elif fault:
                answers.append((_NONE, _NONE, fault))
            else:
                average = total / moving if self._paired and moving else speed
                answers.append(self._answer(count, valid, speed, average))
        self._seen, self._place, self._count, self._valid, self._moving = seen, place, count, valid, moving
        self._total, self._fresh = total, fresh
        frequency, wavelength, status = zip(*answers, strict=True) if answers else ((), (), ())
        return Answers(list(frequency), list(wavelength), [_NONE] * len(answers), list(status))

    def _answer(self, count: int, valid: int, speed: float, average: float) -> _Answer:
        """Frequency, wavelength and status of one full window, from the speed now or its average."""
        if valid < self._half:
            return _NONE, _NONE, GAP
        if count == 0:
            return _NONE, _NONE, SILENT
        if speed > self._fastest or count > self._most:
            return _NONE, _NONE, ALIASED
        periods = count / self._per_period
        seconds = valid / self._rate
        if average != average:
            return periods / seconds, _NONE, NO_VELOCITY
        if average <= 0.0:
            return periods / seconds, _NONE, STANDSTILL
        return periods / seconds, average * seconds / periods, OK if valid == self._samples else GAP
