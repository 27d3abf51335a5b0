"""2007: zero crossings counted over A = 0.08 s."""

from dataclasses import astuple, dataclass

import numpy as np
from scipy.stats import binomtest

from papilla.estimators.published.roughness import ZeroCrossing, expected_error, optimal_period
from papilla.estimators.published.roughness.impulses import UpwardCrossings
from papilla.studies.reproduce.claim import Found, Series, gathered
from papilla.studies.reproduce.signals import SEEDS, SNR_DB, answers_mm, answers_to, apart, heard

SIMULATED = "synthetic gratings of 1-4 mm at 100 mm/s"
SCENE = ("the gratings, noise of the same power instead", f"white, {SNR_DB['2007']:g} dB", len(SEEDS))
MILLIMETRES = (4.0, 3.0, 2.0, 1.0)


@dataclass(frozen=True)
class Touch:
    """The natural touch for which A was chosen: peak speed in mm/s and strokes a second, of 2006 and 2007."""

    peak_mm_s: float = 100.0
    strokes_Hz: float = 1.0


ASSUMED = Touch()
PERIODS_S = np.linspace(0.02, 0.2, 361)
"""Values of A to compare."""

NEARER_TO_TWO = 1 / 3
"""Tolerance around 4 mm: within it an answer is nearer to a count of two in 0.08 s than to one or three (8.0 and 2.7
mm)."""


def run(tell, cause: bool = True) -> Found:
    """The count of zero crossings of 2007, its period A, and gratings 1 mm apart.

    The expected error of a count over A is computed for 1-4 mm in natural touch. Gratings 1 mm apart slide at constant
    speed and under strokes: are the mean answers nearest to their own millimetre? Then the grating steps from 1 to 4
    mm: when is the answer first about 4 mm, and what is its mean from there on?
    """
    tell("gratings 1 mm apart")
    values = gathered(lambda: _period(ASSUMED), lambda: _told_apart(cause), lambda: _steps(cause))
    series = tuple(
        Series(f"{one:g} mm", 1000 * PERIODS_S, expected_error(PERIODS_S, one, *astuple(ASSUMED)))
        for one in MILLIMETRES[::-1]
    )
    title = "Expected error of counting in natural touch: flat about 0.08 s, least where counting and delay balance"
    return Found(values, title, "time A that is counted over, ms", "expected error of the frequency, Hz", series)


def _period(assumed: Touch) -> dict:
    """One impulse per period; the A with the smallest expected error."""
    touch = astuple(assumed)
    time = np.arange(4000) / 1000
    crossings = UpwardCrossings(80, UpwardCrossings.PRINTED, 1000.0, 10.0)
    fired = [crossings.fire(value) for value in np.sin(2 * np.pi * 41.3 * time + 0.3).tolist()]
    best = {wavelength: optimal_period(wavelength, *touch) for wavelength in MILLIMETRES[::-1]}
    # Error of the wavelength, relative: the error of the frequency over its amplitude
    total = np.sqrt(sum((expected_error(PERIODS_S, wavelength, *touch) * wavelength) ** 2 for wavelength in best))
    cost = max(
        float(expected_error(0.08, wavelength, *touch) / expected_error(period, wavelength, *touch)) - 1
        for wavelength, period in best.items()
    )
    return {
        "a_period": sum(fired) / (41.3 * 4),
        "window": ZeroCrossing().window_samples / 1000,
        "best_A": float(PERIODS_S[int(np.argmin(total))]),
        "each": ", ".join(f"{period:.3f}" for period in best.values()),
        "cost": cost,
        "significant": float(next(k for k in range(6, 11) if binomtest(k, 10).pvalue < 0.05)),
    }


def _told_apart(cause: bool) -> dict:
    """Answers on each grating, the longest first: share of means nearest to their own millimetre."""
    values: dict = {}
    for name, scene in (("apart", "const"), ("apart_touch", "act1")):
        groups = [
            [answers_mm(ZeroCrossing(), heard(scene, one, "2007", seed, cause=cause)) for one in MILLIMETRES]
            for seed in SEEDS
        ]
        means = np.array([[one.mean() if one.size else np.nan for one in own] for own in groups])
        values[name] = float(np.mean(np.round(means) == MILLIMETRES))
        values[f"{name}_mm"] = ", ".join(f"{mean:.2f}" for mean in means.mean(axis=0)) + " mm"
        values[f"{name}_deviations"] = float(np.mean([apart(own) for own in groups]))
    return values


def _steps(cause: bool) -> dict:
    """Time in ms from a step of 1 to 4 mm until the answer is first about 4 mm, and its mean from there on."""
    first, means = [], []
    for seed in range(20):
        seen = heard("const", 1.0, "2007", seed, cause=cause, seconds=3.0, step_to_mm=4.0)
        after = np.asarray(answers_to(ZeroCrossing(), seen)[0].wavelength_mm)[2000:]
        near = np.abs(after / 4.0 - 1) <= NEARER_TO_TWO
        first.append(float(np.argmax(near)) if near.any() else np.inf)
        means.append(np.nanmean(after[int(min(first[-1], 900)) :]))
    return {
        "reached": float(np.median(first)),
        "steps": len(first),
        "at_80": float(np.mean(np.array(first) <= 80)),
        "afterwards": float(np.mean(means)),
    }


VARIED = {"best_A": _period}
