"""2011 Okamoto, section 4.1: wavelength by the highest line of a 32 ms spectrum."""

import numpy as np

from papilla.core.units import MS_PER_S
from papilla.estimators import SpaceTracker, find_lines
from papilla_papers.claims.claim import Experiment, gathered
from papilla_papers.claims.scenes import scene
from papilla_papers.claims.signals import (
    SHARED_SCENE,
    RATE_Hz,
    WhiteNoise,
    answers_mm,
    answers_to,
    mean_error,
    noisy_scene,
    times,
)
from papilla_papers.methods.roughness import ImpulseDensity, Okamoto, ZeroCrossing

SPECTRUM_SCENE = scene("spectra")
STROKE_SEEDS = range(SPECTRUM_SCENE.about.seeds)
WINDOWS_MS: tuple[int, ...] = SPECTRUM_SCENE.windows_ms
GRATINGS_MM: tuple[float, ...] = SPECTRUM_SCENE.gratings_mm
SPECTRUM_PAPER = "2011_okamoto"
SPECTRUM_NOISE = WhiteNoise(SHARED_SCENE.snr_dB[SPECTRUM_PAPER])


def run(tell, cause: bool = True) -> dict:
    """The 32 ms spectrum of Okamoto 2011 in natural touch, compared with other windows.

    Gratings of 0.6-3.0 mm under strokes of 197 mm/s and 1.07 Hz; errors are rms over samples, wavelengths and seeds.
    The method is written a second time and compared sample by sample.
    """
    tell("windows")
    scenes = [
        noisy_scene("act2" if cause else "const", grating, SPECTRUM_PAPER, seed)
        for grating in GRATINGS_MM
        for seed in STROKE_SEEDS
    ]
    errors = [mean_error(lambda ms=ms: Okamoto(window_s=ms / MS_PER_S), scenes) for ms in WINDOWS_MS]
    return gathered(
        lambda: {
            "best_ms": float(WINDOWS_MS[int(np.argmin(errors))]),
            "errors": ", ".join(f"{error:.1%} ({ms} ms)" for ms, error in zip(WINDOWS_MS, errors, strict=True)),
            "fast_share": min(_answered_fast(kind()) for kind in (ImpulseDensity, ZeroCrossing, Okamoto)),
            "by_hand": _by_hand(),
        },
        lambda: _gratings(SPECTRUM_NOISE),
        lambda: _components(cause),
        lambda: _finest(cause),
    )


def _gratings(assumed: WhiteNoise) -> dict:
    """Answers on each grating in strokes: the mean error on the coarse gratings over that on the fine ones."""
    groups = [
        np.concatenate(
            [
                answers_mm(Okamoto(), noisy_scene("act2", wavelength, SPECTRUM_PAPER, k, snr_dB=assumed.snr_dB))
                for k in STROKE_SEEDS
            ]
        )
        for wavelength in GRATINGS_MM
    ]
    off = np.abs([group.mean() - wavelength for group, wavelength in zip(groups, GRATINGS_MM, strict=True)])
    settings = SPECTRUM_SCENE.resolved
    scenes = [noisy_scene("const", wavelength, SPECTRUM_PAPER, settings.seed) for wavelength in settings.wavelengths_mm]
    unresolved, resolved = (
        mean_error(lambda kind=variant: Okamoto(variant=kind), scenes) for variant in ("as_printed", "corrected")
    )
    return {
        "worse": float(off[SPECTRUM_SCENE.fine :].mean() / off[: SPECTRUM_SCENE.fine].mean()),
        "means": ", ".join(f"{group.mean():.2f} ± {group.std():.2f}" for group in groups) + " mm",
        "line_Hz": 1 / (Okamoto().window_samples / RATE_Hz),
        "resolved": resolved,
        "unresolved": unresolved,
    }


def _by_hand() -> float:
    """Share of samples on which the published method agrees with a second implementation of the spectrum."""
    settings = SPECTRUM_SCENE.by_hand
    seen = noisy_scene("act2", settings.wavelength_mm, SPECTRUM_PAPER, settings.seed, seconds=settings.seconds)
    size = settings.window_samples
    readings, estimate = seen.readings[:, 0], answers_to(Okamoto(), seen)[0]
    taper, agree = np.hamming(size), []
    for sample in range(settings.first_sample, len(readings), settings.every):
        power = np.abs(np.fft.rfft(taper * readings[sample + 1 - size : sample + 1])) ** 2
        frequency = (1 + int(np.argmax(power[1:-1]))) * RATE_Hz / size
        wavelength = abs(seen.known_mm_s[sample]) / frequency
        if np.isfinite(answer := estimate.wavelength_mm[sample]):
            agree.append(np.isclose(answer, wavelength, rtol=settings.rounding))
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
    settings, orders = SPECTRUM_SCENE.components, []
    place = np.linspace(0, settings.way_mm, settings.samples)
    first, second = settings.strengths if cause else settings.strengths[::-1]
    fine, coarse = settings.wavelengths_mm
    readings = first * np.sin(2 * np.pi * place / fine) + second * np.sin(2 * np.pi * place / coarse + settings.phase)
    for seed in STROKE_SEEDS:
        lines = find_lines(place, (readings + _noise(seed, place.size))[:, None]).lines
        pairs = zip(lines, settings.wavelengths_mm, strict=False)
        right = [abs(line.wavelength_mm / true - 1) < settings.within for line, true in pairs]
        orders.append(len(right) == 2 and all(right))
    told_of = ", ".join(f"{line.wavelength_mm:.3f} mm with {line.amplitude:.2f}" for line in lines[:2])
    return {"ordered": float(np.mean(orders)), "lines": f"found {told_of}, for 1.0 with 2 and 2.3 with 1"}


def _finest(cause: bool) -> dict:
    """The wavelength that the tracker of one gauge finds for a grating of 0.2 mm; the worst of the seeds."""
    settings, time, wavelengths = SPECTRUM_SCENE.finest, times(SPECTRUM_SCENE.finest.seconds), []
    texture = cause * np.sqrt(2) * np.sin(2 * np.pi * settings.speed_mm_s * time / settings.wavelength_mm)
    for seed in STROKE_SEEDS:
        block = np.column_stack([texture + _noise(seed, time.size), np.full(time.size, settings.speed_mm_s)])
        tracked = SpaceTracker(wavelength_range_mm=settings.range_mm).process(block).wavelength_mm
        wavelengths.append(float(np.asarray(tracked)[-1]))
    return {
        "finest": max(wavelengths, key=lambda mm: abs(mm / settings.wavelength_mm - 1) if np.isfinite(mm) else np.inf)
    }


def _noise(seed: int, count: int) -> np.ndarray:
    return SPECTRUM_SCENE.amplitude_of_noise * np.random.default_rng(seed).standard_normal(count)


experiment = Experiment.of(run, SPECTRUM_NOISE, worse=_gratings)
