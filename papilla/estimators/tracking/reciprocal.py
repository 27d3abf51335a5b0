"""Reciprocal counting in space: the wavelength is the distance between upward crossings, over their number.

The velocity-aware form of the zero-crossing counter: positions of the crossings are interpolated, so whole numbers of
samples do not matter. A reversal begins a new count.
"""

import math
from dataclasses import dataclass, replace

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.tracking.answer import TrackingStatus, WavelengthEstimate
from papilla.estimators.tracking.stream import VAGUE, WavelengthStream, frequency_of, pair

_OK, _SEARCHING, _STANDSTILL, _MISSING, _NO_VELOCITY, _ALIASED, _, _DISTURBED = map(int, TrackingStatus)
HYSTERESIS = 0.5
"""A crossing counts after the signal was this fraction of its rms below the mean."""
DOUBT = HYSTERESIS / math.sqrt(2) / (2 * math.pi)
"""Sd of a crossing before any was compared, in wavelengths: noise beyond the hysteresis, over a sine's slope, would
have counted more crossings."""
IRREGULAR = 2.0
"""Sd of the crossings, over `DOUBT`, from which some are missing or too many: noise or a second line made them."""
SILENCE = 1.5
"""Longest wavelengths without a crossing after which the mean is no mean of these readings."""
WINDOWS, TRUST = 6.0, 2.0
"""Windows without common crossings that are compared with the one before, fading, and how many the white noise that
sigma assumes is worth against them."""
APART = 4.0
"""Sds from the window before within which it confirms fewer than half of the crossings that are kept."""
SPLIT = 5.0
"""Normalised square from which the two halves of a window differ by more than noise."""
PRIOR = 3.0
"""Comparisons that `DOUBT` is worth: the fewest of which the error over its stated sigma has a variance."""


@dataclass(frozen=True)
class CrossingState:
    """mean, power: fading in distance; since, silent: mm since the mean began, and since the last crossing; armed: the
    signal was low; last: the reading before, less the mean; travel: mm since the stroke began; crossings: their places
    on this stroke, newest last; sign: of the stroke; answer: the last one; regular: whether the crossings since then
    do not contradict it; window: wavelength of the last whole window, and its relative variance in white noise; fresh:
    crossings since then; excess: of such windows, sum of squares of what neighbours differ by over what they should,
    and how many; scatter: of the strokes before, sum of squares of their crossings' errors in wavelengths, and
    comparisons."""

    mean: float = math.nan
    power: float = 0.0
    since: float = 0.0
    silent: float = 0.0
    armed: bool = False
    last: float = 0.0
    travel: float = 0.0
    crossings: tuple[float, ...] = ()
    velocity: float = math.nan
    sign: float = 0.0
    answer: tuple[float, float] = (math.nan, math.nan)
    regular: bool = False
    window: tuple[float, float] = (math.nan, 0.0)
    fresh: int = 0
    excess: tuple[float, float] = (TRUST, TRUST)
    scatter: tuple[float, float] = (PRIOR * DOUBT**2, PRIOR)


class ReciprocalCounter(WavelengthStream):
    """Streaming wavelength from zero crossings in space; one sample is (reading, velocity_mm_s).

    Parameters
    ----------
    wavelength_range_mm : (shortest, longest); the mean fades over twice the longest, shorter intervals are not counted.
    sample_rate_Hz : of the samples, evenly spaced.
    crossings : how many are kept; the memory in wavelengths is one less.

    Raises `InputError` for unusable values.
    """

    def __init__(
        self,
        *,
        wavelength_range_mm: tuple[float, float] = (0.4, 6.0),
        sample_rate_Hz: float = 1000.0,
        crossings: int = 17,
    ):
        self._shortest = checks.positive("shortest wavelength (mm)", wavelength_range_mm[0])
        self._longest = checks.positive("longest wavelength (mm)", wavelength_range_mm[1])
        if self._longest <= self._shortest:
            raise InputError(f"wavelength_range_mm must rise, got {self._shortest:g} to {self._longest:g} mm")
        if crossings < 3:
            raise InputError(f"crossings must be at least 3, got {crossings}")
        self._dt = 1 / checks.positive("sample_rate_Hz", sample_rate_Hz)
        self._kept = int(crossings)
        self.reset()

    def _fresh(self) -> CrossingState:
        return CrossingState()

    def update(self, sample) -> WavelengthEstimate:
        """The estimate after one more sample (reading, velocity_mm_s); raises `InputError` for another length."""
        reading, velocity = pair(sample)
        state = self.state
        if not math.isfinite(velocity):
            # Without a distance the intervals before and after do not belong together.
            self.state = replace(state, velocity=math.nan, crossings=(), armed=False)
            return self._answer(_NO_VELOCITY, velocity)
        before = velocity if math.isnan(state.velocity) else state.velocity
        step = 0.5 * (before + velocity) * self._dt
        if step == 0.0:
            self.state = replace(state, velocity=velocity)
            return self._answer(_STANDSTILL, velocity)
        if abs(step) > 0.5 * self._longest:
            self.state = replace(state, velocity=velocity, crossings=(), armed=False)
            return self._answer(_ALIASED, velocity)
        sign = math.copysign(1.0, step)
        if sign != state.sign:
            state = self._compared(state) if min(state.fresh, len(state.crossings)) > 2 else state
            scatter = self._remembered(state.crossings, state.scatter)
            state = replace(state, sign=sign, travel=0.0, crossings=(), armed=False, scatter=scatter)
        travel = state.travel + abs(step)
        if not math.isfinite(reading):
            self.state = replace(state, velocity=velocity, travel=travel, crossings=(), armed=False)
            return self._answer(_MISSING, velocity)
        self.state = self._counted(state, reading, velocity, travel, abs(step))
        if math.isnan(self.state.answer[0]):
            return self._answer(_SEARCHING, velocity)
        sure = self.state.regular and self.state.answer[1] < VAGUE * self.state.answer[0]
        return self._answer(_OK if sure else _DISTURBED, velocity)

    def _counted(self, state: CrossingState, reading, velocity, travel, step) -> CrossingState:
        if state.silent > SILENCE * self._longest:
            state = replace(state, mean=math.nan, since=0.0, silent=0.0, armed=False, crossings=(), regular=False)
        since, silent = state.since + step, state.silent + step
        # At first the mean of all readings, then a fading one.
        share = max(-math.expm1(-step / (2 * self._longest)), step / since)
        mean = reading if math.isnan(state.mean) else state.mean + share * (reading - state.mean)
        level = reading - mean
        power = state.power + share * (level * level - state.power)
        armed, crossings, answer, regular = state.armed, state.crossings, state.answer, state.regular
        fresh = state.fresh
        if level < -HYSTERESIS * math.sqrt(power):
            armed = True
        elif armed and level >= 0.0 > state.last:
            place = travel - step * level / (level - state.last)
            # A mean of less than the longest wavelength is not where the texture's crossings are.
            if since > self._longest and (not crossings or place - crossings[-1] >= 0.5 * self._shortest):
                crossings, silent, fresh = (*crossings[-self._kept + 1 :], place), 0.0, state.fresh + 1
                if len(crossings) > 2:
                    found = self._measured(crossings, state)
                    answer, regular = found or answer, found is not None
            armed = False
        if travel > 1e6:
            # Places are differences only: a long stroke must not lose digits.
            crossings, travel, since = tuple(place - travel for place in crossings), 0.0, min(since, 1e6)
        counted = replace(
            state,
            mean=mean,
            power=power,
            since=since,
            silent=silent,
            armed=armed,
            last=level,
            travel=travel,
            crossings=crossings,
            velocity=velocity,
            answer=answer,
            regular=regular,
            fresh=fresh,
        )
        return self._compared(counted) if min(fresh, len(crossings)) >= self._kept else counted

    def _pooled(self, crossings: tuple[float, ...], before: tuple[float, float]) -> tuple[float, float]:
        """Scatter of a stroke of three crossings or more, and of those before as far as it has fewer comparisons than
        all the crossings that are kept would give."""
        squares, freedom = _scatter(crossings)
        share = min(1.0, (max(self._kept - 2, PRIOR) - freedom) / before[1])
        return squares + share * before[0], freedom + share * before[1]

    def _remembered(self, crossings: tuple[float, ...], before: tuple[float, float]) -> tuple[float, float]:
        """Scatter of all strokes when one ends. What exceeds `DOUBT` came of a wrong count, and the next stroke counts
        anew."""
        if len(crossings) < 3:
            return before
        squares, freedom = self._pooled(crossings, before)
        return min(squares, freedom * DOUBT**2), freedom

    def _variance(self, state: CrossingState, crossings: tuple[float, ...]) -> float:
        """Relative variance of the wavelength of these crossings, if the windows before err on their own; infinite
        where they are not those of one wavelength."""
        squares, freedom = self._pooled(crossings, state.scatter)
        # Few comparisons: Student's distribution is wider than a normal one, its variance by n / (n - 2).
        jitter = squares / (freedom - 2)
        if jitter > (IRREGULAR * DOUBT) ** 2:
            return math.inf
        alone, half = 2 * jitter / (len(crossings) - 1) ** 2, (len(crossings) - 1) // 2
        # In white noise the halves of a window differ by 12 times the variance of the whole: by far more, and they err
        # as two, their mean by a quarter.
        first, last = crossings[half] - crossings[0], crossings[-1] - crossings[-1 - half]
        differ = math.log(last / first) ** 2
        return differ / 4 if differ > SPLIT * 12 * alone else alone

    def _measured(self, crossings: tuple[float, ...], state: CrossingState) -> tuple[float, float] | None:
        """Wavelength and sigma of three crossings or more; None where they are not those of one wavelength, where it is
        out of range, or where they are few and not confirmed by the window before."""
        count = len(crossings) - 1
        wavelength, variance = (crossings[-1] - crossings[0]) / count, self._variance(state, crossings)
        excess = state.excess[0] / state.excess[1]
        before, doubt = state.window
        off = math.log(wavelength / before)
        confirmed = off * off < APART**2 * excess * (variance + doubt) or 2 * count >= self._kept - 1
        if not confirmed or not self._shortest <= wavelength <= self._longest or variance == math.inf:
            return None
        return wavelength, wavelength * math.sqrt(variance * excess)

    def _compared(self, state: CrossingState) -> CrossingState:
        """When a window is over: what it differs by from the one before says by how much crossings err together.

        Source of the ratio: Birge (1932), doi:10.1103/PhysRev.40.207.
        """
        crossings, excess, (before, doubt) = state.crossings, state.excess, state.window
        wavelength, variance = (crossings[-1] - crossings[0]) / (len(crossings) - 1), self._variance(state, crossings)
        if variance == math.inf:
            return replace(state, fresh=0)
        if not math.isnan(before):
            off, keep = math.log(wavelength / before), math.exp(-1 / WINDOWS)
            squares, windows = ((value - TRUST) * keep for value in excess)
            excess = squares + off * off / (variance + doubt) + TRUST, windows + 1 + TRUST
        return replace(state, window=(wavelength, variance), fresh=0, excess=excess)

    def _answer(self, status: int, velocity: float) -> WavelengthEstimate:
        wavelength, sigma = self.state.answer
        return WavelengthEstimate(wavelength, sigma, frequency_of(velocity, wavelength), status)


def _scatter(crossings: tuple[float, ...]) -> tuple[float, float]:
    """Sum of squares of the crossings' errors in wavelengths, and how many comparisons it is from.

    The line through the outer crossings is not the fitted one: with n intervals the squares about it are on average
    1 + (2 n - 1) / (3 n) times those of the n - 1 crossings between.
    """
    count = len(crossings) - 1
    wavelength = (crossings[-1] - crossings[0]) / count
    residuals = [place - crossings[0] - number * wavelength for number, place in enumerate(crossings)]
    excess = 1 + (2 * count - 1) / (3 * count)
    return math.fsum(value * value for value in residuals) / (excess * wavelength**2), count - 1.0
