"""2006, section III: impulses of a model corpuscle, their density and intervals, beside a short-time spectrum."""

import numpy as np

from papilla.estimators import find_lines
from papilla.estimators.published.roughness import ImpulseDensity, ImpulseInterval, ShortTimeSpectrum
from papilla.estimators.published.roughness.impulses import Corpuscle
from papilla.studies.estimator_bench.scenes import Scene, scene
from papilla.studies.reproduce.claim import TRUE, Claim, Experiment, Found, Series, above, below, near
from papilla.studies.reproduce.signals import (
    FIVE_MM,
    QUIET_DB,
    USUAL_DB,
    correlation,
    lag_ms,
    mean_error,
    overlap,
    told,
)

DENSITY, STFT = "estimators.ImpulseDensity().process(block)", "estimators.ShortTimeSpectrum().process(block)"
SYNTHETIC = "synthetic gratings (trapezoid through a soft skin, white noise), not the sensor's own records"

CLAIMS = (
    Claim("A5", "2006 II", "At constant speed a spectrum gives the texture's frequency", "qualitative", below(0.1),
          "%", "line_error", "estimators.find_lines(position_mm, readings)",
          "wavelength found {line_mm:.5f} mm for 1.8"),
    Claim("A10", "2006 eq. (1)", "The corpuscle is driven by the size of the strain's rate of change", "formula",
          TRUE, "share of samples", "rectified", "published.roughness.impulses.Corpuscle"),
    Claim("A11", "2006 III.A", "One impulse at each upward crossing of the threshold, none while above it", "rule",
          TRUE, "share of samples", "crossings", "published.roughness.impulses.Corpuscle"),
    Claim("A12", "2006 III.A", "The threshold is 1.5 times the mean rate over 200 ms", 1.5, near(1.5, by=1e-3), "",
          "factor", "published.roughness.impulses.Corpuscle.PRINTED", "found by bisection on a single faster sample"),
    Claim("A13", "2006 eq. (2)", "Density: impulses of the last a = 0.2 s are counted", 0.2, near(0.2, by=1e-9), "s",
          "window", DENSITY, "against a second count written here: {count_agree:.0%} of samples alike"),
    Claim("A14", "2006 eq. (3)", "Frequency is the count over 2 a: two impulses a groove", 20.0, near(20.0, by=1e-6),
          "Hz", "frequency", DENSITY, "of a pulse every 25 ms, the two edges of a groove at 60 mm/s and 3 mm"),
    Claim("A15", "2006 eq. (4)", "Wavelength is |v| 2 a / c at any speed", 3.0, near(3.0, percent=1), "mm", "at_350",
          DENSITY, "told 350 mm/s for the impulses of a 3 mm grating: {fast_share:.0%} of samples answered"),
    Claim("A16", "2006 fig. 2", "Two 1.5 mm grooves, 1.5 mm apart, at 60 mm/s: edges of one kind 0.050 s apart",
          0.050, near(0.050, by=0.001), "s", "interval", "corpuscle on a synthetic record",
          "20 Hz and 3.0 mm; {SYNTHETIC}"),
    Claim("X12", "2006 eq. (3), fig. 2", "Two grooves give 20 Hz by the density over 0.2 s", 20.0, near(20.0, by=1.0),
          "Hz", "two_grooves", DENSITY, "inconsistent in print: two grooves alone are four impulses, and 4 / (2 x "
          "0.2 s) is 10 Hz; 20 Hz is one over 0.050 s"),
    Claim("A19", "2006 fig. 5", "Five gratings, 3.0 to 0.6 mm, give five levels of wavelength at 100 mm/s",
          "5 levels", TRUE, "share of neighbours apart", "levels_20", DENSITY, "as printed, 20 dB: {levels_20_mm}; "
          "at 40 dB {levels_40:.0%} of neighbours apart ({levels_40_mm}): 1.5 x the mean misses every other impulse "
          "of 0.6 mm, and noise makes impulses; {SYNTHETIC}"),
    Claim("X1", "2006 fig. 5", "The same with the corrected variant (threshold 1.2, hysteresis, distance paired)",
          "5 levels", TRUE, "share of neighbours apart", "corrected_40",
          "estimators.ImpulseDensity(variant='corrected')", "40 dB: {corrected_40_mm}; {SYNTHETIC}"),
    Claim("A22", "2006 fig. 7", "In natural touch the density's frequency lags by about 100 ms", 100.0,
          near(100.0, by=25.0), "ms", "lag_40", DENSITY,
          "1.8 mm, 1 Hz, 100 mm/s, 40 dB; {lag_20:.0f} ms at 20 dB; half of the window is the expectation"),
    Claim("A23", "2006 fig. 7(c)", "The wavelength is more precise where the finger is fast", "slow over fast error",
          above(1.2), "", "slow_over_fast", DENSITY,
          "as printed {fast:.0%} fast, {slow:.0%} slow; corrected {fast_corrected:.1%} and {slow_corrected:.1%}"),
    Claim("A24", "2006 fig. 8", "The density follows the true frequency better than a 200 ms spectrum",
          "higher correlation", above(0.0), "difference of correlations", "better_40", DENSITY,
          "density {follows_density:.3f}, spectrum {follows_stft:.3f} at 40 dB; {better_20:+.3f} at 20 dB"),
    Claim("A25", "2006 III.C", "The spectrum is refreshed every 10 ms", 10.0, near(10.0, by=1e-6), "ms", "hop", STFT),
    Claim("A48", "2006 I", "The density answers anew within 1 ms: at every sample", 1.0, near(1.0, by=1e-6), "ms",
          "refresh", DENSITY, "times of computing are in papilla bench --estimators"),
    Claim("A26", "2006 III.C (2)", "The spectrum fails while the motion accelerates", "qualitative", above(0.2), "",
          "stft_moving", STFT, "rms error of the wavelength in strokes; {stft_corrected:.1%} corrected"),
    Claim("A27", "2006 III.C (3)", "A slow main frequency is hidden in the spectrum's low lobe", "qualitative", TRUE,
          "share of spectra", "hidden", STFT, "12.6 Hz beside a baseline that drifts: the highest line is "
          "{hidden_Hz:.1f} Hz as printed, {unhidden_Hz:.1f} Hz after mean and trend are removed"),
    Claim("A28", "2006 eq. (5), fig. 9", "A frequency from single intervals flickers", "more than the density",
          above(3.0), "ratio of rms steps", "flicker", "estimators.ImpulseInterval().process(block)",
          "{step_interval:.1f} Hz from sample to sample against {step_density:.2f} Hz"),
    Claim("X2", "2006 eq. (5)", "One over the time between two impulses is the frequency", "f", near(1.0, percent=10),
          "f", "literal", "estimators.ImpulseInterval().process(block)", "misprint or omission: two impulses a "
          "groove make it about 2 f; between edges of one kind {same_edge:.2f} f"),
)  # fmt: skip


def run(tell) -> Found:
    """Impulse methods on synthetic gratings."""
    values = {"SYNTHETIC": SYNTHETIC, **_rules(), **_grooves()}
    tell("five gratings")
    values |= _levels()
    tell("natural touch")
    values |= _touch()
    values |= _spectrum()
    seen = scene("act1", 1.8, snr_dB=QUIET_DB, seed=3, seconds=3.0)
    density, spectrum = (np.asarray(told(kind(), seen)[0].frequency_Hz) for kind in (ImpulseDensity, ShortTimeSpectrum))
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
    usual = np.asarray(told(ImpulseDensity(), seen)[0].wavelength_mm)
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
            found, answered = told(
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
            np.asarray(told(kind(), seen)[0].frequency_Hz) for kind in (ImpulseDensity, ShortTimeSpectrum)
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
    single, density, paired = (np.asarray(told(one, seen)[0].frequency_Hz)[judged] for one in methods)
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
        found, answered = told(ImpulseDensity(variant=variant), seen)
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


EXPERIMENT = Experiment(
    "impulses",
    "The impulse methods of 2006 as printed, on gratings at constant speed and under strokes, beside a 200 ms spectrum",
    CLAIMS,
    run,
    SYNTHETIC,
)
