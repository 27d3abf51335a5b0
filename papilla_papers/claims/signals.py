"""Signals and figures that several experiments share: synthetic gratings, errors of an answer, and delays."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from papilla.core.units import MS_PER_S
from papilla.scenes.scenes import Scene, scene
from papilla_papers.claims.scenes import scene as scene_of
from papilla_papers.methods.roughness import RoughnessStream

SHARED_SIGNALS = scene_of("signals")
METHOD_VARIANTS = ("as_printed", "corrected")
RATE_Hz: int = SHARED_SIGNALS.rate_Hz
SCENE_SEEDS = range(SHARED_SIGNALS.seeds)
"""Seeds of every scene with noise; statistical statements are judged by a share over them."""


def times(seconds: float, rate_Hz: float = RATE_Hz) -> np.ndarray:
    """Times (n,) in s of the samples of a record."""
    return np.arange(round(seconds * rate_Hz)) / rate_Hz


def share_of_noise(snr_dB: float) -> float:
    """Standard deviation of the noise over that of the signal."""
    return 10 ** (-snr_dB / 20)


def listed(numbers: Iterable[float], form: str = ".2f") -> str:
    """Numbers in a line, with commas."""
    return ", ".join(f"{number:{form}}" for number in numbers)


def noisy_scene(name: str, wavelength_mm: float, paper: str, seed: int, *, cause: bool = True, **how) -> Scene:
    """A scene of `estimator_bench` with the noise of a paper; without its cause, noise of the same power alone."""
    seen = scene(name, wavelength_mm, seed=seed, **{"snr_dB": SHARED_SIGNALS.snr_dB[paper], **how})
    if cause:
        return seen
    noise = np.random.default_rng(SHARED_SIGNALS.first_seed_of_noise + seed).standard_normal(seen.readings.shape)
    return replace(seen, readings=noise * seen.readings.std())


def answers_to(method: RoughnessStream, seen: Scene):
    """Answers of a method to the first gauge of a scene and its velocity, and the judged and answered rows."""
    estimate = method.process(np.column_stack([seen.readings[:, 0], seen.known_mm_s]))
    answered = np.isfinite(np.asarray(estimate.wavelength_mm)) & seen.judged()
    return estimate, answered


def wavelength_error(method: RoughnessStream, seen: Scene) -> float:
    """Root mean square relative error of the wavelength over the judged rows that were answered (clipped)."""
    estimate, answered = answers_to(method, seen)
    ratio = np.clip(estimate.wavelength_mm[answered] / seen.wavelength_mm[answered] - 1, *SHARED_SIGNALS.clipped_error)
    return float(np.sqrt(np.mean(ratio**2))) if answered.any() else 1.0


def mean_error(make, scenes: Sequence[Scene]) -> float:
    """Root mean square of `wavelength_error` over scenes; `make` gives a new method."""
    return float(np.sqrt(np.mean([wavelength_error(make(), seen) ** 2 for seen in scenes])))


def lag_ms(answer: np.ndarray, truth: np.ndarray, rate_Hz: float) -> float:
    """Delay in ms of `answer` (n,): the shift with the best correlation with `truth` (n,)."""
    best, best_shift = -np.inf, 0
    for shift in range(round(SHARED_SIGNALS.longest_lag_ms * rate_Hz / MS_PER_S) + 1):
        late, leading = answer[shift:], truth[: len(truth) - shift]
        both = np.isfinite(late) & np.isfinite(leading)
        if (
            both.sum() > SHARED_SIGNALS.fewest_for_a_lag
            and (value := float(np.corrcoef(late[both], leading[both])[0, 1])) > best
        ):
            best, best_shift = value, shift
    return MS_PER_S * best_shift / rate_Hz


def correlation(first: np.ndarray, second: np.ndarray) -> float:
    """Correlation of two columns (n,) where both hold numbers."""
    both = np.isfinite(first) & np.isfinite(second)
    return float(np.corrcoef(first[both], second[both])[0, 1])


def follows(answer: np.ndarray, truth: np.ndarray, rate_Hz: float) -> float:
    """Correlation of an answer (n,) with the truth (n,), after the answer's delay is removed."""
    shift = round(lag_ms(answer, truth, rate_Hz) * rate_Hz / MS_PER_S)
    late, leading = answer[shift:], truth[: len(truth) - shift]
    return correlation(late, leading)


@dataclass(frozen=True)
class ReadingNoise:
    """White noise: signal to noise in dB, which no paper prints."""

    snr_dB: float


def apart(groups: Sequence[np.ndarray]) -> float:
    """Share of neighbouring groups, in their order, whose means differ by more than the sum of their deviations."""
    pairs = zip(groups, groups[1:], strict=False)
    distinct = [a.size and b.size and a.mean() - b.mean() > a.std() + b.std() for a, b in pairs]
    return float(np.mean(distinct))


def answers_mm(method: RoughnessStream, seen: Scene) -> np.ndarray:
    """Wavelengths (k,) that a method answers in the judged rows of a scene."""
    estimate, answered = answers_to(method, seen)
    return np.asarray(estimate.wavelength_mm)[answered]


def frequencies_Hz(method: RoughnessStream, seen: Scene) -> np.ndarray:
    """Frequencies (n,) that a method answers in a scene."""
    return np.asarray(answers_to(method, seen)[0].frequency_Hz)


def on_gratings(make, wavelengths_mm: Sequence[float], name: str, paper: str, **how) -> tuple[np.ndarray, float]:
    """Mean answers in mm (seeds, gratings) of new methods, nan where there is none; and the share of neighbours that
    are `apart`."""
    answers = [
        [answers_mm(make(), noisy_scene(name, mm, paper, seed, **how)) for mm in wavelengths_mm] for seed in SCENE_SEEDS
    ]
    means = [[levels.mean() if levels.size else np.nan for levels in of_seed] for of_seed in answers]
    return np.array(means), float(np.mean([apart(of_seed) for of_seed in answers]))


def last_number(column) -> float:
    """The last finite value of a column (n,); nan if there is none."""
    finite = np.asarray(column)[np.isfinite(column)]
    return float(finite[-1]) if finite.size else float("nan")
