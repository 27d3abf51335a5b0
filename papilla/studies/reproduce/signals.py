"""Signals and figures that several experiments share: synthetic gratings, errors of an answer, and delays."""

from collections.abc import Sequence

import numpy as np

from papilla.estimators.published.roughness import RoughnessStream
from papilla.studies.estimator_bench.scenes import Scene, scene

FIVE_MM = (3.0, 2.4, 1.8, 1.2, 0.6)
"""The wavelengths of the 2006 gratings."""
QUIET_DB, USUAL_DB = 40.0, 20.0
"""Signal to noise ratios that are tried: AC power of the texture over the variance of white noise."""


def answers_to(method: RoughnessStream, seen: Scene):
    """What a method answers to the first gauge of a scene and its velocity, and which rows are judged and answered."""
    found = method.process(np.column_stack([seen.readings[:, 0], seen.known_mm_s]))
    answered = np.isfinite(np.asarray(found.wavelength_mm)) & seen.judged()
    return found, answered


def wavelength_error(method: RoughnessStream, seen: Scene) -> float:
    """Root mean square relative error of the wavelength over the judged rows that were answered (clipped to 1, 3)."""
    found, answered = answers_to(method, seen)
    ratio = np.clip(found.wavelength_mm[answered] / seen.wavelength_mm[answered] - 1, -1, 3)
    return float(np.sqrt(np.mean(ratio**2))) if answered.any() else 1.0


def mean_error(make, name: str, wavelengths: Sequence[float], snr_dB: float, seeds: Sequence[int] = (11, 12)) -> float:
    """Root mean square of `wavelength_error` over wavelengths and seeds; `make` gives a new method."""
    errors = [
        wavelength_error(make(), scene(name, wavelength, snr_dB=snr_dB, seed=seed))
        for wavelength in wavelengths
        for seed in seeds
    ]
    return float(np.sqrt(np.mean(np.square(errors))))


def lag_ms(answer: np.ndarray, truth: np.ndarray, rate_Hz: float, longest_ms: float = 250.0) -> float:
    """Shift of `answer` (n,) that correlates best with `truth` (n,), in ms: by how much it is late."""
    best, found = -np.inf, 0
    for shift in range(round(longest_ms * rate_Hz / 1000) + 1):
        late, own = answer[shift:], truth[: len(truth) - shift]
        both = np.isfinite(late) & np.isfinite(own)
        if both.sum() > 100 and (value := float(np.corrcoef(late[both], own[both])[0, 1])) > best:
            best, found = value, shift
    return 1000 * found / rate_Hz


def correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Correlation of two columns (n,) where both hold numbers."""
    both = np.isfinite(one) & np.isfinite(other)
    return float(np.corrcoef(one[both], other[both])[0, 1])


def overlap(groups: Sequence[np.ndarray]) -> float:
    """Share of neighbouring groups, in their order, whose means differ by more than the sum of their deviations."""
    apart = [
        float(np.mean(one)) - float(np.mean(other)) > float(np.std(one) + np.std(other))
        for one, other in zip(groups, groups[1:], strict=False)
    ]
    return float(np.mean(apart))
