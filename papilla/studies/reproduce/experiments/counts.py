"""2007: zero crossings counted over A = 0.08 s."""

import numpy as np

from papilla.estimators.published.roughness import ZeroCrossing, expected_error, optimal_period
from papilla.estimators.published.roughness.impulses import UpwardCrossings
from papilla.studies.estimator_bench.scenes import scene
from papilla.studies.reproduce.claim import Found, Series
from papilla.studies.reproduce.signals import USUAL_DB, answers_to, overlap

SIMULATED = "synthetic gratings of 1-4 mm at 100 mm/s, white noise at 20 dB"
MILLIMETRES = (4.0, 3.0, 2.0, 1.0)
TOUCH = (100.0, 1.0)
"""Peak speed in mm/s and frequency in Hz of the natural touch of 2006 and 2007."""


def run(tell) -> Found:
    """The count of zero crossings of 2007, its period A, and gratings 1 mm apart.

    The expected error of a count over A is computed for 1-4 mm in natural touch. Gratings 1 mm apart slide at constant
    speed and under strokes, and 20 scenes step from 1 to 4 mm: settled is when the answer stays within 25 % for 80 ms.
    """
    time = np.arange(4000) / 1000
    crossings = UpwardCrossings(80, UpwardCrossings.PRINTED, 1000.0, 10.0)
    fired = [crossings.fire(value) for value in np.sin(2 * np.pi * 41.3 * time + 0.3).tolist()]
    best = {wavelength: optimal_period(wavelength, *TOUCH) for wavelength in MILLIMETRES[::-1]}
    periods = np.linspace(0.02, 0.2, 361)
    # Of the wavelength, as a share of it: the error of the frequency over its amplitude
    total = np.sqrt(sum((expected_error(periods, wavelength, *TOUCH) * wavelength) ** 2 for wavelength in best))
    cost = max(
        float(expected_error(0.08, wavelength, *TOUCH) / expected_error(period, wavelength, *TOUCH)) - 1
        for wavelength, period in best.items()
    )
    tell("gratings 1 mm apart")
    constant, moving = (_groups(name) for name in ("const", "act1"))
    tell("steps from 1 to 4 mm")
    settled = np.array([_settling_ms(seed) for seed in range(20)])
    values = {
        "a_period": sum(fired) / (41.3 * 4),
        "window": ZeroCrossing().window_samples / 1000,
        "best_A": float(periods[int(np.argmin(total))]),
        "each": ", ".join(f"{period:.3f}" for period in best.values()),
        "cost": cost,
        "apart": overlap(constant),
        "apart_touch": overlap(moving),
        "means": ", ".join(f"{np.mean(group):.2f} ± {np.std(group):.2f}" for group in constant) + " mm",
        "settled": float(np.median(settled)),
        "steps": len(settled),
        "at_80": float(np.mean(settled <= 80)),
    }
    series = tuple(
        Series(f"{wavelength:g} mm", 1000 * periods, expected_error(periods, wavelength, *TOUCH)) for wavelength in best
    )
    title = "Expected error of counting in natural touch: flat about 0.08 s, least where counting and delay balance"
    return Found(values, title, "time A that is counted over, ms", "expected error of the frequency, Hz", series)


def _groups(name: str) -> list[np.ndarray]:
    """Answers (mm) on each grating, the longest first."""
    groups = []
    for wavelength in MILLIMETRES:
        found, answered = answers_to(ZeroCrossing(), scene(name, wavelength, snr_dB=USUAL_DB, seed=8))
        groups.append(np.asarray(found.wavelength_mm)[answered])
    return groups


def _settling_ms(seed: int) -> float:
    """Time after a step from 1 to 4 mm from which on the answer stays within 25 % for 0.08 s; inf if never."""
    seen = scene("const", 1.0, snr_dB=USUAL_DB, seed=seed, seconds=3.0, step_to_mm=4.0)
    off = np.abs(np.asarray(answers_to(ZeroCrossing(), seen)[0].wavelength_mm)[2000:] / 4.0 - 1) <= 0.25
    stays = np.convolve(off, np.ones(80), "valid") == 80
    return float(np.argmax(stays)) if stays.any() else float("inf")
