"""Zero crossings of the high-passed signal accumulated over a period A (2007 paper), and its correction."""

import math
from dataclasses import dataclass

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.published.corpuscle import fault_of
from papilla.estimators.published.counting import CountState, ImpulseCount
from papilla.estimators.published.stream import (
    DEFAULT_RANGE_MM,
    OK,
    Answers,
    RoughnessStream,
    StreamState,
    checked_ring,
)

CORRECTED_RELEASE = 0.7
"""Of the mean |signal| of the last A: the signal must have been below minus this before a crossing counts again."""
_NONE = math.nan


@dataclass(frozen=True)
class CrossingState:
    """passed : the high-passed signal; last_reading; armed : it has been low enough since the last impulse.

    place, total, fresh, sizes : ring of |passed| with its running sums, as in `CorpuscleState`.
    """

    passed: float = 0.0
    last_reading: float = _NONE
    armed: bool = False
    place: int = 0
    total: float = 0.0
    fresh: float = 0.0
    sizes: tuple[float, ...] = ()


class UpwardCrossings:
    """An impulse where the signal behind a first-order high-pass goes over zero, once `release` x its mean size below.

    Missing readings leave the filter as it is: the signal is taken to go on from where it stopped.
    """

    def __init__(self, samples: int, rate_Hz: float, cutoff_Hz: float, saturation: float, release: float):
        self._samples, self._saturation, self._release = samples, saturation, release
        # The bilinear first-order high-pass of this corner frequency.
        tangent = math.tan(math.pi * cutoff_Hz / rate_Hz)
        self._gain, self._keep = 1 / (1 + tangent), (1 - tangent) / (1 + tangent)
        self.state = CrossingState(sizes=(0.0,) * samples)

    @property
    def state(self) -> CrossingState:
        """All that is remembered, to be kept or to be set again."""
        return CrossingState(
            self._passed, self._last, self._armed, self._place, self._total, self._fresh, tuple(self._sizes)
        )

    @state.setter
    def state(self, state: CrossingState) -> None:
        self._sizes = checked_ring("sizes", state.sizes, self._samples)
        self._passed, self._last, self._armed = state.passed, state.last_reading, state.armed
        self._place, self._total, self._fresh = state.place, state.total, state.fresh

    def fire(self, readings) -> tuple[list[int], list[bool], list[int]]:
        """For each reading: the impulse (1 or 0), whether there could be one, and the fault of the reading."""
        samples, saturation, gain, keep = self._samples, self._saturation, self._gain, self._keep
        release = self._release / samples
        sizes, passed, last, armed = self._sizes, self._passed, self._last, self._armed
        place, total, fresh = self._place, self._total, self._fresh
        impulses: list[int] = []
        known: list[bool] = []
        faults: list[int] = []
        for reading in readings:
            fault = OK if -saturation < reading < saturation else fault_of(reading)
            impulse = 0
            if not fault:
                if last == last:
                    passed = keep * passed + gain * (reading - last)
                last = reading
                size = abs(passed)
                total += size - sizes[place]
                fresh += size
                sizes[place] = size
                place += 1
                if place == samples:
                    place, total, fresh = 0, fresh, 0.0
                if armed and passed > 0.0:
                    impulse, armed = 1, False
                elif passed < -release * total or (passed <= 0.0 and release == 0.0):
                    armed = True
            impulses.append(impulse)
            known.append(not fault)
            faults.append(fault)
        self._passed, self._last, self._armed = passed, last, armed
        self._place, self._total, self._fresh = place, total, fresh
        return impulses, known, faults


@dataclass(frozen=True, kw_only=True)
class ZeroCrossingState(StreamState):
    """What the crossings and the counter remember of the last period A."""

    crossings: CrossingState
    count: CountState


class ZeroCrossing(RoughnessStream):
    """Streaming frequency and wavelength from zero crossings; a sample is (reading, velocity_mm_s[, t_s]).

    As printed: an impulse each time the high-passed reading goes over zero, one a period; f = impulses in the last
    A = 0.08 s / A; wavelength = |v(t)| / f. `expected_error` says for which touch 0.08 s is best. The paper states
    neither order nor corner of the high-pass: first order, 10 Hz, is assumed. It must lie below |v| / wavelength.

    Corrected: a crossing counts only after the signal has been below -0.7 x its mean size over A, and the count is
    paired with the distance travelled in A.

    Measured (RMS error of the wavelength over 0.6-3.0 mm, synthetic gratings, as printed / corrected): 13 / 13 % at
    20 dB and 97-103 mm/s, which is the counting of whole periods; 59 / 46 % at 0 dB; at 20 dB 40 / 21 % in active touch
    of 100 sin 2 pi t mm/s and 40 / 13 % of 197 sin 2 pi 1.07 t.

    Parameters
    ----------
    variant : "as_printed" or "corrected".
    window_s : A.
    high_pass_Hz : corner frequency, < sample_rate_Hz / 2.
    sample_rate_Hz, saturation : of the readings; |reading| >= saturation is not used.
    wavelength_range_mm : its low end says from which speed on the sampling rate is too low to answer.

    Raises `InputError` for unusable values.
    """

    def __init__(
        self,
        *,
        variant: str = "as_printed",
        window_s: float = 0.08,
        high_pass_Hz: float = 10.0,
        sample_rate_Hz: float = 1000.0,
        wavelength_range_mm: tuple[float, float] = DEFAULT_RANGE_MM,
        saturation: float = math.inf,
    ):
        super().__init__(
            variant=variant,
            window_s=window_s,
            sample_rate_Hz=sample_rate_Hz,
            wavelength_range_mm=wavelength_range_mm,
            saturation=saturation,
        )
        self._corner = checks.positive("high_pass_Hz", high_pass_Hz)
        if not self._corner < 0.5 * self.sample_rate_Hz:
            raise InputError(f"high_pass_Hz must be below half of sample_rate_Hz, got {self._corner:g}")
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        corrected, samples, rate = self.variant == "corrected", self.window_samples, self.sample_rate_Hz
        release = CORRECTED_RELEASE if corrected else 0.0
        self._crossings = UpwardCrossings(samples, rate, self._corner, self._saturation, release)
        self._count = ImpulseCount(samples, rate, 1, corrected, self._fastest)
        self._time = math.nan

    @property
    def state(self) -> ZeroCrossingState:
        """All that the estimator remembers, to be kept or to be set again."""
        return ZeroCrossingState(last_time_s=self._time, crossings=self._crossings.state, count=self._count.state)

    @state.setter
    def state(self, state: ZeroCrossingState) -> None:
        self._time, self._crossings.state, self._count.state = state.last_time_s, state.crossings, state.count

    def _advance(self, readings, velocities) -> Answers:
        impulses, known, faults = self._crossings.fire(readings)
        return self._count.advance(impulses, known, faults, velocities)
