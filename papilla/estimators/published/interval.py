"""Frequency from the interval between two impulses (2006 paper, equation (5)), and its correction."""

import math
from dataclasses import dataclass

from papilla.estimators.published.corpuscle import Corpuscle, CorpuscleState
from papilla.estimators.published.stream import (
    ALIASED,
    DEFAULT_RANGE_MM,
    NO_VELOCITY,
    OK,
    SILENT,
    STANDSTILL,
    WARMING_UP,
    Answers,
    RoughnessStream,
    StreamState,
)

_NONE = math.nan
_Answer = tuple[float, float, int]


@dataclass(frozen=True, kw_only=True)
class ImpulseIntervalState(StreamState):
    """since : samples since the last impulse of the falling and of the rising edge, -1 where there was none.

    path : distance in mm since then (NaN once a velocity was missing); seen : samples so far, up to one window;
    interval, distance : of the last two impulses, in samples (0: none yet) and mm.
    """

    corpuscle: CorpuscleState
    since: tuple[int, int] = (-1, -1)
    path: tuple[float, float] = (0.0, 0.0)
    seen: int = 0
    interval: int = 0
    distance: float = 0.0


class ImpulseInterval(RoughnessStream):
    """Streaming frequency from single intervals; a sample is (reading, velocity_mm_s[, t_s]).

    As printed: f_t = 1 / t_v (5), t_v the time between the last two impulses of the corpuscle (threshold 1.5 x the
    mean slope over 200 ms). Entering a groove and reaching a ridge both emit one, so (5) read literally is about
    twice v / wavelength, and flickers where the two edges are not half a wavelength apart.

    Corrected: threshold and hysteresis of `ImpulseDensity`'s correction; t_v between two impulses of the same edge
    (the reading rising at both, or falling); and the wavelength is the distance travelled in t_v.

    Measured (RMS error of the wavelength over 0.6-3.0 mm, synthetic gratings, as printed / corrected): 60 / 2.3 % at
    40 dB and 97-103 mm/s, 59 / 26 % at 20 dB, and 66 / 60 % in active touch of 100 sin 2 pi t mm/s at 20 dB.

    Parameters
    ----------
    variant : "as_printed" or "corrected".
    window_s : period of the mean slope; an answer is held so long without a new impulse.
    sample_rate_Hz, saturation : of the readings; |reading| >= saturation is not used.
    wavelength_range_mm : its low end says from which speed on the sampling rate is too low to answer.

    Raises `InputError` for unusable values.
    """

    def __init__(
        self,
        *,
        variant: str = "as_printed",
        window_s: float = 0.2,
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
        self._paired = variant == "corrected"
        self._corpuscle = Corpuscle(self.window_samples, self._saturation, self._paired)
        self._fresh = self._corpuscle.state
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.state = ImpulseIntervalState(corpuscle=self._fresh)

    @property
    def state(self) -> ImpulseIntervalState:
        """All that the estimator remembers, to be kept or to be set again."""
        (falling, rising), (falling_mm, rising_mm) = self._since, self._path
        return ImpulseIntervalState(
            last_time_s=self._time,
            corpuscle=self._corpuscle.state,
            since=(falling, rising),
            path=(falling_mm, rising_mm),
            seen=self._seen,
            interval=self._interval,
            distance=self._distance,
        )

    @state.setter
    def state(self, state: ImpulseIntervalState) -> None:
        self._time, self._corpuscle.state = state.last_time_s, state.corpuscle
        self._since, self._path = list(state.since), list(state.path)
        self._seen, self._interval, self._distance = state.seen, state.interval, state.distance

    def _advance(self, readings, velocities) -> Answers:
        impulses, _, faults = self._corpuscle.fire(readings)
        step = 1 / self.sample_rate_Hz
        since, path, samples = self._since, self._path, self.window_samples
        answers: list[_Answer] = []
        for impulse, fault, velocity in zip(impulses, faults, velocities, strict=True):
            moved = abs(velocity) * step
            for edge in (0, 1):
                if since[edge] >= 0:
                    since[edge] += 1
                    path[edge] += moved
                # What is longer ago than a window is forgotten, so nothing grows with the stream.
                if since[edge] > samples:
                    since[edge], path[edge] = -1, 0.0
            if impulse:
                self._emit(impulse)
            elif max(since) < 0:
                self._interval = 0
            if self._seen < samples:
                self._seen += 1
                answers.append((_NONE, _NONE, fault or WARMING_UP))
            else:
                answers.append((_NONE, _NONE, fault) if fault else self._answer(abs(velocity)))
        frequency, wavelength, status = zip(*answers, strict=True) if answers else ((), (), ())
        return Answers(list(frequency), list(wavelength), [_NONE] * len(answers), list(status))

    def _emit(self, impulse: int) -> None:
        """Take one impulse: its interval to the last one, or to the last one of its edge."""
        edge = 1 if impulse > 0 else 0
        since = [elapsed for elapsed in self._since if elapsed > 0]
        if self._paired:
            if self._since[edge] > 0:
                self._interval, self._distance = self._since[edge], self._path[edge]
        elif since:
            self._interval = min(since)
        self._since[edge], self._path[edge] = 0, 0.0

    def _answer(self, speed: float) -> _Answer:
        """Frequency, wavelength and status from the last interval."""
        if not self._interval:
            return _NONE, _NONE, SILENT
        if speed > self._fastest or self._interval <= 2:
            return _NONE, _NONE, ALIASED
        frequency = self.sample_rate_Hz / self._interval
        distance = self._distance if self._paired else speed / frequency
        if not distance < math.inf:
            return frequency, _NONE, NO_VELOCITY
        if distance <= 0.0:
            return frequency, _NONE, STANDSTILL
        return frequency, distance, OK
