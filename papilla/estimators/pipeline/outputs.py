"""The outputs of a pipeline: each passes the needed values of a sample to its estimators and fills some of the
columns."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

from papilla.calibration import Calibration, SoftnessStatus
from papilla.core.errors import InputError
from papilla.core.status import Status
from papilla.core.units import MS_PER_S
from papilla.estimators.friction import Friction, FrictionEstimate, FrictionStatus
from papilla.estimators.health import in_words
from papilla.estimators.methods import SampleMethod
from papilla.estimators.pipeline.clock import Tick
from papilla.estimators.softness import GaugeSoftness, Softness
from papilla.estimators.wavelength import FusedTracker, TrackingStatus
from papilla.estimators.wavelength.chirp import ChirpStatus, ChirpTracker
from papilla.references import Prony

CONTRADICTED_SIGMAS = 3.0
"""Difference between the wavelengths over the path and between the gauges, in standard deviations of the difference,
above which one of them is wrong."""
LIVELY_S, LIVELIER_VARIANCE_RATIO = 0.1, 4.0
"""Without a velocity: time constant with which the variance of a gauge fades, and the ratio of variances at which
another gauge is followed."""
LATE_MS = 1.5
"""Smallest delay that a message mentions; smaller ones are within its error in harsh touch."""
LEAST_SD_RATIO_CHANGE = 0.02
"""Change of that ratio beyond the range from which a touch is called different: 1 to 2 % of S_d."""

CREEP_WORDS = (
    "",
    "loaded faster than the touches that the finger was identified by",
    "loaded more slowly, held longer or unloaded, unlike the touches that the finger was identified by",
)
"""How a touch crept unlike those that identified the finger, in words."""
_NONE = math.nan


class SampleRow(NamedTuple):
    """One sample that is not left out: readings (g) and their faults (see `GaugeHealth`), forces in N (NaN if unknown),
    and its `Tick`."""

    readings: tuple[float, ...]
    found: tuple[int, ...]
    force_N: float
    tangential_N: float
    tick: Tick


def _either(answer: float, second: float, unit: str) -> str:
    """The two possible values of an answer, in words; empty if one of them is infinite or too large."""
    return f" ({answer:.4g} or {second:.4g} {unit})" if max(answer, second) < 1e4 else ""


class Output(ABC):
    """One or more estimators of the pipeline, each with a `state`; statuses : enumeration of their statuses; fills :
    columns of the pipeline's answer, one after the other; remembered : attributes that belong to the state."""

    statuses: ClassVar[type[Status]]
    fills: ClassVar[tuple[str, ...]]
    remembered: ClassVar[tuple[str, ...]] = ()

    def __init__(self, *estimators):
        self._estimators = estimators

    @property
    def doubted(self) -> str:
        """A message on the largest contribution to the standard deviation; empty if there is nothing to say."""
        return ""

    @abstractmethod
    def take(self, record: SampleRow) -> tuple:
        """The columns of a sample, and last the status: a tuple, first its number, last what changes from sample to
        sample."""

    def sentence(self, status: tuple) -> str:
        """The status in words."""
        return self.statuses(status[0]).sentence + status[-1]

    def code(self, status: tuple) -> str:
        """The status as a short code, which begins with "ok" if the sentence does."""
        return self.statuses(status[0]).code

    @property
    def state(self) -> tuple:
        """The state of the estimators, to be kept or to be set again."""
        return *(estimator.state for estimator in self._estimators), *(getattr(self, name) for name in self.remembered)

    @state.setter
    def state(self, state: tuple) -> None:
        estimators = len(self._estimators)
        for estimator, saved in zip(self._estimators, state[:estimators], strict=True):
            estimator.state = saved
        for name, value in zip(self.remembered, state[estimators:], strict=True):
            setattr(self, name, value)


class CreepState(NamedTuple):
    """Time and force of the last sample, and, for each term, the part of the force (N) that has not relaxed yet."""

    time_s: float
    force_N: float
    kept: tuple[float, ...]


class Creep:
    """Creep of the silicone in a touch, compared with the touches that identified the finger.

    The equivalent force is the force that would give the same strain at once; its ratio to the force says how far the
    silicone has crept (`Prony.strained`, here a sample at a time). If this ratio leaves the range of the identifying
    touches, readings differ from the calibration, and a note says so.

    Parameters
    ----------
    relaxation : of a calibration's finger: shares, times_s, and crept, the range of that ratio in the touches that it
        was identified by. least_N : smaller forces are not judged.

    Raises `InputError` for a relaxation that is not of these numbers.
    """

    def __init__(self, relaxation: Mapping[str, Any], least_N: float):
        try:
            series = Prony(tuple(relaxation["shares"]), tuple(relaxation["times_s"]))
            low, high = map(float, relaxation["crept"])
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(
                "the calibration's finger.relaxation must have shares, times_s and crept, two numbers"
            ) from error
        self._terms, self._least = series.retardation, least_N
        self._low, self._high = low - LEAST_SD_RATIO_CHANGE, high + LEAST_SD_RATIO_CHANGE
        self.state = CreepState(math.nan, 0.0, (0.0,) * len(self._terms))

    def feel(self, time_s: float, force_N: float) -> int:
        """Take a sample. Returns 0, or the index in `CREEP_WORDS` of the difference. A sample without a force is not
        judged."""
        before = self.state
        step = time_s - before.time_s
        if force_N != force_N or step <= 0:
            return 0
        unrelaxed = (force_N,) * len(self._terms)
        if step > 0:
            # The forces kept creep away; of a force that rises linearly over the step, a part has crept already.
            rise, lost = force_N - before.force_N, [(-math.expm1(-step / tau), tau) for _, tau in self._terms]
            terms = zip(lost, before.kept, strict=True)
            unrelaxed = tuple([slow * (1 - share) + rise * tau / step * share for (share, tau), slow in terms])
        self.state = CreepState(time_s, force_N, unrelaxed)
        if force_N < self._least:
            return 0
        crept = 1.0 + sum([c * (1 - slow / force_N) for (c, _), slow in zip(self._terms, unrelaxed, strict=True)])
        return 1 if crept < self._low else 2 if crept > self._high else 0


class ModulusOutput(Output):
    """modulus_MPa, modulus_sigma_MPa from S_d and, if possible, from every gauge. The status also says which gauge is
    wrong, and whether a touch creeps differently from those that identified the finger.

    If the readings contradict each other (as over a texture), S_d answers, because it changes much less.

    names : of the gauges. Raises `InputError` for an invalid relaxation in the calibration.
    """

    statuses = SoftnessStatus
    fills = ("modulus_MPa", "modulus_sigma_MPa")

    def __init__(
        self, calibration: Calibration, names: tuple[str, ...], by_sd: Softness | SampleMethod,
        every: GaugeSoftness | None = None,
    ):  # fmt: skip
        relaxation, self._creep = calibration.finger.get("relaxation"), None
        if relaxation is not None:
            self._creep = Creep(relaxation, calibration.domain["force_N"][0])
        super().__init__(*[estimator for estimator in (by_sd, every, self._creep) if estimator is not None])
        self._sd, self._every, self._names = by_sd, every, names
        self._in_doubt = bool(calibration.doubt)

    @property
    def doubted(self) -> str:
        """A message on the largest contribution to the modulus' standard deviation, in the last touch."""
        if note := getattr(self._sd, "note", ""):
            return f"modulus: {note}"
        what = (self._every.dominant if self._every else "") or getattr(self._sd, "dominant", "")
        return f"modulus: most of its standard deviation is {what}" if what else ""

    def take(self, record):
        """The columns of a sample; last a tuple of the status, whether S_d answered because the gauges contradict each
        other, the note on creep, and the faults of all channels."""
        sample, by_sd, unlike = (record.readings, record.force_N, record.found), False, 0
        modulus, sigma, status, bad = *self._sd.feel(*sample), 0
        if self._every is not None:
            by_gauges = self._every.feel(*sample)
            if status != SoftnessStatus.NO_CONTACT or by_gauges.modulus_MPa == by_gauges.modulus_MPa:
                by_sd = by_gauges.status == SoftnessStatus.MISFIT
                if not by_sd:
                    modulus, sigma, status, bad = *by_gauges[:2], by_gauges.status, int(by_gauges.left_out)
        if self._creep is not None:
            unlike = self._creep.feel(record.tick.time_s, record.force_N) * (modulus == modulus)
        return modulus, sigma, (status, by_sd, unlike, bad)

    def sentence(self, status):
        """The status in words."""
        code, by_sd, unlike, bad = status
        text = self.statuses(code).sentence
        if by_sd:
            text = "from S_d, because the gauges contradict each other" + (f": {text}" if text != "ok" else "")
        elif bad:
            text = f"{text}, {in_words(bad, self._names)}"
        if self._in_doubt and text.startswith("ok"):
            text += ", by a calibration that is in doubt"
        return f"{text}, but {CREEP_WORDS[unlike]}" if unlike else text

    def code(self, status):
        """The status as a short code."""
        text, (_, by_sd, unlike, _) = super().code(status), status
        if by_sd:
            text = "gauges contradict" if text == "ok" else f"gauges contradict, {text}"
        if self._in_doubt and text.startswith("ok"):
            text += ", calibration in doubt"
        return f"{text}, crept" if unlike else text


class WavelengthOutput(Output):
    """frequency_Hz, wavelength_mm, wavelength_sigma_mm of all gauges, over the path and the time of the clock.

    gauges : their number, or their places along the movement in mm. The phases between gauges do not depend on the
    velocity, and a status says if they give another wavelength.
    """

    statuses = TrackingStatus
    fills = ("frequency_Hz", "wavelength_mm", "wavelength_sigma_mm")

    def __init__(self, gauges, **options):
        self.tracker, self._stated = FusedTracker(gauges, **options), options.get("latency_s")
        super().__init__(self.tracker)

    @property
    def doubted(self) -> str:
        """A message on the estimated delay of velocity or position, if it was not stated."""
        late = MS_PER_S * self.tracker.latency_s
        # At a constant speed a delay only shifts the surface, which no reading can show.
        unknown = abs(late) < 3e3 * self.tracker.latency_sigma_s
        if self._stated is not None or abs(late) < LATE_MS or unknown:
            return ""
        return f"wavelength: velocity or position found to be {late:.1f} ms behind the readings, which is corrected"

    def take(self, record):
        """The columns of a sample; last a tuple of the status, whether the phases between the gauges contradict it, and
        the two values of an ambiguous wavelength."""
        tick = record.tick
        answer = self.tracker.follow(tick.time_s, tick.place_mm, tick.velocity_mm_s, record.readings)
        # The wavelength from the phases is NaN if they give none, and then contradicts nothing.
        spread = math.hypot(answer.wavelength_sigma_mm, answer.wavelength_by_phase_sigma_mm)
        contradicted = abs(answer.wavelength_by_phase_mm - answer.wavelength_mm) > CONTRADICTED_SIGMAS * spread
        open_ = answer.status == TrackingStatus.AMBIGUOUS and not contradicted
        either = _either(round(answer.wavelength_mm, 3), round(self.tracker.other_mm, 3), "mm") if open_ else ""
        wavelength, sigma, frequency, status, *_ = answer
        return frequency, wavelength, sigma, (status, contradicted, either)

    def sentence(self, status):
        """The status in words."""
        note = ", but the phases between the gauges give another wavelength: the velocity may be wrong"
        return super().sentence(status) + note * bool(status[1])

    def code(self, status):
        """The status as a short code."""
        return super().code(status) + ", phases differ" * bool(status[1])


class FrequencyOutput(Output):
    """frequency_Hz without a velocity, `lag_s` ago, from the gauge that changes most.

    One chirp tracker follows this gauge, because one for each gauge would cost several times more. The tracker needs
    evenly spaced samples, so missing ones are passed on as missing. Another gauge is followed if it changes
    `LIVELIER_VARIANCE_RATIO` times more."""

    statuses = ChirpStatus
    fills = ("frequency_Hz",)
    remembered = ("_followed", "_moments")

    def __init__(self, gauges: int, rate_Hz: float):
        self._tracker = ChirpTracker(sample_rate_Hz=rate_Hz)
        super().__init__(self._tracker)
        self.lag_s, self._fade = self._tracker.lag_s, 1 / (LIVELY_S * rate_Hz)
        self._followed, self._moments = 0, ((_NONE, 0.0),) * gauges

    def take(self, record):
        """The columns of a sample; last a tuple of the status and the two values of an ambiguous frequency."""
        for _ in range(record.tick.missing):
            self._tracker.update((_NONE,))
        self._moments = tuple(map(self._faded, self._moments, record.readings))
        powers = [power for _, power in self._moments]
        best, followed = max(range(len(powers)), key=powers.__getitem__), self._followed
        if powers[best] > LIVELIER_VARIANCE_RATIO * powers[followed]:
            self._followed = best
            if powers[followed]:
                self._tracker.reset()
        frequency, *_, status = self._tracker.update((record.readings[self._followed],))
        either = ""
        if status == ChirpStatus.AMBIGUOUS:
            # In steps of 0.1 Hz, because a new sentence for every sample would cost more than the sample.
            either = _either(round(frequency, 1), round(self._tracker.other_Hz, 1), "Hz")
        return frequency, (status, either)

    def code(self, status):
        """The status as a short code, different from those of a wavelength."""
        return "frequency alone" + f", {super().code(status)}" * bool(status[0])

    def _faded(self, moments: tuple[float, float], reading: float) -> tuple[float, float]:
        """Fading mean and variance of a gauge after one more reading; a missing one does not change them."""
        mean, power = moments
        off = reading - mean
        if off != off:
            return mean if mean == mean else reading, power * (1 - self._fade)
        return mean + self._fade * off, power + self._fade * (off * off - power)


class FrictionOutput(Output):
    """mu_kinetic, mu_static with their sigmas; last : the whole answer to the last sample."""

    statuses = FrictionStatus
    fills = ("mu_kinetic", "mu_kinetic_sigma", "mu_static", "mu_static_sigma")
    remembered = ("last",)

    def __init__(self, rate_Hz: float, memory_mm: float | None):
        self._friction = Friction(sample_rate_Hz=rate_Hz, memory_mm=memory_mm)
        super().__init__(self._friction)
        self.last: FrictionEstimate | None = None

    def take(self, record):
        """The columns of a sample, and last the status."""
        self.last = answer = self._friction.update((record.tangential_N, record.force_N, record.tick.slope_mm_s))
        return answer.mu_kinetic, answer.mu_kinetic_sigma, answer.mu_static, answer.mu_static_sigma, (answer.status, "")
