"""What the pipeline calls ok on signals that it was not made for: share ok, false among ok, coverage of sigma.

Run with `python benchmarks/honesty.py [--seeds 101 102] [SCENE ...]`; seeds below 100 were looked at while it was made.
False: ok and off by more than 5 %, or ok where there is no line; the share ok counts from 12 mm of path on.
"""

import argparse
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from papilla.estimators import Pipeline
from papilla.studies.estimator_bench.scenes import profile_amplitudes

RATE_HZ, NOISE, SECONDS, SLOW_SECONDS = 1000.0, 0.1, 4.0, 26.0
LATE_MS = (4, 10, 20)


@dataclass(frozen=True)
class Honesty:
    """Of the runs of a scene: share ok, false among ok, errors within 2 sigma among ok, and runs with any ok."""

    ok: float
    false: float
    coverage: float
    runs: float


def scene(name: str, wavelength: float, seed: int):
    """Time (n,), reading (n,), velocity as it is known (n,), place (n,) and the true wavelengths, () without a line."""
    rng = np.random.default_rng(1000 * seed + round(100 * wavelength))
    time = np.arange(round((SLOW_SECONDS if "slow" in name else SECONDS) * RATE_HZ)) / RATE_HZ
    velocity = 100 * np.sin(2 * np.pi * time)
    if "const" in name:
        velocity = np.full(time.size, 100 * (1 + rng.uniform(-0.1, 0.1)))
    if "slow" in name:
        velocity = np.ones(time.size)
    place = np.cumsum(velocity) / RATE_HZ + rng.uniform(0, 60)
    amplitudes = profile_amplitudes(wavelength).copy()
    if "missing" in name:
        amplitudes[0] = 0
    order = np.arange(1, len(amplitudes) + 1)
    present = np.abs(velocity[:, None]) * order / wavelength < 0.4 * RATE_HZ
    reading = np.real(np.exp(-2j * np.pi * order * place[:, None] / wavelength) * present @ amplitudes)
    truth: tuple[float, ...] = (wavelength,)
    if "rough" in name:
        surface = gaussian_filter1d(rng.normal(size=60_000), 15)
        reading = np.interp(place - place.min(), np.arange(60_000) * 0.01, surface / surface.std())
        truth = ()
    if "hum" in name:
        reading = (0 if "only" in name else reading) + 2 * np.sqrt(2) * np.sin(
            2 * np.pi * 50 * time + rng.uniform(0, 6)
        )
        truth = () if "only" in name else truth
    if "drift" in name:
        starts = np.arange(0.35, time[-1], 0.7)
        sizes = rng.uniform(1.5, 4, starts.size) * rng.choice([-1, 1], starts.size)
        reading = reading + np.clip((time[:, None] - starts) / 0.02, 0, 1) @ sizes + 3 * np.sin(2 * np.pi * 0.3 * time)
    late = next((ms for ms in LATE_MS if f"{ms} ms" in name), 0)
    known = np.concatenate([np.full(late, velocity[0]), velocity[: time.size - late]])
    known = known * (1.03 if "scale" in name else 1.0)
    return time, reading + NOISE * rng.normal(size=time.size), known, place, truth if wavelength <= 6 else ()


SCENES = (
    "const", "stroke", "const slow", "const hum", "stroke hum", "const hum only", "stroke hum only", "const rough",
    "stroke rough", "stroke drift", "stroke missing", "stroke scale", *(f"stroke {ms} ms late" for ms in LATE_MS),
)  # fmt: skip


def honesty(name: str, wavelengths, seeds) -> Honesty:
    """Run the pipeline on a scene with each wavelength (mm) and seed."""
    counts = []
    for wavelength in wavelengths:
        for seed in seeds:
            time, reading, velocity, place, truth = scene(name, wavelength, seed)
            pipeline = Pipeline(None, gauges=1, columns=("velocity_mm_s",), sample_rate_Hz=RATE_HZ)
            found = pipeline.process(np.column_stack([time, reading, velocity]))
            ok = np.array([words.startswith("ok") for words in found.wavelength_status])
            path = np.cumsum(np.abs(np.diff(place, prepend=place[0])))
            off = np.abs(found.wavelength_mm - truth[0]) if truth else np.full(ok.size, np.inf)
            wrong, inside = off > 0.05 * wavelength, off < 2 * found.wavelength_sigma_mm
            counts.append((ok[path > 12].mean(), ok.sum(), (ok & wrong).sum(), (ok & inside).sum(), ok.any()))
    share, rows, false, covered, runs = np.array(counts, float).T
    total = max(rows.sum(), 1.0)
    return Honesty(float(share.mean()), float(false.sum() / total), float(covered.sum() / total), float(runs.mean()))


def main() -> None:
    """Print a line for each scene."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", default=SCENES)
    parser.add_argument("--seeds", type=int, nargs="+", default=[101, 102])
    parser.add_argument("--wavelengths", type=float, nargs="+", default=[0.8, 1.5, 2.3])
    chosen = parser.parse_args()
    print(f"{'scene':24s}{'ok':>8s}{'false':>8s}{'2 sigma':>9s}{'runs ok':>9s}")
    for name in chosen.scenes:
        row = honesty(name, chosen.wavelengths, chosen.seeds)
        print(f"{name:24s}{row.ok:8.3f}{row.false:8.3f}{row.coverage:9.3f}{row.runs:9.2f}", flush=True)


if __name__ == "__main__":
    main()
