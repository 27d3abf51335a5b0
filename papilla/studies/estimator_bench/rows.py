"""The lines of the comparison's tables: one estimator in one scene, after steps, with a late or wrong velocity."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from papilla.references.chirp_bound import windowed_bounds
from papilla.studies.estimator_bench.competitors import BLIND, COMPETITORS, Competitor
from papilla.studies.estimator_bench.measures import (
    OUTLIER,
    aligned_square,
    errors_of,
    falsely_locked,
    lag_ms,
    settling_ms,
)
from papilla.studies.estimator_bench.plan import Plan
from papilla.studies.estimator_bench.scenes import PASS_BAND, Scene, profile_amplitudes, scene

STEP_AT_S, AFTER_STEP_S = 1.5, 1.0
BLIND_WINDOW_S = 0.08
"""Window of the bound of those that do not know the velocity: over longer ones a stroke is no chirp any more."""
VELOCITY_SCENE = ("act1", 20.0)


@dataclass(frozen=True)
class SceneRow:
    """One estimator in one scene, over all wavelengths and seeds; errors are fractions of the wavelength.

    error, median : RMS and median of |relative error| over the judged rows, a row without an answer counting as 3.
    answered, error_answered : share of rows with an answer, and the RMS over these alone. bound, ratio : Cramér-Rao of
    the declared memory with the velocity known, or of the frequency of a chirp from the last 80 ms for those who do not
    know it and answer as late as they do; RMS over wavelengths, and error over it;
    NaN for those that declare none, in harsh touch, whose disturbances the bound does not know, and where the bound
    itself is beyond 10 % (no bound of small errors any more). outliers : share of rows beyond 10 %. false_locks : share
    of runs that settle on a wrong wavelength. sigma_ratio : RMS of error over stated sigma. lag_ms : of the frequency,
    median over the runs that follow it. aligned : RMS error when the velocity is taken that much earlier.
    """

    estimator: str
    family: str
    scene: str
    snr_dB: float
    error: float
    median: float
    answered: float
    error_answered: float
    bound: float
    ratio: float
    outliers: float
    false_locks: float
    sigma_ratio: float
    lag_ms: float
    aligned: float

    @property
    def place(self) -> str:
        """Scene and SNR in words."""
        return f"{self.scene}, {self.snr_dB:g} dB"


@dataclass(frozen=True)
class StepRow:
    """Times in ms to stay within 5 % after the wavelength steps, constant speed, 20 dB: median and 90 % quantile over
    seeds and step phases (inf: never within a second)."""

    estimator: str
    family: str
    from_mm: float
    to_mm: float
    median_ms: float
    p90_ms: float

    @property
    def place(self) -> str:
        """The step in words."""
        return f"{self.from_mm:g} to {self.to_mm:g} mm"


@dataclass(frozen=True)
class VelocityRow:
    """RMS error (a fraction) in act1 at 20 dB, the velocity being known delay_ms late and `gain` times too large."""

    estimator: str
    family: str
    delay_ms: int
    gain: float
    error: float


@lru_cache(maxsize=128)
def _scene(kind: str, wavelength: float, snr: float, seed: int, seconds: float, gauges: tuple[float, ...]) -> Scene:
    return scene(kind, wavelength, snr_dB=snr, seed=seed, seconds=seconds, gauge_positions_mm=gauges)


@lru_cache(maxsize=512)
def _bound(kind: str, wavelength: float, seed: int, seconds: float, memory: float, gauges: int) -> float:
    """The bound at 0 dB; it is proportional to the noise."""
    return _scene(kind, wavelength, 0.0, seed, seconds, (0.0,) * gauges).bound(memory)


@lru_cache(maxsize=64)
def _blind_bound(kind: str, wavelength: float, seed: int, seconds: float, lag_s: float) -> float:
    """The bound at 0 dB without the velocity: median over windows that end in judged rows."""
    made = _scene(kind, wavelength, 0.0, seed, seconds, (0.0,))
    bounds = windowed_bounds(
        made.time_s,
        2 * math.pi * made.position_mm / wavelength,
        made.frequency_Hz,
        profile_amplitudes(wavelength),
        made.noise_sd,
        ends=np.flatnonzero(made.judged())[::20],
        window_s=BLIND_WINDOW_S,
        lag_s=lag_s,
        band_Hz=PASS_BAND * made.sample_rate_Hz,
    )
    return float(np.median(bounds))


def bound_of(competitor: Competitor, kind: str, snr: float, plan: Plan) -> float:
    """RMS over wavelengths of the Cramér-Rao bound of a competitor's memory, NaN where it says nothing."""
    blind = competitor.family == BLIND
    if kind == "harsh" or (competitor.memory_s is None and not blind):
        return math.nan
    given = [(kind, wavelength, plan.seeds[0], plan.seconds) for wavelength in plan.wavelengths_mm]
    if blind:
        lag = competitor.make().lag_s
        bounds = [_blind_bound(*scene_of, lag) for scene_of in given]
    else:
        bounds = [_bound(*scene_of, competitor.memory_s, len(competitor.gauges_mm)) for scene_of in given]
    bound = 10 ** (-snr / 20) * math.sqrt(np.mean(np.square(bounds)))
    return bound if bound <= OUTLIER else math.nan


def scene_row(name: str, kind: str, snr: float, plan: Plan) -> SceneRow:
    """Run one competitor in one scene with all wavelengths and seeds of the plan."""
    competitor = COMPETITORS[name]
    absolute, answered, sigmas, locks, lags, aligned = [], [], [], [], [], []
    for wavelength in plan.wavelengths_mm:
        for seed in plan.seeds:
            made = _scene(kind, wavelength, snr, seed, plan.seconds, competitor.gauges_mm)
            answer = competitor.make().process(made.block())
            errors = errors_of(made, answer)
            absolute.append(errors.absolute)
            answered.append(errors.answered)
            sigmas.append(errors.sigma_square)
            locks.append(falsely_locked(made, answer.wavelength_mm))
            lags.append(lag_ms(made, answer.frequency_Hz))
            aligned.append(aligned_square(made, answer.frequency_Hz, lags[-1]))
    pooled = np.concatenate(absolute)
    # Scenes are equally long but not equally many of their rows are judged: each run counts the same.
    error = math.sqrt(np.mean([np.mean(run**2) for run in absolute]))
    partial = [np.mean(run[known] ** 2) for run, known in zip(absolute, answered, strict=True) if known.any()]
    bound = bound_of(competitor, kind, snr, plan)
    return SceneRow(
        estimator=name,
        family=competitor.family,
        scene=kind,
        snr_dB=snr,
        error=error,
        median=float(np.median(pooled)),
        answered=float(np.mean(np.concatenate(answered))),
        error_answered=math.sqrt(_known(np.mean, partial)),
        bound=bound,
        ratio=error / bound,
        outliers=float(np.mean(pooled > OUTLIER)),
        false_locks=float(np.mean(locks)),
        sigma_ratio=math.sqrt(_known(np.mean, sigmas)),
        lag_ms=_known(np.median, lags),
        aligned=math.sqrt(_known(np.mean, aligned)),
    )


def step_row(name: str, before: float, after: float, plan: Plan) -> StepRow:
    """Times to 5 % of one competitor after one step of the wavelength."""
    competitor = COMPETITORS[name]
    period_s = max(before, after) / 100.0
    times = []
    for seed in plan.seeds:
        for phase in range(plan.phases):
            at = STEP_AT_S + phase * period_s / plan.phases
            made = scene("const", before, seed=seed, seconds=at + AFTER_STEP_S, step_to_mm=after, step_at_s=at,
                         gauge_positions_mm=competitor.gauges_mm)  # fmt: skip
            times.append(settling_ms(made, competitor.make().process(made.block()).wavelength_mm, at))
    median, most = np.quantile(times, [0.5, 0.9], method="inverted_cdf")
    return StepRow(name, competitor.family, before, after, float(median), float(most))


def velocity_row(name: str, delay_ms: int, gain: float, plan: Plan) -> VelocityRow:
    """Error of one competitor whose velocity is late or wrong."""
    competitor = COMPETITORS[name]
    kind, snr = VELOCITY_SCENE
    squares = []
    for wavelength in plan.wavelengths_mm:
        made = _scene(kind, wavelength, snr, plan.seeds[0], plan.seconds, competitor.gauges_mm)
        answer = competitor.make().process(made.block(round(delay_ms * made.sample_rate_Hz / 1000), gain))
        squares.append(np.mean(errors_of(made, answer).absolute ** 2))
    return VelocityRow(name, competitor.family, delay_ms, gain, math.sqrt(np.mean(squares)))


def _known(middle, values) -> float:
    """Mean or median of what is a number."""
    known = [value for value in values if value == value]
    return float(middle(known)) if known else math.nan
