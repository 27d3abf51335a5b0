"""2011 Okamoto, section 4.1: wavelength by the highest line of a 32 ms spectrum."""

import numpy as np

from papilla.core.units import MS_PER_S
from papilla.estimators import SpaceTracker, find_lines
from papilla_papers.claims.claim import gathered
from papilla_papers.claims.scenes import scene
from papilla_papers.claims.signals import SHARED, Noise, RATE_Hz, answers_mm, answers_to, mean_error, noisy_scene, times
from papilla_papers.methods.roughness import ImpulseDensity, Okamoto, ZeroCrossing

SCENE = scene("spectra")
SEEDS = range(SCENE.about.seeds)
WINDOWS_MS: tuple[int, ...] = SCENE.windows_ms
GRATINGS: tuple[float, ...] = SCENE.gratings_mm
PAPER = "2011_okamoto"
ASSUMED = Noise(SHARED.snr_dB[PAPER])


def run(tell, cause: bool = True) -> dict:
    """The 32 ms spectrum of Okamoto 2011 in natural touch, compared with other windows.

    Gratings of 0.6-3.0 mm under strokes of 197 mm/s and 1.07 Hz; errors are rms over samples, wavelengths and seeds.
    The method is written a second time and compared sample by sample.
    """
    tell("windows")
    scenes = [noisy_scene("act2" if cause else "const", one, PAPER, seed) for one in GRATINGS for seed in SEEDS]
    errors = [mean_error(lambda ms=ms: Okamoto(window_s=ms / MS_PER_S), scenes) for ms in WINDOWS_MS]
    return gathered(
        lambda: {
            "best_ms": float(WINDOWS_MS[int(np.argmin(errors))]),
            "errors": ", ".join(f"{error:.1%} ({ms} ms)" for ms, error in zip(WINDOWS_MS, errors, strict=True)),
            "fast_share": min(_answered_fast(kind()) for kind in (ImpulseDensity, ZeroCrossing, Okamoto)),
            "by_hand": _by_hand(),
        },
        lambda: _gratings(ASSUMED),
        lambda: _components(cause),
        lambda: _finest(cause),
    )


def _gratings(assumed: Noise) -> dict:
    """Answers on each grating in strokes: the mean error on the coarse gratings over that on the fine ones."""
    groups = [
        np.concatenate(
            [answers_mm(Okamoto(), noisy_scene("act2", one, PAPER, k, snr_dB=assumed.snr_dB)) for k in SEEDS]
        )
        for one in GRATINGS
    ]
    off = np.abs([group.mean() - one for group, one in zip(groups, GRATINGS, strict=True)])
    own = SCENE.resolved
    scenes = [noisy_scene("const", one, PAPER, own.seed) for one in own.wavelengths_mm]
    unresolved, resolved = (
        mean_error(lambda kind=kind: Okamoto(variant=kind), scenes) for kind in ("as_printed", "corrected")
    )
    return {
        "worse": float(off[SCENE.fine :].mean() / off[: SCENE.fine].mean()),
        "means": ", ".join(f"{group.mean():.2f} ± {group.std():.2f}" for group in groups) + " mm",
        "line_Hz": 1 / (Okamoto().window_samples / RATE_Hz),
        "resolved": resolved,
        "unresolved": unresolved,
    }


def _by_hand() -> float:
    """Share of samples on which the published method agrees with a second implementation of the spectrum."""
    own = SCENE.by_hand
    seen, size = noisy_scene("act2", own.wavelength_mm, PAPER, own.seed, seconds=own.seconds), own.window_samples
    readings, found = seen.readings[:, 0], answers_to(Okamoto(), seen)[0]
    taper, agree = np.hamming(size), []
    for row in range(own.first_sample, len(readings), own.every):
        power = np.abs(np.fft.rfft(taper * readings[row + 1 - size : row + 1])) ** 2
        frequency = (1 + int(np.argmax(power[1:-1]))) * RATE_Hz / size
        wavelength = abs(seen.known_mm_s[row]) / frequency
        if np.isfinite(answer := found.wavelength_mm[row]):
            agree.append(np.isclose(answer, wavelength, rtol=own.rounding))
    return float(np.mean(agree))


def _answered_fast(method) -> float:
    """Share of samples above 60 mm/s that a method answers, in a touch with a peak of 241 mm/s."""
    own, time = SCENE.fast, times(SCENE.fast.seconds)
    velocity = own.peak_mm_s * np.sin(2 * np.pi * own.strokes_Hz * time)
    place = np.cumsum(velocity) / RATE_Hz
    texture = np.sin(2 * np.pi * place / own.wavelength_mm) + _noise(own.seed, time.size)
    found = method.process(np.column_stack([texture, velocity]))
    rows = (np.abs(velocity) > own.above_mm_s) & (time > own.settled_s)
    return float(np.mean(np.isfinite(np.asarray(found.wavelength_mm)[rows])))


def _components(cause: bool) -> dict:
    """Two sinusoids of 1.0 and 2.3 mm, the finer one twice as strong; without the cause the coarser one."""
    own, orders = SCENE.components, []
    place, (first, second) = np.linspace(0, own.way_mm, own.samples), own.strengths if cause else own.strengths[::-1]
    fine, coarse = own.wavelengths_mm
    readings = first * np.sin(2 * np.pi * place / fine) + second * np.sin(2 * np.pi * place / coarse + own.phase)
    for seed in SEEDS:
        lines = find_lines(place, (readings + _noise(seed, place.size))[:, None]).lines
        pairs = zip(lines, own.wavelengths_mm, strict=False)
        right = [abs(line.wavelength_mm / true - 1) < own.within for line, true in pairs]
        orders.append(len(right) == 2 and all(right))
    told_of = ", ".join(f"{line.wavelength_mm:.3f} mm with {line.amplitude:.2f}" for line in lines[:2])
    return {"ordered": float(np.mean(orders)), "lines": f"found {told_of}, for 1.0 with 2 and 2.3 with 1"}


def _finest(cause: bool) -> dict:
    """The wavelength that the tracker of one gauge finds for a grating of 0.2 mm; the worst of the seeds."""
    own, time, found = SCENE.finest, times(SCENE.finest.seconds), []
    texture = cause * np.sqrt(2) * np.sin(2 * np.pi * own.speed_mm_s * time / own.wavelength_mm)
    for seed in SEEDS:
        block = np.column_stack([texture + _noise(seed, time.size), np.full(time.size, own.speed_mm_s)])
        tracked = SpaceTracker(wavelength_range_mm=own.range_mm).process(block).wavelength_mm
        found.append(float(np.asarray(tracked)[-1]))
    return {"finest": max(found, key=lambda one: abs(one / own.wavelength_mm - 1) if np.isfinite(one) else np.inf)}


def _noise(seed: int, count: int) -> np.ndarray:
    return SCENE.amplitude_of_noise * np.random.default_rng(seed).standard_normal(count)


VARIED = {"worse": _gratings}
