"""Impulses in a reading: a signal made of it exceeds a multiple of its own mean size (2006 and 2007 papers)."""

import math
from abc import abstractmethod
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

from papilla.estimators.published.roughness.answer import NONE, Finding
from papilla.estimators.published.roughness.stream import RoughnessStream


@dataclass(eq=False)
class MovingSum:
    """`total` of the last `length` values and how many of them are `known`; a NaN is in neither.

    A running sum accumulates rounding errors. Here, whenever the ring is full, the sum of the values since its
    beginning replaces it, so no error lasts longer than two windows.
    """

    length: int
    total: float = 0.0
    known: int = 0
    _fresh: float = 0.0
    _place: int = 0
    _values: list[float] = field(init=False)

    def __post_init__(self) -> None:
        self._values = [NONE] * self.length

    def push(self, value: float) -> None:
        """Take one more value."""
        old = self._values[self._place]
        if old == old:
            self.total -= old
            self.known -= 1
        if value == value:
            self.total += value
            self._fresh += value
            self.known += 1
        self._values[self._place] = value
        self._place += 1
        if self._place == self.length:
            self.total, self._fresh, self._place = self._fresh, 0.0, 0


class Threshold(NamedTuple):
    """Multiples of the mean size of a signal: an impulse occurs when it exceeds `factor`, the next only after it was
    below `release`."""

    factor: float
    release: float


@dataclass(eq=False)
class Trigger:
    """Fires when a signal exceeds a threshold relative to its mean size over the last `samples`."""

    samples: int
    threshold: Threshold
    _sizes: MovingSum = field(init=False)
    _over: bool = field(default=False, init=False)
    _last: float = field(default=NONE, init=False)

    def __post_init__(self) -> None:
        self._sizes = MovingSum(self.samples)

    def fire(self, value: float) -> float:
        """1 if the signal exceeds the threshold now, else 0; NaN if it is missing."""
        self._sizes.push(abs(value))
        if value != value:
            return NONE
        was, level = self._over, self.threshold.release if self._over else self.threshold.factor
        # Rounding may leave a running sum slightly off zero; a signal that stays at zero is not an impulse.
        self._over = value * self._sizes.known > level * max(self._sizes.total, 0.0)
        return 1.0 if self._over and not was else 0.0


class Corpuscle(Trigger):
    """A model Meissner corpuscle: fires when x = |d reading / dt| (2006 paper, (1)) exceeds its threshold."""

    PRINTED = Threshold(factor=1.5, release=1.5)
    CORRECTED = Threshold(factor=1.2, release=1.2 * 0.8)

    def fire(self, reading: float) -> float:
        """The impulse of one reading: 1 while it rises, -1 while it falls, 0 for none, NaN if there can be none."""
        step, self._last = reading - self._last, reading
        return math.copysign(super().fire(abs(step)), step)


@dataclass(eq=False)
class UpwardCrossings(Trigger):
    """Fires when the signal behind a first-order high-pass crosses zero upward (2007 paper).

    Missing readings do not change the filter: the signal is assumed to continue from its last value.
    """

    PRINTED: ClassVar = Threshold(factor=0.0, release=0.0)
    CORRECTED: ClassVar = Threshold(factor=0.0, release=-0.7)
    rate_Hz: float
    cutoff_Hz: float
    _passed: float = field(default=0.0, init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        # The bilinear first-order high-pass of this corner frequency.
        tangent = math.tan(math.pi * self.cutoff_Hz / self.rate_Hz)
        self._gain, self._keep = 1 / (1 + tangent), (1 - tangent) / (1 + tangent)

    def fire(self, reading: float) -> float:
        """The impulse of one reading: 1 or 0, NaN if it is missing."""
        if reading != reading:
            return super().fire(NONE)
        step, self._last = 0.0 if self._last != self._last else reading - self._last, reading
        self._passed = self._keep * self._passed + self._gain * step
        return super().fire(self._passed)


class ImpulseMethod(NamedTuple):
    """window_s : window of the mean size and of the count. threshold : of the impulses.

    paired : the wavelength is the distance travelled between the impulses, or while they were counted, not |v(t)| / f.
    """

    window_s: float
    threshold: Threshold
    paired: bool


class ImpulseStream(RoughnessStream):
    """Base of the estimators that count or time impulses."""

    @abstractmethod
    def _begin(self) -> tuple[Trigger, Any]:
        """Makes the objects of a new state: one makes impulses, the other one reads them (its `find` takes an impulse
        and |velocity| in mm/s)."""

    def _find(self, method: tuple[Trigger, Any], reading: float, speed: float) -> Finding:
        source, reader = method
        return reader.find(source.fire(reading), speed)
