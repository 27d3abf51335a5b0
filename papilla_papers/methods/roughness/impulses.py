"""Frequency from impulses: a signal made of the reading exceeds a multiple of its own mean size (2006 and 2007 papers).

The 2006 paper counts the impulses of a model Meissner corpuscle (`ImpulseDensity`) or measures the interval between two
of them (`ImpulseInterval`). The 2007 paper counts zero crossings (`ZeroCrossing`) over a period A, and says that A =
0.08 s minimises "the formulation of expected estimation errors", but prints no formula. The one of `expected_error`
follows from how the estimate is made. A wavelength w under the velocity v(t) = V sin(2 pi r t) gives the frequency
f(t) = v(t) / w; counted over the last A it is N / A.

It holds for a signed count: periods passed backwards count negative, whereas the impulses of the paper only add up.

* Counting: A f is cut to a whole number of periods; with a random phase the square of the error has the expectation
  u (1 - u), u the fractional part of A f, on average 1/6: the frequency is off by 1 / (sqrt(6) A).
* Delay: N / A is the mean of f over the last A: the sinusoid times sinc(r A), late by A / 2. Its mean square
  difference from f(t) is (V / w)^2 / 2 |1 - sinc(r A) exp(-i pi r A)|^2, about (pi r A V / w)^2 / 2.

Counting falls with A, delay rises: the sum is smallest at A = (4/3)^(1/4) sqrt(w / (2 pi r V)). For A = 0.08 s this is
w = 2 pi r V (0.08 s)^2 / (4/3)^(1/2): 3.5 mm at the natural touch of 100 sin(2 pi t) mm/s. The minimum is flat: over
1-4 mm in this touch, with u (1 - u) itself in place of its average, no A has an error more than 4 % smaller.
"""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from papilla.core import checks
from papilla.core.errors import InputError
from papilla_papers.methods.roughness import stream
from papilla_papers.methods.roughness.stream import Finding, RoughnessStream

IMPULSES_A_GROOVE = 2
ALIAS_SHARE = 0.9
"""Share of the largest number of impulses that a window can contain (one every second sample) above which a count may
be an alias."""


@dataclass(eq=False)
class MovingSum:
    """`total` of the last `length` values and how many of them are `known`; a NaN is in neither.

    A running sum accumulates rounding errors. Here, whenever the ring is full, the sum of the values since its
    beginning replaces it, so no error lasts longer than two windows.
    """

    length: int
    total: float = 0.0
    known: int = 0

    def __post_init__(self) -> None:
        self._fresh, self._place, self._values = 0.0, 0, [stream.NOTHING_FOUND] * self.length

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

    def __post_init__(self) -> None:
        self._sizes, self._over, self._last = MovingSum(self.samples), False, stream.NOTHING_FOUND

    def fire(self, value: float) -> float:
        """1 if the signal exceeds the threshold now, else 0; NaN if it is missing."""
        self._sizes.push(abs(value))
        if value != value:
            return stream.NOTHING_FOUND
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


class UpwardCrossings(Trigger):
    """Fires when the signal behind a first-order high-pass crosses zero upward (2007 paper).

    Missing readings do not change the filter: the signal is assumed to continue from its last value.
    """

    PRINTED = Threshold(factor=0.0, release=0.0)
    CORRECTED = Threshold(factor=0.0, release=-0.7)

    def __init__(self, samples: int, threshold: Threshold, rate_Hz: float, cutoff_Hz: float):
        super().__init__(samples, threshold)
        # The bilinear first-order high-pass of this corner frequency.
        tangent = math.tan(math.pi * cutoff_Hz / rate_Hz)
        self._passed, self._gain, self._keep = 0.0, 1 / (1 + tangent), (1 - tangent) / (1 + tangent)

    def fire(self, reading: float) -> float:
        """The impulse of one reading: 1 or 0, NaN if it is missing."""
        if reading != reading:
            return super().fire(stream.NOTHING_FOUND)
        step, self._last = 0.0 if self._last != self._last else reading - self._last, reading
        self._passed = self._keep * self._passed + self._gain * step
        return super().fire(self._passed)


@dataclass(eq=False)
class ImpulseCount:
    """Counts impulses over the last `samples` and computes f = count / (per_period x duration).

    The distance of a period is |velocity now| / f, or, `paired`, the distance travelled while counting over the number
    of periods. fastest_mm_s : speed above which there is no answer.
    """

    samples: int
    rate_Hz: float
    per_period: int
    paired: bool
    fastest_mm_s: float

    def __post_init__(self) -> None:
        self._impulses, self._speeds = MovingSum(self.samples), MovingSum(self.samples)

    def find(self, impulse: float, speed: float) -> Finding:
        """The finding after a sample: its impulse (0: none, NaN: none possible), and |velocity|."""
        self._impulses.push(abs(impulse))
        self._speeds.push(speed)
        count, valid, moving = self._impulses.total, self._impulses.known, self._speeds.known
        if valid < self.samples // 2:
            return Finding(stream.GAP_CODE)
        if count == 0:
            return Finding(stream.SILENT_CODE)
        if speed > self.fastest_mm_s or count > ALIAS_SHARE * 0.5 * self.samples:
            return Finding(stream.ALIASED_CODE)
        average = self._speeds.total / moving if self.paired and moving else speed
        periods, seconds = count / self.per_period, valid / self.rate_Hz
        status = stream.OK if valid == self.samples else stream.GAP_CODE
        return Finding(status, periods / seconds, average * seconds / periods)


@dataclass(eq=False)
class LastInterval:
    """The interval between the last two impulses of any edge, or of the `same_edge`, if it is not older than `samples`.

    _since : samples and distance in mm since the last impulse of each edge (1 rising, -1 falling), if it is not older
    than that; _interval : the same between the last two impulses, 0 samples if there is none.
    """

    samples: int
    rate_Hz: float
    same_edge: bool
    fastest_mm_s: float
    _since: dict[float, tuple[int, float]] = field(default_factory=dict, init=False)
    _interval: tuple[int, float] = field(default=(0, stream.NOTHING_FOUND), init=False)

    def find(self, impulse: float, speed: float) -> Finding:
        """The finding after a sample: its impulse (1 rising, -1 falling, 0 none), and |velocity|."""
        moved = speed / self.rate_Hz
        # Impulses older than a window are forgotten, so the state does not grow with the stream.
        self._since = {edge: (age + 1, path + moved) for edge, (age, path) in self._since.items() if age < self.samples}
        if not self._since:
            self._interval = (0, stream.NOTHING_FOUND)
        if abs(impulse) > 0:
            latest = min(self._since.values(), default=self._interval)
            self._interval = self._since.get(impulse, self._interval) if self.same_edge else latest
            self._since[impulse] = (0, 0.0)
        samples, distance = self._interval
        if not samples:
            return Finding(stream.SILENT_CODE)
        if speed > self.fastest_mm_s or samples <= 2:
            return Finding(stream.ALIASED_CODE)
        return Finding(stream.OK, self.rate_Hz / samples, distance if self.same_edge else moved * samples)


class ImpulseMethod(NamedTuple):
    """window_s : window of the mean size and of the count. threshold : of the impulses.

    paired : the wavelength is the distance travelled between the impulses, or while they were counted, not |v(t)| / f.
    """

    window_s: float
    threshold: Threshold
    paired: bool


class ImpulseStream(RoughnessStream):
    """Base of the estimators that count or time impulses. `_begin` makes two objects: one makes impulses, the other one
    reads them (its `find` takes an impulse and |velocity| in mm/s)."""

    def _find(self, method: tuple[Trigger, Any], reading: float, speed: float) -> Finding:
        source, reader = method
        return reader.find(source.fire(reading), speed)


class ImpulseDensity(ImpulseStream):
    """Streaming frequency and wavelength from the density of impulses; a sample is (reading, velocity_mm_s[, t_s]).

    As printed: x = |d reading / dt| (1); an impulse where x crosses h = 1.5 x its mean over 200 ms upward; c impulses
    in the last a = 200 ms (2); f = c / (2 a) (3), two impulses a groove; wavelength = |v(t)| / f (4).

    Corrected: h = 1.2 x the mean; no second impulse before x has been below 0.8 h; and c is paired with the distance
    travelled while it was counted, wavelength = 2 distance / c, instead of with the velocity at the end.

    Measured (RMS error of the wavelength over 0.6-3.0 mm, synthetic gratings, as printed / corrected): 52 / 2.2 % at
    40 dB and 97-103 mm/s, where the printed threshold misses every other impulse of 0.6 mm and reads 1.75-2.0 times
    the wavelength; 51 / 19 % at 20 dB, because noise makes impulses and both read short; in active touch at 20 dB
    73 / 55 % (100 sin 2 pi t mm/s) and 115 / 70 % (197 sin 2 pi 1.07 t).

    Parameters are those of `RoughnessStream`; window_s (None: 0.2 s) is a, and the period of the mean.
    """

    VARIANTS = {
        "as_printed": ImpulseMethod(window_s=0.2, threshold=Corpuscle.PRINTED, paired=False),
        "corrected": ImpulseMethod(window_s=0.2, threshold=Corpuscle.CORRECTED, paired=True),
    }

    def _begin(self):
        a, method = self.window_samples, self._method
        count = ImpulseCount(a, self.sample_rate_Hz, IMPULSES_A_GROOVE, method.paired, self._fastest)
        return Corpuscle(a, method.threshold), count


class ImpulseInterval(ImpulseStream):
    """Streaming frequency from single intervals; a sample is (reading, velocity_mm_s[, t_s]).

    As printed: f_t = 1 / t_v (5), t_v the time between the last two impulses of the corpuscle (threshold 1.5 x the
    mean slope over 200 ms). Entering a groove and reaching a ridge both emit one, so (5) read literally is about
    twice v / wavelength, and flickers where the two edges are not half a wavelength apart.

    Corrected: threshold and hysteresis of `ImpulseDensity`'s correction; t_v between two impulses of the same edge
    (the reading rising at both, or falling); and the wavelength is the distance travelled in t_v.

    Measured (RMS error of the wavelength over 0.6-3.0 mm, synthetic gratings, as printed / corrected): 60 / 2.3 % at
    40 dB and 97-103 mm/s, 59 / 26 % at 20 dB, and 66 / 60 % in active touch of 100 sin 2 pi t mm/s at 20 dB.

    Parameters are those of `RoughnessStream`; window_s (None: 0.2 s) is the period of the mean slope, and an answer is
    held so long without a new impulse.
    """

    VARIANTS = ImpulseDensity.VARIANTS

    def _begin(self):
        samples, method = self.window_samples, self._method
        interval = LastInterval(samples, self.sample_rate_Hz, method.paired, self._fastest)
        return Corpuscle(samples, method.threshold), interval


class ZeroCrossing(ImpulseStream):
    """Streaming frequency and wavelength from zero crossings; a sample is (reading, velocity_mm_s[, t_s]).

    As printed: an impulse each time the high-passed reading goes over zero, one a period; f = impulses in the last
    A = 0.08 s / A; wavelength = |v(t)| / f. `expected_error` says for which touch 0.08 s is best. The paper states
    neither order nor corner of the high-pass: first order, 10 Hz, is assumed. It must lie below |v| / wavelength.

    Corrected: a crossing counts only after the signal has been below -0.7 x its mean size over A, and the count is
    paired with the distance travelled in A.

    Measured (RMS error of the wavelength over 0.6-3.0 mm, synthetic gratings, as printed / corrected): 13 / 13 % at
    20 dB and 97-103 mm/s, which is the counting of whole periods; 59 / 46 % at 0 dB; at 20 dB 40 / 21 % in active touch
    of 100 sin 2 pi t mm/s and 40 / 13 % of 197 sin 2 pi 1.07 t.

    Parameters are those of `RoughnessStream`, where window_s (None: 0.08 s) is A, and high_pass_Hz : corner frequency,
    < sample_rate_Hz / 2. Raises `InputError` for unusable values.
    """

    VARIANTS = {
        "as_printed": ImpulseMethod(window_s=0.08, threshold=UpwardCrossings.PRINTED, paired=False),
        "corrected": ImpulseMethod(window_s=0.08, threshold=UpwardCrossings.CORRECTED, paired=True),
    }

    def __init__(self, *, high_pass_Hz: float = 10.0, **parameters: Any):
        self._corner = checks.positive("high_pass_Hz", high_pass_Hz)
        super().__init__(**parameters)

    def _prepare(self):
        if not self._corner < 0.5 * self.sample_rate_Hz:
            raise InputError(f"high_pass_Hz must be below half of sample_rate_Hz, got {self._corner:g}")
        self._settings += f", high-pass of {self._corner:g} Hz"

    def _begin(self):
        a, rate, method = self.window_samples, self.sample_rate_Hz, self._method
        crossings = UpwardCrossings(a, method.threshold, rate, self._corner)
        return crossings, ImpulseCount(a, rate, 1, method.paired, self._fastest)


def expected_error(period_s, wavelength_mm: float, peak_speed_mm_s: float, touch_Hz: float):
    """Root mean square error of the frequency in Hz, counted over `period_s` (scalar or (n,)).

    The touch is peak_speed sin(2 pi touch_Hz t); its amplitude of frequency is peak_speed / wavelength. Counting is
    taken at its average over fractional parts, which holds once a window holds a period or more.
    Raises `InputError` for what is not positive.
    """
    wavelength = checks.positive("wavelength_mm", wavelength_mm)
    speed = checks.positive("peak_speed_mm_s", peak_speed_mm_s)
    turns = checks.positive("touch_Hz", touch_Hz) * _periods(period_s)
    # numpy's sinc already contains the pi.
    delay = np.abs(1 - np.sinc(turns) * np.exp(-1j * np.pi * turns)) ** 2
    return np.sqrt(1 / (6 * _periods(period_s) ** 2) + 0.5 * (speed / wavelength) ** 2 * delay)


def optimal_period(wavelength_mm: float, peak_speed_mm_s: float, touch_Hz: float) -> float:
    """The A in s that makes `expected_error` smallest, to first order in touch_Hz x A.

    Raises `InputError` for what is not positive.
    """
    wavelength = checks.positive("wavelength_mm", wavelength_mm)
    speed, turns = checks.positive("peak_speed_mm_s", peak_speed_mm_s), checks.positive("touch_Hz", touch_Hz)
    return float((4 / 3) ** 0.25 * np.sqrt(wavelength / (2 * np.pi * turns * speed)))


def _periods(period_s) -> np.ndarray:
    periods = np.asarray(period_s, float)
    if not (np.isfinite(periods).all() and (periods > 0).all()):
        raise InputError("period_s must be positive and finite")
    return periods
