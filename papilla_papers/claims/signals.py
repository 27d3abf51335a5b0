"""Signals and figures that several experiments share: synthetic gratings, errors of an answer, and delays."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from papilla.core.units import MS_PER_S
from papilla.scenes.scenes import Scene, scene
from papilla_papers.claims.scenes import scene as scene_of
from papilla_papers.methods.roughness import RoughnessStream

SHARED = scene_of("signals")
RATE_Hz: int = SHARED.rate_Hz
SEEDS = range(SHARED.seeds)
"""Seeds of every scene with noise; statistical statements are judged by a share over them."""


def times(seconds: float, rate_Hz: float = RATE_Hz) -> np.ndarray:
    """Times (n,) in s of the samples of a record."""
    return np.arange(round(seconds * rate_Hz)) / rate_Hz


def share_of_noise(snr_dB: float) -> float:
    """Standard deviation of the noise over that of the signal."""
    return 10 ** (-snr_dB / 20)


def listed(numbers: Iterable[float], form: str = ".2f") -> str:
    """Numbers in a line, with commas."""
    return ", ".join(f"{one:{form}}" for one in numbers)


def noisy_scene(name: str, wavelength_mm: float, paper: str, seed: int, *, cause: bool = True, **how) -> Scene:
    """A scene of `estimator_bench` with the noise of a paper; without its cause, noise of the same power alone."""
    seen = scene(name, wavelength_mm, seed=seed, **{"snr_dB": SHARED.snr_dB[paper], **how})
    if cause:
        return seen
    noise = np.random.default_rng(SHARED.first_seed_of_noise + seed).standard_normal(seen.readings.shape)
    return replace(seen, readings=noise * seen.readings.std())


def answers_to(method: RoughnessStream, seen: Scene):
    """Answers of a method to the first gauge of a scene and its velocity, and the judged and answered rows."""
    found = method.process(np.column_stack([seen.readings[:, 0], seen.known_mm_s]))
    answered = np.isfinite(np.asarray(found.wavelength_mm)) & seen.judged()
    return found, answered


def wavelength_error(method: RoughnessStream, seen: Scene) -> float:
    """Root mean square relative error of the wavelength over the judged rows that were answered (clipped)."""
    found, answered = answers_to(method, seen)
    ratio = np.clip(found.wavelength_mm[answered] / seen.wavelength_mm[answered] - 1, *SHARED.clipped_error)
    return float(np.sqrt(np.mean(ratio**2))) if answered.any() else 1.0


def mean_error(make, scenes: Sequence[Scene]) -> float:
    """Root mean square of `wavelength_error` over scenes; `make` gives a new method."""
    return float(np.sqrt(np.mean([wavelength_error(make(), seen) ** 2 for seen in scenes])))


def lag_ms(answer: np.ndarray, truth: np.ndarray, rate_Hz: float) -> float:
    """Delay in ms of `answer` (n,): the shift with the best correlation with `truth` (n,)."""
    best, found = -np.inf, 0
    for shift in range(round(SHARED.longest_lag_ms * rate_Hz / MS_PER_S) + 1):
        late, own = answer[shift:], truth[: len(truth) - shift]
        both = np.isfinite(late) & np.isfinite(own)
        if both.sum() > SHARED.fewest_for_a_lag and (value := float(np.corrcoef(late[both], own[both])[0, 1])) > best:
            best, found = value, shift
    return MS_PER_S * found / rate_Hz


def correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Correlation of two columns (n,) where both hold numbers."""
    both = np.isfinite(one) & np.isfinite(other)
    return float(np.corrcoef(one[both], other[both])[0, 1])


def follows(answer: np.ndarray, truth: np.ndarray, rate_Hz: float) -> float:
    """Correlation of an answer (n,) with the truth (n,), after the answer's delay is removed."""
    shift = round(lag_ms(answer, truth, rate_Hz) * rate_Hz / MS_PER_S)
    late, own = answer[shift:], truth[: len(truth) - shift]
    return correlation(late, own)


@dataclass(frozen=True)
class Noise:
    """White noise: signal to noise in dB, which no paper prints."""

    snr_dB: float


def apart(groups: Sequence[np.ndarray]) -> float:
    """Share of neighbouring groups, in their order, whose means differ by more than the sum of their deviations."""
    pairs = zip(groups, groups[1:], strict=False)
    told = [one.size and other.size and one.mean() - other.mean() > one.std() + other.std() for one, other in pairs]
    return float(np.mean(told))


def answers_mm(method: RoughnessStream, seen: Scene) -> np.ndarray:
    """Wavelengths (k,) that a method answers in the judged rows of a scene."""
    found, answered = answers_to(method, seen)
    return np.asarray(found.wavelength_mm)[answered]


def last_number(column) -> float:
    """The last finite value of a column (n,); nan if there is none."""
    known = np.asarray(column)[np.isfinite(column)]
    return float(known[-1]) if known.size else float("nan")
