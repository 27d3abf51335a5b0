"""Young's modulus of the touched specimen, sample by sample, from S_d and force: one reading instead of many."""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from papilla import checks
from papilla.calibration import Calibration, SoftnessStatus
from papilla.errors import InputError
from papilla.estimators.health import STUCK_SAMPLES
from papilla.estimators.softness.doubts import Doubts
from papilla.estimators.softness.filter_state import FilterState, NoiseFit
from papilla.estimators.softness.fitter import Fitter
from papilla.estimators.softness.surfaces import SdSurface
from papilla.estimators.softness.touch import Touch
from papilla.estimators.spread import completed
from papilla.logs.quantities import SAMPLE_RATE_HZ

NOISE_REACH = 4.0
"""Number of sigmas by which a measured force may lie outside the domain, if S_d shows that it is inside."""


class SoftnessEstimate(NamedTuple):
    """modulus_MPa, modulus_sigma_MPa (NaN where there is no answer) and status: the value of a `SoftnessStatus`.

    NOT_IDENTIFIABLE may come with a modulus: its sigma is then more than half of it. Of a block, arrays (n,).
    """

    modulus_MPa: float | np.ndarray = math.nan
    modulus_sigma_MPa: float | np.ndarray = math.nan
    status: int | np.ndarray = int(SoftnessStatus.NO_CONTACT)

    @property
    def sentence(self) -> Any:
        """The status in words: a string, or a list of them."""
        return SoftnessStatus.in_words(self.status)


class Softness(Touch):
    """Online estimate of the modulus; one sample is (g1, ..., gg, force_N), readings in microstrain.

    Parameters
    ----------
    calibration : of the same gauges in the same order.
    gauge_sigma : standard deviation of a gauge's noise, microstrain, > 0.
    force_sigma_N : standard deviation of the force's noise, N.
    doubts : all other uncertain quantities; the modulus' sigma contains them.
    memory_s : time constant of forgetting; inf remembers until contact is lost.
    sample_rate_Hz : sampling rate; only used with a finite memory.
    contact_force_N : with force and readings below it there is no contact, and the touch is forgotten.
    saturation : |reading| in microstrain from which a gauge is saturated.
    stuck_samples : a gauge that repeats its reading this often while another moves is stuck.

    Raises `InputError` for unusable values, and for a calibration whose S_d rises with the modulus nowhere.
    """

    answer = SoftnessEstimate

    def __init__(
        self,
        calibration: Calibration,
        *,
        gauge_sigma: float,
        force_sigma_N: float,
        doubts: Doubts | None = None,
        memory_s: float = math.inf,
        sample_rate_Hz: float = SAMPLE_RATE_HZ,
        contact_force_N: float = 0.02,
        saturation: float = math.inf,
        stuck_samples: int = STUCK_SAMPLES,
    ):
        gauges = len(calibration.gauges)
        self._reading_sigma = checks.positive("gauge_sigma (microstrain)", gauge_sigma) / math.sqrt(gauges)
        self._slack = NOISE_REACH * checks.within("force_sigma_N", force_sigma_N, 0, math.inf)
        if not memory_s > 0:
            raise InputError(f"memory_s must be greater than 0, got {memory_s}")
        self._keep = math.exp(-1 / (memory_s * checks.positive("sample_rate_Hz", sample_rate_Hz)))
        known = doubts or Doubts()
        known = replace(known, zero_microstrain=known.zero_microstrain / math.sqrt(gauges))
        self._surface = SdSurface(calibration)
        fitter = Fitter(self._surface, self._reading_sigma, force_sigma_N, known, None)
        super().__init__(fitter, gauges, contact_force_N, saturation, stuck_samples)

    def feel(self, readings: tuple[float, ...], force: float, found: tuple[int, ...]) -> SoftnessEstimate:
        """The estimate after one more sample; found : its gauges' faults, as `GaugeHealth.check` finds them."""
        if force - force != 0.0:
            return SoftnessEstimate(status=int(SoftnessStatus.BAD_INPUT))
        *moved, force_N = self._moved((*readings, force))
        sd = math.nan if found else self._sd(moved)
        if not self._in_contact(np.array((sd, force_N)), self._all[: 0 if found else 1], (*readings, force), not found):
            return SoftnessEstimate(status=int(SoftnessStatus.NO_CONTACT))
        low, high = self._surface.force_N
        if not low - self._slack <= force_N <= high + self._slack:
            side = SoftnessStatus.FORCE_BELOW if force_N < low else SoftnessStatus.FORCE_ABOVE
            return SoftnessEstimate(status=int(side))
        if found:
            return SoftnessEstimate(status=int(SoftnessStatus.BAD_GAUGE))
        if sd > 0:
            # Noise adds to a standard deviation.
            sd -= 0.5 * (self._gauges - 2) * self._reading_sigma**2 / sd
        return self._gather(np.array((sd, force_N)), ())

    def _begin(self, y: np.ndarray, faults: tuple[int, ...]) -> SoftnessEstimate:
        state = completed(self._start(y, self._all, self._unknown()))[1]
        return self._follow(y, faults, state, self._fitter.noise_fit(y, self._all, state))

    def _follow(self, y: np.ndarray, faults: tuple[int, ...], state: FilterState, fit: NoiseFit) -> SoftnessEstimate:
        fitter = self._fitter
        if outside := self._outside(fit):
            return SoftnessEstimate(status=int(outside))
        softest, hardest = self._surface.usable(fit.ln_force)
        if not softest <= fitter.ln_modulus(fitter.h_of_noise(state))[0] <= hardest:
            return SoftnessEstimate(status=int(SoftnessStatus.NOT_IDENTIFIABLE))
        self._learnt(y, self._all, state, fit, keep=self._keep)
        return self._answer(fit.ln_force, fit.place_mm, faults)

    def _answer(self, ln_force: float, place: float, faults: tuple[int, ...]) -> SoftnessEstimate:
        return SoftnessEstimate(*self._modulus()[:3])

    def _sd(self, moved: list[float]) -> float:
        """S_d of the readings minus their zeros, without numpy, which takes several times as long for so few values."""
        mean = sum(moved) / self._gauges
        return math.sqrt(sum([(value - mean) ** 2 for value in moved]) / self._gauges)
