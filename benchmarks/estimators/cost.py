"""Cost of a sample in the pipeline, output by output: a row of a block, and an update in a loop."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from papilla.calibration import Calibration
from papilla.core import settings
from papilla.core.units import US_PER_S
from papilla.estimators import Pipeline
from papilla.scenes.scenes import scene

GIVEN = settings.parameters(__name__)
NOISE: dict[str, Any] = {"gauge_sigma": GIVEN.gauge_sigma_microstrain, "force_sigma_N": GIVEN.force_sigma_N}
OUTPUTS = {
    "frequency, no velocity": (),
    "wavelength": ("velocity_mm_s",),
    "wavelength, friction": ("force_N", "velocity_mm_s", "tangential_N"),
}
EVERYTHING = "wavelength, friction, modulus"


@dataclass(frozen=True)
class Cost:
    """Microseconds for an output: block_us of a row of `process` (median over blocks of 500 rows), update_us,
    update_mean_us and update_p999_us of one `update` (median, mean, 99.9 % quantile).

    Each block or sample counts with the best of three runs, which excludes random delays of the machine. loop_p999_us :
    from the first run alone, as a loop on this machine would experience it.
    """

    output: str
    block_us: float
    update_us: float
    update_mean_us: float
    update_p999_us: float
    loop_p999_us: float


def costs(
    calibration: Calibration | None, seconds: float, outputs: Mapping[str, tuple[str, ...]] = OUTPUTS
) -> tuple[Cost, ...]:
    """Every output on `seconds` of a log; the modulus only with a calibration of five gauges."""
    columns = _log(seconds, calibration)
    cases: dict[str, tuple] = {name: (None, own) for name, own in outputs.items()}
    if calibration is not None:
        cases[EVERYTHING] = (calibration, OUTPUTS["wavelength, friction"])
    found = []
    for name, (known, own) in cases.items():
        rows = np.column_stack([columns[column] for column in ("t_s", "gauges", *own)])
        found.append(Cost(name, *timed(partial(Pipeline, known, columns=own, **NOISE), rows)))
    return tuple(found)


def _log(seconds: float, calibration: Calibration | None) -> dict[str, np.ndarray]:
    """The columns of a log, gauges (n, 5): a finger slides to and fro over a grating with a slightly varying force."""
    made = scene("act1", GIVEN.wavelength_mm, seed=1, seconds=seconds, gauge_positions_mm=GIVEN.gauges_mm)
    rng, force = np.random.default_rng(0), GIVEN.force_N + GIVEN.force_waver_N * np.sin(2 * made.time_s)
    gauges = GIVEN.texture_microstrain * made.readings
    if calibration is not None:
        gauges = gauges + calibration.predict_readings(force, GIVEN.modulus_MPa)
    for begin in rng.integers(GIVEN.gaps_from, len(gauges), len(gauges) // GIVEN.gap_every).tolist():
        gauges[begin : begin + GIVEN.gap, rng.integers(0, gauges.shape[1])] = np.nan
    noisy = force + NOISE["force_sigma_N"] * rng.standard_normal(len(force))
    tangential = GIVEN.friction * force * np.tanh(made.velocity_mm_s / 2)
    columns = {"t_s": made.time_s, "gauges": gauges, "force_N": noisy, "tangential_N": tangential}
    return columns | {"velocity_mm_s": made.velocity_mm_s}


def timed(make: Callable, rows: np.ndarray) -> tuple[float, ...]:
    """block_us to loop_p999_us of new estimators from `make`, on these rows."""
    make().process(rows[: GIVEN.warm_up])
    parts = [rows[start : start + GIVEN.block] for start in range(0, len(rows), GIVEN.block)]
    blocks = [np.divide(_each(make().process, parts), [len(part) for part in parts]) for _ in range(GIVEN.repeats)]
    updates = np.array([_each(make().update, rows.tolist()) for _ in range(GIVEN.repeats)])
    best = updates.min(axis=0)
    median, high = np.quantile(best, [0.5, GIVEN.slow])
    block = np.median(np.min(blocks, axis=0))
    return tuple(
        US_PER_S * float(value) for value in (block, median, best.mean(), high, np.quantile(updates[0], GIVEN.slow))
    )


def _each(call: Callable, arguments) -> list[float]:
    """Seconds of each call."""
    spent = []
    for argument in arguments:
        began = time.perf_counter()
        call(argument)
        spent.append(time.perf_counter() - began)
    return spent
