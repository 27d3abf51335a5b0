"""2007: zero crossings counted over A = 0.08 s."""

import numpy as np

from papilla.estimators.published.roughness import ZeroCrossing, expected_error, optimal_period
from papilla.estimators.published.roughness.impulses import UpwardCrossings
from papilla.studies.estimator_bench.scenes import scene
from papilla.studies.reproduce.claim import TRUE, Claim, Experiment, Found, Series, near
from papilla.studies.reproduce.signals import USUAL_DB, overlap, told

COUNT = "estimators.ZeroCrossing().process(block)"
SYNTHETIC = "synthetic gratings of 1-4 mm at 100 mm/s, white noise at 20 dB"
MILLIMETRES = (4.0, 3.0, 2.0, 1.0)
TOUCH = (100.0, 1.0)
"""Peak speed in mm/s and frequency in Hz of the natural touch of 2006 and 2007."""

CLAIMS = (
    Claim("B3", "2007 3.1", "One impulse a period, where the high-passed signal goes through zero upward", 1.0,
          near(1.0, percent=1), "impulses a period", "a_period", "published.roughness.impulses.UpwardCrossings",
          "order and corner of the high-pass are not printed: first order, 10 Hz, is assumed"),
    Claim("B4", "2007 3.1", "Impulses of the last A = 0.08 s over A are the frequency; wavelength = |v| / f", 0.08,
          near(0.08, by=1e-9), "s", "window", COUNT),
    Claim("B5", "2007 3.1", "A = 0.08 s makes the expected error smallest", 0.08, near(0.08, percent=20), "s",
          "best_A", "published.roughness.optimal_period(wavelength_mm, 100, 1)", "the paper prints no formula; ours, "
          "of a signed count over 1-4 mm in 100 sin 2 pi t mm/s, is least at {best_A:.3f} s for the relative error "
          "of all four wavelengths, at {each} s for 1, 2, 3, 4 mm; 0.08 s costs at most {cost:.1%} more than the "
          "best A of each"),
    Claim("B6", "2007 3.1", "Wavelengths 1 mm apart are told apart", "1 mm", TRUE, "share of neighbours apart",
          "apart", COUNT, "constant speed: {means}; under 1 Hz strokes {apart_touch:.0%} of neighbours; {SYNTHETIC}"),
    Claim("B7", "2007 fig. 5", "From 1 mm to 4 mm the count has settled within 0.08 s", 80.0, (0.0, 90.0), "ms",
          "settled", COUNT, "median of {steps} steps until within 25 %: a window of two counts roams about 4 mm "
          "({at_80:.0%} of steps are within 25 % after 0.08 s); {SYNTHETIC}"),
)  # fmt: skip


def run(tell) -> Found:
    """The count of 2007 on synthetic gratings."""
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
        "SYNTHETIC": SYNTHETIC,
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
        found, answered = told(ZeroCrossing(), scene(name, wavelength, snr_dB=USUAL_DB, seed=8))
        groups.append(np.asarray(found.wavelength_mm)[answered])
    return groups


def _settling_ms(seed: int) -> float:
    """Time after a step from 1 to 4 mm from which on the answer stays within 25 % for 0.08 s; inf if never."""
    seen = scene("const", 1.0, snr_dB=USUAL_DB, seed=seed, seconds=3.0, step_to_mm=4.0)
    off = np.abs(np.asarray(told(ZeroCrossing(), seen)[0].wavelength_mm)[2000:] / 4.0 - 1) <= 0.25
    stays = np.convolve(off, np.ones(80), "valid") == 80
    return float(np.argmax(stays)) if stays.any() else float("inf")


EXPERIMENT = Experiment(
    "counts", "The count of zero crossings of 2007, its period A, and gratings 1 mm apart", CLAIMS, run, SYNTHETIC
)
