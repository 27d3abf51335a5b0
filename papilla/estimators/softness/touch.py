"""A touch, and Young's modulus from its S_d and force: contact, zeros in the air, slots of samples, and the answer.

`TouchEstimator` is the common part of both estimators of softness, `Softness` the one from S_d alone: one reading
instead of many. A touch is a filter (`fitter`) that begins where a first sample fits best and lives until contact is
lost. At 1 kHz most samples repeat the one before, so samples that lie near each other are summed in a slot, and the
filter learns the mean of a full slot: y_slot = (y_1 + ... + y_n) / n with noise R / n. Each sample of a slot still gets
its own answer: a tangent, y - y_0 = B (force, place), gives its force and place by one small matrix product. A sample
beyond the tangent's reach, or with a large misfit, closes the slot.

In the air the readings are zeros. Means of 20 samples are learnt as zeros, each only when the next one agrees, so that
the beginning of a press is never learnt as a zero. Force and readings together decide whether the finger is in the air,
because either alone may be a zero that has drifted.
"""

import math
from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from papilla.calibration import IDENTIFIABLE_SIGMA, Calibration, SoftnessStatus
from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.units import SAMPLE_RATE_HZ
from papilla.estimators.health import STUCK_SAMPLES, GaugeHealth, HealthState, numbered
from papilla.estimators.softness.channels import Doubts, SdReading, Tangent
from papilla.estimators.softness.fitter import FilterState, Fitter, NoiseFit
from papilla.estimators.softness.touch_start import Start
from papilla.estimators.stream import SpreadTask, Stream, completed

NOISE_REACH = 4.0
"""Number of sigmas by which a measured force may lie outside the domain, if S_d shows that it is inside."""
CONTACT_N = 0.02
"""Force below which there may be no contact, of the default finger; that of another one in proportion to the forces of
its calibration."""


def contact_N(calibration: Calibration) -> float:
    """`CONTACT_N` of a calibration's finger."""
    return CONTACT_N * float(calibration.finger.get("force_factor", 1.0))


@dataclass(frozen=True)
class TouchRules:
    """Tuned numbers of contact, air and answers."""

    largest_errors: float = 60.0
    """Squared norm of the estimated errors, each divided by its standard deviation, above which the fit is not
    trusted."""
    air_share: float = 0.5
    """Standard deviation of a zero that was measured in the air, relative to an unknown one: it drifts during the
    touch."""
    rest_samples: int = 20
    """Samples whose mean is compared with the next such mean: a period of 50 Hz at 1 kHz."""
    rest_share: float = 0.05
    """Two means agree within noise and this share of a zero's standard deviation. A press of 10 mN/s moves the middle
    gauge by 10 microstrain from one to the next, a twentieth of the 200 microstrain that its zero may be off."""
    rest_limit: float = 4.0
    """Mean square difference over the channels, in these units, up to which two means agree."""
    zero_samples: float = 100.0
    """Time constant of the zeros in the air."""
    light_samples: int = 50
    """Number of consecutive samples with a force below that of contact after which drifted readings count as air."""
    largest_drift: float = 8.0
    """Largest drift of a zero, in its standard deviations, for this rule."""
    patience: int = 480
    """Number of good samples that outweigh the first time that nothing explains the readings."""


TOUCH_RULES = TouchRules()


class Rest(NamedTuple):
    """Samples in the air that are not yet learnt: their sum (g + 1,) and number, and the earlier mean, if any."""

    total: np.ndarray | float = 0.0
    samples: int = 0
    before: np.ndarray | None = None


class Slot(NamedTuple):
    """Samples that are learnt together: their sum (c + 1,) and number, the (lowest, highest) steps from the tangent
    that they may have, the faults that all of them have, and the fit of their mean once there are enough samples."""

    total: np.ndarray
    samples: int
    reach: tuple[tuple[float, float], ...]
    faults: tuple[int, ...]
    fit: NoiseFit | None = None


class SoftnessEstimate(NamedTuple):
    """modulus_MPa, modulus_sigma_MPa (NaN where there is no answer) and status: the value of a `SoftnessStatus`.

    NOT_IDENTIFIABLE may come with a modulus: its sigma is then more than half of it. Of a block, arrays (n,).
    """

    modulus_MPa: float | np.ndarray = math.nan
    modulus_sigma_MPa: float | np.ndarray = math.nan
    status: int | np.ndarray = int(SoftnessStatus.NO_CONTACT)

    @property
    def sentence(self) -> Any:
        """The status in words: a string, or a list of them."""
        return SoftnessStatus.in_words(self.status)


@dataclass(eq=False)
class TouchState:
    """State of an estimator of softness: health of the gauges; zeros of the channels (microstrain, and N), the number
    of samples in the air from which they come, and samples in the air that are not yet learnt; the filter of this touch
    (None in the air), and the samples that it has not yet learnt.

    faults, returning : per channel (g gauges and the force) the persistent `Fault`, and the number of consecutive good
    samples since. found : faults that the last sample's readings showed by themselves. distrust : number of good
    samples needed before the gauges are trusted again; patience : value of distrust when nothing explains the readings.
    dominant : largest contribution to sigma in the last touch. light : number of consecutive samples with a force below
    that of contact. search : the running search for an explanation of a sample, if any.
    """

    health: HealthState
    zeros: tuple[float, ...]
    airborne: float = 0.0
    rest: Rest = Rest()
    filter: FilterState | None = None
    slot: Slot | None = None
    faults: tuple[int, ...] = ()
    returning: tuple[int, ...] = ()
    found: tuple[int, ...] = ()
    distrust: int = 0
    patience: int = TOUCH_RULES.patience
    dominant: str = ""
    light: int = 0
    search: SpreadTask | None = None


class TouchEstimator(Stream):
    """Base of the estimators; `gauges` readings and a force make a sample.

    A sample without an answer (the status says why) does not change the state, except that lost contact ends the touch.
    """

    _memory: TouchState

    def __init__(self, fitter: Fitter, gauges: int, contact_force_N: float, saturation: float, stuck_samples: int):
        self._fitter, self._start, self._gauges = fitter, Start(fitter), gauges
        self.columns = (*numbered(gauges), "force_N")
        self._contact = checks.positive("contact_force_N", contact_force_N)
        self._health = GaugeHealth(gauges, saturation, stuck_samples)
        self._low = max(self._contact, fitter.surfaces.force_N[0])
        self._lowest = fitter.least_reading() * (self._contact / fitter.surfaces.force_N[0])
        # S_d has the noise and the zero error of a gauge divided by the root of the number of gauges.
        scale = np.append(np.full(gauges, math.sqrt(gauges / fitter.channels)), 1.0)
        self._zero_noise = scale * fitter.noise[[0] * gauges + [-1]]
        self._zero_sigma = scale * ([fitter.doubts.zero_microstrain] * gauges + [fitter.doubts.force_offset_N])
        self._clean, self._all = (0,) * (gauges + 1), np.arange(fitter.channels + 1)
        self.reset()

    def _take(self, sample: tuple[float, ...]):
        readings, force = sample[:-1], sample[-1]
        faults, self._memory.health = self._health.check(readings, self._memory.health)
        return self.feel(readings, force, faults)

    @abstractmethod
    def feel(self, readings: tuple[float, ...], force: float, found: tuple[int, ...]):
        """The estimate after one more sample; found : its gauges' faults, as `GaugeHealth.check` finds them."""

    def _fresh(self) -> TouchState:
        return TouchState(self._health.fresh, (0.0,) * (self._gauges + 1), faults=self._clean, returning=self._clean)

    def _remember(self, memory: TouchState) -> None:
        if len(memory.zeros) != self._gauges + 1:
            raise InputError(f"the state is of {len(memory.zeros) - 1} gauges, the calibration has {self._gauges}")
        self._memory = memory
        self._estimated: tuple[FilterState | None, Any] = (None, None)
        self._tangent: Tangent | None = None

    @property
    def dominant(self) -> str:
        """The largest contribution to the modulus' sigma in the last touch, in words; empty before the first one."""
        return self._fitter.dominant(self._memory.filter) if self._memory.filter else self._memory.dominant

    def _in_contact(self, y: np.ndarray, rows: np.ndarray, sample: tuple[float, ...], good: bool) -> bool:
        """Whether a finger touches; in the air the touch is forgotten, and zeros are learnt from good samples.

        y (c + 1,) : readings and force minus their zeros; rows : the readings that are in use. A light force alone does
        not end a touch, and a wrong zero of the force does not begin one: the readings must agree.
        """
        memory = self._memory
        if y[-1] >= self._low:
            memory.light = 0
        elif not len(rows) or self._is_away(y[rows], self._lowest[rows], y[-1]):
            self._lose_contact(sample, good)
            return False
        if memory.rest.samples or memory.rest.before is not None:
            # The latest samples in the air may have been the beginning of the press.
            memory.rest = Rest()
        return True

    def _is_away(self, moved: np.ndarray, least: np.ndarray, force: float) -> bool:
        """Whether a finger, whose force (minus its zero) is below the calibrated range, is in the air. Either its
        readings (minus their zeros) are below those of contact; or for a long time the force is below that of contact
        and the readings are within the possible drift of zeros."""
        memory = self._memory
        # A drifted zero of the gauges looks like a light contact for ever. A force that stays light for long says
        # otherwise.
        memory.light = 0 if force >= self._contact else memory.light + 1
        square, drift = float(moved @ moved), TOUCH_RULES.largest_drift * self._fitter.doubts.zero_microstrain
        long = memory.light > TOUCH_RULES.light_samples and force == force
        return square < float(least @ least) or (long and square < len(moved) * drift * drift)

    def _lose_contact(self, sample: tuple[float, ...], good: bool) -> None:
        """End the touch: forget what was learnt of it, and in the air learn the zeros."""
        memory = self._memory
        memory.slot = None
        if memory.filter is not None:
            memory.dominant = self.dominant
            memory.filter, memory.distrust, memory.patience = None, 0, TOUCH_RULES.patience
        if not good:
            return
        before, count = memory.rest.before, memory.rest.samples + 1
        total = memory.rest.total + np.array(sample)
        memory.rest = Rest(total, count, before)
        if count < TOUCH_RULES.rest_samples:
            return
        mean = total / count
        memory.rest = Rest(before=mean)
        if before is not None:
            # The earlier mean is learnt as zeros (g + 1,), not this one: if this one is the start of a press, it will
            # disagree, and neither is learnt.
            noise = self._zero_noise**2 / count
            apart = (mean - before) ** 2 / (2 * noise + (TOUCH_RULES.rest_share * self._zero_sigma) ** 2)
            if apart.mean() <= TOUCH_RULES.rest_limit:
                # Kalman gain of one more mean: exactly known zeros do not change by noise.
                zeros, variance = np.array(memory.zeros), self._zero_sigma**2
                zeros += (before - zeros) * variance / (variance * (memory.airborne / count + 1) + noise)
                memory.zeros = tuple(zeros.tolist())
                memory.airborne = min(memory.airborne + count, TOUCH_RULES.zero_samples)

    def _moved(self, sample: tuple[float, ...]) -> list[float]:
        """Readings and force minus their zeros; plain numbers, because arrays are slower for so few values."""
        return [value - zero for value, zero in zip(sample, self._memory.zeros, strict=True)]

    def _unknown(self) -> FilterState:
        """The filter at the beginning of a touch."""
        zeros_known = self._memory.airborne >= TOUCH_RULES.zero_samples / 2
        return self._fitter.prior(TOUCH_RULES.air_share if zeros_known else 1.0)

    def _outside(self, fit: NoiseFit) -> SoftnessStatus | None:
        """The status of a contact outside the calibrated range."""
        fitter = self._fitter
        if not fitter.low <= fit.ln_force <= fitter.high:
            return SoftnessStatus.FORCE_BELOW if fit.ln_force < fitter.low else SoftnessStatus.FORCE_ABOVE
        return SoftnessStatus.OFF_REACH if abs(fit.place_mm) > fitter.surfaces.reach else None

    def _of(self, faults: tuple[int, ...]) -> np.ndarray:
        """The channels that are used with these faults."""
        return self._all

    @abstractmethod
    def _begin(self, y: np.ndarray, faults: tuple[int, ...]):
        """The answer after the first sample (c + 1,) of a touch."""

    @abstractmethod
    def _follow(self, y: np.ndarray, faults: tuple[int, ...], posterior: FilterState, fit: NoiseFit):
        """The answer after a mean of samples of a known touch, and its fit."""

    @abstractmethod
    def _answer(self, ln_force: float, place: float, faults: tuple[int, ...]):
        """The present answer, at the force and place from noise alone."""

    def _gather(self, y: np.ndarray, faults: tuple[int, ...]):
        """The answer after one more sample. Most samples resemble the one before, and wait until their slot is full."""
        memory, rows, flushed = self._memory, self._of(faults), False
        posterior, slot = memory.filter, memory.slot
        tangent: Tangent | None = None
        steps: tuple[float, float] | None = None
        if slot and posterior:
            if not slot.fit and slot.faults == faults and (tangent := self._near(posterior, rows)):
                steps = tangent.steps(y, slot.reach, posterior.usual)
            if steps is None:
                memory.slot = None
                fit = slot.fit or self._fit_of(slot, posterior)
                self._follow(slot.total / slot.samples, slot.faults, posterior, fit)
                posterior, slot, flushed = memory.filter, None, True
        if posterior is None:
            return self._begin(y, faults)
        if slot is None and (tangent := self._near(posterior, rows)):
            steps = tangent.steps(y, tangent.reach, posterior.usual)
        if tangent is None or steps is None:
            fit = self._fitter.noise_fit(y, rows, posterior)
            odd = fit.here > posterior.usual or self._outside(fit)
            if odd or not flushed or self._fitter.channels == 1:
                return self._follow(y, faults, posterior, fit)
            # It is learnt with the next sample, so that no sample has to do the work of two.
            memory.slot = Slot(y, 1, (), faults, fit)
            return self._answer(fit.ln_force, fit.place_mm, faults)
        if slot:
            slot = slot._replace(total=slot.total + y, samples=slot.samples + 1)
        else:
            slot = Slot(y, 1, tangent.about(steps), faults)
        if slot.samples >= self._fitter.slot(posterior):
            # The rest is done with the next sample, so that neither takes too long.
            slot = slot._replace(fit=self._fit_of(slot, posterior))
        memory.slot = slot
        at, place, *_ = tangent.linear.at
        return self._answer(at + steps[0], place + steps[1], faults)

    def _fit_of(self, slot: Slot, posterior: FilterState) -> NoiseFit:
        return self._fitter.noise_fit(slot.total / slot.samples, self._of(slot.faults), posterior, slot.samples)

    def _near(self, posterior: FilterState, rows: np.ndarray) -> Tangent | None:
        """The tangent of a touch for these channels; None as long as samples are learnt one by one."""
        if self._fitter.slot(posterior) <= 1:
            return None
        tangent = self._tangent
        if tangent is None or tangent.linear is not posterior.linear or tangent.rows is not rows:
            assert posterior.linear is not None
            self._tangent = tangent = self._fitter.tangent(posterior.linear, rows)
        return tangent

    def _modulus(self) -> tuple[SoftnessEstimate, tuple[float, float]]:
        """The present modulus, and the difference of ln force and place (mm) between the filter and the fit of noise
        alone; both are computed again when the filter has changed."""
        fitter, posterior = self._fitter, self._memory.filter
        assert posterior is not None
        if posterior is self._estimated[0]:
            return self._estimated[1]
        modulus, sigma, (h, sigma_h, offset) = math.nan, math.nan, fitter.estimate(posterior)
        if float(posterior.mean[1:] @ posterior.mean[1:]) > TOUCH_RULES.largest_errors:
            status = SoftnessStatus.MISFIT
        elif not 0.0 <= h <= fitter.top:
            status = SoftnessStatus.SOFTER if h < 0 else SoftnessStatus.HARDER
        else:
            ln_modulus, slope = fitter.ln_modulus(h)
            modulus, relative = math.exp(ln_modulus), sigma_h / slope
            sigma = relative * modulus
            status = SoftnessStatus.NOT_IDENTIFIABLE if relative > IDENTIFIABLE_SIGMA else SoftnessStatus.OK
        answer = SoftnessEstimate(modulus, sigma, int(status)), offset
        self._estimated = posterior, answer
        return answer


class Softness(TouchEstimator):
    """Online estimate of the modulus; one sample is (g1, ..., gg, force_N), readings in microstrain.

    Parameters
    ----------
    calibration : of the same gauges in the same order.
    gauge_sigma : standard deviation of a gauge's noise, microstrain, > 0.
    force_sigma_N : standard deviation of the force's noise, N.
    doubts : all other uncertain quantities; the modulus' sigma contains them.
    memory_s : time constant of forgetting; inf remembers until contact is lost.
    sample_rate_Hz : sampling rate; only used with a finite memory.
    contact_force_N : with force and readings below it there is no contact, and the touch is forgotten; None takes
        `contact_N`.
    saturation : |reading| in microstrain from which a gauge is saturated.
    stuck_samples : a gauge that repeats its reading this often while another moves is stuck.

    Raises `InputError` for unusable values, and for a calibration whose S_d rises with the modulus nowhere.
    """

    answer = SoftnessEstimate

    def __init__(
        self,
        calibration: Calibration,
        *,
        gauge_sigma: float,
        force_sigma_N: float,
        doubts: Doubts | None = None,
        memory_s: float = math.inf,
        sample_rate_Hz: float = SAMPLE_RATE_HZ,
        contact_force_N: float | None = None,
        saturation: float = math.inf,
        stuck_samples: int = STUCK_SAMPLES,
    ):
        gauges = len(calibration.gauges)
        self._reading_sigma = checks.positive("gauge_sigma (microstrain)", gauge_sigma) / math.sqrt(gauges)
        self._slack = NOISE_REACH * checks.within("force_sigma_N", force_sigma_N, 0, math.inf)
        if not memory_s > 0:
            raise InputError(f"memory_s must be greater than 0, got {memory_s}")
        self._keep = math.exp(-1 / (memory_s * checks.positive("sample_rate_Hz", sample_rate_Hz)))
        stated = doubts or Doubts()
        stated = replace(stated, zero_microstrain=stated.zero_microstrain / math.sqrt(gauges))
        self._surface = SdReading(calibration)
        fitter = Fitter(self._surface, self._reading_sigma, force_sigma_N, stated, None)
        contact = contact_N(calibration) if contact_force_N is None else contact_force_N
        super().__init__(fitter, gauges, contact, saturation, stuck_samples)

    def feel(self, readings: tuple[float, ...], force: float, found: tuple[int, ...]) -> SoftnessEstimate:
        """The estimate after one more sample; found : its gauges' faults, as `GaugeHealth.check` finds them."""
        if force - force != 0.0:
            return SoftnessEstimate(status=int(SoftnessStatus.BAD_INPUT))
        *moved, force_N = self._moved((*readings, force))
        sd = math.nan if found else self._sd(moved)
        if not self._in_contact(np.array((sd, force_N)), self._all[: 0 if found else 1], (*readings, force), not found):
            return SoftnessEstimate(status=int(SoftnessStatus.NO_CONTACT))
        low, high = self._surface.force_N
        if not low - self._slack <= force_N <= high + self._slack:
            side = SoftnessStatus.FORCE_BELOW if force_N < low else SoftnessStatus.FORCE_ABOVE
            return SoftnessEstimate(status=int(side))
        if found:
            return SoftnessEstimate(status=int(SoftnessStatus.BAD_GAUGE))
        if sd > 0:
            # Noise adds to a standard deviation.
            sd -= 0.5 * (self._gauges - 2) * self._reading_sigma**2 / sd
        return self._gather(np.array((sd, force_N)), ())

    def _begin(self, y: np.ndarray, faults: tuple[int, ...]) -> SoftnessEstimate:
        posterior = completed(self._start(y, self._all, self._unknown()))[1]
        return self._follow(y, faults, posterior, self._fitter.noise_fit(y, self._all, posterior))

    def _follow(
        self, y: np.ndarray, faults: tuple[int, ...], posterior: FilterState, fit: NoiseFit
    ) -> SoftnessEstimate:
        fitter = self._fitter
        if outside := self._outside(fit):
            return SoftnessEstimate(status=int(outside))
        softest, hardest = self._surface.usable(fit.ln_force)
        if not softest <= fitter.ln_modulus(fitter.h_of_noise(posterior))[0] <= hardest:
            return SoftnessEstimate(status=int(SoftnessStatus.NOT_IDENTIFIABLE))
        self._memory.filter = fitter.learn(y, self._all, posterior, fit, keep=self._keep)[1]
        return self._answer(fit.ln_force, fit.place_mm, faults)

    def _answer(self, ln_force: float, place: float, faults: tuple[int, ...]) -> SoftnessEstimate:
        return self._modulus()[0]

    def _sd(self, moved: list[float]) -> float:
        """S_d of the readings minus their zeros, without numpy, which takes several times as long for so few values."""
        mean = sum(moved) / self._gauges
        return math.sqrt(sum([(value - mean) ** 2 for value in moved]) / self._gauges)
