"""What a row of a log costs in the pipeline of all estimators, output by output, with and without numba.

Run with `python benchmarks/pipeline.py [--calibration C.json]`: five gauges in active touch at 1 kHz, bursts of NaN
included; without a calibration there is no modulus. Blocks are of 500 rows; `ratio` is plain over numba in blocks.
"""

import argparse
import sys
from functools import partial
from pathlib import Path
from unittest import mock

import numpy as np

from papilla.calibration import Calibration
from papilla.estimators import Pipeline
from papilla.estimators.pipeline.pipeline import OPTIONAL
from papilla.estimators.tracking.compiled import numba_available
from papilla.studies.estimator_bench.competitors import GAUGES_MM
from papilla.studies.estimator_bench.scenes import scene
from papilla.studies.estimator_bench.timing import Cost, timed

TEXTURE_MICROSTRAIN, MODULUS_MPA, FORCE_N, FRICTION = 60.0, 0.3, 0.45, 0.6
NOISE = {"gauge_sigma": 20.0, "force_sigma_N": 0.002}
OUTPUTS = {
    "frequency, no velocity": (),
    "wavelength": ("velocity_mm_s",),
    "wavelength, friction": ("force_N", "velocity_mm_s", "tangential_N"),
}


def log(seconds: float, calibration: Calibration | None) -> dict[str, np.ndarray]:
    """The columns of a log, gauges (n, 5): a finger to and fro over a grating, pressing a little harder and less."""
    made = scene("act1", 1.8, seed=1, seconds=seconds, gauge_positions_mm=GAUGES_MM)
    rng, block = np.random.default_rng(0), made.block()
    force = FORCE_N + 0.01 * np.sin(2 * made.time_s)
    gauges = TEXTURE_MICROSTRAIN * block[:, :-1]
    if calibration is not None:
        gauges = gauges + calibration.predict_readings(force, MODULUS_MPA)
    for begin in rng.integers(300, len(gauges), len(gauges) // 500).tolist():
        gauges[begin : begin + 10, rng.integers(0, 5)] = np.nan
    tangential = FRICTION * force * np.tanh(made.velocity_mm_s / 2)
    noisy = force + NOISE["force_sigma_N"] * rng.standard_normal(len(force))
    columns = {"t_s": made.time_s, "gauges": gauges, "force_N": noisy}
    return columns | {"velocity_mm_s": made.velocity_mm_s, "tangential_N": tangential}


def cost(calibration: Calibration | None, names: tuple[str, ...], columns: dict) -> Cost:
    """What a row of these columns costs."""
    rows = np.column_stack([columns[name] for name in ("t_s", "gauges", *names)])
    return timed("", "", partial(Pipeline, calibration, columns=names, **NOISE), rows)


def main() -> None:
    """Time the pipelines and print a line each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--calibration", type=Path, help="of five gauges (JSON)")
    parser.add_argument("--seconds", type=float, default=4.0, help="length of the log")
    chosen = parser.parse_args()
    calibration = Calibration.load(chosen.calibration) if chosen.calibration else None
    columns = log(chosen.seconds, calibration)
    cases: list[tuple[str, Calibration | None, tuple[str, ...]]] = [(name, None, own) for name, own in OUTPUTS.items()]
    if calibration is not None:
        every = tuple(name for name in OPTIONAL if name in columns)
        cases.append(("wavelength, friction, modulus", calibration, every))
    print(f"{'microseconds':32s}{'plain: block':>14s}{'update':>8s}{'numba: block':>14s}{'update':>8s}{'ratio':>7s}")
    for name, known, names in cases:
        with mock.patch.dict(sys.modules, {"numba": None}):
            plain = cost(known, names, columns)
        line = f"{name:32s}{plain.block_us:14.1f}{plain.update_us:8.1f}"
        if numba_available():
            fast = cost(known, names, columns)
            line += f"{fast.block_us:14.1f}{fast.update_us:8.1f}{plain.block_us / fast.block_us:7.1f}"
        print(line)


if __name__ == "__main__":
    main()
