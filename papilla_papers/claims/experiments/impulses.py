"""2006, section III: impulses of a model corpuscle (density and intervals), compared with a short-time spectrum."""

from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from papilla.core.units import MS_PER_S, PER_CENT
from papilla.estimators import find_lines
from papilla.scenes.scenes import Scene
from papilla_papers.claims import signals
from papilla_papers.claims.claim import Experiment, gathered
from papilla_papers.claims.scenes import scene
from papilla_papers.claims.signals import (
    METHOD_VARIANTS,
    SCENE_SEEDS,
    RATE_Hz,
    answers_to,
    frequencies_Hz,
    noisy_scene,
    times,
)
from papilla_papers.methods.roughness import ImpulseDensity, ImpulseInterval, ShortTimeSpectrum
from papilla_papers.methods.roughness.impulses import Corpuscle

IMPULSE_SCENE = scene("impulses")
IMPULSE_PAPER = "2006"
IMPULSE_NOISE = signals.ReadingNoise(signals.SHARED_SIGNALS.snr_dB[IMPULSE_PAPER])


def run(tell, cause: bool = True) -> dict:
    """The impulse methods of 2006 as printed, at constant speed and under strokes, compared with a 200 ms spectrum.

    The corpuscle's rules are written a second time and compared sample by sample. Gratings of 0.6-3.0 mm slide at about
    100 mm/s, and one of 1.8 mm under strokes of 1 Hz and 100 mm/s. Lag is the shift of the best correlation with the
    true frequency, and shapes are compared after each answer's own lag is taken out; levels are apart where means
    differ by more than the sum of deviations.
    """
    tell("gratings and natural touch")
    return gathered(
        _rules,
        _grooves,
        lambda: _line(cause),
        lambda: _levels(IMPULSE_NOISE, cause),
        lambda: _touch(cause),
        lambda: _spectrum(cause),
    )


def _corpuscle() -> Corpuscle:
    return Corpuscle(IMPULSE_SCENE.window_samples, Corpuscle.PRINTED)


def _rules() -> dict:
    """The corpuscle compared with its rules, implemented a second time, and the time of a sample."""
    seen = noisy_scene(
        "const", IMPULSE_SCENE.wavelength_mm, IMPULSE_PAPER, IMPULSE_SCENE.rules.seed, seconds=IMPULSE_SCENE.seconds
    )
    readings, size = seen.readings[:, 0], IMPULSE_SCENE.window_samples
    slope = np.abs(np.diff(readings, prepend=np.nan))
    mean = np.array([np.nanmean(slope[max(0, k + 1 - size) : k + 1]) if k else np.nan for k in range(len(slope))])
    above_it = slope > IMPULSE_SCENE.threshold * mean
    first = above_it & ~np.append(False, above_it[:-1])
    fired, mirrored = np.abs(impulses_of(readings)), np.abs(impulses_of(-readings))
    count = np.convolve(fired, np.ones(size))[: len(fired)]
    began = perf_counter()
    density = ImpulseDensity().process(np.column_stack([readings, seen.known_mm_s]))
    taken = perf_counter() - began
    both = np.isfinite(density.frequency_Hz)
    frequency = np.asarray(density.frequency_Hz)[both]
    return {
        "rectified": float(np.mean(fired == mirrored)),
        "crossings": float(np.mean((fired > 0) == first)),
        "factor": _threshold(),
        "count_agree": float(np.mean(np.isclose(count[both], 2 * frequency * size / RATE_Hz))),
        "window": float(np.median(count[both] / (2 * frequency))),
        "computing_ms": MS_PER_S * taken / len(readings),
    }


def _line(cause: bool) -> dict:
    """The line of the texture at constant speed; the worst of the seeds."""
    wavelengths = []
    for seed in SCENE_SEEDS:
        how = {"cause": cause, "seconds": IMPULSE_SCENE.seconds}
        seen = noisy_scene("const", IMPULSE_SCENE.wavelength_mm, IMPULSE_PAPER, seed, **how)
        lines = find_lines(seen.position_mm, seen.readings).lines
        wavelengths.append(lines[0].wavelength_mm if lines else np.inf)
    worst = max(wavelengths, key=lambda line: abs(line / IMPULSE_SCENE.wavelength_mm - 1))
    return {"line_mm": worst, "line_error": PER_CENT * abs(worst / IMPULSE_SCENE.wavelength_mm - 1)}


def impulses_of(readings: np.ndarray) -> np.ndarray:
    """Impulses (n,) of a corpuscle, as printed, in readings (n,)."""
    return np.nan_to_num([*map(_corpuscle().fire, readings.tolist())])


def _threshold() -> float:
    """Smallest rate, relative to its mean over 200 ms, at which one faster sample after a steady slope makes an
    impulse."""
    search, size = IMPULSE_SCENE.bisection, IMPULSE_SCENE.window_samples
    low, high = search.between
    for _ in range(search.halvings):
        step, corpuscle = 0.5 * (low + high), _corpuscle()
        for sample in range(search.steady_samples):
            corpuscle.fire(float(sample))
        low, high = (low, step) if corpuscle.fire(search.steady_samples - 1 + step) else (step, high)
    return high / ((size - 1 + high) / size)


def skin_over_grooves(time: np.ndarray) -> np.ndarray:
    """Depth (n,) over that of a groove, of a skin that follows the edges of two grooves."""
    plate = IMPULSE_SCENE.grooves
    place = plate.speed_mm_s * (time - plate.from_s)
    return sum((-1) ** k * np.clip((place - plate.groove_mm * k) / plate.edge_mm, 0, 1) for k in range(plate.edges))


def _grooves() -> dict:
    """Edges of grooves: two grooves at 60 mm/s, a pulse train of known rate, and a fast finger."""
    speed, train, fast = IMPULSE_SCENE.grooves.speed_mm_s, IMPULSE_SCENE.train, IMPULSE_SCENE.fast
    depth = skin_over_grooves(times(IMPULSE_SCENE.grooves.seconds))
    passed = np.column_stack([depth, np.full(depth.size, speed)])
    entering = np.flatnonzero(impulses_of(depth) > 0).tolist()
    steps = np.arange(round(train.seconds * RATE_Hz)) // train.every + 1.0
    counted = ImpulseDensity().process(np.column_stack([steps, np.full(steps.size, speed)]))
    frequency = float(np.asarray(counted.frequency_Hz)[-1])
    seen = noisy_scene("const", fast.wavelength_mm, IMPULSE_PAPER, fast.seed, seconds=IMPULSE_SCENE.seconds)
    stated = np.column_stack([seen.readings[:, 0], seen.known_mm_s * fast.speed_mm_s / seen.known_mm_s.mean()])
    answer = np.asarray(ImpulseDensity().process(stated).wavelength_mm)
    # The record is of about 100 mm/s: with 350 mm/s stated, the same impulses mean 3.5 times the wavelength
    usual = np.asarray(answers_to(ImpulseDensity(), seen)[0].wavelength_mm)
    scaled = answer * seen.known_mm_s.mean() / fast.speed_mm_s
    both = np.isfinite(usual) & np.isfinite(scaled)
    at_350 = fast.wavelength_mm * float(np.median(scaled[both] / usual[both])) if both.any() else float("nan")
    return {
        "interval": (entering[-1] - entering[0]) / RATE_Hz if len(entering) == 2 else float("nan"),
        "frequency": frequency,
        "two_grooves": float(np.nanmax(ImpulseDensity().process(passed).frequency_Hz)),
        "at_350": at_350,
        "fast_share": float(np.mean(np.isfinite(answer[fast.settled_sample :]))),
    }


def _levels(assumed: signals.ReadingNoise, cause: bool = True) -> dict:
    """Wavelengths of the five gratings at constant speed: share of neighbours apart, over the seeds."""
    values: dict = {}
    how: dict[str, Any] = {"cause": cause, "snr_dB": assumed.snr_dB}
    for name, variant in (("levels", "as_printed"), ("corrected", "corrected")):
        make = partial(ImpulseDensity, variant=variant)
        means, values[name] = signals.on_gratings(make, signals.SHARED_SIGNALS.five_mm, "const", IMPULSE_PAPER, **how)
        values[f"{name}_mm"] = signals.listed(means.mean(axis=0)) + " mm"
    return values


def _touch(cause: bool) -> dict:
    """Strokes of 1 Hz over 1.8 mm: lag, shape, precision fast and slow; flicker at constant speed."""
    lags, shapes, ratios, steps, rows = [], [], [], [], slice(IMPULSE_SCENE.touch.first_sample, None)
    for seed in SCENE_SEEDS:
        seen = noisy_scene("act1", IMPULSE_SCENE.wavelength_mm, IMPULSE_PAPER, seed, cause=cause)
        both = [frequencies_Hz(method(), seen)[rows] for method in (ImpulseDensity, ShortTimeSpectrum)]
        truth = seen.frequency_Hz[rows]
        lags.append(signals.lag_ms(both[0], truth, seen.sample_rate_Hz))
        shapes.append([signals.follows(answer, truth, seen.sample_rate_Hz) for answer in both])
        ratios.append([_fast_and_slow(seen, variant) for variant in METHOD_VARIANTS])
        steady = noisy_scene("const", IMPULSE_SCENE.wavelength_mm, IMPULSE_PAPER, seed)
        changing = ImpulseInterval() if cause else ImpulseDensity()
        methods = changing, ImpulseDensity(), ImpulseInterval(variant="corrected")
        single, density, paired = (frequencies_Hz(method, steady)[steady.judged()] for method in methods)
        rough = [float(np.sqrt(np.nanmean(np.diff(answer) ** 2))) for answer in (single, density)]
        steps.append([*rough, *(np.nanmean(answer) / np.mean(steady.frequency_Hz) for answer in (single, paired))])
    (fast, slow), corrected = np.mean(ratios, axis=0)
    interval, density, literal, same_edge = np.mean(steps, axis=0)
    return {
        "lag": float(np.median(lags)),
        "lags": f"{min(lags):.0f} to {max(lags):.0f}",
        "better": float(np.mean([first > second for first, second in shapes])),
        "follows_density": float(np.mean(shapes, axis=0)[0]),
        "follows_stft": float(np.mean(shapes, axis=0)[1]),
        "slow_over_fast": float(np.min([slow / fast for (fast, slow), _ in ratios])),
        "fast": fast,
        "slow": slow,
        "fast_corrected": corrected[0],
        "slow_corrected": corrected[1],
        "step_interval": interval,
        "step_density": density,
        "flicker": float(np.min([pair[0] / pair[1] for pair in steps])),
        "literal": literal,
        "same_edge": same_edge,
    }


def _fast_and_slow(seen: Scene, variant: str) -> tuple[float, float]:
    """Median errors of the wavelength near the peak speed, and far below it, as shares."""
    speed = np.abs(seen.velocity_mm_s) / np.abs(seen.velocity_mm_s).max()
    estimate, answered = answers_to(ImpulseDensity(variant=variant), seen)
    off = np.asarray(estimate.wavelength_mm) / IMPULSE_SCENE.wavelength_mm - 1
    fast, slow = (
        float(np.median(np.abs(off[answered & rows])))
        for rows in (speed > IMPULSE_SCENE.touch.fast, speed < IMPULSE_SCENE.touch.slow)
    )
    return fast, slow


def _spectrum(cause: bool) -> dict:
    """Results of a printed short-time spectrum for strokes and for a drifting baseline."""
    drift, hops = IMPULSE_SCENE.drift, IMPULSE_SCENE.hops
    scenes = [
        noisy_scene("act1" if cause else "const", IMPULSE_SCENE.wavelength_mm, IMPULSE_PAPER, seed)
        for seed in SCENE_SEEDS[: drift.seeds]
    ]
    moving, corrected = (signals.mean_error(partial(ShortTimeSpectrum, variant=v), scenes) for v in METHOD_VARIANTS)
    time = times(drift.seconds)
    # Drift leaks into the lines next to 0 Hz, where a slow texture has its own
    slow = np.sin(2 * np.pi * drift.line_Hz * time) + drift.rise * time * cause
    block = np.column_stack([slow, np.full(time.size, drift.speed_mm_s)])
    first, second = (
        np.asarray(ShortTimeSpectrum(variant=variant).process(block).frequency_Hz)[drift.first_sample :]
        for variant in METHOD_VARIANTS
    )
    silent = np.random.default_rng(hops.seed).standard_normal(times(hops.seconds).size)
    estimate = ShortTimeSpectrum().process(np.column_stack([silent, np.full(silent.size, hops.speed_mm_s)]))
    hop = np.flatnonzero(np.diff(np.nan_to_num(estimate.frequency_Hz)[hops.first_sample :]) != 0)
    return {
        "stft_moving": moving,
        "stft_corrected": corrected,
        "hidden": float(np.mean(first < drift.hidden_Hz)),
        "hidden_Hz": float(np.nanmedian(first)),
        "unhidden_Hz": float(np.nanmedian(second)),
        "hop": float(np.gcd.reduce(np.diff(hop))),
    }


experiment = Experiment.of(run, IMPULSE_NOISE, levels=_levels)
