"""2007: zero crossings counted over A = 0.08 s."""

from dataclasses import astuple, dataclass

import numpy as np
from scipy.stats import binomtest

from papilla.core.units import MS_PER_S
from papilla_papers.claims.claim import Experiment, gathered
from papilla_papers.claims.scenes import even, scene
from papilla_papers.claims.signals import RATE_Hz, answers_to, listed, noisy_scene, on_gratings, times
from papilla_papers.methods.roughness import ZeroCrossing, expected_error, optimal_period
from papilla_papers.methods.roughness.impulses import UpwardCrossings

COUNT_SCENE = scene("counts")
COUNTED_MM: tuple[float, ...] = COUNT_SCENE.wavelengths_mm
PERIODS_S = even(COUNT_SCENE.periods_s)


@dataclass(frozen=True)
class NaturalTouch:
    """The natural touch for which A was chosen: peak speed in mm/s and strokes a second, of 2006 and 2007."""

    peak_mm_s: float
    strokes_Hz: float


NATURAL_TOUCH = NaturalTouch(**COUNT_SCENE.assumed)


def run(tell, cause: bool = True) -> dict:
    """The count of zero crossings of 2007, its period A, and gratings 1 mm apart.

    The expected error of a count over A is computed for 1-4 mm in natural touch. Gratings 1 mm apart slide at constant
    speed and under strokes: are the mean answers nearest to their own millimetre? Then the grating steps from 1 to 4
    mm: when is the answer first about 4 mm, and what is its mean from there on?
    """
    tell("gratings 1 mm apart")
    return gathered(lambda: _period(NATURAL_TOUCH), lambda: _told_apart(cause), lambda: _steps(cause))


def _period(assumed: NaturalTouch) -> dict:
    """One impulse per period; the A with the smallest expected error."""
    touch, n = astuple(assumed), COUNT_SCENE.answers
    line = np.sin(2 * np.pi * COUNT_SCENE.line_Hz * times(COUNT_SCENE.seconds) + COUNT_SCENE.phase)
    window = round(COUNT_SCENE.printed_s * RATE_Hz)
    crossings = UpwardCrossings(window, UpwardCrossings.PRINTED, float(RATE_Hz), COUNT_SCENE.cutoff_Hz)
    fired = [crossings.fire(value) for value in line.tolist()]
    best = {wavelength: optimal_period(wavelength, *touch) for wavelength in COUNTED_MM[::-1]}
    # Error of the wavelength, relative: the error of the frequency over its amplitude
    total = np.sqrt(sum((expected_error(PERIODS_S, wavelength, *touch) * wavelength) ** 2 for wavelength in best))
    errors = [expected_error(np.array([COUNT_SCENE.printed_s, period]), mm, *touch) for mm, period in best.items()]
    return {
        "a_period": sum(fired) / (COUNT_SCENE.line_Hz * COUNT_SCENE.seconds),
        "window": ZeroCrossing().window_samples / RATE_Hz,
        "best_A": float(PERIODS_S[int(np.argmin(total))]),
        "each": listed(best.values(), ".3f"),
        "cost": max(float(printed / least) - 1 for printed, least in errors),
        "significant": float(next(k for k in range(n // 2, n + 1) if binomtest(k, n).pvalue < COUNT_SCENE.level)),
    }


def _told_apart(cause: bool) -> dict:
    """Answers on each grating, the longest first: share of means nearest to their own millimetre."""
    values: dict = {}
    for name, motion in (("apart", "const"), ("apart_touch", "act1")):
        means, values[f"{name}_deviations"] = on_gratings(ZeroCrossing, COUNTED_MM, motion, "2007", cause=cause)
        values[name] = float(np.mean(np.round(means) == COUNTED_MM))
        values[f"{name}_mm"] = listed(means.mean(axis=0)) + " mm"
    return values


def _steps(cause: bool) -> dict:
    """Time in ms from a step of 1 to 4 mm until the answer is first about 4 mm, and its mean from there on."""
    step, first, means = COUNT_SCENE.step, [], []
    for seed in range(step.seeds):
        how = {"cause": cause, "seconds": step.seconds, "step_to_mm": step.to_mm}
        seen = noisy_scene("const", step.from_mm, "2007", seed, **how)
        after = np.asarray(answers_to(ZeroCrossing(), seen)[0].wavelength_mm)[step.at_sample :]
        near = np.abs(after / step.to_mm - 1) <= step.near[0] / step.near[1]
        first.append(float(np.argmax(near)) if near.any() else np.inf)
        means.append(np.nanmean(after[int(min(first[-1], step.latest_sample)) :]))
    return {
        "reached": float(np.median(first)),
        "steps": len(first),
        "at_80": float(np.mean(np.array(first) <= MS_PER_S * COUNT_SCENE.printed_s)),
        "afterwards": float(np.mean(means)),
    }


experiment = Experiment.of(run, NATURAL_TOUCH, best_A=_period)
