"""The pairwise test of Okamoto et al. 2007, section 4: which of two gratings of 1 to 4 mm is longer, ten times each."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest

from papilla.studies.telepresence.observers import (
    TRIALS_2007,
    WAVELENGTHS_2007_MM,
    fit_pairwise_noise,
    pairwise_rates,
)
from papilla.telepresence.link import LinkModel
from papilla.telepresence.loop import Set, run
from papilla.telepresence.motion import Motion
from papilla.telepresence.texture import GratingTexture


@dataclass(frozen=True)
class Pairwise:
    """What the pairwise test gives.

    observer_sd, interval : of ln wavelength, fitted to the published rates. system_sd : what the display adds: RMS of
    ln(displayed / true) over the four gratings. rates : (6,) expected shares of right answers, a pair each; least :
    right answers of ten that differ from chance (binomial, two-sided, 5 %).
    """

    observer_sd: float
    interval: tuple[float, float]
    system_sd: float
    rates: np.ndarray
    least: int

    @property
    def above_nine_tenths(self) -> int:
        """Pairs whose rate, rounded to a tenth as ten trials give it, is 0.9 or more."""
        return int((np.round(self.rates, 1) >= 0.9).sum())


def pairwise_2007(seed: int = 0, seconds: float = 4.0, round_trip_ms: float = 0.0) -> Pairwise:
    """Run the loop on each grating, and let the fitted observer compare what is displayed."""
    logs = []
    for number, wavelength in enumerate(WAVELENGTHS_2007_MM):
        scene = Set(
            GratingTexture(wavelength),
            Motion(100.0, 1.0),
            seconds,
            downlink=LinkModel(one_way_ms=round_trip_ms),
            seed=seed + number,
        )
        felt = run(scene).felt("local").wavelength_mm
        logs.append(np.log(felt[np.isfinite(felt)] / wavelength))
    system = float(np.sqrt(np.mean(np.concatenate(logs) ** 2)))
    sd, interval = fit_pairwise_noise(system)
    rates = pairwise_rates(sd, other_sd=system)
    least = next(k for k in range(TRIALS_2007 + 1) if k > 5 and binomtest(k, TRIALS_2007).pvalue < 0.05)
    return Pairwise(sd, interval, system, rates, least)
