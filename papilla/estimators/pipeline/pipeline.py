"""The pipeline: one `update(sample)` runs every estimator that the columns of the sample allow."""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from copy import deepcopy
from functools import lru_cache
from operator import index, itemgetter
from typing import Any, ClassVar, NamedTuple

import numpy as np

from papilla.calibration import Calibration
from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.units import MS_PER_S, SAMPLE_RATE_HZ
from papilla.estimators import health
from papilla.estimators.friction import STATIC_HZ, FrictionEstimate
from papilla.estimators.health import FAULT_SATURATED, GaugeHealth, HealthState, numbered
from papilla.estimators.methods import SURFACES_METHOD, sample_method, softness_names
from papilla.estimators.pipeline import outputs
from papilla.estimators.pipeline.clock import BEGUN_ANEW, CLOCK_REPEATED, Clock, ClockState, ClockStatus
from papilla.estimators.softness import Doubts, GaugeSoftness, Softness
from papilla.estimators.stream import Stream
from papilla.estimators.wavelength.trackers import DEFAULT_WAVELENGTHS_MM, HAND_SCALE_SIGMA

ESTIMATED_QUANTITIES = ("modulus", "wavelength", "friction")
"""The quantities that have their own status, in the order of the columns."""
OPTIONAL_COLUMNS = ("force_N", "velocity_mm_s", "position_mm", "tangential_N")
DEFAULT_COLUMNS = ("force_N", "velocity_mm_s", "tangential_N")
POSITION_SIGMA_MM = 1.0
SLOW_HZ = 200.0
"""Sampling rate below which the steps of usual movements are nearly as long as the wavelengths of usual textures."""
WORDS_KEPT = 1024
"""Combinations of codes and faults whose words are kept, so that a sample does not put them together again."""
_NONE = math.nan


class PipelineEstimate(NamedTuple):
    """The columns of `papilla estimate`: NaN if there is no answer, and a status that says why.

    modulus_status, wavelength_status, friction_status : a short code for each quantity, which begins with "ok" if the
    value may be used; `Pipeline.legend` explains it. If only the frequency is known, wavelength_status is the code of
    the frequency. status : in words, "ok", or what is wrong with the time, the gauges and each estimator, then `no
    <output>: <why>` for each output that is switched off. Of a block, arrays (n,) and lists of n strings.
    """

    modulus_MPa: float | np.ndarray
    modulus_sigma_MPa: float | np.ndarray
    frequency_Hz: float | np.ndarray
    wavelength_mm: float | np.ndarray
    wavelength_sigma_mm: float | np.ndarray
    mu_kinetic: float | np.ndarray
    mu_kinetic_sigma: float | np.ndarray
    mu_static: float | np.ndarray
    mu_static_sigma: float | np.ndarray
    modulus_status: str | list[str]
    wavelength_status: str | list[str]
    friction_status: str | list[str]
    status: str | list[str]

    def __repr__(self) -> str:
        """One line per quantity; for a block, the last row and the number of rows."""
        rows, last = "", self
        if isinstance(self.status, list):
            if not self.status:
                return "PipelineEstimate(no rows)"
            rows = f"{len(self.status)} rows, the last: "
            columns: Any = self
            last = PipelineEstimate(*(column[-1] for column in columns))
        quantities = [
            f"modulus {last.modulus_MPa:.4g} ± {last.modulus_sigma_MPa:.2g} MPa: {last.modulus_status}",
            f"wavelength {last.wavelength_mm:.4g} ± {last.wavelength_sigma_mm:.2g} mm, {last.frequency_Hz:.4g} Hz: "
            f"{last.wavelength_status}",
            f"friction {last.mu_kinetic:.4g} kinetic, {last.mu_static:.4g} static: {last.friction_status}",
        ]
        return f"PipelineEstimate({rows}" + "\n  ".join(quantities) + ")"


_NOTHING = (_NONE,) * PipelineEstimate._fields.index("modulus_status")


class PipelineState(NamedTuple):
    """State of the clock, of the health of the gauges, and of each running estimator by its output."""

    clock: ClockState
    health: HealthState
    outputs: tuple[tuple[str, Any], ...]


class Pipeline(Stream):
    """All estimators over one stream; one sample is (t_s, g1, ..., gg, then the optional columns in their order).

    Outputs: `modulus` (calibration and force), `wavelength` with frequency (velocity or position), `frequency` alone
    (where neither is known), `friction` (tangential and normal force, velocity or position). What the columns or the
    sampling rate do not allow is switched off: `off` says why, and so does every status.

    Time: samples that arrive in packets with one common time stamp are spread evenly if their number agrees with
    `sample_rate_Hz`; otherwise a sample not later than the one before is left out. If one is more than 1.5 periods
    later, samples are missing before it, and estimators treat them as missing; after more than 1 s all is reset, as
    it is if the time goes back by more than that. A time that is not finite counts as one period after the last.
    The path is that of position_mm if it is given, otherwise the integral of the velocity.

    Parameters
    ----------
    calibration : of the same gauges in the same order; without it there is no modulus.
    gauges : number of gauges, g, or their g names, by which every status calls them (else g1, g2 ...);
        no names where there is friction alone.
    columns : which of force_N, velocity_mm_s, position_mm, tangential_N a sample has, in this order.
    sample_rate_Hz : nominal rate.
    gauge_positions_mm : places (g,) of the gauges along the movement, where they are known.
    wavelength_range_mm : (shortest, longest) wavelength that is searched for.
    scale_sigma, latency_s, resonances_Hz : of the path, see `FusedTracker`; the scale's error is in every wavelength.
    ridge_pitch_mm : of the finger's own ridges, 0 for none; the calibration's where it is None. A line that they may
        feel as a harmonic is not "ok" until the fundamental would be seen.
    gauge_sigma, force_sigma_N : noise of a gauge (microstrain) and of the force (`papilla.logs.white_noise` of a log).
    saturation : |reading| from which a gauge is saturated, and its reading is not used.
    doubts : what else of finger, sensors and specimen is not known exactly, see `papilla.estimators.Doubts`.
    friction_memory_mm : slid path that the kinetic coefficient is averaged over; None: 0.1 s of sliding.
    position_sigma_mm : standard deviation about the apex, along the finger, of where it touches; None: at the apex. A
        calibration that knows nothing of contacts beside the apex takes all to be there, and `notes` says so.
    softness : "gauges", what is best: every gauge against its calibrated surface; "sd", S_d alone; or for comparison
        another method by its name (`papilla.estimators.methods`). Of `papilla_papers` are regressions of S_d: "compact"
        or "quadratic" (the calibration's), "printed" (equation (10)) or "exact" (inverse of (9)).

    Raises `InputError` for unusable values, and for a calibration of another number of gauges.
    """

    answer: ClassVar[type] = PipelineEstimate
    texts = PipelineEstimate._fields[len(_NOTHING) :]

    def __init__(
        self,
        calibration: Calibration | None = None,
        *,
        gauges: int | Sequence[str] = 5,
        columns: tuple[str, ...] = DEFAULT_COLUMNS,
        sample_rate_Hz: float = SAMPLE_RATE_HZ,
        wavelength_range_mm: tuple[float, float] = DEFAULT_WAVELENGTHS_MM,
        gauge_sigma: float = 1.0,
        force_sigma_N: float = 1e-3,
        saturation: float = 1e12,
        position_sigma_mm: float | None = POSITION_SIGMA_MM,
        scale_sigma: float = HAND_SCALE_SIGMA,
        latency_s: float | None = None,
        resonances_Hz: tuple[float, ...] = (),
        ridge_pitch_mm: float | None = None,
        doubts: Doubts | None = None,
        friction_memory_mm: float | None = None,
        gauge_positions_mm: Sequence[float] | None = None,
        softness: str = "gauges",
    ):
        named = tuple(gauges) if isinstance(gauges, Iterable) else numbered(index(gauges))
        if not (named or isinstance(gauges, Sequence) and "tangential_N" in columns):
            raise InputError(f"gauges must be at least 1, got {gauges}")
        if len(set(named)) < len(named):
            raise InputError(f"the names of gauges must differ, got {', '.join(named)}")
        if calibration is not None and len(calibration.gauges) != len(named):
            raise InputError(f"the calibration is of {len(calibration.gauges)} gauges, the pipeline of {len(named)}")
        if unknown := [name for name in columns if name not in OPTIONAL_COLUMNS]:
            raise InputError(f"columns must be among {', '.join(OPTIONAL_COLUMNS)}, got {', '.join(map(str, unknown))}")
        if len(set(columns)) < len(columns):
            raise InputError(f"columns must differ, got {', '.join(columns)}")
        if gauge_positions_mm is not None and len(gauge_positions_mm) != len(named):
            raise InputError(f"gauge_positions_mm must be {len(named)} places, got {len(gauge_positions_mm)}")
        self._places = gauge_positions_mm
        rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
        limit = checks.positive("saturation", saturation)
        if position_sigma_mm is not None and not position_sigma_mm > 0:
            raise InputError(f"position_sigma_mm must be greater than 0, or None, got {position_sigma_mm}")
        self._gauges, self._names = len(named), named
        self.columns = ("t_s", *named, *columns)
        # The values of `OPTIONAL_COLUMNS` in a sample; a missing one points to the NaN that is appended.
        places = {name: place for place, name in enumerate(columns, 1 + len(named))}
        self._optional = itemgetter(*(places.get(name, len(self.columns)) for name in OPTIONAL_COLUMNS))
        self._clock, self._health = Clock(rate), GaugeHealth(self._gauges, limit)
        self._healthy = self._health.fresh
        self.off: dict[str, str] = {}
        self._outputs: dict[str, outputs.Output] = {}
        self._notes: list[str] = []
        noise = {"gauge_sigma": gauge_sigma, "force_sigma_N": force_sigma_N, "doubts": doubts}
        self._add_modulus(calibration, rate, position_sigma_mm, noise, softness)
        path = {"scale_sigma": scale_sigma, "latency_s": latency_s, "resonances_Hz": resonances_Hz}
        ridges_mm = calibration.ridge_pitch_mm if calibration is not None else None
        path["ridge_pitch_mm"] = ridges_mm if ridge_pitch_mm is None else ridge_pitch_mm
        self._add_wavelength(rate, wavelength_range_mm, path)
        self._add_friction(rate, friction_memory_mm)
        self._words = lru_cache(WORDS_KEPT)(self._said)
        self.legend: dict[str, dict[str, str]] = {name: {} for name in ESTIMATED_QUANTITIES}
        self._faults: Counter[tuple[int, tuple[int, ...]]] = Counter()
        # The columns that each output fills, and the output.
        starts = [PipelineEstimate._fields.index(output.fills[0]) for output in self._outputs.values()]
        filled = zip(starts, self._outputs.values(), strict=True)
        self._running = [(slice(start, start + len(output.fills)), output) for start, output in filled]
        self._codes: tuple[tuple, ...] = ()
        self._new = self.state

    def __reduce__(self) -> tuple:
        """What was said and counted so far comes along."""
        make, arguments, saved = super().__reduce__()
        return make, arguments, (saved, deepcopy(self.legend), Counter(self._faults), self._codes)

    def __setstate__(self, saved: tuple) -> None:
        self.state, self.legend, self._faults, self._codes = saved

    def __repr__(self) -> str:
        gives = ", ".join(self._outputs) or "nothing"
        off = "".join(f"\n  no {name}: {why}" for name, why in self.off.items())
        return f"Pipeline({', '.join(self.columns)}; gives {gives}{off})"

    def _add_modulus(self, calibration, rate, position_sigma_mm, noise, softness) -> None:
        if softness not in softness_names():
            raise InputError(f"softness must be one of {', '.join(softness_names())}, got {softness!r}")
        if calibration is None or "force_N" not in self.columns:
            self.off["modulus"] = "no calibration was given" if calibration is None else "no column force_N"
            return
        if calibration.doubt:
            self._notes.append(f"modulus: the calibration is in doubt: {calibration.doubt}")
        if softness not in SURFACES_METHOD:
            plain = {name: value for name, value in noise.items() if name != "doubts"}
            method = sample_method(softness, calibration, **plain)
            self._outputs["modulus"] = outputs.ModulusOutput(calibration, self._names, method)
            return
        every = None
        for place in dict.fromkeys((position_sigma_mm, None)) if softness != "sd" else ():
            try:
                every = every or GaugeSoftness(calibration, position_sigma_mm=place, **noise)
            except InputError as error:
                instead = "from S_d alone, not from each gauge" if place is None else "of touches at the apex alone"
                self._notes.append(f"modulus: {instead}: {error}")
        by_sd = Softness(calibration, sample_rate_Hz=rate, **noise)
        self._outputs["modulus"] = outputs.ModulusOutput(calibration, self._names, by_sd, every)

    def _add_wavelength(self, rate, wavelengths, path) -> None:
        if not self._gauges:
            self.off["wavelength"] = "no gauges"
            return
        path |= {"wavelength_range_mm": wavelengths, "sample_rate_Hz": rate}
        wavelength = outputs.WavelengthOutput(self._places or self._gauges, **path)
        if "velocity_mm_s" in self.columns or "position_mm" in self.columns:
            self._outputs["wavelength"] = wavelength
            note = self._notes.append
            if rate < SLOW_HZ:
                note("wavelength: one below two steps of the path is not visible at this rate and may look longer")
            if path["ridge_pitch_mm"] is None:
                note(
                    "wavelength: nobody said which ridges the finger has (ridge_pitch_mm, 0 for none): a harmonic that "
                    "they feel louder than the fundamental may pose as a shorter wavelength"
                )
            if path["scale_sigma"] > 0:
                note(
                    f"wavelength: its standard deviation holds {path['scale_sigma']:.1%} for the scale of the path "
                    "(scale_sigma), which is most of it"
                )
            return
        self.off["wavelength"] = "no column velocity_mm_s or position_mm"
        try:
            blind = outputs.FrequencyOutput(self._gauges, rate)
        except InputError as error:
            self.off["frequency"] = f"{rate:g} Hz is too slow without a velocity: {error}"
            return
        self._outputs["frequency"] = blind
        self._notes.append(f"frequency: without a velocity, that of {blind.lag_s:.3g} s before")

    def _add_friction(self, rate, memory_mm) -> None:
        lacking = [name for name in ("tangential_N", "force_N") if name not in self.columns]
        if "velocity_mm_s" not in self.columns and "position_mm" not in self.columns:
            lacking.append("velocity_mm_s or position_mm")
        if lacking:
            self.off["friction"] = f"no column {', '.join(lacking)}"
            return
        self._outputs["friction"] = outputs.FrictionOutput(rate, memory_mm)
        if rate < STATIC_HZ:
            self._notes.append(
                f"friction: no static coefficient at {rate:g} Hz: a breakaway of 15 ms is seen from {STATIC_HZ:g} Hz on"
            )

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(self._outputs)

    @property
    def lines(self) -> tuple[tuple[float, float, float], ...]:
        """(wavelength_mm, power over the background, chance) of the last search along the path, strongest first."""
        output = self._outputs.get("wavelength")
        return output.tracker.lines if isinstance(output, outputs.WavelengthOutput) else ()

    @property
    def friction(self) -> FrictionEstimate | None:
        """The last answer of friction, with its standard deviations; None if there is none yet."""
        output = self._outputs.get("friction")
        return output.last if self._codes and isinstance(output, outputs.FrictionOutput) else None

    @property
    def sentences(self) -> dict[str, str]:
        """The sentence of each output on the last sample: its status, or why it is switched off."""
        codes = zip(self._outputs.items(), self._codes, strict=False)
        return {name: output.sentence(code) for (name, output), code in codes} | self.off

    @property
    def faults(self) -> dict[str, int]:
        """Number of samples so far with each fault of the clock or of a gauge, by its sentence: `g2 missing` and the
        like."""
        totals: Counter[str] = Counter()
        for (time, gauges), count in self._faults.items():
            for text in [ClockStatus(time).sentence] * bool(time) + health.words(gauges, self._names):
                totals[text] += count
        return dict(totals.most_common())

    @property
    def notes(self) -> tuple[str, ...]:
        """Messages on what is switched off and why, and what differs from the behaviour at 1 kHz; one line each."""
        doubted = [output.doubted for output in self._outputs.values() if output.doubted]
        if packet := self._clock.state.stamps[2]:
            doubted.append(f"time: packets of samples share one time every {MS_PER_S * packet:.3g} ms: spread evenly")
        return (*(f"no {output}: {why}" for output, why in self.off.items()), *self._notes, *doubted)

    @property
    def state(self) -> PipelineState:
        """All that is remembered, to be kept or to be set again."""
        states = tuple((name, output.state) for name, output in self._outputs.items())
        return PipelineState(self._clock.state, self._healthy, states)

    @state.setter
    def state(self, state: PipelineState) -> None:
        self._remember(state)

    def _fresh(self) -> PipelineState:
        return self._new

    def _remember(self, state: PipelineState) -> None:
        if [name for name, _ in state.outputs] != list(self._outputs):
            theirs, ours = (", ".join(names) or "nothing" for names in (dict(state.outputs), self._outputs))
            raise InputError(f"the state is of a pipeline for {theirs}, this one is for {ours}")
        self._health.fits(state.health)
        self._clock.state, self._healthy, self._codes = state.clock, state.health, ()
        for name, saved in state.outputs:
            self._outputs[name].state = saved

    def _take(self, sample: tuple[float, ...]) -> PipelineEstimate:
        values = (*sample, _NONE)
        force, velocity, position, tangential = self._optional(values)
        tick = self._clock.tick(values[0], velocity, position)
        if tick.status == CLOCK_REPEATED:
            self._faults[CLOCK_REPEATED, ()] += 1
            return PipelineEstimate._make((*_NOTHING, *self._words(CLOCK_REPEATED, (), ())))
        if tick.status == BEGUN_ANEW:
            self._remember(self._new._replace(clock=self._clock.state))
        readings = values[1 : 1 + self._gauges]
        faults, self._healthy = self._health.check(readings, self._healthy)
        if faults or tick.status:
            self._faults[tick.status, faults] += 1
        if FAULT_SATURATED in faults:
            pairs = zip(faults, readings, strict=True)
            readings = tuple([_NONE if fault == FAULT_SATURATED else reading for fault, reading in pairs])
        record, columns, codes = outputs.SampleRow(readings, faults, force, tangential, tick), list(_NOTHING), []
        for place, output in self._running:
            *columns[place], code = output.take(record)
            codes.append(code)
        self._codes = tuple(codes)
        return PipelineEstimate._make((*columns, *self._words(tick.status, faults, self._codes)))

    def _said(self, time: int, gauges: tuple[int, ...], codes: tuple) -> tuple[str, ...]:
        """The code of each of `ESTIMATED_QUANTITIES`, and one sentence with the notes on time, gauges and
        estimators."""
        if time == CLOCK_REPEATED:
            left_out = ClockStatus.REPEATED
            for entries in self.legend.values():
                entries[left_out.code] = left_out.sentence
            return *(left_out.code for _ in ESTIMATED_QUANTITIES), left_out.sentence
        statuses = dict(zip(self._outputs, codes, strict=True))
        sentences = {name: self._outputs[name].sentence(code) for name, code in statuses.items()}
        live = [f"time: {ClockStatus(time).sentence}"] if time else []
        live += health.words(gauges, self._names)
        live += [f"{name}: {text}" for name, text in sentences.items() if not text.startswith("ok")]
        notes = [f"{name}: {text.removeprefix('ok, ')}" for name, text in sentences.items() if text.startswith("ok, ")]
        live = (live or ["ok"]) + notes if codes or live else ["nothing to estimate"]
        off = [f"no {output}: {why}" for output, why in self.off.items()]
        return *(self._code(name, statuses) for name in ESTIMATED_QUANTITIES), "; ".join([*live, *off])

    def _code(self, quantity: str, statuses: dict[str, Any]) -> str:
        """The code of a quantity, which is added to the legend; for one that is switched off, the reason up to the
        first comma."""
        source = "frequency" if quantity == "wavelength" and "frequency" in statuses else quantity
        why = self.off.get(quantity, "")
        if source not in statuses:
            self.legend[quantity][why.split(",")[0]] = why
            return why.split(",")[0]
        output, status = self._outputs[source], statuses[source]
        # A code is explained without what changes from sample to sample, which stands last.
        code, sentence = output.code(status), output.sentence((*status[:-1], ""))
        self.legend[quantity][code] = f"{why}; the frequency: {sentence}" if why else sentence
        return code
