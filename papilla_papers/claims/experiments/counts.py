"""2007: zero crossings counted over A = 0.08 s."""

from dataclasses import astuple, dataclass

import numpy as np
from scipy.stats import binomtest

from papilla.core.units import MS_PER_S
from papilla_papers.claims.claim import gathered
from papilla_papers.claims.scenes import even, scene
from papilla_papers.claims.signals import SEEDS, RATE_Hz, answers_mm, answers_to, apart, listed, noisy_scene, times
from papilla_papers.methods.roughness import ZeroCrossing, expected_error, optimal_period
from papilla_papers.methods.roughness.impulses import UpwardCrossings

SCENE = scene("counts")
MILLIMETRES: tuple[float, ...] = SCENE.wavelengths_mm
PERIODS_S = even(SCENE.periods_s)


@dataclass(frozen=True)
class Touch:
    """The natural touch for which A was chosen: peak speed in mm/s and strokes a second, of 2006 and 2007."""

    peak_mm_s: float
    strokes_Hz: float


ASSUMED = Touch(**SCENE.assumed)


def run(tell, cause: bool = True) -> dict:
    """The count of zero crossings of 2007, its period A, and gratings 1 mm apart.

    The expected error of a count over A is computed for 1-4 mm in natural touch. Gratings 1 mm apart slide at constant
    speed and under strokes: are the mean answers nearest to their own millimetre? Then the grating steps from 1 to 4
    mm: when is the answer first about 4 mm, and what is its mean from there on?
    """
    tell("gratings 1 mm apart")
    return gathered(lambda: _period(ASSUMED), lambda: _told_apart(cause), lambda: _steps(cause))


def _period(assumed: Touch) -> dict:
    """One impulse per period; the A with the smallest expected error."""
    touch, n = astuple(assumed), SCENE.answers
    line = np.sin(2 * np.pi * SCENE.line_Hz * times(SCENE.seconds) + SCENE.phase)
    window = round(SCENE.printed_s * RATE_Hz)
    crossings = UpwardCrossings(window, UpwardCrossings.PRINTED, float(RATE_Hz), SCENE.cutoff_Hz)
    fired = [crossings.fire(value) for value in line.tolist()]
    best = {wavelength: optimal_period(wavelength, *touch) for wavelength in MILLIMETRES[::-1]}
    # Error of the wavelength, relative: the error of the frequency over its amplitude
    total = np.sqrt(sum((expected_error(PERIODS_S, wavelength, *touch) * wavelength) ** 2 for wavelength in best))
    cost = max(
        float(expected_error(SCENE.printed_s, wavelength, *touch) / expected_error(period, wavelength, *touch)) - 1
        for wavelength, period in best.items()
    )
    return {
        "a_period": sum(fired) / (SCENE.line_Hz * SCENE.seconds),
        "window": ZeroCrossing().window_samples / RATE_Hz,
        "best_A": float(PERIODS_S[int(np.argmin(total))]),
        "each": listed(best.values(), ".3f"),
        "cost": cost,
        "significant": float(next(k for k in range(n // 2, n + 1) if binomtest(k, n).pvalue < SCENE.level)),
    }


def _told_apart(cause: bool) -> dict:
    """Answers on each grating, the longest first: share of means nearest to their own millimetre."""
    values: dict = {}
    for name, kind in (("apart", "const"), ("apart_touch", "act1")):
        groups = [
            [answers_mm(ZeroCrossing(), noisy_scene(kind, one, "2007", seed, cause=cause)) for one in MILLIMETRES]
            for seed in SEEDS
        ]
        means = np.array([[one.mean() if one.size else np.nan for one in own] for own in groups])
        values[name] = float(np.mean(np.round(means) == MILLIMETRES))
        values[f"{name}_mm"] = listed(means.mean(axis=0)) + " mm"
        values[f"{name}_deviations"] = float(np.mean([apart(own) for own in groups]))
    return values


def _steps(cause: bool) -> dict:
    """Time in ms from a step of 1 to 4 mm until the answer is first about 4 mm, and its mean from there on."""
    own, first, means = SCENE.step, [], []
    for seed in range(own.seeds):
        seen = noisy_scene("const", own.from_mm, "2007", seed, cause=cause, seconds=own.seconds, step_to_mm=own.to_mm)
        after = np.asarray(answers_to(ZeroCrossing(), seen)[0].wavelength_mm)[own.at_sample :]
        near = np.abs(after / own.to_mm - 1) <= own.near[0] / own.near[1]
        first.append(float(np.argmax(near)) if near.any() else np.inf)
        means.append(np.nanmean(after[int(min(first[-1], own.latest_sample)) :]))
    return {
        "reached": float(np.median(first)),
        "steps": len(first),
        "at_80": float(np.mean(np.array(first) <= MS_PER_S * SCENE.printed_s)),
        "afterwards": float(np.mean(means)),
    }


VARIED = {"best_A": _period}
