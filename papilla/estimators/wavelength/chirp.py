"""The frequency of one gauge that slides over a texture at an unknown velocity: found by spectra, followed in turns.

The reading is a periodic profile of an unknown phase, y(t) = p(phi(t)); the frequency is |dphi/dt|. In active touch it
sweeps to 150 Hz and back within half a second: a spectrum smears the line, a phase-locked loop loses it at every turn.
Here the frequency f is a motion of few parameters, d2f/dt2 = -k f with small jumps of df/dt, which is exact through the
turns of a sinusoidal stroke. Two processes share the samples:

- a search (`frequency_search`) has no memory: spectra of warped time, then fits from the best lines;
- the follower fits the same model to the last 0.3 s every 8 ms, with what it learnt of the profile as a prior. A search
  must be better by 20 nats to replace it; every 0.1 s it is tested whether it follows a harmonic.

A step of the fit takes three samples, a search some 70. The answer is 14 ms old: a window's end knows the frequency
worse. It fails where strokes are shorter than a few periods, or the fundamental is below 5 % of the loudest harmonic.
"""

import math
from typing import Any, ClassVar

import numpy as np

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.units import SAMPLE_RATE_HZ, TINY_DIVISOR
from papilla.estimators.stream import SpreadTask, Stream
from papilla.estimators.wavelength import motion_fit
from papilla.estimators.wavelength.chirp_memory import (
    FIRST_LIVELY,
    OFFSET_KINK_LIMITS,
    ChirpEstimate,
    ChirpMemory,
    ChirpStatus,
    Step,
)
from papilla.estimators.wavelength.frequency_search import FrequencySearch, SubharmonicTest, price_of
from papilla.estimators.wavelength.memory import WIDEST_RANGE_RATIO
from papilla.estimators.wavelength.motion_fit import MOTION_KNOTS, MOTION_PARAMETERS, SHAPE_PARAMETERS, MotionFit
from papilla.estimators.wavelength.spectrum import FEWEST_ROWS

WINDOW_PERIODS, SEARCH_PERIODS = 4.5, 2.0
"""Length of the window of the fit, and of that of a search, in periods of the lowest frequency."""
FIT_HOP_S, CATCH_UP_STEPS = 0.008, 2
"""Time between two steps of the fit; and number of steps that are done at once while a new fit catches up with the
present."""
MOST_HOP_PIECES = 6, 10
"""Largest number of pieces per hop, of a step of the fit (which has three) and of a search: each sample does a share of
them, so that none takes long and half of the samples are free for searches."""
SAME_TURN = 0.25
"""Largest difference (cycles) of a reading's new phase from its earlier one, for the earlier one to stay valid."""
LIVELIER_MOTION_RATIO = 1.6
"""Ratio of residual to noise above which the motion is livelier than expected."""
SEARCH_S, LONGEST_SEARCH = (0.1, 1.0), 400
"""Time between two searches for a better fit: if the present fit is in doubt, and if it is sure; and largest number of
samples of a search."""
HARMONIC_S = 0.1
"""Time between two tests whether the fit follows a harmonic. With half as many tests more of the "ok" rows are wrong:
24 instead of 11 % in the scene "quick turns", 30 instead of 25 % in "hand, realistic"."""
RIVAL_NATS = 20.0
"""Difference in log-likelihood (nats) by which another fit must be better to replace the present one."""
LONGEST_LAG_S, UNSEEN_S = 0.03, 0.05
"""Largest age of an answer; and time constant with which sigma grows while readings are missing."""
FORGOTTEN_S, LEARNT_S = 0.5, 0.03
"""Time constant with which the knowledge of profile and noise fades; and the one with which the liveliness may
change."""
MOTION_NOISE_LIMITS = 0.1, 100.0
"""Smallest and largest process noise of the motion, relative to the frequency, in s^-2 and per sqrt(Hz)."""
STIFFNESS_WALK, FIRM_STIFFNESS_WALK = 10.0, 10.0
"""Random walk of the stiffness (1/s^2) per second, and the tighter value that holds as long as jumps could explain its
changes."""
DOUBTED_RESIDUAL_RATIO, LOST_RESIDUAL_RATIO = 1.4, 6.0
"""Ratio of residual to noise above which a fit is not believed, and above which it is given up."""
PROVED_PERIODS = 3.0
"""Number of periods that a fit must have followed."""
CLEAN_TESTS, SOONER_TEST_SHARE = 8, 0.8
"""Number of consecutive tests without a sign of a lower frequency that must follow a test with one, because faint
harmonics come and go; and the share of the time between two tests by which the next one is earlier if there were too
few periods."""
VAGUE_FREQUENCY_SIGMA, CRAWL_FREQUENCY_SHARE = 0.05, 0.25
"""Relative sigma of the frequency above which a wavelength is held, and the share of its usual frequency below which it
is held."""
QUIET_POWER_SHARE = 0.1
"""Share of the profile's power that the readings must have for movement."""


class ChirpTracker(Stream):
    """Online estimate of the frequency of a periodic surface under one gauge; one sample is (reading,) or (reading,
    velocity_mm_s).

    A search finds lines in spectra of warped time, in which a chirp is one frequency; from the strongest of them the
    motion and the profile are fitted to the latest readings (`papilla.estimators.wavelength.motion_fit`), and followed
    from then on, through reversals. The answer is that of `lag_s` ago, because the end of a window knows the frequency
    several times worse (`references.chirp_bound`). A velocity is used for the wavelength only, |v(t - lag)| / f; if the
    frequency is not known well, near a reversal, the wavelength is held.

    Parameters
    ----------
    frequency_range_Hz : (lowest, highest) frequency at which a fit may begin; it is then followed to lower frequencies,
        down to zero. The default is 15 Hz to the smaller of 400 Hz and 0.4 sample_rate_Hz.
    sample_rate_Hz : of the samples, which are taken to be evenly spaced.
    lag_s : age of the answer, at most 0.03; rounded to whole samples. The default is one sample less than 15 ms.
    saturation : |reading| at and above which a reading is saturated.

    Raises `InputError` for unusable values.
    """

    answer: ClassVar[Any] = ChirpEstimate
    columns, optional = ("reading", "velocity_mm_s"), 1

    def __init__(
        self,
        *,
        frequency_range_Hz: tuple[float, float] | None = None,
        sample_rate_Hz: float = SAMPLE_RATE_HZ,
        lag_s: float = 0.014,
        saturation: float = checks.LARGEST_READING,
    ):
        self._rate = rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
        top = motion_fit.CHIRP_BAND_LIMIT * rate
        asked = (15.0, min(400.0, top)) if frequency_range_Hz is None else frequency_range_Hz
        self._lowest, self._highest = lowest, highest = checks.rising("frequency_range_Hz", asked)
        if not 2 * lowest <= highest <= min(top, WIDEST_RANGE_RATIO * lowest):
            raise InputError(
                f"frequency_range_Hz must span a factor 2 to {WIDEST_RANGE_RATIO} below "
                f"{motion_fit.CHIRP_BAND_LIMIT:g} of the sampling rate ({top:g} Hz), got {lowest:g} to {highest:g} Hz"
            )
        self._lag = round(checks.within("lag_s", lag_s, 0, LONGEST_LAG_S) * rate)
        self.lag_s = self._lag / rate
        self._limit = checks.positive("saturation", saturation)
        self._window = max(math.ceil(WINDOW_PERIODS / self._lowest * rate), motion_fit.FEWEST_READINGS)
        self._kept = 2 * self._window + LONGEST_SEARCH
        self._hop = max(round(FIT_HOP_S * rate), 1)
        self._step_pieces, self._search_pieces = (math.ceil(pieces / self._hop) for pieces in MOST_HOP_PIECES)
        self._times = np.arange(1 - self._window, 1) / rate
        self._spacing = (self._window - 1) / rate / MOTION_KNOTS
        searched = round(SEARCH_PERIODS * rate / self._lowest)
        self._middle = (np.arange(searched) - 0.5 * (searched - 1)) / rate
        self.reset()

    def _fresh(self) -> ChirpMemory:
        nothing = np.full((2, 2 * self._kept), math.nan)
        return ChirpMemory(nothing[0], nothing[1], [math.nan] * (self._lag + 1), self._window)

    def _remember(self, memory: ChirpMemory) -> None:
        if len(memory.readings) != 2 * self._kept or len(memory.speeds) != self._lag + 1:
            raise InputError("the state is not of this sampling rate, range of frequencies and lag")
        super()._remember(memory)

    @property
    def other_Hz(self) -> float:
        """The other possible frequency, of which the last answer may be a harmonic; 0 if there is none."""
        stroke, ratio = self._memory.stroke, self._memory.other
        return abs(float(stroke.motion[1])) * ratio if stroke is not None and ratio == ratio else 0.0

    def _take(self, sample):
        memory, (reading, velocity) = self._memory, (*sample, math.nan)[:2]
        usable = -self._limit < reading < self._limit
        # The buffer holds twice what is kept and is compacted only when full: a copy once in many samples, not in each.
        if memory.count == len(memory.readings):
            for buffer in (memory.readings, memory.phases):
                buffer[: self._kept] = buffer[-self._kept :]
            memory.count = self._kept
        memory.readings[memory.count], memory.phases[memory.count] = reading if usable else math.nan, math.nan
        memory.count += 1
        memory.since += 1
        memory.waited += 1
        memory.asked += 1
        memory.speeds.append(velocity)
        del memory.speeds[0]
        # A step of the fit is due every FIT_HOP_S and has priority; the samples between two steps belong to searches
        # and tests.
        for _ in range(self._step_pieces):
            if memory.step is None and memory.since < self._hop:
                for _ in range(self._search_pieces * (memory.count >= self._window + len(self._middle))):
                    self._search()
                break
            self._follow()
        return self._answer(abs(memory.speeds[0]), usable)

    def _latest(self, behind: int = 0) -> np.ndarray:
        end = self._memory.count - behind
        return self._memory.readings[end - self._window : end]

    def _answer(self, speed: float, usable: bool) -> ChirpEstimate:
        memory, stroke = self._memory, self._memory.stroke
        wavelength, spread = memory.held
        if stroke is None:
            return ChirpEstimate(math.nan, math.nan, wavelength, spread, self._status(usable, False))
        # Frequency and sigma of all samples until the next step are computed together: one product of matrices for them
        # all.
        if memory.since >= len(memory.answers):
            memory.answers = self._answers(stroke)
        frequency, sigma = memory.answers[memory.since]
        seen = memory.since < 2 * self._hop and memory.followed > PROVED_PERIODS and not memory.absent
        sure = stroke.proved and memory.doubt < DOUBTED_RESIDUAL_RATIO
        good = seen and sure and sigma < 2 * VAGUE_FREQUENCY_SIGMA * frequency
        crawling = frequency <= CRAWL_FREQUENCY_SHARE * memory.swing**0.5
        # Near a reversal f tends to 0, and v / f is a quotient of two small numbers: hold the wavelength instead.
        if good and not memory.other and sigma < VAGUE_FREQUENCY_SIGMA * frequency and not crawling and speed == speed:
            wavelength = speed / frequency
            spread = wavelength * sigma / frequency
            memory.held = wavelength, spread
        return ChirpEstimate(frequency, sigma, wavelength, spread, self._status(usable, good))

    def _answers(self, stroke: MotionFit) -> list[tuple[float, float]]:
        """Frequency and its standard deviation in Hz, `lag_s` before each sample of the next step."""
        memory, parameters = self._memory, slice(motion_fit.JUMPS_PART.stop)
        rates, slopes = motion_fit.rates_at(stroke, (np.arange(memory.since + 2 * self._hop) - self._lag) / self._rate)
        variances = ((slopes @ stroke.covariance[parameters, parameters]) * slopes).sum(axis=1) * max(memory.doubt, 1.0)
        # Add the uncertainty by a jump since the youngest knot, because no parameter describes it.
        variances += (0.3 * memory.lively * self._spacing**1.5) ** 2 * memory.swing
        return list(zip(np.abs(rates).tolist(), np.sqrt(variances).tolist(), strict=True))

    def _status(self, usable: bool, good: bool) -> int:
        if not usable:
            return int(ChirpStatus.MISSING)
        if self._memory.quiet:
            return int(ChirpStatus.QUIET)
        # Nothing is "ok" before the first test whether the fit follows a harmonic.
        if not good or self._memory.other != self._memory.other:
            return int(ChirpStatus.SEARCHING)
        return int(ChirpStatus.AMBIGUOUS if self._memory.other else ChirpStatus.OK)

    def _follow(self) -> None:
        """The next piece of a step of the fit, with the readings since the last step; or the first piece."""
        memory, step = self._memory, self._memory.step
        if step is None:
            self._begin_step()
        elif step.fit is None:
            memory.step = step._replace(fit=motion_fit.solved(step.design, step.prior, step.about))
        else:
            memory.step = None
            memory.since -= step.stride
            self._learn(step.fit, step.readings)
            self._learn_profile(step.fit, step.readings)

    def _begin_step(self) -> None:
        memory, stroke = self._memory, self._memory.stroke
        if stroke is None:
            memory.since, memory.quiet = 0, self._still(0.0, 0.0)
            return
        # A search takes some time: its fit catches up in strides that are short enough for the motion to stay within
        # reach.
        stride = min(memory.since, CATCH_UP_STEPS * self._hop)
        since = stride / self._rate
        motion = motion_fit.moved(stroke.motion, since)
        # Only the phase within a turn matters. Large phases would lose digits over hours.
        motion[0] -= math.floor(motion[0])
        jumps, age, trend = stroke.jumps, stroke.age + since, stroke.trend
        # Nearer than half a spacing, a jump cannot be distinguished from a chirp.
        if age > 1.5 * self._spacing:
            jumps, age = np.append(0.0, jumps[:-1]), age - self._spacing
            trend = np.concatenate([trend[:2], [0.0], trend[2:-1]])
        # Periods followed, and fading mean square of the frequency: the scale for the priors of the motion near a turn,
        # where the present frequency is 0.
        memory.followed += abs(float(motion[1])) * since
        memory.swing += (float(motion[1]) ** 2 - memory.swing) * since / FORGOTTEN_S
        # Readings from before the beginning of the fit may belong to another motion.
        memory.span = min(memory.span + stride, self._window)
        readings = self._latest(memory.since - stride).copy()
        readings[: self._window - memory.span] = math.nan
        stroke = stroke._replace(motion=motion, jumps=jumps, age=age, trend=trend)
        # No new reading: continue the motion, with a sigma that grows.
        if not np.isfinite(readings[-stride:]).any():
            memory.since -= stride
            self._take_on(stroke._replace(covariance=stroke.covariance * math.exp(2 * since / UNSEEN_S)))
            return
        design = motion_fit.designed(stroke, readings, self._times, self._rate)
        memory.step = Step(design, *self._prior(stroke), readings, stride)

    def _take_on(self, stroke: MotionFit | None) -> None:
        """Follow this fit from now on."""
        self._memory.stroke, self._memory.answers = stroke, []

    def _swing(self, stroke: MotionFit) -> float:
        """The usual size of the frequency (Hz)."""
        return max(self._memory.swing, float(stroke.motion[1]) ** 2, 1.0) ** 0.5

    def _prior(self, stroke: MotionFit) -> tuple[np.ndarray, np.ndarray]:
        """Information (31, 31) before the readings of the window, and its mean (31,)."""
        memory, swing, size = self._memory, self._swing(stroke), abs(float(stroke.shape[0])) + TINY_DIVISOR
        mean, variance = memory.stiffness
        # The stiffness k changes slowly. As long as jumps of the chirp could explain the same phases, a change of k is
        # not believed: so the livelier the motion, the firmer is k.
        firm = FIRM_STIFFNESS_WALK * swing * abs(float(self._times[0])) ** 5 * memory.lively**2
        jump = memory.lively * swing * self._spacing**0.5
        # Standard deviations: phase within a quarter turn, frequency and chirp wide, jumps as large as this hand's so
        # far.
        motion = [0.25, 0.5 * swing, 20 * swing, (1 / variance + firm) ** -0.5, *[jump] * MOTION_KNOTS]
        trend = [math.inf, 2 * size, *[memory.wander * size] * MOTION_KNOTS]
        prior = np.diag(np.array([*motion, *trend, *[10 * size] * SHAPE_PARAMETERS]) ** -2.0)
        # The profile learnt from readings that have left the window.
        prior[motion_fit.SHAPE_PART, motion_fit.SHAPE_PART] += memory.known / stroke.noise
        still = np.zeros(MOTION_KNOTS)
        about = np.concatenate([stroke.motion, still, stroke.trend[:2], still, memory.about])
        about[MOTION_PARAMETERS - 1] = (mean / variance + stroke.motion[-1] * firm) / (1 / variance + firm)
        return prior, about

    def _learn(self, stroke: MotionFit, readings: np.ndarray) -> None:
        """Update noise, motion and profile from the fit."""
        memory, hop, residual = self._memory, self._hop, stroke.residual
        count = max(int(np.isfinite(readings).sum()) - MOTION_PARAMETERS - 4, 1)
        noise = max(float(residual @ residual) / count, 1e-8 * float(stroke.shape[0]) ** 2, TINY_DIVISOR)
        searched = len(self._middle)
        memory.price = price_of(stroke, float(np.mean(residual[-searched:] ** 2)) + TINY_DIVISOR, searched, self._rate)
        memory.doubt = noise / stroke.noise
        # A residual above the noise means that the hand moves less smoothly than assumed, so let the motion jump more.
        livelier = 2.0 if memory.doubt > LIVELIER_MOTION_RATIO else 1.0
        usual, size = self._swing(stroke) * self._spacing**0.5, abs(float(stroke.shape[0])) + TINY_DIVISOR
        spread = stroke.covariance.diagonal()
        grown = self._grown(memory.lively, stroke.jumps / usual, spread[motion_fit.JUMPS_PART] / usual**2)
        memory.lively = min(max(grown * livelier, MOTION_NOISE_LIMITS[0]), MOTION_NOISE_LIMITS[1])
        kinks = spread[motion_fit.TREND_PART][-MOTION_KNOTS:]
        grown = self._grown(memory.wander, stroke.trend[-MOTION_KNOTS:] / size, kinks / size**2)
        memory.wander = min(max(grown * livelier, OFFSET_KINK_LIMITS[0]), OFFSET_KINK_LIMITS[1])
        mean, variance = memory.stiffness
        # One hop of the window's readings is new.
        information = max(1 / float(spread[MOTION_PARAMETERS - 1]) - 1 / variance, 0.0) * hop / self._window
        mean += (float(stroke.motion[-1]) - mean) * information / (1 / variance + information)
        variance = 1 / (1 / variance + information) + STIFFNESS_WALK**2 * hop / self._rate
        memory.stiffness = mean, min(variance, motion_fit.PRIOR_STIFFNESS_SIGMA**2)
        share = hop / self._rate / FORGOTTEN_S
        crawling = abs(float(stroke.motion[1])) < CRAWL_FREQUENCY_SHARE * self._swing(stroke)
        memory.absent = self._still(stroke.noise, 0.5 * float(stroke.shape @ stroke.shape))
        memory.quiet = crawling and memory.absent
        # Learn the noise three times as fast, but only from a fit that explains its readings: a bad fit's residual is
        # no noise.
        share *= 3 * (memory.doubt < DOUBTED_RESIDUAL_RATIO)
        # A fit that ran beyond the visible band follows nothing: give it up.
        followed = abs(float(stroke.motion[1])) < motion_fit.CHIRP_BAND_LIMIT * self._rate
        self._take_on(stroke._replace(noise=stroke.noise + share * (noise - stroke.noise)) if followed else None)

    def _grown(self, prior: float, values: np.ndarray, variance: np.ndarray) -> float:
        """The expected standard deviation, updated after values (k,) were found with these variances.

        Estimates under a prior of variance s^2 scatter by s^2 minus their own variance. If they scatter by more, the
        prior was too narrow.
        """
        expected = np.maximum(prior**2 - variance, 0.0)
        ratio = min(float(values @ values) / max(float(expected.sum()), 1e-12 * prior**2), 5.0)
        weight = self._hop / self._rate / LEARNT_S * float(expected.mean()) / prior**2
        return prior * math.exp(0.5 * weight * (ratio - 1))

    def _still(self, noise: float, power: float) -> bool:
        """Whether the newest readings change by no more than noise, and by little compared with a profile of this
        power."""
        newest = self._memory.readings[max(self._memory.count - len(self._middle) // 2, 0) : self._memory.count]
        newest = newest[np.isfinite(newest)]
        return newest.size > FEWEST_ROWS and float(newest.var()) - noise <= QUIET_POWER_SHARE * power

    def _learn_profile(self, stroke: MotionFit, readings: np.ndarray) -> None:
        """Add those readings to the profile whose phase is known best and that will soon leave the window."""
        memory, begin, fade = self._memory, self._window // 4, 1 - self._hop / self._rate / FORGOTTEN_S
        rows = slice(begin, begin + self._hop)
        columns, _ = motion_fit.profile(*motion_fit.phase_at(stroke, self._times[rows]), self._rate)
        columns = columns * np.isfinite(readings[rows, None])
        # Recursive least squares with fading memory: information and right-hand side of the nine shape parameters.
        pull = fade * (memory.known @ memory.about) + columns.T @ (stroke.residual[rows] + columns @ stroke.shape)
        memory.known = fade * memory.known + columns.T @ columns
        least = 1e-9 * (float(np.trace(memory.known)) + TINY_DIVISOR)
        memory.about = np.linalg.solve(memory.known + least * np.eye(SHAPE_PARAMETERS), pull)

    def _search(self) -> None:
        """The next piece of a search or test, or the first piece."""
        memory, search = self._memory, self._memory.search
        if search is None:
            due = self._due()
            memory.search = SpreadTask(due) if due else None
            return
        result = search.advance()
        if result is None:
            return
        memory.search = None
        if isinstance(search.task, FrequencySearch):
            self._choose(*result)
        # A sign of a lower frequency; see `CLEAN_TESTS` for how long it counts.
        elif result > 0:
            # If there was no sign before, a single one may be noise.
            memory.other = result if memory.clean <= CLEAN_TESTS else memory.other
            memory.clean = 0
        elif result == 0:
            memory.clean += 1
            memory.other = 0.0 if memory.clean > CLEAN_TESTS else memory.other
        else:
            # Too few periods for a test: repeat it soon.
            memory.asked += round(SOONER_TEST_SHARE * HARMONIC_S * self._rate)

    def _due(self) -> FrequencySearch | SubharmonicTest | None:
        """The search or test that is due, if any."""
        memory, stroke = self._memory, self._memory.stroke
        if stroke is not None and memory.followed > PROVED_PERIODS and memory.asked >= HARMONIC_S * self._rate:
            memory.asked = 0
            return self._periods(stroke)
        sure = stroke is not None and memory.doubt < LIVELIER_MOTION_RATIO
        if memory.waited < SEARCH_S[sure] * self._rate * (stroke is not None or memory.idle):
            return None
        newest = self._latest()[-len(self._middle) :].copy()
        search = FrequencySearch(newest, self._middle, self._lowest, self._highest, self._rate)
        # Without a fit, first ask whether the readings are more than noise: a search is the most expensive part.
        memory.idle, memory.waited = stroke is None and not search.moves(), 0
        # The present fit's cost on the readings of this search, minus the margin: fixed now, because the search ends
        # later.
        memory.rival = memory.price - RIVAL_NATS
        return None if memory.idle else search

    def _periods(self, stroke: MotionFit) -> SubharmonicTest:
        """A test on the readings with known phase: those of the window, and earlier ones without a gap."""
        memory, end = self._memory, self._memory.count - self._memory.since
        first, phases = end - memory.span, memory.phases
        now = motion_fit.phase_at(stroke, self._times[-memory.span :])[0]
        # The phase now counts from another whole turn.
        before = now - phases[first:end]
        shifts = before[np.isfinite(before)]
        turns = round(float(np.median(shifts))) if shifts.size else 0
        same = shifts.size > 0 and float(np.abs(shifts - turns).max()) < SAME_TURN
        phases[:first] = phases[:first] + turns if same else math.nan
        phases[first:end] = now
        begin = end - int(np.isfinite(phases[:end][::-1]).argmin()) if np.isnan(phases[:end]).any() else 0
        rate = max(abs(float(stroke.motion[1])), self._lowest)
        return SubharmonicTest(phases[begin:end].copy(), memory.readings[begin:end].copy(), self._lowest / rate)

    def _choose(self, best: MotionFit | None, price: float) -> None:
        """Follow the best fit of a search from now on if it is better than the present one."""
        memory, stroke = self._memory, self._memory.stroke
        if best is None or memory.waited > LONGEST_SEARCH:
            return
        if stroke is not None and stroke.proved and memory.doubt < LOST_RESIDUAL_RATIO and price > memory.rival:
            return
        # The search fitted the middle of its window; extrapolate to its end. The next steps catch up with the present.
        motion = motion_fit.moved(best.motion, float(self._middle[-1]))
        memory.step = None
        self._take_on(best._replace(motion=motion, age=0.5 * self._spacing, spacing=self._spacing))
        memory.since, memory.span, memory.followed, memory.doubt = memory.waited, len(self._middle), 0.0, 1.0
        # A new fit has learnt nothing yet: profile, stiffness and noise of the motion start from their priors.
        memory.known, memory.about = np.zeros((SHAPE_PARAMETERS, SHAPE_PARAMETERS)), best.shape.copy()
        memory.stiffness, memory.swing = (0.0, motion_fit.PRIOR_STIFFNESS_SIGMA**2), float(best.motion[1]) ** 2
        memory.lively, memory.wander = FIRST_LIVELY, OFFSET_KINK_LIMITS[0]
        # The first test follows as soon as the fit was followed for long enough.
        memory.phases[:], memory.asked, memory.clean, memory.other = math.nan, LONGEST_SEARCH, CLEAN_TESTS, math.nan
