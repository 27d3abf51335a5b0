"""2006, section III: impulses of a model corpuscle, their density and intervals, beside a short-time spectrum."""

import numpy as np

from papilla.estimators import find_lines
from papilla.estimators.published.roughness import ImpulseDensity, ImpulseInterval, ShortTimeSpectrum
from papilla.estimators.published.roughness.impulses import Corpuscle
from papilla.studies.estimator_bench.scenes import Scene, scene
from papilla.studies.reproduce.claim import Found, Series
from papilla.studies.reproduce.signals import (
    FIVE_MM,
    QUIET_DB,
    USUAL_DB,
    answers_to,
    correlation,
    lag_ms,
    mean_error,
    overlap,
)

SIMULATED = "synthetic gratings (trapezoid through a soft skin, white noise), not the sensor's own records"


def run(tell) -> Found:
    """The impulse methods of 2006 as printed, at constant speed and under strokes, beside a 200 ms spectrum.

    The corpuscle's rules are written a second time and compared sample by sample. Gratings of 0.6-3.0 mm slide at about
    100 mm/s, and one of 1.8 mm under strokes of 1 Hz and 100 mm/s, at 20 and at 40 dB. Lag is the shift of the best
    correlation with the true frequency; levels are apart where means differ by more than the sum of deviations.
    """
    values = {**_rules(), **_grooves()}
    tell("five gratings")
    values |= _levels()
    tell("natural touch")
    values |= _touch()
    values |= _spectrum()
    seen = scene("act1", 1.8, snr_dB=QUIET_DB, seed=3, seconds=3.0)
    density, spectrum = (
        np.asarray(answers_to(kind(), seen)[0].frequency_Hz) for kind in (ImpulseDensity, ShortTimeSpectrum)
    )
    series = (
        Series("true, |v| over wavelength", seen.time_s, seen.frequency_Hz),
        Series("impulse density, as printed", seen.time_s, density),
        Series("spectrum of 200 ms, as printed", seen.time_s, np.where(spectrum < 120, spectrum, np.nan)),
    )
    title = "A grating of 1.8 mm under strokes of 1 Hz: the density follows late, the spectrum fails"
    return Found(values, title, "time, s", "frequency, Hz", series)


def _rules() -> dict:
    """The corpuscle against its rules, written once more."""
    seen = scene("const", 1.8, snr_dB=QUIET_DB, seed=5, seconds=2.0)
    readings = seen.readings[:, 0]
    slope = np.abs(np.diff(readings, prepend=np.nan))
    mean = np.array([np.nanmean(slope[max(0, row - 199) : row + 1]) if row else np.nan for row in range(len(slope))])
    above_it = slope > 1.5 * mean
    first = above_it & ~np.append(False, above_it[:-1])
    fired, mirrored = np.abs(_fired(readings)), np.abs(_fired(-readings))
    count = np.convolve(fired, np.ones(200))[: len(fired)]
    density = ImpulseDensity().process(np.column_stack([readings, seen.known_mm_s]))
    both = np.isfinite(density.frequency_Hz)
    frequency = np.asarray(density.frequency_Hz)[both]
    window = float(np.median(count[both] / (2 * frequency)))
    line = find_lines(seen.position_mm, seen.readings).lines[0].wavelength_mm
    steps = np.flatnonzero(np.diff(np.asarray(density.frequency_Hz)[both]) != 0)
    fresh = np.gcd.reduce(np.diff(steps)) if len(steps) > 2 else 0
    return {
        "rectified": float(np.mean(fired == mirrored)),
        "crossings": float(np.mean((fired > 0) == first)),
        "factor": _threshold(),
        "count_agree": float(np.mean(np.isclose(count[both], frequency * 0.4))),
        "window": window,
        "refresh": float(fresh),
        "line_mm": line,
        "line_error": 100 * abs(line / 1.8 - 1),
    }


def _fired(readings: np.ndarray) -> np.ndarray:
    """Impulses (n,) of a corpuscle, as printed, in readings (n,)."""
    return np.nan_to_num([*map(Corpuscle(200, Corpuscle.PRINTED).fire, readings.tolist())])


def _threshold() -> float:
    """The least rate, over its mean of 200 ms, at which one faster sample after a steady slope makes an impulse."""
    low, high = 1.0, 4.0
    for _ in range(40):
        step = 0.5 * (low + high)
        corpuscle = Corpuscle(200, Corpuscle.PRINTED)
        for row in range(300):
            corpuscle.fire(float(row))
        low, high = (low, step) if corpuscle.fire(299 + step) else (step, high)
    return high / ((199 + high) / 200)


def _grooves() -> dict:
    """Edges of grooves: two grooves at 60 mm/s, a pulse train of known rate, and a fast finger."""
    time = np.arange(1000) / 1000
    place = 60 * (time - 0.3)
    depth = sum((-1) ** k * np.clip((place - 1.5 * k) / 0.2, 0, 1) for k in range(4))
    entering = np.flatnonzero(_fired(depth) > 0).tolist()
    pulses = np.zeros(2000)
    pulses[::25] = 1.0
    # A step each 25 ms is one impulse each
    train = np.cumsum(pulses)
    counted = ImpulseDensity().process(np.column_stack([train, np.full(2000, 60.0)]))
    frequency = float(np.asarray(counted.frequency_Hz)[-1])
    seen = scene("const", 3.0, snr_dB=QUIET_DB, seed=4, seconds=2.0)
    fast = np.column_stack([seen.readings[:, 0], seen.known_mm_s * 350 / seen.known_mm_s.mean()])
    answer = np.asarray(ImpulseDensity().process(fast).wavelength_mm)
    # The record is of about 100 mm/s: told 350 mm/s, the same impulses mean 3.5 times the wavelength
    usual = np.asarray(answers_to(ImpulseDensity(), seen)[0].wavelength_mm)
    scaled = answer * seen.known_mm_s.mean() / 350
    both = np.isfinite(usual) & np.isfinite(scaled)
    at_350 = 3.0 * float(np.median(scaled[both] / usual[both])) if both.any() else float("nan")
    return {
        "interval": (entering[-1] - entering[0]) / 1000 if len(entering) == 2 else float("nan"),
        "frequency": frequency,
        "two_grooves": float(
            np.nanmax(ImpulseDensity().process(np.column_stack([depth, np.full(1000, 60.0)])).frequency_Hz)
        ),
        "at_350": at_350,
        "fast_share": float(np.mean(np.isfinite(answer[500:]))),
    }


def _levels() -> dict:
    """Wavelengths of the five gratings at constant speed."""
    values: dict = {}
    cases = {"levels_20": ("as_printed", USUAL_DB), "levels_40": ("as_printed", QUIET_DB)}
    cases["corrected_40"] = ("corrected", QUIET_DB)
    for name, (variant, noise) in cases.items():
        groups = []
        for wavelength in FIVE_MM:
            found, answered = answers_to(
                ImpulseDensity(variant=variant), scene("const", wavelength, snr_dB=noise, seed=2, seconds=3.0)
            )
            groups.append(np.asarray(found.wavelength_mm)[answered])
        values[name] = overlap(groups)
        values[f"{name}_mm"] = ", ".join(f"{np.mean(group):.2f}" for group in groups) + " mm"
    return values


def _touch() -> dict:
    """Strokes of 1 Hz over 1.8 mm: lag, precision fast and slow, flicker."""
    values: dict = {}
    for noise in (QUIET_DB, USUAL_DB):
        seen = scene("act1", 1.8, snr_dB=noise, seed=3)
        density, spectrum = (
            np.asarray(answers_to(kind(), seen)[0].frequency_Hz) for kind in (ImpulseDensity, ShortTimeSpectrum)
        )
        rows, dB = slice(1000, None), int(noise)
        values[f"lag_{dB}"] = lag_ms(density[rows], seen.frequency_Hz[rows], seen.sample_rate_Hz)
        follows = [correlation(one[rows], seen.frequency_Hz[rows]) for one in (density, spectrum)]
        values[f"better_{dB}"] = follows[0] - follows[1]
        if noise == QUIET_DB:
            values |= {"follows_density": follows[0], "follows_stft": follows[1]} | _fast_and_slow(seen)
    seen = scene("const", 1.8, snr_dB=QUIET_DB, seed=6)
    judged = seen.judged()
    methods = (ImpulseInterval(), ImpulseDensity(), ImpulseInterval(variant="corrected"))
    single, density, paired = (np.asarray(answers_to(one, seen)[0].frequency_Hz)[judged] for one in methods)
    step_interval, step_density = (float(np.sqrt(np.nanmean(np.diff(one) ** 2))) for one in (single, density))
    true = float(np.mean(seen.frequency_Hz))
    return values | {
        "step_interval": step_interval,
        "step_density": step_density,
        "flicker": step_interval / step_density,
        "literal": float(np.nanmean(single)) / true,
        "same_edge": float(np.nanmean(paired)) / true,
    }


def _fast_and_slow(seen: Scene) -> dict:
    """Errors of the wavelength above 0.8 and between 0.3 and 0.6 of the peak speed."""
    speed = np.abs(seen.velocity_mm_s) / np.abs(seen.velocity_mm_s).max()
    values: dict[str, float] = {}
    for name, variant in (("", "as_printed"), ("_corrected", "corrected")):
        found, answered = answers_to(ImpulseDensity(variant=variant), seen)
        off = np.asarray(found.wavelength_mm) / 1.8 - 1
        parts = {"fast": answered & (speed > 0.8), "slow": answered & (speed < 0.6)}
        values |= {f"{part}{name}": float(np.sqrt(np.mean(off[rows] ** 2))) for part, rows in parts.items()}
    return values | {"slow_over_fast": values["slow"] / values["fast"]}


def _spectrum() -> dict:
    """What a short-time spectrum as printed makes of strokes and of a drifting baseline."""
    moving, corrected = (
        mean_error(lambda kind=kind: ShortTimeSpectrum(variant=kind), "act1", (1.8,), QUIET_DB)
        for kind in ("as_printed", "corrected")
    )
    time = np.arange(3000) / 1000
    # Drift leaks into the lines beside 0 Hz, where a slow texture has its own
    slow = np.sin(2 * np.pi * 12.6 * time) + 60 * time
    block = np.column_stack([slow, np.full(time.size, 37.8)])
    first, second = (
        np.asarray(ShortTimeSpectrum(variant=kind).process(block).frequency_Hz)[1000:]
        for kind in ("as_printed", "corrected")
    )
    noise = np.column_stack([np.random.default_rng(1).standard_normal(2000), np.full(2000, 100.0)])
    hop = np.flatnonzero(np.diff(np.nan_to_num(ShortTimeSpectrum().process(noise).frequency_Hz)[250:]) != 0)
    return {
        "stft_moving": moving,
        "stft_corrected": corrected,
        "hidden": float(np.mean(first < 10)),
        "hidden_Hz": float(np.nanmedian(first)),
        "unhidden_Hz": float(np.nanmedian(second)),
        "hop": float(np.gcd.reduce(np.diff(hop))),
    }
