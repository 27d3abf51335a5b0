"""The estimators of a pipeline: each is fed with what it wants of the samples and answers some columns of each."""

import math
from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np

from papilla.calibration import Calibration, SoftnessStatus
from papilla.estimators.friction import Friction, FrictionEstimate, FrictionStatus
from papilla.estimators.health import in_words
from papilla.estimators.pipeline.clock import Tick
from papilla.estimators.published.softness import Form, PrintedSoftness
from papilla.estimators.softness import GaugeSoftness, Softness
from papilla.estimators.tracking import FusedTracker, TrackingStatus
from papilla.estimators.tracking.chirp import ChirpStatus, ChirpTracker

LOW_PASS_HZ, LOW_PASS_SHARE = 20.0, 0.2
"""Low-pass of the forces for friction, and the greatest share of the sampling rate that it may be."""
CONTRADICTED_SIGMAS = 3.0
"""By which the wavelengths over the path and between the gauges differ, where one of them is wrong."""
LATE_MS = 1.5
"""From here on a lateness that was found is told; less is its error in harsh touch."""
_BY_PHASE = 32
"""Added to the status of a wavelength where they do."""
_NONE = math.nan
_BY_SD, _STATUSES = 32, 64
"""A status, whether it is that of S_d, and the faults of all channels make one number: faults x 64 + 32 + status."""


class Row(NamedTuple):
    """One sample that is not left out: time_s, readings (g), forces in N (NaN where unknown), and its `Tick`."""

    time_s: float

    readings: tuple[float, ...]
    force_N: float
    tangential_N: float
    tick: Tick


class Part(ABC):
    """One estimator of the pipeline; `estimator` has reset and state."""

    estimator: Any
    doubted = ""
    """What makes most of the standard deviation now, as a message; empty where there is nothing to say."""

    @abstractmethod
    def advance(self, rows: list[Row]) -> list[tuple]:
        """For each row its columns, and last the status as a number."""

    @abstractmethod
    def sentence(self, status: int) -> str:
        """The status in words."""

    @property
    def state(self):
        """What the estimator remembers, to be kept or to be set again."""
        return self.estimator.state

    @state.setter
    def state(self, state) -> None:
        self.estimator.state = state

    def reset(self) -> None:
        """Forget everything."""
        self.estimator.reset()


class GaugesPart(Part):
    """modulus_MPa, modulus_sigma_MPa from every gauge and the force; its status also says which of them is wrong.

    Where the readings contradict each other (over a texture they do) S_d answers, which that moves much less.
    names : of the gauges. position_sigma_mm : contacts lie about the apex with this standard deviation, None at the
    apex.
    """

    def __init__(
        self, calibration: Calibration, names: tuple[str, ...], rate_Hz: float, position_sigma_mm: float | None, **noise
    ):
        self._every = GaugeSoftness(calibration, position_sigma_mm=position_sigma_mm, **noise)
        self._sd = Softness(calibration, sample_rate_Hz=rate_Hz, **noise)
        self._names = names

    @property
    def doubted(self) -> str:  # type: ignore[override]
        """What makes most of the modulus' standard deviation, of the last touch."""
        what = self._every.dominant or self._sd.dominant
        return f"modulus: most of its standard deviation is {what}" if what else ""

    @property
    def state(self):
        """The states of both estimators."""
        return self._every.state, self._sd.state

    @state.setter
    def state(self, state) -> None:
        self._every.state, self._sd.state = state

    def reset(self) -> None:
        """Forget everything."""
        self._every.reset()
        self._sd.reset()

    def advance(self, rows):
        """For each row its columns, and last the status as a number."""
        return [self._both((*row.readings, row.force_N)) for row in rows]

    def _both(self, sample: tuple[float, ...]) -> tuple:
        modulus, sigma, status = self._sd.update(sample)
        found = self._every.update(sample)
        if status == SoftnessStatus.NO_CONTACT and found.modulus_MPa != found.modulus_MPa:
            return modulus, sigma, status
        if found.status == SoftnessStatus.MISFIT:
            return modulus, sigma, status + _BY_SD
        return found.modulus_MPa, found.modulus_sigma_MPa, found.status + _STATUSES * found.left_out

    def sentence(self, status):
        """The status in words."""
        bad, code = divmod(status, _STATUSES)
        text = SoftnessStatus(code % _BY_SD).sentence
        if code >= _BY_SD:
            return "from S_d, because the gauges contradict each other" + (f": {text}" if text != "ok" else "")
        faults = in_words(bad, self._names)
        return f"{text}, {faults}" if faults else text


class SdPart(Part):
    """modulus_MPa, modulus_sigma_MPa from S_d and the force: for calibrations without usable gauges."""

    def __init__(self, calibration: Calibration, rate_Hz: float, **options):
        self.estimator = Softness(calibration, sample_rate_Hz=rate_Hz, **options)

    def advance(self, rows):
        """For each row its columns, and last the status as a number."""
        return _run(self.estimator, [(*row.readings, row.force_N) for row in rows])

    def sentence(self, status):
        """The status in words."""
        return SoftnessStatus(status).sentence


class PrintedPart(SdPart):
    """modulus_MPa, modulus_sigma_MPa of each sample by a published form, for who wants it: it does not fit."""

    doubted = "modulus: by the published form, which presses of a finger do not follow; its misfit is in sigma"

    def __init__(self, calibration: Calibration, form: Form, **options):
        self.estimator = PrintedSoftness(calibration, form=form, **options)


class WavelengthPart(Part):
    """frequency_Hz, wavelength_mm, wavelength_sigma_mm of all gauges, over the path and the time of the clock.

    gauges : their number, or their places along the movement in mm: the phases between them know no velocity, and a
    status says where they tell another wavelength.
    """

    def __init__(self, gauges, **options):
        self.estimator, self._stated = FusedTracker(gauges, **options), options.get("latency_s")

    @property
    def doubted(self) -> str:  # type: ignore[override]
        """How late velocity or position were found to be, where nobody said so."""
        late = 1e3 * self.estimator.latency_s
        if self._stated is not None or abs(late) < LATE_MS:
            return ""
        return (
            f"wavelength: velocity or position were found to be {late:.1f} ms behind the readings, which is allowed for"
        )

    def advance(self, rows):
        """For each row its columns, and last the status as a number."""
        answers = []
        for row in rows:
            tick = row.tick
            found = self.estimator.follow(row.time_s, tick.place_mm, tick.velocity_mm_s, row.readings)
            spread = math.hypot(found.wavelength_sigma_mm, found.wavelength_by_phase_sigma_mm)
            other = abs(found.wavelength_by_phase_mm - found.wavelength_mm) > CONTRADICTED_SIGMAS * spread
            status = found.status + _BY_PHASE * other
            answers.append((found.frequency_Hz, found.wavelength_mm, found.wavelength_sigma_mm, status))
        return answers

    def sentence(self, status):
        """The status in words."""
        text = TrackingStatus(status % _BY_PHASE).sentence
        remark = "the phases between the gauges tell another wavelength: the velocity may be wrong"
        return f"{text}, but {remark}" if status >= _BY_PHASE else text


class BlindPart(Part):
    """frequency_Hz without a velocity: the median over the gauges that their chirp trackers follow, `lag_s` ago."""

    def __init__(self, gauges: int, rate_Hz: float):
        self._trackers = [ChirpTracker(sample_rate_Hz=rate_Hz) for _ in range(gauges)]
        self.lag_s = self._trackers[0].lag_s

    @property
    def state(self):
        """The states of the gauges' trackers, to be kept or to be set again."""
        return tuple(tracker.state for tracker in self._trackers)

    @state.setter
    def state(self, state) -> None:
        for tracker, own in zip(self._trackers, state, strict=True):
            tracker.state = own

    def reset(self) -> None:
        """Forget everything."""
        for tracker in self._trackers:
            tracker.reset()

    def advance(self, rows):
        """For each row its columns, and last the status as a number."""
        even, places = _evenly(rows, lambda row: row.readings, (_NONE,) * len(self._trackers))
        gauges = [_run(one, [(row[number],) for row in even]) for number, one in enumerate(self._trackers)]
        return [_median([(gauge[place][0], gauge[place][-1]) for gauge in gauges]) for place in places]

    def sentence(self, status):
        """The status in words."""
        return ChirpStatus(status).sentence


class FrictionPart(Part):
    """mu_kinetic, mu_static; last : the whole answer to the last sample."""

    def __init__(self, rate_Hz: float, low_pass_Hz: float, memory_mm: float):
        self.estimator = Friction(sample_rate_Hz=rate_Hz, low_pass_Hz=low_pass_Hz, memory_mm=memory_mm)
        self.last: FrictionEstimate | None = None

    def advance(self, rows):
        """For each row its columns, and last the status as a number."""
        answers = _run(self.estimator, [(row.tangential_N, row.force_N, row.tick.slope_mm_s) for row in rows])
        self.last = FrictionEstimate(*answers[-1])
        return [(answer[0], answer[1], answer[-1]) for answer in answers]

    def sentence(self, status):
        """The status in words."""
        return FrictionStatus(status).sentence


def _run(estimator, rows: list[tuple]) -> list[tuple]:
    """The estimator's answers to the rows."""
    if len(rows) == 1:
        return [estimator.update(rows[0])]
    return list(zip(*(column.tolist() for column in estimator.process(np.array(rows))), strict=True))


def _evenly(rows: list[Row], values, lost: tuple) -> tuple[list[tuple], list[int]]:
    """Values of the rows with the missing samples between them, and where the rows are in that list."""
    even: list[tuple] = []
    places = []
    for row in rows:
        own = values(row)
        even += [(*lost, *own[len(lost) :])] * row.tick.missing
        places.append(len(even))
        even.append(own)
    return even, places


def _median(answers: list[tuple[float, int]]) -> tuple[float, int]:
    """Median of the frequencies with the best status of (frequency, status), and that status."""
    status = min((own for frequency, own in answers if frequency == frequency), default=None)
    if status is None:
        return _NONE, min(own for _, own in answers)
    known = sorted(frequency for frequency, own in answers if own == status and frequency == frequency)
    middle = len(known) // 2
    return known[middle] if len(known) % 2 else 0.5 * (known[middle - 1] + known[middle]), status
