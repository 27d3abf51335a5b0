"""The frequency of what one gauge slides over, the velocity being unknown: found by spectra, followed through turns."""

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.stream import Stream
from papilla.estimators.tracking.chirp_look import STIFFNESS, ChirpLook, price_of
from papilla.estimators.tracking.stroke import (
    BAND,
    KNOTS,
    MOTION,
    SHAPE,
    Stroke,
    improved,
    moved,
    phase_at,
    profile,
    rate_at,
)  # fmt: skip
from papilla.status import Status

PERIODS, LOOK_PERIODS = 4.5, 2.0
"""Of the lowest frequency, in the window of the fit and in that of a look."""
HOP_S, STRIDE = 0.006, 2
"""Between two steps of the fit; hops of a step while it catches up with the time that a look took."""
STEPS, LIVELIER = 3, 1.6
"""Steps at most while the residual is so many times the noise: the motion is livelier than was expected then."""
LOOK_S, LONGEST_LOOK = (0.1, 0.5), 400
"""Between two looks for a better fit than one in doubt, and than one that is sure; samples that one may take."""
RIVAL = 20.0
"""Nats by which another fit must be better than the one that is followed."""
LONGEST_LAG_S, UNSEEN_S = 0.03, 0.05
"""Longest age of an answer; in which sigma grows by e where readings are missing."""
FORGOTTEN_S, LEARNT_S = 0.5, 0.03
"""In which what is known of the profile and the noise fades by e; in which the liveliness may change by that."""
LIVELY, FIRST_LIVELY = (0.1, 100.0), 1.0
"""Least and greatest noise of the motion, as a part of the frequency a s^2 and sqrt(Hz), and that of a new lock."""
WANDER = 0.1, 10.0
"""Least and greatest kink of the offset at a knot, as a part of the first harmonic over the window."""
WANDERING, FIRM = 10.0, 10.0
"""How the stiffness wanders (1/s^2) in a second, and how firmly it is held while jumps could stand for it."""
DOUBTED, LOST = 1.4, 6.0
"""Residual over the noise from which a fit is not believed, and from which it is given up."""
PROVED = 3.0
"""Periods that a fit must have followed."""
VAGUE, CRAWL = 0.05, 0.25
"""Sigma over the frequency above which, and part of its usual size below which, a wavelength is held."""
QUIET = 0.1
"""Of the profile's power, that the readings must have for there to be movement."""


class ChirpStatus(Status):
    """What became of an answer."""

    OK = 0, "ok"
    SEARCHING = 1, "no frequency stands out: the last one, if any, goes on in doubt, and its sigma grows"
    QUIET = 2, "the reading does not change: standstill, or no texture"
    MISSING = 3, "the reading is missing, not finite or saturated: the motion goes on as it was"


class ChirpEstimate(NamedTuple):
    """frequency_Hz and frequency_sigma_Hz, `lag_s` ago; wavelength_mm and wavelength_sigma_mm, NaN without a velocity;
    status (a `ChirpStatus` value). NaN before the first lock. Of a block, arrays (n,)."""

    frequency_Hz: float | np.ndarray
    frequency_sigma_Hz: float | np.ndarray
    wavelength_mm: float | np.ndarray
    wavelength_sigma_mm: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self):
        """The status in words: a string, or a list of them."""
        return ChirpStatus.in_words(self.status)


@dataclass(eq=False)
class ChirpMemory:
    """readings (n,), speeds : of the latest samples; count : readings in use; since : samples since the last step.

    stroke : the fit that is followed, None before; span : samples since it began; followed : periods since; doubt : its
    residual over the noise; price : of the same readings as a look's. known (9, 9), about (9,) : information of the
    profile in units of the noise, and what it says; stiffness : mean and variance; lively, wander : noise of the motion
    and of the offset; swing : fading mean square of the frequency; quiet : whether nothing changes.
    look : the one under way; rival : what its best must cost less than; waited : samples since it began.
    held : wavelength and sigma.
    """

    readings: np.ndarray
    speeds: list[float]
    count: int = 0
    since: int = 0
    stroke: Stroke | None = None
    span: int = 0
    followed: float = 0.0
    doubt: float = 0.0
    price: float = math.inf
    known: np.ndarray = field(default_factory=lambda: np.zeros((SHAPE, SHAPE)))
    about: np.ndarray = field(default_factory=lambda: np.zeros(SHAPE))
    stiffness: tuple[float, float] = (0.0, STIFFNESS**2)
    lively: float = FIRST_LIVELY
    wander: float = WANDER[0]
    swing: float = 0.0
    quiet: bool = False
    look: ChirpLook | None = None
    rival: float = math.inf
    waited: int = 0
    held: tuple[float, float] = (math.nan, math.nan)


class ChirpTracker(Stream):
    """Streaming frequency of a periodic surface under one gauge; one sample is (reading,) or (reading, velocity_mm_s).

    A look finds lines in spectra of warped time, in which a chirp is one frequency; from the strongest of them the
    motion and the profile are fitted to the latest readings (`papilla.estimators.tracking.stroke`), and followed from
    then on, through reversals. The answer is that of `lag_s` ago, because the end of a window knows the frequency
    several times worse (`references.chirp_bound`). A velocity serves to tell the wavelength only, |v(t - lag)| / f;
    where the frequency is not known well, near a reversal, the wavelength is held.

    Parameters
    ----------
    frequency_range_Hz : (lowest, highest) frequency at which a lock may begin; a lock is then followed below, to zero.
        15 Hz to the lesser of 400 Hz and 0.4 sample_rate_Hz by default.
    sample_rate_Hz : of the samples, which are taken to be evenly spaced.
    lag_s : age of the answer, at most 0.03; rounded to whole samples. The default leaves a sample of a budget of 15 ms.
    saturation : |reading| from which a reading is not one.

    Raises `InputError` for unusable values.
    """

    answer: ClassVar[Any] = ChirpEstimate
    columns, optional = ("reading", "velocity_mm_s"), 1

    def __init__(
        self,
        *,
        frequency_range_Hz: tuple[float, float] | None = None,
        sample_rate_Hz: float = 1000.0,
        lag_s: float = 0.014,
        saturation: float = 1e12,
    ):
        self._rate = rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
        self._lowest, self._highest = _checked_range(frequency_range_Hz, rate)
        self._lag = round(checks.within("lag_s", lag_s, 0, LONGEST_LAG_S) * rate)
        self.lag_s = self._lag / rate
        self._limit = checks.positive("saturation", saturation)
        self._window = max(math.ceil(PERIODS / self._lowest * rate), 32)
        self._kept = 2 * self._window + LONGEST_LOOK
        self._hop = max(round(HOP_S * rate), 1)
        self._times = np.arange(1 - self._window, 1) / rate
        self._spacing = (self._window - 1) / rate / KNOTS
        looked = round(LOOK_PERIODS * rate / self._lowest)
        self._middle = (np.arange(looked) - 0.5 * (looked - 1)) / rate
        self.reset()

    def _fresh(self) -> ChirpMemory:
        return ChirpMemory(np.full(2 * self._kept, math.nan), [math.nan] * (self._lag + 1))

    def _remember(self, memory: ChirpMemory) -> None:
        if len(memory.readings) != 2 * self._kept or len(memory.speeds) != self._lag + 1:
            raise InputError("the state is not of this sampling rate, range of frequencies and lag")
        super()._remember(memory)

    def _take(self, sample):
        memory, (reading, velocity) = self._memory, (*sample, math.nan)[:2]
        usable = -self._limit < reading < self._limit
        if memory.count == len(memory.readings):
            memory.readings[: self._kept] = memory.readings[-self._kept :]
            memory.count = self._kept
        memory.readings[memory.count] = reading if usable else math.nan
        memory.count += 1
        memory.since += 1
        memory.waited += 1
        memory.speeds.append(velocity)
        del memory.speeds[0]
        if memory.since >= self._hop:
            self._follow()
        elif memory.count >= self._window:
            self._search()
        return self._answer(abs(memory.speeds[0]), usable)

    def _latest(self, behind: int = 0) -> np.ndarray:
        end = self._memory.count - behind
        return self._memory.readings[end - self._window : end]

    def _answer(self, speed: float, usable: bool) -> ChirpEstimate:
        memory, stroke = self._memory, self._memory.stroke
        wavelength, spread = memory.held
        if stroke is None:
            return ChirpEstimate(math.nan, math.nan, wavelength, spread, self._status(usable, False))
        rate, slopes = rate_at(stroke, (memory.since - self._lag) / self._rate)
        known, swing, frequency = slice(MOTION + KNOTS), memory.swing**0.5, abs(rate)
        sigma = math.sqrt(float(slopes @ stroke.covariance[known, known] @ slopes) * max(memory.doubt, 1.0))
        # What a jump since the youngest knot would add: there is none to take it.
        sigma = math.hypot(sigma, 0.3 * memory.lively * swing * self._spacing**1.5)
        caught_up = memory.since <= self._hop and memory.followed > PROVED
        good = caught_up and stroke.proved and memory.doubt < DOUBTED and sigma < 2 * VAGUE * frequency
        if good and sigma < VAGUE * frequency and frequency > CRAWL * swing and speed == speed:
            wavelength = speed / frequency
            spread = wavelength * sigma / frequency
            memory.held = wavelength, spread
        return ChirpEstimate(frequency, sigma, wavelength, spread, self._status(usable, good))

    def _status(self, usable: bool, good: bool) -> int:
        if not usable:
            return int(ChirpStatus.MISSING)
        if self._memory.quiet:
            return int(ChirpStatus.QUIET)
        return int(ChirpStatus.OK if good else ChirpStatus.SEARCHING)

    def _follow(self) -> None:
        """A step of the fit with the readings since the last one."""
        memory, stroke = self._memory, self._memory.stroke
        if stroke is None:
            memory.since, memory.quiet = 0, self._still(0.0, 0.0)
            return
        # A look takes a while: what it found catches up by strides that a motion cannot leave the fit in.
        stride = min(memory.since, STRIDE * self._hop)
        memory.since -= stride
        since = stride / self._rate
        motion = moved(stroke.motion, since)
        motion[0] -= math.floor(motion[0])
        jumps, age, trend = stroke.jumps, stroke.age + since, stroke.trend
        # Nearer than half a spacing a jump is as good as a chirp.
        if age > 1.5 * self._spacing:
            jumps, age = np.append(0.0, jumps[:-1]), age - self._spacing
            trend = np.concatenate([trend[:2], [0.0], trend[2:-1]])
        memory.followed += abs(float(motion[1])) * since
        memory.swing += (float(motion[1]) ** 2 - memory.swing) * since / FORGOTTEN_S
        # What was before the fit began is not known to be of the same motion.
        memory.span = min(memory.span + stride, self._window)
        readings = self._latest(memory.since).copy()
        readings[: self._window - memory.span] = math.nan
        stroke = stroke._replace(motion=motion, jumps=jumps, age=age, trend=trend)
        if not np.isfinite(readings[-stride:]).any():
            memory.stroke = stroke._replace(covariance=stroke.covariance * math.exp(2 * since / UNSEEN_S))
            return
        prior, about = self._prior(stroke)
        for _ in range(STEPS):
            stroke = improved(stroke, readings, self._times, self._rate, prior, about)
            if stroke.residual @ stroke.residual < LIVELIER * stroke.noise * memory.span:
                break
        self._learn(stroke, readings)

    def _swing(self, stroke: Stroke) -> float:
        """What the frequency (Hz) usually is."""
        return max(self._memory.swing, float(stroke.motion[1]) ** 2, 1.0) ** 0.5

    def _prior(self, stroke: Stroke) -> tuple[np.ndarray, np.ndarray]:
        """Information (31, 31) that is known before the readings of the window, and where it is centred (31,)."""
        memory, swing, size = self._memory, self._swing(stroke), abs(float(stroke.shape[0])) + 1e-300
        mean, variance = memory.stiffness
        firm = FIRM * swing * abs(float(self._times[0])) ** 5 * memory.lively**2
        jump = memory.lively * swing * self._spacing**0.5
        loose = [
            0.25,
            0.5 * swing,
            20 * swing,
            (1 / variance + firm) ** -0.5,
            *[jump] * KNOTS,
            math.inf,
            2 * size,
            *[memory.wander * size] * KNOTS,
        ]
        prior = np.diag(np.concatenate([np.array(loose) ** -2.0, np.full(SHAPE, 0.01 / size**2)]))
        prior[-SHAPE:, -SHAPE:] += memory.known / stroke.noise
        about = np.concatenate([stroke.motion, np.zeros(KNOTS), stroke.trend[:2], np.zeros(KNOTS), memory.about])
        about[MOTION - 1] = (mean / variance + stroke.motion[3] * firm) / (1 / variance + firm)
        return prior, about

    def _learn(self, stroke: Stroke, readings: np.ndarray) -> None:
        """What the fit says of the noise, the motion and the profile."""
        memory, hop, residual = self._memory, self._hop, stroke.residual
        count = max(int(np.isfinite(readings).sum()) - MOTION - 4, 1)
        noise = max(float(residual @ residual) / count, 1e-8 * float(stroke.shape[0]) ** 2, 1e-300)
        looked = len(self._middle)
        memory.price = price_of(stroke, float(np.mean(residual[-looked:] ** 2)) + 1e-300, looked, self._rate)
        memory.doubt = noise / stroke.noise
        livelier = 2.0 if memory.doubt > LIVELIER else 1.0
        usual, size = self._swing(stroke) * self._spacing**0.5, abs(float(stroke.shape[0])) + 1e-300
        spread, begin = stroke.covariance.diagonal(), MOTION + KNOTS + 2
        found = self._grown(memory.lively, stroke.jumps / usual, spread[MOTION : MOTION + KNOTS] / usual**2)
        memory.lively = min(max(found * livelier, LIVELY[0]), LIVELY[1])
        found = self._grown(memory.wander, stroke.trend[-KNOTS:] / size, spread[begin : begin + KNOTS] / size**2)
        memory.wander = min(max(found * livelier, WANDER[0]), WANDER[1])
        mean, variance = memory.stiffness
        # Of the window's readings a hop is new.
        own = max(1 / float(stroke.covariance[3, 3]) - 1 / variance, 0.0) * hop / self._window
        mean += (float(stroke.motion[3]) - mean) * own / (1 / variance + own)
        variance = 1 / (1 / variance + own) + WANDERING**2 * hop / self._rate
        memory.stiffness = mean, min(variance, STIFFNESS**2)
        share = hop / self._rate / FORGOTTEN_S
        self._learn_profile(stroke, readings, 1 - share)
        crawling = abs(float(stroke.motion[1])) < CRAWL * self._swing(stroke)
        memory.quiet = crawling and self._still(stroke.noise, 0.5 * float(stroke.shape @ stroke.shape))
        share *= 3 * (memory.doubt < DOUBTED)
        followed = abs(float(stroke.motion[1])) < BAND * self._rate
        memory.stroke = stroke._replace(noise=stroke.noise + share * (noise - stroke.noise)) if followed else None

    def _grown(self, prior: float, found: np.ndarray, variance: np.ndarray) -> float:
        """A standard deviation that was expected, after values (k,) were found with these variances.

        Estimates under a prior scatter by its variance less their own: by more, and the prior was too narrow.
        """
        told = np.maximum(prior**2 - variance, 0.0)
        ratio = min(float(found @ found) / max(float(told.sum()), 1e-12 * prior**2), 5.0)
        weight = self._hop / self._rate / LEARNT_S * float(told.mean()) / prior**2
        return prior * math.exp(0.5 * weight * (ratio - 1))

    def _still(self, noise: float, power: float) -> bool:
        """Whether the newest readings change by no more than noise, and little beside a profile of this power."""
        newest = self._memory.readings[max(self._memory.count - len(self._middle) // 2, 0) : self._memory.count]
        newest = newest[np.isfinite(newest)]
        return newest.size > 8 and float(newest.var()) - noise <= QUIET * power

    def _learn_profile(self, stroke: Stroke, readings: np.ndarray, fade: float) -> None:
        """Add what the readings say whose phase is known best and that the window soon leaves behind."""
        memory, begin = self._memory, self._window // 4
        rows = slice(begin, begin + self._hop)
        columns, _ = profile(*phase_at(stroke, self._times[rows]), self._rate)
        columns = columns * np.isfinite(readings[rows, None])
        pull = fade * (memory.known @ memory.about) + columns.T @ (stroke.residual[rows] + columns @ stroke.shape)
        memory.known = fade * memory.known + columns.T @ columns
        least = 1e-9 * (float(np.trace(memory.known)) + 1e-300)
        memory.about = np.linalg.solve(memory.known + least * np.eye(SHAPE), pull)

    def _search(self) -> None:
        """The next part of a look, or its beginning."""
        memory = self._memory
        if memory.look is not None:
            if memory.look.advance():
                self._choose(memory.look)
                memory.look = None
            return
        sure = memory.stroke is not None and memory.doubt < LIVELIER
        if memory.stroke is None or memory.waited >= LOOK_S[sure] * self._rate:
            begun = self._latest()[-len(self._middle) :].copy()
            memory.look = ChirpLook(begun, self._middle, self._lowest, self._highest, self._rate)
            memory.rival, memory.waited = memory.price - RIVAL, 0

    def _choose(self, look: ChirpLook) -> None:
        """Follow the best fit of a look from now on, if it is better than what is followed."""
        memory, own, best = self._memory, self._memory.stroke, look.best
        if best is None or memory.waited > LONGEST_LOOK:
            return
        if own is not None and own.proved and memory.doubt < LOST and look.price > memory.rival:
            return
        motion = moved(best.motion, float(self._middle[-1]))
        memory.stroke = best._replace(motion=motion, age=0.5 * self._spacing, spacing=self._spacing)
        memory.since, memory.span, memory.followed, memory.doubt = memory.waited, len(self._middle), 0.0, 1.0
        memory.known, memory.about = np.zeros((SHAPE, SHAPE)), best.shape.copy()
        memory.stiffness, memory.lively = (0.0, STIFFNESS**2), FIRST_LIVELY
        memory.wander = WANDER[0]
        memory.swing = float(best.motion[1]) ** 2


def _checked_range(frequency_range_Hz, rate: float) -> tuple[float, float]:
    top = BAND * rate
    asked = (15.0, min(400.0, top)) if frequency_range_Hz is None else frequency_range_Hz
    lowest, highest = checks.rising("frequency_range_Hz", asked)
    if not 2 * lowest <= highest <= min(top, 100 * lowest):
        raise InputError(
            f"frequency_range_Hz must span a factor 2 to 100 below {BAND:g} of the sampling rate ({top:g} Hz), "
            f"got {lowest:g} to {highest:g} Hz"
        )
    return lowest, highest
