"""2011 Okamoto, section 4.1: wavelength by the highest line of a 32 ms spectrum."""

from functools import partial

import numpy as np

from papilla.core.units import MS_PER_S
from papilla.estimators import SpaceTracker, find_lines
from papilla_papers.claims import signals
from papilla_papers.claims.claim import Experiment, gathered
from papilla_papers.claims.scenes import scene
from papilla_papers.claims.signals import RATE_Hz, answers_to, mean_error, noisy_scene, times
from papilla_papers.methods.roughness import ImpulseDensity, Okamoto, ZeroCrossing

SPECTRUM_SCENE = scene("spectra")
STROKE_SEEDS = range(SPECTRUM_SCENE.about.seeds)
WINDOWS_MS: tuple[int, ...] = SPECTRUM_SCENE.windows_ms
GRATINGS_MM: tuple[float, ...] = SPECTRUM_SCENE.gratings_mm
SPECTRUM_PAPER = "2011_okamoto"
SPECTRUM_NOISE = signals.ReadingNoise(signals.SHARED_SIGNALS.snr_dB[SPECTRUM_PAPER])


def run(tell, cause: bool = True) -> dict:
    """The 32 ms spectrum of Okamoto 2011 in natural touch, compared with other windows.

    Gratings of 0.6-3.0 mm under strokes of 197 mm/s and 1.07 Hz; errors are rms over samples, wavelengths and seeds.
    The method is written a second time and compared sample by sample.
    """
    tell("windows")
    motion = "act2" if cause else "const"
    scenes = [noisy_scene(motion, mm, SPECTRUM_PAPER, seed) for mm in GRATINGS_MM for seed in STROKE_SEEDS]
    errors = [mean_error(partial(Okamoto, window_s=ms / MS_PER_S), scenes) for ms in WINDOWS_MS]
    return gathered(
        lambda: {
            "best_ms": float(WINDOWS_MS[int(np.argmin(errors))]),
            "errors": ", ".join(f"{error:.1%} ({ms} ms)" for ms, error in zip(WINDOWS_MS, errors, strict=True)),
            "fast_share": min(_answered_fast(method()) for method in (ImpulseDensity, ZeroCrossing, Okamoto)),
            "by_hand": _by_hand(),
        },
        lambda: _gratings(SPECTRUM_NOISE),
        lambda: _components(cause),
        lambda: _finest(cause),
    )


def in_strokes(wavelength_mm: float, **how) -> np.ndarray:
    """Answers (k,) in mm on a grating in strokes, of all seeds."""
    scenes = (noisy_scene("act2", wavelength_mm, SPECTRUM_PAPER, seed, **how) for seed in STROKE_SEEDS)
    return np.concatenate([signals.answers_mm(Okamoto(), seen) for seen in scenes])


def _gratings(assumed: signals.ReadingNoise) -> dict:
    """Answers on each grating in strokes: the mean error on the coarse gratings over that on the fine ones."""
    groups = [in_strokes(mm, snr_dB=assumed.snr_dB) for mm in GRATINGS_MM]
    off = np.abs(np.array([group.mean() for group in groups]) - GRATINGS_MM)
    setup = SPECTRUM_SCENE.resolved
    scenes = [noisy_scene("const", wavelength, SPECTRUM_PAPER, setup.seed) for wavelength in setup.wavelengths_mm]
    unresolved, resolved = (mean_error(partial(Okamoto, variant=name), scenes) for name in signals.METHOD_VARIANTS)
    return {
        "worse": float(off[SPECTRUM_SCENE.fine :].mean() / off[: SPECTRUM_SCENE.fine].mean()),
        "means": ", ".join(f"{group.mean():.2f} ± {group.std():.2f}" for group in groups) + " mm",
        "line_Hz": 1 / (Okamoto().window_samples / RATE_Hz),
        "resolved": resolved,
        "unresolved": unresolved,
    }


def _by_hand() -> float:
    """Share of samples on which the published method agrees with a second implementation of the spectrum."""
    setup = SPECTRUM_SCENE.by_hand
    seen = noisy_scene("act2", setup.wavelength_mm, SPECTRUM_PAPER, setup.seed, seconds=setup.seconds)
    size = setup.window_samples
    readings, estimate = seen.readings[:, 0], answers_to(Okamoto(), seen)[0]
    taper, agree = np.hamming(size), []
    for sample in range(setup.first_sample, len(readings), setup.every):
        power = np.abs(np.fft.rfft(taper * readings[sample + 1 - size : sample + 1])) ** 2
        frequency = (1 + int(np.argmax(power[1:-1]))) * RATE_Hz / size
        wavelength = abs(seen.known_mm_s[sample]) / frequency
        if np.isfinite(answer := estimate.wavelength_mm[sample]):
            agree.append(np.isclose(answer, wavelength, rtol=setup.rounding))
    return float(np.mean(agree))


def _answered_fast(method) -> float:
    """Share of samples above 60 mm/s that a method answers, in a touch with a peak of 241 mm/s."""
    touch, time = SPECTRUM_SCENE.fast, times(SPECTRUM_SCENE.fast.seconds)
    velocity = touch.peak_mm_s * np.sin(2 * np.pi * touch.strokes_Hz * time)
    place = np.cumsum(velocity) / RATE_Hz
    texture = np.sin(2 * np.pi * place / touch.wavelength_mm) + _noise(touch.seed, time.size)
    estimate = method.process(np.column_stack([texture, velocity]))
    rows = (np.abs(velocity) > touch.above_mm_s) & (time > touch.settled_s)
    return float(np.mean(np.isfinite(np.asarray(estimate.wavelength_mm)[rows])))


def _components(cause: bool) -> dict:
    """Two sinusoids of 1.0 and 2.3 mm, the finer one twice as strong; without the cause the coarser one."""
    setup, orders = SPECTRUM_SCENE.components, []
    place = np.linspace(0, setup.way_mm, setup.samples)
    first, second = setup.strengths if cause else setup.strengths[::-1]
    fine, coarse = setup.wavelengths_mm
    readings = first * np.sin(2 * np.pi * place / fine) + second * np.sin(2 * np.pi * place / coarse + setup.phase)
    for seed in STROKE_SEEDS:
        lines = find_lines(place, (readings + _noise(seed, place.size))[:, None]).lines
        pairs = zip(lines, setup.wavelengths_mm, strict=False)
        right = [abs(line.wavelength_mm / true - 1) < setup.within for line, true in pairs]
        orders.append(len(right) == 2 and all(right))
    told_of = ", ".join(f"{line.wavelength_mm:.3f} mm with {line.amplitude:.2f}" for line in lines[:2])
    return {"ordered": float(np.mean(orders)), "lines": f"found {told_of}, for 1.0 with 2 and 2.3 with 1"}


def _finest(cause: bool) -> dict:
    """The wavelength that the tracker of one gauge finds for a grating of 0.2 mm; the worst of the seeds."""
    setup, time, wavelengths = SPECTRUM_SCENE.finest, times(SPECTRUM_SCENE.finest.seconds), []
    texture = cause * np.sqrt(2) * np.sin(2 * np.pi * setup.speed_mm_s * time / setup.wavelength_mm)
    for seed in STROKE_SEEDS:
        block = np.column_stack([texture + _noise(seed, time.size), np.full(time.size, setup.speed_mm_s)])
        tracked = SpaceTracker(wavelength_range_mm=setup.range_mm).process(block).wavelength_mm
        wavelengths.append(float(np.asarray(tracked)[-1]))
    return {"finest": max(wavelengths, key=lambda mm: abs(mm / setup.wavelength_mm - 1) if np.isfinite(mm) else np.inf)}


def _noise(seed: int, count: int) -> np.ndarray:
    return SPECTRUM_SCENE.amplitude_of_noise * np.random.default_rng(seed).standard_normal(count)


experiment = Experiment.of(run, SPECTRUM_NOISE, worse=_gratings)
