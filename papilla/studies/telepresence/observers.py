"""Ideal observers: two cues to a texture's wavelength, each with one noise figure, weighted as by an optimal observer.

They stand for the information that reaches a person, never for the person.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import ndtr
from scipy.stats import binom

from papilla import checks

WAVELENGTHS_2007_MM = (1.0, 2.0, 3.0, 4.0)
TRIALS_2007 = 10
TEMPORAL_SD = 0.34
"""Of ln wavelength by frequency over own speed: `fit_pairwise_noise` of the rates of 2007, rounded."""
INTENSITY_SD = 0.19
"""Of ln amplitude: a Weber fraction of 0.2 at 75 % correct in two intervals, ln 1.2 / (sqrt 2 x 0.674), as commonly
quoted for vibration of the finger (Craig 1972, Percept. Psychophys. 11, 150-152); the source was not at hand."""
NOTICED_MS, CHANGED_MS = 59.0, 41.0
"""Delay that is noticed, and delay from which textures feel different: Okamoto et al. 2008 (ICRA), the source that the
2011 paper rounds to 60 and 40 ms."""


@dataclass(frozen=True)
class Observer:
    """An observer with a temporal cue (frequency over own speed) and an intensity cue.

    temporal_sd, intensity_sd : standard deviation of ln wavelength by each. Raises `InputError` for others than > 0.
    """

    temporal_sd: float = TEMPORAL_SD
    intensity_sd: float = INTENSITY_SD

    def __post_init__(self):
        checks.positive("temporal_sd", self.temporal_sd)
        checks.positive("intensity_sd", self.intensity_sd)

    def weights(self, lag_ms: float) -> tuple[float, float]:
        """Weights (sum 1) of the two cues: inverse variances, the temporal one falling to nothing between 41 and 59 ms
        of lag, as participants report of delayed feedback."""
        kept = min(1.0, max(0.0, (NOTICED_MS - lag_ms) / (NOTICED_MS - CHANGED_MS)))
        temporal, intensity = kept / self.temporal_sd**2, 1 / self.intensity_sd**2
        return temporal / (temporal + intensity), intensity / (temporal + intensity)

    def sd(self, lag_ms: float) -> float:
        """Standard deviation of the ln wavelength that it answers."""
        temporal, intensity = self.weights(lag_ms)
        return math.hypot(temporal * self.temporal_sd, intensity * self.intensity_sd)

    def answer(self, temporal_mm, intensity_mm, lag_ms: float, rng: np.random.Generator):
        """Wavelengths (n,) that it answers where its cues, without its noise, tell these (n,)."""
        temporal, intensity = self.weights(lag_ms)
        told = intensity * np.log(intensity_mm) + (temporal * np.log(temporal_mm) if temporal else 0.0)
        return np.exp(told + self.sd(lag_ms) * rng.standard_normal(np.shape(told)))


def pairwise_rates(sd: float, wavelengths_mm: Sequence[float] = WAVELENGTHS_2007_MM, other_sd: float = 0.0):
    """Share of right answers to "which is longer", for each pair in rising order: Phi(ln(b / a) / (sqrt 2 sd)).

    `other_sd` is what the system adds to the observer's `sd`, both in ln wavelength.
    """
    spread = math.sqrt(2) * math.hypot(sd, other_sd)
    return ndtr(np.array([math.log(b / a) / spread for a, b in combinations(wavelengths_mm, 2)]))


def likelihood(sd: float, other_sd: float = 0.0) -> float:
    """Log likelihood of what is published: of six pairs the two hardest right in 7 of 10, four in more than 9 of 10.

    More than 0.9 of ten trials is read as at least nine, for a rate of 0.9 is reported among them as significant.
    """
    rates = np.sort(pairwise_rates(sd, other_sd=other_sd))
    two = binom.logpmf(7, TRIALS_2007, rates[:2]).sum()
    return float(two + binom.logsf(8, TRIALS_2007, rates[2:]).sum())


def fit_pairwise_noise(other_sd: float = 0.0) -> tuple[float, tuple[float, float]]:
    """(sd, 95 % interval) of ln wavelength of the one observer of 2007, by maximum likelihood of what is published."""
    found = minimize_scalar(lambda sd: -likelihood(sd, other_sd), bounds=(0.05, 2.0), method="bounded")
    best, grid = float(found.x), np.linspace(0.05, 2.0, 391)
    inside = grid[[likelihood(sd, other_sd) > -found.fun - 1.92 for sd in grid]]
    return best, (float(inside.min()), float(inside.max()))
