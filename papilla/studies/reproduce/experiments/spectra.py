"""2011 Okamoto, section 4.1: wavelength by the highest line of a 32 ms spectrum."""

import numpy as np

from papilla.estimators import SpaceTracker, find_lines
from papilla.estimators.published.roughness import ImpulseDensity, Okamoto, ZeroCrossing
from papilla.studies.reproduce.claim import Found, Series, gathered
from papilla.studies.reproduce.signals import SNR_DB, Noise, answers_mm, answers_to, heard, mean_error

SEEDS = (0, 1, 2, 3)
SIMULATED = "synthetic gratings, strokes of 197 sin(2 pi 1.07 t) mm/s"
SCENE = (
    "strokes, a constant speed instead; the order of two components; the grating",
    f"white, {SNR_DB['2011_okamoto']:g} dB",
    len(SEEDS),
)
WINDOWS_MS = (16, 32, 64, 128)
GRATINGS = (0.6, 1.2, 1.8, 2.4, 3.0)
PAPER = "2011_okamoto"
ASSUMED = Noise(SNR_DB[PAPER])


def run(tell, cause: bool = True) -> Found:
    """The 32 ms spectrum of Okamoto 2011 in natural touch, beside other windows.

    Gratings of 0.6-3.0 mm under strokes of 197 mm/s and 1.07 Hz; errors are rms over samples, wavelengths and seeds.
    The method is written a second time and compared sample by sample.
    """
    tell("windows")
    scenes = [heard("act2" if cause else "const", one, PAPER, seed) for one in GRATINGS for seed in SEEDS]
    errors = [mean_error(lambda ms=ms: Okamoto(window_s=ms / 1000), scenes) for ms in WINDOWS_MS]
    values = gathered(
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
    series = (Series("rms error over 0.6-3.0 mm", [f"{ms} ms" for ms in WINDOWS_MS], 100 * np.array(errors), "bars"),)
    title = "Windows in natural touch: long ones smear the speed, short ones have too few lines"
    return Found(values, title, "window", "error of the wavelength, %", series)


def _gratings(assumed: Noise) -> dict:
    """Answers on each grating in strokes: the mean error on the coarse gratings over that on the fine ones."""
    groups = [
        np.concatenate([answers_mm(Okamoto(), heard("act2", one, PAPER, k, snr_dB=assumed.snr_dB)) for k in SEEDS])
        for one in GRATINGS
    ]
    off = np.abs([group.mean() - one for group, one in zip(groups, GRATINGS, strict=True)])
    unresolved, resolved = (
        mean_error(lambda kind=kind: Okamoto(variant=kind), [heard("const", one, PAPER, 11) for one in (0.6, 1.8, 3.0)])
        for kind in ("as_printed", "corrected")
    )
    return {
        "worse": float(off[3:].mean() / off[:3].mean()),
        "means": ", ".join(f"{group.mean():.2f} ± {group.std():.2f}" for group in groups) + " mm",
        "line_Hz": 1 / (Okamoto().window_samples / 1000),
        "resolved": resolved,
        "unresolved": unresolved,
    }


def _by_hand() -> float:
    """Share of samples on which the published method agrees with a second implementation of the spectrum."""
    seen = heard("act2", 1.8, PAPER, 15, seconds=2.0)
    readings, found = seen.readings[:, 0], answers_to(Okamoto(), seen)[0]
    taper, agree = np.hamming(32), []
    for row in range(100, 2000, 7):
        power = np.abs(np.fft.rfft(taper * readings[row - 31 : row + 1])) ** 2
        frequency = (1 + int(np.argmax(power[1:-1]))) * 1000 / 32
        wavelength = abs(seen.known_mm_s[row]) / frequency
        if np.isfinite(answer := found.wavelength_mm[row]):
            agree.append(np.isclose(answer, wavelength, rtol=1e-9))
    return float(np.mean(agree))


def _answered_fast(method) -> float:
    """Share of samples above 60 mm/s that a method answers, in a touch with a peak of 241 mm/s."""
    time = np.arange(4000) / 1000
    velocity = 241 * np.sin(2 * np.pi * 1.07 * time)
    place = np.cumsum(velocity) / 1000
    noise = 0.1 * np.random.default_rng(3).standard_normal(time.size)
    found = method.process(np.column_stack([np.sin(2 * np.pi * place / 1.8) + noise, velocity]))
    rows = (np.abs(velocity) > 60) & (time > 1)
    return float(np.mean(np.isfinite(np.asarray(found.wavelength_mm)[rows])))


def _components(cause: bool) -> dict:
    """Two sinusoids of 1.0 and 2.3 mm, the finer one twice as strong; without the cause the coarser one."""
    place, strong = np.linspace(0, 60, 6000), (2, 1) if cause else (1, 2)
    readings = strong[0] * np.sin(2 * np.pi * place / 1.0) + strong[1] * np.sin(2 * np.pi * place / 2.3 + 1)
    orders = []
    for seed in SEEDS:
        noise = 0.1 * np.random.default_rng(seed).standard_normal(place.size)
        lines = find_lines(place, (readings + noise)[:, None]).lines
        right = [abs(line.wavelength_mm / true - 1) < 0.01 for line, true in zip(lines, (1.0, 2.3), strict=False)]
        orders.append(len(right) == 2 and all(right))
    told_of = ", ".join(f"{line.wavelength_mm:.3f} mm with {line.amplitude:.2f}" for line in lines[:2])
    return {"ordered": float(np.mean(orders)), "lines": f"found {told_of}, for 1.0 with 2 and 2.3 with 1"}


def _finest(cause: bool) -> dict:
    """The wavelength that the tracker of one gauge finds for a grating of 0.2 mm; the worst of the seeds."""
    time, found = np.arange(3000) / 1000, []
    for seed in SEEDS:
        texture = cause * np.sqrt(2) * np.sin(2 * np.pi * 40 * time / 0.2)
        noise = 0.1 * np.random.default_rng(seed).standard_normal(time.size)
        block = np.column_stack([texture + noise, np.full(time.size, 40.0)])
        found.append(float(np.asarray(SpaceTracker(wavelength_range_mm=(0.1, 3.0)).process(block).wavelength_mm)[-1]))
    return {"finest": max(found, key=lambda one: abs(one / 0.2 - 1) if np.isfinite(one) else np.inf)}


VARIED = {"worse": _gratings}
