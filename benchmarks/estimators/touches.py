"""Touches of a specimen with the calibrated finger, each with one effect that no calibration contains, and the answers
of the estimators.

A touch begins in the air, presses and is partly released; readings are finite-element presses of the default design, on
the calibration's mesh unless the touch says otherwise. Noise is the same for all estimators.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from papilla.calibration import Calibration, SoftnessStatus, sweep
from papilla.core import settings
from papilla.core.errors import InputError
from papilla.core.progress import CountedStep, Progress, silent
from papilla.estimators import Doubts, GaugeSoftness, Pipeline, Softness
from papilla.fem import prepare
from papilla.model.finger import Finger
from papilla.model.specimen import STICK_WORD, THICKNESS_MM, Block
from papilla.references.bounds import modulus_bound

GIVEN = settings.parameters(__name__)
NOISE: dict[str, Any] = {"gauge_sigma": GIVEN.gauge_sigma_microstrain, "force_sigma_N": GIVEN.force_sigma_N}
AIR, TOUCHED, RATE_HZ = GIVEN.air, GIVEN.touched, GIVEN.rate_Hz
Disturbance = Callable[[np.random.Generator, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def creep(rng, readings, force, share: float):
    """Readings creep: under load they grow, by `share` at the end of a touch."""
    return readings * (1 + share * -np.expm1(-np.cumsum(force > 0) / (TOUCHED / 3)))[:, None], force


def gauge_gain(rng, readings, force, sigma: float):
    """Each gauge has its own gain."""
    return readings * (1 + sigma * rng.normal(size=readings.shape[1])), force


def zero_drift(rng, readings, force, sigma: float):
    """Each gauge has its own zero (microstrain), already in the air."""
    return readings + sigma * rng.normal(size=readings.shape[1]), force


def force_zero(rng, readings, force, offset: float):
    """The force sensor has its own zero (N), already in the air."""
    return readings, force + offset


def drawn(scale: float) -> tuple[Disturbance, ...]:
    """Random errors of all sensors, with `scale` times the standard deviations of `Doubts`; zero of the force 20 mN."""

    def crept(rng, readings, force):
        return creep(rng, readings, force, scale * Doubts.creep * rng.normal())

    def zeroed(rng, readings, force):
        return force_zero(rng, readings, force, 0.02 * rng.normal())

    gains = partial(gauge_gain, sigma=scale * Doubts.gauge_gain), partial(force_gain, sigma=scale * Doubts.force_gain)
    return crept, *gains, partial(zero_drift, sigma=scale * Doubts.zero_microstrain), zeroed


def force_gain(rng, readings, force, sigma: float):
    """The force sensor has its own gain."""
    return readings, force * (1 + sigma * rng.normal())


class Touch(NamedTuple):
    """Where a touch is (mm), the specimen's thickness in mm, friction, the number of the mesh, and what is not as
    calibrated.

    exact : readings are the calibration's own, and it and the lab are taken as exact: the bound is the noise's.
    others : touches that trials take in turn instead, each with these disturbances.
    """

    at: tuple[float, float] = (0.0, 0.0)
    thickness_mm: float = THICKNESS_MM
    variant: int = 0
    friction: float | str = STICK_WORD
    disturbances: tuple[Disturbance, ...] = ()
    exact: bool = False
    others: tuple["Touch", ...] = ()


def _touch(row: Any) -> Touch:
    """The touch of a row of the file."""
    given = dict(row)
    if "doubts" in given:
        return Touch(disturbances=drawn(given["doubts"]), others=tuple(map(_touch, GIVEN.mixed.values())))
    known: tuple[Callable, ...] = (creep, gauge_gain, zero_drift, force_gain, force_zero)
    sizes = given.pop("disturbances", {})
    acts = {own.__name__: own for own in known}
    return Touch(**given, disturbances=tuple(_sized(acts[name], size) for name, size in sizes.items()))


def _sized(act: Callable, size: float) -> Disturbance:
    return lambda rng, readings, force: act(rng, readings, force, size)


TOUCHES: Mapping[str, Touch] = MappingProxyType({name: _touch(row) for name, row in GIVEN.rows.items()})
"""Every touch by its disturbance."""


@dataclass(frozen=True)
class TouchRow:
    """One estimator on one touch over all trials, each of another modulus; errors are of ln E at the end of the touch.

    answered : share of trials that end in "ok". median, rms : of the error of these. covered : share of them within two
    sigma; false_confident : of all trials, "ok" and off by more than three sigma and 5 %. over_sigma : RMS of error
    over sigma. over_bound : RMS of error over the Cramér-Rao bound of each trial, where the readings are the
    calibration's.
    """

    touch: str
    method: str
    answered: float
    median: float
    rms: float
    covered: float
    false_confident: float
    over_sigma: float
    over_bound: float
    trials: int


def _by_pipeline(calibration: Calibration, block, doubts: Doubts) -> tuple[float, float, bool]:
    gauges = [gauge.name for gauge in calibration.gauges]
    columns, time = ("force_N", "velocity_mm_s"), np.arange(len(block)) / RATE_HZ
    pipeline = Pipeline(calibration, gauges=gauges, columns=columns, sample_rate_Hz=RATE_HZ, doubts=doubts, **NOISE)
    found = pipeline.process(np.column_stack([time, block, 0 * time]))
    modulus, sigma = np.asarray(found.modulus_MPa)[-1], np.asarray(found.modulus_sigma_MPa)[-1]
    return modulus, sigma, bool(np.isfinite(modulus))


def _by_estimator(kind, calibration: Calibration, block, doubts: Doubts) -> tuple[float, float, bool]:
    found = kind(calibration, doubts=doubts, **NOISE).process(block)
    ok = SoftnessStatus(int(found.status[-1])).sentence.startswith("ok")
    return found.modulus_MPa[-1], found.modulus_sigma_MPa[-1], ok


METHODS: Mapping[str, Callable] = MappingProxyType(
    {
        "pipeline": _by_pipeline,
        "all gauges": partial(_by_estimator, GaugeSoftness),
        "S_d alone": partial(_by_estimator, Softness),
    }
)
"""Name -> (calibration, block (n, g + 1), doubts) -> modulus and sigma in MPa at the end, and whether they may be used;
the pipeline returns no modulus that may not be used."""


def forces() -> np.ndarray:
    """(AIR + TOUCHED,) force in N: none, then up to 0.9 and back to 0.6."""
    up, down = 2 * TOUCHED // 3, TOUCHED // 3
    steps = np.append(
        np.linspace(0, GIVEN.presses - 1, up), np.linspace(GIVEN.presses - 1, GIVEN.released * GIVEN.presses, down)
    )
    return np.append(
        np.zeros(AIR), np.linspace(GIVEN.light_N, GIVEN.firm_N, GIVEN.presses)[np.round(steps).astype(int)]
    )


def taken_as_exact(calibration: Calibration) -> Calibration:
    """The calibration without any stated error, so that only noise is left."""

    def sure(readout):
        known = readout.uncertainty
        exact = replace(known, fit_rms=0.0, fit_max=0.0, scatter=0.0 * known.scatter, strain=0.0, friction=None)
        return replace(readout, uncertainty=exact)

    return replace(calibration, surface=sure(calibration.surface), gauges=tuple(map(sure, calibration.gauges)))


def bound(calibration: Calibration, modulus: float, force, by_sd: bool) -> float:
    """Cramér-Rao bound of ln E from the gauges, or S_d alone, at forces (n,), with noise alone."""
    predict, step = calibration.predict if by_sd else calibration.predict_readings, GIVEN.relative_step
    noise = (
        GIVEN.gauge_sigma_microstrain / math.sqrt(len(calibration.gauges)) if by_sd else GIVEN.gauge_sigma_microstrain
    )
    along = [
        (predict(force * (1 + df), modulus * (1 + dE)) - predict(force * (1 - df), modulus * (1 - dE))) / (2 * step)
        for df, dE in ((0.0, step), (step, 0.0))
    ]
    by_modulus, by_ln_force = (slope.reshape(len(force), -1) for slope in along)
    return modulus_bound(by_modulus, by_ln_force / force[:, None], noise, GIVEN.force_sigma_N)


def feel(
    calibration: Calibration,
    finger: Finger,
    *,
    touches=tuple(TOUCHES),
    methods=tuple(METHODS),
    seeds=range(*GIVEN.seeds),
    progress: Progress = silent,
) -> tuple[TouchRow, ...]:
    """A row for each touch and method: one trial per seed, each with another modulus of 0.05-0.72 MPa.

    calibration : of the finger. Raises what `prepare` and `press` raise, and `InputError` for fewer than two trials.
    """
    if len(seeds) < 2:
        raise InputError(f"trials must be at least 2, got {len(seeds)}")
    rows, force, drawn = [], forces()[AIR:], np.random.default_rng(seeds[0]).uniform(size=len(seeds))
    least, most = GIVEN.moduli_MPa
    moduli = least * (most / least) ** np.sort(drawn)
    for number, name in enumerate(touches):
        progress(CountedStep("softness", number, len(touches)))
        touch = TOUCHES[name]
        known = taken_as_exact(calibration) if touch.exact else calibration
        doubts = Doubts.NONE if touch.exact else Doubts()
        if touch.exact:
            readings = np.array([known.predict_readings(force, modulus) for modulus in moduli])
        else:
            kinds = touch.others or (touch,)
            readings = np.empty((len(moduli), len(force), len(calibration.gauges)))
            for place, kind in enumerate(kinds[: len(moduli)]):
                readings[place :: len(kinds)] = pressed(finger, kind, moduli[place :: len(kinds)].tolist(), force)
        blocks = [_block(touch, *trial) for trial in zip(readings, seeds, strict=True)]
        for method in methods:
            found = np.array([METHODS[method](known, block, doubts) for block in blocks], float)
            bounds = np.full(len(moduli), math.nan)
            if touch.exact:
                bounds = np.array([bound(known, modulus, force, method == "S_d alone") for modulus in moduli])
            rows.append(row_of(name, method, found, moduli, bounds))
    return tuple(rows)


def pressed(finger: Finger, touch: Touch, moduli: list[float], force: np.ndarray) -> np.ndarray:
    """(moduli, forces, g) readings in microstrain of presses, made as in a sweep.

    Large strain is known only at the apex. At another place, the readings at the apex are used, plus the change that
    this place makes in small-strain presses with full stick.
    """
    levels, which = np.unique(force, return_inverse=True)

    def table(at: tuple[float, float], **how) -> np.ndarray:
        reduced = prepare(finger, variant=touch.variant, at=at)
        found = sweep(reduced, moduli, levels.tolist(), Block(1.0, touch.thickness_mm), **how).reading
        return found.reshape(len(moduli), len(levels), -1)[:, which]

    apex, plain = (0.0, 0.0), {"friction": STICK_WORD, "large_strain": False}
    readings = table(apex, friction=touch.friction)
    return readings if touch.at == apex else readings + table(touch.at, **plain) - table(apex, **plain)


def _block(touch: Touch, readings: np.ndarray, seed: int) -> np.ndarray:
    """A block (n, g + 1) of noisy readings and forces, in the air first."""
    rng, force = np.random.default_rng(seed), forces()
    readings = np.concatenate([np.zeros((AIR, readings.shape[1])), readings])
    for disturb in touch.disturbances:
        readings, force = disturb(rng, readings, force)
    readings = readings + GIVEN.gauge_sigma_microstrain * rng.normal(size=readings.shape)
    return np.column_stack([readings, force + GIVEN.force_sigma_N * rng.normal(size=len(force))])


def row_of(touch: str, method: str, found: np.ndarray, moduli: np.ndarray, bounds: np.ndarray) -> TouchRow:
    """The statistics of trials with results (n, 3) modulus, sigma and ok, for moduli (n,) and their bounds (n,)."""
    ok = (found[:, 2] == 1) & np.isfinite(found).all(axis=1)
    error = np.abs(np.log(found[ok, 0] / moduli[ok]))
    over = error / (found[ok, 1] / found[ok, 0])
    falsely = (over > GIVEN.false_sigmas) & (error > GIVEN.wrong)
    middle, covered = (float(np.median(error)), float(np.mean(over <= 2))) if ok.any() else (math.nan, math.nan)
    return TouchRow(
        touch, method, float(ok.mean()), middle, _rms(error), covered, float(falsely.sum() / len(ok)), _rms(over),
        _rms(error / bounds[ok]), len(ok),
    )  # fmt: skip


def _rms(values: np.ndarray) -> float:
    return math.sqrt(np.mean(values**2)) if values.size else math.nan
